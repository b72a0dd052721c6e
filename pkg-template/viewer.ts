/// <reference lib="esnext.disposable" preserve="true" />
/**
 * Draws an MT on a canvas with WebGPU, or WebGL 2 where there is none, and gives of its mesh what `MultiTessellation` gives.
 *
 * ```js
 * import { Viewer } from "tetralod/viewer";
 *
 * const viewer = await Viewer.create(document.querySelector("canvas"));
 * await viewer.open("bucky.mt");
 * await viewer.refine({ error: "1%" });
 * await viewer.set({ isosurfaces: [{ value: 0.5 }] });
 * ```
 *
 * @module
 */

import { DISPOSE } from "./dispose.js";
import { TetralodError, badOption, known, ofFile, reviveError } from "./errors.js";
import { changedScene } from "./fit.js";
import { type Deferred, Latest, type Update, deferred, mergeUpdates } from "./latest.js";
import { type Need, type ReadOptions, type Reading as Fetching, type RefineOptions, type Unchecked, type ViewOptions, checkAmount, checkNames, openOptions, sendable } from "./options.js";
import type { BlockMap, BlockProgress, Mesh, MtInfo, RefineStats, Traffic } from "./results.js";
import type { Remote } from "./rpc.js";
import type { CameraState, Legend, Misfit, Overlay, Reading, SceneState, ViewerChanges, ViewerState } from "./scene.js";
import { type Kind, PLACES, absoluteHref, checkWorker, startWorker } from "./start.js";
import { absolute, displaced } from "./stored.js";
import { type OpenSource, type RangesSource, type Source, abortable, openSource, pump, rangesOf, transferOf } from "./stream.js";
import { type AwaitOptions, type FieldOptions, setCaller, withMeshTools } from "./tools.js";
import { startViewer, viewerRemedy, viewerScript, viewerWasm } from "./viewer-files.js";
import type { RendererName, ViewerMethods } from "./viewer-worker.js";

export { TetralodError, absolute, displaced };
export type { BlockMap, Traffic } from "./results.js";
export type {
  ArrowState,
  AxisOverlay,
  BoundaryState,
  CameraState,
  CellState,
  ColourState,
  CompareState,
  DeformState,
  IsosurfaceState,
  Legend,
  Misfit,
  Overlay,
  PlaneState,
  Reading,
  SceneState,
  SliceState,
  StreamlineState,
  ThresholdState,
  ViewerChanges,
  ViewerState,
  VolumeState,
} from "./scene.js";

/** How much of a file has arrived. */
export interface ViewerProgress {
  /** Whether the base mesh has arrived. */
  ready: boolean;
  /** Whether the whole file has arrived. */
  complete: boolean;
  /** Bytes decoded. */
  bytes: number;
  /** Updates decoded. */
  updates: number;
  /** Size of the file, if known. */
  total: number | undefined;
  /** Of a file that is fetched in parts: the state of its blocks. */
  blocks?: BlockProgress;
  /** Of such a file: what has been asked of the server. */
  traffic?: Traffic;
}

/**
 * A request for the viewer's mesh. A view without `matrix` and `viewport` is that of the viewer's own camera: the mesh
 * follows it.
 */
export interface ViewerRefineOptions extends Omit<RefineOptions, "view" | "needs" | "where"> {
  view?: OwnView | ViewOptions;
  needs?: readonly (Omit<Need, "view"> & { view?: OwnView | ViewOptions })[];
  /** The URL of a module whose default export is the function. */
  where?: string | URL;
}

/** What the viewer's own camera sees. */
export type OwnView = Pick<ViewOptions, "pixels" | "outside">;

/**
 * The work for the last request so far. The mesh changes in steps of some milliseconds between frames; `done` is true
 * with the last one.
 */
export interface ViewerStats extends RefineStats {
  /** Bytes of the file that had been decoded. */
  bytes: number;
  /** Of a file that is fetched in parts: the state of its blocks. */
  blocks?: BlockProgress;
}

/** A picture that was drawn. */
export interface ViewerFrame {
  /** Time of the worker to extract, upload and draw it. */
  milliseconds: number;
  /** Triangles of all surfaces. */
  triangles: number;
  /** Bytes that were uploaded to the GPU for it. */
  uploaded: number;
  /**
   * Bytes of memory on the GPU of all buffers and textures that pictures are made of and in; those of the canvas itself belong to the
   * browser and are not counted.
   */
  gpuBytes: number;
  /** The part of the canvas's pixels that it has, in each direction: less than 1 only while something moves. */
  scale: number;
  /** Bytes of the file that had been decoded. */
  bytes: number;
  /** Whether it shows a volume yet. */
  ready: boolean;
}

