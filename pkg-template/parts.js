/**
 * A file on a server of which only those blocks come that are needed: the session in wasm takes what the loader has and tells it
 * what is wanted; this moves bytes with `Ranges`, and keeps the promises of those who wait. Runs where the session is, so that no
 * bytes cross between threads.
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
  /** Whether anything has come since `look`. */
  #hasNews = false;

  /**
   * @param {typeof import("./tetralod_core.js").RangeLoader} RangeLoader of the session's wasm module
   * @param {(loader: object) => PartsSession} makeSession makes the session that the loader serves
   * @param {string} url
   * @param {import("./ranges.js").RangesOptions} options
   * @param {(progress: object) => void} onChange hears of everything that comes
   * @param {(error: Error) => void} [onError] hears of what ends the fetching until `retry`
   */
  constructor(RangeLoader, makeSession, url, options, onChange, onError = () => {}) {
    this.#url = url;
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

  /** Hands the session what has come; whether it could take it. */
  #supply() {
    if (this.#closed || this.#failure) return false;
    try {
      this.#hasNews = this.#session.supply() || this.#hasNews;
      return true;
    } catch (error) {
      const known = reviveError(error);
      this.#ranges.forget();
      this.#fail(new TetralodError(known.code, `${this.#url}: ${known.message}`, { cause: error }));
      return false;
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
    // Half-edge and edge-based MTs come in blocks.
    return { ...this.#session.progress(), blocks: blocks.all > 0 ? blocks : undefined };
  }

  /** Whether there is more to come. */
  get isWaiting() {
    return this.#session.isWaiting;
  }

  /** Whether there is more to come, or something has come since `look`. */
  get hasMore() {
    return this.isWaiting || this.#hasNews;
  }

  /** Resolves when all that is wanted has come, rejects when it cannot. */
  settled() {
    return this.#wait(this.#settled, this.#failure || this.isWaiting);
  }

  /** Resolves when anything has come since `look`, or another mesh is wanted. */
  arrived() {
    return this.#wait(this.#arrived, this.#failure || !this.#hasNews);
  }

  /** The mesh is made of what is here now. */
  look() {
    this.#hasNews = false;
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
