/**
 * The planes of the settings: as clip planes each cuts away one of its sides, as sections they are looked at. Each has a place of its own
 * for both. The chosen one is what the settings are of, and its handle in the picture.
 */

import { $, button, input, select, text } from "./dom.js";
import { precise } from "./format.js";
import { centreOf, dot, each, outline, unit } from "./geometry.js";
import { demo, page, volume } from "./page.js";
import { FIRST, isAxis, isSection, MIDDLE, MOST_PLANES, store } from "./state.js";

/** @typedef {import("./state.js").Plane} Plane */
/** @typedef {import("./volume.js").Point} Point */

/** Normals that are not typed have so many digits behind the point. */
const DIGITS = 3;
const NORMAL = ["normal-x", "normal-y", "normal-z"];

const own = () => (isSection(store.state) ? "section" : "cut");

/** The plane that is chosen. */
export const chosen = () => store.state.planes[store.state.plane];

/** What the direction of a plane is called. @param {Plane} plane */
export const nameOf = ({ normal } = chosen()) => [..."xyz"].find((_, axis) => isAxis(normal, axis)) ?? "n";

/** Where the model, or a box, begins and ends along the normal of the chosen plane, or another one. @param {Plane} plane @param {ArrayLike<number>} bounds */
export function span({ normal } = chosen(), bounds = volume().bounds) {
  const along = unit(normal);
  const end = (/** @type {(...ends: number[]) => number} */ pick) => each((i) => pick(along[i] * bounds[i], along[i] * bounds[i + 3])).reduce((a, b) => a + b);
  return { normal: along, low: end(Math.min), high: end(Math.max) };
}

/** Where a plane is along its normal: its coordinate, where that is an axis. */
export function placeOfPlane(plane = chosen()) {
  const { low, high } = span(plane);
  const place = plane[own()];
  // Exactly the end, there.
  return place === 1000 ? high : Math.min(low + ((high - low) * place) / 1000, high);
}

/** The thousandths for a place along the normal, within the model. @param {Plane} plane @param {number} at */
export function thousandths(plane, at) {
  const { low, high } = span(plane);
  return Math.min(Math.max(Number(((1000 * (at - low)) / (high - low)).toFixed(9)), 0), 1000);
}

/** As the scene has it; as a clip plane it cuts away the side that this normal points to. @param {Plane} plane @returns {import("tetralod/viewer").PlaneState} */
function seen(plane) {
  const sign = plane.flip ? -1 : 1;
  const { normal } = span(plane);
  // There is no −0 in links and requests.
  return { normal: each((i) => sign * normal[i] + 0), offset: sign * placeOfPlane(plane) };
}

/** All planes, in their order. */
export const planes = () => store.state.planes.map(seen);
/** The chosen one. */
export const plane = () => seen(chosen());
/** The corners of the part of it that is in the model's box. */
export const corners = () => outline(span().normal, placeOfPlane(), volume().bounds);

/** Whether the chosen plane is a clip plane that cuts nothing away. */
export const cutsNothing = () => !isSection(store.state) && chosen().cut === (chosen().flip ? 0 : 1000);
/** The number of the clip plane that leaves nothing, or −1. */
export const cutsAll = () => store.state.planes.findIndex(({ cut, flip }) => cut === (flip ? 1000 : 0));

/** Whether no plane meets a box. @param {ArrayLike<number>} box */
export function missesAll(box) {
  return store.state.planes.every((plane) => {
    const { low, high } = span(plane, box);
    return placeOfPlane(plane) < low || placeOfPlane(plane) > high;
  });
}

/** Changes the chosen plane, or another one. @param {Partial<Plane>} values */
function changePlane(values, number = store.state.plane) {
  store.change({ planes: store.state.planes.map((plane, i) => (i === number ? { ...plane, ...values } : plane)), plane: number });
}

/** Moves the view's plane. */
export const movePlane = (place = MIDDLE, number = store.state.plane) => changePlane({ [own()]: place }, number);

/** A direction; along an axis, of length 1. @param {Point} normal @returns {Point} */
function tidy(normal) {
  const isAlone = normal.filter((x) => x !== 0).length === 1;
  return each((i) => (isAlone ? Math.sign(normal[i]) : normal[i]) + 0);
}

/** Turns the chosen plane, around a point where one is given. @param {Point} normal @param {Point} [around] */
function face(normal, around) {
  const turned = { ...chosen(), normal: tidy(normal) };
  changePlane({ ...turned, ...(around ? { [own()]: thousandths(turned, dot(unit(turned.normal), around)) } : {}) });
}

/** The same for a direction of the picture, which gets few digits. @param {Point} normal @param {Point} [around] */
export const turnPlane = (normal, around) =>
  face(
    each((i) => Number(normal[i].toFixed(DIGITS))),
    around,
  );

