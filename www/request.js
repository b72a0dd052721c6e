/** What is asked of the mesh: its error, its size, where. */

import { $, all, checked, text } from "./dom.js";
import { followingStep } from "./fields.js";
import { count, percentage, pixels } from "./format.js";
import { fail } from "./messages.js";
import { demo, page } from "./page.js";
import { region } from "./region.js";
import { isovalue } from "./scene.js";

export const refineBy = () => /** @type {"field" | "view"} */ (checked("refine-by"));

/** Positions of the slider of the field error: by screen error, it applies outside the view and may be coarser. */
const DEFAULT_POSITIONS = { field: 50, view: 78 };
export const errorPositions = { ...DEFAULT_POSITIONS };

/** 0 at the left end, then from 0.01 % to 100 % in equal ratios. */
function errorPercent() {
  const place = Number($("error").value);
  return place === 0 ? 0 : 10 ** (-2 + (4 * place) / 100);
}

/** From a quarter of a pixel to 64 pixels in equal ratios. */
export function errorPixels() {
  return Number((0.25 * 256 ** ($("pixels").value / 100)).toPrecision(2));
}

/** The number of tetrahedra, or undefined at the right end. */
export function budget() {
  const place = Number($("budget").value);
  if (place === 100) return undefined;
  const most = Math.max(demo.info?.tetrahedra ?? 1e6, 2000);
  return Number((1000 * (most / 1000) ** (place / 100)).toPrecision(2));
}

/** Requests the mesh that the settings ask for. */
export function refine() {
  if (!demo.info) return;
  const percent = errorPercent();
  text("error-text", percent === 0 ? "0 (full resolution)" : percentage(percent), "error");
  text("budget-text", budget() === undefined ? "no limit" : `${count(budget())}`, "budget");
  text("pixels-text", pixels(errorPixels()), "pixels");
  const field = page.field.number;
  /** @type {import("tetralod/viewer").ViewerRefineOptions} */
  const options = { error: `${percent}%`, field, maxTets: budget(), .../** @type {any} */ (region()) };
  if ($("focus").checked) options.isovalues = [isovalue()];
  if (refineBy() === "view") options.needs = [{ view: { pixels: errorPixels() } }];
  // The step that comes next is refined with the one that is shown, so that it is there when it is shown.
  const following = followingStep();
  if (following !== undefined) options.needs = [...(options.needs ?? []), { error: `${percent}%`, field: following }];
  demo.request = options;
  return page.viewer.refine(options).catch((error) => {
    if (error.code !== "freed" && error.code !== "not-ready") fail(error);
  });
}

/** Shows the settings of the kind of error that is chosen. */
export function applyRefineBy() {
  const view = refineBy() === "view";
  for (const row of all("[data-refine-by]")) row.hidden = !view;
  $("error-label").textContent = view ? "Maximum field error outside the view" : "Maximum field error";
  $("error").value = errorPositions[refineBy()];
  refine();
}

/** Takes the time of a picture while something moves. */
export function applyFrameTime() {
  const milliseconds = Number($("frame-time").value);
  text("frame-time-text", `${milliseconds} ms`, "frame-time");
  page.viewer.frameTime = milliseconds;
}

export function attachRequest() {
  $("frame-time").addEventListener("input", applyFrameTime);
  for (const radio of all("[name=refine-by]")) radio.addEventListener("change", applyRefineBy);
  $("error").addEventListener("input", () => {
    errorPositions[refineBy()] = $("error").value;
    refine();
  });
  for (const id of ["pixels", "budget", "focus"]) $(id).addEventListener("input", refine);
}
