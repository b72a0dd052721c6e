/// <reference lib="esnext.disposable" />
/**
 * Draws an MT on a canvas with WebGPU, and gives of its mesh what `MultiTessellation` gives.
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

import type {
  BlockProgress,
  FieldOptions,
  Mesh,
  MeshTools,
  MtInfo,
  Need,
  ReadOptions,
  RefineOptions,
  RefineStats,
  Source,
  ViewOptions,
} from "./index.js";

export { TetralodError, absolute } from "./index.js";

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
  /** Of such a file: requests so far, bytes that have arrived with them, and how many of these were needed. */
  traffic?: { requests: number; received: number; used: number };
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
  /** Bytes of the file that had been decoded. */
  bytes: number;
  /** Whether it shows a volume yet. */
  ready: boolean;
}

/** The blocks of a file in space, in the order of the file. */
export interface BlockMap {
  /**
   * Six numbers for each block, in model units: the lower and the upper corner of a box that holds all tetrahedra that the
   * block changes. Boxes overlap; those of the first blocks, which are the coarsest, are as large as the volume.
   */
  bounds: Float64Array;
  /** For each block 0: not fetched, 1: fetched, 2: fetched, and the current mesh uses it. */
  states: Uint8Array;
}

/** A part of a scene that does not fit a volume, and is left out. */
export interface Misfit {
  /** Its name, such as `slices[0].field`. */
  part: string;
  /** What is wrong, in words. */
  problem: string;
}

