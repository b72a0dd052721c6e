/**
 * Calls that replace each other, so that a worker is never behind by more than one: what keeps a viewer responsive while
 * sliders and pointers move faster than meshes can follow.
 */

/** Calls of which one is running and one waits; later ones are merged into the waiting one. */
export class Latest {
  #run;
  #merge;
  #busy = false;
  /** Resolves when the call that is under way has ended. */
  #running;
  #waiting = null;

  constructor(run, merge = (_, next) => next) {
    this.#run = run;
    this.#merge = merge;
  }

  call(value) {
    if (this.#waiting) {
      this.#waiting.value = this.#merge(this.#waiting.value, value);
    } else {
      this.#waiting = { value, ...deferred() };
    }
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
    this.#waiting = null;
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
export function deferred() {
  let resolve, reject;
  const promise = new Promise((yes, no) => ([resolve, reject] = [yes, no]));
  return { promise, resolve, reject };
}

/** What adds up. */
const MOVEMENTS = ["orbit", "pan", "fly", "look"];

/** Two sets of changes as one: movements add up, of everything else the later one counts. */
export function mergeUpdates(a, b) {
  const merged = { ...a, ...b };
  const isHome = Boolean(b.home || b.side);
  const earlier = isHome ? a.sets?.map(({ camera, ...set }) => set) : a.sets;
  if (a.sets || b.sets) merged.sets = [...(earlier ?? []), ...(b.sets ?? [])];
  // A camera that is set forgets the movements before it.
  if (isHome || b.sets?.some(({ camera }) => camera)) {
    for (const name of [...MOVEMENTS, "zoom"]) if (b[name] === undefined) delete merged[name];
    return merged;
  }
  for (const name of MOVEMENTS) {
    if (a[name] && b[name]) merged[name] = a[name].map((amount, i) => amount + b[name][i]);
  }
  // Both ends of a zoom are near each other: the later point stands for both.
  if (a.zoom && b.zoom) merged.zoom = [a.zoom[0] * b.zoom[0], b.zoom[1], b.zoom[2]];
  return merged;
}
