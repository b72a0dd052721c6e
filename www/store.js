/** One value for everything that can change, and those who are told. */

/**
 * Values by name. Whoever shows or uses some of them subscribes; whoever changes one does it here, so that all see the same.
 *
 * @template {object} T
 */
export class Store {
  #state;
  #settle;
  /** @type {{ names: readonly (keyof T)[] | undefined, then: () => void }[]} */
  #subscribers = [];
  /** Subscribers that are still to be told, each once, in the order of their names here. @type {Set<() => void>} */
  #due = new Set();
  #isTelling = false;

  /**
   * @param {T} first
   * @param {(state: T) => T} settle makes values fit each other: no others are ever seen
   */
  constructor(first, settle = (state) => state) {
    this.#state = first;
    this.#settle = settle;
  }

  /** @returns {Readonly<T>} */
  get state() {
    return this.#state;
  }

  /** Changes some values. Those who use one that is another now are told when all of them are. @param {Partial<T>} values */
  change(values) {
    const before = this.#state;
    this.#state = this.#settle({ ...before, ...values });
    this.#tell((name) => before[name] !== this.#state[name]);
  }

  /** As `change`, but all are told: what the values are of is another, too. @param {Partial<T>} values */
  replace(values) {
    this.#state = this.#settle({ ...this.#state, ...values });
    this.#tell(() => true);
  }

  /**
   * Calls `then` when one of some values has changed, or any without names.
   *
   * @param {readonly (keyof T)[] | undefined} names
   * @param {() => void} then
   */
  subscribe(names, then) {
    this.#subscribers.push({ names, then });
  }

  /** @param {(name: keyof T) => boolean} isOther */
  #tell(isOther) {
    const changed = /** @type {(keyof T)[]} */ (Object.keys(this.#state)).filter(isOther);
    if (changed.length === 0) return;
    for (const { names, then } of this.#subscribers) if (!names || names.some((name) => changed.includes(name))) this.#due.add(then);
    // One that is told may change more: whoever that concerns is told after those who wait already.
    if (this.#isTelling) return;
    this.#isTelling = true;
    try {
      for (const then of this.#due) {
        this.#due.delete(then);
        then();
      }
    } finally {
      this.#isTelling = false;
    }
  }
}