/** Lets the chosen plane face the eye: as a clip plane, it cuts away what is near. */
function faceEye() {
  const [, , towards] = page.overlay.rotation ?? [];
  if (towards) turnPlane(each((i) => (chosen().flip ? -towards[i] : towards[i])));
}

/** One more plane, across the first axis that has none. */
function add() {
  const { planes } = store.state;
  const free = [1, 0, 2].find((axis) => !planes.some(({ normal }) => isAxis(normal, axis)));
  // Where all axes have one, it is not in the place of another.
  const place = free === undefined ? { cut: 1000 - 100 * planes.length, section: 100 * planes.length } : {};
  const added = { ...FIRST.planes[0], normal: each((i) => Number(i === (free ?? 1))), ...place };
  store.change({ planes: [...planes, added], plane: planes.length });
}

/** The chosen plane goes, the one before it is chosen. */
function remove() {
  const { planes, plane } = store.state;
  store.change({ planes: planes.filter((_, i) => i !== plane), plane: Math.max(plane - 1, 0) });
}

/** Takes the position that was typed if the model is there. */
function positionWasTyped() {
  const { low, high } = span();
  const at = input("position").valueAsNumber;
  const [from, to] = [low, high].map((end) => precise(end, high - low, 6));
  const isThere = at >= Math.min(low, from) && at <= Math.max(high, to);
  input("position").setCustomValidity(isThere ? "" : `The model lies between ${from} and ${to}`);
  input("position").reportValidity();
  if (isThere) movePlane(thousandths(chosen(), at));
}

/** Takes the normal that was typed if it is a direction. @param {HTMLInputElement} typed */
function normalWasTyped(typed) {
  const normal = each((i) => input(NORMAL[i]).valueAsNumber);
  const isDirection = normal.every(Number.isFinite) && normal.some((x) => x !== 0);
  typed.setCustomValidity(isDirection ? "" : "One of the three numbers must not be 0");
  typed.reportValidity();
  if (isDirection) face(normal, centreOf(corners()));
}

/** Where a plane is along its normal, in so many digits. @param {Plane} plane @param {number} digits */
function placeIn(plane, digits) {
  const [at, { low, high }] = [placeOfPlane(plane), span(plane)];
  return Math.abs(at) < (high - low) * 10 ** (-digits - 1) ? 0 : precise(at, high - low, digits);
}

/** Where a plane is, or what it hides. @param {Plane} plane */
const wordsOf = (plane) => `${nameOf(plane)} ${isSection(store.state) ? "=" : plane.flip ? "<" : ">"} ${placeIn(plane, 3)}`;

/** Shows where the planes are. */
function showPlanes() {
  const { planes, plane: number } = store.state;
  const isLookedAt = isSection(store.state);
  const { normal, flip } = chosen();
  // Slices and seeds have no side.
  const side = input("flip").parentElement;
  if (side) side.hidden = isLookedAt;
  $("cut-label").textContent = isLookedAt ? "Plane" : "Clip plane";
  input("cut").value = String(chosen()[own()]);
  input("flip").checked = flip;
  const axis = "xyz".indexOf(nameOf());
  select("axis").value = axis < 0 ? "" : String(axis);
  button("add-plane").disabled = planes.length === MOST_PLANES;
  button("remove-plane").disabled = planes.length === 1;
  if (!demo.info) return;
  text("cut", `${isLookedAt ? "" : "Hide "}${wordsOf(chosen())}`);
  select("plane").replaceChildren(...planes.map((one, i) => new Option(`${i + 1}: ${wordsOf(one)}`, String(i))));
  select("plane").value = String(number);
  const values = { position: placeIn(chosen(), 6), ...Object.fromEntries(NORMAL.map((id, i) => [id, normal[i]])) };
  for (const [id, value] of Object.entries(values)) {
    input(id).setCustomValidity("");
    if (document.activeElement !== input(id)) input(id).value = String(value);
  }
}

export function attachPlanes() {
  input("cut").addEventListener("input", () => movePlane(input("cut").valueAsNumber));
  input("flip").addEventListener("input", () => {
    const { cut } = chosen();
    // What is not cut stays whole.
    changePlane({ flip: input("flip").checked, cut: cut % 1000 === 0 ? 1000 - cut : cut });
  });
  select("axis").addEventListener("input", () => {
    const { value } = select("axis");
    if (value === "view") faceEye();
    else changePlane({ normal: each((i) => Number(String(i) === value)) });
    // Where there is no view yet, nothing has changed.
    showPlanes();
  });
  select("plane").addEventListener("input", () => store.change({ plane: Number(select("plane").value) }));
  $("add-plane").addEventListener("click", add);
  $("remove-plane").addEventListener("click", remove);
  input("position").addEventListener("input", positionWasTyped);
  for (const id of NORMAL) input(id).addEventListener("input", () => normalWasTyped(input(id)));
  for (const id of ["position", ...NORMAL]) input(id).addEventListener("blur", showPlanes);
  store.subscribe(["view", "planes", "plane"], showPlanes);
}
