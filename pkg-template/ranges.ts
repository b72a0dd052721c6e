/**
 * Byte ranges of a file on a server: the loader in wasm decides what to fetch, cancel or read from the cache, and when;
 * this does it, and passes on the bytes that arrive. It does not interpret the bytes or decide which are needed.
 */

import { TetralodError, known, ofFile, reviveError } from "./errors.js";
import type { Traffic } from "./results.js";
import { Remote, portEndpoint } from "./rpc.js";
import type { ReaderMethods, ReaderPort } from "./stream.js";
import { shardAddress } from "./shards.js";
import type { RangeLoader } from "./tetralod_core.js";

/** The headers that the loader reads, in its order. */
const FIELDS = [
  "content-range",
  "content-length",
  "content-encoding",
  "content-type",
  "etag",
  "last-modified",
  "retry-after",
];

/** Statuses of an address that is good no longer. */
const GONE = [401, 403, 404, 410];

/** If a timer is later than this, the machine was asleep: that time does not count. */
const LATE = 100;

/** How ranges are fetched. */
export interface RangesOptions {
  /** Used in place of the global one, for instance to sign requests. */
  fetch?: Fetch;
  /** Go along with each request to the origin of the address; it must allow them. */
  headers?: HeadersInit;
  credentials?: RequestCredentials;
  /** Ranges that several sessions of one file have, in place of `cache`. */
  shared?: SharedRanges;
  /** Name of a cache (Cache Storage) in which ranges are kept for the next time, where there is one. */
  cache?: string;
  /** At a time; 6. */
  maxRequests?: number;
  /** Ranges closer than so many bytes are fetched as one; by default what suits the network. */
  gap?: number;
  /** 4 MiB. */
  maxRequestBytes?: number;
  /** Of the same bytes; 5. */
  retries?: number;
  /** Before the first of these; 500. */
  backoffMs?: number;
  /** Without a byte; 30000. */
  timeoutMs?: number;
  /** Is read instead of a server. */
  blob?: Blob;
  /** Is asked instead of a server. */
  reader?: ReaderPort;
  /** Stands for the address in messages. */
  name?: string;
}

/** How long is waited for a reader of the page's own, in ms: it gives bytes or says why not. Timers cannot wait much longer. */
const FOREVER = 2 ** 30;

/** A `fetch` of one address. */
export type Fetch = (url: string, init: RequestInit & { headers: Headers }) => Promise<Response>;

/** The class of the loader, of a wasm module that is loaded. */
export type Loader = typeof RangeLoader;

/** What hears of the ranges. */
interface RangesSink {
  /** The loader has ranges that are complete: they are to be taken. */
  onComplete(): void;
  /** Hears once, before any range, whether the server gives ranges. May call `close`. */
  onServer?(servesRanges: boolean): void;
  /** No more data arrives until `retry` is called. */
  onError(error: TetralodError): void;
}

/** Where ranges are kept. */
interface Kept {
  readonly isOpen: boolean;
  /** Finds what is kept: start and end of each range. */
  open(name: string): Promise<number[]>;
  get(start: number, end: number): Promise<Uint8Array | undefined>;
  /** Whether the range is kept now, and the loader has not heard of it. */
  put(start: number, end: number, bytes: Uint8Array<ArrayBuffer>): Promise<boolean>;
  clear(): void;
}

/** What the loader wants next: a request, by places in a shard, or its end, a range of the cache, or a wait. */
interface Action {
  id?: number;
  shard?: number;
  start?: number;
  end?: number;
  until?: number;
}

/** Protocols that carry many answers over one connection, and how many are asked for at a time then. */
const STREAMING = ["h2", "h3"];
const STREAMS = 24;

/** Tells the loader of a request, unless it has cancelled that; whether it wants more of it. */
type Tell = (what: (now: number) => void) => boolean;

