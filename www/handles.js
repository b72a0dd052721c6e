/**
 * The handle of the chosen plane in the picture: an arrow along its normal that moves it, and a ball on the other side that tilts it; by
 * pointer, touch and keys. It is as long on the screen wherever the eye is.
 */

import { $, shape, svg } from "./dom.js";
import { centreOf, dot, each, plus, turned } from "./geometry.js";
import { demo, page } from "./page.js";
import { mode, shows } from "./parts.js";
import { chosen, corners, cutsNothing, movePlane, placeOfPlane, span, thousandths, turnPlane } from "./planes.js";
import { isSection, store } from "./state.js";

/** From the plane to the tip of the arrow and to the ball, and at least so far where it is seen from its end (in px). */
const LENGTH = 64;
const LEAST = 32;
/** What a key moves, in thousandths of the model, and turns, in radians; with Shift. */
const STEP = { move: [10, 1], turn: [Math.PI / 36, Math.PI / 180] };

/** @typedef {import("./overlay.js").Pixels} Pixels */
/** @typedef {NonNullable<ReturnType<typeof placed>>} Placed */

const stem = ["rim", "stem"].map((name) => shape("path", { class: name }));
const [arrow, ball] = [
  grip("arrow", "slider", shape("path", { d: "M-9 7L0-11L9 7Z" }), "Drag to move the plane"),
  grip("ball", "button", shape("circle", { r: 8 }), "Drag to tilt the plane"),
];

/** What can be taken hold of. @param {string} name @param {string} role @param {SVGElement} look @param {string} title */
function grip(name, role, look, title) {
  const made = shape("g", { class: name, role, tabindex: 0 });
  // As large as a finger.
  made.append(shape("circle", { r: 20, class: "reach" }), look, shape("title", {}, title));
  return made;
}

const overlay = () => svg("handles");

/** Whether the picture has planes. */
const isUsed = () => ["slice", "solid", "mesh", "flow"].includes(mode()) || shows("slice") || shows("flow");

/** Whether there is a handle: a clip plane that cuts nothing away has none, unless it is taken hold of. */
function isShown() {
  const isHeld = overlay().contains(document.activeElement);
  return demo.info !== undefined && store.state.handle && isUsed() && (isHeld || !cutsNothing());
}

/** Whether the arrow goes along the normal of the settings, 1, or against it, −1: to the side that is hidden. */
const sign = () => (isSection(store.state) || !chosen().flip ? 1 : -1);

/** Where the handle is: its middle, the way of the arrow, in the model and in pixels, and how long a pixel is there. */
function placed() {
  const { rotation } = page.overlay;
  const middle = centreOf(corners());
  const from = page.overlay.project(middle);
  const { normal: along, low, high } = span();
  const normal = each((i) => sign() * along[i]);
  const right = rotation && page.overlay.project(plus(middle, rotation[0], (high - low) / 1000));
  if (!rotation || !from || !right) return undefined;
  const pixel = (high - low) / 1000 / Math.hypot(right[0] - from[0], right[1] - from[1]);
  const to = page.overlay.project(plus(middle, normal, LENGTH * pixel)) ?? from;
  const seen = Math.hypot(to[0] - from[0], to[1] - from[1]);
  // Seen from its end, it points upwards.
  /** @type {Pixels} */
  const way = seen > 1 ? [(to[0] - from[0]) / seen, (to[1] - from[1]) / seen] : [0, -1];
  return { middle, from, normal, way, far: Math.max(seen, LEAST), pixel, rotation };
}

function place() {
  const is = isShown() ? placed() : undefined;
  overlay().toggleAttribute("hidden", !is);
  if (!is) return;
  const { from, way, far } = is;
  const at = (/** @type {number} */ part) => from.map((x, i) => x + part * far * way[i]);
  const [tip, back] = [at(1), at(-1)];
  for (const line of stem) line.setAttribute("d", `M${back}L${tip}`);
  arrow.setAttribute("transform", `translate(${tip}) rotate(${(180 * Math.atan2(way[0], -way[1])) / Math.PI})`);
  ball.setAttribute("transform", `translate(${back})`);
}

