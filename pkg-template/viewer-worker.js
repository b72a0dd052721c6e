/**
 * The worker behind `Viewer`: decodes, refines and draws, so that the page never waits for any of it.
 *
 * Frames are drawn when something has changed, at most one for each refresh of the screen.
 */

import init, { Viewer } from "./tetralod_viewer.js";
import { TetralodError, flattenError } from "./errors.js";
import { serve, webEndpoint } from "./rpc.js";

/** While a file streams in, the mesh follows it this often (in ms), and at most half of the time is spent on that. */
const FOLLOW = 120;

/** @type {Viewer | undefined} */
let viewer;
/** What `refine` was last asked for; applied again as data arrives. */
let request = {};
/** Set once `refine` has been asked for or the base mesh has come. */
let lastRefine = { end: -Infinity, took: 0 };
let bytes = 0;
let ready = false;
let frameAsked = false;
let broken = false;

const nextFrame =
  typeof requestAnimationFrame === "function" ? requestAnimationFrame : (then) => setTimeout(then, 16);

const emit = serve(webEndpoint(globalThis), {
  async create(canvas, width, height, ratio) {
    await init().catch((error) => {
      throw new TetralodError("wasm", `the wasm module did not load: ${error?.message ?? error}`);
    });
    viewer = await Viewer.create(canvas, width, height, ratio);
    invalidate();
    return { adapter: viewer.adapter(), palette: viewer.palette() };
  },

  clear() {
    viewer.clear();
    request = {};
    bytes = 0;
    ready = false;
    lastRefine = { end: -Infinity, took: 0 };
    invalidate();
  },

  /** Takes a chunk; the answer to the one that brings the base mesh waits until the first picture is out. */
  async feed(chunk) {
    const progress = viewer.feed(chunk);
    bytes = progress.bytes;
    if (!progress.ready) return { progress };
    const first = !ready;
    ready = true;
    const due = performance.now() - lastRefine.end > Math.max(FOLLOW, 2 * lastRefine.took);
    if (first || due) follow();
    if (!first) return { progress };
    await drawn();
    return { progress, info: { ...viewer.info(), bounds: Array.from(viewer.bounds()) } };
  },

  finish() {
    const progress = viewer.finish();
    follow();
    return progress;
  },

  refine(options) {
    request = options;
    return refine();
  },

  /** Applies what has been set since the last call, in one go. */
  update({ mode, isovalue, clip, roi, orbit, zoom, pan, home, size }) {
    if (size) viewer.resize(...size);
    if (mode !== undefined) viewer.setMode(mode);
    if (isovalue !== undefined) viewer.setIsovalue(isovalue);
    if (clip !== undefined) viewer.setClip(...(clip ? [...clip.normal, clip.offset] : [0, 0, 0, 0]));
    if (roi !== undefined) viewer.setRoi(roi ? Float64Array.from(roi) : undefined);
    if (home) viewer.home();
    if (orbit) viewer.orbit(...orbit);
    if (zoom !== undefined) viewer.zoom(zoom);
    if (pan) viewer.pan(...pan);
    invalidate();
  },

  pickRoi: (x, y) => viewer.pickRoi(x, y),

  dragRoi(handle, x, y) {
    const box = viewer.dragRoi(handle, x, y);
    invalidate();
    return Array.from(box);
  },

  hash: () => viewer.hash(),
});

/** Refines, and tells how long it took. */
function refine() {
  const start = performance.now();
  const result = viewer.refine(request);
  const end = performance.now();
  lastRefine = { end, took: end - start };
  const stats = { ...result, milliseconds: end - start, bytes };
  emit("stats", stats);
  invalidate();
  return stats;
}

/** Applies the last request to what has arrived since; a request that cannot be kept is told, not thrown. */
function follow() {
  try {
    refine();
  } catch (error) {
    emit("error", flattenError(error));
  }
}

function invalidate() {
  if (frameAsked || broken) return;
  frameAsked = true;
  nextFrame(draw);
}

function draw() {
  frameAsked = false;
  try {
    const start = performance.now();
    const drew = viewer.frame();
    const milliseconds = performance.now() - start;
    if (drew) emit("frame", { milliseconds, triangles: viewer.triangles, bytes, ready });
    // The canvas may be hidden just now: then try again with the next refresh.
    else if (viewer.pending) invalidate();
  } catch (error) {
    // A frame that fails would fail again: wait for a change, or for good if the GPU or the program is gone.
    broken = error?.code === "device-lost" || error?.code === undefined;
    emit("error", flattenError(error));
  }
}

/** Resolves after a frame has been handed to the screen; soon in any case, since hidden pages have no frames. */
async function drawn() {
  invalidate();
  const patience = new Promise((resolve) => setTimeout(resolve, 250));
  // Of two refreshes, the first draws and the second comes after that picture.
  const twice = new Promise((resolve) => nextFrame(() => nextFrame(resolve)));
  await Promise.race([twice, patience]);
}
