/** Files made of what is shown: the picture, the mesh, surfaces, probes. */

import { absolute } from "tetralod/viewer";
import { compose, joined } from "./compose.js";
import { isDeformed, saved } from "./deform.js";
import { $, all, button, element, input, select } from "./dom.js";
import { isovalue, shownField } from "./fields.js";
import { count } from "./format.js";
import { showIdle } from "./idle.js";
import { nameWithUnit } from "./lengths.js";
import { fail, note } from "./messages.js";
import { hasTimes, plotOf, valuesOverTime } from "./overtime.js";
import { demo, page, viewer } from "./page.js";
import { alongAlways, alongNow, legsOf, lengthOf, NAMES as PROBES } from "./path.js";
import { nameOf as nameOfPlane, placeOfPlane, plane, span } from "./planes.js";
import { draw } from "./scene.js";
import { volumeName } from "./source.js";
import { store } from "./state.js";
import { onTab } from "./tabs.js";
import { coloursOf, csv, glb, ply, stl, vtk, vtu } from "./writers.js";

/** @param {string} name @param {BlobPart[]} parts @param {string} type */
export function saveAs(name, parts, type) {
  const link = element("a", { href: URL.createObjectURL(new Blob(parts, { type })), download: name });
  link.click();
  // Once the browser has begun to save it.
  setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
}

/** The triangles that are chosen. @returns {Promise<import("tetralod").Surface & { normals?: Float32Array }>} */
async function triangles(how = {}) {
  const kind = select("surface-kind").value;
  if (kind === "isosurface") return viewer().isosurface(isovalue(), how);
  const { normal, offset } = plane();
  return kind === "slice" ? viewer().slice(normal, offset, how) : viewer().surface(how);
}

/** How long the colours of the field are waited for (in ms). */
const PATIENCE = 5000;

/** The colours of the field that is shown; nothing where they cannot be had. @returns {Promise<import("tetralod/viewer").Legend | undefined>} */
async function legend() {
  const { name } = shownField();
  if (viewer().legend?.label === name) return viewer().legend;
  /** @type {Promise<import("tetralod/viewer").Legend | undefined>} */
  const heard = new Promise((resolve) => {
    viewer().addEventListener("legend", ({ detail }) => resolve(detail), { once: true });
    setTimeout(resolve, PATIENCE);
  });
  // A section outside of the model brings the colours of the field into the picture, and nothing else.
  const { high, low } = span();
  const outside = { ...plane(), offset: Math.max(Math.abs(high), Math.abs(low)) * 2 + (high - low) };
  await viewer().set({ slices: [...(viewer().state.slices ?? []), outside] });
  const found = await heard;
  draw();
  return found?.label === name ? found : undefined;
}

/** The triangles that are chosen, with the colours that their values have. */
async function coloured() {
  const [surface, colours] = [await drawn(), await legend()];
  return colours ? { ...surface, colours: coloursOf(absolute(surface).values, colours) } : surface;
}

/** The triangles that are chosen, where they are drawn. @returns {ReturnType<typeof triangles>} */
async function drawn() {
  if (!isDeformed()) return triangles();
  const { normals, fields, ...surface } = await triangles(ALL);
  const { positions } = saved({ ...surface, fields });
  // As it came: relative to its origin, with values as they are stored.
  return { ...surface, fields: [], positions: Float32Array.from(positions, (x, i) => x - surface.origin[i % 3]) };
}

/** The values at the probes, and on the way between them. */
async function probes() {
  const { pins } = page.probes;
  if (pins.length === 0) return undefined;
  const { name } = shownField();
  const names = Object.keys(pins[0].values);
  const now = hasTimes() ? [shownField().time] : [];
  const head = ["what", ...["x", "y", "z", "distance"].map((word) => nameWithUnit(word)), ...(hasTimes() ? ["time"] : []), ...names];
  const legs = legsOf(pins.map(({ position }) => position));
  /** @param {string} what @param {{ position: number[], distance: number }} place @param {Record<string, number | undefined>} values @param {(number | undefined)[]} time @returns {(string | number | undefined)[]} */
  const row = (what, { position, distance }, values, time = now) => [what, ...position, distance, ...time, ...names.map((name) => values[name])];
  // What is plotted over time is there at each of these times.
  /** @param {string} what @param {{ position: number[], distance: number }} place @param {readonly number[]} all */
  const overTime = (what, place, all) => valuesOverTime(name, all).map(({ time, value }) => row(`${what} over time`, place, { [name]: value }, [time]));
  const places = pins.map((pin, i) => ({ ...pin, what: `probe ${PROBES[i]}`, distance: lengthOf(legs.slice(0, i)) }));
  const kind = plotOf(pins.length);
  return csv([
    head,
    ...places.map((place) => row(place.what, place, place.values)),
    ...(kind === "1" ? places.flatMap((place) => overTime(place.what, place, place.all)) : []),
    ...(await alongNow(legs)).map((place) => row("line", place, { [name]: place.value })),
    ...(kind === "line" ? await alongAlways(legs) : []).flatMap((place) => (place.value ? overTime("line", place, place.value) : [])),
  ]);
}

