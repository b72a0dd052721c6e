/// <reference lib="esnext.disposable" />
/**
 * Very large tetrahedral volumes in a web page: an MT file is streamed, and selective refinement makes from it the
 * mesh that is needed now.
 *
 * ```js
 * import { MultiTessellation } from "tetralod";
 *
 * const mt = await MultiTessellation.open("combustor.mt", { onProgress: (p) => console.log(p.bytes, "of", p.total) });
 * const coarse = await mt.refine({ error: "5%" }, { partial: true });  // as far as what has arrived allows
 * const sharp = await mt.refine({ error: "0.1%", isovalues: [0.7], maxTets: 500_000 });
 * const surface = await mt.isosurface(0.7);
 * mt.free();
 * ```
 *
 * @module
 */

import type {
  BlockProgress,
  CoreStats,
  ErrorCurve,
  FieldError,
  FieldInfo,
  FieldStats,
  FieldValues,
  IsoSurface,
  LineProfile,
  Mesh,
  MeshChanges,
  MeshDelta,
  MtInfo,
  Need,
  Progress,
  RefineOptions,
  Slice,
  Stored,
  Streamline,
  Surface,
  TetBatch,
  TransferOptions,
  Vector,
  ViewOptions,
  Where,
} from "./tetralod_core.js";

export type {
  BlockProgress,
  ErrorCurve,
  FieldError,
  FieldInfo,
  FieldStats,
  FieldValues,
  IsoSurface,
  LineProfile,
  Mesh,
  MeshChanges,
  MeshDelta,
  MtInfo,
  Need,
  Progress,
  RefineOptions,
  Slice,
  Stored,
  Streamline,
  Surface,
  TetBatch,
  TransferOptions,
  Vector,
  ViewOptions,
  Where,
};

/** Everything that an MT can be read from. Bytes in memory are copied, not taken away. */
export type Source =
  | string
  | URL
  | Request
  | Response
  | Blob
  | ArrayBuffer
  | ArrayBufferView
  | ReadableStream<Uint8Array>
  | AsyncIterable<Uint8Array>;

/** How a source is read. */
export interface ReadOptions {
  /**
   * Names of the fields to read; the others are not downloaded, if the file is fetched in parts, and are not available.
   * Default: all.
   */
  fields?: readonly string[];
  /**
   * Bytes of memory for the blocks of a file that is fetched in parts. When they are used up, blocks that are no longer
   * needed are evicted; needed blocks that do not fit are not fetched (`progress.blocks.leftOut`). Default: 512 MiB.
   */
  memory?: number;
  /** The name of a cache (Cache Storage) in which the parts are kept for the next time. Default: none. */
  cache?: string;
  /** Whether to read the file as a whole, front to back. Default: only where the server gives no byte ranges. */
  whole?: boolean;
  /** Headers of every request for a URL; servers of other origins must allow them. */
  headers?: HeadersInit;
  /** Whether cookies are sent: as for `fetch`. */
  credentials?: RequestCredentials;
  /** How often a failed request for a part is repeated. Default: 5. */
  retries?: number;
  /** Milliseconds before the first of these; each later one waits about twice as long. Default: 500. */
  backoffMs?: number;
  /** A request fails after so many milliseconds without a byte. Default: 30000. */
  timeoutMs?: number;
  /** Ranges closer to each other than so many bytes are fetched as one. Default: 16384. */
  gap?: number;
}

/** A worker of `worker_threads`, in Node. */
export interface NodeWorker {
  postMessage(message: any, transfer?: readonly any[]): void;
  on(event: string, listener: (value: any) => void): unknown;
  terminate(): unknown;
}

