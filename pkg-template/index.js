/**
 * tetralod: very large tetrahedral volumes, streamed and refined where it counts. See README.md.
 */

import { applyChanges, arrayBits, emptyMesh } from "./changes.js";
import { Local, REPLACED } from "./core.js";
import { coreRemedy, coreScript, coreWasm, startCore } from "./files.js";
import { TetralodError, reviveError } from "./errors.js";
import { openOptions, sendable } from "./options.js";
import { PLACES, absoluteUrl, loadWasm, startWorker } from "./start.js";
import { absolute, fieldsOf } from "./stored.js";
import { abortable, isRepeatable, openSource, pump, rangesOf } from "./stream.js";
import { checkAmount, checkNames, setCaller, withMeshTools } from "./tools.js";

export { TetralodError, absolute, applyChanges, emptyMesh };

const OPEN_OPTIONS = ["signal", "onProgress", ...PLACES];
const NO_RETRY = "only a file that is fetched in parts can be continued: open it again";
const STEP_OPTIONS = ["budgetMs", "updates", "deltas", "arrays", "signal"];
const NO_VIEW = "a stream is read only once; for views, open a URL, a Blob or bytes in memory";
const NO_ZERO_COPY = "needs `worker: false`, and no `deltas`: no other thread has this memory";

/** A volume that is open: it can be refined while the rest of it is still arriving. */
export class MultiTessellation extends withMeshTools(EventTarget) {
  #core;
  #info;
  #progress = { ready: false, complete: false, bytes: 0, total: undefined, updates: 0 };
  /** For a stream, when it has ended; nothing for a file in parts. */
  #complete;
  #onProgress;
  #stop = new AbortController();
  #inWorker;
  /** Why nothing can be called any more. */
  #closed;
  /** The last request, and how many there were: each one replaces those before it, unless it is refused. */
  #goal = 0;
  #goals = 0;
  /** Settles when it is known whether the last one is refused. */
  #judged = Promise.resolve();
  #source;
  #fetching;
  /** Other meshes of the volume. @type {Set<MultiTessellation>} */
  #views = new Set();
  /** The one for calls with a request of their own, and the last of these. @type {Promise<MultiTessellation> | undefined} */
  #aside;
  #asked = Promise.resolve();

  static async open(source, options = {}) {
    const { signal, onProgress = () => {}, worker = true, workerUrl, workerTimeoutMs, wasmUrl, ...how } = options;
    const fetching = openOptions(how, OPEN_OPTIONS);
    const wasm = wasmUrl === undefined ? await embedded() : absoluteUrl("wasmUrl", wasmUrl).href;
    signal?.throwIfAborted();
    if (!worker && workerUrl !== undefined) throw new TetralodError("bad-option", "option `workerUrl`: goes with `worker: true` only");
    let mt;
    const onEvent = (name, data) => mt.#heard(name, data);
    const core = worker ? startWorker(CORE, { worker, workerUrl, workerTimeoutMs }, onEvent) : new Local(onEvent);
    mt = new MultiTessellation(core, Boolean(worker), onProgress);
    return mt.#opened(source, signal, fetching, loadWasm(core, CORE, wasm));
  }

  /** @private use `MultiTessellation.open` */
  constructor(core, inWorker, onProgress) {
    super();
    setCaller(this, (method, args, request, signal) =>
      request === undefined ? this.#core.call(method, args) : this.#askAside(request, method, args, signal),
    );
    this.#core = core;
    this.#inWorker = inWorker;
    this.#onProgress = onProgress;
  }

  get info() {
    return this.#info;
  }

  get progress() {
    return this.#progress;
  }

