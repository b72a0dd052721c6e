/** Which field is shown, at which time, and which of its values is the isovalue. */

import { percentilesOf, rebinned } from "./bins.js";
import { $, input, select, text } from "./dom.js";
import { precise, rounded } from "./format.js";
import { demo, volume } from "./page.js";
import { store } from "./state.js";
import { fieldNames, rangeOf, stepsOf, vectors } from "./volume.js";

/**
 * A field at one of its times. `min` and `max` are over all times, and the histogram is of that range, so that values and colours mean
 * the same at all of them; `number` is its place in the list of the volume, `own` what that says of it.
 *
 * @typedef {import("tetralod").FieldInfo & { number: number, own: import("tetralod").FieldInfo }} ShownField
 */

/** The isovalue has so many digits: as many as links keep. */
const DIGITS = 6;

/** A field of the file, as the page shows it. @param {number} number @returns {ShownField} */
function asShown(number) {
  const own = volume().fields[number];
  const [min, max] = rangeOf(own.name);
  const histogram = own.histogram && /** @type {any} */ (rebinned(own.histogram, [own.min, own.max], [min, max]));
  return { ...own, min, max, histogram, number, own };
}

/** @type {ShownField | undefined} */
let last;

/** The field that is shown, at its time. Only asked for while a volume is open. @returns {ShownField} */
export function shownField() {
  const number = stepsOf(store.state.field)[store.state.time];
  if (last?.own !== volume().fields[number]) last = asShown(number);
  return /** @type {ShownField} */ (last);
}

/** The values below which some fractions of the volume lie, at all times together; undefined where the file has no histograms. @param {number[]} fractions */
export function percentilesAtAllTimes(fractions) {
  const { name, min, max } = shownField();
  const steps = stepsOf(name).flatMap((number) => asShown(number).histogram ?? []);
  if (steps.length < stepsOf(name).length) return undefined;
  const sums = steps.reduce((sum, histogram) => sum.map((volume, i) => volume + histogram[i]));
  return percentilesOf(sums, [min, max], fractions);
}

/** While steps follow each other: the number of the field at the one that comes next. */
export function followingStep() {
  const steps = stepsOf(store.state.field);
  return store.state.playing ? steps[(store.state.time + 1) % steps.length] : undefined;
}

/** In units of the field. */
export function isovalue() {
  return store.state.isovalue ?? shownField().isovalue;
}

/** Where the isovalue is in the field's range, 0 to 1. */
export function isovaluePart() {
  if (!demo.info) return 0.5;
  const { min, max } = shownField();
  return max > min ? Math.min(Math.max((isovalue() - min) / (max - min), 0), 1) : 0.5;
}

/** Takes an isovalue at a fraction of the field's range. @param {number} part */
export function setIsovalue(part) {
  if (!demo.info) return;
  const { min, max } = shownField();
  store.change({ isovalue: precise(min + Math.min(Math.max(part, 0), 1) * (max - min), max - min, DIGITS) });
}

/** The isovalue in words, which may be one of the volume before: values carry over. */
export function isovalueWords() {
  const { min, max, unit } = shownField();
  return `${rounded(isovalue(), max - min)} ${unit}`.trim();
}

/** Another file is shown. */
export function listFields() {
  const options = () => fieldNames().map((name) => new Option(name, name));
  select("field").replaceChildren(...options());
  select("surface-colour").replaceChildren(new Option("two sides", ""), ...options());
  select("vector").replaceChildren(...[...vectors().keys()].map((name) => new Option(name, name)));
  $("field-row").hidden = options().length < 2;
}

function showField() {
  if (!demo.info) return;
  const { field, time } = store.state;
  select("field").value = field;
  input("time").max = String(stepsOf(field).length - 1);
  input("time").value = String(time);
  $("time-row").hidden = stepsOf(field).length < 2;
  const at = shownField().time;
  if (at !== undefined) text("time", String(Number(at.toPrecision(6))));
}

function showIsovalue() {
  if (!demo.info) return;
  input("isovalue").value = String(1000 * isovaluePart());
  text("isovalue", isovalueWords());
}

export function attachFields() {
  select("field").addEventListener("input", () => {
    const { range } = store.state;
    // A range that was typed is one of the field before.
    store.change({ field: select("field").value, range: Array.isArray(range) ? "data" : range });
  });
  input("time").addEventListener("input", () => store.change({ time: input("time").valueAsNumber }));
  input("isovalue").addEventListener("input", () => setIsovalue(input("isovalue").valueAsNumber / 1000));
  store.subscribe(["field", "time"], showField);
  store.subscribe(["field", "time", "isovalue"], showIsovalue);
}