export interface OpenOptions extends ReadOptions {
  /** Stops the download; pending calls reject with the signal's reason, by default an `AbortError`. */
  signal?: AbortSignal;
  /** Called whenever something has arrived and been decoded. */
  onProgress?: (progress: Progress) => void;
  /**
   * Whether decoding and refinement run in a worker of their own (a Web Worker; in Node a `worker_threads` worker), so
   * that the caller's thread never stalls. Default true. With false everything runs in the caller's thread: simpler to
   * debug, and enough for scripts.
   *
   * Or a worker that you have made of `tetralod/worker`; it belongs to the volume from then on, and `free` ends it.
   */
  worker?: boolean | Worker | NodeWorker;
  /**
   * The address of the worker's file, as your server or bundler gives it: that of `tetralod/worker`. A relative address is
   * relative to the page. From another origin (a CDN), which must allow it by CORS, it is started by a small worker that
   * imports it. Default: the file beside this module.
   *
   * @example
   * await MultiTessellation.open(source, { workerUrl: "/assets/worker.js", wasmUrl: "/assets/core.wasm" });
   * @throws {TetralodError} `worker` if nothing starts there, or a worker of another version
   */
  workerUrl?: string | URL;
  /**
   * How long the worker may take to load its script and answer, in milliseconds: a number of at least 0, `Infinity` for any time.
   * Default 30 000. Its work, and the download of the wasm file, are not limited by this.
   *
   * @example
   * await MultiTessellation.open(source, { workerTimeoutMs: 5000 });
   * @throws {TetralodError} `worker` if it does not answer in time
   */
  workerTimeoutMs?: number;
  /**
   * The address of the wasm file, `tetralod/core.wasm`. A relative address is relative to the page. Default: the file beside the
   * worker's.
   *
   * @throws {TetralodError} `wasm` if it cannot be loaded or compiled
   */
  wasmUrl?: string | URL;
}

/** The work of a refinement, or of a step of one, and the quality of the mesh. */
export interface RefineStats extends CoreStats {
  /** Time of refinement, without making and sending the arrays. */
  milliseconds: number;
  /**
   * What keeps the mesh from being finer: `error`: it is as accurate as was asked for, or the finest that there is; `budget`: it has
   * as many tetrahedra as were allowed; `network`: data is on its way; `memory`: blocks that it needs do not fit into `memory`.
   * `undefined` until `done`.
   */
  limitedBy: "error" | "budget" | "network" | "memory" | undefined;
}

/** The arrays of a mesh. */
export type MeshArray = "positions" | "field" | "tets" | "neighbors";

/** Which fields come with a mesh or a surface, besides the one that is chosen. */
export interface FieldOptions {
  /**
   * All fields of the volume with `true`, or those of these names or numbers in `info.fields`; a name of several time steps is the first.
   * They are in `fields` of the result, in this order. Default: none.
   *
   * @example
   * const { positions, indices, fields } = absolute(await mt.isosurface(0.7, { fields: true }));
   * for (const { name, values } of fields) console.log(name, values[0]);
   * @throws {TetralodError} `bad-option` if there is no such field
   */
  fields?: boolean | readonly (string | number)[];
}

/** How a mesh is handed out. */
export interface ResultOptions<A extends MeshArray = MeshArray> extends FieldOptions {
  /** Whether to return at once what is possible with the data that has arrived. Default: false. */
  partial?: boolean;
  /** The arrays to return; none with `[]`. Default: all four. What you do not use need not be made and sent. */
  arrays?: readonly A[];
  /**
   * With `worker: false`: the arrays are those of the volume itself, in the memory of wasm, not copies. Read them at once: they
   * are valid until the next call of this or another volume in this thread, and must not be written to. Default: false.
   *
   * @throws {TetralodError} `bad-option` with a worker, and with `deltas`
   */
  zeroCopy?: boolean;
  /**
   * Ends the wait: the call rejects with the signal's reason, by default an `AbortError`. The mesh is valid, somewhere between the one
   * before and the one that was asked for; nothing more is fetched for the request, and what the one before it needs is fetched again.
   * A mesh that had been made just then is lost with it: where deltas are applied, the next call is one without `deltas`.
   *
   * @example
   * const mesh = await mt.refine({ error: "0.1%" }, { signal: AbortSignal.timeout(5000) });
   */
  signal?: AbortSignal | undefined;
}

/** The mesh after a refinement: a {@link Mesh} in arrays that belong to the caller, what changed in it, and the numbers. */
export interface RefineResult extends Mesh {
  /** Where this mesh differs from the one that was handed out before. */
  changes: MeshChanges;
  stats: RefineStats;
}

