/// <reference lib="esnext.disposable" />
import type {
  BlockProgress,
  MtInfo,
  Need,
  ReadOptions,
  RefineOptions,
  RefineStats,
  Source,
  ViewOptions,
} from "./index.js";

export { TetralodError } from "./index.js";

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
  /** Triangles of the isosurface or of the cut-away view. */
  triangles: number;
  /** Bytes of the file that had been decoded. */
  bytes: number;
  /** Whether it shows a volume yet. */
  ready: boolean;
}

/** A volume that has been opened. */
export interface OpenedVolume {
  info: MtInfo;
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

/** A clip plane: the side that `normal` points to is hidden. */
export interface ClipPlane {
  normal: [number, number, number];
  /** `normal · p` of its points. */
  offset: number;
}

export interface ViewerEventMap {
  progress: CustomEvent<ViewerProgress>;
  stats: CustomEvent<ViewerStats>;
  frame: CustomEvent<ViewerFrame>;
  error: CustomEvent<Error>;
}

/**
 * Draws an MT on a canvas with WebGPU; decoding, refinement and drawing happen in a worker.
 *
 * Calls that are faster than the worker replace each other: only the last one is carried out.
 *
 * ```js
 * const viewer = await Viewer.create(document.querySelector("canvas"));
 * const { info } = await viewer.open("bucky.mt");
 * await viewer.refine({ error: "1%" });
 * await viewer.setIsovalue((info.fields[0].min + info.fields[0].max) / 2);
 * ```
 */
export class Viewer extends EventTarget {
  private constructor(canvas: HTMLCanvasElement);
  /** Rejects with code `no-webgpu`, and the reason, if WebGPU is not available. */
  static check(): Promise<void>;
  /** Transfers the canvas to the worker, permanently; rejects with code `no-webgpu` before that if there is no WebGPU. */
  static create(canvas: HTMLCanvasElement, options?: { signal?: AbortSignal }): Promise<Viewer>;

  /** The description of the volume; `undefined` until its base mesh has arrived. */
  readonly info: MtInfo | undefined;
  /** The name of the GPU. */
  readonly adapter: string;
  /** Sixteen evenly spaced colours of the colour map as CSS colours. */
  readonly palette: string[];

  /**
   * Opens a volume in place of the one before; resolves when its base mesh has been drawn. URLs are fetched in parts where
   * the server gives byte ranges: the mesh is refined as blocks arrive.
   */
  open(source: Source, options?: ReadOptions & { signal?: AbortSignal }): Promise<OpenedVolume>;
  /**
   * Of a file that is fetched in parts: resolves when all data that the mesh needs has arrived, rejects with the error
   * that prevents it.
   */
  settled(): Promise<void>;
  /** Continues such a file after an error. Rejects with `changed` if it was replaced on the server: open it again. */
  retry(): Promise<void>;
  /**
   * Requests another mesh. While the file streams in, and with the camera's own view while that moves, the mesh follows
   * this request. Resolves when the mesh is complete; a call that was replaced resolves together with the later one.
   *
   * @example
   * await viewer.refine({ view: { pixels: 1, outside: "10%" }, maxTets: 300_000 });
   */
  refine(options?: ViewerRefineOptions): Promise<ViewerStats>;
  setMode(mode: "iso" | "cutaway"): Promise<void>;
  /** In field units. */
  setIsovalue(value: number): Promise<void>;
  /** `null` hides nothing. */
  setClip(plane: ClipPlane | null): Promise<void>;
  /** Shows a box, `[x0, y0, z0, x1, y1, z1]`, with handles; `null` hides it. Pass `box` to `refine` to use it. */
  setRoi(box: ArrayLike<number> | null): Promise<void>;

  /** Rotates the model to the right and upwards, in radians. */
  orbit(right: number, up: number): Promise<void>;
  /** Multiplies the distance to the model. */
  zoom(factor: number): Promise<void>;
  /** Moves the picture by fractions of the canvas's height. */
  pan(right: number, up: number): Promise<void>;
  /** Shows the whole model from the front. */
  home(): Promise<void>;

  /** The handle (0 to 5: lower and upper x, y, z) at a point of the canvas (−1 to 1, y upwards), or −1. */
  pickRoi(x: number, y: number): Promise<number>;
  /** Moves a handle under a point; resolves to the new box. */
  dragRoi(handle: number, x: number, y: number): Promise<number[]>;

  /** A hash of the current mesh: the same request gives the same hash on every machine. */
  hash(): Promise<string>;
  /** Stops the worker; the canvas keeps its last picture. Pending and later calls reject with code `freed`. */
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