/** The requests of one file. */
export class Ranges {
  #loader: RangeLoader;
  #url: string;
  /** Where redirects led to, for each shard. */
  #ledTo = new Map<number, string>();
  /** Whether other origins that redirects led to are asked directly. They are not sent the caller's headers; some refuse without. */
  #asksOthers = true;
  #options: RangesOptions;
  #sink: RangesSink;
  #open = new Map<number, AbortController>();
  #timer: ReturnType<typeof setTimeout> | undefined;
  /** Time that has passed while this was awake, and when that was last looked at. */
  #clock = 0;
  #seen = performance.now();
  #due = Infinity;
  #cached: Kept | undefined;
  #leave = () => {};
  #release = () => {};
  #failed = false;
  #closed = false;
  #knowsServer = false;
  #knowsProtocol = false;
  #forgets = false;

  constructor(Loader: Loader, url: string, sink: RangesSink, options: RangesOptions = {}) {
    this.#url = new URL(url, globalThis.location?.href).href;
    // What a file of the user does not give at once, it does not give later.
    const { blob, reader } = options;
    if (blob) options = { ...options, fetch: answering(this.#url, blob.size, (start, end) => blob.slice(start, end)), retries: 0, cache: undefined };
    if (reader) {
      const remote = new Remote<ReaderMethods>(portEndpoint(reader.port));
      const read = async (start: number, end: number) => (await remote.call("read", [start, end])).bytes;
      options = { timeoutMs: FOREVER, ...options, fetch: answering(this.#url, reader.size, read, reader.ranges), retries: 0, cache: undefined };
      // What is between the ranges that are there cannot be asked for with them.
      if (reader.ranges) options.gap = 0;
      this.#release = () => remote.close(new Error("the file was closed"));
    }
    const { maxRequests, gap, maxRequestBytes, retries, backoffMs, timeoutMs } = options;
    this.#loader = new Loader(maxRequests, gap, maxRequestBytes, retries, backoffMs, timeoutMs, Math.random());
    if (reader?.ranges) this.#loader.hold(Float64Array.from(reader.ranges));
    this.#options = options;
    // What the caller's own function puts into a request is meant for the address that was given.
    if (options.fetch) this.#asksOthers = false;
    this.#sink = sink;
  }

  /** Decides what to fetch. */
  get loader() {
    return this.#loader;
  }

  /** Tries again after an error. */
  retry() {
    if (this.#closed) return;
    this.#loader.retry();
    this.#cached = undefined;
    this.#forgets = false;
    this.#failed = false;
    this.go();
  }

  /** Data was damaged, perhaps in the cache, which is not used until `retry`. */
  forget() {
    this.#cached?.clear();
    this.#cached = undefined;
    this.#forgets = true;
    this.#loader.forgetCached();
  }

  /** The size of the file, once it is known. */
  get total(): number | undefined {
    return this.#closed ? undefined : this.#loader.total();
  }

  /** Whether the server gives ranges; if not, the file is read from its start. */
  get servesRanges(): boolean | undefined {
    return this.#closed ? undefined : this.#loader.servesRanges();
  }

  get traffic(): Traffic {
    const [requests, received, used, repeated, rounds, waitedMs] = this.#closed ? new Float64Array(6) : this.#loader.traffic();
    return { requests, received, used, repeated, rounds, waitedMs };
  }

  /** Ends all requests. */
  close() {
    if (this.#closed) return;
    this.#closed = true;
    clearTimeout(this.#timer);
    this.#leave();
    this.#release();
    for (const controller of this.#open.values()) controller.abort();
    this.#open.clear();
    this.#loader.free();
  }

  #now() {
    const now = performance.now();
    const passed = now - this.#seen;
    this.#clock += Math.min(passed, Math.max(this.#due, 0) + LATE);
    this.#due -= passed;
    this.#seen = now;
    return this.#clock;
  }

  /** Reports complete ranges and follows the loader: call it when the needs have changed. */
  go() {
    if (this.#closed) return;
    this.#learn();
    if (this.#closed) return;
    if (this.#loader.hasComplete()) {
      const cached = this.#cached;
      const copies = cached?.isOpen ? this.#loader.uncached() : [];
      this.#sink.onComplete();
      if (this.#closed) return;
      // What is damaged has made the cache forgotten.
      if (cached && cached === this.#cached) for (const range of copies) this.#keep(cached, range);
    }
    try {
      this.#obey();
    } catch (error) {
      this.#fail(reviveError(error));
    }
  }

  #fail(error: TetralodError) {
    if (this.#failed || this.#closed) return;
    this.#failed = true;
    this.#sink.onError(ofFile(this.#options.name ?? this.#url, error));
  }

  #obey() {
    clearTimeout(this.#timer);
    this.#now();
    this.#due = Infinity;
    for (let action: Action | undefined; (action = this.#loader.next(this.#now())); ) {
      const { id, shard = 0, start = 0, end = 0, until } = action;
      if (until !== undefined) {
        this.#due = Math.max(until - this.#clock, 1);
        this.#timer = setTimeout(() => this.go(), this.#due);
        return;
      }
      if (id === undefined) {
        this.#read(start, end);
      } else if (action.start === undefined) {
        this.#open.get(id)?.abort();
        this.#open.delete(id);
      } else {
        this.#fetch(id, shard, [start, end]);
      }
    }
  }

  async #keep(cached: Kept, { start, end, bytes }: { start: number; end: number; bytes: Uint8Array<ArrayBuffer> }) {
    if ((await cached.put(start, end, bytes)) && !this.#closed && cached === this.#cached) {
      this.#loader.addCached(Float64Array.of(start, end));
    }
  }

  /** A range from the cache, if it is still there and sound. */
  async #read(start: number, end: number) {
    const cached = this.#cached;
    const bytes = await cached?.get(start, end);
    if (this.#closed || cached !== this.#cached) return;
    if (bytes) this.#loader.put(start, end, bytes);
    else this.#loader.lost(start, end);
    this.go();
  }

  /** Reads the first response: whether there are ranges, and the version of the file, which selects the cache. */
  #learn() {
    if (!this.#knowsServer && this.servesRanges !== undefined) {
      this.#knowsServer = true;
      this.#sink.onServer?.(this.servesRanges);
      if (this.#closed) return;
    }
    const { cache = "", shared } = this.#options;
    const isKept = cache !== "" && globalThis.caches !== undefined;
    if (this.#cached || this.#forgets || !(isKept || shared)) return;
    const version = this.#loader.version();
    if (version === undefined) return;
    const cached = isKept ? new Cached(this.#url, version) : shared?.of(version);
    if (!cached) return;
    this.#cached = cached;
    if (cached instanceof SharedVersion) {
      this.#leave();
      this.#leave = cached.join((start, end) => cached === this.#cached && this.#loader.addCached(Float64Array.of(start, end)));
    }
    cached.open(cache).then((found) => {
      if (this.#closed || cached !== this.#cached) return;
      this.#loader.addCached(Float64Array.from(found));
      this.go();
    });
  }

  /** One request from beginning to end. */
  async #fetch(id: number, shard: number, range: [number, number]) {
    const controller = new AbortController();
    this.#open.set(id, controller);
    const tell: Tell = (what) => {
      if (this.#closed || this.#open.get(id) !== controller) return false;
      what(this.#now());
      this.go();
      return !this.#closed && this.#open.get(id) === controller;
    };
    const asked = this.#ledTo.get(shard) ?? shardAddress(this.#url, shard);
    try {
      await this.#receive(id, [shard, asked], range, controller.signal, tell);
    } catch (error) {
      const blocked = !controller.signal.aborted && (await this.#isBlocked(error, asked, controller.signal));
      // A reader knows best what is wrong.
      if (error instanceof TetralodError) this.#fail(error);
      const { message, cause } = known(error);
      const detail = String(cause?.message || cause?.code || message || error);
      tell((now) => this.#loader.failed(id, now, blocked, detail));
    }
    if (this.#open.get(id) === controller) this.#open.delete(id);
    controller.abort();
    this.#learnProtocol(asked);
  }

  /** Browsers open few connections to a server, but ask for many things at once on one where the protocol can. */
  #learnProtocol(url: string) {
    if (this.#closed || this.#knowsProtocol || this.#options.maxRequests !== undefined) return;
    const entries = globalThis.performance?.getEntriesByName?.(url, "resource") ?? [];
    const { nextHopProtocol = "" } = (entries.at(-1) as PerformanceResourceTiming | undefined) ?? {};
    this.#knowsProtocol = nextHopProtocol !== "";
    if (STREAMING.includes(nextHopProtocol)) this.#loader.setMaxRequests(STREAMS);
  }

  async #receive(id: number, [shard, url]: [number, string], [start, end]: [number, number], signal: AbortSignal, tell: Tell) {
    const response = await this.#request(url, start, end, signal);
    if (GONE.includes(response.status) && url !== shardAddress(this.#url, shard)) {
      // Addresses that redirects lead to may be good for a while only.
      if (this.#ledTo.get(shard) === url) this.#ledTo.delete(shard);
      if (this.#options.headers && !this.#isOwn(url)) this.#asksOthers = false;
      throw new Error(`HTTP ${response.status} where a redirect led to`);
    }
    if (response.ok && response.url && (this.#isOwn(response.url) || this.#asksOthers)) this.#ledTo.set(shard, response.url);
    const fields = FIELDS.map((name) => response.headers.get(name));
    if (!tell((now) => this.#loader.head(id, now, response.status, fields))) return;
    await this.#body(response, (bytes) => tell((now) => this.#loader.data(id, now, bytes)));
    tell((now) => this.#loader.end(id, now));
  }

  /** Whether an address is of the same origin as the given one. */
  #isOwn(url: string) {
    return new URL(url).origin === new URL(this.#url).origin;
  }

  #request(url: string, start: number, end: number, signal: AbortSignal) {
    // Without an end where it is not known: such numbers are no integers any more.
    const last = Number.isSafeInteger(end) ? end - 1 : "";
    // Whoever a server redirects to must not learn what the caller tells that server.
    const headers = new Headers(this.#isOwn(url) ? this.#options.headers : undefined);
    headers.set("range", `bytes=${start}-${last}`);
    const call = this.#options.fetch ?? globalThis.fetch;
    // A browser's own cache serves ranges of one address one after the other, and may mix versions.
    return call(url, { signal, headers, credentials: this.#options.credentials, cache: "no-store" });
  }

  /** Reads until the end, or until the request is cancelled. */
  async #body(response: Response, take: (bytes: Uint8Array) => boolean) {
    const reader = response.body?.getReader();
    if (!reader) return;
    for (;;) {
      const { done, value } = await reader.read();
      if (done) return;
      if (!take(value)) return reader.cancel().catch(() => {});
    }
  }

  /**
   * Whether CORS, not the network, is the cause of a failure. Pages cannot see the difference; but a request without
   * CORS, whose response cannot be read, succeeds if the server can be reached.
   */
  async #isBlocked(error: unknown, url: string, signal: AbortSignal): Promise<boolean> {
    const page = globalThis.location?.origin;
    if (!(error instanceof TypeError) || !page || page === "null" || new URL(url).origin === page) return false;
    if (this.#options.fetch) return false;
    const probe = fetch(url, { mode: "no-cors", method: "HEAD", cache: "no-store", signal });
    return probe.then(() => true, () => false);
  }
}

/** Ranges that the sessions of one file share in memory, as long as there are several. */
export class SharedRanges {
  #versions = new Map<string, SharedVersion>();
  #sessions = 1;

  /** Those of one version of the file. */
  of(version: string): SharedVersion {
    const found = this.#versions.get(version) ?? new SharedVersion(() => this.#sessions > 1);
    this.#versions.set(version, found);
    return found;
  }

  /** There is one more session, or one less: the last one needs nothing of this. */
  count(change: number) {
    this.#sessions += change;
    if (this.#sessions > 1) return;
    for (const version of this.#versions.values()) version.clear();
  }
}

type Hear = (start: number, end: number) => void;

/** Those of one version. */
class SharedVersion implements Kept {
  #isShared: () => boolean;
  #ranges = new Map<string, Uint8Array>();
  /** What hears of ranges that come. */
  #heard = new Set<Hear>();

  constructor(isShared: () => boolean) {
    this.#isShared = isShared;
  }

  get isOpen() {
    return this.#isShared();
  }

  /** Tells `hear` of what comes, until it leaves. */
  join(hear: Hear): () => void {
    this.#heard.add(hear);
    return () => this.#heard.delete(hear);
  }

  async open() {
    return [...this.#ranges.keys()].flatMap((key) => key.split("-").map(Number));
  }

  async get(start: number, end: number) {
    return this.#ranges.get(`${start}-${end}`);
  }

  async put(start: number, end: number, bytes: Uint8Array) {
    this.#ranges.set(`${start}-${end}`, bytes);
    for (const hear of this.#heard) hear(start, end);
    return false;
  }

  clear() {
    this.#ranges.clear();
  }
}

/**
 * Answers requests for ranges of the file at `address`, of this size, as a server would, by what `read` gives of those that are there. Other
 * shards of it are not.
 */
function answering(
  address: string,
  size: number,
  read: (start: number, end: number) => BodyInit | Promise<BodyInit>,
  there: readonly number[] = [0, size],
): Fetch {
  return async (asked, { headers }) => {
    if (asked !== address) return new Response(null, { status: 404 });
    const [, first, last] = /^bytes=(\d+)-(\d*)$/.exec(headers.get("range") ?? "") ?? ["", "0", ""];
    const start = Number(first);
    const until = there.find((_, i) => i % 2 === 1 && there[i - 1] <= start && start < there[i]) ?? 0;
    const end = last === "" ? until : Math.min(Number(last) + 1, until);
    if (start >= end) return new Response(null, { status: 416, headers: { "content-range": `bytes */${size}` } });
    const range = { "content-range": `bytes ${start}-${end - 1}/${size}`, "content-length": String(end - start), etag: '"file"' };
    return new Response(await read(start, end), { status: 206, headers: range });
  };
}

/** Ranges of one version of one file in Cache Storage. Nothing depends on it: whatever fails is as if it were empty. */
class Cached implements Kept {
  #cache: Cache | undefined;
  #base: URL;
  /** Addresses of what is kept. */
  #keys = new Set<string>();

  constructor(url: string, version: string) {
    this.#base = new URL(url);
    this.#base.hash = "";
    this.#base.searchParams.set("tetralod-version", version);
  }

  get isOpen() {
    return this.#cache !== undefined;
  }

  /** Ranges of other versions are of no more use. */
  async open(name: string) {
    const found: number[] = [];
    try {
      const cache = await caches.open(name);
      const { origin, pathname, searchParams } = this.#base;
      for (const { url } of await cache.keys()) {
        const key = new URL(url);
        const version = key.searchParams.get("tetralod-version");
        if (!version || key.origin !== origin || key.pathname !== pathname) continue;
        if (version !== searchParams.get("tetralod-version")) {
          await cache.delete(url);
          continue;
        }
        this.#keys.add(url);
        found.push(...(key.searchParams.get("tetralod-range") ?? "").split("-").map(Number));
      }
      this.#cache = cache;
    } catch {
      // As if it were empty.
    }
    return found;
  }

  #key(start: number, end: number) {
    const key = new URL(this.#base);
    key.searchParams.set("tetralod-range", `${start}-${end}`);
    return key.href;
  }

  async get(start: number, end: number) {
    const key = this.#key(start, end);
    try {
      const response = await this.#cache?.match(key);
      const bytes = response && new Uint8Array(await response.arrayBuffer());
      if (bytes?.length === Number(response?.headers.get("content-length"))) return bytes;
    } catch {
      // As if it were empty.
    }
    this.#keys.delete(key);
    return undefined;
  }

  async put(start: number, end: number, bytes: Uint8Array<ArrayBuffer>) {
    const key = this.#key(start, end);
    const response = new Response(bytes, { headers: { "content-length": String(bytes.length) } });
    try {
      await this.#cache?.put(key, response);
    } catch {
      return false;
    }
    this.#keys.add(key);
    return true;
  }

  clear() {
    for (const key of this.#keys) this.#cache?.delete(key).catch(() => {});
    this.#keys.clear();
  }
}
