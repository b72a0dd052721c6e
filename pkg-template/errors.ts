/** The one error class of the package, and how errors cross a worker boundary. */

/** The codes of errors, for programs. */
export type ErrorCode =
  /** The source is not of a kind that can be read, or has been read already. */
  | "bad-source"
  /** The server could not be reached, answered with an error, or broke off. */
  | "network"
  /** The server does not let pages of this origin read the file; the message says what it must send. */
  | "cors"
  /** The server sends something else than the bytes of the file; the message says what to change there. */
  | "server"
  /** The file on the server was replaced while it was being read. */
  | "changed"
  /** The bytes are not an MT file at all. */
  | "not-mt"
  /** The file was made by a later version. */
  | "unsupported-version"
  /** The file contradicts itself or its checksums. */
  | "corrupt"
  /** The file ended too early. */
  | "truncated"
  /** The file needs more memory than is allowed. */
  | "limit"
  /** An option or argument is unknown or has an impossible value; the message names it. */
  | "bad-option"
  /** Another mesh, or in the viewer another volume, was requested before all data for this one had arrived. */
  | "replaced"
  /** The base mesh has not arrived yet. */
  | "not-ready"
  /** The object has been freed. */
  | "freed"
  /**
   * The worker did not start or does not answer: its file is not where the page looks for it, is not JavaScript or of another
   * version, or a Content-Security-Policy forbids it. The message says what to change.
   */
  | "worker"
  /** The wasm module could not be loaded or compiled; the message says what to change. */
  | "wasm"
  /** The browser has neither WebGPU nor WebGL 2, or gives no GPU for them (viewer only). */
  | "no-webgpu"
  /** A volume cannot be drawn, since the browser has no WebGPU; all else is drawn with WebGL 2 (viewer only). */
  | "needs-webgpu"
  /** The GPU was reset or removed, and could not be opened again; make a new viewer (viewer only). */
  | "device-lost"
  /** The mesh is larger than this GPU can hold (viewer only). */
  | "too-large"
  /** The GPU refused a command; a mistake in this package, please report it (viewer only). */
  | "gpu"
  /** The file is of no format that can be built from (`tetralod/build` only). */
  | "unknown-format"
  /** The file has cells, or is of a type, that cannot be read here; the message says what to do (`tetralod/build` only). */
  | "unsupported"
  /** The mesh cannot be built: the message says which cell or point, and why (`tetralod/build` only). */
  | "bad-mesh"
  /** The files, or the work, need more memory than a wasm module can have (`tetralod/build` only). */
  | "memory"
  /** A mistake in this package, also in a worker that had started: please report it. */
  | "internal";

/** The errors of this package. Aborts are not among them: they reject with the signal's own reason. */
export class TetralodError extends Error {
  readonly code: ErrorCode;

  constructor(code: ErrorCode, message: string, options?: { cause?: unknown }) {
    super(message, options);
    this.name = "TetralodError";
    this.code = code;
  }
}

/** An error as `postMessage` can carry it. */
export interface FlatError {
  name: string;
  message: string;
  code: string | undefined;
}

/** What may be known of something that was thrown. */
export const known = (error: unknown) => (error ?? {}) as { name?: string; message?: string; code?: unknown; cause?: { message?: string; code?: unknown } };

/** What `postMessage` can carry of an error. */
export function flattenError(error: unknown): FlatError {
  if (error instanceof Error) {
    const { name, message, code } = error as Error & { code?: string };
    return { name, message, code };
  }
  return { name: "Error", message: String(error), code: undefined };
}

/**
 * The error that a user sees for `error`, which came from wasm or out of a worker.
 *
 * An error without a `code` of ours is a trap in wasm or a bug in the package: `internal`.
 */
export function reviveError(error: unknown): TetralodError {
  const { name, code, message } = known(error);
  if (error instanceof TetralodError || name === "AbortError") return error as TetralodError;
  return new TetralodError(typeof code === "string" ? (code as ErrorCode) : "internal", message ?? String(error), { cause: error });
}

/** The refusal of an option. */
export const badOption = (name: string, problem: string, options?: { cause?: unknown }) =>
  new TetralodError("bad-option", `option \`${name}\`: ${problem}`, options);

/** An error of a file's contents, or of what brought it, with the name of the file. */
export const ofFile = (name: string, error: TetralodError) => new TetralodError(error.code, `${name}: ${error.message}`, { cause: error });
