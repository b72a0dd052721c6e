/** A plot of values along a line, as SVG: gaps where the line is outside of the domain. */

import { shape } from "./dom.js";

/** Room around the plot, in pixels. */
const ROOM = { left: 52, right: 16, top: 8, bottom: 34 };

/**
 * Draws what `Viewer.line` gives of a line of some length into an SVG element that is shown.
 *
 * @param {SVGSVGElement} svg
 * @param {{ at: ArrayLike<number>, values: ArrayLike<number> }} profile
 * @param {{ length: number, label: string }} how
 */
export function linePlot(svg, profile, { length, label }) {
  const { left, right, top, bottom } = ROOM;
  const { clientWidth: width, clientHeight: height } = svg;
  const [at, values] = [Array.from(profile.at), Array.from(profile.values)];
  if (values.length === 0) {
    svg.replaceChildren(shape("text", { x: width / 2, y: height / 2, class: "none" }, "no data between the points"));
    return;
  }
  const [low, high] = widened(
    values.reduce((a, b) => Math.min(a, b)),
    values.reduce((a, b) => Math.max(a, b)),
  );
  const x = (/** @type {number} */ part) => left + part * (width - left - right);
  const y = (/** @type {number} */ value) => top + (1 - (value - low) / (high - low)) * (height - top - bottom);
  const parts = [];
  for (const value of ticks(low, high, 4)) {
    parts.push(shape("line", { x1: left, x2: width - right, y1: y(value.at), y2: y(value.at), class: "grid" }));
    parts.push(shape("text", { x: left - 6, y: y(value.at) + 4, class: "y" }, value.label));
  }
  for (const place of ticks(0, length, Math.max(2, Math.floor(width / 90)))) {
    const left = x(place.at / length);
    parts.push(shape("line", { x1: left, x2: left, y1: height - bottom, y2: height - bottom + 4 }));
    parts.push(shape("text", { x: left, y: height - bottom + 16, class: "x" }, place.label));
  }
  parts.push(shape("line", { x1: left, x2: width - right, y1: height - bottom, y2: height - bottom }));
  parts.push(shape("text", { x: x(0.5), y: height - 5, class: "x name" }, label));
  // Each part has two ends; where one begins at the end of the part before, the line goes on.
  const goesOn = (/** @type {number} */ i) => i % 2 === 1 || (i > 0 && at[i] - at[i - 1] < 1e-9);
  const path = values.map((value, i) => `${goesOn(i) ? "L" : "M"}${x(at[i]).toFixed(1)} ${y(value).toFixed(1)}`);
  parts.push(shape("path", { d: path.join("") }));
  svg.replaceChildren(...parts);
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
