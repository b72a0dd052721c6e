/** The numbers of the page: what has arrived, how good the mesh is, and what a picture takes. */

import { $, all, announce, element } from "./dom.js";
import { noteEmpty, showEmpty } from "./empty.js";
import { refreshExtremes } from "./extremes.js";
import { count, milliseconds, nameOf, percentage, pixels, size, vtuBytes } from "./format.js";
import { showHistogram } from "./histogram.js";
import { showIdle } from "./idle.js";
import { refreshMeasures } from "./measures.js";
import { fail } from "./messages.js";
import { demo, page, viewer } from "./page.js";
import { budget, errorPixels } from "./request.js";
import { originOf, source } from "./source.js";
import { store } from "./state.js";

/** @param {import("tetralod/viewer").ViewerProgress} progress */
export function showProgress({ bytes, total, complete, blocks }) {
  demo.receivedBytes = bytes;
  const isNews = !demo.blocks !== !blocks;
  demo.blocks = blocks;
  if (isNews) showIdle();
  for (const row of all(".of-blocks")) row.hidden = !blocks;
  if (blocks) return showBlocks(blocks, bytes);
  const known = total ?? demo.totalBytes;
  demo.totalBytes ??= total;
  if (known) $("progress", HTMLProgressElement).value = bytes / known;
  const amount = known ? `${size(bytes)} of ${size(known)}` : size(bytes);
  showGrowth();
  $("n-bytes").textContent = complete ? size(bytes) : amount;
}

/**
 * What a picture beside another one is of, and how good it is.
 *
 * @param {{ name: string, info?: { tetrahedra: number } | undefined, stats?: import("./page.js").Stats | undefined }} shown
 * @param {string[]} more
 */
export function pictureWords({ name, info, stats }, more = []) {
  const whole = info ? `${count(info.tetrahedra)} tetrahedra` : "opening…";
  const within = stats ? [`shown within ${percentage(100 * stats.relativeErrorBound)}`] : [];
  return [element("b", {}, name), `: ${[whole, ...within, ...more].join(", ")}`];
}

/** How large the volume is, and how little of it has come; and what is not as fast as it could be. */
export function showGrowth() {
  const { info, stats, totalBytes, receivedBytes } = demo;
  if (!info) return;
  if (store.state.beside) return $("growth").replaceChildren(...pictureWords({ name: nameOf(source.open ?? ""), info, stats }));
  const { vertices, tetrahedra } = info;
  const whole = totalBytes ? `${size(totalBytes)} as MT, ` : "";
  const arrived = element("b", {}, size(receivedBytes));
  const origin = originOf();
  const before = origin ? `${size(origin.bytes)} as ${origin.format}` : `${size(vtuBytes({ vertices, tetrahedra, fields: info.fields.length }))} as VTU`;
  const software = viewer().isSoftware ? [" ", element("small", {}, "No GPU: drawn in software", element("span", {}, ", coarser while something moves"))] : [];
  const words = [`${count(tetrahedra)} tetrahedra: `, element("span", {}, `${before}, `), whole];
  $("growth").replaceChildren(...words, arrived, ["opening", "streaming"].includes(demo.state) ? " so far" : " fetched", ...software);
}

/** Shows the progress of a file that is fetched in blocks: only those that the mesh needs. @param {import("tetralod").BlockProgress} blocks @param {number} bytes */
function showBlocks({ here, all, needed, leftOut }, bytes) {
  if (needed > 0) $("progress", HTMLProgressElement).value = Math.min(here / needed, 1);
  showGrowth();
  const excess = leftOut > 0 ? `, ${count(leftOut)} do not fit in memory` : "";
  $("n-blocks").textContent = `${count(here)} of ${count(all)}${excess}`;
  $("n-bytes").textContent = size(bytes);
}

/** @param {import("./page.js").Stats} stats */
export function showStats(stats) {
  demo.step = stats;
  showEmpty();
  const { info } = demo;
  $("n-current").textContent = count(stats.tetrahedra);
  const all = info ? ` of ${count(info.updates)}` : "";
  $("n-applied").textContent = `${count(stats.applied)}${all}`;
  $("n-updates").textContent = `+${count(stats.refined)} −${count(stats.coarsened)}`;
  $("n-refine").textContent = `${milliseconds(stats.milliseconds)}${stats.done ? "" : "…"}`;
  if (info) {
    $("n-reference").textContent = count(info.tetrahedra);
    $("fill").style.width = `${(100 * stats.tetrahedra) / info.tetrahedra}%`;
  }
  // No error is guaranteed before the last step.
  if (!stats.done) return;
  // The mesh is not complete while data is missing.
  if (!stats.missing) demo.stats = stats;
  if (store.state.beside) showGrowth();
  page.probes.refresh();
  refreshExtremes();
  refreshMeasures();
  showHistogram().catch(fail);
  const bound = percentage(stats.relativeErrorBound * 100);
  $("n-error").textContent = bound;
  $("budget-note").textContent = stats.satisfied || budget() === undefined ? BUDGET_NOTE : achieved(stats);
  $("error-achieved").textContent = `Achieved: ${bound}`;
  $("budget-achieved").textContent = `Achieved: ${count(stats.tetrahedra)} tetrahedra. ${limit(stats)}`;
  const seen = stats.bounds[1];
  $("n-pixels").textContent = seen === undefined ? "–" : pixels(seen);
  $("pixels-achieved").textContent = seen === undefined ? "" : `Achieved: ${pixels(seen)}`;
  $("n-pixels").classList.toggle("short", seen > errorPixels());
  announce(`${count(stats.tetrahedra)} tetrahedra, error ${bound}`);
}

/** What keeps the mesh from being finer. */
function limit(/** @type {import("./page.js").Stats} */ { satisfied, missing }) {
  if ((demo.blocks?.leftOut ?? 0) > 0) return "Limited by memory";
  if (missing) return "Limited by the network: data is on its way";
  return satisfied ? "Limited by the error" : "Limited by this number";
}

/** @param {import("tetralod/viewer").ViewerFrame} frame */
export function showFrame(frame) {
  noteEmpty(frame);
  demo.frame = frame;
  demo.frames++;
  if (!frame.ready) return;
  if (demo.firstFrameBytes === undefined) {
    demo.firstFrameBytes = frame.bytes;
    demo.firstFrameMs = performance.now();
    $("poster").hidden = true;
    $("stage").dataset.shows = "volume";
  }
  $("n-triangles").textContent = count(frame.triangles);
  $("n-uploaded").textContent = size(frame.uploaded);
  $("n-draw").textContent = milliseconds(frame.milliseconds);
}

const BUDGET_NOTE = "If the mesh would be larger, its error is as small as this number allows";

/** The errors that the budget allows. */
function achieved(/** @type {import("./page.js").Stats} */ { relativeErrorBound, bounds }) {
  const seen = bounds[1] === undefined ? "" : ` and ${pixels(bounds[1])} on screen`;
  return `Too few for the requested error: the error is at most ${percentage(relativeErrorBound * 100)}${seen}`;
}