/** What a refinement changed. */
export interface RefineDelta extends MeshDelta {
  stats: RefineStats;
}

/** How far each step of a refinement goes. */
export interface StepOptions<A extends MeshArray = MeshArray> {
  /** About so many milliseconds. Default 8, or no limit if `updates` is given. */
  budgetMs?: number;
  /** So many updates. Default: no limit. */
  updates?: number;
  /** The arrays to return, as for `refine`. Default: all four. */
  arrays?: readonly A[];
  /** Ends the loop between two steps: it throws the signal's reason. The mesh stays as it is then. */
  signal?: AbortSignal;
}

/** What {@link absolute} makes of a result. */
export type Absolute<T> = {
  [K in keyof T]: K extends "positions" | "values" | "field"
    ? Float32Array | Float64Array | Extract<T[K], undefined>
    : K extends "fields"
      ? Absolute<FieldValues>[]
      : T[K];
};

/**
 * A mesh or a surface in absolute numbers, as files need them: positions in model units, values in units of their field; `origin`, `offset`
 * and `scale` are 0, 0 and 1. Arrays that were absolute, as most are, are the same ones; others are copies in double precision.
 *
 * @example
 * const { positions, values } = absolute(await mt.slice([0, 0, 1], 0.5));
 */
export function absolute<T extends Partial<Stored>>(stored: T): Absolute<T>;

/** A mesh without tetrahedra: {@link applyChanges} starts with it if no mesh has been returned before. */
export function emptyMesh(): Omit<RefineResult, "stats">;

/**
 * Applies `delta` to `mesh`, and returns it. The arrays are written where `delta.changes` says. Arrays that are too
 * short are replaced by larger ones, so read them from `mesh` each time.
 *
 * A delta applies to the mesh that was returned right before it, whole or as a delta; other meshes are refused. Arrays that the
 * delta lacks, as its `arrays` say, are removed from the mesh.
 *
 * @example
 * const mesh = emptyMesh();
 * applyChanges(mesh, await mt.refine({ error: "1%" }, { deltas: true }));
 */
export function applyChanges<M extends Partial<Mesh> & Pick<RefineResult, "changes">>(
  mesh: M,
  delta: Partial<MeshDelta> & Pick<MeshDelta, "changes" | "vertexCount" | "tetCount">,
): M;

/**
 * What can be got out of the current mesh: the same calls in `MultiTessellation` and in `Viewer`. `Aside` is what
 * `MultiTessellation` takes besides.
 */
export interface MeshTools<Aside = AwaitOptions & { request?: never }> {
  /**
   * The isosurface of the current mesh at one value or several, in units of the field, with the value of each vertex.
   * Normals point towards lower values: they are those of the field's gradient, or with `"smooth"` of the triangles.
   *
   * @example
   * const { positions, normals, indices } = await mt.isosurface(0.7);
   */
  isosurface(
    values: number | ArrayLike<number>,
    how?: { normals?: "gradient" | "smooth" } & FieldOptions & Aside,
  ): Promise<IsoSurface & { values: Float32Array }>;

  /**
   * The section of the current mesh with the plane of all points with `normal · p = offset`, facing the way the normal
   * points.
   *
   * @example
   * const cut = await mt.slice([0, 0, 1], 2.5);                       // z = 2.5
   */
  slice(normal: ArrayLike<number>, offset: number, how?: FieldOptions & Aside): Promise<Slice>;

  /** The boundary of the current mesh, facing outwards. */
  surface(how?: FieldOptions & Aside): Promise<Surface>;

  /** The field at some points, three coordinates each, in model units; NaN outside of the mesh. */
  probe(points: ArrayLike<number>, how?: Aside): Promise<Float64Array>;

  /** The field along a line, in parts that are linear. */
  line(from: ArrayLike<number>, to: ArrayLike<number>, how?: Aside): Promise<LineProfile>;

