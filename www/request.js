/** What is asked of the mesh: its error, its size, where. */

import { $, all, input, named, text } from "./dom.js";
import { followingStep, isovalue, shownField } from "./fields.js";
import { count, percentage, pixels } from "./format.js";
import { fail } from "./messages.js";
import { needsOverTime } from "./overtime.js";
import { demo, viewer } from "./page.js";
import { areas } from "./region.js";
import { FIRST, store } from "./state.js";

/** What the request is made of. */
export const ASKED = /** @type {const} */ ([
  ...["refine", "error", "outside", "pixels", "budget", "focus", "isovalue", "field", "time"],
  ...["region", "part", "box", "view", "planes", "threshold", "over-time", "probes"],
]);

/** Which place the slider of errors shows. */
const place = () => (store.state.refine === "view" ? "outside" : "error");

/** 0 at the left end, then from 0.01 % to 100 % in equal ratios. @param {number} at */
const percentAt = (at) => (at === 0 ? 0 : 10 ** (-2 + (4 * at) / 100));
const errorPercent = () => percentAt(store.state[place()]);

/** With these words less may be asked for than an error everywhere. */
const SHAPING = ["refine", "budget", "focus", "region", "field", "time", "hidden", "threshold"];
/** A mesh within this error (in %) shows what a volume is, and is there much sooner than a fine one. */
const COARSE = 5;

/** What is asked for with the opening of a volume that these words are of; nothing where it might be too much. @param {import("./state.js").Words} words */
export function firstRequest({ error = "", ...words }) {
  if (SHAPING.some((name) => words[name])) return undefined;
  const percent = percentAt(error === "" ? FIRST.error : Number(error));
  return { error: /** @type {const} */ (`${percent >= COARSE ? percent : COARSE}%`) };
}

/** How long others wait for the first mesh (in ms). */
const PATIENCE = 1000;
let isHeld = false;

/**
 * Makes no request before the first mesh is there, or has taken too long; resolves when the mesh is what is asked for then.
 *
 * @param {Promise<unknown>} first
 * @param {() => boolean} isCurrent whether no other volume has been opened
 */
export async function afterFirst(first, isCurrent) {
  isHeld = true;
  // Whoever waits for it hears of an error.
  await Promise.race([first.catch(() => {}), new Promise((resolve) => setTimeout(resolve, PATIENCE))]);
  if (!isCurrent()) return;
  isHeld = false;
  refine();
  await viewer().settled();
}

/** Another volume is opened. */
export const stopHolding = () => void (isHeld = false);

/** From a quarter of a pixel to 64 pixels in equal ratios. */
export const errorPixels = () => Number((0.25 * 256 ** (store.state.pixels / 100)).toPrecision(2));

/** The number of tetrahedra, or undefined at the right end. */
export function budget() {
  if (store.state.budget === 100) return undefined;
  const most = Math.max(demo.info?.tetrahedra ?? 1e6, 2000);
  return Number((1000 * (most / 1000) ** (store.state.budget / 100)).toPrecision(2));
}

/** What is asked for. @returns {import("tetralod/viewer").ViewerRefineOptions} */
export function options() {
  const error = /** @type {const} */ (`${errorPercent()}%`);
  const needs = [];
  if (store.state.refine === "view") needs.push({ view: { pixels: errorPixels() } });
  // The step that comes next is refined with the one that is shown, so that it is there when it is shown.
  const following = followingStep();
  if (following !== undefined) needs.push({ error, field: following });
  needs.push(...needsOverTime(error));
  const { focus, threshold } = store.state;
  // What no cell that is shown can have is not refined.
  const values = focus ? { isovalues: [isovalue()] } : threshold ? { ranges: [threshold] } : {};
  const field = shownField().number;
  const [where, ...others] = areas();
  needs.push(...others.map((other) => ({ error, field, ...other, ...values })));
  return { error, field, maxTets: budget(), ...where, ...values, ...(needs.length > 0 ? { needs } : {}) };
}

/** The mesh that was requested last. @type {Promise<unknown>} */
let coming = Promise.resolve();
export const refined = () => coming;

/** Requests the mesh that the settings ask for, if that is another one. */
function refine() {
  if (!demo.info || isHeld) return;
  const wanted = options();
  if (JSON.stringify(wanted) === JSON.stringify(demo.request)) return;
  demo.request = wanted;
  coming = viewer()
    .refine(wanted)
    .catch((error) => {
      if (demo.request === wanted) demo.request = undefined;
      if (error.code !== "freed" && error.code !== "not-ready") fail(error);
    });
}

/** Shows the settings, those of the kind of error that is chosen. */
function showRequest() {
  const { refine } = store.state;
  for (const radio of named("refine-by")) radio.checked = radio.value === refine;
  for (const row of all("[data-refine-by]")) row.hidden = refine !== "view";
  $("error-label").textContent = refine === "view" ? "Maximum field error outside the view" : "Maximum field error";
  input("error").value = String(store.state[place()]);
  const percent = errorPercent();
  text("error", percent === 0 ? "0 (full resolution)" : percentage(percent));
  text("budget", budget() === undefined ? "no limit" : count(budget() ?? 0));
  text("pixels", pixels(errorPixels()));
}

/** Takes the time of a picture while something moves. */
function applyFrameTime() {
  text("frame-time", `${store.state["frame-time"]} ms`);
  viewer().frameTime = store.state["frame-time"];
}

export function attachRequest() {
  for (const radio of named("refine-by")) radio.addEventListener("change", () => store.change({ refine: radio.value === "view" ? "view" : "field" }));
  input("error").addEventListener("input", () => store.change({ [place()]: input("error").valueAsNumber }));
  store.subscribe(["frame-time"], applyFrameTime);
  store.subscribe(["refine", "error", "outside", "pixels", "budget"], showRequest);
  store.subscribe(ASKED, refine);
}
