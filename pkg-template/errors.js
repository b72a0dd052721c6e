/** The one error class of the package, and how errors cross a worker boundary. */

/** An error with a `code` that a program can act on; the codes are listed in `index.d.ts`. */
export class TetralodError extends Error {
  /**
   * @param {string} code
   * @param {string} message
   * @param {ErrorOptions} [options]
   */
  constructor(code, message, options) {
    super(message, options);
    this.name = "TetralodError";
    this.code = code;
  }
}

/** What `postMessage` can carry of an error. */
export function flattenError(error) {
  if (error instanceof Error) {
    const { name, message, code } = /** @type {Error & { code?: string }} */ (error);
    return { name, message, code };
  }
  return { name: "Error", message: String(error), code: undefined };
}

/**
 * The error that a user sees for `error`, which came from wasm or out of a worker.
 *
 * An error without a `code` of ours is a trap in wasm or a bug in the package: `internal`.
 */
export function reviveError(error) {
  if (error instanceof TetralodError || error?.name === "AbortError") return error;
  const code = typeof error?.code === "string" ? error.code : "internal";
  return new TetralodError(code, error?.message ?? String(error), { cause: error });
}
