/** What can be got out of the current mesh: the same calls in `MultiTessellation` and in `Viewer`. */

import { TetralodError, badOption } from "./errors.js";
import type { Class, TypedEvents } from "./events.js";
import { type RefineOptions, type Unchecked, checkAmount, checkNames } from "./options.js";
import type { BlockProgress, CoreStats, FieldStats, IsoSurface, LineProfile, MtInfo, RefineStats, Slice, Streamline, Surface } from "./results.js";
import { type KnownField, type WantedFields, fieldsOf, withFields } from "./stored.js";
import { abortable } from "./stream.js";

/** Which fields come with a mesh or a surface, besides the one that is chosen. */
export interface FieldOptions {
  /**
   * All fields of the volume with `true`, or those of these names or numbers in `info.fields`; a name of several time steps is the first.
   * They are in `fields` of the result, in this order. Default: none.
   *
   * @example
   * const { positions, indices, fields } = absolute(await mt.isosurface(0.7, { fields: true }));
   * for (const { name, values } of fields) console.log(name, values[0]);
   * @throws {TetralodError} `bad-option` if there is no such field
   */
  fields?: boolean | readonly (string | number)[];
}

/**
 * What can be got out of the current mesh: the same calls in `MultiTessellation` and in `Viewer`. `Aside` is what
 * `MultiTessellation` takes besides.
 */
export interface MeshTools<Aside = AwaitOptions & { request?: never }> {
  /**
   * The isosurface of the current mesh at one value or several, in units of the field, with the value of each vertex.
   * Normals point towards lower values: they are those of the field's gradient, or with `"smooth"` of the triangles.
   *
   * @example
   * const { positions, normals, indices } = await mt.isosurface(0.7);
   */
  isosurface(
    values: number | ArrayLike<number>,
    how?: { normals?: "gradient" | "smooth" } & FieldOptions & Aside,
  ): Promise<IsoSurface & { values: Float32Array }>;

  /**
   * The section of the current mesh with the plane of all points with `normal · p = offset`, facing the way the normal
   * points.
   *
   * @example
   * const cut = await mt.slice([0, 0, 1], 2.5);                       // z = 2.5
   */
  slice(normal: ArrayLike<number>, offset: number, how?: FieldOptions & Aside): Promise<Slice>;

  /** The boundary of the current mesh, facing outwards. */
  surface(how?: FieldOptions & Aside): Promise<Surface>;

  /** The field at some points, three coordinates each, in model units; NaN outside of the mesh. */
  probe(points: ArrayLike<number>, how?: Aside): Promise<Float64Array>;

  /** The field along a line, in parts that are linear. */
  line(from: ArrayLike<number>, to: ArrayLike<number>, how?: Aside): Promise<LineProfile>;

  /**
   * The streamlines from some seeds, three coordinates each, through the vector field whose components are three fields;
   * `undefined` for seeds outside of the mesh. `maxLength` is in model units.
   *
   * @example
   * const lines = await mt.streamlines(["u", "v", "w"], [0, 0, 0, 1, 0, 0]);
   */
  streamlines(
    fields: [string, string, string],
    seeds: ArrayLike<number>,
    how?: { backward?: boolean; maxLength?: number; maxSteps?: number } & Aside,
  ): Promise<(Streamline | undefined)[]>;

  /**
   * Volume, integral, mean and a histogram by volume (100 bins over the field's range, if not said otherwise); and the values
   * below which `fractions` (0 to 1) of the volume lie, as exactly as the bins are fine.
   *
   * @example
   * const { percentiles } = await mt.stats({ bins: 1000, fractions: [0.02, 0.98] });
   */
  stats(
    how?: {
      bins?: number;
      range?: ArrayLike<number>;
      fractions?: ArrayLike<number>;
    } & Aside,
  ): Promise<FieldStats>;

  /** A hash of the current mesh: the same request gives the same hash on every machine. A viewer gives it when it is at rest. */
  hash(): Promise<string>;
}

/** For a call that may take long. */
export interface AwaitOptions {
  /** Ends the wait: the call rejects with the signal's reason, by default an `AbortError`. The mesh stays as it is. */
  signal?: AbortSignal | undefined;
}