/** How a volume is opened. */
export interface ViewerOpenOptions extends ReadOptions {
  /** Ends the download; pending calls for it reject with the signal's reason. */
  signal?: AbortSignal | undefined;
  /** What is drawn from the first picture on: changes as for `set`, of which all that fits the volume is used. */
  state?: { [K in keyof ViewerState]?: ViewerState[K] | null };
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

/** A plane, `normal · p = offset`. As a clip plane it cuts away the side that `normal` points to. */
export interface PlaneState {
  /** Any length but zero. */
  normal: [number, number, number];
  /** `normal · p` of its points. */
  offset: number;
}

/** An isosurface. */
export interface IsosurfaceState {
  /** In field units; without it the middle of the field's range over all of its time steps. */
  value?: number;
  /** 0 to 1; 1 without it. */
  opacity?: number;
  /** `"#rrggbb"`, for both sides; without it, and without `field`, each side has a colour of its own. */
  colour?: string;
  /** The name of the field whose values colour it. */
  field?: string;
  /** Draws the sides of its facets. */
  edges?: boolean;
}

/** The volume, as emission and absorption. */
export interface VolumeState {
  /** Values in field units, ascending, each with an opacity (0 to 1); a ramp over the range of the colours without it. */
  opacities?: [value: number, opacity: number][];
  /** Values, each with red, green, blue and opacity (0 to 1): in place of `opacities` and the colours of the scene. */
  points?: [value: number, red: number, green: number, blue: number, opacity: number][];
  /** The way, in model units, that has these opacities; a tenth of the domain's diagonal without it. */
  unitLength?: number;
  /** Whether clip planes cut it; they do without it. */
  clipped?: boolean;
}

/** A section with a plane, coloured by a field. */
export interface SliceState extends PlaneState {
  /** 0 to 1; 1 without it. */
  opacity?: number;
  /** Draws the edges of the tetrahedra that it cuts. */
  edges?: boolean;
  /** The field that colours it; the one that is shown without it. */
  field?: string;
  /** Whether clip planes cut it; they do without it. */
  clipped?: boolean;
}

/** The surface of the domain. What clip planes cut open is closed. */
export interface BoundaryState {
  /** 0 to 1; 1 without it. */
  opacity?: number;
  /** Draws the edges of tetrahedra. */
  edges?: boolean;
  /** `"#rrggbb"`, in place of the colours of the values. */
  colour?: string;
  /** Whether clip planes cut it; they do without it. */
  clipped?: boolean;
}

/** The tetrahedra as they are. */
export interface CellState {
  /** `"solid"` without it. */
  shape?: "solid" | "wire" | "points";
  /** By which part of their size they are shrunk, 0 to 1. */
  shrink?: number;
  /** Leaves out tetrahedra, as a whole, with their centroid on the side that `normal` points to. */
  cut?: PlaneState;
  /** What colours them; the field without it. */
  colourBy?: "field" | "size" | "error" | "depth" | "block" | "missing";
  /** Whether edges are drawn; they are without it. */
  edges?: boolean;
  /** Width of wires and edges, in CSS pixels; points are four times as large. */
  width?: number;
}

/** Tubes along a vector field. */
export interface StreamlineState {
  /** The names of the fields along x, y and z. */
  fields: [string, string, string];
  /** Where they start, in model units. */
  seeds: [number, number, number][];
  /** In model units; 1/400 of the domain's diagonal without it. */
  radius?: number;
  /** The field that colours them; the speed without it, from 0 to the largest that the ranges of the components allow. */
  field?: string;
}

/** Arrows of a vector field. */
export interface ArrowState {
  /** The names of the fields along x, y and z. */
  fields: [string, string, string];
  /** From one to the next, in model units; 1/20 of the domain's diagonal without it. */
  spacing?: number;
  /** The field that colours them; the magnitude without it, with the colours of the speed of `streamlines`. */
  field?: string;
  /** Makes all of one length. */
  constant?: boolean;
}

/** Two meshes beside each other. */
export interface CompareState {
  /** Where the kept one ends and the current one begins, as a fraction of the width; 0.5 without it. */
  at?: number;
  /**
   * Colours the current one by its field minus that of the kept one, with a range that is symmetric around 0; `"coolwarm"` or
   * another diverging map shows it best.
   */
  difference?: boolean;
}

/** The colours of values. */
export interface ColourState {
  /** The name of a colour map, such as `"viridis"`, `"turbo"`, `"coolwarm"` or `"grey"`. */
  map?: string;
  /**
   * The values of the field that is shown with the first and the last colour. Without it, and for other fields: their range over all of
   * their time steps, so that a colour means the same at all times.
   */
  range?: [number, number];
  /** Lets the colours run backwards. */
  reversed?: boolean;
  /** A logarithmic scale; a `range` must be positive. Without one it has the positive part of the values, and is linear where there is none. */
  log?: boolean;
}

/** Where the camera is. */
export interface CameraState {
  /** What it looks at, in model units. */
  target: [number, number, number];
  /** From there to the eye, in model units. */
  distance: number;
  /** The turn around z, in radians. */
  yaw: number;
  /** How far it looks from above, in radians. */
  pitch: number;
  projection: "perspective" | "orthographic";
}

/** What is drawn: any of these at once, in exact order, also where they are transparent. */
export interface SceneState {
  isosurfaces?: IsosurfaceState[];
  volume?: VolumeState;
  slices?: SliceState[];
  boundary?: BoundaryState;
  cells?: CellState;
  streamlines?: StreamlineState;
  arrows?: ArrowState;
  /** Planes that cut away; with a `clipBox`, which counts as six, at most 16. */
  clips?: PlaneState[];
  /** Everything outside of this box is cut away: `[x0, y0, z0, x1, y1, z1]`. */
  clipBox?: [number, number, number, number, number, number];
  colours?: ColourState;
  /** `"dark"` without it. */
  background?: "dark" | "light" | "transparent";
  /** How dark places get that hardly any light reaches, 0 to 1; 0.5 without it. */
  shade?: number;
  /** Whether the box around the domain is drawn; it is without it. */
  outline?: boolean;
  /** The mesh that was kept by `keep` on the left, the current one on the right. */
  compare?: CompareState;
  /** A box with handles. It is a picture only: pass `box` to `refine` to use it. */
  region?: ArrayLike<number>;
}

/** All that can be set: what is drawn, and where from. Plain data, for JSON and URLs. */
export interface ViewerState extends SceneState {
  camera?: CameraState;
}

/** What the colours of the picture mean. */
export interface Legend {
  /** The name of the field, or what tetrahedra are coloured by. */
  label: string;
  range: [number, number];
  log: boolean;
  /** Evenly spaced CSS colours from the lower to the upper end of the range. */
  colours: string[];
  /** The ends of the range, and round numbers between them, ascending; `fraction` is where the tick is in the range, 0 to 1. */
  ticks: { value: number; label: string; fraction: number }[];
}

/** What is at a point. */
export interface Reading {
  /** In model units. */
  position: [number, number, number];
  /** The value of each field, by its name; of fields with several time steps at the time that is shown. */
  values: Record<string, number>;
  /** The number of the tetrahedron in the current mesh. */
  tet: number;
  /** Its longest edge, in model units. */
  size: number;
  /** Its error, as a fraction of the field's range. */
  error: number;
}

export interface ViewerOptions {
  signal?: AbortSignal;
  /**
   * How long a picture should take while something moves, in milliseconds; 60 without it. Where pictures take longer, they
   * have fewer pixels, then fewer tetrahedra; at rest they get sharp again. `Infinity` always draws everything.
   */
  frameTime?: number;
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

/** An edge of the box around the domain that shows the ticks of an axis. */
export interface AxisOverlay {
  /** 0 to 2 for x, y, z. */
  axis: number;
  /** The ends of the edge's part on the canvas, at the smaller coordinate first. */
  ends: [[x: number, y: number], [x: number, y: number]];
  /** Where labels go: away from the box, a direction of length 1 in pixels, y upwards. */
  outward: [x: number, y: number];
  /** Ascending. */
  ticks: { label: string; at: [x: number, y: number] }[];
}

/** What an overlay over the picture draws. Points are points of the canvas: −1 to 1, y upwards. */
export interface Overlay {
  /** At most one for each axis; none for an axis that is seen end-on. */
  axes: AxisOverlay[];
  /**
   * A bar of a round length. `width` is its length as a fraction of the canvas's width. In perspective it holds at the distance
   * of the camera's target; `everywhere` is true where it holds at any distance.
   */
  scaleBar: { label: string; length: number; width: number; everywhere: boolean };
  /** Right, up and towards the eye, as directions in the model. */
  rotation: [right: number[], up: number[], towards: number[]];
  /** From the model to clip space, column by column: with it points of the model can be drawn over the picture. */
  matrix: number[];
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

declare const EventTargetWithMeshTools: { new (): EventTarget & MeshTools; prototype: EventTarget & MeshTools };

/**
 * Draws an MT on a canvas with WebGPU; decoding, refinement and drawing happen in a worker.
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
export class Viewer extends EventTargetWithMeshTools {
  private constructor(canvas: HTMLCanvasElement);
  /** Rejects with code `no-webgpu`, and the reason, if WebGPU is not available. */
  static check(): Promise<void>;
  /**
   * Hands the canvas to a worker; rejects with code `no-webgpu` before that if there is no WebGPU. One viewer at a time can have a
   * canvas: free it before you make another one, and pass a `signal` to give up one that is being made.
   */
  static create(canvas: HTMLCanvasElement, options?: ViewerOptions): Promise<Viewer>;

