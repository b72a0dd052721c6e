/** Files made of what is shown: the picture, the mesh, surfaces, probes. */

import { absolute } from "tetralod/viewer";
import { $, all } from "./dom.js";
import { count } from "./format.js";
import { fail } from "./messages.js";
import { demo, page } from "./page.js";
import { compose } from "./compose.js";
import { showIdle } from "./idle.js";
import { volumeName } from "./opening.js";
import { placeOfPlane, plane, span } from "./planes.js";
import { draw, isovalue } from "./scene.js";
import { note } from "./share.js";
import { onTab } from "./tabs.js";
import { coloursOf, csv, glb, ply, stl, vtk, vtu } from "./writers.js";

function saveAs(name, parts, type) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob(parts, { type }));
  link.download = name;
  link.click();
  // Once the browser has begun to save it.
  setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
}

/** The triangles that are chosen. @returns {Promise<import("tetralod").Surface & { normals?: Float32Array }>} */
async function triangles(how = {}) {
  const { viewer } = page;
  const kind = $("surface-kind").value;
  if (kind === "isosurface") return viewer.isosurface(isovalue(), how);
  const { normal, offset } = plane();
  return kind === "slice" ? viewer.slice(normal, offset, how) : viewer.surface(how);
}

/** How long the colours of the field are waited for (in ms). */
const PATIENCE = 5000;

/** The colours of the field that is shown; nothing where they cannot be had. @returns {Promise<import("tetralod/viewer").Legend | undefined>} */
async function legend() {
  const { viewer, field } = page;
  if (viewer.legend?.label === field.name) return viewer.legend;
  const heard = new Promise((resolve) => {
    viewer.addEventListener("legend", ({ detail }) => resolve(detail), { once: true });
    setTimeout(resolve, PATIENCE);
  });
  // A section outside of the model brings the colours of the field into the picture, and nothing else.
  const { high, low } = span();
  const outside = { ...plane(), offset: Math.max(Math.abs(high), Math.abs(low)) * 2 + (high - low) };
  await viewer.set({ slices: [...(viewer.state.slices ?? []), outside] });
  const found = /** @type {import("tetralod/viewer").Legend | undefined} */ (await heard);
  draw();
  return found?.label === field.name ? found : undefined;
}

/** The triangles that are chosen, with the colours that their values have. */
async function coloured() {
  const [surface, colours] = [await triangles(), await legend()];
  return colours ? { ...surface, colours: coloursOf(absolute(surface).values, colours) } : surface;
}

/** The values at the probes, and along the line between two of them. */
async function probes() {
  const { pins } = page.probes;
  if (pins.length === 0) return undefined;
  const names = Object.keys(pins[0].values);
  const head = ["what", "x", "y", "z", "distance", ...names];
  const row = (what, position, distance, values) => [what, ...position, distance, ...names.map((name) => values[name])];
  const distance = (to) => Math.hypot(...to.map((x, i) => x - pins[0].position[i]));
  const rows = pins.map(({ position, values }, i) => row(`probe ${"AB"[i]}`, position, distance(position), values));
  if (pins.length < 2) return csv([head, ...rows]);
  const [from, to] = pins.map(({ position }) => position);
  const { at, values } = await page.viewer.line(from, to);
  const onLine = Array.from(at, (part, i) => {
    const position = from.map((x, axis) => x + part * (to[axis] - x));
    return row("line", position, distance(position), { [page.field.name]: values[i] });
  });
  return csv([head, ...rows, ...onLine]);
}

/** What is asked for of files that hold all fields. */
const ALL = { fields: true };

/** How each file is made. @type {Record<string, () => Promise<[parts: BlobPart[] | undefined, type: string]>>} */
const MAKERS = {
  vtu: async () => [vtu(absolute(await page.viewer.mesh(ALL)), page.field.number), "application/xml"],
  vtk: async () => [vtk(absolute(await page.viewer.mesh(ALL)), page.field.number), "application/octet-stream"],
  stl: async () => [stl(await triangles()), "model/stl"],
  ply: async () => [ply(absolute(await triangles(ALL))), "application/octet-stream"],
  glb: async () => [glb(await coloured()), "model/gltf-binary"],
  csv: async () => [await probes(), "text/csv"],
};

/** What surfaces that are saved are called. @type {Record<string, () => string>} */
const SURFACES = {
  isosurface: () => `isosurface-${isovalue()}`,
  slice: () => `section-${"xyz"[span().axis]}-${Number(placeOfPlane().toPrecision(6))}`,
  boundary: () => "boundary",
};
const surfaceName = () => SURFACES[$("surface-kind").value]();
/** What comes behind the name of the volume in that of a file. @type {Record<string, () => string>} */
const NAMES = { stl: surfaceName, ply: surfaceName, glb: surfaceName, csv: () => "probes" };

/** The name of a file that is made of the volume. */
const fileName = (words, ending) => `${[volumeName(), ...(words ? [words] : [])].join("-").replaceAll(/[\\/:*?"<>|]/g, "_")}.${ending}`;

async function exportAs(kind) {
  if (!demo.info) return;
  const [parts, type] = await MAKERS[kind]();
  if (!parts) return note("There is no probe: click on the picture first");
  saveAs(fileName(NAMES[kind]?.(), kind), parts, type);
}

async function savePicture(canvas) {
  const factor = Number($("shot-scale").value) * devicePixelRatio;
  const [width, height] = [canvas.clientWidth, canvas.clientHeight].map((length) => Math.round(length * factor));
  const picture = await page.viewer.screenshot({ width, height });
  const all = $("shot-overlay").checked ? await compose(picture, { width, height, canvas }) : picture;
  saveAs(fileName(`${width}x${height}`, "png"), [all], "image/png");
}

/** Runs what a button is for, which may take a while. */
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
  onPress($("shot"), () => savePicture(canvas));
  for (const button of all("[data-export]")) onPress(button, () => exportAs(button.dataset.export));
  onTab((name) => {
    if (name !== "export" || !demo.step) return;
    $("mesh-words").textContent = `The mesh as it is shown: ${count(demo.step.tetrahedra)} tetrahedra with all fields`;
  });
}
