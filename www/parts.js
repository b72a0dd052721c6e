/**
 * What a picture is made of: surface, volume, slice, boundary, mesh, flow. The view that is chosen is one of these, and what the
 * settings are of; others are shown beside it, each with the look that it has in its own view.
 */

import { $, all, checked } from "./dom.js";

/** @typedef {"iso" | "volume" | "slice" | "solid" | "mesh" | "flow"} Mode */

/** Parts that have an opacity, in the order that links have. */
const SHEER = ["iso", "volume", "slice", "solid"];
/** Parts whose edges can be drawn, and whether they are drawn first. */
const EDGES = { iso: false, slice: true, solid: true, mesh: true };
/** Boxes that mean the same part of the scene: only one of them can be chosen. */
const ONE_OF = ["wires", "points"];

/** The opacity of each part, in percent. @type {Record<string, number>} */
const opacities = Object.fromEntries(SHEER.map((name) => [name, 100]));
/** @type {Record<string, boolean>} */
const edges = { ...EDGES };
/** The view that was chosen before. @type {Mode} */
let before = "iso";

/** The view: what the settings are of. @returns {Mode} */
export const mode = () => /** @type {Mode} */ (checked("mode"));

const boxes = () => all("[name=also]");

/** What is shown beside the view. @returns {string[]} */
export const beside = () => boxes().filter((box) => box.checked && !isOfView(box.value)).map(({ value }) => value);

/** Whether the picture has a part, as the view or beside it. @param {string} name */
export const shows = (name) => mode() === name || beside().includes(name);

/** Whether a box is of what the view shows anyway; the flow has a setting of its own for the boundary. */
function isOfView(name) {
  const view = mode();
  return name === view || (view === "mesh" && ONE_OF.includes(name)) || (view === "flow" && name === "solid");
}

/** The opacity of a part, 0 to 1. @param {string} name */
export const opacityOf = (name) => opacities[name] / 100;
/** @param {string} name */
export const hasEdges = (name) => edges[name];

/** Shows the settings of the view, and the boxes of the others. */
export function showParts() {
  before = mode();
  for (const row of all("[data-mode]")) row.hidden = !row.dataset.mode.split(" ").includes(before);
  for (const box of boxes()) box.parentElement.hidden = isOfView(box.value);
  $("opacity").value = opacities[before] ?? 100;
  $("edges").checked = edges[before] ?? false;
}

/** Another view was chosen: if it was beside the one before, both stay. */
function turn() {
  const box = (name) => boxes().find(({ value }) => value === name);
  const names = { mesh: $("shape").value === "points" ? "points" : "wires" };
  const [to, from] = [mode(), before];
  const target = to === "mesh" ? ONE_OF.map(box).find(({ checked }) => checked) : box(to);
  if (!target?.checked) return;
  target.checked = false;
  if (to === "mesh") $("shape").value = target.value;
  box(names[from] ?? from).checked = true;
}

/** A box was checked. @param {HTMLInputElement} box */
function choose(box) {
  if (!box.checked || !ONE_OF.includes(box.value)) return;
  for (const other of boxes()) if (other !== box && ONE_OF.includes(other.value)) other.checked = false;
}

/** Adds a part of the picture, or takes it away, by its number in the row. @param {number} number */
export function toggle(number) {
  const box = boxes()[number - 1];
  if (box && !box.disabled && !box.parentElement.hidden) box.click();
}

/** The boxes, opacities and edges as words of the address; nothing for what there is first. */
export const words = {
  also: {
    get: () => String(beside()),
    set: (given) => {
      const names = given.split(",");
      for (const box of boxes()) box.checked = names.includes(box.value) && !box.disabled;
    },
  },
  /** One number is that of the view. */
  opacity: {
    get() {
      const others = SHEER.filter((name) => name !== mode());
      if (others.every((name) => opacities[name] === 100)) return opacities[mode()] === undefined || opacities[mode()] === 100 ? "" : String(opacities[mode()]);
      return String(SHEER.map((name) => opacities[name]));
    },
    set(given) {
      const numbers = given ? given.split(",").map(Number) : [];
      const held = (number) => (number >= 5 && number <= 100 ? number : 100);
      const one = (name) => (name === mode() ? numbers[0] : 100);
      SHEER.forEach((name, i) => (opacities[name] = held(numbers.length === SHEER.length ? numbers[i] : one(name))));
    },
  },
  /** The parts that are not as first. */
  edges: {
    get: () => String(Object.keys(EDGES).filter((name) => edges[name] !== EDGES[name])),
    set: (given) => {
      const others = given.split(",");
      for (const name of Object.keys(EDGES)) edges[name] = EDGES[name] !== others.includes(name);
    },
  },
};

/** @param {{ onView: () => void, onChange: () => void }} page */
export function attachParts({ onView, onChange }) {
  for (const radio of all("[name=mode]")) {
    radio.addEventListener("change", () => {
      turn();
      onView();
    });
  }
  for (const box of boxes()) {
    box.addEventListener("change", () => {
      choose(box);
      onChange();
    });
  }
  $("opacity").addEventListener("input", () => {
    opacities[mode()] = Number($("opacity").value);
    onChange();
  });
  $("edges").addEventListener("input", () => {
    edges[mode()] = $("edges").checked;
    onChange();
  });
  for (const id of ["shape", "shrink"]) $(id).addEventListener("input", onChange);
}
