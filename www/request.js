/** What is asked of the mesh: its error, its size, where. */

import { $, all, input, named, text } from "./dom.js";
import { followingStep, isovalue, shownField } from "./fields.js";
import { count, percentage, pixels } from "./format.js";
import { fail } from "./messages.js";
import { demo, viewer } from "./page.js";
import { region } from "./region.js";
import { store } from "./state.js";

/** What the request is made of. */
const ASKED = /** @type {const} */ ([
  ...["refine", "error", "outside", "pixels", "budget", "focus", "isovalue", "field", "time"],
  ...["region", "box", "view", "places", "axis", "flip"],
]);

/** Which place the slider of errors shows. */
const place = () => (store.state.refine === "view" ? "outside" : "error");

/** 0 at the left end, then from 0.01 % to 100 % in equal ratios. */
function errorPercent() {
  const at = store.state[place()];
  return at === 0 ? 0 : 10 ** (-2 + (4 * at) / 100);
}

/** From a quarter of a pixel to 64 pixels in equal ratios. */
export const errorPixels = () => Number((0.25 * 256 ** (store.state.pixels / 100)).toPrecision(2));

/** The number of tetrahedra, or undefined at the right end. */
export function budget() {
  if (store.state.budget === 100) return undefined;
  const most = Math.max(demo.info?.tetrahedra ?? 1e6, 2000);
  return Number((1000 * (most / 1000) ** (store.state.budget / 100)).toPrecision(2));
}

/** @returns {import("tetralod/viewer").ViewerRefineOptions} */
function options() {
  const error = /** @type {const} */ (`${errorPercent()}%`);
  const needs = [];
  if (store.state.refine === "view") needs.push({ view: { pixels: errorPixels() } });
  // The step that comes next is refined with the one that is shown, so that it is there when it is shown.
  const following = followingStep();
  if (following !== undefined) needs.push({ error, field: following });
  const isovalues = store.state.focus ? { isovalues: [isovalue()] } : {};
  return { error, field: shownField().number, maxTets: budget(), ...region(), ...isovalues, ...(needs.length > 0 ? { needs } : {}) };
}

/** The mesh that was requested last. @type {Promise<unknown>} */
let coming = Promise.resolve();
export const refined = () => coming;

/** Requests the mesh that the settings ask for, if that is another one. */
function refine() {
  if (!demo.info) return;
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
