/**
 * A file on a server of which only those blocks come that are needed: a session in wasm says which bytes it wants, `Ranges`
 * fetches them. Runs where the session is, so that no bytes cross between threads.
 */

import { TetralodError, reviveError } from "./errors.js";
import { deferred } from "./latest.js";
import { Ranges } from "./ranges.js";

/** What a session in parts has: `CoreSession` and `Viewer` of the wasm modules.
 *
 * @typedef {object} PartsSession
 * @property {() => Float64Array} wanted
 * @property {(start: number, bytes: Uint8Array) => import("./index.js").Progress} take
 * @property {() => import("./index.js").BlockProgress} blocks
 */

/** Keeps a session supplied with what it wants. */
export class Parts {
  #session;
  #ranges;
  #url;
  #onChange;
  #begun = deferred();
  /** Those who wait until nothing is wanted, and those who wait for anything to come. */
  #settled = [];
  #arrived = [];
  #failure;
  #closed = false;
  #due = false;
  /** Bytes taken in, and how often that was. */
  #bytes = 0;
  #count = 0;
  #seen = 0;
  /** The first bytes of the file: more than what stands in front of the blocks, where files are small. */
  #first;
  #progress;

  /**
   * @param {typeof import("./tetralod_core.js").RangeLoader} RangeLoader of the session's wasm module
   * @param {PartsSession} session
   * @param {string} url
   * @param {import("./ranges.js").RangesOptions} options
   * @param {(progress: object) => void} onChange hears of everything that comes
   * @param {(error: Error) => void} [onError] hears of what ends the fetching until `retry`
   */
  constructor(RangeLoader, session, url, options, onChange, onError = () => {}) {
    this.#session = session;
    this.#url = url;
    this.#onChange = onChange;
    const sink = {
      onServer: (servesRanges) => servesRanges || this.#turnAway(),
      onRange: (start, end, bytes) => this.#take(start, bytes),
      onError: (error) => {
        this.#fail(error);
        onError(error);
      },
    };
    this.#ranges = new Ranges(RangeLoader, url, sink, options);
  }

  /**
   * Reads what stands in front of the blocks. Resolves to true when the base mesh is there; to false if the server gives
   * no ranges: then nothing has been taken, and this is of no more use.
   */
  begin() {
    this.follow();
    return this.#begun.promise;
  }

  /** Asks for what the session wants now, and for nothing else any more. */
  follow() {
    if (this.#closed || this.#failure) return;
    let wanted = this.#session.wanted();
    // What has come already with the first bytes is taken from there, and may make the session want other things.
    while (this.#takeFirst(wanted)) {
      if (this.#failure) return;
      this.#onChange(this.progress);
      wanted = this.#session.wanted();
    }
    this.#ranges.want(wanted);
    if (wanted.length > 0) return;
    for (const { resolve } of this.#settled.splice(0)) resolve();
    this.#wake();
  }

  /** Takes what `wanted` has of the first bytes; whether there was any. */
  #takeFirst(wanted) {
    if (!this.#first) return false;
    let any = false;
    for (let at = 0; at < wanted.length && !this.#failure; at += 3) {
      const [start, end] = [wanted[at], wanted[at + 1]];
      if (end > this.#first.length) continue;
      this.#give(start, this.#first.subarray(start, end));
      any = true;
    }
    return any;
  }

  /** Without ranges each look at the file would be one at all of it. */
  #turnAway() {
    this.close();
    this.#begun.resolve(false);
  }

  #take(start, bytes) {
    if (this.#closed || this.#failure) return;
    if (start === 0) this.#first = bytes;
    this.#bytes += bytes.length;
    this.#give(start, bytes);
    if (!this.#failure) this.#soon();
  }

  #give(start, bytes) {
    try {
      this.#progress = this.#session.take(start, bytes);
      this.#count++;
    } catch (error) {
      const known = reviveError(error);
      this.#ranges.forget();
      this.#ranges.want([]);
      this.#fail(new TetralodError(known.code, `${this.#url}: ${known.message}`, { cause: error }));
    }
  }

  /** Looks once at what is wanted after all that comes at a time. */
  #soon() {
    if (this.#due) return;
    this.#due = true;
    queueMicrotask(() => {
      this.#due = false;
      if (this.#closed || this.#failure) return;
      this.follow();
      this.#onChange(this.progress);
      if (this.#progress?.ready) this.#begun.resolve(true);
      this.#wake();
    });
  }

  #wake() {
    for (const { resolve } of this.#arrived.splice(0)) resolve();
  }

  #fail(error) {
    this.#failure = error;
    this.#begun.reject(error);
    for (const { reject } of [...this.#settled.splice(0), ...this.#arrived.splice(0)]) reject(error);
  }

  /** What is known of the file as a whole. */
  get progress() {
    const { ready = false, complete = false, updates = 0 } = this.#progress ?? {};
    const total = this.#ranges.total ?? this.#progress?.total;
    const blocks = this.#session.blocks();
    // Half-edge and edge-based MTs come in blocks.
    return { ready, complete, bytes: this.#bytes, total, updates, blocks: blocks.all > 0 ? blocks : undefined };
  }

  /** Whether there is more to come. */
  get isWaiting() {
    return this.#session.wanted().length > 0;
  }

  /** Whether anything has come since `look`. */
  get hasNews() {
    return this.#count !== this.#seen;
  }

  /** Resolves when all that is wanted has come, rejects when it cannot. */
  settled() {
    return this.#wait(this.#settled, this.#failure || this.isWaiting);
  }

  /** Resolves when anything has come since `look`, or another mesh is wanted. */
  arrived() {
    return this.#wait(this.#arrived, this.#failure || !this.hasNews);
  }

  /** The mesh is made of what is here now. */
  look() {
    this.#seen = this.#count;
  }

  /** Another mesh is wanted: those who wait for the one before look again. */
  turn() {
    this.follow();
    this.#wake();
  }

  #wait(list, isNeeded) {
    if (!isNeeded) return Promise.resolve();
    if (this.#failure) return Promise.reject(this.#failure);
    const waiting = deferred();
    list.push(waiting);
    return waiting.promise;
  }

  /** Goes on after an error. Blocks of another version of the file would not fit those that are here: that is no use. */
  retry() {
    if (this.#closed || !this.#failure) return;
    if (this.#failure.code === "changed") throw this.#failure;
    this.#failure = undefined;
    this.#ranges.retry();
    this.follow();
  }

  close(reason) {
    if (this.#closed) return;
    this.#closed = true;
    this.#ranges.close();
    if (reason) this.#fail(reason);
  }
}
