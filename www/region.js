/** The region of the request: a box with handles, the sphere in it, a part, or the clip planes. */

import { $, all } from "./dom.js";
import { diagonalOf, precise } from "./format.js";
import { fail } from "./messages.js";
import { demo, page, viewer } from "./page.js";
import { planes } from "./planes.js";
import { namesIn } from "./regions.js";
import { store } from "./state.js";
import { AXES, boxOf } from "./volume.js";

/** @typedef {import("./volume.js").Box} Box */

/** What the request says of it: one or several, all of which are refined. @returns {Partial<Pick<import("tetralod/viewer").ViewerRefineOptions, "box" | "sphere" | "slab" | "regions">>[]} */
export function areas() {
  const { box } = store.state;
  switch (store.state.region) {
    case "box":
      return [{ box }];
    case "sphere":
      return [{ sphere: sphereIn(box) }];
    case "part":
      return [{ regions: namesIn(store.state.part) }];
    case "cut":
      return planes().map((slab) => ({ slab }));
    default:
      return [{}];
  }
}

/** The largest sphere in a box, around its middle. @param {Box} box */
function sphereIn(box) {
  const middle = (/** @type {number} */ i) => (box[i] + box[i + 3]) / 2;
  /** @type {import("./volume.js").Point} */
  const center = [middle(0), middle(1), middle(2)];
  return { center, radius: Math.min(...AXES.map((i) => box[i + 3] - box[i])) / 2 };
}

/** Whether the region is a box, or the sphere in it. */
const hasBox = () => ["box", "sphere"].includes(store.state.region);

/** The box with handles in the picture. */
export const boxWithHandles = () => (hasBox() ? store.state.box : undefined);

/** The box outside of which everything is cut away; nothing without one. */
export const cutBox = () => (hasBox() && store.state.inside ? store.state.box : undefined);

/** Refines in this box. @param {ArrayLike<number>} box */
export const useBox = (box) => store.change({ box: boxOf(box), region: "box" });

/** What the viewer has by itself, since its handle was dragged. @type {Box | undefined} */
let dragged;

/** A handle in the picture was dragged. @param {ArrayLike<number>} box */
export function boxWasDragged(box) {
  dragged = boxOf(box);
  store.change({ box: dragged });
}

/** Shows the region. The box has handles that the viewer draws; the sphere in it is drawn over the picture. */
function showRegion() {
  if (!demo.info) return;
  const { box } = store.state;
  const on = hasBox();
  $("box").hidden = !on;
  $("inside-row").hidden = !on;
  showNumbers();
  page.overlay.sphere = store.state.region === "sphere" ? sphereIn(box) : undefined;
  const handles = box === dragged ? {} : { region: on ? box : null };
  dragged = undefined;
  viewer()
    .set({ ...handles, clipBox: cutBox() ?? null })
    .catch(fail);
}

const inputs = () => /** @type {HTMLInputElement[]} */ (all("#box input"));
/** Which number of the box an input is of. @param {HTMLInputElement} input */
const numberOf = (input) => Number(input.dataset.i);

function showNumbers() {
  if (!demo.info) return;
  const length = diagonalOf(demo.info.bounds);
  for (const input of inputs()) {
    if (document.activeElement !== input) input.value = String(precise(store.state.box[numberOf(input)], length, 5));
  }
}

/** Takes the number that was typed if the box stays valid. @param {HTMLInputElement} input */
function boxWasTyped(input) {
  const typed = [...store.state.box];
  typed[numberOf(input)] = input.valueAsNumber;
  const valid = AXES.every((i) => typed[i] <= typed[i + 3]);
  input.setCustomValidity(valid ? "" : "“min” must not be larger than “max”");
  input.reportValidity();
  if (valid) store.change({ box: boxOf(typed) });
}

export function attachRegion() {
  for (const input of inputs()) {
    input.addEventListener("input", () => boxWasTyped(input));
    input.addEventListener("blur", showNumbers);
  }
  store.subscribe(["region", "inside", "box"], showRegion);
}
