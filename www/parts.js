/**
 * What a picture is made of: surface, volume, slice, boundary, mesh, flow. The view that is chosen is one of these, and what the
 * settings are of; others are shown beside it, each with the look that it has in its own view.
 */

import { all, input, named, text } from "./dom.js";
import { store } from "./state.js";

/** @typedef {import("./state.js").Mode} Mode */

/** Boxes that mean the same part of the scene: only one of them can be chosen. */
const ONE_OF = ["wires", "points"];

/** The view: what the settings are of. */
export const mode = () => store.state.view;

const boxes = () => named("also");

/** What is shown beside the view. */
export const beside = () => store.state.also.filter((name) => !isOfView(name));

/** Whether the picture has a part, as the view or beside it. @param {string} name */
export const shows = (name) => mode() === name || beside().includes(name);

/** Whether a box is of what the view shows anyway; the flow has a setting of its own for the boundary. @param {string} name */
function isOfView(name) {
  const view = mode();
  return name === view || (view === "mesh" && ONE_OF.includes(name)) || (view === "flow" && name === "solid");
}

/** The opacity of a part, 0 to 1. @param {string} name */
export const opacityOf = (name) => store.state.opacities[name] / 100;
/** @param {string} name */
export const hasEdges = (name) => store.state.edges[name];

/** What is beside the view, in the order of the row. @param {(name: string) => boolean} isBeside */
const chosen = (isBeside) =>
  boxes()
    .map(({ value }) => value)
    .filter(isBeside);

/** Chooses another view: if it was beside the one before, both stay. @param {Mode} to */
export function turnTo(to) {
  const { view: from, also, shape } = store.state;
  const target = to === "mesh" ? ONE_OF.find((name) => also.includes(name)) : to;
  if (!target || !also.includes(target)) return store.change({ view: to });
  const left = from === "mesh" ? (shape === "points" ? "points" : "wires") : from;
  const isBeside = (/** @type {string} */ name) => name === left || (name !== target && also.includes(name));
  store.change({ view: to, also: chosen(isBeside), shape: to === "mesh" ? target.replace("wires", "wire") : shape });
}

/** Adds a part of the picture, or takes it away. @param {string} name */
function turn(name) {
  const { also } = store.state;
  const isAdded = !also.includes(name);
  const givesWay = (/** @type {string} */ other) => isAdded && ONE_OF.includes(name) && ONE_OF.includes(other);
  store.change({ also: chosen((other) => (other === name ? isAdded : also.includes(other) && !givesWay(other))) });
}

/** Adds a part of the picture, or takes it away, by its number in the row. @param {number} number */
export function toggle(number) {
  const box = boxes()[number - 1];
  if (box && !box.disabled && !box.parentElement?.hidden) turn(box.value);
}

/** Shows the settings of the view, and the boxes of the others. */
function showParts() {
  const { view, also, opacities, edges } = store.state;
  for (const row of all("[data-mode]")) row.hidden = !row.dataset.mode?.split(" ").includes(view);
  for (const radio of named("mode")) radio.checked = radio.value === view;
  for (const box of boxes()) {
    box.checked = also.includes(box.value);
    if (box.parentElement) box.parentElement.hidden = isOfView(box.value);
  }
  input("opacity").value = String(opacities[view] ?? 100);
  input("edges").checked = edges[view] ?? false;
  text("opacity", `${input("opacity").value} %`);
}

/** The looks of all parts with that of the view, if it has one. @template T @param {Record<string, T>} looks @param {T} own */
const withOwn = (looks, own) => (mode() in looks ? { ...looks, [mode()]: own } : looks);

export function attachParts() {
  for (const radio of named("mode")) radio.addEventListener("change", () => turnTo(/** @type {Mode} */ (radio.value)));
  for (const box of boxes()) box.addEventListener("change", () => turn(box.value));
  input("opacity").addEventListener("input", () => store.change({ opacities: withOwn(store.state.opacities, input("opacity").valueAsNumber) }));
  input("edges").addEventListener("input", () => store.change({ edges: withOwn(store.state.edges, input("edges").checked) }));
  store.subscribe(["view", "also", "opacities", "edges"], showParts);
}
