/** The settings of the flow: streamlines and arrows of a vector field, and where streamlines start. */

import { $, text } from "./dom.js";
import { page, volume } from "./page.js";
import { seedPlane } from "./planes.js";
import { store } from "./state.js";
import { vectors } from "./volume.js";

/** Seeds have so many digits: as many as links keep. */
const DIGITS = 12;

/** @typedef {import("./volume.js").Point} Point */

/** Whether the colours are those of the field that is shown. */
export const flowIsByField = () => store.state["flow-colour"] === "field";

const components = () => vectors().get(store.state.vector);

/** The unit of the vector. */
export const flowUnit = () => volume().fields.find(({ name }) => name === components()?.[0])?.unit ?? "";

/** A click at a point of the canvas: one more seed on the plane; whether there is one. @param {[number, number]} point */
export function addSeed(point) {
  const { axis, at } = seedPlane();
  const found = page.overlay.onPlane(point, axis, at);
  if (!found) return false;
  const [x, y, z] = found.map((one) => Number(one.toPrecision(DIGITS)));
  store.change({ seeds: [...store.state.seeds, [x, y, z]] });
  return true;
}

/** The plane of the seeds, with those that were clicked, for the overlay. */
export const seedQuad = () => ({ ...seedPlane(), bounds: volume().bounds, seeds: store.state.seeds });

/** What is drawn. @returns {import("tetralod/viewer").SceneState} */
export function flowScene() {
  const fields = components();
  if (!fields) return {};
  const by = flowIsByField() ? { field: store.state.field } : {};
  return {
    streamlines: { fields, seeds: [...rake(), ...store.state.seeds], ...by },
    ...(store.state.arrows ? { arrows: { fields, ...by } } : {}),
  };
}

/** Seeds in a square grid across the volume, on the plane of the seeds. @returns {Point[]} */
function rake() {
  const { bounds } = volume();
  const { axis, at } = seedPlane();
  const [first, second] = [(axis + 1) % 3, (axis + 2) % 3];
  const between = (/** @type {number} */ i, /** @type {number} */ part) => bounds[i] + part * (bounds[i + 3] - bounds[i]);
  // The middles of equal parts: none lies on the boundary.
  const parts = Array.from({ length: store.state.rake }, (_, i) => (i + 0.5) / store.state.rake);
  return parts.flatMap((one) =>
    parts.map((other) => {
      /** @type {Point} */
      const seed = [0, 0, 0];
      [seed[axis], seed[first], seed[second]] = [at, between(first, one), between(second, other)];
      return seed;
    }),
  );
}

export function attachFlow() {
  $("no-seeds").addEventListener("click", () => store.change({ seeds: [] }));
  store.subscribe(["rake", "seeds"], () => {
    const { rake, seeds } = store.state;
    text("rake", rake === 0 ? "none" : `${rake} × ${rake}`);
    $("no-seeds").hidden = seeds.length === 0;
  });
}
