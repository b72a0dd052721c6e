/**
 * tetralod: very large tetrahedral volumes, streamed and refined where it counts. See README.md.
 */

import { Local } from "./core.js";
import { TetralodError } from "./errors.js";
import { Remote, nodeEndpoint, webEndpoint } from "./rpc.js";
import { nodeModule, openSource, pump } from "./stream.js";

export { TetralodError };

const OPEN_OPTIONS = ["signal", "onProgress", "worker"];

/** A volume that is open: it can be refined while the rest of it is still arriving. */
export class MultiTessellation {
  #core;
  #info;
  #progress = { ready: false, complete: false, bytes: 0, total: undefined, updates: 0 };
  #complete;
  #stop = new AbortController();

  static async open(source, options = {}) {
    for (const name of Object.keys(options)) {
      if (OPEN_OPTIONS.includes(name)) continue;
      throw new TetralodError("bad-option", `option \`${name}\`: there is none of this name, only ${OPEN_OPTIONS.join(", ")}`);
    }
    const { signal, onProgress = () => {}, worker = true } = options;
    signal?.throwIfAborted();
    const mt = new MultiTessellation(worker ? startWorker() : new Local());
    try {
      await mt.#begin(source, signal, onProgress);
    } catch (error) {
      mt.#close(error);
      throw error;
    }
    return mt;
  }

  /** @private use `MultiTessellation.open` */
  constructor(core) {
    this.#core = core;
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

  async refine(options = {}) {
    return this.#core.call("refine", [plain(options)]);
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

/** Options as they can be sent to a worker: typed arrays become lists, everything else goes as it is. */
function plain(options) {
  if (typeof options !== "object" || options === null) return options;
  const list = (value) => (ArrayBuffer.isView(value) ? Array.from(value) : value);
  return Object.fromEntries(Object.entries(options).map(([name, value]) => [name, list(value)]));
}

function startWorker() {
  const node = nodeModule("node:worker_threads");
  if (node) return new Remote(nodeEndpoint(new node.Worker(new URL("./worker.js", import.meta.url))));
  return new Remote(webEndpoint(new Worker(new URL("./worker.js", import.meta.url), { type: "module" })));
}
