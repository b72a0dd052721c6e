/**
 * A file on a server of which only the needed blocks are fetched: the session in wasm takes blocks from the loader and
 * tells it which ones it needs; this module fetches bytes with `Ranges` and settles the promises of callers. It runs in
 * the session's thread, so that no bytes cross between threads.
 */

import { TetralodError, reviveError } from "./errors.js";
import { deferred } from "./latest.js";
import { Ranges } from "./ranges.js";

/** What a session in parts has: `CoreSession` and `Viewer` of the wasm modules.
 *
 * @typedef {object} PartsSession
 * @property {() => boolean} supply
 * @property {boolean} isWaiting
 * @property {() => import("./index.js").Progress} progress
 * @property {() => import("./index.js").BlockProgress} blocks
 */

/** Fetches the blocks that a session needs. */
export class Parts {
  #session;
  #ranges;
  /** What to call the file in messages. */
  #name;
  #onChange;
  #begun = deferred();
  /** Callers that wait until nothing is needed any more, and those that wait for any data. */
  #settled = [];
  #arrived = [];
  #failure;
  #closed = false;
  #due = false;
  /** Whether data has arrived since `look`. */
  #hasNews = false;

  /**
   * @param {typeof import("./tetralod_core.js").RangeLoader} RangeLoader of the session's wasm module
   * @param {(loader: object) => PartsSession} makeSession makes the session that the loader serves
   * @param {string} url
   * @param {import("./ranges.js").RangesOptions} options
   * @param {(progress: object) => void} onChange is called for all data that arrives
   * @param {(error: Error) => void} [onError] hears of what ends the fetching until `retry`
   */
  constructor(RangeLoader, makeSession, url, options, onChange, onError = () => {}) {
    this.#name = options.name ?? url;
    this.#onChange = onChange;
    const sink = {
      // Without ranges each look at the file would be one at all of it.
      onServer: (servesRanges) => servesRanges || this.#turnAway(),
      onComplete: () => this.#supply() && this.#soon(),
      onError: (error) => {
        this.#fail(error);
        onError(error);
      },
    };
    this.#ranges = new Ranges(RangeLoader, url, sink, options);
    this.#session = makeSession(this.#ranges.loader);
  }

  /**
   * Reads the file up to the first block. Resolves to true when the base mesh has arrived; to false if the server gives
   * no ranges: then nothing has been taken, and this is of no more use.
   */
  begin() {
    this.follow();
    return this.#begun.promise;
  }

  /** Requests the blocks that the session needs now, and cancels other requests. */
  follow() {
    if (this.#closed || this.#failure) return;
    this.#supply();
    this.#ranges.go();
    if (this.#failure || this.isWaiting) return;
    for (const { resolve } of this.#settled.splice(0)) resolve();
    this.#wake();
  }

  #turnAway() {
    this.close();
    this.#begun.resolve(false);
  }

  /** Passes arrived data to the session; returns whether it was accepted. */
  #supply() {
    if (this.#closed || this.#failure) return false;
    try {
      this.#hasNews = this.#session.supply() || this.#hasNews;
      return true;
    } catch (error) {
      const known = reviveError(error);
      this.#ranges.forget();
      this.#fail(new TetralodError(known.code, `${this.#name}: ${known.message}`, { cause: error }));
      return false;
    }
  }

  /** Asks the session once for its needs after all data of one turn. */
  #soon() {
    if (this.#due) return;
    this.#due = true;
    queueMicrotask(() => {
      this.#due = false;
      if (this.#closed || this.#failure) return;
      this.follow();
      const { progress } = this;
      this.#onChange(progress);
      if (progress.ready) this.#begun.resolve(true);
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
    const blocks = this.#session.blocks();
    // Half-edge and edge-based MTs are fetched in blocks.
    return { ...this.#session.progress(), blocks: blocks.all > 0 ? blocks : undefined };
  }

  /** Requests, bytes that have arrived, and bytes that were needed. */
  get traffic() {
    return this.#ranges.traffic;
  }

  /** Whether more data is to come. */
  get isWaiting() {
    return this.#session.isWaiting;
  }

  /** Whether more data is to come, or some has arrived since `look`. */
  get hasMore() {
    return this.isWaiting || this.#hasNews;
  }

  /** Resolves when all needed data has arrived, rejects when that fails. */
  settled() {
    return this.#wait(this.#settled, this.#failure || this.isWaiting);
  }

  /** Resolves when data has arrived since `look`, or another mesh is requested. */
  arrived() {
    return this.#wait(this.#arrived, this.#failure || !this.#hasNews);
  }

  /** The mesh is made of what is here now. */
  look() {
    this.#hasNews = false;
  }

  /** Another mesh is requested: wakes the callers that wait for the one before. */
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

  /** Continues after an error; not after `changed`, since blocks of different versions do not fit together. */
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
