/** The planes of the settings: one that cuts away, and one that is looked at. Each has a place of its own along the axis. */

import { $ } from "./dom.js";
import { demo } from "./page.js";
import { mode } from "./parts.js";

/** Places are in thousandths of the model's length. */
const MIDDLE = 500;

/** @type {Record<"cut" | "section", number>} */
const places = { cut: MIDDLE, section: MIDDLE };

/** Whether the plane of the view is one to look at, and cuts nothing away. */
export const isSection = () => mode() === "slice" || mode() === "flow";

const own = () => (isSection() ? "section" : "cut");
const other = () => (isSection() ? "cut" : "section");

/** The axis of the planes, and where the model begins and ends along it. */
export function span() {
  const axis = Number($("axis").value);
  return { axis, low: demo.info.bounds[axis], high: demo.info.bounds[axis + 3] };
}

/** The coordinate of the view's plane along its axis. */
export function placeOfPlane() {
  const { low, high } = span();
  // Exactly the end, there.
  return places[own()] === 1000 ? high : low + ((high - low) * places[own()]) / 1000;
}

/** The plane of the seeds. */
export const seedPlane = () => ({ axis: span().axis, at: placeOfPlane() });

/** The plane of the view; as a clip plane it cuts away the side that the normal points to. @returns {{ normal: [number, number, number], offset: number }} */
export function plane() {
  const { axis } = span();
  const sign = $("flip").checked ? -1 : 1;
  const along = (one) => (one === axis ? sign : 0);
  return { normal: [along(0), along(1), along(2)], offset: sign * placeOfPlane() };
}

/** Whether the clip plane leaves nothing. */
export const cutsAll = () => !isSection() && places.cut === ($("flip").checked ? 1000 : 0);

/** Shows the place of the view's plane. */
export const showPlace = () => ($("cut").value = places[own()]);

/** The slider was moved. */
export const takePlace = () => (places[own()] = Number($("cut").value));

/** Moves the view's plane to the middle. */
export function moveToMiddle() {
  places[own()] = MIDDLE;
  showPlace();
}

const placeWords = (kind) => ({
  get: () => (places[kind()] === MIDDLE ? "" : String(places[kind()])),
  set: (words) => (places[kind()] = words && words >= 0 && words <= 1000 ? Number(words) : MIDDLE),
});

/** The places as words of the address: that of the view's plane, and of the other one. */
export const words = { cut: placeWords(own), "other-cut": placeWords(other) };