  /**
   * The streamlines from some seeds, three coordinates each, through the vector field whose components are three fields;
   * `undefined` for seeds outside of the mesh. `maxLength` is in model units.
   *
   * @example
   * const lines = await mt.streamlines(["u", "v", "w"], [0, 0, 0, 1, 0, 0]);
   */
  streamlines(
    fields: [string, string, string],
    seeds: ArrayLike<number>,
    how?: { backward?: boolean; maxLength?: number; maxSteps?: number } & Aside,
  ): Promise<(Streamline | undefined)[]>;

  /**
   * Volume, integral, mean and a histogram by volume (100 bins over the field's range, if not said otherwise); and the values
   * below which `fractions` (0 to 1) of the volume lie, as exactly as the bins are fine.
   *
   * @example
   * const { percentiles } = await mt.stats({ bins: 1000, fractions: [0.02, 0.98] });
   */
  stats(
    how?: {
      bins?: number;
      range?: ArrayLike<number>;
      fractions?: ArrayLike<number>;
    } & Aside,
  ): Promise<FieldStats>;

  /** A hash of the current mesh: the same request gives the same hash on every machine. A viewer gives it when it is at rest. */
  hash(): Promise<string>;
}

/** For a call that may take long. */
export interface AwaitOptions {
  /** Ends the wait: the call rejects with the signal's reason, by default an `AbortError`. The mesh stays as it is. */
  signal?: AbortSignal | undefined;
}

/** For a call that answers from another mesh. */
export interface AsideOptions extends AwaitOptions {
  /**
   * Answers from the mesh of this request, and leaves the current mesh as it is. It waits for the data that the request needs. There
   * is one more mesh for all such calls, as of {@link MultiTessellation.view}; a `field` is named in the request.
   *
   * @example
   * const { indices } = await mt.isosurface(0.7, { request: { error: "1%", isovalues: [0.7] } });
   * @throws {TetralodError} `bad-source` if the volume is a stream, which cannot be read again
   */
  request?: RefineOptions;
}

/** The events of a volume, each with its `detail`. */
export interface MultiTessellationEventMap {
  /** Something has arrived and been decoded: as `onProgress`. */
  progress: CustomEvent<Progress>;
  /** `refine` or a step of `refineSteps` has made a mesh. */
  stats: CustomEvent<RefineStats>;
  /** The download has ended with an error; `retry` continues where that is possible. */
  error: CustomEvent<Error>;
}

type Tools = EventTarget & MeshTools<AsideOptions>;
declare const WithMeshTools: { new (): Tools; prototype: Tools };

/**
 * A volume that is open. Calls are answered in the order in which they were made.
 */
export class MultiTessellation extends WithMeshTools {
  private constructor();

  /**
   * Opens a volume. Resolves as soon as its base mesh has arrived.
   *
   * A URL (text, `URL`, or a `Request` that gets) of `http` or `https` is fetched in parts, by byte ranges: only the
   * blocks that the request needs, most important first. In pages a `File` or `Blob` is read so, too, by slices. If the
   * server gives no ranges, with `whole`, and from all other sources, the rest arrives as a stream.
   *
   * @example
   * await MultiTessellation.open("https://example.org/combustor.mt");
   * @example
   * await MultiTessellation.open(fileInput.files[0]);
   * @example
   * await MultiTessellation.open(await readFile("combustor.mt"), { worker: false });
   * @throws {TetralodError} when the source cannot be read or is not an MT file
   */
  static open(source: Source, options?: OpenOptions): Promise<MultiTessellation>;

  /** What the file says about the volume. */
  readonly info: MtInfo;

  /** How much has arrived and been decoded; a new object each time. */
  readonly progress: Progress;

  /**
   * Of a stream: resolves when the whole file has been decoded.
   *
   * Of a file that is fetched in parts: another promise each time it is read, that resolves when everything that the
   * last request needs has arrived; at once before the first request. It does not change the mesh: call `refine`, which
   * waits by itself.
   *
   * Rejects with the error that ended the download; the data that has arrived stays usable.
   */
  readonly complete: Promise<void>;

  /**
   * Continues a file that is fetched in parts after an error. Until then, pending calls reject with that error.
   *
   * @throws {TetralodError} `changed` if the file was replaced on the server, `bad-source` if it is a stream: open it again
   */
  retry(): Promise<void>;

