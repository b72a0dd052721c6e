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

import type { BuildMethods, InputFile } from "./build-worker.js";
import { type ErrorCode, TetralodError, badOption, known } from "./errors.js";
import type { Averaged, Extremes } from "./results.js";
import { type Kind, absoluteHref, checkWorker, startWorker } from "./start.js";
import { nodeModule } from "./stream.js";

export { TetralodError, type ErrorCode };

/** The content of a file. Bytes in memory are copied, not taken away. */
export type FileSource = Blob | ArrayBuffer | ArrayBufferView | URL | string;

/**
 * A file under a name, by which others name it, perhaps with folders: `case/0.vtu`. A `File` has a name of its own, and a URL its path;
 * bytes have none.
 */
export interface NamedFile {
  name: string;
  data: FileSource;
}

/** A file of a mesh; of raw samples two that belong together whatever they are called. */
export type MeshFile = FileSource | NamedFile | { raw: FileSource; json: FileSource };

/**
 * What an MT is built of: a file of any format that the command reads, or a list of files. What one of them names belongs to it: the
 * pieces of a `.pvtu`, the samples of a `.nhdr` or `.mhd`, the files of a `.pvd`, and of one name `.node` and `.ele`, `.mesh` and `.sol`,
 * `.raw` and `.json`. All others are time steps over one mesh, in the order of the list.
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

/** A field in the files of a mesh. */
export interface InputField {
  /** Its name; a component of a vector has a name of its own, as `v_x`. */
  name: string;
  /** Fields at cells are left out unless `cellToPoint` makes fields at points of them. */
  at: "points" | "cells";
  /** Empty if it is not known. */
  unit: string;
  /** The vector that it is a part of: which component, or without one what follows from these, as its length. `undefined` for a scalar. */
  vector: { name: string; component: number | undefined } | undefined;
}

/** A format of meshes: VTK's, also with the pieces in several files and in HDF5, Exodus II, those of meshers and of images, and raw samples. */
export type InputFormat =
  | "vtu"
  | "vti"
  | "vtr"
  | "vts"
  | "vtk"
  | "pvtu"
  | "pvti"
  | "pvtr"
  | "pvts"
  | "vtkhdf"
  | "exodus"
  | "gmsh"
  | "medit"
  | "tetgen"
  | "netgen"
  | "nrrd"
  | "metaimage"
  | "raw";

/** What is in the files of a mesh. */
export interface InputInfo {
  /** The format, by content. */
  format: InputFormat;
  /** Points; of a mesh in pieces, those that several pieces have count in each. */
  points: number;
  /** Cells; of a grid the tetrahedra that it is split into. */
  tetrahedra: number;
  /** Points along x, y and z of a grid. */
  dims: [number, number, number] | undefined;
  /** Smallest and largest x, y and z. `undefined` without points, or where there is not enough memory to read them. */
  bounds: [number, number, number, number, number, number] | undefined;
  fields: InputField[];
  /** What building needs of memory, in bytes, about; what there is; and whether that is enough. */
  memory: { needed: number; available: number; fits: boolean };
}

