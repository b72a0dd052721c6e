/** What has arrived, and what it has bought: the panel of data. */

import { attachBlockMap, showBlockMap } from "./blockmap.js";
import { $, all, describe, shape, svg } from "./dom.js";
import { shownField } from "./fields.js";
import { count, milliseconds, percentage, size } from "./format.js";
import { stateNow } from "./history.js";
import { measured } from "./measures.js";
import { copied } from "./messages.js";
import { demo, viewer } from "./page.js";
import { ticks } from "./plot.js";
import { store } from "./state.js";
import { onTab, shownTab } from "./tabs.js";

/** So many pictures and meshes are remembered. */
const FRAMES = 120;
const MESHES = 400;
/** Pictures that follow each other within this time belong to one movement (in ms). */
const MOVEMENT = 500;

/** @typedef {{ bytes: number, error: number, tetrahedra: number, time: number }} Mesh what was guaranteed with so many bytes */

/** @type {Mesh[]} */
let meshes = [];
/** Times of the worker for a picture, and from one picture to the next. @type {{ time: number, interval?: number }[]} */
let frames = [];
let last = 0;
let uploaded = 0;
let gpuBytes = 0;
/** @type {import("tetralod/viewer").ViewerProgress["traffic"]} */
let traffic;
/** The file that all this is of. */
/** @type {typeof demo.info} */
let of;
let isDue = false;

/** Takes what the viewer says. @param {string} name @param {any} detail */
export function record(name, detail) {
  if (of !== demo.info) {
    of = demo.info;
    [meshes, frames, uploaded, traffic] = [[], [], 0, undefined];
  }
  if (name === "progress") traffic = detail.traffic ?? traffic;
  if (name === "stats") demo.blocks = detail.blocks ?? demo.blocks;
  if (name === "stats" && detail.done) mesh(detail);
  if (name === "frame") frame(detail);
  if (isDue) return;
  isDue = true;
  requestAnimationFrame(() => {
    isDue = false;
    if (shownTab() === "data") show();
  });
}

/** @param {import("./page.js").Stats} stats */
function mesh({ bytes, relativeErrorBound, tetrahedra }) {
  meshes.push({ bytes, error: relativeErrorBound, tetrahedra, time: Math.round(performance.now()) });
  if (meshes.length > MESHES) meshes.shift();
}

/** @param {import("tetralod/viewer").ViewerFrame} frame */
function frame({ milliseconds: time, uploaded: bytes, gpuBytes: held }) {
  gpuBytes = held;
  const now = performance.now();
  const interval = now - last < MOVEMENT ? now - last : undefined;
  last = now;
  uploaded += bytes;
  frames.push({ time, interval });
  if (frames.length > FRAMES) frames.shift();
  const intervals = frames.flatMap((one) => one.interval ?? []);
  if (intervals.length > 0) $("frame-time-achieved").textContent = `Achieved: ${milliseconds(quantile(intervals, 0.5))} from one to the next`;
}

/** The value below which a part of some numbers lies. @param {number[]} values @param {number} part */
function quantile(values, part) {
  const sorted = [...values].sort((a, b) => a - b);
  return sorted[Math.min(Math.floor(part * sorted.length), sorted.length - 1)] ?? 0;
}

function show() {
  showBought();
  showBlocks();
  showTraffic();
  showFrames();
}

/** The bytes that the index of the file states for meshes of the whole volume. @returns {{ bytes: number, error: number }[]} */
function stated() {
  if (!demo.info) return [];
  const { curve, min, max } = shownField().own;
  if (!curve) return [];
  return Array.from(curve.errors, (error, i) => ({ error: error / (max - min || 1), bytes: curve.bytes[i] }));
}

/** The error against bytes; errors in equal ratios. */
function showBought() {
  const chart = svg("bought");
  const good = meshes.filter(({ error, bytes }) => error > 0 && bytes > 0);
  if (good.length === 0) return chart.replaceChildren();
  const { clientWidth: width, clientHeight: height } = chart;
  const [left, right, top, bottom] = [52, 12, 8, 34];
  const low = Math.floor(Math.log10(Math.min(...good.map(({ error }) => error))));
  // What the file states for errors down to that scale, so that one sees what more bytes would buy.
  const near = stated().filter(({ error }) => error >= 10 ** low && error <= 1);
  const most = Math.max(...[...good, ...near].map(({ bytes }) => bytes)) * 1.04;
  const largest = Math.max(...[...good, ...near].map(({ error }) => error));
  const high = Math.max(Math.ceil(Math.log10(largest)), low + 1);
  const x = (/** @type {number} */ bytes) => left + (bytes / most) * (width - left - right);
  const y = (/** @type {number} */ error) => top + ((high - Math.log10(error)) / (high - low)) * (height - top - bottom);
  const parts = [];
  for (let power = low; power <= high; power++) {
    const at = y(10 ** power);
    parts.push(shape("line", { x1: left, x2: width - right, y1: at, y2: at, class: "grid" }));
    parts.push(shape("text", { x: left - 6, y: at + 4, class: "y" }, percentage(100 * 10 ** power)));
  }
  for (const { at } of ticks(0, most, Math.max(2, Math.floor(width / 100)))) {
    parts.push(shape("text", { x: x(at), y: height - bottom + 15 }, at === 0 ? "0" : size(at)));
  }
  parts.push(shape("text", { x: (left + width - right) / 2, y: height - 4 }, "bytes that have arrived"));
  const line = (/** @type {{ bytes: number, error: number }[]} */ points) =>
    `M${points.map(({ bytes, error }) => `${x(bytes).toFixed(1)} ${y(error).toFixed(1)}`).join("L")}`;
  if (near.length > 1) parts.push(shape("path", { d: line(near), class: "stated" }));
  parts.push(shape("path", { d: line(good) }));
  parts.push(...good.map(({ bytes, error }) => shape("circle", { cx: x(bytes), cy: y(error), r: 2.5 })));
  chart.replaceChildren(...parts);
  const end = good[good.length - 1];
  chart.setAttribute("aria-label", `Error ${percentage(100 * end.error)} with ${size(end.bytes)}; ${good.length} meshes so far`);
}