  /**
   * Refines the current mesh to a request and returns a copy of it. The cost grows with the difference from the last
   * mesh. It resolves when all data that the request needs has arrived. It rejects with `replaced` if another mesh is
   * requested before that, or with the error that ended the download; a request that is refused, with code `bad-option`, changes
   * nothing. With `partial` it resolves at once, with the best
   * mesh of the data that has arrived; `stats.missing` says whether more data is to come.
   *
   * @example
   * await mt.refine({ error: "1%" });                                  // within 1 % of the field's range everywhere
   * @example
   * await mt.refine({ error: 0.2, field: "T", box: [0, 0, 0, 1, 1, 2] });  // within 0.2 field units in the box
   * @example
   * await mt.refine({ isovalues: [0.5], maxTets: 100_000 });           // the best surface for 100,000 tetrahedra
   * @example
   * await mt.refine({                                                  // coarse everywhere, fine in two places
   *   error: "5%",
   *   needs: [
   *     { error: "0.5%", sphere: { center: [0, 0, 1], radius: 0.2 } },
   *     { error: "1%", slab: { normal: [0, 0, 1], offset: 0.5 } },
   *   ],
   * });
   * @example
   * const matrix = camera.projectionMatrix.clone().multiply(camera.matrixWorldInverse);  // three.js
   * await mt.refine({ view: { matrix, viewport: [width, height], pixels: 1, outside: "10%" }, maxTets: 500_000 });
   *
   * @example
   * const { positions, tets } = await mt.refine({ error: "1%" }, { arrays: ["positions", "tets"] });
   *
   * With `deltas` it returns only what has changed since the last returned mesh, for {@link applyChanges}.
   */
  refine<A extends MeshArray = MeshArray>(
    options?: RefineOptions,
    how?: ResultOptions<A> & { deltas?: false },
  ): Promise<Pick<RefineResult, A | keyof Stored | "fields" | "changes" | "stats">>;
  refine<A extends MeshArray = MeshArray>(
    options: RefineOptions | undefined,
    how: Omit<ResultOptions<A>, "zeroCopy" | "fields"> & { deltas: true },
  ): Promise<Pick<RefineDelta, A | keyof Stored | "changes" | "stats" | "vertexCount" | "tetCount">>;

  /**
   * The same in steps, each of which gives a mesh that is valid and within the budget. The loop ends when the mesh
   * meets the request (`stats.done`), when `refine` or `refineSteps` requests another one, or when the caller leaves
   * it. For a file that is fetched in parts it continues as blocks arrive, and throws the error that ends the download.
   *
   * @example
   * const mesh = await mt.refine({ error: "5%" });
   * for await (const step of mt.refineSteps({ error: "0.1%" }, { budgetMs: 4, deltas: true })) {
   *   draw(applyChanges(mesh, step), step.changes);
   * }
   */
  refineSteps<A extends MeshArray = MeshArray>(
    options?: RefineOptions,
    how?: StepOptions<A> & { deltas?: false },
  ): AsyncGenerator<Pick<RefineResult, A | keyof Stored | "fields" | "changes" | "stats">, void, void>;
  refineSteps<A extends MeshArray = MeshArray>(
    options: RefineOptions | undefined,
    how: StepOptions<A> & { deltas: true },
  ): AsyncGenerator<Pick<RefineDelta, A | keyof Stored | "changes" | "stats" | "vertexCount" | "tetCount">, void, void>;

  /**
   * Another mesh of the same volume, for a second part of a program: its requests do not change this mesh, nor those of this one
   * the other. It has memory of its own for its mesh and its blocks, and shares the worker. Of a file in parts, what either fetches
   * from now on is there for both; it is kept compressed as long as there are views. Other sources are read again. `free` ends a view;
   * that of the volume ends all of its views.
   *
   * @example
   * const overview = await mt.view();
   * await Promise.all([mt.refine({ error: "0.1%" }), overview.refine({ maxTets: 10_000 })]);
   * @throws {TetralodError} `bad-source` if the volume is a stream, which cannot be read again
   */
  view(options?: Pick<OpenOptions, "signal" | "onProgress">): Promise<MultiTessellation>;

