/** What is asked of a mesh and of a source; and options as wasm takes them: objects of other libraries become lists, the URL of a module its function. */

import { badOption } from "./errors.js";

/** A point or a direction: three numbers, or an object such as the `Vector3` of three.js. */
export type Vector = ArrayLike<number> | { readonly x: number; readonly y: number; readonly z: number };

/** A number in the field's own units, or a string such as `"1%"` relative to the field's range. */
export type FieldError = number | string;

/** What a camera sees. */
export interface ViewOptions {
  /**
   * From the space of the model to clip space, 16 numbers column by column. In three.js
   * `new Matrix4().multiplyMatrices(camera.projectionMatrix, camera.matrixWorldInverse)`, or its `elements`.
   */
  matrix: ArrayLike<number> | { readonly elements: ArrayLike<number> };
  /** Width and height of the picture in pixels. */
  viewport: ArrayLike<number>;
  /** The largest error that may be seen, in pixels: the displacement that the field's error counts as. */
  pixels: number;
  /** The error that is good enough everywhere, seen or not. Default: what is not seen is left as coarse as it can be. */
  outside?: FieldError;
}

/** The colour and opacity of each value of a field, linear between its points and constant beyond. */
export interface TransferOptions {
  /** `[value, red, green, blue, opacity]` of each point: values in field units, ascending, the others from 0 to 1. */
  points: ArrayLike<ArrayLike<number>> | ArrayLike<number>;
  /** The way through the model, in parts of its diagonal, along which the opacities are what they say. Default 1. */
  unitLength?: number;
}

/**
 * A part of the volume and the error that the mesh may have there. A need is one of three: the field within `error`, in
 * one region or around values or both; what a camera sees, within `view.pixels`; or what a transfer function shows,
 * within `error`.
 */
export interface Need {
  /**
   * The largest error that the mesh may have where it counts. Default 0: the reference mesh. With `transfer`: of colour
   * and opacity, 0 to 1 or a percentage, along a ray through the whole model.
   */
  error?: FieldError;
  /** The field that the need speaks of: its name, or its number in `info.fields`. Default: the field of the request. */
  field?: string | number;
  /** Only tetrahedra that meet this box count: `[x0, y0, z0, x1, y1, z1]`, or the `Box3` of three.js. */
  box?: ArrayLike<number> | { readonly min: Vector; readonly max: Vector };
  /** Only what meets this ball counts. */
  sphere?: { readonly center: Vector; readonly radius: number };
  /** Only what meets this box counts: its center, and from there the ways to the middles of three faces. */
  orientedBox?: { readonly center: Vector; readonly halfAxes: ArrayLike<number> | readonly [Vector, Vector, Vector] };
  /** Only what meets the half-space of all p with `normal · p <= offset` counts. */
  halfSpace?: { readonly normal: Vector; readonly offset: number };
  /** Only what is close to a plane counts: all p with `|normal · p - offset| <= thickness / 2 · |normal|`. */
  slab?: { readonly normal: Vector; readonly offset: number; readonly thickness?: number };
  /** Only what lies behind all of these planes, `[nx, ny, nz, d]`, counts: all p with `n · p <= d`. At most 16. */
  planes?: ArrayLike<ArrayLike<number>> | ArrayLike<number>;
  /** Only tetrahedra whose values may span one of these values, in field units, count. */
  isovalues?: ArrayLike<number>;
  /** Only tetrahedra whose values may meet one of these ranges, `[low, high]` in field units, count. */
  ranges?: ArrayLike<ArrayLike<number>> | ArrayLike<number>;
  /** Only these regions of the volume count (`info.regions`), by their names or labels; others stay as coarse as they can be. */
  regions?: readonly (string | number)[];
  /** What a camera sees. */
  view?: ViewOptions;
  /** What a transfer function shows. */
  transfer?: TransferOptions;
}

