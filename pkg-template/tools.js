/** What can be got out of the current mesh: the same calls in `MultiTessellation` and in `Viewer`. */

import { TetralodError } from "./errors.js";

/** What passes a call on to the session, of each object with these calls. @type {WeakMap<object, (method: string, args?: any[]) => Promise<any>>} */
const callers = new WeakMap();

/** Says what passes the calls of `object` on to its session. */
export const setCaller = (object, call) => callers.set(object, call);

/** Passes a call on. */
const call = (object, method, args = []) => /** @type {any} */ (callers.get(object))(method, args);

/**
 * A class with these calls.
 *
 * @param {new (...args: any[]) => any} Base
 */
export const withMeshTools = (Base) =>
  class extends Base {
    async isosurface(values, how = {}) {
      checkNames(how, ["normals"]);
      const { normals = "gradient" } = how;
      if (normals !== "gradient" && normals !== "smooth") {
        throw new TetralodError("bad-option", 'option `normals`: must be "gradient" or "smooth"');
      }
      const list = typeof values === "number" ? [values] : values;
      return call(this, "isosurface", [numbers("isosurface", list), normals === "smooth"]);
    }

    async slice(normal, offset) {
      if (typeof offset !== "number") throw new TetralodError("bad-option", "option `offset`: must be a number");
      return call(this, "slice", [numbers("normal", normal), offset]);
    }

    async surface() {
      return call(this, "surface");
    }

    async probe(points) {
      return call(this, "probe", [numbers("points", points)]);
    }

    async line(from, to) {
      return call(this, "line", [numbers("from", from), numbers("to", to)]);
    }

    async streamlines(fields, seeds, how = {}) {
      checkNames(how, ["backward", "maxLength", "maxSteps"]);
      const { backward = false, maxLength = Infinity, maxSteps = 10_000 } = how;
      if (!Array.isArray(fields) || fields.length !== 3 || fields.some((name) => typeof name !== "string")) {
        throw new TetralodError("bad-option", "streamlines: a vector field is the names of three fields");
      }
      checkAmount("maxLength", maxLength, 0);
      checkAmount("maxSteps", maxSteps, 1);
      return call(this, "streamlines", [fields, numbers("seeds", seeds), Boolean(backward), maxLength, maxSteps]);
    }

    async stats(how = {}) {
      checkNames(how, ["bins", "range", "fractions"]);
      const { bins = 100, range = [NaN, NaN], fractions = [] } = how;
      checkAmount("bins", bins, 1);
      if (range?.length !== 2) throw new TetralodError("bad-option", "option `range`: must be two numbers");
      return call(this, "stats", [bins, range[0], range[1], numbers("fractions", fractions)]);
    }

    async hash() {
      return call(this, "hash");
    }
  };

/**
 * The calls in the worker; `session` gives the object of the wasm module that answers them.
 *
 * @param {() => any} session
 */
export const meshToolMethods = (session) => ({
  isosurface: (values, smooth) => session().isosurfaces(values, smooth),
  slice: (normal, offset) => session().slice(normal, offset),
  surface: () => session().surface(),
  probe: (points) => session().probe(points),
  line: (from, to) => session().line(from, to),
  streamlines: (fields, seeds, backward, maxLength, maxSteps) =>
    session().streamlines(fields, seeds, backward, maxLength, maxSteps),
  stats: (bins, low, high, fractions) => session().stats(bins, low, high, fractions),
  hash: () => session().hash(),
});

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
