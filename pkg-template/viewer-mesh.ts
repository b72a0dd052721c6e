/** The mesh of a viewer: what is asked of it, and how it gets there in steps. */

import { flattenError } from "./errors.js";
import type { RefineOptions, Unchecked } from "./options.js";
import type { Parts } from "./parts.js";
import type { OnEvent } from "./rpc.js";
import type { Viewer } from "./tetralod_viewer.js";
import { limitOf } from "./tools.js";

/** While a file arrives, the mesh follows it this often (in ms), and at most half of the time is spent on that. */
const FOLLOW = 120;

/** What a mesh is without a request: what the picture shows, within a budget that any machine can draw. */
const FIRST: Unchecked = { view: { pixels: 1, outside: "10%" }, maxTets: 500_000 };

/** The work for a request: sums over its steps. */
const NO_WORK = { refined: 0, coarsened: 0, forced: 0, judged: 0, milliseconds: 0 };

export class MeshWork {
  #viewer: Viewer;
  #emit: OnEvent;
  /** Called when there is more to do or to draw. */
  #changed: () => void;
  /** Fetches the blocks of a file that is read in parts. */
  parts: Parts | undefined;
  /** Bytes of the file that have been decoded, and whether its base mesh is there. */
  bytes = 0;
  ready = false;
  /** The last request, and whether the viewer has it: it takes none before the base mesh has arrived. */
  #request = FIRST;
  #isRequested = false;
  /** The request before it, which holds again if it is given up. */
  #before = FIRST;
  /** Counts the requests; steps carry the number of their request. */
  goal = 0;
  #total = { ...NO_WORK };
  /** When the last refinement ended, and how long it took. */
  #last = { end: -Infinity, took: 0 };
  /** The timer of the next refinement with new data. */
  #following: ReturnType<typeof setTimeout> | undefined;
  /** Tetrahedra of the mesh, and the number that it is held to now. */
  tets = 0;
  held: number | undefined;

  constructor(viewer: Viewer, emit: OnEvent, changed: () => void) {
    [this.#viewer, this.#emit, this.#changed] = [viewer, emit, changed];
  }

  /** Another volume has taken the place of the one before; `request` is the first for it. */
  forget(request = FIRST) {
    [this.#request, this.#before, this.#isRequested] = [request, FIRST, false];
    [this.bytes, this.ready, this.held] = [0, false, undefined];
    this.#last = { end: -Infinity, took: 0 };
  }

  /** Whether there is something to do. */
  get isMoving(): boolean {
    return this.ready && this.#viewer.moving;
  }

  /** Whether it is not the one that was asked for yet, or is held to fewer tetrahedra. */
  get isBehind(): boolean {
    return this.#following !== undefined || this.#viewer.moving || this.held !== undefined;
  }

  /** Passes a request to the viewer; throws if it is not valid, and the one before it holds. */
  request(next: Unchecked) {
    this.#viewer.request(next as RefineOptions);
    [this.#before, this.#request] = [this.#request, next];
    this.parts?.turn();
    this.#isRequested = true;
    this.goal++;
    this.#total = { ...NO_WORK };
    this.#changed();
  }

  /** Makes the first request, unless there is one. */
  begin() {
    if (this.ready && !this.#isRequested) this.follow();
  }

  /** Gives a request up, if it is the last one: the one before it holds again. */
  abandon(given: number) {
    if (given === this.goal && this.ready) this.request(this.#before);
  }

  /** Applies the last request to new data; an error of the request is reported, not thrown. */
  follow() {
    try {
      if (!this.#isRequested) this.request(this.#request);
      this.#viewer.requestAgain();
      this.#changed();
    } catch (error) {
      this.#emit("error", flattenError(error));
    }
  }

  /** More of a stream has come. */
  came() {
    if (this.#pause() <= 0) this.follow();
  }

  /** Blocks have arrived: refines with them, as with a stream. */
  blocksCame() {
    if (!this.ready || !this.#isRequested) return;
    this.#following ??= setTimeout(() => {
      this.#following = undefined;
      if (!this.parts || !this.ready || !this.#isRequested) return;
      this.#viewer.requestAgain();
      this.#changed();
    }, Math.max(this.#pause(), 0));
  }

  /** How long the mesh stays as it is while data arrives. */
  #pause(): number {
    return Math.max(FOLLOW, 2 * this.#last.took) - (performance.now() - this.#last.end);
  }

  /** Refines for about so many milliseconds, and reports the result. */
  step(budget: number) {
    const start = performance.now();
    try {
      const made = this.#viewer.step(budget);
      const end = performance.now();
      // A view that follows the camera may need other blocks.
      this.parts?.follow();
      const stats = { ...made, milliseconds: end - start };
      const total = this.#total;
      for (const name of Object.keys(total) as (keyof typeof total)[]) total[name] += stats[name];
      this.tets = stats.tetrahedra;
      // A mesh that is held to fewer tetrahedra while something moves is not the one that was asked for.
      const done = stats.done && this.held === undefined;
      if (done) this.#last = { end, took: total.milliseconds };
      const { blocks } = this.parts?.progress ?? {};
      const limitedBy = limitOf({ ...stats, done }, blocks, this.#request);
      this.#emit("stats", { ...stats, ...total, done, bytes: this.bytes, goal: this.goal, blocks, limitedBy });
      if (done) this.#total = { ...NO_WORK };
    } catch (error) {
      this.#emit("failed", { goal: this.goal, error: flattenError(error) });
    }
  }

  /** Steps until nothing is left to do: for the first picture. */
  stepAll() {
    while (this.#viewer.moving) this.step(Infinity);
  }

  /** Holds the mesh to so many tetrahedra, or lets it become what was asked for. */
  hold(most: number | undefined) {
    if (!this.ready || !this.#isRequested || most === this.held) return;
    this.held = most;
    this.#viewer.limit(most);
    this.parts?.follow();
  }
}
