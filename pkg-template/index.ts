/// <reference lib="esnext.disposable" preserve="true" />
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

import { type MeshArray, applyChanges, arrayBits, emptyMesh } from "./changes.js";
import { type CoreMethods, type Handed, Local, type NotYet, REPLACED, type What } from "./core.js";
import { DISPOSE } from "./dispose.js";
import { deferred } from "./latest.js";
import { coreRemedy, coreScript, coreWasm, startCore } from "./files.js";
import { type ErrorCode, type FlatError, TetralodError, badOption, known, reviveError } from "./errors.js";
import {
  type FieldError,
  type Need,
  type ReadOptions,
  type Reading,
  type RefineOptions,
  type TetBatch,
  type TransferOptions,
  type Unchecked,
  type Vector,
  type ViewOptions,
  type Where,
  checkAmount,
  checkNames,
  openOptions,
  sendable,
} from "./options.js";
import type {
  Averaged,
  BlockProgress,
  ErrorCurve,
  Extreme,
  Extremes,
  FieldInfo,
  FieldStats,
  FieldSums,
  FieldValues,
  IsoSurface,
  LineProfile,
  Mesh,
  MeshChanges,
  MeshDelta,
  MtInfo,
  Progress,
  RefineStats,
  RegionInfo,
  RegionStats,
  Regions,
  Slice,
  Stored,
  Streamline,
  Surface,
} from "./results.js";
import type { Answer, Args, NodeWorker, Remote } from "./rpc.js";
import { type Kind, PLACES, absoluteHref, checkWorker, startWorker } from "./start.js";
import { type Absolute, absolute, displaced, fieldsOf } from "./stored.js";
import { type FilePart, type RangesSource, type Source, abortable, isRepeatable, openSource, pump, rangesOf } from "./stream.js";
import type { SurfaceOptions } from "./surfaces.js";
import { type AsideOptions, type AwaitOptions, type FieldOptions, type MeshTools, setCaller, withMeshTools } from "./tools.js";

export type {
  Absolute,
  AsideOptions,
  Averaged,
  AwaitOptions,
  BlockProgress,
  ErrorCode,
  ErrorCurve,
  Extreme,
  Extremes,
  FieldError,
  FieldInfo,
  FieldOptions,
  FieldStats,
  FieldSums,
  FieldValues,
  FilePart,
  IsoSurface,
  LineProfile,
  Mesh,
  MeshArray,
  MeshChanges,
  MeshDelta,
  MeshTools,
  MtInfo,
  Need,
  NodeWorker,
  Progress,
  ReadOptions,
  RefineOptions,
  RefineStats,
  RegionInfo,
  RegionStats,
  Regions,
  Slice,
  Source,
  Stored,
  Streamline,
  Surface,
  SurfaceOptions,
  TetBatch,
  TransferOptions,
  Vector,
  ViewOptions,
  Where,
};
export { TetralodError, absolute, applyChanges, displaced, emptyMesh };

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

/** The events of a volume, each with its `detail`. */
export interface MultiTessellationEventMap {
  /** Something has arrived and been decoded: as `onProgress`. */
  progress: CustomEvent<Progress>;
  /** `refine` or a step of `refineSteps` has made a mesh. */
  stats: CustomEvent<RefineStats>;
  /** The download has ended with an error; `retry` continues where that is possible. */
  error: CustomEvent<Error>;
}

const OPEN_OPTIONS = ["signal", "onProgress", ...PLACES];
const NO_RETRY = "only a file that is fetched in parts can be continued: open it again";
const STEP_OPTIONS = ["budgetMs", "updates", "deltas", "arrays", "signal"];
const NO_VIEW = "a stream is read only once; for views, open a URL, a Blob or bytes in memory";
const NO_ZERO_COPY = "needs `worker: false`, and no `deltas`: no other thread has this memory";

/** What answers the calls: a worker, or a session in the caller's thread. */
type Core = Remote<CoreMethods> | Local;

/**
 * A volume that is open. Calls are answered in the order in which they were made.
 */