/** How a volume is opened. */
export interface ViewerOpenOptions extends ReadOptions {
  /** Ends the download; pending calls for it reject with the signal's reason. */
  signal?: AbortSignal | undefined;
  /** What is drawn from the first picture on: changes as for `set`, of which all that fits the volume is used. */
  state?: ViewerChanges;
  /** The first request, as for `refine`: what it needs is fetched as soon as the base mesh has arrived. A later one replaces it. */
  request?: ViewerRefineOptions | undefined;
}

/** A volume that has been opened. */
export interface OpenedVolume {
  info: MtInfo;
  /**
   * What of the scene did not fit this volume, and is not drawn: fields that it does not have, values that none of its fields has,
   * planes, boxes and points elsewhere. `state` is what is drawn. Empty where all of it fits.
   */
  dropped: Misfit[];
  /** Its URL or kind. */
  name: string;
  /** Its size in bytes where that is known. */
  total: number | undefined;
  /**
   * Resolves when the whole file has arrived; for a file that is fetched in parts, when everything that the first
   * request needs has arrived. Rejects with the error of the download.
   */
  finished: Promise<void>;
}

export interface ViewerOptions {
  signal?: AbortSignal;
  /**
   * How long a picture should take while something moves, in milliseconds; 60 without it. Where pictures take longer, they are drawn
   * without shade and with rough edges, then with fewer pixels, then with fewer tetrahedra; at rest they get sharp again. `Infinity`
   * always draws everything.
   */
  frameTime?: number;
  /**
   * What it draws with, for tests: without it WebGPU, or WebGL 2 where there is no WebGPU.
   *
   * @throws {TetralodError} `no-webgpu` if the browser does not have it
   */
  renderer?: "webgpu" | "webgl" | undefined;
  /** A worker that you have made of `tetralod/viewer-worker`; it belongs to the viewer from then on. Default: its own. */
  worker?: true | Worker;
  /**
   * The address of the worker's file, as your server or bundler gives it: that of `tetralod/viewer-worker`. A relative address is
   * relative to the page. From another origin (a CDN), which must allow it by CORS, it is started by a small worker that
   * imports it. Default: the file beside this module.
   *
   * @example
   * await Viewer.create(canvas, { workerUrl: "/assets/viewer-worker.js", wasmUrl: "/assets/viewer.wasm" });
   * @throws {TetralodError} `worker` if nothing starts there, or a worker of another version
   */
  workerUrl?: string | URL;
  /**
   * How long the worker may take to load its script and answer, in milliseconds: a number of at least 0, `Infinity` for any time.
   * Default 30 000. Its work, and the download of the wasm file, are not limited by this.
   *
   * @example
   * await Viewer.create(canvas, { workerTimeoutMs: 5000 });
   * @throws {TetralodError} `worker` if it does not answer in time
   */
  workerTimeoutMs?: number;
  /**
   * The address of the wasm file, `tetralod/viewer.wasm`. A relative address is relative to the page. Default: the file beside
   * the worker's.
   *
   * @throws {TetralodError} `wasm` if it cannot be loaded or compiled
   */
  wasmUrl?: string | URL;
  /** The URL of the volume that is opened first: its first bytes are fetched while the wasm module loads. */
  prefetch?: string | URL;
}

export interface ViewerEventMap {
  progress: CustomEvent<ViewerProgress>;
  stats: CustomEvent<ViewerStats>;
  frame: CustomEvent<ViewerFrame>;
  /** The camera has moved. */
  camera: CustomEvent<CameraState>;
  /** The colours mean something else. */
  legend: CustomEvent<Legend | undefined>;
  /** The GPU was lost, as when its driver is reset, and has been opened again. All is drawn as before. */
  restored: CustomEvent<{ adapter: string }>;
  /** What an overlay draws has changed, with the picture that has just been drawn. */
  overlay: CustomEvent<Overlay | undefined>;
  error: CustomEvent<Error>;
}

const NO_WEBGPU =
  "this browser has no WebGPU; use a current Chrome, Edge, Firefox or Safari over https (or on localhost)";
const NO_ADAPTER =
  "the browser gives no GPU adapter; allow hardware acceleration in its settings, or update the graphics driver";
const NEITHER =
  "this browser has no WebGPU and no WebGL 2; use a current Chrome, Edge, Firefox or Safari, and allow hardware acceleration in its settings";
const NO_WEBGL = "this browser has no WebGL 2; allow hardware acceleration in its settings, or update the graphics driver";

const NO_PAGE = 'a viewer draws on a canvas of a page; elsewhere, use MultiTessellation of "tetralod"';
const USED_CANVAS =
  "`canvas` belongs to another viewer, or has a context of its own; free that viewer first, or give each a canvas of its own";