  /**
   * Chooses the field that isosurfaces follow, by name or by number in `info.fields`, without changing the mesh; `refine`
   * with `field` does so too.
   */
  setField(field: string | number): Promise<void>;

  /** Stops the download and the worker. Pending and later calls reject with code `freed`. */
  free(): void;

  addEventListener<K extends keyof MultiTessellationEventMap>(
    type: K,
    listener: (event: MultiTessellationEventMap[K]) => void,
    options?: boolean | AddEventListenerOptions,
  ): void;
  addEventListener(
    type: string,
    listener: EventListenerOrEventListenerObject | null,
    options?: boolean | AddEventListenerOptions,
  ): void;

  /** The same as {@link MultiTessellation.free}, for `using mt = await MultiTessellation.open(...)`. */
  [Symbol.dispose](): void;
}

/** Which surface `tetralod/three` and `tetralod/vtk` show: one of these, with fields beside the values that are drawn. */
export type SurfaceOptions = FieldOptions & (
  | {
      /** At one value or several, in units of the field. */
      isosurface: number | ArrayLike<number>;
      /** Those of the field's gradient (default), or of the triangles. */
      normals?: "gradient" | "smooth";
    }
  | {
      /** The section with the plane of all points with `normal · p = offset`. */
      slice: { normal: ArrayLike<number>; offset: number };
    }
  | {
      /** The boundary of the mesh. */
      boundary: true;
    }
);

/** The codes of errors, for programs. */
export type ErrorCode =
  /** The source is not of a kind that can be read, or has been read already. */
  | "bad-source"
  /** The server could not be reached, answered with an error, or broke off. */
  | "network"
  /** The server does not let pages of this origin read the file; the message says what it must send. */
  | "cors"
  /** The server sends something else than the bytes of the file; the message says what to change there. */
  | "server"
  /** The file on the server was replaced while it was being read. */
  | "changed"
  /** The bytes are not an MT file at all. */
  | "not-mt"
  /** The file was made by a later version. */
  | "unsupported-version"
  /** The file contradicts itself or its checksums. */
  | "corrupt"
  /** The file ended too early. */
  | "truncated"
  /** The file needs more memory than is allowed. */
  | "limit"
  /** An option or argument is unknown or has an impossible value; the message names it. */
  | "bad-option"
  /** Another mesh, or in the viewer another volume, was requested before all data for this one had arrived. */
  | "replaced"
  /** The base mesh has not arrived yet. */
  | "not-ready"
  /** The object has been freed. */
  | "freed"
  /**
   * The worker did not start or does not answer: its file is not where the page looks for it, is not JavaScript or of another
   * version, or a Content-Security-Policy forbids it. The message says what to change.
   */
  | "worker"
  /** The wasm module could not be loaded or compiled; the message says what to change. */
  | "wasm"
  /** The browser has no WebGPU, or it gives no adapter (viewer only). */
  | "no-webgpu"
  /** The GPU was reset or removed, and could not be opened again; make a new viewer (viewer only). */
  | "device-lost"
  /** The mesh is larger than this GPU can hold (viewer only). */
  | "too-large"
  /** The GPU refused a command; a mistake in this package, please report it (viewer only). */
  | "gpu"
  /** The file is of no format that can be built from (`tetralod/build` only). */
  | "unknown-format"
  /** The file has cells, or is of a type, that cannot be read here; the message says what to do (`tetralod/build` only). */
  | "unsupported"
  /** The mesh cannot be built: the message says which cell or point, and why (`tetralod/build` only). */
  | "bad-mesh"
  /** The files, or the work, need more memory than a wasm module can have (`tetralod/build` only). */
  | "memory"
  /** A mistake in this package, also in a worker that had started: please report it. */
  | "internal";

/** The errors of this package. Aborts are not among them: they reject with the signal's own reason. */
export class TetralodError extends Error {
  constructor(code: ErrorCode, message: string, options?: { cause?: unknown });
  readonly code: ErrorCode;
}
