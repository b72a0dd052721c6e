/**
 * `Viewer`: an MT streamed from anywhere and drawn on a canvas with WebGPU, all of it in a worker.
 *
 * Calls that are faster than the worker replace each other: only the last one is carried out, and the promises of all
 * resolve when it is done.
 */

import { TetralodError, reviveError } from "./errors.js";
import { changedScene } from "./fit.js";
import { Latest, deferred, mergeUpdates } from "./latest.js";
import { openOptions, sendable } from "./options.js";
import { PLACES, absoluteUrl, loadWasm, startWorker } from "./start.js";
import { abortable, openSource, pump, rangesOf } from "./stream.js";
import { checkAmount, checkNames, setCaller, withMeshTools } from "./tools.js";

export { TetralodError } from "./errors.js";
export { absolute } from "./stored.js";

const NO_WEBGPU =
  "this browser has no WebGPU; use a current Chrome, Edge, Firefox or Safari over https (or on localhost)";
const NO_ADAPTER =
  "the browser gives no GPU adapter; allow hardware acceleration in its settings, or update the graphics driver";

const NO_PAGE = 'a viewer draws on a canvas of a page; elsewhere, use MultiTessellation of "tetralod"';
const USED_CANVAS =
  "`canvas` belongs to another viewer, or has a context of its own; free that viewer first, or give each a canvas of its own";

/** The worker of a viewer. */
const VIEWER = {
  name: "viewer",
  entry: "tetralod/viewer-worker",
  start: () => new Worker(new URL("./viewer-worker.js", import.meta.url), { type: "module" }),
  script: () => new URL("./viewer-worker.js", new URL("./tetralod_viewer_bg.wasm", import.meta.url)),
  remedy: ", or pass a `worker` that you have made",
};

/** A GPU that is lost is opened again after these waits (in ms): drivers take some time to start. */
const WAITS = [0, 500, 2000, 8000];

/** Who asks for no mesh so long after a volume has been opened (in ms) gets the one that the picture needs. */
const UNASKED = 100;

/** Canvases that were handed over, which can be done once: who draws on them now. @type {WeakMap<HTMLCanvasElement, Viewer | undefined>} */
const holders = new WeakMap();

/** What is drawn before something else is set: the isosurface in the middle of the field's range. */
const SCENE = { isosurfaces: [{}] };

export class Viewer extends withMeshTools(EventTarget) {
  #remote;
  #canvas;
  #observer;
  /** What the picture is on where the canvas cannot show another one. @type {HTMLCanvasElement | undefined} */
  #cover;
  #info;
  #adapter;
  #stream = null;
  /** For a file in parts: resolves when a mesh is requested. */
  #requested;
  #setRequest = new Latest((options) => this.#remote.call("setRequest", [options]));
  /** Callers that wait for a mesh, by the number of their request. */
  #waiting = [];
  #update = new Latest((changes) => this.#remote.call("update", [changes]), mergeUpdates);
  #drag = new Latest(([handle, x, y]) => this.#remote.call("dragRegion", [handle, x, y]));
  #pick = new Latest(([x, y]) => this.#remote.call("pick", [x, y]));
  /** What is drawn, and changes of it that are on their way, by their numbers. @type {Record<string, any>} */
  #scene = {};
  /** @type {Map<number, object>} */
  #changes = new Map();
  #sets = 0;
  #camera;
  #frameTime;
  #legend;
  #overlay;
  /** Of the canvas, in pixels. */
  #size;

  /** Rejects with code `no-webgpu` where nothing can be drawn; resolves to nothing where it can. */
  static async check() {
    const adapter = await gpuOfPage().requestAdapter().catch(() => null);
    if (!adapter) throw new TetralodError("no-webgpu", NO_ADAPTER);
  }