/** The worker of a viewer. */
const VIEWER: Kind = {
  name: "viewer",
  entry: "tetralod/viewer-worker",
  start: startViewer,
  script: viewerScript,
  remedy: viewerRemedy,
};

/** A GPU that is lost is opened again after these waits (in ms): drivers take some time to start. */
const WAITS = [0, 500, 2000, 8000];

/** Who asks for no mesh so long after a volume has been opened (in ms) gets the one that the picture needs. */
const UNASKED = 100;

/** Canvases that were handed over, which can be done once: who draws on them now. */
const holders = new WeakMap<HTMLCanvasElement, Viewer | undefined>();

/** A caller that waits for a mesh, by the number of its request. */
type Waiting = Deferred<ViewerStats> & { goal: number };

/**
 * Draws an MT on a canvas with WebGPU, or WebGL 2 where there is none; decoding, refinement and drawing happen in a worker.
 *
 * Calls that are faster than the worker replace each other: only the last one is carried out.
 *
 * ```js
 * const viewer = await Viewer.create(document.querySelector("canvas"));
 * const { info } = await viewer.open("bucky.mt");
 * await viewer.refine({ error: "1%" });
 * const [{ min, max }] = info.fields;
 * await viewer.set({ isosurfaces: [{ value: min + 0.6 * (max - min), opacity: 0.5 }], volume: {} });
 * ```
 */
export class Viewer extends withMeshTools<AwaitOptions & { request?: never }, ViewerEventMap>() {
  #remote: Remote<ViewerMethods>;
  #canvas: HTMLCanvasElement;
  #observer: ResizeObserver | undefined;
  /** What the picture is on where the canvas cannot show another one. */
  #cover: HTMLCanvasElement | undefined;
  #info: MtInfo | undefined;
  #device: { renderer: RendererName; adapter: string; isSoftware: boolean } = { renderer: "webgpu", adapter: "", isSoftware: false };
  #stream: AbortController | undefined;
  /** For a file in parts: resolves when a mesh is requested. */
  #requested: (() => void) | undefined;
  #setRequest = new Latest((options: Unchecked) => this.#remote.call("setRequest", [options]));
  #waiting: Waiting[] = [];
  #update = new Latest((changes: Update) => this.#remote.call("update", [changes]), mergeUpdates);
  #drag = new Latest(([handle, x, y]: [number, number, number]) => this.#remote.call("dragRegion", [handle, x, y]));
  #pick = new Latest(([x, y]: [number, number]) => this.#remote.call("pick", [x, y]));
  /** What is drawn, and changes of it that are on their way, by their numbers. */
  #scene: SceneState = {};
  #changes = new Map<number, Unchecked>();
  #sets = 0;
  #camera: CameraState | undefined;
  #frameTime = 60;
  #legend: Legend | undefined;
  #overlay: Overlay | undefined;
  /** Of the canvas, in pixels. */
  #size: [number, number] = [1, 1];

  /** Rejects with code `no-webgpu`, and the reason, if neither WebGPU nor WebGL 2 is available. */
  static async check(): Promise<void> {
    await rendererOfPage();
  }

