/** The planes of the settings: one that cuts away, and one that is looked at. Each has a place of its own along the axis. */

import { $, input, text } from "./dom.js";
import { precise } from "./format.js";
import { demo, volume } from "./page.js";
import { isSection, MIDDLE, store } from "./state.js";

const own = () => (isSection(store.state) ? "section" : "cut");

/** The axis of the planes, and where the model begins and ends along it. */
export function span() {
  const { bounds } = volume();
  const axis = Number(store.state.axis);
  return { axis, low: bounds[axis], high: bounds[axis + 3] };
}

/** The coordinate of the view's plane along its axis. */
export function placeOfPlane() {
  const { low, high } = span();
  const place = store.state.places[own()];
  // Exactly the end, there.
  return place === 1000 ? high : low + ((high - low) * place) / 1000;
}

/** The plane of the seeds. */
export const seedPlane = () => ({ axis: span().axis, at: placeOfPlane() });

/** The plane of the view; as a clip plane it cuts away the side that the normal points to. @returns {import("tetralod/viewer").PlaneState} */
export function plane() {
  const { axis } = span();
  const sign = store.state.flip ? -1 : 1;
  const along = (/** @type {number} */ one) => (one === axis ? sign : 0);
  return { normal: [along(0), along(1), along(2)], offset: sign * placeOfPlane() };
}

/** Whether the clip plane leaves nothing. */
export const cutsAll = () => !isSection(store.state) && store.state.places.cut === (store.state.flip ? 1000 : 0);

/** Moves the view's plane. */
export const movePlane = (place = MIDDLE) => store.change({ places: { ...store.state.places, [own()]: place } });

/** Shows where the plane is. */
function showPlane() {
  const isLookedAt = isSection(store.state);
  // Slices and seeds have no side.
  const side = input("flip").parentElement;
  if (side) side.hidden = isLookedAt;
  $("cut-label").textContent = isLookedAt ? "Plane" : "Clip plane";
  input("cut").value = String(store.state.places[own()]);
  if (!demo.info) return;
  const { axis, low, high } = span();
  const at = placeOfPlane();
  const where = Math.abs(at) < (high - low) * 1e-4 ? 0 : precise(at, high - low, 3);
  text("cut", isLookedAt ? `${"xyz"[axis]} = ${where}` : `Hide ${"xyz"[axis]} ${store.state.flip ? "<" : ">"} ${where}`);
}

export function attachPlanes() {
  input("cut").addEventListener("input", () => movePlane(input("cut").valueAsNumber));
  // What is not cut stays whole.
  input("flip").addEventListener("input", () => store.state.places.cut % 1000 === 0 && movePlane(1000 - store.state.places.cut));
  store.subscribe(["view", "places", "axis", "flip"], showPlane);
}