  /**
   * Hands the canvas to a new worker. When the viewer has been freed, another one can be made of it.
   *
   * @param {HTMLCanvasElement} canvas
   * @param {{
   *   signal?: AbortSignal, frameTime?: number, prefetch?: string | URL,
   *   worker?: any, workerUrl?: string | URL, workerTimeoutMs?: number, wasmUrl?: string | URL,
   * }} [options]
   */
  static async create(canvas, { signal, frameTime = 60, prefetch, ...places } = {}) {
    signal?.throwIfAborted();
    checkNames(places, PLACES, ["signal", "frameTime", "prefetch"]);
    checkAmount("frameTime", frameTime, 1);
    if (typeof HTMLCanvasElement === "undefined") throw new TetralodError("no-webgpu", NO_PAGE);
    if (!(canvas instanceof HTMLCanvasElement)) {
      throw new TetralodError("bad-option", "`canvas` must be a canvas element");
    }
    gpuOfPage();
    const viewer = new Viewer(canvas, places);
    viewer.#frameTime = frameTime;
    try {
      // An adapter takes a browser some time, in which the worker loads.
      const checked = Viewer.check();
      checked.catch(() => {});
      const { wasmUrl } = places;
      const wasm = wasmUrl === undefined ? undefined : absoluteUrl("wasmUrl", wasmUrl).href;
      const ahead = prefetch === undefined ? undefined : absoluteUrl("prefetch", prefetch).href;
      const loaded = loadWasm(viewer.#remote, VIEWER, wasm, ahead);
      loaded.catch(() => {});
      await checked;
      signal?.throwIfAborted();
      await loaded;
      signal?.throwIfAborted();
      await viewer.#start(frameTime);
      signal?.throwIfAborted();
    } catch (error) {
      viewer.free();
      throw error;
    }
    return viewer;
  }

  /** @private Use `Viewer.create`. */
  constructor(canvas, places) {
    super();
    setCaller(this, (method, args, request) => {
      if (request !== undefined) throw badOption("request", "a viewer has one mesh; open the volume as MultiTessellation, too");
      return this.#remote.call(method, args);
    });
    this.#canvas = canvas;
    this.#remote = startWorker(VIEWER, places, (name, data) => this.#heard(name, data));
  }

  async #start(frameTime) {
    const offscreen = this.#handOver();
    const [width, height] = (this.#size = pixels(this.#canvas.getBoundingClientRect()));
    const args = [offscreen, width, height, devicePixelRatio, frameTime];
    const created = await this.#remote.call("create", args, [offscreen]);
    this.#adapter = created.adapter;
    await this.set(SCENE);
    this.#observer = new ResizeObserver(([entry]) => {
      const size = entry.devicePixelContentBoxSize?.[0];
      const [w, h] = size ? [size.inlineSize, size.blockSize] : pixels(entry.contentRect);
      if (this.#cover) this.#cover.style.cssText = coverStyle(this.#canvas);
      this.#size = [Math.max(1, w), Math.max(1, h)];
      this.#change({ size: [...this.#size, devicePixelRatio] });
    });
    try {
      this.#observer.observe(this.#canvas, { box: "device-pixel-content-box" });
    } catch {
      // Safari does not support device pixels here.
      this.#observer.observe(this.#canvas);
    }
  }

  /** A canvas can be handed to a worker once: another one covers it where that has been done. */
  #handOver() {
    const canvas = this.#canvas;
    if (!holders.has(canvas)) {
      const offscreen = handOver(canvas);
      holders.set(canvas, this);
      return offscreen;
    }
    if (holders.get(canvas)) throw new TetralodError("bad-option", USED_CANVAS);
    holders.set(canvas, this);
    // The last picture of the viewer before is not seen through this one; the focus of the canvas is.
    canvas.style.objectPosition = "-99999px 0";
    this.#cover = coverOf(canvas);
    canvas.after(this.#cover);
    return this.#cover.transferControlToOffscreen();
  }

