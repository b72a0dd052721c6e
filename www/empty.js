/** What is said, and can be done, where the picture shows nothing. */

import { FIRST, pointsOf } from "./curve.js";
import { $ } from "./dom.js";
import { isovalue, isovaluePart, shownField } from "./fields.js";
import { rounded } from "./format.js";
import { leavesNothing } from "./geometry.js";
import { demo, volume } from "./page.js";
import { beside, mode } from "./parts.js";
import { cutsAll, missesAll, movePlane, nameOf, planes, span } from "./planes.js";
import { cutBox } from "./region.js";
import { shownRegions } from "./regions.js";
import { LOOKS } from "./scene.js";
import { store } from "./state.js";

/** @typedef {{ words: string, label: string, act: () => void }} Reason what is wrong, and what a button does about it */

/** Whether the last frame showed no triangle. */
let frameIsEmpty = false;

const middleOfPlane = { label: "Move the plane to the middle", act: () => movePlane() };

const whole = { label: "Show what is outside, too", act: () => store.change({ inside: false }) };

function useFirstIsovalue() {
  store.change({ isovalue: undefined });
  $("isovalue").focus();
}

/** Why a view whose surface has no triangle shows none. @type {Record<string, () => Reason | undefined>} */
const MISSED = {
  iso() {
    const { name, min, max } = shownField();
    const [value, low, high] = [isovalue(), min, max].map((x) => rounded(x, max - min));
    const isOutside = isovalue() < min || isovalue() > max;
    const words = isOutside ? `${value} is outside of the range of ${name}, ${low} to ${high}` : `${name} does not pass ${value} in this mesh`;
    return { words: `There is no surface: ${words}.`, label: "Use a value that it has", act: useFirstIsovalue };
  },
  slice: () => ({ words: `There is no section: the plane ${$("cut-text").textContent} does not pass through the mesh.`, ...middleOfPlane }),
  flow: () => ({ words: "There is no streamline: no seed is in the mesh where the field has a direction.", ...middleOfPlane }),
};

/** Why nothing is left of what is drawn. @returns {Reason | undefined} */
function cutAway() {
  const box = cutBox();
  if (shownRegions()?.length === 0) return { words: "All parts are hidden.", label: "Show all parts", act: () => store.change({ hidden: [] }) };
  if (box && !meetsModel(box)) return { words: "Everything is cut away: nothing of the model is in the box of the region.", ...whole };
  if (box && mode() === "slice" && missesAll(box)) {
    return { words: `There is no section: the plane ${$("cut-text").textContent} is outside of the box of the region.`, ...whole };
  }
  const isClipped = ["solid", "mesh"].includes(mode());
  const number = cutsAll();
  if (isClipped && number >= 0) {
    const plane = store.state.planes[number];
    const { low, high } = span(plane);
    const [from, to] = [low, high].map((x) => rounded(x, high - low));
    const words = `Everything is cut away: the model lies between ${nameOf(plane)} = ${from} and ${to}.`;
    return { words, label: middleOfPlane.label, act: () => movePlane(undefined, number) };
  }
  if (isClipped && leavesNothing(planes(), volume().bounds)) {
    const act = () => store.change({ planes: store.state.planes.slice(0, 1), plane: 0 });
    return { words: "Everything is cut away: together the planes leave nothing of the model.", label: "Keep the first plane alone", act };
  }
  if (mode() === "volume" && pointsOf(store.state.transfer, isovaluePart()).every(([, opacity]) => opacity === 0)) {
    return { words: "The volume is transparent: no value has an opacity.", label: "Use the ramp", act: () => store.change({ transfer: FIRST }) };
  }
  return undefined;
}

/** Why a threshold may leave nothing. @returns {Reason | undefined} */
function noCell() {
  const range = store.state.threshold;
  if (!range || mode() === "volume") return undefined;
  const { name, min, max } = shownField();
  const [low, high] = range.map((x) => rounded(x, max - min));
  const none = store.state["threshold-cut"] ? `No value of ${name} is` : `No cell has all values of ${name}`;
  return { words: `${none} from ${low} to ${high}.`, label: "Show all cells", act: () => store.change({ threshold: undefined }) };
}

/** Whether a box with a volume has a part in common with the model. @param {import("./volume.js").Box} box */
function meetsModel(box) {
  const { bounds } = volume();
  return [0, 1, 2].every((i) => box[i] < box[i + 3] && box[i] < bounds[i + 3] && box[i + 3] > bounds[i]);
}

/** Notes whether a frame shows an empty surface. @param {import("tetralod/viewer").ViewerFrame} frame */
export function noteEmpty({ ready, triangles }) {
  frameIsEmpty = ready && triangles === 0;
  showEmpty();
}

/** Another picture is on its way. */
function expectFrame() {
  frameIsEmpty = false;
  showEmpty();
}

/** @type {Reason | undefined} */
let reason;

/** Says so where nothing is seen and no step may yet change that: the last step may come before or after the last frame. */
export function showEmpty() {
  const isSettled = demo.step?.done === true && demo.info !== undefined;
  const missed = () => noCell() ?? MISSED[mode()]?.();
  reason = isSettled && beside().length === 0 ? (cutAway() ?? (frameIsEmpty ? missed() : undefined)) : undefined;
  $("empty").hidden = !reason;
  if (!reason) return;
  if ($("empty-text").textContent !== reason.words) $("empty-text").textContent = reason.words;
  $("empty-act").textContent = reason.label;
}

export function attachEmpty() {
  $("empty-act").addEventListener("click", () => reason?.act());
  store.subscribe(LOOKS, expectFrame);
  store.subscribe(["region", "inside", "box"], showEmpty);
}
