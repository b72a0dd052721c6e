/** The wasm core behind the methods that `MultiTessellation` calls: in a worker, or in the caller's own thread. */

import initCore, { CoreSession, RangeLoader } from "./tetralod_core.js";
import { arraysIn } from "./changes.js";
import { TetralodError, flattenError, reviveError } from "./errors.js";
import { type RefineOptions, type Unchecked, received } from "./options.js";
import { coreWasm } from "./files.js";
import { Parts } from "./parts.js";
import { type RangesOptions, SharedRanges } from "./ranges.js";
import type { CoreStats, Mesh, MeshChanges, MeshDelta, MtInfo, Progress, RefineStats } from "./results.js";
import { type Answer, type Args, type OnEvent, portEndpoint, serve } from "./rpc.js";
import { type Loaded, type WasmSource, wasmError, wasmOf } from "./start.js";
import { type KnownField, withFields } from "./stored.js";
import { limitOf, meshToolMethods } from "./tools.js";
import { VERSION } from "./version.js";

let loading: Promise<{ memory: WebAssembly.Memory }> | undefined;

/** The wasm module, which is compiled once per thread; without `wasm`, its address or its bytes, the one of the package. */
export function loadCore(wasm?: WasmSource) {
  loading ??= compiled(wasm ?? coreWasm()).catch((error) => {
    loading = undefined;
    throw wasmError(error, "tetralod/core.wasm");
  });
  return loading;
}

const compiled = async (wasm: WasmSource) => initCore({ module_or_path: await wasmOf(wasm) });

/** The methods that wait for bytes, beside which others are answered. */
export const WAITING = ["openParts", "reach", "settled", "arrived"];

export const REPLACED = "another mesh was requested before all data for this one had arrived";

/** A request that every mesh meets. */
const NOTHING: Unchecked = { error: Number.MAX_VALUE };

/** What adds up over the steps of a refinement. */
const SUMS = ["refined", "coarsened", "forced", "judged", "milliseconds"] as const;

/** How a mesh is handed out: which arrays, and whether only what has changed in them. */
export interface What {
  deltas: boolean;
  /** A set of bits. */
  arrays: number;
  fields?: KnownField[];
  zeroCopy?: boolean;
  /** The caller's number of the request, which may be given up. */
  goal?: number;
}

/** A mesh that was made, or what has changed in it. */
export type Handed = (Partial<Mesh> | Partial<MeshDelta>) & { changes: MeshChanges; stats: RefineStats; more: boolean };

/** Where there is no mesh yet. */
export interface NotYet {
  stats?: undefined;
  more: true;
}

/** One step; `more`: whether there is more to do, now or when more data has arrived. */
interface Step {
  stats: RefineStats;
  more: boolean;
}

/** How a file in parts is read. */
type PartsOptions = RangesOptions & { fields: readonly string[]; memory: number };

