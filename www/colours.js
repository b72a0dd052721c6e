/** The settings of colours: map, direction, scale and range. */

import { $, input, select } from "./dom.js";
import { percentilesAtAllTimes, shownField } from "./fields.js";
import { precise } from "./format.js";
import { demo, viewer } from "./page.js";
import { store } from "./state.js";
import { commonRange } from "./volume.js";

/** The fractions of the volume between which the range of percentiles lies. */
const PERCENTILES = [0.02, 0.98];
/** A logarithmic range that begins below this part of its upper end is made to begin at that other part of it. */
const LOG_LEAST = 1e-8;
const LOG_START = 1e-3;

/** The values of the first and the last colour. @type {[low: number, high: number]} */
let range = [0, 1];
/** Counts the choices of a range: late answers are ignored. */
let chosen = 0;
/** Draws with a range that has come late. */
let draw = () => {};

/** @returns {import("tetralod/viewer").ColourState} */
export function colours() {
  const { map, reversed, log, bands } = store.state;
  return { map, reversed, log, range, ...(bands ? { bands: Number(bands) } : {}) };
}

/** The gradient over the whole range of the field, of colours that are even over the range of a legend. @param {import("tetralod/viewer").Legend} legend */
export function gradient({ colours, range, log }) {
  const { min, max } = shownField();
  const value = (/** @type {number} */ t) => (log ? range[0] * (range[1] / range[0]) ** t : range[0] + t * (range[1] - range[0]));
  const stops = colours.map((colour, i) => {
    const part = (value(i / (colours.length - 1)) - min) / (max - min);
    return `${colour} ${(100 * part).toFixed(2)}%`;
  });
  return `linear-gradient(90deg, ${stops.join(", ")})`;
}

/** Takes the range that is chosen. Percentiles come later. */
function choose() {
  if (!demo.info) return;
  const mine = ++chosen;
  const [min, max] = commonRange(shownField().name);
  const { range: wanted } = store.state;
  const most = Math.max(Math.abs(min), Math.abs(max));
  if (Array.isArray(wanted)) take(wanted);
  else if (wanted === "symmetric") take([-most, most]);
  else if (wanted === "data") take([min, max]);
  else {
    percentiles().then((found) => {
      if (mine !== chosen || !demo.info) return;
      take(found);
      draw();
    });
  }
}

/** @returns {Promise<[number, number]>} */
async function percentiles() {
  const { min, max } = shownField();
  const known = percentilesAtAllTimes(PERCENTILES);
  const asked = () =>
    viewer()
      .stats({ bins: 1000, fractions: PERCENTILES })
      .then(({ percentiles }) => Array.from(percentiles));
  const [low, high] = known ?? (await asked().catch(() => [min, max]));
  return low < high ? [low, high] : [min, max];
}

/** @param {[low: number, high: number]} wanted */
function take([low, high]) {
  // A range that a logarithmic scale can have.
  const end = high > 0 ? high : shownField().max;
  const needs = store.state.log && low < end * LOG_LEAST;
  range = needs ? [end * LOG_START, end] : [low, high];
  $("range-note").hidden = !needs;
  showRange();
}

function showRange() {
  const { range: wanted, log } = store.state;
  select("range-preset").value = typeof wanted === "string" ? wanted : "custom";
  const symmetric = select("range-preset").querySelector("option[value=symmetric]");
  symmetric?.toggleAttribute("disabled", log);
  const [low, high] = range;
  for (const [id, value] of /** @type {const} */ ([
    ["range-low", low],
    ["range-high", high],
  ])) {
    input(id).setCustomValidity("");
    if (document.activeElement !== input(id)) input(id).value = String(Math.abs(value) < 1e-9 * (high - low) ? 0 : precise(value, high - low, 5));
  }
}

/** Takes the numbers that were typed if they are a range. */
function typed() {
  const [low, high] = [input("range-low"), input("range-high")];
  const [lower, upper] = [low.valueAsNumber, high.valueAsNumber];
  const isRange = lower < upper;
  const isPositive = !store.state.log || lower > 0;
  low.setCustomValidity(isPositive ? "" : "A logarithmic scale needs positive numbers");
  high.setCustomValidity(isRange ? "" : "The second number must be larger than the first");
  for (const input of [low, high]) input.reportValidity();
  if (isRange && isPositive) store.change({ range: [lower, upper] });
}

/** @param {() => void} onLate draws with a range that has come late */
export function attachColours(onLate) {
  draw = onLate;
  const preset = select("range-preset");
  preset.addEventListener("input", () => {
    const { value } = preset;
    store.change({ range: value === "data" || value === "percentiles" || value === "symmetric" ? value : range });
  });
  for (const id of ["range-low", "range-high"]) input(id).addEventListener("input", typed);
  store.subscribe(["range", "log", "field", "time", "met"], choose);
}
