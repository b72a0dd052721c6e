/**
 * Byte ranges of a file on a server: the loader in wasm decides what to fetch, cancel or read from the cache, and when;
 * this does it, and passes on the bytes that arrive. It does not interpret the bytes or decide which are needed.
 */

import { TetralodError, reviveError } from "./errors.js";

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

/**
 * @typedef {object} RangesOptions
 * @property {typeof fetch} [fetch] used in place of the global one, for instance to sign requests
 * @property {HeadersInit} [headers] go along with each request to the origin of the address; it must allow them
 * @property {RequestCredentials} [credentials]
 * @property {SharedRanges} [shared] ranges that several sessions of one file have, in place of `cache`
 * @property {string} [cache] name of a cache (Cache Storage) in which ranges are kept for the next time, where there is one
 * @property {number} [maxRequests] at a time; 6
 * @property {number} [gap] ranges closer than so many bytes are fetched as one; 16384
 * @property {number} [maxRequestBytes] 4 MiB
 * @property {number} [retries] of the same bytes; 5
 * @property {number} [backoffMs] before the first of these; 500
 * @property {number} [timeoutMs] without a byte; 30000
 * @property {Blob} [blob] is read instead of a server
 * @property {string} [name] stands for the address in messages
 */

/**
 * @typedef {object} RangesSink
 * @property {() => void} onComplete the loader has ranges that are complete: they are to be taken
 * @property {(servesRanges: boolean) => void} [onServer] hears once, before any range, whether the server gives ranges. May
 *   call `close`.
 * @property {(error: TetralodError) => void} onError no more data arrives until `retry` is called
 */

/** The requests of one file. */
export class Ranges {
  #loader;
  #url;
  /** Where redirects led to. */
  #ledTo;
  /** Whether other origins that redirects led to are asked directly. They are not sent the caller's headers; some refuse without. */
  #asksOthers = true;
  #options;
  #sink;
  /** @type {Map<number, AbortController>} */
  #open = new Map();
  #timer;
  /** Time that has passed while this was awake, and when that was last looked at. */
  #clock = 0;
  #seen = performance.now();
  #due = Infinity;
  /** @type {Cached | SharedVersion | undefined} */
  #cached;
  #leave = () => {};
  #failed = false;
  #closed = false;
  #knowsServer = false;
  #forgets = false;