/** The methods of one session, for `serve` or `Local`; `emit` sends events, `shared` are the ranges of all sessions of the file. */
export function coreMethods(emit: OnEvent, shared = new SharedRanges()) {
  let session: CoreSession | undefined;
  /** That of the wasm module. */
  let memory: WebAssembly.Memory | undefined;
  /** The last request, and the one before it, which holds again if that is given up. */
  let request = NOTHING;
  let before = NOTHING;
  let parts: Parts | undefined;
  /** Counts the requests. */
  let goal = 0;
  /** The caller's number of the last one, if it may be given up. */
  let given: number | undefined;
  const open = (): CoreSession => {
    if (session) return session;
    throw new TetralodError("freed", "this session has been freed");
  };
  const setRequest = (options: Unchecked) => {
    open().request(options as RefineOptions);
    [before, request, given] = [request, options ?? {}, undefined];
    goal++;
    parts?.turn();
  };
  const advance = (milliseconds: number, updates: number): Step => {
    const start = performance.now();
    parts?.look();
    const made: CoreStats = open().step(milliseconds, updates);
    const took = performance.now() - start;
    parts?.follow();
    const stats = { ...made, milliseconds: took, limitedBy: limitOf(made, parts?.progress.blocks, request) };
    return { stats, more: !stats.done || Boolean(parts?.hasMore) };
  };
  /** Refines with all data that has arrived. */
  const advanceAll = (): Step => {
    for (let all: RefineStats | undefined; ; ) {
      const step = advance(Infinity, Infinity);
      if (all) for (const name of SUMS) step.stats[name] += all[name];
      if (step.stats.done) return step;
      all = step.stats;
    }
  };
  /** Resolves when all data that the mesh needs has arrived. Arriving blocks may show that others are needed. */
  const settled = async () => {
    let done: boolean;
    do {
      await parts?.settled();
      if (goal === 0) return;
      // The changes are kept for callers that follow the mesh by deltas.
      ({ done } = open().step(Infinity, Infinity));
      parts?.follow();
    } while (!done || parts?.isWaiting);
  };
  /** The mesh as it is now, or what has changed in it, after a step. */
  const result = ({ stats, more }: Step, { deltas, arrays, zeroCopy, fields = [] }: What): Handed => {
    const session = open();
    if (deltas) return { ...session.delta(arrays), stats, more };
    const mesh = session.mesh(zeroCopy ? 0 : arrays);
    withFields(mesh, fields, fields.map(({ index }) => session.values(index)));
    if (!zeroCopy || !memory) return { ...mesh, stats, more };
    // Last: where the memory grows, views of it end.
    const places = session.places();
    return { ...mesh, ...arraysIn(memory.buffer as ArrayBuffer, places, arrays), stats, more };
  };
  const close = (reason?: TetralodError) => {
    parts?.close(reason);
    session?.free();
    [session, parts] = [undefined, undefined];
  };
  return {
    async load(wasm?: WasmSource): Promise<Loaded> {
      await loadCore(wasm);
      return { name: "core", version: VERSION };
    },
    async start(fields: readonly string[]) {
      ({ memory } = await loadCore());
      session = new CoreSession([...fields]);
    },
    feed: (bytes: Uint8Array): Progress => open().feed(bytes),
    /** Opens a file in parts; resolves to nothing without ranges of the server, else when the base mesh has arrived. */
    async openParts(url: string, { fields, memory: bytes, ...options }: PartsOptions): Promise<{ info: MtInfo; progress: Progress } | undefined> {
      ({ memory } = await loadCore());
      const make = (loader: RangeLoader) => (session = CoreSession.inParts([...fields], bytes, loader));
      const [tell, fail] = [(progress: Progress) => emit("progress", progress), (error: TetralodError) => emit("error", flattenError(error))];
      const mine = (parts = new Parts(RangeLoader, make, url, { ...options, shared }, tell, fail));
      if (await mine.begin()) return { info: open().info() as MtInfo, progress: mine.progress };
      close();
      return undefined;
    },
    finish: (): Progress => open().finish(),
    info: (): MtInfo | undefined => open().info(),
    /** Without `partial`, nothing is handed out as long as data is missing that a stream will bring. */
    async refine(options: Unchecked, what: What, partial: boolean): Promise<Handed | NotYet> {
      setRequest(await received(options));
      const step = advanceAll();
      return partial || !step.stats.missing ? result(step, what) : { more: true };
    },
    /** The same when all data that it needs has arrived. */
    async reach(options: Unchecked, what: What): Promise<Handed> {
      setRequest(await received(options));
      const mine = goal;
      given = what.goal;
      let step = advanceAll();
      while (step.more) {
        const before = step.stats;
        await parts?.settled();
        if (mine !== goal) break;
        step = advanceAll();
        for (const name of SUMS) step.stats[name] += before[name];
      }
      if (mine === goal) return result(step, what);
      throw new TetralodError("replaced", REPLACED);
    },
    /** Gives a request up that waits for data, if it is the last one: nothing more is fetched for it. */
    abandon(number: number) {
      if (number === given) setRequest(before);
    },
    setRequest: async (options: Unchecked) => setRequest(await received(options)),
    step: (milliseconds: number, updates: number, what: What): Handed => result(advance(milliseconds, updates), what),
    settled,
    arrived: async () => parts?.arrived(),
    retry: () => parts?.retry(),
    /** Ends the fetching; the mesh stays usable. */
    halt: () => parts?.close(new TetralodError("freed", "the download was ended")),
    setField: (name: string | number) => open().setField(name),
    ...meshToolMethods(open),
    /** Begins another session over the same bytes, which is called through `port`. */
    view(port: MessagePort): void {
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

export type CoreMethods = ReturnType<typeof coreMethods>;

/** The same calls as `Remote` makes, without a worker. */
export class Local {
  #methods: CoreMethods;
  #shared: SharedRanges;
  #closed: Error | undefined;

  /** @param onEvent gets the events of the session */
  constructor(onEvent: OnEvent = () => {}, shared = new SharedRanges()) {
    this.#shared = shared;
    this.#methods = coreMethods(onEvent, shared);
  }

  /** Another session over the same bytes. */
  view(onEvent: OnEvent) {
    this.#shared.count(1);
    return new Local(onEvent, this.#shared);
  }

  async call<Method extends keyof CoreMethods>(method: Method, args: Args<CoreMethods, Method>, _transfer?: Transferable[]): Answer<CoreMethods, Method> {
    if (this.#closed) throw this.#closed;
    try {
      return await (this.#methods[method] as (...args: any[]) => any)(...args);
    } catch (error) {
      // What was under way when the session was freed fails in some way of its own.
      throw this.#closed ?? reviveError(error);
    }
  }

  close(reason: Error) {
    if (this.#closed) return;
    this.#closed = reason;
    this.#shared.count(-1);
    this.#methods.free();
  }
}
