/** What is said, and can be done, where the picture shows nothing. */

import { FIRST, pointsOf } from "./curve.js";
import { $ } from "./dom.js";
import { isovalue, isovaluePart, shownField } from "./fields.js";
import { rounded } from "./format.js";
import { demo, volume } from "./page.js";
import { beside, mode } from "./parts.js";
import { cutsAll, movePlane, placeOfPlane, span } from "./planes.js";
import { cutBox } from "./region.js";
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

/** Why a view whose surface has no triangle shows none. @type {Record<string, () => Reason>} */
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
  const { axis, low, high } = span();
  const box = cutBox();
  const [at, from, to] = [placeOfPlane(), low, high].map((x) => rounded(x, high - low));
  if (box && !meetsModel(box)) return { words: "Everything is cut away: nothing of the model is in the box of the region.", ...whole };
  if (box && mode() === "slice" && (placeOfPlane() < box[axis] || placeOfPlane() > box[axis + 3])) {
    return { words: `There is no section: the plane ${"xyz"[axis]} = ${at} is outside of the box of the region.`, ...whole };
  }
  if (["solid", "mesh"].includes(mode()) && cutsAll()) {
    return { words: `Everything is cut away: the model lies between ${"xyz"[axis]} = ${from} and ${to}.`, ...middleOfPlane };
  }
  if (mode() === "volume" && pointsOf(store.state.transfer, isovaluePart()).every(([, opacity]) => opacity === 0)) {
    return { words: "The volume is transparent: no value has an opacity.", label: "Use the ramp", act: () => store.change({ transfer: FIRST }) };
  }
  return undefined;
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
  reason = isSettled && beside().length === 0 ? (cutAway() ?? (frameIsEmpty ? MISSED[mode()]?.() : undefined)) : undefined;
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