  /**
   * Hands the canvas to a worker; rejects with code `no-webgpu` before that if there is neither WebGPU nor WebGL 2. One viewer at a time can have a
   * canvas: free it before you make another one, and pass a `signal` to give up one that is being made.
   */
  static async create(canvas: HTMLCanvasElement, options: ViewerOptions = {}): Promise<Viewer> {
    const { signal, frameTime = 60, prefetch, renderer, ...places } = options;
    signal?.throwIfAborted();
    checkNames(places, PLACES, ["signal", "frameTime", "prefetch", "renderer"]);
    if (renderer !== undefined && renderer !== "webgpu" && renderer !== "webgl") throw badOption("renderer", 'must be "webgpu" or "webgl"');
    checkAmount("frameTime", frameTime, 1);
    if (typeof HTMLCanvasElement === "undefined") throw new TetralodError("no-webgpu", NO_PAGE);
    if (!(canvas instanceof HTMLCanvasElement)) {
      throw new TetralodError("bad-option", "`canvas` must be a canvas element");
    }
    // An adapter takes a browser some time, in which the worker loads.
    const checked = rendererOfPage(renderer);
    checked.catch(() => {});
    if (!webGpu()) await checked;
    const viewer = new Viewer(canvas, places);
    viewer.#frameTime = frameTime;
    try {
      const [wasm, ahead] = [absoluteHref("wasmUrl", places.wasmUrl), absoluteHref("prefetch", prefetch)];
      const loaded = checkWorker(VIEWER, viewer.#remote.call("load", [wasm ?? (await viewerWasm()), ahead]));
      loaded.catch(() => {});
      const found = await checked;
      signal?.throwIfAborted();
      await loaded;
      signal?.throwIfAborted();
      await viewer.#start(frameTime, found);
      signal?.throwIfAborted();
    } catch (error) {
      viewer.free();
      throw error;
    }
    return viewer;
  }

  private constructor(canvas: HTMLCanvasElement, places: ViewerOptions) {
    super();
    setCaller(this, (method, args, request) => {
      if (request !== undefined) throw badOption("request", "a viewer has one mesh; open the volume as MultiTessellation, too");
      return this.#remote.call(method, args as Parameters<ViewerMethods[typeof method]>) as Promise<any>;
    });
    this.#canvas = canvas;
    this.#remote = startWorker<ViewerMethods>(VIEWER, places, (name, data) => this.#heard(name, data));
  }

  async #start(frameTime: number, renderer: RendererName) {
    const offscreen = this.#handOver();
    const [width, height] = (this.#size = pixels(this.#canvas.getBoundingClientRect()));
    this.#device = await this.#remote.call("create", [offscreen, width, height, devicePixelRatio, frameTime, renderer], [offscreen]);
    this.#observer = new ResizeObserver(([entry]) => {
      const size = entry.devicePixelContentBoxSize?.[0];
      const [w, h] = size ? [size.inlineSize, size.blockSize] : pixels(entry.contentRect);
      if (this.#cover) this.#cover.style.cssText = coverStyle(this.#canvas);
      this.#size = [Math.max(1, w), Math.max(1, h)];
      // A viewer that is freed has no size.
      this.#change({ size: [...this.#size, devicePixelRatio] }).catch(() => {});
    });
    try {
      this.#observer.observe(this.#canvas, { box: "device-pixel-content-box" });
    } catch {
      // Safari does not support device pixels here.
      this.#observer.observe(this.#canvas);
    }
  }

  /** A canvas can be handed to a worker once: another one covers it where that has been done. */
  #handOver(): OffscreenCanvas {
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

  #heard(name: string, data: any) {
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
  async #restore(error: unknown) {
    for (const wait of WAITS) {
      await new Promise((resolve) => setTimeout(resolve, wait));
      const cover = coverOf(this.#canvas);
      const offscreen = cover.transferControlToOffscreen();
      const [width, height] = pixels(this.#canvas.getBoundingClientRect());
      try {
        this.#device = await this.#remote.call("restore", [offscreen, width, height, devicePixelRatio], [offscreen]);
        this.#cover?.remove();
        this.#canvas.after(cover);
        this.#cover = cover;
        this.#emit("restored", { adapter: this.#device.adapter });
        return;
      } catch (again) {
        error = again;
      }
    }
    this.#emit("error", error);
  }

  #failed(goal: number, error: TetralodError) {
    if (!this.#settle(goal, ({ reject }) => reject(error))) this.#emit("error", error);
  }

  /** Settles the callers that wait for this request or one that it has replaced; returns whether there were any. */
  #settle(goal: number, how: (waiting: Waiting) => void): boolean {
    const settled = this.#waiting.filter((waiting) => waiting.goal <= goal);
    this.#waiting = this.#waiting.filter((waiting) => waiting.goal > goal);
    settled.forEach(how);
    return settled.length > 0;
  }