  /** The description of the volume; `undefined` until its base mesh has arrived. */
  readonly info: MtInfo | undefined;
  /** The name of the GPU. */
  readonly adapter: string;
  /** What the colours mean; `undefined` where nothing is coloured by values. */
  readonly legend: Legend | undefined;
  /** What an overlay over the last picture draws; `undefined` until the base mesh has arrived. */
  readonly overlay: Overlay | undefined;
  /** As in `ViewerOptions`; it can be changed. */
  frameTime: number;
  /** All that is set, as plain data: `set` takes it. */
  readonly state: ViewerState;

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
  open(source: Source, options?: ViewerOpenOptions): Promise<OpenedVolume>;
  /**
   * Resolves when the viewer is at rest: all that was set has reached it, the mesh is what was asked for, for the camera as it is, all
   * data that it needs has arrived, and the picture shows it. Pages that are hidden draw no pictures, and wait for none. Rejects with the
   * error that prevents it.
   */
  settled(options?: { signal?: AbortSignal | undefined }): Promise<void>;
  /** Continues such a file after an error. Rejects with `changed` if it was replaced on the server: open it again. */
  retry(): Promise<void>;
  /**
   * Requests another mesh. While the file streams in, and with the camera's own view while that moves, the mesh follows
   * this request. Resolves when the mesh is complete; a call that was replaced resolves together with the later one. A request that
   * is refused, with code `bad-option`, changes nothing.
   *
   * `signal` ends the wait: the call rejects with the signal's reason, by default an `AbortError`, and the request before it holds
   * again.
   *
   * @example
   * await viewer.refine({ view: { pixels: 1, outside: "10%" }, maxTets: 300_000 });
   * @example
   * await viewer.refine({ error: "0.1%" }, { signal: AbortSignal.timeout(2000) });
   */
  refine(options?: ViewerRefineOptions, how?: { signal?: AbortSignal | undefined }): Promise<ViewerStats>;
  /**
   * Keeps a copy of the mesh as it is, with all fields, in place of one that was kept before; another volume forgets it.
   *
   * @example
   * await viewer.refine({ error: "10%" });
   * await viewer.keep();
   * await viewer.refine({ error: "1%" });
   * await viewer.set({ compare: { at: 0.5 } }); // coarse on the left, fine on the right
   */
  keep(): Promise<void>;
  /**
   * Keeps the mesh as it is, wherever the camera goes and whatever is requested, to look at it from elsewhere; with `false`
   * it follows again. Requests wait meanwhile.
   */
  freeze(on?: boolean): Promise<void>;
  /**
   * Changes what is drawn, and the camera: what is named replaces what was there, `null` gives it its default, all else
   * stays. Rejects with code `bad-option`, and changes nothing, if something is wrong: a value, or a field that the volume does not
   * have. Before a volume is open, any names of fields will do: see `dropped` of `open`.
   *
   * @example
   * await viewer.set({ isosurfaces: [], slices: [{ normal: [0, 0, 1], offset: 0.5 }], colours: { map: "magma" } });
   */
  set(changes: { [K in keyof ViewerState]?: ViewerState[K] | null }): Promise<void>;

