/** The wasm core behind the methods that `MultiTessellation` calls: in a worker, or in the caller's own thread. */

import initCore, { CoreSession, RangeLoader } from "./tetralod_core.js";
import { arraysIn } from "./changes.js";
import { TetralodError, flattenError, reviveError } from "./errors.js";
import { received } from "./options.js";
import { coreWasm } from "./files.js";
import { Parts } from "./parts.js";
import { SharedRanges } from "./ranges.js";
import { portEndpoint, serve } from "./rpc.js";
import { wasmError, wasmOf } from "./start.js";
import { withFields } from "./stored.js";
import { limitOf, meshToolMethods } from "./tools.js";
import { VERSION } from "./version.js";

/** @type {Promise<{ memory: WebAssembly.Memory }> | undefined} */
let loading;

/** The wasm module, which is compiled once per thread; without `wasm`, its address or its bytes, the one of the package. */
export function loadCore(wasm = undefined) {
  loading ??= compiled(wasm ?? coreWasm()).catch((error) => {
    loading = undefined;
    throw wasmError(error, "tetralod/core.wasm");
  });
  return loading;
}

const compiled = async (wasm) => initCore({ module_or_path: await wasmOf(wasm) });

/** The methods that wait for bytes, beside which others are answered. */
export const WAITING = ["openParts", "reach", "settled", "arrived"];

export const REPLACED = "another mesh was requested before all data for this one had arrived";

/** A request that every mesh meets. @type {Record<string, any>} */
const NOTHING = { error: Number.MAX_VALUE };

/** What adds up over the steps of a refinement. */
const SUMS = ["refined", "coarsened", "forced", "judged", "milliseconds"];

/** The methods of one session, for `serve` or `Local`; `emit` sends events, `shared` are the ranges of all sessions of the file. */
export function coreMethods(emit, shared = new SharedRanges()) {
  /** @type {CoreSession | undefined} */
  let session;
  /** That of the wasm module. @type {WebAssembly.Memory} */
  let memory;
  /** The last request, and the one before it, which holds again if that is given up. @type {Record<string, any>} */
  let request = NOTHING;
  let before = NOTHING;
  /** @type {Parts | undefined} */
  let parts;
  /** Counts the requests. */
  let goal = 0;
  /** The caller's number of the last one, if it may be given up. @type {number | undefined} */
  let given;
  const setRequest = (options) => {
    session.request(options);
    [before, request, given] = [request, options ?? {}, undefined];
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
  const result = ({ stats, more }, { deltas, arrays, zeroCopy, fields = [] }) => {
    if (deltas) return { ...session.delta(arrays), stats, more };
    const mesh = session.mesh(zeroCopy ? 0 : arrays);
    withFields(mesh, fields, fields.map(({ index }) => session.values(index)));
    if (!zeroCopy) return { ...mesh, stats, more };
    // Last: where the memory grows, views of it end.
    const places = session.places();
    return { ...mesh, ...arraysIn(memory.buffer, places, arrays), stats, more };
  };
  const close = (reason) => {
    parts?.close(reason);
    session?.free();
    [session, parts] = [undefined, undefined];
  };
  return {
    async load(wasm) {
      await loadCore(wasm);
      return { name: "core", version: VERSION };
    },
    async start(fields) {
      ({ memory } = await loadCore());
      session = new CoreSession(fields);
    },
    feed: (bytes) => session.feed(bytes),
    /** Opens a file in parts; resolves to nothing without ranges of the server, else when the base mesh has arrived. */
    async openParts(url, { fields, memory: bytes, ...options }) {
      ({ memory } = await loadCore());
      const make = (loader) => (session = CoreSession.inParts(fields, bytes, loader));
      parts = new Parts(RangeLoader, make, url, { ...options, shared }, (progress) => emit("progress", progress), (error) => emit("error", flattenError(error)));
      if (await parts.begin()) return { info: session.info(), progress: parts.progress };
      return close();
    },
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
      given = what.goal;
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
    /** Gives a request up that waits for data, if it is the last one: nothing more is fetched for it. */
    abandon(number) {
      if (number === given) setRequest(before);
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
    free: () => close(new TetralodError("freed", "this MultiTessellation has been freed")),
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
