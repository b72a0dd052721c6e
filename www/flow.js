/** The settings of the flow: streamlines and arrows of a vector field, and where streamlines start. */

import { $, text } from "./dom.js";
import { page, volume } from "./page.js";
import { across, dot, plus } from "./geometry.js";
import { corners, placeOfPlane, span } from "./planes.js";
import { store } from "./state.js";
import { isInside, vectors } from "./volume.js";

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
  const found = page.overlay.onPlane(point, span().normal, placeOfPlane());
  if (!found || !isInside(found)) return false;
  const [x, y, z] = found.map((one) => Number(one.toPrecision(DIGITS)));
  store.change({ seeds: [...store.state.seeds, [x, y, z]] });
  return true;
}

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

/** Seeds in a grid across the chosen plane, in the volume. @returns {Point[]} */
function rake() {
  const { normal } = span();
  const ways = across(normal);
  const [first, second] = ways.map((way) => {
    const ends = corners().map((corner) => dot(corner, way));
    const [low, high] = [Math.min(...ends), Math.max(...ends)];
    // The middles of equal parts: none lies on the boundary.
    return Array.from({ length: store.state.rake }, (_, i) => low + ((i + 0.5) / store.state.rake) * (high - low));
  });
  const onAxis = plus([0, 0, 0], normal, placeOfPlane());
  return first.flatMap((one) => second.map((other) => plus(plus(onAxis, ways[0], one), ways[1], other))).filter(isInside);
}

export function attachFlow() {
  $("no-seeds").addEventListener("click", () => store.change({ seeds: [] }));
  store.subscribe(["rake", "seeds"], () => {
    const { rake, seeds } = store.state;
    text("rake", rake === 0 ? "none" : `${rake} × ${rake}`);
    $("no-seeds").hidden = seeds.length === 0;
  });
}
