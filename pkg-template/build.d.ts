/**
 * MT files from meshes, in the page: what the command `tetralod build` does, with the same bytes.
 *
 * ```js
 * import { build, inspect } from "tetralod/build";
 * import { MultiTessellation } from "tetralod";
 *
 * const { fields, memory } = await inspect(file); // a File that was dropped or chosen
 * if (memory.fits) {
 *   const { bytes } = await build(file, { fields: [fields[0].name], onProgress: (p) => console.log(p.phase, p.fraction) });
 *   const mt = await MultiTessellation.open(bytes);
 * }
 * ```
 */

import type { CoreBuildOptions, CoreBuildReport, InputField, InputInfo, RepairReport } from "./tetralod_build.js";

export { TetralodError, type ErrorCode } from "./index.js";
export type { InputField, InputInfo, RepairReport };

/** The content of a file. Bytes in memory are copied, not taken away. */
export type FileSource = Blob | ArrayBuffer | ArrayBufferView | URL | string;

/** The file of a mesh; of raw samples two. */
export type MeshFile = FileSource | { raw: FileSource; json: FileSource };

/**
 * What an MT is built of: a file (`.vtu`, `.vti`, `.vtk`, or raw samples with the JSON beside them), or a list of files, which are
 * time steps over one mesh. In a list, `x.raw` and `x.json` are one.
 */
export type MeshSource = MeshFile | readonly MeshFile[];

/** The stages of the work, in their order; a build has one of `remove`, `collapse` and `insert`. */
export type BuildPhase = "read" | "parse" | "repair" | "remove" | "collapse" | "insert" | "order" | "encode";

export interface BuildProgress {
  phase: BuildPhase;
  /** How much of the whole work is done, about: 0 to 1, never less than before. */
  fraction: number;
  /** Tetrahedra of the mesh as it is now, in phases that change it. */
  tetrahedra: number | undefined;
}

/** What both calls take: what is forecast depends on the kind and on the fields. */
export interface InspectOptions extends CoreBuildOptions {
  /** Ends the work, and its worker, at once; the call rejects with the signal's reason. */
  signal?: AbortSignal;
  /** Bytes of memory that may be used. Default and most: what a wasm module can have, nearly 4 GiB. */
  memory?: number;
  /**
   * The address of the worker's file, `tetralod/build-worker`, as your server or bundler gives it; as for `Viewer.create`. Default:
   * the file beside this module.
   *
   * @throws {TetralodError} `worker` if nothing starts there, or a worker of another version
   */
  workerUrl?: string | URL;
  /**
   * How long the worker may take to load its script and answer, in milliseconds: a number of at least 0, `Infinity` for any time.
   * Default 30 000. Its work, and the download of the wasm file, are not limited by this.
   *
   * @example
   * await build(file, { workerTimeoutMs: 5000 });
   * @throws {TetralodError} `worker` if it does not answer in time
   */
  workerTimeoutMs?: number;
  /**
   * The address of the wasm file, `tetralod/build.wasm`. Default: the file beside the worker's.
   *
   * @throws {TetralodError} `wasm` if it cannot be loaded or compiled
   */
  wasmUrl?: string | URL;
}

export interface BuildOptions extends InspectOptions {
  onProgress?: (progress: BuildProgress) => void;
}

export interface BuildReport extends CoreBuildReport {
  fileBytes: number;
  seconds: number;
  /** The largest size of the module's memory. */
  memoryBytes: number;
}

/**
 * What is in the files of a mesh, before it is built: nothing is decoded but the points, for their bounds.
 *
 * @throws {TetralodError} as {@link build}, as far as that is seen from the structure of the files and from the cells
 */
export function inspect(source: MeshSource, options?: InspectOptions): Promise<InputInfo>;

/**
 * Builds an MT file in a worker. The same files and options give the same bytes as the command `tetralod build`.
 *
 * @throws {TetralodError} `unknown-format`, `unsupported`, `corrupt` or `truncated` for files that cannot be read; `bad-mesh` for a
 *   mesh that cannot be built; `memory` if there is too little, before the work begins if that can be known; `bad-option`
 */
export function build(source: MeshSource, options?: BuildOptions): Promise<{ bytes: Uint8Array<ArrayBuffer>; report: BuildReport }>;
