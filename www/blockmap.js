/**
 * The map of blocks: the boxes of the blocks of the file, turned as the picture is. What is not fetched is faint, what the mesh uses
 * lies over all others. Coarse blocks, as large as the volume, hardly show: they are always needed.
 */

import { $, all } from "./dom.js";
import { count } from "./format.js";
import { fail } from "./messages.js";
import { page, viewer, volume } from "./page.js";
import { shownTab } from "./tabs.js";

/** How blocks look: not fetched, fetched, in use; in this order they are drawn. */
const LOOKS = [
  { name: "missing", fill: 0.04, line: 0.2 },
  { name: "fetched", fill: 0.2, line: 0.7 },
  { name: "in-use", fill: 0.2, line: 0.7 },
];
/** How much less is seen of large boxes, which lie around all others: a power of what they leave of the volume's length. */
const FADE = 3;
/** Where a file has about so few blocks, large boxes are seen, too. */
const FEW = 8;
/** Room around the map, in pixels. */
const MARGIN = 12;
/** New states are asked for at most so often (in ms). */
const PAUSE = 250;
/** The four corners of the faces of a box in each direction: a bit an axis says which end. */
const FACES = [0, 1, 2].flatMap((axis) => {
  const [one, other] = [1 << ((axis + 1) % 3), 1 << ((axis + 2) % 3)];
  return [0, 1 << axis].map((side) => ({ axis, isUpper: side > 0, corners: [side, side | one, side | one | other, side | other] }));
});

/** @typedef {import("tetralod/viewer").BlockMap} BlockMap */

/** @type {BlockMap | undefined} */
let map;
let asking = false;
let isOld = false;

/** @param {any} error @returns {undefined} */
function failed(error) {
  if (error.code !== "freed") fail(error);
}

/** Asks for the states of the blocks, and draws them. Calls that come meanwhile are answered once. */
export async function showBlockMap() {
  isOld = true;
  if (asking) return;
  asking = true;
  while (isOld) {
    isOld = false;
    map = await viewer().blockMap().catch(failed);
    showCounts();
    draw();
    await new Promise((resolve) => setTimeout(resolve, PAUSE));
  }
  asking = false;
}

function showCounts() {
  $("blocks-map").hidden = !map;
  if (!map) return;
  for (const [state, { name }] of LOOKS.entries()) {
    all(`#blocks-counts .${name} b`)[0].textContent = count(map.states.reduce((sum, one) => sum + Number(one === state), 0));
  }
}

/** @typedef {ArrayLike<number>} Numbers */
/** @typedef {{ place: (point: Numbers) => [number, number], depth: (point: Numbers) => number, isSeen: (face: (typeof FACES)[number]) => boolean }} View */

/**
 * Coordinates on the map of a point of the model: right, down, and towards the eye.
 *
 * @param {number[][]} rotation
 * @param {{ width: number, height: number }} size
 * @returns {View}
 */
function projection([right, up, towards], { width, height }) {
  const { bounds } = volume();
  const middle = [0, 1, 2].map((i) => (bounds[i] + bounds[i + 3]) / 2);
  // How far the corners of the volume are from its middle, to the right and upwards.
  const reach = (/** @type {number[]} */ direction) => direction.reduce((sum, x, i) => sum + Math.abs(x) * (bounds[i + 3] - bounds[i]), 0) / 2;
  const scale = Math.min((width / 2 - MARGIN) / reach(right), (height / 2 - MARGIN) / reach(up));
  /** @param {number[]} direction @param {Numbers} point */
  const along = (direction, point) => direction.reduce((sum, x, i) => sum + x * (point[i] - middle[i]), 0);
  return {
    place: (point) => [width / 2 + scale * along(right, point), height / 2 - scale * along(up, point)],
    depth: (point) => along(towards, point),
    isSeen: ({ axis, isUpper }) => towards[axis] > 0 === isUpper,
  };
}

const lengths = (/** @type {Numbers} */ box) => [0, 1, 2].map((axis) => box[axis + 3] - box[axis]);

/** The order in which boxes are drawn: by state, then from the back to the front. `part` is how long they are, of the volume. @param {BlockMap} map @param {View} view */
function order({ bounds, states }, { depth }) {
  const whole = lengths(volume().bounds);
  const all = Array.from(states, (state, i) => {
    const box = bounds.subarray(6 * i, 6 * i + 6);
    const part = Math.cbrt(lengths(box).reduce((product, length, axis) => product * Math.min(length / whole[axis], 1), 1));
    return { box, state, part, depth: depth([0, 1, 2].map((axis) => (box[axis] + box[axis + 3]) / 2)) };
  });
  return all.sort((a, b) => a.state - b.state || a.depth - b.depth);
}

function draw() {
  const canvas = $("blocks-canvas", HTMLCanvasElement);
  const [context, rotation] = [canvas.getContext("2d"), page.overlay.rotation];
  if (!context || !map || !rotation || shownTab() !== "data") return;
  const [width, height, ratio] = [canvas.clientWidth, canvas.clientHeight, devicePixelRatio];
  if (width === 0) return;
  Object.assign(canvas, { width: Math.round(width * ratio), height: Math.round(height * ratio) });
  context.scale(ratio, ratio);
  context.lineJoin = "round";
  context.lineWidth = 1;
  const view = projection(rotation, { width, height });
  const seen = FACES.filter(view.isSeen);
  // The colours of the words below the map.
  const colours = LOOKS.map(({ name }) => getComputedStyle(all(`#blocks-counts .${name}`)[0], "::before").backgroundColor);
  context.strokeStyle = getComputedStyle(canvas).color;
  context.globalAlpha = 0.35;
  outline(context, volume().bounds, view, FACES);
  context.stroke();
  const least = Math.min(FEW / map.states.length, 1);
  for (const { box, state, part } of order(map, view)) {
    const { fill, line } = LOOKS[state];
    const seenOfIt = Math.max((1 - part) ** FADE, least);
    context.fillStyle = context.strokeStyle = colours[state];
    outline(context, box, view, seen);
    context.globalAlpha = fill * seenOfIt;
    context.fill();
    context.globalAlpha = line * seenOfIt;
    context.stroke();
  }
}

/** The path of these faces of a box. @param {CanvasRenderingContext2D} context @param {Numbers} box @param {View} view @param {typeof FACES} faces */
function outline(context, box, { place }, faces) {
  const corners = Array.from({ length: 8 }, (_, i) => place([0, 1, 2].map((axis) => box[axis + (i & (1 << axis) ? 3 : 0)])));
  context.beginPath();
  for (const { corners: face } of faces) {
    face.forEach((corner, i) => (i === 0 ? context.moveTo(...corners[corner]) : context.lineTo(...corners[corner])));
    context.closePath();
  }
}

export function attachBlockMap() {
  page.overlay.follow(draw);
}
