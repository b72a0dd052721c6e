/**
 * Calls that replace each other, so that a worker is never behind by more than one: what keeps a viewer responsive while
 * sliders and pointers move faster than meshes can follow.
 */

import type { CameraState } from "./scene.js";

/** Calls of which one is running and one waits; later ones are merged into the waiting one. */
export class Latest<V, R> {
  #run: (value: V) => Promise<R>;
  #merge: (waiting: V, next: V) => V;
  #busy = false;
  /** Resolves when the call that is under way has ended. */
  #running: Promise<void> | undefined;
  #waiting: (Deferred<R> & { value: V }) | undefined;

  constructor(run: (value: V) => Promise<R>, merge: (waiting: V, next: V) => V = (_, next) => next) {
    this.#run = run;
    this.#merge = merge;
  }

  call(value: V): Promise<R> {
    if (this.#waiting) this.#waiting.value = this.#merge(this.#waiting.value, value);
    else this.#waiting = { value, ...deferred<R>() };
    const { promise } = this.#waiting;
    this.#next();
    return promise;
  }

  /** Resolves when none is running and none waits. */
  async idle() {
    while (this.#busy) await this.#running;
  }

  #next() {
    if (this.#busy || !this.#waiting) return;
    const { value, resolve, reject } = this.#waiting;
    this.#waiting = undefined;
    this.#busy = true;
    this.#running = this.#run(value)
      .then(resolve, reject)
      .finally(() => {
        this.#busy = false;
        this.#next();
      });
  }
}

/** A promise and what settles it. */
export interface Deferred<T> {
  promise: Promise<T>;
  resolve: (value: T) => void;
  reject: (reason: unknown) => void;
}

export function deferred<T>(): Deferred<T> {
  let resolve!: (value: T) => void;
  let reject!: (reason: unknown) => void;
  const promise = new Promise<T>((yes, no) => ([resolve, reject] = [yes, no]));
  return { promise, resolve, reject };
}

/** What is set of a scene, with the number of the call. */
export interface SceneChange {
  id: number;
  changes: Record<string, unknown>;
  camera?: CameraState | null;
}

/** What has been set of a viewer. */
export interface Update {
  sets?: SceneChange[];
  orbit?: [right: number, up: number];
  zoom?: [factor: number, x: number, y: number];
  pan?: [right: number, up: number];
  fly?: [right: number, up: number, ahead: number];
  look?: [right: number, up: number];
  home?: boolean;
  side?: string;
  size?: [width: number, height: number, ratio: number];
}

/** What adds up. */
const MOVEMENTS = ["orbit", "pan", "fly", "look"] as const;

/** Two sets of changes as one: movements add up, of everything else the later one counts. */
export function mergeUpdates(a: Update, b: Update): Update {
  const merged: Update = { ...a, ...b };
  const isHome = Boolean(b.home || b.side);
  const earlier = isHome ? a.sets?.map(({ camera, ...set }) => set) : a.sets;
  if (a.sets || b.sets) merged.sets = [...(earlier ?? []), ...(b.sets ?? [])];
  // A camera that is set forgets the movements before it.
  if (isHome || b.sets?.some(({ camera }) => camera)) {
    for (const name of [...MOVEMENTS, "zoom"] as const) if (b[name] === undefined) delete merged[name];
    return merged;
  }
  const movements: { [name in (typeof MOVEMENTS)[number]]?: number[] } = merged;
  for (const name of MOVEMENTS) {
    const [before, next]: (number[] | undefined)[] = [a[name], b[name]];
    if (before && next) movements[name] = before.map((amount, i) => amount + next[i]);
  }
  // Both ends of a zoom are near each other: the later point stands for both.
  if (a.zoom && b.zoom) merged.zoom = [a.zoom[0] * b.zoom[0], b.zoom[1], b.zoom[2]];
  return merged;
}