  /** Rotates the model to the right and upwards, in radians. */
  orbit(right: number, up: number): Promise<void>;
  /** Multiplies the distance to the model; the point of the canvas (−1 to 1, y upwards; its middle) stays where it is. */
  zoom(factor: number, x?: number, y?: number): Promise<void>;
  /** Moves the picture by fractions of the canvas's height. */
  pan(right: number, up: number): Promise<void>;
  /** Shows the whole model from the front. */
  home(): Promise<void>;

  /** Shows the whole model from a side. */
  lookFrom(side: "home" | "alongX" | "againstX" | "alongY" | "againstY" | "alongZ" | "againstZ"): Promise<void>;
  /** Moves the eye to the right, up and ahead, by multiples of its distance to the model. */
  fly(right: number, up: number, ahead: number): Promise<void>;
  /** Turns the eye where it is, to the right and upwards, in radians. */
  look(right: number, up: number): Promise<void>;

  /** What is shown at a point of the canvas (−1 to 1, y upwards); `undefined` if nothing is there. */
  pick(x: number, y: number): Promise<Reading | undefined>;
  /** What is at a point of the model, in the current mesh; `undefined` outside of it. */
  reading(point: ArrayLike<number> & Iterable<number>): Promise<Reading | undefined>;
  /**
   * A picture of what is drawn, as a PNG of any size; the size of the canvas without one. It is the mean of `samples` pictures (16
   * without it, at most 256), so that edges are smooth. Frames wait until it is ready.
   *
   * @example
   * const blob = await viewer.screenshot({ width: 3840, height: 2160, background: "transparent" });
   */
  screenshot(options?: {
    width?: number;
    height?: number;
    samples?: number;
    /** That of the scene without it. */
    background?: SceneState["background"];
    signal?: AbortSignal | undefined;
  }): Promise<Blob>;
  /** The handle of the region (0 to 5: lower and upper x, y, z) at a point of the canvas (−1 to 1, y upwards), or −1. */
  pickRegion(x: number, y: number): Promise<number>;
  /** Moves a handle of the region under a point; resolves to the new box. */
  dragRegion(handle: number, x: number, y: number): Promise<number[]>;

  /**
   * A copy of the mesh that is shown, in arrays that belong to the caller.
   *
   * @example
   * const { positions, tets, fields } = await viewer.mesh({ fields: true });
   */
  mesh(how?: FieldOptions): Promise<Mesh>;
  /** Where the blocks of the file are, and which of them are here; `undefined` for a file without blocks. */
  blockMap(): Promise<BlockMap | undefined>;
  /**
   * Stops the worker. Pending and later calls reject with code `freed`. Another viewer can be made of the canvas then, as React's
   * `StrictMode` does: since a browser hands a canvas to a worker only once, the picture of that one is on a canvas of its own, which
   * lies over this one, lets the pointer through, and goes when that viewer is freed.
   */
  free(): void;
  [Symbol.dispose](): void;

  addEventListener<K extends keyof ViewerEventMap>(
    type: K,
    listener: (event: ViewerEventMap[K]) => void,
    options?: boolean | AddEventListenerOptions,
  ): void;
  addEventListener(
    type: string,
    listener: EventListenerOrEventListenerObject | null,
    options?: boolean | AddEventListenerOptions,
  ): void;
}