/** What is asked for of files that hold all fields. */
const ALL = { fields: true };

/** How each file is made. @type {Record<string, () => Promise<[parts: BlobPart[] | undefined, type: string]>>} */
const MAKERS = {
  vtu: async () => [vtu(absolute(saved(await viewer().mesh(ALL))), shownField().number), "application/xml"],
  vtk: async () => [vtk(absolute(saved(await viewer().mesh(ALL))), shownField().number), "application/octet-stream"],
  stl: async () => [stl(await drawn()), "model/stl"],
  ply: async () => [ply(absolute(saved(await triangles(ALL)))), "application/octet-stream"],
  glb: async () => [glb(await coloured()), "model/gltf-binary"],
  csv: async () => [await probes(), "text/csv"],
};

/** What surfaces that are saved are called. @type {Record<string, () => string>} */
const SURFACES = {
  isosurface: () => `isosurface-${isovalue()}`,
  slice: () => `section-${nameOfPlane()}-${Number(placeOfPlane().toPrecision(6))}`,
  boundary: () => "boundary",
};
const surfaceName = () => SURFACES[select("surface-kind").value]();
/** What comes behind the name of the volume in that of a file. @type {Record<string, () => string>} */
const NAMES = { stl: surfaceName, ply: surfaceName, glb: surfaceName, csv: () => "probes" };

/** The name of a file that is made of the volume. @param {string | undefined} words @param {string} ending */
export const fileName = (words, ending) => `${[volumeName(), ...(words ? [words] : [])].join("-").replaceAll(/[\\/:*?"<>|]/g, "_")}.${ending}`;

async function exportAs(/** @type {string} */ kind) {
  if (!demo.info) return;
  const [parts, type] = await MAKERS[kind]();
  if (!parts) return note("There is no probe: click on the picture first");
  saveAs(fileName(NAMES[kind]?.(), kind), parts, type);
}

/** The size that is chosen for pictures. @param {HTMLCanvasElement} canvas */
export function pictureSize(canvas) {
  const factor = Number(select("shot-scale").value) * devicePixelRatio;
  const [width, height] = [canvas.clientWidth, canvas.clientHeight].map((length) => Math.round(length * factor));
  return { width, height };
}

/** The picture of a viewer, with what lies over it if that is wanted. @param {import("tetralod/viewer").Viewer} from @param {HTMLCanvasElement} canvas */
async function pictureOf(from, canvas) {
  const size = pictureSize(canvas);
  const picture = await from.screenshot(size);
  return input("shot-overlay").checked ? compose(picture, { ...size, canvas }) : picture;
}

async function savePicture(/** @type {HTMLCanvasElement} */ canvas) {
  const { width, height } = pictureSize(canvas);
  const picture = await pictureOf(viewer(), canvas);
  const other = store.state.met && !store.state.subtracted ? demo.beside?.viewer : undefined;
  const all = other ? await joined(picture, await pictureOf(other, $("canvas-beside", HTMLCanvasElement))) : picture;
  saveAs(fileName(`${other ? 2 * width : width}x${height}`, "png"), [all], "image/png");
}

/** Runs what a button is for, which may take a while. @param {HTMLButtonElement} button @param {() => Promise<unknown>} act */
function onPress(button, act) {
  button.addEventListener("click", async () => {
    button.disabled = true;
    await act().catch(fail);
    button.disabled = false;
    showIdle();
  });
}

/** @param {HTMLCanvasElement} canvas */
export function attachExport(canvas) {
  onPress(button("shot"), () => savePicture(canvas));
  for (const button of /** @type {HTMLButtonElement[]} */ (all("[data-export]"))) onPress(button, () => exportAs(button.dataset.export ?? ""));
  onTab((name) => {
    if (name !== "export" || !demo.step) return;
    $("mesh-words").textContent = `The mesh as it is shown: ${count(demo.step.tetrahedra)} tetrahedra with all fields`;
  });
}