/** Which part of the blocks is here, and which part is needed but is not. */
function showBlocks() {
  const { blocks } = demo;
  const [here, coming] = all("#blocks-bar i");
  const words = blocks
    ? `${count(blocks.here)} of ${count(blocks.all)} blocks are here${blocks.needed > 0 ? `, the request needs ${count(blocks.needed)}` : ""}`
    : "This file comes as a whole";
  here.style.width = blocks ? `${(100 * blocks.here) / blocks.all}%` : "100%";
  coming.style.width = blocks ? `${(100 * Math.max(blocks.needed - blocks.here, 0)) / blocks.all}%` : "0";
  $("blocks-bar").setAttribute("aria-label", words);
  $("blocks-words").textContent = words;
  showBlockMap();
}

function showTraffic() {
  const rows = [
    ["Bytes received", size(demo.receivedBytes)],
    ["Of these needed", size(traffic?.used ?? demo.receivedBytes)],
    ["Requests", traffic ? `${count(traffic.requests)} in ${count(traffic.rounds)} rounds` : "1"],
    ["Waited for them", traffic ? milliseconds(traffic.waitedMs) : "–"],
    ["Memory of blocks", demo.blocks ? size(demo.blocks.bytes) : "–"],
    ["Memory on the GPU", size(gpuBytes)],
    ["Uploaded to the GPU", size(uploaded)],
    ["First picture", demo.firstFrameMs ? `after ${milliseconds(demo.firstFrameMs)}` : "–"],
    ["Bytes until then", demo.firstFrameBytes ? size(demo.firstFrameBytes) : "–"],
  ];
  $("traffic").replaceChildren();
  describe($("traffic"), rows);
}

/** The times of the last pictures, as bars. */
function showFrames() {
  const chart = svg("frames");
  const times = frames.map(({ time }) => time);
  if (times.length === 0) return chart.replaceChildren();
  const { clientWidth: width, clientHeight: height } = chart;
  const most = Math.max(...times);
  const wide = width / FRAMES;
  chart.replaceChildren(
    ...times.map((time, i) => {
      const high = Math.max((time / most) * (height - 4), 1);
      return shape("rect", { x: i * wide, y: height - high, width: Math.max(wide - 1, 0.5), height: high });
    }),
  );
  const words = `Worker: ${milliseconds(quantile(times, 0.5))} in the middle, ${milliseconds(quantile(times, 0.95))} at most for 95 %, of the last ${times.length} pictures`;
  chart.setAttribute("aria-label", words);
  $("frames-words").textContent = words;
}

/** All numbers, as plain data. */
export function report() {
  return {
    state: stateNow(),
    info: demo.info,
    request: demo.request,
    stats: demo.stats,
    received: demo.receivedBytes,
    total: demo.totalBytes,
    firstPicture: { milliseconds: demo.firstFrameMs, bytes: demo.firstFrameBytes },
    blocks: demo.blocks,
    traffic,
    ...measured(),
    uploaded,
    gpuBytes,
    meshes,
    frames,
    gpu: viewer().adapter,
    browser: navigator.userAgent,
  };
}

/** Shows the tetrahedra, coloured by what there is of the file. @param {"block" | "missing"} colourBy */
function map(colourBy) {
  store.change({ view: "mesh", "colour-by": colourBy, shape: "solid" });
}

export function attachData() {
  attachBlockMap();
  onTab((name) => name === "data" && show());
  new ResizeObserver(() => shownTab() === "data" && show()).observe($("data-panel"));
  $("map-blocks").addEventListener("click", () => map("block"));
  $("map-missing").addEventListener("click", () => map("missing"));
  $("copy-data").addEventListener("click", () => copied(JSON.stringify(report(), undefined, 2), "Numbers copied as JSON"));
}