  #emit(name: string, detail: unknown) {
    this.dispatchEvent(new CustomEvent(name, { detail }));
  }

  /** The description of the volume; `undefined` until its base mesh has arrived. */
  get info(): MtInfo | undefined {
    return this.#info;
  }

  /** What draws: WebGPU, or WebGL 2 where there is no WebGPU. It draws all but volumes, and no shade in hollows. */
  get renderer(): "webgpu" | "webgl" {
    return this.#device.renderer;
  }

  /** The name of the GPU; empty where the browser does not say it. */
  get adapter(): string {
    return this.#device.adapter;
  }

  /** Whether the browser has no GPU to draw with, so that the processor draws, which is slower. */
  get isSoftware(): boolean {
    return this.#device.isSoftware;
  }

  /** What the colours mean; `undefined` where nothing is coloured by values. */
  get legend(): Legend | undefined {
    return this.#legend;
  }

  /** What an overlay over the last picture draws; `undefined` until the base mesh has arrived. */
  get overlay(): Overlay | undefined {
    return this.#overlay;
  }

  /** As in `ViewerOptions`; it can be changed. */
  get frameTime(): number {
    return this.#frameTime;
  }

  set frameTime(milliseconds: number) {
    checkAmount("frameTime", milliseconds, 1);
    this.#frameTime = milliseconds;
    this.#remote.call("setFrameTime", [milliseconds]).catch(() => {});
  }

  /** All that is set, as plain data: `set` takes it. */
  get state(): ViewerState {
    return structuredClone({ ...[...this.#changes.values()].reduce<SceneState>(changedScene, this.#scene), camera: this.#camera });
  }

  /**
   * Opens a volume in place of the one before; resolves when its base mesh has been drawn. URLs are fetched in parts where
   * the server gives byte ranges: the mesh is refined as blocks arrive. Without a call of `refine` the mesh becomes the one that the
   * picture needs, within a pixel, of at most 500 000 tetrahedra: `refine({ view: { pixels: 1, outside: "10%" }, maxTets: 500_000 })`.
   *
   * What was drawn before is drawn of this volume, too, as far as it fits; `dropped` of the result says what does not.
   *
   * @example
   * const { info, dropped } = await viewer.open("flow.mt", { state: { streamlines: { fields: ["u", "v", "w"], seeds: [[0, 0, 0]] } } });
   * for (const { part, problem } of dropped) console.warn(`${part}: ${problem}`);
   * @throws {TetralodError} when the source cannot be read or is not an MT file; what was open stays, unless it came as a stream
   */
  async open(source: Source, options: ViewerOpenOptions = {}): Promise<OpenedVolume> {
    const { signal, state, request, ...how } = options;
    signal?.throwIfAborted();
    const first = request && sendable(request, true);
    const fetching = { ...openOptions(how, ["signal", "state", "request"]), state: sendable(state ?? {}, true) as ViewerChanges, request: first };
    this.#stream?.abort(new DOMException("another volume was opened", "AbortError"));
    const control = new AbortController();
    this.#stream = control;
    const stopped = signal ? AbortSignal.any([signal, control.signal]) : control.signal;
    const ranges = fetching.whole ? undefined : rangesOf(source, fetching);
    const inParts = ranges && (await this.#openParts(fetching, ranges, stopped));
    if (inParts) return inParts;
    const opened = await openSource(source, stopped, fetching);
    await this.#remote.call("clear", [fetching.fields, fetching.state, first]);
    stopped.throwIfAborted();
    this.#info = undefined;
    const { promise: ready, resolve, reject } = deferred<Pick<OpenedVolume, "info" | "dropped">>();
    const finished = this.#read(opened, stopped, resolve).catch((error) => {
      throw naming(opened.name, error);
    });
    finished.catch(reject);
    const { info, dropped } = await ready;
    // A failure after this point rejects `finished`, which may have no handler.
    finished.catch((error) => {
      if (known(error).name !== "AbortError") this.#emit("error", error);
    });
    return { info, dropped, name: opened.name, total: opened.total, finished };
  }

  async #openParts(
    { whole: _, ...fetching }: Fetching & { state: ViewerChanges; request?: Unchecked | undefined },
    { url, ...along }: RangesSource,
    signal: AbortSignal,
  ): Promise<OpenedVolume | undefined> {
    const { promise, resolve } = deferred<void>();
    signal.addEventListener("abort", () => this.#remote.call("halt", []).catch(() => {}), { once: true });
    const opened = await abortable(this.#remote.call("openParts", [url, { ...fetching, ...along }], transferOf(along)), signal);
    if (!opened?.info) return undefined;
    const { info, scene = {}, dropped = [], progress } = opened;
    [this.#info, this.#scene] = [info, scene];
    if (fetching.request) resolve();
    const unasked = setTimeout(() => this.#remote.call("follow", []).then(resolve, () => {}), UNASKED);
    this.#requested = () => {
      clearTimeout(unasked);
      resolve();
    };
    signal.addEventListener("abort", () => clearTimeout(unasked), { once: true });
    const finished = abortable(promise.then(() => this.#atRest()), signal);
    // The worker reports errors by itself.
    finished.catch(() => {});
    this.#emit("progress", progress);
    return { info, dropped, name: along.name ?? url, total: progress.total, finished };
  }

  /**
   * Resolves when the viewer is at rest: all that was set has reached it, the mesh is what was asked for, for the camera as it is, all
   * data that it needs has arrived, and the picture shows it. Pages that are hidden draw no pictures, and wait for none. Rejects with the
   * error that prevents it.
   */
  async settled(options: { signal?: AbortSignal | undefined } = {}): Promise<void> {
    const { signal } = options;
    signal?.throwIfAborted();
    await abortable(this.#atRest().then(() => this.#pictured()), signal);
  }

  /** Resolves when the mesh is at rest. */
  async #atRest() {
    await this.#sent();
    await this.#remote.call("settled", []);
  }

  /** Resolves when the picture shows what is set, or the page is hidden. */
  async #pictured() {
    if (document.hidden) return;
    const { promise: hidden, resolve } = deferred<unknown>();
    document.addEventListener("visibilitychange", resolve);
    try {
      await Promise.race([this.#remote.call("pictured", []), hidden]);
    } finally {
      document.removeEventListener("visibilitychange", resolve);
    }
  }

  /** Resolves when the worker has all that was set. */
  async #sent() {
    await Promise.all([this.#update.idle(), this.#setRequest.idle()]);
  }

  override async hash(): Promise<string> {
    await this.#sent();
    return super.hash();
  }

  /** Continues such a file after an error. Rejects with `changed` if it was replaced on the server: open it again. */
  async retry(): Promise<void> {
    await this.#remote.call("retry", []);
  }

  async #read(opened: OpenSource, signal: AbortSignal, ready: (met: Pick<OpenedVolume, "info" | "dropped">) => void): Promise<void> {
    const { total } = opened;
    const feed = async (chunk: Uint8Array<ArrayBuffer>) => {
      const { progress, info, scene = {}, dropped = [] } = await this.#remote.call("feed", [chunk], [chunk.buffer]);
      signal.throwIfAborted();
      if (info) {
        [this.#info, this.#scene] = [info, scene];
        ready({ info, dropped });
      }
      this.#emit("progress", { ...progress, total });
    };
    const finish = async () => {
      const progress = await this.#remote.call("finish", []);
      this.#emit("progress", { ...progress, total: total ?? progress.bytes });
    };
    await pump(opened, { feed, finish }, signal);
  }

  /**
   * Requests another mesh. While the file streams in, and with the camera's own view while that moves, the mesh follows
   * this request. Resolves when the mesh is what the data that has arrived allows; a call that was replaced resolves together with the later
   * one. If more data is on its way, `limitedBy` of the answer is `"network"`: `settled` waits for all of it. A request that is refused, with
   * code `bad-option`, changes nothing.
   *
   * `signal` ends the wait: the call rejects with the signal's reason, by default an `AbortError`, and the request before it holds
   * again.
   *
   * @example
   * await viewer.refine({ view: { pixels: 1, outside: "10%" }, maxTets: 300_000 });
   * @example
   * const { limitedBy } = await viewer.refine({ error: "0.1%" }, { signal: AbortSignal.timeout(2000) });
   * if (limitedBy === "network") await viewer.settled();
   */
  async refine(options: ViewerRefineOptions = {}, how: { signal?: AbortSignal | undefined } = {}): Promise<ViewerStats> {
    const { signal, ...others } = how;
    checkNames(others, [], ["signal"]);
    signal?.throwIfAborted();
    const goal = await this.#setRequest.call(sendable(options, true));
    this.#requested?.();
    const waiting = { goal, ...deferred<ViewerStats>() };
    this.#waiting.push(waiting);
    if (!signal) return waiting.promise;
    return abortable(waiting.promise, signal).catch((error) => {
      if (signal.aborted) this.#giveUp(waiting);
      throw error;
    });
  }

  /** Others may wait for the same mesh. */
  #giveUp(waiting: Waiting) {
    this.#waiting = this.#waiting.filter((other) => other !== waiting);
    if (!this.#waiting.some(({ goal }) => goal === waiting.goal)) this.#remote.call("abandon", [waiting.goal]).catch(() => {});
  }

  /**
   * Keeps a copy of the mesh as it is, with all fields, in place of one that was kept before; another volume forgets it.
   *
   * @example
   * await viewer.refine({ error: "10%" });
   * await viewer.keep();
   * await viewer.refine({ error: "1%" });
   * await viewer.set({ compare: { at: 0.5 } }); // coarse on the left, fine on the right
   */
  async keep(): Promise<void>;
  /**
   * Keeps the mesh of another viewer, as its `mesh` gives it: with `compare: { at: 0, difference: true }` the mesh is coloured by its field
   * minus that of the other one, where that has a field of the same name and time. Nothing else is drawn of the other mesh. Points farther than
   * `reach` outside of it (in model units; any distance without it) have no value, and their tetrahedra are not shown: `legend.apart` counts
   * them. Points outside that are nearer are compared with its boundary. What is shown is right within the sum of both errors.
   *
   * @example
   * await viewer.keep(await other.mesh({ fields: ["p"] }), { reach: 0.01 });
   * await viewer.set({ compare: { at: 0, difference: true } });
   * @throws {TetralodError} `bad-option` if it is no mesh
   */
  async keep(mesh: Pick<Mesh, "positions" | "origin" | "tets" | "fields">, how?: { reach?: number }): Promise<void>;
  async keep(mesh?: Pick<Mesh, "positions" | "origin" | "tets" | "fields">, how: { reach?: number } = {}): Promise<void> {
    checkNames(how, ["reach"]);
    await this.#remote.call("keep", mesh ? [{ ...keptOf(mesh), reach: how.reach ?? Infinity }] : []);
  }

  /**
   * Keeps the mesh as it is, wherever the camera goes and whatever is requested, to look at it from elsewhere; with `false`
   * it follows again. Requests wait meanwhile.
   */
  async freeze(on = true): Promise<void> {
    await this.#remote.call("freeze", [Boolean(on)]);
  }

  #change(changes: Update) {
    return this.#update.call(changes);
  }

  /**
   * Changes what is drawn, and the camera: what is named replaces what was there, `null` gives it its default, all else
   * stays. Rejects with code `bad-option`, and changes nothing, if something is wrong: a value, or a field that the volume does not
   * have. Before a volume is open, any names of fields will do: see `dropped` of `open`.
   *
   * @example
   * await viewer.set({ isosurfaces: [], slices: [{ normal: [0, 0, 1], offset: 0.5 }], colours: { map: "magma" } });
   */
  async set(changes: ViewerChanges = {}): Promise<void> {
    const { camera, ...given } = changes;
    const sent = sendable(given, true);
    const id = this.#sets++;
    this.#changes.set(id, sent);
    try {
      // What is wrong in one call is no reason to refuse another one that was sent with it.
      const { scene, refused } = await this.#change({ sets: [{ id, changes: sent, camera }] });
      this.#scene = scene;
      if (refused[id]) throw reviveError(refused[id]);
    } finally {
      this.#changes.delete(id);
    }
  }

  /** Rotates the model to the right and upwards, in radians. */
  async orbit(right: number, up: number): Promise<void> {
    await this.#change({ orbit: [right, up] });
  }

  /** Multiplies the distance to the model; the point of the canvas (−1 to 1, y upwards; its middle) stays where it is. */
  async zoom(factor: number, x = 0, y = 0): Promise<void> {
    await this.#change({ zoom: [factor, x, y] });
  }

  /** Moves the picture by fractions of the canvas's height. */
  async pan(right: number, up: number): Promise<void> {
    await this.#change({ pan: [right, up] });
  }

  /** Shows the whole model from the front. */
  async home(): Promise<void> {
    await this.#change({ home: true });
  }

  /** Shows the whole model from a side. */
  async lookFrom(side: "home" | "alongX" | "againstX" | "alongY" | "againstY" | "alongZ" | "againstZ"): Promise<void> {
    await this.#change({ side });
  }

  /** Moves the eye to the right, up and ahead, by multiples of its distance to the model. */
  async fly(right: number, up: number, ahead: number): Promise<void> {
    await this.#change({ fly: [right, up, ahead] });
  }

  /** Turns the eye where it is, to the right and upwards, in radians. */
  async look(right: number, up: number): Promise<void> {
    await this.#change({ look: [right, up] });
  }

  /** What is shown at a point of the canvas (−1 to 1, y upwards); `undefined` if nothing is there. */
  async pick(x: number, y: number): Promise<Reading | undefined> {
    return this.#pick.call([x, y]);
  }

  /** What is at a point of the model, in the current mesh; `undefined` outside of it. */
  async reading(point: ArrayLike<number> & Iterable<number>): Promise<Reading | undefined> {
    const [x, y, z] = point;
    return this.#remote.call("reading", [x, y, z]);
  }

  /**
   * A picture of what is drawn, as a PNG of any size; the size of the canvas without one. It is the mean of `samples` pictures (16
   * without it, at most 256), so that edges are smooth. Frames wait until it is ready.
   *
   * @example
   * const blob = await viewer.screenshot({ width: 3840, height: 2160, background: "transparent" });
   */
  async screenshot(options: {
    width?: number;
    height?: number;
    samples?: number;
    /** That of the scene without it. */
    background?: SceneState["background"];
    signal?: AbortSignal | undefined;
  } = {}): Promise<Blob> {
    const { width = this.#size[0], height = this.#size[1], samples = 16, background, signal } = options;
    for (const [name, value] of Object.entries({ width, height, samples })) {
      if (!(Number.isInteger(value) && value > 0)) throw badOption(name, "must be a positive integer");
    }
    signal?.throwIfAborted();
    return abortable(this.#remote.call("screenshot", [width, height, samples, background]), signal);
  }

  /** The handle of the region (0 to 5: lower and upper x, y, z) at a point of the canvas (−1 to 1, y upwards), or −1. */
  async pickRegion(x: number, y: number): Promise<number> {
    return this.#remote.call("pickRegion", [x, y]);
  }

  /** Moves a handle of the region under a point; resolves to the new box. */
  async dragRegion(handle: number, x: number, y: number): Promise<number[]> {
    const region = await this.#drag.call([handle, x, y]);
    this.#scene = { ...this.#scene, region };
    return region;
  }

  /**
   * A copy of the mesh that is shown, in arrays that belong to the caller.
   *
   * @example
   * const { positions, tets, fields } = await viewer.mesh({ fields: true });
   */
  async mesh(how: FieldOptions = {}): Promise<Mesh> {
    checkNames(how, ["fields"]);
    return this.#remote.call("mesh", [how.fields]);
  }

  /** Where the blocks of the file are, and which of them are here; `undefined` for a file without blocks. */
  async blockMap(): Promise<BlockMap | undefined> {
    return this.#remote.call("blockMap", []);
  }

  /**
   * Stops the worker. Pending and later calls reject with code `freed`. Another viewer can be made of the canvas then, as React's
   * `StrictMode` does: since a browser hands a canvas to a worker only once, the picture of that one is on a canvas of its own, which
   * lies over this one, lets the pointer through, and goes when that viewer is freed.
   */
  free(): void {
    this.#cover?.remove();
    if (holders.get(this.#canvas) === this) holders.set(this.#canvas, undefined);
    this.#stream?.abort(new DOMException("the viewer was freed", "AbortError"));
    this.#observer?.disconnect();
    const freed = new TetralodError("freed", "the viewer was freed");
    this.#remote.close(freed);
    this.#settle(Infinity, ({ reject }) => reject(freed));
  }

  /** The same as {@link Viewer.free}, for `using`. */
  [DISPOSE](): void {
    this.free();
  }
}

/** Absolute numbers of a mesh: positions, and the values of its fields. */
function keptOf(mesh: Pick<Mesh, "positions" | "origin" | "tets" | "fields">) {
  const { positions, tets, fields } = absolute(mesh);
  return {
    positions: Float64Array.from(positions),
    tets,
    fields: fields.map(({ name, time, values }) => ({ name, time, values: Float64Array.from(values) })),
  };
}

/** An error of the file's contents says which file. */
function naming(name: string, error: unknown): unknown {
  const isOfFile = error instanceof TetralodError && error.code !== "freed" && !error.message.startsWith(`${name}:`);
  return isOfFile ? ofFile(name, error) : error;
}

/** A canvas can be handed to a worker once. */
function handOver(canvas: HTMLCanvasElement): OffscreenCanvas {
  try {
    return canvas.transferControlToOffscreen();
  } catch (error) {
    throw new TetralodError("bad-option", USED_CANVAS, { cause: error });
  }
}

/** A canvas that covers another one, and lets the pointer through. */
function coverOf(canvas: HTMLCanvasElement): HTMLCanvasElement {
  const cover = document.createElement("canvas");
  // Not as an attribute, which a Content-Security-Policy forbids.
  cover.style.cssText = coverStyle(canvas);
  cover.ariaHidden = "true";
  return cover;
}

/** The style of a canvas that covers another one. */
function coverStyle({ offsetLeft, offsetTop, offsetWidth, offsetHeight }: HTMLElement): string {
  const place = `left: ${offsetLeft}px; top: ${offsetTop}px; width: ${offsetWidth}px; height: ${offsetHeight}px`;
  return `position: absolute; pointer-events: none; ${place}`;
}

/** WebGPU, where a browser has it. */
const webGpu = () => (globalThis.navigator as { gpu?: { requestAdapter(): Promise<object | null> } } | undefined)?.gpu;

function hasWebGl(): boolean {
  if (typeof OffscreenCanvas === "undefined") return false;
  const context = new OffscreenCanvas(1, 1).getContext("webgl2");
  // Browsers allow few of them at a time.
  context?.getExtension("WEBGL_lose_context")?.loseContext();
  return Boolean(context);
}

/** What to draw with: that which is asked for, else the better one of those that there are. */
async function rendererOfPage(asked?: RendererName): Promise<RendererName> {
  const gpu = webGpu();
  if (asked !== "webgl" && (await gpu?.requestAdapter().catch(() => null))) return "webgpu";
  if (asked !== "webgpu" && hasWebGl()) return "webgl";
  throw new TetralodError("no-webgpu", asked === "webgl" ? NO_WEBGL : gpu ? NO_ADAPTER : asked ? NO_WEBGPU : NEITHER);
}

function pixels({ width, height }: { width: number; height: number }): [number, number] {
  const of = (length: number) => Math.max(1, Math.round(length * devicePixelRatio));
  return [of(width), of(height)];
}