/** Shows the outline of the plane, its handle, and what both are for those who do not see them. */
function show() {
  const isFlow = mode() === "flow" && demo.info !== undefined;
  page.overlay.section = isFlow || isShown() ? { corners: corners(), seeds: isFlow ? store.state.seeds : [], isAid: !isFlow } : undefined;
  if (!demo.info) return;
  const { low, high } = span();
  const values = { min: low, max: high, now: placeOfPlane(), text: $("cut-text").textContent };
  for (const [name, value] of Object.entries(values)) arrow.setAttribute(`aria-value${name}`, String(value));
  ball.setAttribute("aria-label", `Tilt the plane with the arrow keys: normal ${chosen().normal.join(", ")}`);
}

/** Where the ball is from the middle of the plane. @param {Placed} is */
const ballOf = ({ normal }) => each((i) => -normal[i]);

/** Turns the plane around its middle, to where its ball is from there. @param {Placed} is @param {import("./geometry.js").Point} to */
function aim({ middle }, to) {
  const normal = each((i) => -sign() * to[i]);
  turnPlane(normal, middle);
}

/** The ball goes to the right and upwards on the screen by so many of its distances; it stays in front of the plane, or behind it. @param {Placed} is @param {number} right @param {number} up */
function drawBall(is, right, up) {
  const [toRight, upwards, towards] = is.rotation;
  const from = ballOf(is);
  const [x, y] = [dot(from, toRight) + right, dot(from, upwards) + up];
  const far = Math.hypot(x, y);
  const depth = Math.sqrt(Math.max(1 - far * far, 0)) * (dot(from, towards) < -1e-3 ? -1 : 1);
  const held = Math.max(far, 1);
  const to = each((i) => (x * toRight[i] + y * upwards[i]) / held + depth * towards[i]);
  aim(is, to);
}

/** @param {PointerEvent} event */
function press(event) {
  const is = placed();
  const held = /** @type {SVGElement} */ (event.currentTarget);
  if (!is || event.button !== 0) return;
  event.preventDefault();
  held.setPointerCapture(event.pointerId);
  held.focus();
  const zoom = overlay().currentCSSZoom ?? 1;
  let [x, y, at] = [event.clientX, event.clientY, placeOfPlane()];
  const [x0, y0] = [x, y];
  const drag = (/** @type {PointerEvent} */ moved) => {
    if (moved.pointerId !== event.pointerId) return;
    if (held === ball) return drawBall(is, (moved.clientX - x0) / zoom / LENGTH, (y0 - moved.clientY) / zoom / LENGTH);
    // Each step by what a pixel is where the arrow is now: it stays under the pointer.
    const now = placed() ?? is;
    at += (sign() * now.pixel * LENGTH * ((moved.clientX - x) * now.way[0] + (moved.clientY - y) * now.way[1])) / zoom / now.far;
    [x, y] = [moved.clientX, moved.clientY];
    movePlane(thousandths(chosen(), at));
  };
  const end = () => {
    held.removeEventListener("pointermove", drag);
    held.removeEventListener("lostpointercapture", end);
  };
  held.addEventListener("pointermove", drag);
  held.addEventListener("lostpointercapture", end);
}

/** Directions on the screen: right, up. @type {Record<string, [number, number]>} */
const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };

/** @param {KeyboardEvent} event */
function key(event) {
  const [is, direction] = [placed(), ARROWS[event.key]];
  if (!is || !direction || event.ctrlKey || event.altKey || event.metaKey) return;
  event.preventDefault();
  const fine = Number(event.shiftKey);
  // Around the axis of the screen that the key goes across: what is in front goes that way.
  const [axis, turn] = direction[0] ? [is.rotation[1], direction[0]] : [is.rotation[0], -direction[1]];
  if (event.currentTarget === ball) return aim(is, turned(ballOf(is), axis, turn * STEP.turn[fine]));
  const { low, high } = span();
  const step = ((high - low) * STEP.move[fine] * (direction[0] + direction[1])) / 1000;
  movePlane(thousandths(chosen(), placeOfPlane() + step));
}

export function attachHandles() {
  overlay().replaceChildren(...stem, ball, arrow);
  arrow.setAttribute("aria-label", "Position of the plane");
  for (const held of [arrow, ball]) {
    held.addEventListener("pointerdown", press);
    held.addEventListener("keydown", key);
    held.addEventListener("blur", show);
  }
  // The wheel zooms there, too.
  const zoom = (/** @type {WheelEvent} */ event) => {
    event.preventDefault();
    $("canvas").dispatchEvent(new WheelEvent("wheel", event));
  };
  overlay().addEventListener("wheel", zoom, { passive: false });
  store.subscribe(["view", "also", "planes", "plane", "handle", "seeds"], show);
  page.overlay.follow(place);
}
