/** The region of the request: a box with handles, the sphere in it, or the side of the clip plane that is shown. */

import { diagonalOf, precise } from "./format.js";
import { $, all } from "./dom.js";
import { showEmpty } from "./empty.js";
import { fail } from "./messages.js";
import { page } from "./page.js";
import { refine } from "./request.js";
import { plane } from "./planes.js";

/** Numbers of the box have so many digits: as many as links keep. */
const DIGITS = 6;

/** What the request says of it. */
export function region() {
  const { box } = page;
  switch ($("region").value) {
    case "box":
      return { box };
    case "sphere":
      return { sphere: sphereIn(box) };
    case "cut":
      return { slab: plane() };
    default:
      return {};
  }
}

/** The largest sphere in a box, around its middle. */
export function sphereIn(box) {
  const center = [0, 1, 2].map((i) => (box[i] + box[i + 3]) / 2);
  const radius = Math.min(...[0, 1, 2].map((i) => box[i + 3] - box[i])) / 2;
  return { center, radius };
}

/** Whether the region is a box, or the sphere in it. */
const hasBox = () => ["box", "sphere"].includes($("region").value);

/** The box outside of which everything is cut away; nothing without one. */
export const cutBox = () => (hasBox() && $("inside").checked ? page.box : undefined);

/** Shows the region that is chosen. */
export function applyRegion() {
  const on = hasBox();
  $("box").hidden = !on;
  $("inside-row").hidden = !on;
  showNumbers();
  showSphere();
  setBoxes({ region: on ? page.box : null });
}

/** Draws with the box that cuts, and more of the scene. @param {any} [more] */
function setBoxes(more = {}) {
  page.viewer.set({ ...more, clipBox: /** @type {any} */ (cutBox() ?? null) }).catch(fail);
  showEmpty();
}

/** Refines in this box. */
export function useBox(wanted) {
  page.box = rounded(wanted);
  $("region").value = "box";
  applyRegion();
  refine();
}

/** A handle in the picture was dragged. */
export function boxWasDragged(moved) {
  page.box = rounded(moved);
  showNumbers();
  showSphere();
  setBoxes();
  refine();
}

/** The middle half of a box. */
export function inner(bounds) {
  return rounded(bounds.map((value, i) => value + (bounds[(i + 3) % 6] - value) / 4));
}

const rounded = (numbers, digits = DIGITS) => Array.from(numbers, (x) => precise(x, diagonalOf(page.viewer.info?.bounds ?? [0, 0, 0, 1, 1, 1]), digits));

/** The box has handles that the viewer draws; the sphere in it is drawn over the picture. */
function showSphere() {
  page.overlay.sphere = $("region").value === "sphere" ? sphereIn(page.box) : undefined;
}

function showNumbers() {
  for (const input of all("#box input")) {
    if (document.activeElement !== input) [input.value] = rounded([page.box[input.dataset.i]], 5).map(String);
  }
}

/** Takes the number that was typed if the box stays valid. */
function boxWasTyped(input) {
  const typed = page.box.slice();
  typed[input.dataset.i] = input.valueAsNumber;
  const valid = [0, 1, 2].every((i) => typed[i] <= typed[i + 3]);
  input.setCustomValidity(valid ? "" : "“min” must not be larger than “max”");
  input.reportValidity();
  if (!valid) return;
  page.box = rounded(typed);
  applyRegion();
  refine();
}

export function attachRegion() {
  $("region").addEventListener("input", () => {
    if (!page.box) return;
    applyRegion();
    refine();
  });
  $("inside").addEventListener("input", () => page.box && applyRegion());
  for (const input of all("#box input")) {
    input.addEventListener("input", () => boxWasTyped(input));
    input.addEventListener("blur", showNumbers);
  }
}
