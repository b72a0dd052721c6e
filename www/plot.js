/** Plots of values along a line, as SVG: gaps where the line is outside of the domain. */

import { element, shape } from "./dom.js";

/** Room around the plot, in pixels. */
const ROOM = { left: 52, right: 16, top: 8, bottom: 34 };
/** The width of a colour bar, and the room for its numbers. */
const BAR = { width: 10, room: 48 };

/** Values at parts of a way, 0 to 1, as `Viewer.line` gives them. @typedef {{ at: ArrayLike<number>, values: ArrayLike<number> }} Profile */

/** A part of the way that is marked, with its name. @typedef {[part: number, name: string]} Mark */

/**
 * Draws curves into an SVG element that is shown; the first has no mark, the others are dashed. The way goes from one number to another.
 *
 * @param {SVGSVGElement} svg
 * @param {Profile[]} profiles
 * @param {{ from?: number, to: number, label: string, names?: string[], marks?: Mark[] }} how
 */
export function linePlot(svg, profiles, { from = 0, to, label, names = [], marks = [] }) {
  const { clientWidth: width } = svg;
  const all = profiles.flatMap(({ values }) => Array.from(values));
  if (all.length === 0) return nothing(svg);
  const range = widened(
    all.reduce((a, b) => Math.min(a, b)),
    all.reduce((a, b) => Math.max(a, b)),
  );
  const { x, y, parts } = axes(svg, { from, to, label, range });
  parts.push(...marksAt(svg, marks, x));
  /** @type {number[]} */
  const named = [];
  for (const [number, { at, values }] of profiles.entries()) {
    // Each part has two ends; where one begins at the end of the part before, the line goes on.
    const goesOn = (/** @type {number} */ i) => i % 2 === 1 || (i > 0 && at[i] - at[i - 1] < 1e-9);
    const path = Array.from(values, (value, i) => `${goesOn(i) ? "L" : "M"}${x(at[i]).toFixed(1)} ${y(value).toFixed(1)}`);
    parts.push(shape("path", { d: path.join(""), class: number > 0 ? "other" : "" }));
    let end = y(values[values.length - 1]) + 4;
    // Below those before that are at the same height.
    while (named.some((other) => Math.abs(other - end) < 11)) end += 1;
    if (names[number]) parts.push(shape("text", { x: width - ROOM.right / 2, y: end }, names[number]));
    named.push(end);
  }
  svg.replaceChildren(...parts);
}

/** What colours mean. @typedef {Pick<import("tetralod/viewer").Legend, "range" | "log" | "colours">} Scale */

/** Values at parts of a way, 0 to 1, in a row for each time; undefined where there is none. @typedef {{ at: number[], times: number[], rows: (number | undefined)[][] }} Grid */

/**
 * Draws values along a way and over time as colours, those of a colour bar, which is drawn beside; a frame marks one of the times.
 *
 * @param {SVGSVGElement} svg
 * @param {Grid} grid
 * @param {{ to: number, label: string, marks?: Mark[], step: number, scale: Scale }} how
 */
export function heatPlot(svg, { at, times, rows }, { to, label, marks = [], step, scale }) {
  // What is hidden has no size.
  if (svg.clientWidth === 0) return;
  if (rows.every((row) => row.every((value) => value === undefined))) return nothing(svg);
  const right = ROOM.right + BAR.width + BAR.room;
  const ends = endsOf(times);
  const { x, y, parts } = axes(svg, { from: 0, to, label, range: [ends[0], ends[times.length]], right });
  const columns = endsOf(at, [0, 1]).map(x);
  const heights = ends.map(y);
  const { top, left, bottom } = ROOM;
  const [width, height] = [svg.clientWidth - left, svg.clientHeight - top - bottom];
  const canvas = element("canvas", { width, height });
  const context = canvas.getContext("2d");
  const { colours } = scale;
  const colourOf = (/** @type {number} */ value) => colours[Math.min(Math.floor(partOf(value, scale) * colours.length), colours.length - 1)];
  /** @param {string} colour @param {number} x0 @param {number} y0 @param {number} x1 @param {number} y1 */
  const fill = (colour, x0, y0, x1, y1) => {
    if (!context) return;
    context.fillStyle = colour;
    // To whole pixels: no gaps between neighbours.
    const [l, t, r, b] = [x0 - left, y0 - top, x1 - left, y1 - top].map(Math.round);
    context.fillRect(l, t, r - l, b - t);
  };
  for (const [i, row] of rows.entries()) {
    for (const [k, value] of row.entries()) if (value !== undefined) fill(colourOf(value), columns[k], heights[i + 1], columns[k + 1], heights[i]);
  }
  const bar = svg.clientWidth - ROOM.right - BAR.room;
  const part = height / colours.length;
  for (const [i, colour] of colours.entries()) fill(colour, bar, top + height - (i + 1) * part, bar + BAR.width, top + height - i * part);
  const numbers = ticks(scale.range[0], scale.range[1], 5).map(({ at, label }) =>
    shape("text", { x: bar + BAR.width + 5, y: top + (1 - partOf(at, scale)) * height + 4, class: "bar" }, label),
  );
  svg.replaceChildren(
    ...parts,
    shape("image", { href: canvas.toDataURL(), x: left, y: top, width, height }),
    shape("rect", { x: left, y: heights[step + 1], width: x(1) - left, height: heights[step] - heights[step + 1], class: "step" }),
    shape("text", { transform: `translate(11 ${top + height / 2}) rotate(-90)` }, "time"),
    ...marksAt(svg, marks, x),
    ...numbers,
  );
}