/** For a call that answers from another mesh. */
export interface AsideOptions extends AwaitOptions {
  /**
   * Answers from the mesh of this request, and leaves the current mesh as it is. It waits for the data that the request needs. There
   * is one more mesh for all such calls, as of {@link MultiTessellation.view}; a `field` is named in the request.
   *
   * @example
   * const { indices } = await mt.isosurface(0.7, { request: { error: "1%", isovalues: [0.7] } });
   * @throws {TetralodError} `bad-source` if the volume is a stream, which cannot be read again
   */
  request?: RefineOptions;
}

/** Passes a call on to the session; with `request`, to the mesh that this asks for. */
type Caller = (method: keyof ToolMethods, args: any[], request?: RefineOptions, signal?: AbortSignal) => Promise<any>;

/** What passes the calls of each object on. */
const callers = new WeakMap<object, Caller>();

/** Says what passes the calls of `object` on to its session. */
export const setCaller = (object: object, call: Caller) => callers.set(object, call);

/** Passes a call on; the end of the signal ends the wait for its answer. */
async function call(object: object, method: keyof ToolMethods, args: unknown[], { request, signal }: AsideOptions = {}) {
  signal?.throwIfAborted();
  const caller = callers.get(object) as Caller;
  return abortable(caller(method, args, request, signal), signal);
}

/** An object with these calls and events. */
export type WithMeshTools<Aside, Events> = Class<TypedEvents<Events> & EventTarget & MeshTools<Aside>>;

/** The base class of what has these calls. */
class MeshCaller extends EventTarget implements MeshTools<AsideOptions> {
  async isosurface(values: number | ArrayLike<number>, how: { normals?: "gradient" | "smooth" } & FieldOptions & AsideOptions = {}) {
    checkNames(how, ["normals", "fields", "request", "signal"]);
    const { normals = "gradient" } = how;
    if (normals !== "gradient" && normals !== "smooth") throw badOption("normals", 'must be "gradient" or "smooth"');
    const list = typeof values === "number" ? [values] : values;
    return call(this, "isosurface", [numbers("isosurface", list), normals === "smooth", how.fields], how);
  }

  async slice(normal: ArrayLike<number>, offset: number, how: FieldOptions & AsideOptions = {}) {
    checkNames(how, ["fields", "request", "signal"]);
    if (typeof offset !== "number") throw badOption("offset", "must be a number");
    return call(this, "slice", [numbers("normal", normal), offset, how.fields], how);
  }

  async surface(how: FieldOptions & AsideOptions = {}) {
    checkNames(how, ["fields", "request", "signal"]);
    return call(this, "surface", [how.fields], how);
  }

  async probe(points: ArrayLike<number>, how: AsideOptions = {}) {
    checkNames(how, ["request", "signal"]);
    return call(this, "probe", [numbers("points", points)], how);
  }

  async line(from: ArrayLike<number>, to: ArrayLike<number>, how: AsideOptions = {}) {
    checkNames(how, ["request", "signal"]);
    return call(this, "line", [numbers("from", from), numbers("to", to)], how);
  }

  async streamlines(
    fields: [string, string, string],
    seeds: ArrayLike<number>,
    how: { backward?: boolean; maxLength?: number; maxSteps?: number } & AsideOptions = {},
  ) {
    checkNames(how, ["backward", "maxLength", "maxSteps", "request", "signal"]);
    const { backward = false, maxLength = Infinity, maxSteps = 10_000 } = how;
    if (!Array.isArray(fields) || fields.length !== 3 || fields.some((name) => typeof name !== "string")) {
      throw new TetralodError("bad-option", "streamlines: a vector field is the names of three fields");
    }
    checkAmount("maxLength", maxLength, 0);
    checkAmount("maxSteps", maxSteps, 1);
    return call(this, "streamlines", [fields, numbers("seeds", seeds), Boolean(backward), maxLength, maxSteps], how);
  }