/** How an MT is built: the options of the command `tetralod build`, under the same names. */
export interface CoreBuildOptions {
  /** The kind of MT. Default: what goes with the other options, else `"half-edge"`. */
  kind?: "half-edge" | "edge" | "vertex";
  /** How it is built. Default: `"collapse"` for kind edge, `"decimate"` for kinds half-edge and vertex. */
  method?: "collapse" | "insert" | "decimate";
  /** By what criterion vertices go or come. Default: `"half-edge"` with method decimate. */
  criterion?: "delaunay" | "half-edge";
  /** What it is for, with method decimate. Default: `"uniform"`. */
  purpose?: "uniform" | "regions";
  /** Whether tetrahedra have errors of their own, with method insert. */
  tetErrors?: boolean;
  /** Names of the fields to keep, in this order; a vector's name for its components. Default: the first array that does not number something or say where it is, by its name; of a vector the magnitude, of a symmetric tensor von Mises' equivalent. */
  fields?: readonly string[];
  /** Whether to keep all fields but what follows from others: magnitudes of vectors, von Mises' equivalent and principal values of symmetric tensors. */
  allFields?: boolean;
  /** Whether fields at cells become fields at points: the mean of the cells around, weighted by volume, of labels the most frequent one. `averaged` of the report says what that does to them. */
  cellToPoint?: boolean;
  /**
   * Gives points where regions meet (`preserve`) one value in fields that were at cells, the mean of all cells around. By default files of kind
   * `half-edge` keep a value for each region there, from the cells of that region alone.
   */
  meanAcrossRegions?: boolean;
  /**
   * Which fields are labels, by their names: whole numbers with nothing between two of them, shown by the nearest point; or, with `false`, are not.
   * Default: integers of at most 256 different values whose name says that they number something, as `material`.
   */
  labels?: Readonly<Record<string, boolean>>;
  /**
   * What is repaired: nothing (a mesh that needs it is refused), what has only one sensible repair, or also points that lie on each other,
   * where that closes open seams or joins blocks that touch. Default: `"safe"`.
   */
  repair?: "none" | "safe" | "weld";
  /** How far apart points may be that `"weld"` makes one, in model units; less than the shortest edge. Default: 0. */
  weldDistance?: number;
  /** The units of fields or vectors, by name. */
  units?: Readonly<Record<string, string>>;
  /** Entries of the file's metadata. */
  metadata?: Readonly<Record<string, string>>;
  /** Bits of the position lattice, 1 to 30. Default: as few as the thinnest cells allow, at least 16. */
  positionBits?: number;
  /** How far positions may be rounded, in the units of the model. */
  positionTolerance?: number;
  /** Bits of the field lattices, 1 to 24: of all fields, or by name. Default: 16; integers are exact. */
  fieldBits?: number | Readonly<Record<string, number>>;
  /** How far values may be rounded, in units of the field or as `"1%"` of its range: of all fields, or by name. */
  fieldTolerance?: number | string | Readonly<Record<string, number | string>>;
  /** Whether the exact values of all fields are kept, or of which. */
  lossless?: boolean | readonly string[];
  /** The displacement of the boundary that counts as an error of 100 %, as `"20%"` of the diagonal, or a fraction of it. */
  displacement?: number | string;
  /** The same in lengths of the shortest edge at each place, where that is less. Default: 10. */
  displacementEdges?: number;
  /** No cell gets a dihedral angle below so many degrees, 0 to 70, except in the place of one that has a smaller one already. */
  minDihedral?: number;
  /** Creases and corners where flat parts of the boundary meet at so many degrees or more stay, 1 to 90. Default: 60. */
  featureAngle?: number;
  /**
   * Labels that part the mesh into regions: names of whole numbers at cells or points, which are kept apart in all meshes, or `"components"`, the
   * parts that hang together by faces. Half-edge files keep the regions (`info.regions`).
   */
  preserve?: readonly string[];
  /** How far curved interfaces between regions may move, in model units. Default: 0. */
  preserveWithin?: number;
  /** Updates in a block: a power of two from 16 to 65536. */
  blockUpdates?: number;
}

/** What was done to a mesh before it was built, and what of it is kept though it is unusual: counts. */
export interface RepairReport {
  level: "none" | "safe" | "weld";
  weldDistance: number;
  /** Points at one place that an edge joined. */
  mergedPoints: number;
  /** Points replaced by another one so that open seams closed. */
  weldedPoints: number;
  /** Those of both which had another field value than the point that stayed. */
  differingValues: number;
  /** Dropped, because two of their points are one. */
  collapsedTetrahedra: number;
  /** Dropped, because an earlier one has the same points. */
  duplicateTetrahedra: number;
  /** Turned, because they were inside out. */
  turnedTetrahedra: number;
  /** Dropped from the boundary, because they have no volume. */
  flatTetrahedra: number;
  /** Dropped, because no tetrahedron uses them. */
  unusedPoints: number;
  /** What follows in words; empty for a mesh of one part whose boundary is a surface without open seams. */
  kept: string;
  /** Parts that hang together by faces. */
  components: number;
  /** Edges with more than two faces of the boundary, which touches itself there. */
  nonManifoldEdges: number;
  /** Points at which the boundary touches itself, the ends of such edges among them. */
  nonManifoldVertices: number;
  /**
   * Faces of the boundary that lie on others: with the same three corners, or two with the same four corners as two others, which meet
   * in the other diagonal.
   */
  openSeamFaces: number;
  /** Those of the first kind, which `repair: "weld"` closes. */
  weldableFaces: number;
}