/** Where each of some numbers ends and the next begins: half way. @param {number[]} numbers @param {number[]} outer the first and the last end, if these are no further than half a step */
function endsOf(numbers, outer = []) {
  const last = numbers.length - 1;
  const before = outer[0] ?? numbers[0] - (numbers[1] - numbers[0]) / 2;
  const after = outer[1] ?? numbers[last] + (numbers[last] - numbers[last - 1]) / 2;
  return [before, ...numbers.slice(1).map((number, i) => (numbers[i] + number) / 2), after];
}

/** Where a value is on a colour bar, 0 to 1. @param {number} value @param {Scale} scale */
function partOf(value, { range, log }) {
  const [at, low, high] = [value, ...range].map((number) => (log ? Math.log(number) : number));
  return Math.min(Math.max((at - low) / (high - low) || 0, 0), 1);
}

/** @param {SVGSVGElement} svg */
function nothing(svg) {
  svg.replaceChildren(shape("text", { x: svg.clientWidth / 2, y: svg.clientHeight / 2, class: "none" }, "no data between the points"));
}

/** Lines at parts of the way, with their names. @param {SVGSVGElement} svg @param {Mark[]} marks @param {(part: number) => number} x */
function marksAt({ clientHeight: height }, marks, x) {
  return marks.flatMap(([part, name]) => [
    shape("line", { x1: x(part), x2: x(part), y1: ROOM.top, y2: height - ROOM.bottom, class: "mark" }),
    shape("text", { x: x(part) + 8, y: ROOM.top + 11, class: "mark" }, name),
  ]);
}

/**
 * The axes of a plot, and where parts of its way and numbers of its height are.
 *
 * @param {SVGSVGElement} svg
 * @param {{ from: number, to: number, label: string, range: number[], right?: number }} how
 */
function axes({ clientWidth: width, clientHeight: height }, { from, to, label, range: [low, high], right = ROOM.right }) {
  const { left, top, bottom } = ROOM;
  const x = (/** @type {number} */ part) => left + part * (width - left - right);
  const y = (/** @type {number} */ value) => top + (1 - (value - low) / (high - low)) * (height - top - bottom);
  const parts = [];
  for (const value of ticks(low, high, 4)) {
    parts.push(shape("line", { x1: left, x2: width - right, y1: y(value.at), y2: y(value.at), class: "grid" }));
    parts.push(shape("text", { x: left - 6, y: y(value.at) + 4, class: "y" }, value.label));
  }
  for (const place of ticks(from, to, Math.max(2, Math.floor(width / 90)))) {
    const left = x((place.at - from) / (to - from));
    parts.push(shape("line", { x1: left, x2: left, y1: height - bottom, y2: height - bottom + 4 }));
    parts.push(shape("text", { x: left, y: height - bottom + 16, class: "x" }, place.label));
  }
  parts.push(shape("line", { x1: left, x2: width - right, y1: height - bottom, y2: height - bottom }));
  parts.push(shape("text", { x: x(0.5), y: height - 5, class: "x name" }, label));
  return { x, y, parts };
}

/** A range with some room above and below. @param {number} low @param {number} high */
function widened(low, high) {
  const room = (high - low || Math.abs(high) || 1) * 0.06;
  return [low - room, high + room];
}

/** At most `count` round numbers in a range, with their labels. @param {number} low @param {number} high @param {number} count @returns {{ at: number, label: string }[]} */
export function ticks(low, high, count) {
  const least = (high - low) / count;
  const power = 10 ** Math.floor(Math.log10(least));
  const step = [1, 2, 5].map((factor) => factor * power).find((size) => size >= least * 0.999) ?? 10 * power;
  const digits = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
  const made = [];
  for (let i = Math.ceil(low / step - 1e-9); i * step <= high + step * 1e-9; i++) {
    const value = i * step;
    const isLong = Math.abs(value) >= 1e5 || (value !== 0 && step < 1e-4);
    made.push({ at: value, label: (isLong ? value.toExponential(1) : value.toFixed(digits)).replace("-", "−") });
  }
  return made;
}
