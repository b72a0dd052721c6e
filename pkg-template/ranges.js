/**
 * Byte ranges of a file on a server: the loader in wasm decides what to fetch, this does it. Nothing here knows what the
 * bytes mean.
 */

import { TetralodError, reviveError } from "./errors.js";

/** The headers that the loader wants to see, in its order. */
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

/** A timer that comes so much later than it was set for has slept: that time does not count. */
const LATE = 100;

/**
 * @typedef {object} RangesOptions
 * @property {typeof fetch} [fetch] used in place of the global one, for instance to sign requests
 * @property {HeadersInit} [headers] go along with each request; other origins must allow them
 * @property {RequestCredentials} [credentials]
 * @property {string} [cache] name of a cache (Cache Storage) in which ranges are kept for the next time, where there is one
 * @property {number} [maxRequests] at a time; 6
 * @property {number} [gap] unwanted bytes that are rather fetched than asked around; 16384
 * @property {number} [maxRequestBytes] 4 MiB
 * @property {number} [retries] of the same bytes; 5
 * @property {number} [backoffMs] before the first of these; 500
 * @property {number} [timeoutMs] without a byte; 30000
 */

/**
 * @typedef {object} RangesSink
 * @property {(start: number, end: number, bytes: Uint8Array) => void} onRange takes a range that was wanted: once, with
 *   fewer bytes where it reaches beyond the end of the file. May call `want`.
 * @property {(servesRanges: boolean) => void} [onServer] hears once, before any range, whether the server gives ranges. May
 *   call `close`.
 * @property {(error: TetralodError) => void} onError nothing comes any more, until `retry` is called
 */