export class MultiTessellation extends withMeshTools<AsideOptions, MultiTessellationEventMap>() {
  #core: Core;
  #info: MtInfo | undefined;
  #progress: Progress = { ready: false, complete: false, bytes: 0, total: undefined, updates: 0 };
  /** For a stream, when it has ended; nothing for a file in parts. */
  #complete: Promise<void> | undefined;
  #onProgress: (progress: Progress) => void;
  #stop = new AbortController();
  #inWorker: boolean;
  /** Why nothing can be called any more. */
  #closed: Error | undefined;
  /** The last request, and how many there were: each one replaces those before it, unless it is refused. */
  #goal = 0;
  #goals = 0;
  /** Settles when it is known whether the last one is refused. */
  #judged = Promise.resolve();
  #source!: Source;
  #fetching!: Reading;
  /** Other meshes of the volume. */
  #views = new Set<MultiTessellation>();
  /** The one for calls with a request of their own, and the last of these. */
  #aside: Promise<MultiTessellation> | undefined;
  #asked: Promise<unknown> = Promise.resolve();

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
  static async open(source: Source, options: OpenOptions = {}): Promise<MultiTessellation> {
    const { signal, onProgress = () => {}, worker = true, workerUrl, workerTimeoutMs, wasmUrl, ...how } = options;
    const fetching = openOptions(how, OPEN_OPTIONS);
    const wasm = wasmUrl === undefined ? await embedded() : absoluteHref("wasmUrl", wasmUrl);
    signal?.throwIfAborted();
    if (!worker && workerUrl !== undefined) throw badOption("workerUrl", "goes with `worker: true` only");
    let mt: MultiTessellation;
    const onEvent = (name: string, data: unknown) => mt.#heard(name, data);
    const core: Core = worker ? startWorker<CoreMethods>(CORE, { worker, workerUrl, workerTimeoutMs }, onEvent) : new Local(onEvent);
    mt = new MultiTessellation(core, Boolean(worker), onProgress);
    return mt.#opened(source, signal, fetching, checkWorker(CORE, core.call("load", [wasm])));
  }

