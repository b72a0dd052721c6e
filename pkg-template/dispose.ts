/** What `using` calls at the end of a block. */

/** The name of that method, also where a language without one looks for it. */
export const DISPOSE: typeof Symbol.dispose = Symbol.dispose ?? Symbol.for("Symbol.dispose");