/** What is wanted of one file, and its requests. */
export class Ranges {
  #loader;
  #url;
  /** Where redirects led to. */
  #ledTo;
  #options;
  #sink;
  /** @type {Map<number, AbortController>} */
  #open = new Map();
  #timer;
  /** Time that has passed while this was awake, and when that was last looked at. */
  #clock = 0;
  #seen = performance.now();
  #due = Infinity;
  #kept;
  /** What has not come yet. */
  #wanted = [];
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
    const { maxRequests, gap, maxRequestBytes, retries, backoffMs, timeoutMs } = options;
    this.#loader = new RangeLoader(maxRequests, gap, maxRequestBytes, retries, backoffMs, timeoutMs, Math.random());
    this.#url = this.#ledTo = new URL(url, globalThis.location?.href).href;
    this.#options = options;
    this.#sink = sink;
  }

  /**
   * Says which ranges are wanted from now on, all of them; each comes out once.
   *
   * @param {ArrayLike<number>} triples start, end and priority of each; higher priorities come first
   */
  want(triples) {
    if (this.#closed) return;
    const wanted = [];
    for (let at = 0; at + 2 < triples.length; at += 3) wanted.push(Array.prototype.slice.call(triples, at, at + 3));
    this.#wanted = wanted;
    this.#ask();
  }

  /** Tries again after an error. */
  retry() {
    if (this.#closed) return;
    this.#loader.retry();
    this.#kept = undefined;
    this.#forgets = false;
    this.#failed = false;
    this.#ask();
  }

  /** What came is damaged: the cache may hold it, and is not used until `retry`. */
  forget() {
    this.#kept?.clear();
    this.#kept = undefined;
    this.#forgets = true;
  }

  /** The size of the file, once it is known. */
  get total() {
    return this.#closed ? undefined : this.#loader.total();
  }

  /** Whether the server gives ranges; where it does not, everything passes by from the start for whatever is wanted. */
  get servesRanges() {
    return this.#closed ? undefined : this.#loader.servesRanges();
  }

  /** What has been asked and has come: requests, bytes, and bytes that were wanted. */
  get traffic() {
    const [requests, received, used] = this.#closed ? [0, 0, 0] : this.#loader.traffic();
    return { requests, received, used };
  }

  /** Ends all requests. */
  close() {
    if (this.#closed) return;
    this.#closed = true;
    clearTimeout(this.#timer);
    for (const controller of this.#open.values()) controller.abort();
    this.#open.clear();
    this.#loader.free();
  }

  /** Takes from the cache what is kept there, and asks for the rest. */
  #ask() {
    const kept = (range) => this.#kept?.has(range) ?? false;
    this.#loader.want(Float64Array.from(this.#wanted.filter((range) => !kept(range)).flat()));
    for (const range of this.#wanted.filter(kept)) this.#takeKept(range);
    this.#go();
  }

  async #takeKept(range) {
    const bytes = await this.#kept.get(range);
    if (this.#closed) return;
    // Damaged, or removed by somebody else: then it is fetched like others.
    if (!bytes) this.#ask();
    else if (this.#noMore(range)) this.#sink.onRange(range[0], range[1], bytes);
  }

  /** Takes `range` off the list; whether it was on it. */
  #noMore([start, end]) {
    const before = this.#wanted.length;
    this.#wanted = this.#wanted.filter(([a, b]) => a !== start || b !== end);
    return this.#wanted.length < before;
  }

  #now() {
    const now = performance.now();
    const passed = now - this.#seen;
    this.#clock += Math.min(passed, Math.max(this.#due, 0) + LATE);
    this.#due -= passed;
    this.#seen = now;
    return this.#clock;
  }

  /** Hands out what is complete, and does what the loader says. */
  #go() {
    if (this.#closed) return;
    this.#learn();
    if (this.#closed) return;
    for (let range; (range = this.#loader.take()); ) {
      const { start, end, bytes } = range;
      const kept = this.#kept;
      // A copy at once: whoever takes the range may move it to another thread.
      const copy = kept && bytes.slice();
      if (this.#noMore([start, end])) this.#sink.onRange(start, end, bytes);
      if (this.#closed) return;
      if (kept === this.#kept) kept?.put([start, end], copy);
    }
    try {
      this.#obey();
    } catch (error) {
      if (this.#failed) return;
      this.#failed = true;
      const known = reviveError(error);
      this.#sink.onError(new TetralodError(known.code, `${this.#url}: ${known.message}`, { cause: error }));
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
        this.#timer = setTimeout(() => this.#go(), this.#due);
        return;
      }
      if (start !== undefined) {
        this.#fetch(id, start, end);
      } else {
        this.#open.get(id)?.abort();
        this.#open.delete(id);
      }
    }
  }

  /** What the first answer tells: whether there are ranges, and of which version of the file, which opens the cache. */
  #learn() {
    if (!this.#knowsServer && this.servesRanges !== undefined) {
      this.#knowsServer = true;
      this.#sink.onServer?.(this.servesRanges);
      if (this.#closed) return;
    }
    const { cache } = this.#options;
    if (this.#kept || this.#forgets || !cache || !globalThis.caches) return;
    const version = this.#loader.version();
    if (version === undefined) return;
    this.#kept = new Kept(cache, this.#url, version);
    this.#kept.opened.then(() => this.#closed || this.#ask());
  }

  /** One request from beginning to end. */
  async #fetch(id, start, end) {
    const controller = new AbortController();
    this.#open.set(id, controller);
    /** Tells the loader, unless it has cancelled the request. */
    const tell = (what) => {
      if (this.#closed || this.#open.get(id) !== controller) return false;
      what(this.#now());
      this.#go();
      return !this.#closed && this.#open.get(id) === controller;
    };
    const asked = this.#ledTo;
    try {
      const response = await this.#request(asked, start, end, controller.signal);
      if (GONE.includes(response.status) && asked !== this.#url) {
        // Addresses that redirects lead to may be good for a while only.
        if (this.#ledTo === asked) this.#ledTo = this.#url;
        throw new Error(`HTTP ${response.status} where a redirect led to`);
      }
      if (response.ok && response.url) this.#ledTo = response.url;
      const fields = FIELDS.map((name) => response.headers.get(name));
      if (tell((now) => this.#loader.head(id, now, response.status, fields))) {
        await this.#body(response, (bytes) => tell((now) => this.#loader.data(id, now, bytes)));
        tell((now) => this.#loader.end(id, now));
      }
    } catch (error) {
      const blocked = !controller.signal.aborted && (await this.#isBlocked(error, asked, controller.signal));
      const detail = String(error?.cause?.message || error?.cause?.code || error?.message || error);
      tell((now) => this.#loader.failed(id, now, blocked, detail));
    }
    if (this.#open.get(id) === controller) this.#open.delete(id);
    controller.abort();
  }

  #request(url, start, end, signal) {
    // Without an end where it is not known: such numbers are no integers any more.
    const last = Number.isSafeInteger(end) ? end - 1 : "";
    const headers = new Headers(this.#options.headers);
    headers.set("range", `bytes=${start}-${last}`);
    const call = this.#options.fetch ?? globalThis.fetch;
    // A browser's own cache serves ranges of one address one after the other, and may mix versions.
    return call(url, { signal, headers, credentials: this.#options.credentials, cache: "no-store" });
  }

  /** Reads until the end, or until nobody wants to know. */
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
   * Whether the browser, not the network, is in the way. It tells pages no difference; but without CORS, where nothing
   * can be read of the answer, it lets requests through to a server that is there.
   */
  async #isBlocked(error, url, signal) {
    const page = globalThis.location?.origin;
    if (!(error instanceof TypeError) || !page || page === "null" || new URL(url).origin === page) return false;
    if (this.#options.fetch) return false;
    const probe = fetch(url, { mode: "no-cors", method: "HEAD", cache: "no-store", signal });
    return probe.then(() => true, () => false);
  }
}

/** Ranges of one version of one file in Cache Storage. Nothing depends on it: whatever fails is as if it were empty. */
class Kept {
  #cache;
  #base;
  /** Addresses of what is kept. */
  #keys = new Set();
  #reading = new Map();
  /** Resolves when it is known what is kept. */
  opened;

  constructor(name, url, version) {
    this.#base = new URL(url);
    this.#base.hash = "";
    this.#base.searchParams.set("tetralod-version", version);
    this.opened = this.#look(name).catch(() => {});
  }

  /** Finds what is kept; ranges of other versions are of no more use. */
  async #look(name) {
    const cache = await caches.open(name);
    this.#cache = cache;
    const { origin, pathname, searchParams } = this.#base;
    for (const { url } of await cache.keys()) {
      const found = new URL(url);
      const version = found.searchParams.get("tetralod-version");
      if (!version || found.origin !== origin || found.pathname !== pathname) continue;
      if (version === searchParams.get("tetralod-version")) this.#keys.add(url);
      else await cache.delete(url);
    }
  }

  #key([start, end]) {
    const key = new URL(this.#base);
    key.searchParams.set("tetralod-range", `${start}-${end}`);
    return key.href;
  }

  has(range) {
    return this.#keys.size > 0 && this.#keys.has(this.#key(range));
  }

  /** The bytes of `range`; asked for again meanwhile, it is read once. */
  get(range) {
    const key = this.#key(range);
    let reading = this.#reading.get(key);
    if (!reading) {
      reading = this.#read(key).finally(() => this.#reading.delete(key));
      this.#reading.set(key, reading);
    }
    return reading;
  }

  async #read(key) {
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

  clear() {
    for (const key of this.#keys) this.#cache.delete(key).catch(() => {});
    this.#keys.clear();
  }

  put(range, bytes) {
    if (!this.#cache) return;
    const key = this.#key(range);
    const response = new Response(bytes, { headers: { "content-length": String(bytes.length) } });
    this.#cache.put(key, response).then(() => this.#keys.add(key)).catch(() => {});
  }
}