/** Many tetrahedra at once, for a function that says where the mesh is too coarse. */
export interface TetBatch {
  /** Number of tetrahedra. */
  count: number;
  /** Twelve coordinates a tetrahedron. */
  positions: Float64Array;
  /** Four values a tetrahedron, in field units. */
  values: Float64Array;
  /** The error of each tetrahedron, in field units: what is removed with it differs from the reference by so much. */
  errors: Float64Array;
}

/** How often the error of each tetrahedron exceeds what is wanted there: above 1 it is refined. */
export type Where = (batch: TetBatch) => ArrayLike<number>;

/**
 * Which mesh is wanted: the coarsest one that meets every need. The options of a {@link Need} describe the first one.
 * Every option may be left out, and names that are not listed here are refused.
 */
export interface RefineOptions extends Need {
  /**
   * The field that errors and values speak of and that the mesh carries: its name (the first time step of that name), or
   * its number in `info.fields`. Default: `info.firstField`.
   */
  field?: string | number;
  /** More needs. If they are given and nothing else is, they are the only ones. */
  needs?: readonly Need[];
  /**
   * A need of your own, answered from the base mesh with every request. A function where the MT runs in the caller's
   * thread (`worker: false`); otherwise the URL of a module whose default export is the function.
   */
  where?: Where | string | URL;
  /**
   * The function of `where` is asked of tetrahedra alone whose own boxes meet this one, as of `box`; the mesh is not refined for it elsewhere.
   * Of a file that is fetched in parts, all blocks that it can need are then fetched at once, not step by step.
   */
  whereBox?: NonNullable<Need["box"]>;
  /** The mesh may have at most so many tetrahedra; the error is then as small as that allows. Default: no limit. */
  maxTets?: number;
  /** At most so many vertices, as the arrays of the mesh have them: where fields jump between regions, one for each region. Default: no limit. */
  maxVertices?: number;
  /** At most so many bytes of arrays: 32 a tetrahedron and 16 a vertex. Default: no limit. */
  maxBytes?: number;
}

/** How a source is read. */
export interface ReadOptions {
  /**
   * Names of the fields to read; the others are not downloaded, if the file is fetched in parts, and are not available.
   * Default: all.
   */
  fields?: readonly string[];
  /**
   * Bytes of memory for the blocks of a file that is fetched in parts. When they are used up, blocks that are no longer
   * needed are evicted; needed blocks that do not fit are not fetched (`progress.blocks.leftOut`). Default: 512 MiB.
   */
  memory?: number;
  /** The name of a cache (Cache Storage) in which the parts are kept for the next time. Default: none. */
  cache?: string;
  /** Whether to read the file as a whole, front to back. Default: only where the server gives no byte ranges. */
  whole?: boolean;
  /** Headers of every request for a URL; servers of other origins must allow them. */
  headers?: HeadersInit;
  /** Whether cookies are sent: as for `fetch`. */
  credentials?: RequestCredentials;
  /** How often a failed request for a part is repeated. Default: 5. */
  retries?: number;
  /** Milliseconds before the first of these; each later one waits about twice as long. Default: 500. */
  backoffMs?: number;
  /** A request fails after so many milliseconds without a byte. Default: 30000. */
  timeoutMs?: number;
  /** Ranges closer to each other than so many bytes are fetched as one. Default: what suits the network, as measured. */
  gap?: number;
}

/** How a source is read: what `MultiTessellation.open` and `Viewer.open` have in common. */
const NETWORK = ["headers", "credentials", "retries", "backoffMs", "timeoutMs", "gap"];
const READING = ["fields", "memory", "cache", "whole", ...NETWORK];

/** The default of `memory`: bytes for the blocks of a file. */
const MEMORY = 512 * 2 ** 20;

/** Options that have been checked. */
export type Reading = ReadOptions & { fields: readonly string[]; memory: number };

