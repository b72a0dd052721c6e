/** The wasm core behind the methods that `MultiTessellation` calls: in a worker, or in the caller's own thread. */

import init, { CoreSession, RangeLoader } from "./tetralod_core.js";
import { arraysIn } from "./changes.js";
import { TetralodError, flattenError, reviveError } from "./errors.js";
import { received } from "./options.js";
import { coreWasm } from "./files.js";
import { Parts } from "./parts.js";
import { SharedRanges } from "./ranges.js";
import { portEndpoint, serve } from "./rpc.js";
import { wasmError, wasmOf } from "./start.js";
import { limitOf, meshToolMethods } from "./tools.js";
import { VERSION } from "./version.js";

let loading;
/** That of wasm. @type {WebAssembly.Memory} */
let memory;

/** Compiles the wasm module once per thread; without `wasm`, its address or its bytes, the one of the package. */
export function loadCore(wasm) {
  loading ??= load(wasm ?? coreWasm()).catch((error) => {
    loading = undefined;
    throw wasmError(error, "tetralod/core.wasm");
  });
  return loading;
}

async function load(wasm) {
  ({ memory } = await init({ module_or_path: await wasmOf(wasm) }));
}

/** The methods that wait for bytes, beside which others are answered. */
export const WAITING = ["openParts", "reach", "settled", "arrived"];

export const REPLACED = "another mesh was requested before all data for this one had arrived";

/** What adds up over the steps of a refinement. */
const SUMS = ["refined", "coarsened", "forced", "judged", "milliseconds"];

/** The methods of one session, for `serve` or `Local`; `emit` sends events, `shared` are the ranges of all sessions of the file. */
export function coreMethods(emit, shared = new SharedRanges()) {
  let session;
  /** The last request. @type {Record<string, any>} */
  let request = {};
  /** @type {Parts | undefined} */
  let parts;
  /** Counts the requests. */
  let goal = 0;
  const setRequest = (options) => {
    session.request(options);
    request = options ?? {};
    goal++;
    parts?.turn();
  };
  /** One step; `more`: whether there is more to do, now or when more data has arrived. */
  const advance = (milliseconds, updates) => {
    const start = performance.now();
    parts?.look();
    const stats = session.step(milliseconds, updates);
    stats.milliseconds = performance.now() - start;
    parts?.follow();
    stats.limitedBy = limitOf(stats, parts?.progress.blocks, request);
    return { stats, more: !stats.done || Boolean(parts?.hasMore) };
  };
  /** Refines with all data that has arrived. */
  const advanceAll = () => {
    let all;
    let step;
    do {
      step = advance(Infinity, Infinity);
      if (all) for (const name of SUMS) step.stats[name] += all[name];
      all = step.stats;
    } while (!step.stats.done);
    return step;
  };
  /** Resolves when all data that the mesh needs has arrived. Arriving blocks may show that others are needed. */
  const settled = async () => {
    let done;
    do {
      await parts.settled();
      if (goal === 0) return;
      // The changes are kept for callers that follow the mesh by deltas.
      ({ done } = session.step(Infinity, Infinity));
      parts.follow();
    } while (!done || parts.isWaiting);
  };
  /** The mesh as it is now, or what has changed in it, after a step. */
  const result = ({ stats, more }, { deltas, arrays, zeroCopy }) => {
    if (!zeroCopy) return { ...(deltas ? session.delta(arrays) : session.mesh(arrays)), stats, more };
    const { changes } = session.mesh(0);
    const places = session.places();
    return { ...arraysIn(memory.buffer, places, arrays), changes, stats, more };
  };
  return {
    async load(wasm) {
      await loadCore(wasm);
      return { name: "core", version: VERSION };
    },
    async start(fields) {
      await loadCore();
      session = new CoreSession(fields);
    },
    /** Opens a file in parts; resolves to nothing without ranges of the server, else when the base mesh has arrived. */
    async openParts(url, { fields, memory, ...options }) {
      await loadCore();
      const make = (loader) => (session = CoreSession.inParts(fields, memory, loader));
      parts = new Parts(RangeLoader, make, url, { ...options, shared }, (progress) => emit("progress", progress), (error) => emit("error", flattenError(error)));
      if (await parts.begin()) return { info: session.info(), progress: parts.progress };
      session.free();
      [session, parts] = [undefined, undefined];
      return undefined;
    },
    feed: (bytes) => session.feed(bytes),
    finish: () => session.finish(),
    info: () => session.info(),
    /** Without `partial`, nothing is handed out as long as data is missing that a stream will bring. */
    async refine(options, what, partial) {
      setRequest(await received(options));
      const step = advanceAll();
      return partial || !step.stats.missing ? result(step, what) : { more: true };
    },
    /** The same when all data that it needs has arrived. */
    async reach(options, what) {
      setRequest(await received(options));
      const mine = goal;
      let step = advanceAll();
      while (step.more) {
        const before = step.stats;
        await parts.settled();
        if (mine !== goal) break;
        step = advanceAll();
        for (const name of SUMS) step.stats[name] += before[name];
      }
      if (mine === goal) return result(step, what);
      throw new TetralodError("replaced", REPLACED);
    },
    setRequest: async (options) => setRequest(await received(options)),
    step: (milliseconds, updates, what) => result(advance(milliseconds, updates), what),
    settled,
    arrived: () => parts.arrived(),
    retry: () => parts.retry(),
    /** Ends the fetching; the mesh stays usable. */
    halt: () => parts?.close(new TetralodError("freed", "the download was ended")),
    setField: (name) => session.setField(name),
    ...meshToolMethods(() => session),
    /** Begins another session over the same bytes, which is called through `port`. */
    view(port) {
      shared.count(1);
      const methods = coreMethods((name, data) => tell(name, data), shared);
      const free = () => {
        shared.count(-1);
        methods.free();
      };
      const tell = serve(portEndpoint(port), { ...methods, free }, WAITING);
    },
    free() {
      parts?.close(new TetralodError("freed", "this MultiTessellation has been freed"));
      session?.free();
    },
  };
}

/** The same calls as `Remote` makes, without a worker. */
export class Local {
  #methods;
  #shared;
  #closed = null;

  /**
   * @param {(name: string, data: any) => void} [onEvent] gets the events of the session
   * @param {SharedRanges} [shared]
   */
  constructor(onEvent = () => {}, shared = new SharedRanges()) {
    this.#shared = shared;
    this.#methods = coreMethods(onEvent, shared);
  }

  /** Another session over the same bytes. */
  view(onEvent) {
    this.#shared.count(1);
    return new Local(onEvent, this.#shared);
  }

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
    this.#shared.count(-1);
    this.#methods.free();
  }
}