/** What was built. */
export interface CoreBuildReport {
  kind: "half-edge" | "edge" | "vertex";
  method: "collapse" | "insert" | "decimate";
  criterion: "delaunay" | "half-edge" | undefined;
  /** Of the reference mesh. */
  vertices: number;
  tetrahedra: number;
  baseVertices: number;
  baseTetrahedra: number;
  updates: number;
  /** The longest chain of updates, each of which depends on the one before. */
  depth: number;
  positionBits: number;
  /** What was mended in the mesh, in words; empty if nothing was. */
  repaired: string;
  /** The same in numbers, and what was found and kept. `undefined` for points without cells. */
  repair: RepairReport | undefined;
  /** What the reader left out of the files or changed, in words. */
  notes: string[];
  /** What averaging has done to the fields that the files have at cells (`cellToPoint`). */
  averaged: AveragedField[];
}

/** A field that was averaged from cells to points. */
export interface AveragedField extends Averaged {
  name: string;
  /** `undefined` if it is not known. */
  unit?: string;
  time?: number;
  /** Whether it is a label: `difference` is then of shares of a cell, 0 to 1, that have another one. */
  isLabel: boolean;
  /** The smallest and the largest value at points, and where they are. */
  points: Extremes;
}

const KINDS = "give a File, Blob, ArrayBuffer, Uint8Array, URL, { name, data }, { raw, json }, or a list of these";

const BUILDER: Kind = {
  name: "build",
  entry: "tetralod/build-worker",
  start: () => new Worker(new URL("./build-worker.js", import.meta.url), { type: "module" }),
  script: () => new URL("./build-worker.js", new URL("./tetralod_build_bg.wasm", import.meta.url)),
  remedy: "",
};

/** How far the work is at the begin of each phase; what changes the mesh takes most of the time. */
const BEGINS: Record<BuildPhase, number> = { read: 0, parse: 0.05, repair: 0.1, remove: 0.15, collapse: 0.15, insert: 0.15, order: 0.85, encode: 0.95 };
const ENDS: Record<BuildPhase, number> = { read: 0.05, parse: 0.1, repair: 0.15, remove: 0.85, collapse: 0.85, insert: 0.85, order: 0.95, encode: 1 };

/** What a worker tells of its work: how much of a phase is done. */
export interface Work {
  phase: BuildPhase;
  done: number;
  total: number;
  tetrahedra: number | undefined;
}

/**
 * Builds an MT file in a worker. The same files and options give the same bytes as the command `tetralod build`.
 *
 * @throws {TetralodError} `unknown-format`, `unsupported`, `corrupt` or `truncated` for files that cannot be read; `bad-mesh` for a
 *   mesh that cannot be built; `memory` if there is too little, before the work begins if that can be known; `bad-option`
 */
export async function build(source: MeshSource, options: BuildOptions = {}): Promise<{ bytes: Uint8Array<ArrayBuffer>; report: BuildReport }> {
  const { onProgress = () => {}, ...rest } = options;
  let fraction = 0;
  const tell = ({ phase, done, total, tetrahedra }: Work) => {
    const part = total > 0 ? Math.min(done / total, 1) : 0;
    // Phases may start again, and a phase may turn out to be longer.
    fraction = Math.max(fraction, BEGINS[phase] + part * (ENDS[phase] - BEGINS[phase]));
    onProgress({ phase, fraction, tetrahedra });
  };
  const built = await inWorker("build", source, rest, (_, progress) => tell(progress));
  tell({ phase: "encode", done: 1, total: 1, tetrahedra: undefined });
  return built;
}

/**
 * What is in the files of a mesh, before it is built: nothing is decoded but the points, for their bounds, and cells where only these say
 * how many there are.
 *
 * @throws {TetralodError} as {@link build}, as far as that is seen from the structure of the files and from the cells
 */