/** The options of `READING`, checked, with their defaults; `others` are names that are handled elsewhere. */
export function openOptions(options: ReadOptions, others: string[]): Reading {
  for (const name of Object.keys(options)) {
    if (!READING.includes(name)) throw badOption(name, `there is none of this name, only ${[...others, ...READING].join(", ")}`);
  }
  const { fields = [], memory = MEMORY, cache, retries, backoffMs, timeoutMs, gap } = options;
  const isText = (value: unknown) => typeof value === "string";
  if (!Array.isArray(fields) || !fields.every(isText)) throw badOption("fields", "must be a list of names");
  if (cache !== undefined && !isText(cache)) throw badOption("cache", "must be the name of a cache");
  for (const [name, amount] of Object.entries({ memory, retries, backoffMs, timeoutMs, gap })) {
    if (amount !== undefined && !(amount >= 0)) throw badOption(name, "must be a number that is not negative");
  }
  return { ...options, fields, memory };
}

const NO_FUNCTION =
  "a function cannot be sent to a worker; open with `worker: false`, or give the URL of a module whose default export is the function";

/** Options that wasm checks: anything at all. */
export type Unchecked = Record<string, unknown>;

/**
 * `options` as they can be sent to a worker, or with functions as they are where there is none.
 *
 * What these hold is checked in wasm, so that every refusal is made in one place.
 */
export function sendable(options: object, toWorker: boolean): Unchecked {
  // What is no object is refused there.
  if (typeof options !== "object" || options === null) return options;
  const { where, ...rest } = options as Unchecked;
  const sent = plain(rest) as Unchecked;
  if (where === undefined) return sent;
  if (typeof where === "function" && toWorker) throw badOption("where", NO_FUNCTION);
  return { ...sent, where: typeof where === "function" ? where : address(where) };
}

/** The same with the function that `where` names. */
export async function received(options: Unchecked): Promise<Unchecked> {
  const where = options?.where;
  if (typeof where !== "string") return options;
  const module = await import(/* @vite-ignore */ /* webpackIgnore: true */ where).catch((error) => {
    throw badOption("where", `${where} cannot be imported: ${error?.message ?? error}`);
  });
  if (typeof module.default === "function") return { ...options, where: module.default };
  throw badOption("where", `the default export of ${where} is not a function`);
}

/** A URL that means the same in a worker. */
function address(where: unknown): string {
  try {
    return new URL(where as string, globalThis.location?.href).href;
  } catch {
    throw badOption("where", "must be a function, or the URL of a module that has one");
  }
}

/** Options are nested no deeper than this; objects of other libraries may go round in circles. */
const DEPTH = 6;

/** Vectors, boxes and matrices of three.js and its like as lists of numbers; what no message can carry, as null. */
function plain(value: unknown, depth = DEPTH): unknown {
  if (typeof value === "function" || typeof value === "symbol") return null;
  if (typeof value !== "object" || value === null) return value;
  if (depth === 0) return null;
  const inner = (member: unknown) => plain(member, depth - 1);
  if (ArrayBuffer.isView(value)) return Array.from(value as Float64Array);
  if (Array.isArray(value)) return value.map(inner);
  const { x, y, z, min, max, elements } = value as Unchecked;
  if (x !== undefined && y !== undefined && z !== undefined) return [x, y, z];
  if (min !== undefined && max !== undefined) return [inner(min), inner(max)];
  if (elements !== undefined) return inner(elements);
  return Object.fromEntries(Object.entries(value).map(([name, member]) => [name, inner(member)]));
}

/** Refuses options that there are not; `others` are handled elsewhere. */
export function checkNames(options: object, names: string[], others: string[] = []) {
  for (const name of Object.keys(options)) {
    if (!names.includes(name)) throw badOption(name, `there is none of this name, only ${[...others, ...names].join(", ")}`);
  }
}

/** Refuses what is not a number of at least `least`. */
export function checkAmount(name: string, value: unknown, least: number) {
  if (!(typeof value === "number" && value >= least)) throw badOption(name, `must be a number of at least ${least}`);
}
