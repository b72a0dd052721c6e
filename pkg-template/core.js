/** The wasm core behind the methods that `MultiTessellation` calls: in a worker, or in the caller's own thread. */

import initCore, { CoreSession, RangeLoader } from "./tetralod_core.js";
import initAllKinds, { CoreSession as AllKindsSession, RangeLoader as AllKindsLoader } from "./tetralod_all_kinds.js";
import initTools, { MeshTools } from "./tetralod_tools.js";
import { arraysIn, copyChanged } from "./changes.js";
import { TetralodError, flattenError, reviveError } from "./errors.js";
import { received } from "./options.js";
import { allKindsWasm, coreWasm, toolsWasm } from "./files.js";
import { Parts } from "./parts.js";
import { FirstResponse, SharedRanges } from "./ranges.js";
import { portEndpoint, serve } from "./rpc.js";
import { wasmError, wasmOf } from "./start.js";
import { withFields } from "./stored.js";
import { copyToolMethods, limitOf } from "./tools.js";
import { VERSION } from "./version.js";

/**
 * A wasm module that is compiled once per thread.
 *
 * @template T
 * @param {(options: object) => Promise<{ memory: WebAssembly.Memory }>} init
 * @param {T} classes
 * @param {() => any} place the address of the package's own, or its bytes
 * @param {string} entry
 * @param {string} [option] what else may say where it is
 */
function lazily(init, classes, place, entry, option) {
  let loading;
  const load = async (wasm) => {
    const { memory } = await init({ module_or_path: await wasmOf(wasm) });
    return { ...classes, memory };
  };
  /** Without `wasm`, its address or its bytes, the one of the package. */
  return (wasm = undefined) => {
    loading ??= load(wasm ?? place()).catch((error) => {
      loading = undefined;
      throw wasmError(error, entry, option);
    });
    return loading;
  };
}

/** The module that is enough for half-edge MTs. */
export const loadCore = lazily(initCore, { Session: CoreSession, Loader: RangeLoader }, coreWasm, "tetralod/core.wasm");

/** The one for MTs of the other kinds: a page that opens none does not download it. */
const loadAllKinds = lazily(initAllKinds, { Session: AllKindsSession, Loader: AllKindsLoader }, allKindsWasm, "tetralod/all-kinds.wasm");

/** Where the caller says that the one with the tools is. */
let toolsPlace;

/** The one with the tools for meshes: a page that only wants the mesh does not download it. */
const loadTools = lazily(initTools, { Tools: MeshTools }, () => toolsPlace ?? toolsWasm(), "tetralod/tools.wasm", "toolsUrl");

/** The methods that wait for bytes, beside which others are answered. */
export const WAITING = ["openParts", "reach", "settled", "arrived"];

export const REPLACED = "another mesh was requested before all data for this one had arrived";

/** A request that every mesh meets. @type {Record<string, any>} */
const NOTHING = { error: Number.MAX_VALUE };

/** What adds up over the steps of a refinement. */
const SUMS = ["refined", "coarsened", "forced", "judged", "milliseconds"];

/** The methods of one session, for `serve` or `Local`; `emit` sends events, `shared` are the ranges of all sessions of the file. */
export function coreMethods(emit, shared = new SharedRanges()) {
  /** The wasm module: first the one for half-edge MTs, which says what is of another kind. */
  let load = loadCore;
  /** @type {Awaited<ReturnType<typeof loadCore>>} */
  let wasm;
  let session;
  /** What works on a copy of the mesh. @type {MeshTools | undefined} */
  let tools;
  /** What has come of a stream until its base mesh is there, and the fields that are wanted of it. @type {Uint8Array[] | undefined} */
  let head;
  let wanted;
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
    return { ...mesh, ...arraysIn(wasm.memory.buffer, places, arrays), stats, more };
  };
  /** Calls `use` with the tools and the mesh as it is now: what has changed since the last time is copied. */
  const withTools = async (use) => {
    const { Tools, memory } = await loadTools();
    const changed = session.copied(!tools);
    const made = tools ?? new Tools();
    // If this fails, the next call begins with another copy.
    tools = undefined;
    made.setStored(session.stored());
    const places = session.sources();
    const copies = made.change(places[1] / 3, places[5] / 4, changed.vertices, changed.tets);
    copyChanged([wasm.memory.buffer, places], [memory.buffer, copies], changed);
    tools = made;
    return use(tools);
  };
  const close = (reason) => {
    parts?.close(reason);
    session?.free();
    tools?.free();
    [session, parts, tools] = [undefined, undefined, undefined];
  };
  /** Begins with the file again, with the other module, where this one has no MTs of its kind. */
  const orWithAllKinds = async (first, again) => {
    try {
      return await first();
    } catch (error) {
      if (error?.code !== "kind" || load === loadAllKinds) throw error;
      close();
      load = loadAllKinds;
      return again();
    }
  };
  const start = async () => {
    wasm = await load();
    session = new wasm.Session(wanted);
  };
  const feedAll = async () => {
    await start();
    let progress;
    for (const bytes of head) progress = session.feed(bytes);
    return progress;
  };
  const openParts = async (url, { fields, memory, ...options }) => {
    wasm = await load();
    const make = (loader) => (session = wasm.Session.inParts(fields, memory, loader));
    parts = new Parts(wasm.Loader, make, url, { ...options, shared }, (progress) => emit("progress", progress), (error) => emit("error", flattenError(error)));
    if (await parts.begin()) return { info: session.info(), progress: parts.progress };
    return close();
  };
  return {
    async load(wasm, tools) {
      toolsPlace = tools ?? toolsPlace;
      await loadCore(wasm);
      return { name: "core", version: VERSION };
    },
    start(fields) {
      [head, wanted] = [[], fields];
      return start();
    },
    async feed(bytes) {
      head?.push(bytes);
      const progress = await orWithAllKinds(() => session.feed(bytes), feedAll);
      if (progress.ready) head = undefined;
      return progress;
    },
    /** Opens a file in parts; resolves to nothing without ranges of the server, else when the base mesh has arrived. */
    async openParts(url, options) {
      // What has come for one module is not fetched again for the other.
      const first = new FirstResponse();
      const open = () => openParts(url, { ...options, first });
      const again = () => {
        first.begin();
        return open();
      };
      const opened = await orWithAllKinds(open, again);
      first.take();
      return opened;
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
    ...copyToolMethods(() => session, withTools),
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