  /**
   * @param {typeof import("./tetralod_core.js").RangeLoader} RangeLoader of a wasm module that is loaded
   * @param {string} url
   * @param {RangesSink} sink
   * @param {RangesOptions} [options]
   */
  constructor(RangeLoader, url, sink, options = {}) {
    // What a file of the user does not give at once, it does not give later.
    if (options.blob) options = { ...options, fetch: sliceOf(options.blob), retries: 0, cache: undefined };
    const { maxRequests, gap, maxRequestBytes, retries, backoffMs, timeoutMs } = options;
    this.#loader = new RangeLoader(maxRequests, gap, maxRequestBytes, retries, backoffMs, timeoutMs, Math.random());
    this.#url = this.#ledTo = new URL(url, globalThis.location?.href).href;
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
  get total() {
    return this.#closed ? undefined : this.#loader.total();
  }

  /** Whether the server gives ranges; if not, the file is read from its start. */
  get servesRanges() {
    return this.#closed ? undefined : this.#loader.servesRanges();
  }

  /** Statistics: requests, bytes that have arrived, and bytes that were needed. */
  get traffic() {
    const [requests, received, used] = this.#closed ? [0, 0, 0] : this.#loader.traffic();
    return { requests, received, used };
  }

  /** Ends all requests. */
  close() {
    if (this.#closed) return;
    this.#closed = true;
    clearTimeout(this.#timer);
    this.#leave();
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
      if (cached === this.#cached) for (const range of copies) this.#keep(range);
    }
    try {
      this.#obey();
    } catch (error) {
      if (this.#failed) return;
      this.#failed = true;
      const known = reviveError(error);
      const name = this.#options.name ?? this.#url;
      this.#sink.onError(new TetralodError(known.code, `${name}: ${known.message}`, { cause: error }));
    }
  }

  #obey() {
    clearTimeout(this.#timer);
    this.#now();
    this.#due = Infinity;
    for (let action; (action = this.#loader.next(this.#now())); ) {
      const { id, start, end, until } = action;
      if (until !== undefined) {
        this.#due = Math.max(until - this.#clock, 1);
        this.#timer = setTimeout(() => this.go(), this.#due);
        return;
      }
      if (start === undefined) {
        this.#open.get(id)?.abort();
        this.#open.delete(id);
      } else if (id === undefined) {
        this.#read(start, end);
      } else {
        this.#fetch(id, start, end);
      }
    }
  }

  async #keep({ start, end, bytes }) {
    const cached = this.#cached;
    if ((await cached.put(start, end, bytes)) && !this.#closed && cached === this.#cached) {
      this.#loader.addCached(Float64Array.of(start, end));
    }
  }

  /** A range from the cache, if it is still there and sound. */
  async #read(start, end) {
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
    const isKept = cache !== "" && globalThis.caches;
    if (this.#cached || this.#forgets || !(isKept || shared)) return;
    const version = this.#loader.version();
    if (version === undefined) return;
    const cached = isKept ? new Cached(this.#url, version) : shared.of(version);
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
  async #fetch(id, start, end) {
    const controller = new AbortController();
    this.#open.set(id, controller);
    /** Tells the loader, unless it has cancelled the request. */
    const tell = (what) => {
      if (this.#closed || this.#open.get(id) !== controller) return false;
      what(this.#now());
      this.go();
      return !this.#closed && this.#open.get(id) === controller;
    };
    const asked = this.#ledTo;
    try {
      await this.#receive(id, asked, [start, end], controller.signal, tell);
    } catch (error) {
      const blocked = !controller.signal.aborted && (await this.#isBlocked(error, asked, controller.signal));
      const detail = String(error?.cause?.message || error?.cause?.code || error?.message || error);
      tell((now) => this.#loader.failed(id, now, blocked, detail));
    }
    if (this.#open.get(id) === controller) this.#open.delete(id);
    controller.abort();
  }

  async #receive(id, url, [start, end], signal, tell) {
    const response = await this.#request(url, start, end, signal);
    if (GONE.includes(response.status) && url !== this.#url) {
      // Addresses that redirects lead to may be good for a while only.
      if (this.#ledTo === url) this.#ledTo = this.#url;
      if (this.#options.headers && !this.#isOwn(url)) this.#asksOthers = false;
      throw new Error(`HTTP ${response.status} where a redirect led to`);
    }
    if (response.ok && response.url && (this.#isOwn(response.url) || this.#asksOthers)) this.#ledTo = response.url;
    const fields = FIELDS.map((name) => response.headers.get(name));
    if (!tell((now) => this.#loader.head(id, now, response.status, fields))) return;
    await this.#body(response, (bytes) => tell((now) => this.#loader.data(id, now, bytes)));
    tell((now) => this.#loader.end(id, now));
  }

  /** Whether an address is of the same origin as the given one. */
  #isOwn(url) {
    return new URL(url).origin === new URL(this.#url).origin;
  }

  #request(url, start, end, signal) {
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
  async #body(response, take) {
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
  async #isBlocked(error, url, signal) {
    const page = globalThis.location?.origin;
    if (!(error instanceof TypeError) || !page || page === "null" || new URL(url).origin === page) return false;
    if (this.#options.fetch) return false;
    const probe = fetch(url, { mode: "no-cors", method: "HEAD", cache: "no-store", signal });
    return probe.then(() => true, () => false);
  }
}

/** Ranges that the sessions of one file share in memory, as long as there are several. */
export class SharedRanges {
  /** @type {Map<string, SharedVersion>} */
  #versions = new Map();
  #sessions = 1;

  /** Those of one version of the file. */
  of(version) {
    const found = this.#versions.get(version) ?? new SharedVersion(() => this.#sessions > 1);
    this.#versions.set(version, found);
    return found;
  }

  /** There is one more session, or one less: the last one needs nothing of this. */
  count(change) {
    this.#sessions += change;
    if (this.#sessions > 1) return;
    for (const version of this.#versions.values()) version.clear();
  }
}

/** Those of one version; the same calls as `Cached` has. */
class SharedVersion {
  #isShared;
  /** @type {Map<string, Uint8Array>} */
  #ranges = new Map();
  /** What hears of ranges that come. @type {Set<(start: number, end: number) => void>} */
  #heard = new Set();

  constructor(isShared) {
    this.#isShared = isShared;
  }

  get isOpen() {
    return this.#isShared();
  }

  join(hear) {
    this.#heard.add(hear);
    return () => this.#heard.delete(hear);
  }

  async open(_name) {
    return [...this.#ranges.keys()].flatMap((key) => key.split("-").map(Number));
  }

  async get(start, end) {
    return this.#ranges.get(`${start}-${end}`);
  }

  async put(start, end, bytes) {
    this.#ranges.set(`${start}-${end}`, bytes);
    for (const hear of this.#heard) hear(start, end);
    return false;
  }

  clear() {
    this.#ranges.clear();
  }
}

/**
 * Answers requests for ranges of `blob` as a server would, by slices of it.
 *
 * @returns {typeof fetch}
 */
function sliceOf(blob) {
  return async (_, { headers }) => {
    const [, first, last] = /^bytes=(\d+)-(\d*)$/.exec(headers.get("range"));
    const start = Number(first);
    const end = last === "" ? blob.size : Math.min(Number(last) + 1, blob.size);
    if (start >= end) return new Response(null, { status: 416, headers: { "content-range": `bytes */${blob.size}` } });
    const range = { "content-range": `bytes ${start}-${end - 1}/${blob.size}`, "content-length": String(end - start), etag: '"blob"' };
    return new Response(blob.slice(start, end), { status: 206, headers: range });
  };
}

/** Ranges of one version of one file in Cache Storage. Nothing depends on it: whatever fails is as if it were empty. */
class Cached {
  #cache;
  #base;
  /** Addresses of what is kept. */
  #keys = new Set();

  constructor(url, version) {
    this.#base = new URL(url);
    this.#base.hash = "";
    this.#base.searchParams.set("tetralod-version", version);
  }

  get isOpen() {
    return this.#cache !== undefined;
  }

  /** Finds what is kept: start and end of each range. Those of other versions are of no more use. */
  async open(name) {
    const found = [];
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
        found.push(...key.searchParams.get("tetralod-range").split("-").map(Number));
      }
      this.#cache = cache;
    } catch {
      // As if it were empty.
    }
    return found;
  }

  #key(start, end) {
    const key = new URL(this.#base);
    key.searchParams.set("tetralod-range", `${start}-${end}`);
    return key.href;
  }

  async get(start, end) {
    const key = this.#key(start, end);
    try {
      const response = await this.#cache.match(key);
      const bytes = response && new Uint8Array(await response.arrayBuffer());
      if (bytes?.length === Number(response?.headers.get("content-length"))) return bytes;
    } catch {
      // As if it were empty.
    }
    this.#keys.delete(key);
    return undefined;
  }

  /** Whether the range is kept now. */
  async put(start, end, bytes) {
    const key = this.#key(start, end);
    const response = new Response(bytes, { headers: { "content-length": String(bytes.length) } });
    try {
      await this.#cache.put(key, response);
    } catch {
      return false;
    }
    this.#keys.add(key);
    return true;
  }

  clear() {
    for (const key of this.#keys) this.#cache.delete(key).catch(() => {});
    this.#keys.clear();
  }
}