  async stats(how: { bins?: number; range?: ArrayLike<number>; fractions?: ArrayLike<number> } & AsideOptions = {}) {
    checkNames(how, ["bins", "range", "fractions", "request", "signal"]);
    const { bins = 100, range = [NaN, NaN], fractions = [] } = how;
    checkAmount("bins", bins, 1);
    if (range?.length !== 2) throw badOption("range", "must be two numbers");
    return call(this, "stats", [bins, range[0], range[1], numbers("fractions", fractions)], how);
  }

  async hash() {
    return call(this, "hash", []);
  }
}

/** {@link MeshCaller} as a base class whose options are `Aside`, and whose events are those of `Events`. */
export const withMeshTools = <Aside, Events>() => MeshCaller as unknown as WithMeshTools<Aside, Events>;

/** What answers these calls: the session of a wasm module. */
interface ToolSession {
  info(): MtInfo | undefined;
  isosurfaces(values: Float64Array, smooth: boolean, fields: Uint32Array): IsoSurface;
  slice(normal: Float64Array, offset: number, fields: Uint32Array): Slice;
  surface(fields: Uint32Array): Surface;
  probe(points: Float64Array): Float64Array;
  line(from: Float64Array, to: Float64Array): LineProfile;
  streamlines(fields: string[], seeds: Float64Array, backward: boolean, maxLength: number, maxSteps: number): (Streamline | undefined)[];
  stats(bins: number, low: number, high: number, fractions: Float64Array): FieldStats;
  hash(): string;
}

/** A surface with the fields that are wanted, these as they are stored; wasm gives them in double precision. */
function surfaceOf<S extends Surface>(session: ToolSession, wanted: WantedFields | undefined, make: (fields: Uint32Array) => S): S {
  const fields: KnownField[] = fieldsOf(() => session.info(), wanted);
  const surface = make(Uint32Array.from(fields, ({ index }) => index));
  return withFields(surface, fields, surface.fields as unknown as Float64Array[]);
}

/** The calls in the worker; `session` gives the object of the wasm module that answers them. */
export const meshToolMethods = (session: () => ToolSession) => ({
  isosurface: (values: Float64Array, smooth: boolean, wanted?: WantedFields) =>
    surfaceOf(session(), wanted, (fields) => session().isosurfaces(values, smooth, fields)),
  slice: (normal: Float64Array, offset: number, wanted?: WantedFields) =>
    surfaceOf(session(), wanted, (fields) => session().slice(normal, offset, fields)),
  surface: (wanted?: WantedFields) => surfaceOf(session(), wanted, (fields) => session().surface(fields)),
  probe: (points: Float64Array) => session().probe(points),
  line: (from: Float64Array, to: Float64Array) => session().line(from, to),
  streamlines: (fields: string[], seeds: Float64Array, backward: boolean, maxLength: number, maxSteps: number) =>
    session().streamlines(fields, seeds, backward, maxLength, maxSteps),
  stats: (bins: number, low: number, high: number, fractions: Float64Array) => session().stats(bins, low, high, fractions),
  hash: (): string | Promise<string> => session().hash(),
});

type ToolMethods = ReturnType<typeof meshToolMethods>;

/** What keeps a mesh from being finer; `blocks` are those of a file in parts. */
export function limitOf(
  { done, satisfied, missing }: Pick<CoreStats, "done" | "satisfied" | "missing">,
  blocks: BlockProgress | undefined,
  request: Unchecked,
): RefineStats["limitedBy"] {
  if (!done) return undefined;
  if (satisfied) return "error";
  if (missing) return "network";
  if (blocks && blocks.leftOut > 0) return "memory";
  if (blocks && blocks.absent > 0) return "part";
  return ["maxTets", "maxVertices", "maxBytes"].some((name) => request[name] !== undefined) ? "budget" : "error";
}

/** A list of numbers, as wasm takes it; which numbers will do is its to say. */
function numbers(name: string, list: ArrayLike<number>): Float64Array {
  const isList = Array.isArray(list) || (ArrayBuffer.isView(list) && !(list instanceof DataView));
  if (!isList || !Array.prototype.every.call(list, (number) => typeof number === "number")) {
    throw badOption(name, "must be a list of numbers");
  }
  return Float64Array.from(list);
}
