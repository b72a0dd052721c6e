/** What can be got out of the current mesh: the same calls in `MultiTessellation` and in `Viewer`. */

import { TetralodError } from "./errors.js";
import { fieldsOf, withFields } from "./stored.js";
import { abortable } from "./stream.js";

/**
 * What passes a call on to the session, of each object with these calls; with `request`, to the mesh that this asks for.
 *
 * @type {WeakMap<object, (method: string, args: any[], request?: object, signal?: AbortSignal) => Promise<any>>}
 */
const callers = new WeakMap();

/** Says what passes the calls of `object` on to its session. */
export const setCaller = (object, call) => callers.set(object, call);

/** Passes a call on; the end of the signal ends the wait for its answer. */
async function call(object, method, args, { request, signal } = /** @type {any} */ ({})) {
  signal?.throwIfAborted();
  return abortable(/** @type {any} */ (callers.get(object))(method, args, request, signal), signal);
}

/**
 * A class with these calls.
 *
 * @param {new (...args: any[]) => any} Base
 */
export const withMeshTools = (Base) =>
  class extends Base {
    async isosurface(values, how = {}) {
      checkNames(how, ["normals", "fields", "request", "signal"]);
      const { normals = "gradient" } = how;
      if (normals !== "gradient" && normals !== "smooth") {
        throw new TetralodError("bad-option", 'option `normals`: must be "gradient" or "smooth"');
      }
      const list = typeof values === "number" ? [values] : values;
      return call(this, "isosurface", [numbers("isosurface", list), normals === "smooth", how.fields], how);
    }

    async slice(normal, offset, how = {}) {
      checkNames(how, ["fields", "request", "signal"]);
      if (typeof offset !== "number") throw new TetralodError("bad-option", "option `offset`: must be a number");
      return call(this, "slice", [numbers("normal", normal), offset, how.fields], how);
    }

    async surface(how = {}) {
      checkNames(how, ["fields", "request", "signal"]);
      return call(this, "surface", [how.fields], how);
    }

    async probe(points, how = {}) {
      checkNames(how, ["request", "signal"]);
      return call(this, "probe", [numbers("points", points)], how);
    }

    async line(from, to, how = {}) {
      checkNames(how, ["request", "signal"]);
      return call(this, "line", [numbers("from", from), numbers("to", to)], how);
    }

    async streamlines(fields, seeds, how = {}) {
      checkNames(how, ["backward", "maxLength", "maxSteps", "request", "signal"]);
      const { backward = false, maxLength = Infinity, maxSteps = 10_000 } = how;
      if (!Array.isArray(fields) || fields.length !== 3 || fields.some((name) => typeof name !== "string")) {
        throw new TetralodError("bad-option", "streamlines: a vector field is the names of three fields");
      }
      checkAmount("maxLength", maxLength, 0);
      checkAmount("maxSteps", maxSteps, 1);
      const args = [fields, numbers("seeds", seeds), Boolean(backward), maxLength, maxSteps];
      return call(this, "streamlines", args, how);
    }

    async stats(how = {}) {
      checkNames(how, ["bins", "range", "fractions", "request", "signal"]);
      const { bins = 100, range = [NaN, NaN], fractions = [] } = how;
      checkAmount("bins", bins, 1);
      if (range?.length !== 2) throw new TetralodError("bad-option", "option `range`: must be two numbers");
      return call(this, "stats", [bins, range[0], range[1], numbers("fractions", fractions)], how);
    }

    async hash() {
      return call(this, "hash", []);
    }
  };

/** The surface that `make` makes with the fields of some numbers, these as they are stored. */
function surfaceOf(session, wanted, make) {
  const fields = fieldsOf(() => session.info(), wanted);
  const surface = make(fields.map(({ index }) => index));
  return withFields(surface, fields, surface.fields);
}

/**
 * The calls in the worker; `session` gives the object of the wasm module that answers them.
 *
 * @param {() => any} session
 */
export const meshToolMethods = (session) => ({
  isosurface: (values, smooth, wanted) => surfaceOf(session(), wanted, (fields) => session().isosurfaces(values, smooth, fields)),
  slice: (normal, offset, wanted) => surfaceOf(session(), wanted, (fields) => session().slice(normal, offset, fields)),
  surface: (wanted) => surfaceOf(session(), wanted, (fields) => session().surface(fields)),
  probe: (points) => session().probe(points),
  line: (from, to) => session().line(from, to),
  streamlines: (fields, seeds, backward, maxLength, maxSteps) =>
    session().streamlines(fields, seeds, backward, maxLength, maxSteps),
  stats: (bins, low, high, fractions) => session().stats(bins, low, high, fractions),
  hash: () => session().hash(),
});

/**
 * What keeps a mesh from being finer.
 *
 * @param {{ done: boolean, satisfied: boolean, missing: boolean }} stats
 * @param {{ leftOut: number } | undefined} blocks of a file in parts
 * @param {Record<string, any>} request
 */
export function limitOf({ done, satisfied, missing }, blocks, request) {
  if (!done) return undefined;
  if (satisfied) return "error";
  if (missing) return "network";
  if (blocks && blocks.leftOut > 0) return "memory";
  return ["maxTets", "maxVertices", "maxBytes"].some((name) => request[name] !== undefined) ? "budget" : "error";
}

/** Refuses options that there are not; `others` are handled elsewhere. */
export function checkNames(options, names, others = []) {
  for (const name of Object.keys(options)) {
    if (names.includes(name)) continue;
    const all = [...others, ...names].join(", ");
    throw new TetralodError("bad-option", `option \`${name}\`: there is none of this name, only ${all}`);
  }
}

/** Refuses what is not a number of at least `least`. */
export function checkAmount(name, value, least) {
  if (typeof value === "number" && value >= least) return;
  throw new TetralodError("bad-option", `option \`${name}\`: must be a number of at least ${least}`);
}

/** A list of numbers, as wasm takes it; which numbers will do is its to say. */
function numbers(name, list) {
  const isList = Array.isArray(list) || (ArrayBuffer.isView(list) && !(list instanceof DataView));
  if (!isList || !Array.prototype.every.call(list, (number) => typeof number === "number")) {
    throw new TetralodError("bad-option", `option \`${name}\`: must be a list of numbers`);
  }
  return Float64Array.from(/** @type {ArrayLike<number>} */ (list));
}