export async function inspect(source: MeshSource, options: InspectOptions = {}): Promise<InputInfo> {
  return inWorker("inspect", source, options, () => {});
}

/** One call in a worker of its own: only its end gives its memory back, and nothing else can stop it. */
async function inWorker<Method extends "build" | "inspect">(
  method: Method,
  source: MeshSource,
  { signal, memory, workerUrl, workerTimeoutMs, wasmUrl, ...options }: InspectOptions,
  onEvent: (name: string, data: Work) => void,
): Promise<Awaited<ReturnType<BuildMethods[Method]>>> {
  signal?.throwIfAborted();
  if (memory !== undefined && !(memory >= 0)) throw badOption("memory", "must be a number that is not negative");
  const wasm = absoluteHref("wasmUrl", wasmUrl);
  const files = await filesOf(source);
  signal?.throwIfAborted();
  const remote = startWorker<BuildMethods>(BUILDER, { workerUrl, workerTimeoutMs }, onEvent);
  const onAbort = () => remote.close(signal?.reason);
  signal?.addEventListener("abort", onAbort, { once: true });
  try {
    await checkWorker(BUILDER, remote.call("load", [wasm]));
    return await remote.call(method, [files, options, memory] as unknown as Parameters<BuildMethods[Method]>);
  } catch (error) {
    if (known(error).name === "DataCloneError") throw badOption("options", "must be plain data");
    throw error;
  } finally {
    signal?.removeEventListener("abort", onAbort);
    remote.close(new TetralodError("freed", "the work has ended"));
  }
}

/** All files, as they can be sent to a worker. */
async function filesOf(source: MeshSource): Promise<InputFile[]> {
  const list: readonly MeshFile[] = Array.isArray(source) ? source : [source as MeshFile];
  const files = (await Promise.all(list.map(filesIn))).flat();
  if (files.length === 0) throw new TetralodError("bad-source", `there is no file; ${KINDS}`);
  return files;
}

async function filesIn(source: MeshFile, number: number): Promise<InputFile[]> {
  const { raw, json, data, name } = (source ?? {}) as Partial<NamedFile & { raw: FileSource; json: FileSource }>;
  if (data !== undefined) return [{ ...(await sendable(data)), name }];
  if (raw === undefined && json === undefined) return [await sendable(source as FileSource)];
  if (raw === undefined || json === undefined) {
    throw new TetralodError("bad-source", "raw samples are two files: give { raw, json }");
  }
  const [samples, sidecar] = await Promise.all([sendable(raw), sendable(json)]);
  const stem = (sidecar.name ?? samples.name ?? `samples-${number}`).replace(/\.[^./]*$/, "");
  return [
    { ...samples, name: `${stem}.raw` },
    { ...sidecar, name: `${stem}.json` },
  ];
}

/** A source that a worker can read, and its name, which not every runtime sends along. */
async function sendable(source: FileSource): Promise<InputFile> {
  if (typeof Blob === "function" && source instanceof Blob) {
    const { name, webkitRelativePath } = source as Partial<File>;
    // Node 20 crashes when a worker reads a Blob that is backed by a file.
    return { source: nodeModule("node:worker_threads") ? await source.arrayBuffer() : source, name: webkitRelativePath || name };
  }
  if (source instanceof ArrayBuffer || ArrayBuffer.isView(source)) return { source };
  if (typeof source === "string" || source instanceof URL) {
    const url = absolute(source);
    return { source: url.href, name: pathOf(url) };
  }
  throw new TetralodError("bad-source", `this cannot be read; ${KINDS}`);
}

function absolute(url: string | URL): URL {
  try {
    return new URL(url, globalThis.location?.href);
  } catch {
    throw new TetralodError("bad-source", `${url}: this is no URL; ${KINDS}`);
  }
}

/** A URL as files name it: without what is not of its path, and with all characters as they are. */
function pathOf({ protocol, host, pathname }: URL): string | undefined {
  if (!/^(https?|file):$/.test(protocol)) return undefined;
  try {
    return `${protocol}//${host}${decodeURIComponent(pathname)}`;
  } catch {
    return `${protocol}//${host}${pathname}`;
  }
}