  get complete() {
    if (this.#complete) return this.#complete;
    const settled = this.#wait("settled");
    settled.catch(() => {});
    return settled;
  }

  /** @param {{ signal?: AbortSignal, onProgress?: (progress: any) => void }} [how] */
  async view({ signal, onProgress = () => {}, ...others } = {}) {
    checkNames(others, [], ["signal", "onProgress"]);
    if (this.#closed) throw this.#closed;
    if (!isRepeatable(this.#source)) throw new TetralodError("bad-source", NO_VIEW);
    signal?.throwIfAborted();
    let view;
    const core = this.#core.view((name, data) => view.#heard(name, data));
    view = new MultiTessellation(core, this.#inWorker, onProgress);
    this.#views.add(view);
    return view.#opened(this.#source, signal, this.#fetching, undefined);
  }

  async retry() {
    if (this.#complete) throw new TetralodError("bad-source", NO_RETRY);
    await this.#wait("retry");
  }

  async refine(options = {}, how = {}) {
    checkNames(how, ["deltas", "partial", "arrays", "fields", "zeroCopy", "signal"]);
    const { deltas = false, partial = false, zeroCopy = false, signal } = how;
    signal?.throwIfAborted();
    const fields = fieldsOf(() => this.#info, how.fields);
    if (deltas && how.fields) throw new TetralodError("bad-option", "option `fields`: goes without `deltas`");
    if (zeroCopy && (this.#inWorker || deltas)) throw new TetralodError("bad-option", `option \`zeroCopy\`: ${NO_ZERO_COPY}`);
    const what = { deltas: Boolean(deltas), arrays: arrayBits(how.arrays), fields, zeroCopy: Boolean(zeroCopy) };
    const sent = sendable(options, this.#inWorker);
    const { goal, asked } = this.#request((number) => this.#make(number, sent, what, partial));
    if (!signal) return asked;
    return abortable(asked, signal).catch((error) => {
      if (signal.aborted) this.#giveUp(goal);
      throw error;
    });
  }

  /** Makes the mesh of a request. */
  async #make(goal, sent, what, partial) {
    const ask = async (method, ...more) => {
      const args = [sent, { ...what, goal }, ...more];
      const { more: _, ...result } = await this.#wait(method, args, method === "reach");
      if (result.stats) this.#emit("stats", result.stats);
      return result;
    };
    if (!partial && !this.#complete) return ask("reach");
    const early = await ask("refine", Boolean(partial));
    if (early.stats) return early;
    // Data of the stream is missing, and nothing was handed out.
    await this.#complete;
    if (goal !== this.#goal) throw new TetralodError("replaced", REPLACED);
    return ask("refine", true);
  }

  /** Makes a request, which replaces those before it unless it is refused. `ask` gets its number. */
  #request(ask) {
    const before = this.#goal;
    const goal = (this.#goal = ++this.#goals);
    const asked = ask(goal);
    const refused = (error) => {
      if (error?.code === "bad-option" && this.#goal === goal) this.#goal = before;
    };
    this.#judged = asked.then(() => {}, refused);
    return { goal, asked };
  }

  /** The one before it holds again. */
  #giveUp(goal) {
    if (goal !== this.#goal) return;
    this.#goal = ++this.#goals;
    this.#core.call("abandon", [goal]).catch(() => {});
  }

  async *refineSteps(options = {}, how = {}) {
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
      await abortable(this.#wait("arrived"), signal);
    }
  }

  async #isLast(goal) {
    if (goal !== this.#goal) await this.#judged;
    return goal === this.#goal;
  }

  async setField(field) {
    await this.#core.call("setField", [field]);
  }

  free() {
    this.#close(new TetralodError("freed", "this MultiTessellation has been freed"));
  }

  [Symbol.dispose ?? Symbol.for("Symbol.dispose")]() {
    this.free();
  }

  #close(reason) {
    this.#closed ??= reason;
    for (const view of this.#views) view.#close(reason);
    this.#stop.abort(reason);
    this.#core.close(reason);
  }

  /** Answers from the mesh of another request; the current mesh stays as it is. One such call after the other. */
  #askAside(request, method, args, signal) {
    const answer = async () => {
      this.#aside ??= this.view();
      this.#aside.catch(() => (this.#aside = undefined));
      const aside = await this.#aside;
      await aside.refine(request, { arrays: [], signal });
      return aside.#core.call(method, args);
    };
    const answered = this.#asked.then(answer);
    this.#asked = answered.catch(() => {});
    return answered;
  }

  /** A call that may wait for bytes: the end of the download ends the wait. */
  #wait(method, args = [], waits = true) {
    // A signal may have ended the download before, which is not why this call fails.
    if (this.#closed) return Promise.reject(this.#closed);
    const called = this.#core.call(method, args);
    return waits ? abortable(called, this.#stop.signal) : called;
  }

  #heard(name, data) {
    if (name === "progress") this.#tell(data);
    // Before that, `open` rejects with it.
    if (name === "error" && this.#info && !this.#closed) this.#emit("error", reviveError(data));
  }

  #tell(progress) {
    this.#progress = progress;
    this.#onProgress(progress);
    this.#emit("progress", progress);
  }

  #emit(name, detail) {
    this.dispatchEvent(new CustomEvent(name, { detail }));
  }

  /** Reads `source`; what fails ends it. */
  async #opened(source, signal, fetching, loaded) {
    [this.#source, this.#fetching] = [source, fetching];
    try {
      await Promise.all([loaded, this.#begin(source, signal, fetching)]);
    } catch (error) {
      this.#close(error);
      throw error;
    }
    return this;
  }

  /** Resolves when the base mesh has arrived; `complete` waits for the rest. */
  async #begin(source, outer, fetching) {
    const forward = () => this.#stop.abort(outer.reason);
    outer?.addEventListener("abort", forward, { once: true });
    const ranges = fetching.whole ? undefined : rangesOf(source, fetching);
    if (ranges && (await this.#beginParts({ ...fetching, ...ranges }))) return;
    await this.#beginStream(source, fetching, () => outer?.removeEventListener("abort", forward));
  }

  /** Whether the file comes in parts. */
  async #beginParts({ url, whole, ...options }) {
    const opened = await this.#wait("openParts", [url, options]);
    if (!opened) return false;
    this.#info = opened.info;
    if (!this.#progress.ready) this.#tell(opened.progress);
    this.#stop.signal.addEventListener("abort", () => this.#core.call("halt").catch(() => {}), { once: true });
    return true;
  }

  async #beginStream(source, fetching, then) {
    const { signal } = this.#stop;
    const starting = this.#core.call("start", [fetching.fields]);
    starting.catch(() => {});
    let isReady;
    const ready = new Promise((resolve) => (isReady = resolve));
    const onProgress = async (progress, total) => {
      if (progress.ready && !this.#info) {
        this.#info = await this.#core.call("info");
        isReady();
      }
      this.#tell({ ...progress, total: progress.total ?? total });
    };
    this.#complete = this.#stream(source, fetching, starting, onProgress).finally(then);
    // Whoever does not wait for the end must not get an unhandled rejection for it.
    this.#complete.catch((error) => this.#info && !this.#stop.signal.aborted && this.#emit("error", error));
    signal.throwIfAborted();
    await Promise.race([ready, this.#complete]);
    if (!this.#info) throw new TetralodError("truncated", "the file ended before its base mesh");
  }

  async #stream(source, fetching, starting, onProgress) {
    const { signal } = this.#stop;
    const opened = await openSource(source, signal, fetching);
    await starting;
    const report = (progress) => onProgress(progress, opened.total);
    const feed = async (chunk) => report(await this.#core.call("feed", [chunk], [chunk.buffer]));
    const finish = async () => report(await this.#core.call("finish"));
    await pump(opened, { feed, finish }, signal);
  }
}

/** The worker of this class. */
const CORE = {
  name: "core",
  entry: "tetralod/worker",
  start: startCore,
  script: coreScript,
  remedy: coreRemedy,
};

/** The bytes of the wasm module, where they are in this one; elsewhere the worker finds its file. */
async function embedded() {
  const wasm = coreWasm();
  return wasm instanceof URL ? undefined : wasm;
}
