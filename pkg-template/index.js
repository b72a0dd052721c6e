/**
 * tetralod: very large tetrahedral volumes, streamed and refined where it counts. See README.md.
 */

import { applyChanges, emptyMesh } from "./changes.js";
import { Local } from "./core.js";
import { TetralodError } from "./errors.js";
import { sendable } from "./options.js";
import { Remote, nodeEndpoint, webEndpoint } from "./rpc.js";
import { nodeModule, openSource, pump } from "./stream.js";

export { TetralodError, applyChanges, emptyMesh };

const OPEN_OPTIONS = ["signal", "onProgress", "worker"];
const STEP_OPTIONS = ["budgetMs", "updates", "deltas", "signal"];

/** A volume that is open: it can be refined while the rest of it is still arriving. */
export class MultiTessellation {
  #core;
  #info;
  #progress = { ready: false, complete: false, bytes: 0, total: undefined, updates: 0 };
  #complete;
  #stop = new AbortController();
  #inWorker;
  /** Counts the meshes that were asked for: each one replaces those before it. */
  #goal = 0;

  static async open(source, options = {}) {
    checkNames(options, OPEN_OPTIONS);
    const { signal, onProgress = () => {}, worker = true } = options;
    signal?.throwIfAborted();
    const mt = new MultiTessellation(worker ? startWorker() : new Local(), Boolean(worker));
    try {
      await mt.#begin(source, signal, onProgress);
    } catch (error) {
      mt.#close(error);
      throw error;
    }
    return mt;
  }

  /** @private use `MultiTessellation.open` */
  constructor(core, inWorker) {
    this.#core = core;
    this.#inWorker = inWorker;
  }

  get info() {
    return this.#info;
  }

  get progress() {
    return this.#progress;
  }

  get complete() {
    return this.#complete;
  }

  async refine(options = {}, how = {}) {
    checkNames(how, ["deltas"]);
    const sent = sendable(options, this.#inWorker);
    this.#goal++;
    return this.#core.call("refine", [sent, Boolean(how.deltas)]);
  }

  async *refineSteps(options = {}, how = {}) {
    checkNames(how, STEP_OPTIONS);
    const { budgetMs = how.updates === undefined ? 8 : Infinity, updates = Infinity, deltas = false, signal } = how;
    checkAmount("budgetMs", budgetMs, 0);
    checkAmount("updates", updates, 1);
    signal?.throwIfAborted();
    const goal = ++this.#goal;
    await this.#core.call("aim", [sendable(options, this.#inWorker)]);
    for (let done = false; !done && goal === this.#goal; ) {
      signal?.throwIfAborted();
      const step = await this.#core.call("step", [budgetMs, updates, Boolean(deltas)]);
      yield step;
      done = step.stats.done;
    }
  }

  async setField(name) {
    await this.#core.call("setField", [name]);
  }

  async isosurface(value) {
    if (typeof value !== "number") throw new TetralodError("bad-option", "isosurface: the value must be a number");
    return this.#core.call("isosurface", [value]);
  }

  async hash() {
    return this.#core.call("hash");
  }

  free() {
    this.#close(new TetralodError("freed", "this MultiTessellation has been freed"));
  }

  [Symbol.dispose ?? Symbol.for("Symbol.dispose")]() {
    this.free();
  }

  #close(reason) {
    this.#stop.abort(reason);
    this.#core.close(reason);
  }

  /** Resolves when the base mesh is there; the rest of the stream goes on behind `complete`. */
  async #begin(source, outer, onProgress) {
    const forward = () => this.#stop.abort(outer.reason);
    outer?.addEventListener("abort", forward, { once: true });
    const { signal } = this.#stop;
    const starting = this.#core.call("start");
    starting.catch(() => {});
    let isReady;
    const ready = new Promise((resolve) => (isReady = resolve));
    this.#complete = this.#stream(source, signal, starting, async (progress, total) => {
      this.#progress = { ...progress, total: progress.total ?? total };
      if (progress.ready && !this.#info) {
        this.#info = await this.#core.call("info");
        isReady();
      }
      onProgress(this.#progress);
    }).finally(() => outer?.removeEventListener("abort", forward));
    // Whoever does not wait for the end must not get an unhandled rejection for it.
    this.#complete.catch(() => {});
    await Promise.race([ready, this.#complete]);
    if (!this.#info) throw new TetralodError("truncated", "the file ended before its base mesh");
  }

  async #stream(source, signal, starting, onProgress) {
    const opened = await openSource(source, signal);
    await starting;
    const report = (progress) => onProgress(progress, opened.total);
    const feed = async (chunk) => report(await this.#core.call("feed", [chunk], [chunk.buffer]));
    const finish = async () => report(await this.#core.call("finish"));
    await pump(opened, { feed, finish }, signal);
  }
}

function checkNames(options, names) {
  for (const name of Object.keys(options)) {
    if (names.includes(name)) continue;
    throw new TetralodError("bad-option", `option \`${name}\`: there is none of this name, only ${names.join(", ")}`);
  }
}

function checkAmount(name, value, least) {
  if (typeof value === "number" && value >= least) return;
  throw new TetralodError("bad-option", `option \`${name}\`: must be a number of at least ${least}`);
}

function startWorker() {
  const node = nodeModule("node:worker_threads");
  if (node) return new Remote(nodeEndpoint(new node.Worker(new URL("./worker.js", import.meta.url))));
  return new Remote(webEndpoint(new Worker(new URL("./worker.js", import.meta.url), { type: "module" })));
}
