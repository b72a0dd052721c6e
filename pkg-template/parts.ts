/**
 * A file on a server of which only the needed blocks are fetched: the session in wasm takes blocks from the loader and
 * tells it which ones it needs; this module fetches bytes with `Ranges` and settles the promises of callers. It runs in
 * the session's thread, so that no bytes cross between threads.
 */

import { type TetralodError, ofFile, reviveError } from "./errors.js";
import { type Deferred, deferred } from "./latest.js";
import { type Loader, Ranges, type RangesOptions } from "./ranges.js";
import type { BlockProgress, Progress } from "./results.js";
import type { RangeLoader } from "./tetralod_core.js";

/** What a session in parts has: `CoreSession` and `Viewer` of the wasm modules. */
export interface PartsSession {
  supply(): boolean;
  readonly isWaiting: boolean;
  progress(): Progress;
  blocks(): BlockProgress;
}

/** Fetches the blocks that a session needs. */
export class Parts {
  #session: PartsSession;
  #ranges: Ranges;
  /** What to call the file in messages. */
  #name: string;
  #onChange: (progress: Progress) => void;
  #begun = deferred<boolean>();
  /** Callers that wait until nothing is needed any more, and those that wait for any data. */
  #settled: Deferred<void>[] = [];
  #arrived: Deferred<void>[] = [];
  #failure: TetralodError | undefined;
  #closed = false;
  #due = false;
  /** Whether data has arrived since `look`. */
  #hasNews = false;

  /**
   * @param RangeLoader that of the session's wasm module
   * @param makeSession makes the session that the loader serves
   * @param onChange is called for all data that arrives
   * @param onError hears of what ends the fetching until `retry`
   */
  constructor(
    RangeLoader: Loader,
    makeSession: (loader: RangeLoader) => PartsSession,
    url: string,
    options: RangesOptions,
    onChange: (progress: Progress) => void,
    onError: (error: TetralodError) => void = () => {},
  ) {
    this.#name = options.name ?? url;
    this.#onChange = onChange;
    const sink = {
      // Without ranges each look at the file would be one at all of it.
      onServer: (servesRanges: boolean) => {
        if (!servesRanges) this.#turnAway();
      },
      onComplete: () => {
        if (this.#supply()) this.#soon();
      },
      onError: (error: TetralodError) => {
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
  begin(): Promise<boolean> {
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
  #supply(): boolean {
    if (this.#closed || this.#failure) return false;
    try {
      this.#hasNews = this.#session.supply() || this.#hasNews;
      return true;
    } catch (error) {
      this.#ranges.forget();
      this.#fail(ofFile(this.#name, reviveError(error)));
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

  #fail(error: TetralodError) {
    this.#failure = error;
    this.#begun.reject(error);
    for (const { reject } of [...this.#settled.splice(0), ...this.#arrived.splice(0)]) reject(error);
  }

  /** What is known of the file as a whole. */
  get progress(): Progress {
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
  settled(): Promise<void> {
    return this.#wait(this.#settled, this.isWaiting);
  }

  /** Resolves when data has arrived since `look`, or another mesh is requested. */
  arrived(): Promise<void> {
    return this.#wait(this.#arrived, !this.#hasNews);
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

  #wait(list: Deferred<void>[], isNeeded: boolean): Promise<void> {
    if (this.#failure) return Promise.reject(this.#failure);
    if (!isNeeded) return Promise.resolve();
    const waiting = deferred<void>();
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

  close(reason?: TetralodError) {
    if (this.#closed) return;
    this.#closed = true;
    this.#ranges.close();
    if (reason) this.#fail(reason);
  }
}
