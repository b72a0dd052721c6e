/** The wasm core behind the methods that `MultiTessellation` calls: in a worker, or in the caller's own thread. */

import init, { CoreSession } from "./tetralod_core.js";
import { TetralodError, reviveError } from "./errors.js";
import { received } from "./options.js";
import { nodeModule } from "./stream.js";

let loading;

/** Compiles the wasm module once per thread. */
export function loadCore() {
  loading ??= load().catch((error) => {
    loading = undefined;
    throw new TetralodError("wasm", `the wasm module did not load: ${error?.message ?? error}`, { cause: error });
  });
  return loading;
}

async function load() {
  const url = new URL("./tetralod_core_bg.wasm", import.meta.url);
  // Node cannot fetch files; browsers compile while they download.
  const fs = url.protocol === "file:" ? nodeModule("node:fs/promises") : undefined;
  return init({ module_or_path: fs ? await fs.readFile(url) : url });
}

/** The methods of one session, for `serve` or `local`. */
export function coreMethods() {
  let session;
  /** Goes on for so many milliseconds and updates, and gives the mesh that is there then, or what has changed in it. */
  const step = (milliseconds, updates, deltas) => {
    const start = performance.now();
    const stats = session.step(milliseconds, updates);
    stats.milliseconds = performance.now() - start;
    return { ...(deltas ? session.delta() : session.mesh()), stats };
  };
  return {
    async start() {
      await loadCore();
      session = new CoreSession();
    },
    feed: (bytes) => session.feed(bytes),
    finish: () => session.finish(),
    info: () => session.info(),
    async refine(options, deltas) {
      session.aim(await received(options));
      return step(Infinity, Infinity, deltas);
    },
    aim: async (options) => session.aim(await received(options)),
    step,
    setField: (name) => session.setField(name),
    isosurface: (values, smooth) => session.isosurfaces(values, smooth),
    slice: (normal, offset) => session.slice(normal, offset),
    surface: () => session.surface(),
    probe: (points) => session.probe(points),
    line: (from, to) => session.line(from, to),
    streamlines: (fields, seeds, backward, maxLength, maxSteps) =>
      session.streamlines(fields, seeds, backward, maxLength, maxSteps),
    stats: (bins, low, high) => session.stats(bins, low, high),
    hash: () => session.hash(),
    free: () => session?.free(),
  };
}

/** The same calls as `Remote` makes, without a worker. */
export class Local {
  #methods = coreMethods();
  #closed = null;

  async call(method, args = []) {
    if (this.#closed) throw this.#closed;
    try {
      return await this.#methods[method](...args);
    } catch (error) {
      // What was under way when the session was freed fails in some way of its own.
      throw this.#closed ?? reviveError(error);
    }
  }

  close(reason) {
    if (this.#closed) return;
    this.#closed = reason;
    this.#methods.free();
  }
}