  #heard(name, data) {
    if (name === "error") return this.#emit("error", reviveError(data));
    if (name === "lost") return this.#restore(reviveError(data));
    if (name === "failed") return this.#failed(data.goal, reviveError(data.error));
    if (name === "camera") this.#camera = data;
    if (name === "legend") this.#legend = data;
    if (name === "overlay") this.#overlay = data;
    this.#emit(name, data);
    if (name === "stats" && data.done) this.#settle(data.goal, ({ resolve }) => resolve(data));
  }

  /**
   * Opens a GPU in place of the one that was lost. Where a browser loses the process of the GPU, a canvas that was handed
   * to a worker never shows a picture again (Chromium 148): another one covers it, and lets the pointer through.
   */
  async #restore(error) {
    for (const wait of WAITS) {
      await new Promise((resolve) => setTimeout(resolve, wait));
      const cover = coverOf(this.#canvas);
      const offscreen = cover.transferControlToOffscreen();
      const args = [offscreen, ...pixels(this.#canvas.getBoundingClientRect()), devicePixelRatio];
      try {
        const { adapter } = await this.#remote.call("restore", args, [offscreen]);
        this.#cover?.remove();
        this.#canvas.after(cover);
        [this.#cover, this.#adapter] = [cover, adapter];
        this.#emit("restored", { adapter });
        return;
      } catch (again) {
        error = again;
      }
    }
    this.#emit("error", error);
  }

  #failed(goal, error) {
    if (!this.#settle(goal, ({ reject }) => reject(error))) this.#emit("error", error);
  }

  /** Settles the callers that wait for this request or one that it has replaced; returns whether there were any. */
  #settle(goal, how) {
    const settled = this.#waiting.filter((waiting) => waiting.goal <= goal);
    this.#waiting = this.#waiting.filter((waiting) => waiting.goal > goal);
    settled.forEach(how);
    return settled.length > 0;
  }

  #emit(name, detail) {
    this.dispatchEvent(new CustomEvent(name, { detail }));
  }

  /** The description of the volume; `undefined` until its base mesh has arrived. */
  get info() {
    return this.#info;
  }

  /** The name of the GPU. */
  get adapter() {
    return this.#adapter;
  }

  /** What the colours mean; `undefined` where nothing is coloured by values. */
  get legend() {
    return this.#legend;
  }

  /** What an overlay over the last picture draws; `undefined` until the base mesh has arrived. */
  get overlay() {
    return this.#overlay;
  }

  /** How long a picture should take while something moves, in milliseconds. */
  get frameTime() {
    return this.#frameTime;
  }

  set frameTime(milliseconds) {
    checkAmount("frameTime", milliseconds, 1);
    this.#frameTime = milliseconds;
    this.#remote.call("setFrameTime", [milliseconds]).catch(() => {});
  }

  /** All that is set: what is drawn, and `camera`. A copy, as plain data; `set` takes it. */
  get state() {
    return structuredClone({ ...[...this.#changes.values()].reduce(changedScene, this.#scene), camera: this.#camera });
  }

  /**
   * Streams a volume in, in place of the one before. Resolves when its base mesh has been drawn; `finished` of the
   * result when the whole file has arrived. What is drawn is `state` over what was drawn before, as far as it fits the volume.
   *
   * @param {any} source
   * @param {{ signal?: AbortSignal, state?: object, [how: string]: any }} [options]
   */
  async open(source, { signal, state, ...how } = {}) {
    signal?.throwIfAborted();
    const fetching = { ...openOptions(how, ["signal", "state"]), state: sendable(state ?? {}, true) };
    this.#stream?.abort(new DOMException("another volume was opened", "AbortError"));
    const control = new AbortController();
    this.#stream = control;
    const stopped = signal ? AbortSignal.any([signal, control.signal]) : control.signal;
    const ranges = fetching.whole ? undefined : rangesOf(source, fetching);
    const inParts = ranges && (await this.#openParts({ ...fetching, ...ranges }, stopped));
    if (inParts) return inParts;
    const opened = await openSource(source, stopped, fetching);
    await this.#remote.call("clear", [fetching.fields, fetching.state]);
    stopped.throwIfAborted();
    this.#info = undefined;
    const { promise: ready, resolve, reject } = deferred();
    const finished = this.#read(opened, stopped, resolve).catch((error) => {
      throw naming(opened.name, error);
    });
    finished.catch(reject);
    const { info, dropped } = await ready;
    // A failure after this point rejects `finished`, which may have no handler.
    finished.catch((error) => {
      if (error?.name !== "AbortError") this.#emit("error", error);
    });
    return { info, dropped, name: opened.name, total: opened.total, finished };
  }

  async #openParts({ url, whole, ...options }, signal) {
    const { promise, resolve } = deferred();
    signal.addEventListener("abort", () => this.#remote.call("halt").catch(() => {}), { once: true });
    const opened = await abortable(this.#remote.call("openParts", [url, options]), signal);
    if (!opened) return undefined;
    [this.#info, this.#scene] = [opened.info, opened.scene];
    const unasked = setTimeout(() => this.#remote.call("follow").then(resolve, () => {}), UNASKED);
    this.#requested = () => {
      clearTimeout(unasked);
      resolve();
    };
    signal.addEventListener("abort", () => clearTimeout(unasked), { once: true });
    const finished = abortable(promise.then(() => this.#atRest()), signal);
    // The worker reports errors by itself.
    finished.catch(() => {});
    this.#emit("progress", opened.progress);
    const { info, dropped, progress } = opened;
    return { info, dropped, name: options.name ?? url, total: progress.total, finished };
  }

  /**
   * Resolves when the viewer is at rest: all that was set has reached it, the mesh is what was asked for, for the camera as it is, all
   * data that it needs has arrived, and the picture shows it. Pages that are hidden draw no pictures, and wait for none.
   *
   * @param {{ signal?: AbortSignal }} [how]
   */
  async settled({ signal } = {}) {
    signal?.throwIfAborted();
    await abortable(this.#atRest().then(() => this.#pictured()), signal);
  }

  /** Resolves when the mesh is at rest. */
  async #atRest() {
    await this.#sent();
    await this.#remote.call("settled");
  }

  /** Resolves when the picture shows what is set, or the page is hidden. */
  async #pictured() {
    if (document.hidden) return;
    const { promise: hidden, resolve } = deferred();
    document.addEventListener("visibilitychange", resolve);
    try {
      await Promise.race([this.#remote.call("pictured"), hidden]);
    } finally {
      document.removeEventListener("visibilitychange", resolve);
    }
  }

  /** Resolves when the worker has all that was set. */
  async #sent() {
    await Promise.all([this.#update.idle(), this.#setRequest.idle()]);
  }

  async hash() {
    await this.#sent();
    return super.hash();
  }

  /** Continues after a network error. */
  async retry() {
    await this.#remote.call("retry");
  }

  async #read(opened, signal, ready) {
    const { total } = opened;
    const feed = async (chunk) => {
      const { progress, info, scene, dropped } = await this.#remote.call("feed", [chunk], [chunk.buffer]);
      signal.throwIfAborted();
      if (info) {
        [this.#info, this.#scene] = [info, scene];
        ready({ info, dropped });
      }
      this.#emit("progress", { ...progress, total });
    };
    const finish = async () => {
      const progress = await this.#remote.call("finish");
      this.#emit("progress", { ...progress, total: total ?? progress.bytes });
    };
    await pump(opened, { feed, finish }, signal);
  }

  /**
   * Requests another mesh; while the file streams in, and with `view` while the camera moves, the mesh follows this
   * request. Resolves when the mesh has been made; calls that were replaced meanwhile, with the later one. The end of the signal
   * gives the request up: the one before it holds again.
   *
   * @param {object} [options]
   * @param {{ signal?: AbortSignal }} [how]
   */
  async refine(options = {}, { signal, ...others } = {}) {
    checkNames(others, [], ["signal"]);
    signal?.throwIfAborted();
    const goal = await this.#setRequest.call(sendable(options, true));
    this.#requested?.();
    const waiting = { goal, ...deferred() };
    this.#waiting.push(waiting);
    if (!signal) return waiting.promise;
    return abortable(waiting.promise, signal).catch((error) => {
      if (signal.aborted) this.#giveUp(waiting);
      throw error;
    });
  }

  /** Others may wait for the same mesh. */
  #giveUp(waiting) {
    this.#waiting = this.#waiting.filter((other) => other !== waiting);
    if (!this.#waiting.some(({ goal }) => goal === waiting.goal)) this.#remote.call("abandon", [waiting.goal]).catch(() => {});
  }

  /** Keeps a copy of the mesh as it is, which `compare` shows beside later ones. */
  keep() {
    return this.#remote.call("keep");
  }

  /** Keeps the mesh as it is, wherever the camera goes and whatever is requested; with `false` it follows again. */
  freeze(on = true) {
    return this.#remote.call("freeze", [Boolean(on)]);
  }

  #change(changes) {
    return this.#update.call(changes);
  }

  /**
   * Changes what is drawn, and the camera: what is named in `changes` replaces what was there, `null` gives it its default, all
   * else stays. If something is wrong, nothing changes.
   *
   * @param {Record<string, any>} changes
   */
  async set({ camera, ...given } = {}) {
    const changes = sendable(given, true);
    const id = this.#sets++;
    this.#changes.set(id, changes);
    try {
      // What is wrong in one call is no reason to refuse another one that was sent with it.
      const { scene, refused } = await this.#change({ sets: [{ id, changes, camera }] });
      this.#scene = scene;
      if (refused[id]) throw reviveError(refused[id]);
    } finally {
      this.#changes.delete(id);
    }
  }

  /** Rotates the model to the right and upwards, in radians. */
  orbit(right, up) {
    return this.#change({ orbit: [right, up] });
  }

  /** Multiplies the distance to the model; the point of the canvas (−1 to 1, y upwards) stays where it is. */
  zoom(factor, x = 0, y = 0) {
    return this.#change({ zoom: [factor, x, y] });
  }

  /** Moves the picture by fractions of the canvas's height. */
  pan(right, up) {
    return this.#change({ pan: [right, up] });
  }

  /** Shows the whole model from the front. */
  home() {
    return this.#change({ home: true });
  }

  /** Shows the whole model from a side: `"home"`, `"alongX"`, `"againstX"`, and so on. */
  lookFrom(side) {
    return this.#change({ side });
  }

  /** Moves the eye to the right, up and ahead, by multiples of its distance to the model. */
  fly(right, up, ahead) {
    return this.#change({ fly: [right, up, ahead] });
  }

  /** Turns the eye where it is, to the right and upwards, in radians. */
  look(right, up) {
    return this.#change({ look: [right, up] });
  }

  /** What is shown at a point of the canvas (−1 to 1, y upwards); `undefined` if nothing is there. */
  pick(x, y) {
    return this.#pick.call([x, y]);
  }

  /** What is at a point of the model, in the current mesh; `undefined` outside of it. */
  reading([x, y, z]) {
    return this.#remote.call("reading", [x, y, z]);
  }

  /**
   * A picture of what is drawn, as a PNG; the canvas keeps its own.
   *
   * @param {{ width?: number, height?: number, samples?: number, background?: string, signal?: AbortSignal }} [options]
   */
  async screenshot({ width = this.#size[0], height = this.#size[1], samples = 16, background, signal } = {}) {
    for (const [name, value] of Object.entries({ width, height, samples })) {
      if (!(Number.isInteger(value) && value > 0)) throw badOption(name, "must be a positive integer");
    }
    signal?.throwIfAborted();
    return abortable(this.#remote.call("screenshot", [width, height, samples, background]), signal);
  }

  /** The handle of the region at a point (−1 to 1, y upwards), or −1. */
  pickRegion(x, y) {
    return this.#remote.call("pickRegion", [x, y]);
  }

  /** Moves a handle of the region under a point; resolves to the new box. */
  async dragRegion(handle, x, y) {
    const region = await this.#drag.call([handle, x, y]);
    this.#scene = { ...this.#scene, region };
    return region;
  }

  /** A copy of the mesh that is shown. */
  async mesh(how = /** @type {any} */ ({})) {
    checkNames(how, ["fields"]);
    return this.#remote.call("mesh", [how.fields]);
  }

  /** Where the blocks of the file are, and which of them are here; `undefined` where it has none. */
  blockMap() {
    return this.#remote.call("blockMap");
  }

  /** Ends the worker. Another viewer can be made of the canvas. */
  free() {
    this.#cover?.remove();
    if (holders.get(this.#canvas) === this) holders.set(this.#canvas, undefined);
    this.#stream?.abort(new DOMException("the viewer was freed", "AbortError"));
    this.#observer?.disconnect();
    const freed = new TetralodError("freed", "the viewer was freed");
    this.#remote.close(freed);
    this.#settle(Infinity, ({ reject }) => reject(freed));
  }

  [Symbol.dispose ?? Symbol.for("Symbol.dispose")]() {
    this.free();
  }
}

function badOption(name, problem) {
  return new TetralodError("bad-option", `option \`${name}\`: ${problem}`);
}

/** An error of the file's contents says which file. */
function naming(name, error) {
  const named = !(error instanceof TetralodError) || error.code === "freed" || error.message.startsWith(`${name}:`);
  return named ? error : new TetralodError(error.code, `${name}: ${error.message}`, { cause: error });
}

/** A canvas can be handed to a worker once. */
function handOver(canvas) {
  try {
    return canvas.transferControlToOffscreen();
  } catch (error) {
    throw new TetralodError("bad-option", USED_CANVAS, { cause: error });
  }
}

/** A canvas that covers another one, and lets the pointer through. */
function coverOf(canvas) {
  const cover = document.createElement("canvas");
  // Not as an attribute, which a Content-Security-Policy forbids.
  cover.style.cssText = coverStyle(canvas);
  cover.ariaHidden = "true";
  return cover;
}

/** The style of a canvas that covers another one. */
function coverStyle({ offsetLeft, offsetTop, offsetWidth, offsetHeight }) {
  const place = `left: ${offsetLeft}px; top: ${offsetTop}px; width: ${offsetWidth}px; height: ${offsetHeight}px`;
  return `position: absolute; pointer-events: none; ${place}`;
}

/** WebGPU; throws where a browser has none. */
function gpuOfPage() {
  const gpu = globalThis.navigator?.gpu;
  if (!gpu) throw new TetralodError("no-webgpu", NO_WEBGPU);
  return gpu;
}

function pixels({ width, height }) {
  return [width, height].map((length) => Math.max(1, Math.round(length * devicePixelRatio)));
}