  private constructor(core: Core, inWorker: boolean, onProgress: (progress: Progress) => void) {
    super();
    setCaller(this, (method, args, request, signal) => {
      const ask = (core: Core) => core.call(method, args as Parameters<CoreMethods[typeof method]>) as Promise<any>;
      return request === undefined ? ask(this.#core) : this.#askAside(request, ask, signal);
    });
    this.#core = core;
    this.#inWorker = inWorker;
    this.#onProgress = onProgress;
  }

  /** What the file says about the volume. */
  get info(): MtInfo {
    // Whoever has the object has it from `open`, which waits for this.
    return this.#info as MtInfo;
  }

  /** How much has arrived and been decoded; a new object each time. */
  get progress(): Progress {
    return this.#progress;
  }

  /**
   * Of a stream: resolves when the whole file has been decoded.
   *
   * Of a file that is fetched in parts: another promise each time it is read, that resolves when everything that the
   * last request needs has arrived; at once before the first request. It does not change the mesh: call `refine`, which
   * waits by itself.
   *
   * Rejects with the error that ended the download; the data that has arrived stays usable.
   */
  get complete(): Promise<void> {
    if (this.#complete) return this.#complete;
    const settled = this.#wait("settled", []);
    settled.catch(() => {});
    return settled;
  }

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
  async view(options: Pick<OpenOptions, "signal" | "onProgress"> = {}): Promise<MultiTessellation> {
    const { signal, onProgress = () => {}, ...others } = options;
    checkNames(others, [], ["signal", "onProgress"]);
    if (this.#closed) throw this.#closed;
    if (!isRepeatable(this.#source)) throw new TetralodError("bad-source", NO_VIEW);
    signal?.throwIfAborted();
    let view: MultiTessellation;
    const core = this.#core.view((name, data) => view.#heard(name, data));
    view = new MultiTessellation(core, this.#inWorker, onProgress);
    this.#views.add(view);
    return view.#opened(this.#source, signal, this.#fetching, undefined);
  }

  /**
   * Continues a file that is fetched in parts after an error. Until then, pending calls reject with that error.
   *
   * @throws {TetralodError} `changed` if the file was replaced on the server, `bad-source` if it is a stream: open it again
   */
  async retry(): Promise<void> {
    if (this.#complete) throw new TetralodError("bad-source", NO_RETRY);
    await this.#wait("retry", []);
  }

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
  refine<A extends MeshArray = MeshArray>(options?: RefineOptions, how?: ResultOptions<A> & { deltas?: false }): Promise<Pick<RefineResult, A | keyof Stored | "fields" | "changes" | "stats">>;
  refine<A extends MeshArray = MeshArray>(
    options: RefineOptions | undefined,
    how: Omit<ResultOptions<A>, "zeroCopy" | "fields"> & { deltas: true },
  ): Promise<Pick<RefineDelta, A | keyof Stored | "changes" | "stats" | "vertexCount" | "tetCount">>;
  async refine(options: RefineOptions = {}, how: ResultOptions & { deltas?: boolean } = {}): Promise<any> {
    checkNames(how, ["deltas", "partial", "arrays", "fields", "zeroCopy", "signal"]);
    const { deltas = false, partial = false, zeroCopy = false, signal } = how;
    signal?.throwIfAborted();
    const fields = fieldsOf(() => this.#info, how.fields);
    if (deltas && how.fields) throw badOption("fields", "goes without `deltas`");
    if (zeroCopy && (this.#inWorker || deltas)) throw badOption("zeroCopy", NO_ZERO_COPY);
    const what = { deltas: Boolean(deltas), arrays: arrayBits(how.arrays), fields, zeroCopy: Boolean(zeroCopy) };
    const sent = sendable(options, this.#inWorker);
    const { goal, asked } = this.#request((number) => this.#make(number, sent, what, Boolean(partial)));
    if (!signal) return asked;
    return abortable(asked, signal).catch((error) => {
      if (signal.aborted) this.#giveUp(goal);
      throw error;
    });
  }

  /** Makes the mesh of a request. */
  async #make(goal: number, sent: Unchecked, what: What, partial: boolean) {
    const asked = { ...what, goal };
    const told = (answer: Handed | NotYet) => {
      const { more: _, ...result } = answer;
      if (result.stats) this.#emit("stats", result.stats);
      return result;
    };
    if (!partial && !this.#complete) return told(await this.#wait("reach", [sent, asked]));
    const early = told(await this.#wait("refine", [sent, asked, partial], false));
    if (early.stats) return early;
    // Data of the stream is missing, and nothing was handed out.
    await this.#complete;
    if (goal !== this.#goal) throw new TetralodError("replaced", REPLACED);
    return told(await this.#wait("refine", [sent, asked, true], false));
  }

  /** Makes a request, which replaces those before it unless it is refused. `ask` gets its number. */
  #request<T>(ask: (goal: number) => Promise<T>) {
    const before = this.#goal;
    const goal = (this.#goal = ++this.#goals);
    const asked = ask(goal);
    const refused = (error: unknown) => {
      if (known(error).code === "bad-option" && this.#goal === goal) this.#goal = before;
    };
    this.#judged = asked.then(() => {}, refused);
    return { goal, asked };
  }

  /** The one before it holds again. */
  #giveUp(goal: number) {
    if (goal !== this.#goal) return;
    this.#goal = ++this.#goals;
    this.#core.call("abandon", [goal]).catch(() => {});
  }

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
  async *refineSteps(options: RefineOptions = {}, how: StepOptions & { deltas?: boolean } = {}): AsyncGenerator<any, void, void> {
    checkNames(how, STEP_OPTIONS);
    const { budgetMs = how.updates === undefined ? 8 : Infinity, updates = Infinity, deltas = false, signal } = how;
    checkAmount("budgetMs", budgetMs, 0);
    checkAmount("updates", updates, 1);
    signal?.throwIfAborted();
    const what = { deltas: Boolean(deltas), arrays: arrayBits(how.arrays) };
    const sent = sendable(options, this.#inWorker);
    const { goal, asked } = this.#request(() => this.#core.call("setRequest", [sent]));
    await asked;
    for (let done = false; !done && (await this.#isLast(goal)); ) {
      signal?.throwIfAborted();
      const { more, ...step } = await this.#core.call("step", [budgetMs, updates, what]);
      this.#emit("stats", step.stats);
      yield step;
      done = !more;
      if (!more || !step.stats.done || !(await this.#isLast(goal))) continue;
      await abortable(this.#wait("arrived", []), signal);
    }
  }

  async #isLast(goal: number) {
    if (goal !== this.#goal) await this.#judged;
    return goal === this.#goal;
  }

  /**
   * Chooses the field that isosurfaces follow, by name or by number in `info.fields`, without changing the mesh; `refine`
   * with `field` does so too.
   */
  async setField(field: string | number): Promise<void> {
    await this.#core.call("setField", [field]);
  }

  /** Stops the download and the worker. Pending and later calls reject with code `freed`. */
  free(): void {
    this.#close(new TetralodError("freed", "this MultiTessellation has been freed"));
  }

  /** The same as {@link MultiTessellation.free}, for `using mt = await MultiTessellation.open(...)`. */
  [DISPOSE](): void {
    this.free();
  }

  #close(reason: Error) {
    this.#closed ??= reason;
    for (const view of this.#views) view.#close(reason);
    this.#stop.abort(reason);
    this.#core.close(reason);
  }

  /** Answers from the mesh of another request; the current mesh stays as it is. One such call after the other. */
  #askAside(request: RefineOptions, ask: (core: Core) => Promise<any>, signal: AbortSignal | undefined) {
    const answer = async () => {
      this.#aside ??= this.view();
      this.#aside.catch(() => (this.#aside = undefined));
      const aside = await this.#aside;
      await aside.refine(request, { arrays: [], signal });
      return ask(aside.#core);
    };
    const answered = this.#asked.then(answer);
    this.#asked = answered.catch(() => {});
    return answered;
  }

  /** A call that may wait for bytes: the end of the download ends the wait. */
  #wait<Method extends keyof CoreMethods>(method: Method, args: Args<CoreMethods, Method>, waits = true): Answer<CoreMethods, Method> {
    // A signal may have ended the download before, which is not why this call fails.
    if (this.#closed) return Promise.reject(this.#closed);
    const called = this.#core.call(method, args);
    return waits ? abortable(called, this.#stop.signal) : called;
  }

  #heard(name: string, data: unknown) {
    if (name === "progress") this.#tell(data as Progress);
    // Before that, `open` rejects with it.
    if (name === "error" && this.#info && !this.#closed) this.#emit("error", reviveError(data as FlatError));
  }

  #tell(progress: Progress) {
    this.#progress = progress;
    this.#onProgress(progress);
    this.#emit("progress", progress);
  }

  #emit(name: string, detail: unknown) {
    this.dispatchEvent(new CustomEvent(name, { detail }));
  }

  /** Reads `source`; what fails ends it. */
  async #opened(source: Source, signal: AbortSignal | undefined, fetching: Reading, loaded: Promise<void> | undefined): Promise<MultiTessellation> {
    [this.#source, this.#fetching] = [source, fetching];
    try {
      await Promise.all([loaded, this.#begin(source, signal, fetching)]);
    } catch (error) {
      this.#close(error as Error);
      throw error;
    }
    return this;
  }

  /** Resolves when the base mesh has arrived; `complete` waits for the rest. */
  async #begin(source: Source, outer: AbortSignal | undefined, fetching: Reading) {
    const forward = () => this.#stop.abort(outer?.reason);
    outer?.addEventListener("abort", forward, { once: true });
    const ranges = fetching.whole ? undefined : rangesOf(source, fetching);
    if (ranges && (await this.#beginParts(fetching, ranges))) return;
    await this.#beginStream(source, fetching, () => outer?.removeEventListener("abort", forward));
  }

  /** Whether the file comes in parts. */
  async #beginParts({ whole: _, ...fetching }: Reading, { url, ...along }: RangesSource) {
    const opened = await this.#wait("openParts", [url, { ...fetching, ...along }]);
    if (!opened) return false;
    this.#info = opened.info;
    if (!this.#progress.ready) this.#tell(opened.progress);
    this.#stop.signal.addEventListener("abort", () => this.#core.call("halt", []).catch(() => {}), { once: true });
    return true;
  }

  async #beginStream(source: Source, fetching: Reading, then: () => void) {
    const { signal } = this.#stop;
    const starting = this.#core.call("start", [fetching.fields]);
    starting.catch(() => {});
    const ready = deferred<void>();
    const onProgress = async (progress: Progress, total: number | undefined) => {
      if (progress.ready && !this.#info) {
        this.#info = await this.#core.call("info", []);
        ready.resolve();
      }
      this.#tell({ ...progress, total: progress.total ?? total });
    };
    const complete = (this.#complete = this.#stream(source, fetching, starting, onProgress).finally(then));
    // Whoever does not wait for the end must not get an unhandled rejection for it.
    complete.catch((error) => this.#info && !this.#stop.signal.aborted && this.#emit("error", error));
    signal.throwIfAborted();
    await Promise.race([ready.promise, complete]);
    if (!this.#info) throw new TetralodError("truncated", "the file ended before its base mesh");
  }

  async #stream(source: Source, fetching: Reading, starting: Promise<void>, onProgress: (progress: Progress, total?: number) => Promise<void>) {
    const { signal } = this.#stop;
    const opened = await openSource(source, signal, fetching);
    await starting;
    const report = (progress: Progress) => onProgress(progress, opened.total);
    const feed = async (chunk: Uint8Array<ArrayBuffer>) => report(await this.#core.call("feed", [chunk], [chunk.buffer]));
    const finish = async () => report(await this.#core.call("finish", []));
    await pump(opened, { feed, finish }, signal);
  }
}

/** The worker of this class. */
const CORE: Kind = {
  name: "core",
  entry: "tetralod/worker",
  start: startCore,
  script: coreScript,
  remedy: coreRemedy,
};

/** The bytes of the wasm module, where they are in this one; elsewhere the worker finds its file. */
async function embedded(): Promise<Uint8Array<ArrayBuffer> | undefined> {
  const wasm = await coreWasm();
  return wasm instanceof URL ? undefined : wasm;
}
