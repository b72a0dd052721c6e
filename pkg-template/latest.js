/**
 * Calls that replace each other, so that a worker is never behind by more than one: what keeps a viewer responsive while
 * sliders and pointers move faster than meshes can follow.
 */

/** Calls of which one is running and one waits; later ones are merged into the waiting one. */
export class Latest {
  #run;
  #merge;
  #busy = false;
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

  #next() {
    if (this.#busy || !this.#waiting) return;
    const { value, resolve, reject } = this.#waiting;
    this.#waiting = null;
    this.#busy = true;
    this.#run(value)
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

/** Two sets of changes as one: movements add up, of everything else the later one counts. */
export function mergeUpdates(a, b) {
  const merged = { ...a, ...b };
  // Going home forgets the movements before it.
  if (b.home) {
    for (const name of ["orbit", "pan", "zoom"]) if (b[name] === undefined) delete merged[name];
    return merged;
  }
  for (const name of ["orbit", "pan"]) {
    if (a[name] && b[name]) merged[name] = [a[name][0] + b[name][0], a[name][1] + b[name][1]];
  }
  if (a.zoom !== undefined && b.zoom !== undefined) merged.zoom = a.zoom * b.zoom;
  return merged;
}
