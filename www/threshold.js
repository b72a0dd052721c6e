/** What is shown by the values of the field: cells whose values are all within a range, or what is left of all cells that are cut at its ends. */

import { $, input } from "./dom.js";
import { shownField } from "./fields.js";
import { precise } from "./format.js";
import { demo } from "./page.js";
import { store } from "./state.js";

const ENDS = /** @type {const} */ (["threshold-low", "threshold-high"]);

/** What the scene says of it. @returns {import("tetralod/viewer").ThresholdState | null} */
export function threshold() {
  const { threshold: range, field, "threshold-cut": cut } = store.state;
  // Nothing can be cut between two labels.
  return range ? { field, range, ...(cut && !shownField().isLabel ? { cut } : {}) } : null;
}

/** Cuts cells at the ends of the range, or shows whole ones; turns the threshold on if it is off. */
export function toggleCut() {
  if (!demo.info) return;
  if (!store.state.threshold) toggle();
  store.change({ "threshold-cut": !store.state["threshold-cut"] });
}

/** Turns it on for the upper half of the values, or off. */
function toggle() {
  const { min, max } = shownField();
  store.change({ threshold: store.state.threshold ? undefined : [precise(min + (max - min) / 2, max - min, 5), max] });
}

/** Takes a number that was typed if there is a range then. The other one is shown rounded, and stays. @param {0 | 1} end */
function typed(end) {
  const { threshold: before = [0, 0] } = store.state;
  const changed = input(ENDS[end]);
  /** @type {[low: number, high: number]} */
  const range = end === 0 ? [changed.valueAsNumber, before[1]] : [before[0], changed.valueAsNumber];
  const isRange = range[0] <= range[1];
  changed.setCustomValidity(isRange ? "" : "The second number must not be smaller than the first");
  changed.reportValidity();
  if (isRange) store.change({ threshold: range });
}

function show() {
  const range = store.state.threshold;
  input("thresholded").checked = range !== undefined;
  $("threshold").hidden = !range;
  if (!demo.info) return;
  const { min, max } = shownField();
  for (const [i, id] of ENDS.entries()) {
    input(id).setCustomValidity("");
    if (document.activeElement !== input(id)) input(id).value = range ? String(precise(range[i], max - min, 6)) : "";
  }
}

export function attachThreshold() {
  input("thresholded").addEventListener("change", toggle);
  for (const end of /** @type {const} */ ([0, 1])) input(ENDS[end]).addEventListener("input", () => typed(end));
  store.subscribe(["threshold", "field"], show);
}
