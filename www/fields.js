/** Which field is shown, at which time, and the time steps that follow each other by themselves. */

import { percentilesOf, rebinned } from "./bins.js";
import { $, text } from "./dom.js";
import { fail } from "./messages.js";
import { demo, page } from "./page.js";
import { refine } from "./request.js";
import { applyIsovalue } from "./scene.js";

/** How long a time step is shown at least (in ms). */
const STEP_TIME = 150;

/** Fields by name: the numbers of their time steps, or one. @type {Map<string, number[]>} */
let fields = new Map();
let playing = false;

/** Another file is shown. @param {import("tetralod").FieldInfo[]} all */
export function setFields(all) {
  stop();
  fields = new Map();
  all.forEach(({ name }, number) => fields.set(name, [...(fields.get(name) ?? []), number]));
  for (const steps of fields.values()) steps.sort((a, b) => all[a].time - all[b].time);
  $("field").replaceChildren(...[...fields.keys()].map((name) => new Option(name, name)));
  $("surface-colour").replaceChildren(new Option("two sides", ""), ...[...fields.keys()].map((name) => new Option(name, name)));
  $("field-row").hidden = fields.size < 2;
  $("time").max = Math.max(...[...fields.values()].map((steps) => steps.length)) - 1;
  $("time").value = 0;
}

/** The smallest and the largest value of a field at all of its times. @param {string} name @returns {[number, number]} */
export function rangeOf(name) {
  const steps = demo.info.fields.filter((field) => field.name === name);
  return [Math.min(...steps.map(({ min }) => min)), Math.max(...steps.map(({ max }) => max))];
}

/** A field of the file, as the page shows it. @param {number} number @returns {import("./page.js").ShownField} */
function shownField(number) {
  const own = demo.info.fields[number];
  const [min, max] = rangeOf(own.name);
  const histogram = own.histogram && /** @type {any} */ (rebinned(own.histogram, [own.min, own.max], [min, max]));
  return { ...own, min, max, histogram, number, own };
}

/** The values below which some fractions of the volume lie, at all times together; undefined where the file has no histograms. */
export function percentilesAtAllTimes(fractions) {
  const steps = (fields.get(page.field.name) ?? []).map((number) => shownField(number).histogram);
  if (!steps.every(Boolean)) return undefined;
  const sums = steps.reduce((sum, histogram) => sum.map((volume, i) => volume + histogram[i]));
  return percentilesOf(sums, [page.field.min, page.field.max], fractions);
}

/** Reads the field and the time step from the settings. */
export function chooseField() {
  const steps = fields.get($("field").value);
  $("time").max = steps.length - 1;
  $("time-row").hidden = steps.length < 2;
  if ($("time").value >= steps.length) $("time").value = 0;
  const field = (page.field = shownField(steps[$("time").value]));
  page.transfer.field = field;
  page.colours.setField(field).catch(fail);
  if (field.time !== undefined) text("time-text", String(Number(field.time.toPrecision(6))), "time");
  applyIsovalue();
}

/** While steps follow each other: the number of the field at the one that comes next. */
export function followingStep() {
  if (!playing) return undefined;
  const steps = fields.get(page.field.name);
  return steps[(steps.indexOf(page.field.number) + 1) % steps.length];
}

export const isPlaying = () => playing;

/** Shows the time steps one after the other, each when the mesh of the one before is complete. */
function play() {
  playing = true;
  showPlaying();
  nextStep();
}

function stop() {
  playing = false;
  showPlaying();
}

function showPlaying() {
  $("play").textContent = playing ? "Pause" : "Play";
  $("play").setAttribute("aria-pressed", String(playing));
}

async function nextStep() {
  const shownFor = new Promise((resolve) => setTimeout(resolve, STEP_TIME));
  $("time").value = (Number($("time").value) + 1) % (Number($("time").max) + 1);
  chooseField();
  await Promise.all([refine(), shownFor]);
  if (playing) nextStep();
}

export function attachFields() {
  $("play").addEventListener("click", () => (playing ? stop() : play()));
  for (const id of ["field", "time"]) {
    $(id).addEventListener("input", () => {
      chooseField();
      refine();
    });
  }
}
