/** Prepares options for wasm: objects of other libraries become lists, and the URL of a module becomes its function. */

import { TetralodError } from "./errors.js";

/** How a source is read: what `MultiTessellation.open` and `Viewer.open` have in common. */
const NETWORK = ["headers", "credentials", "retries", "backoffMs", "timeoutMs", "gap"];
const READING = ["fields", "memory", "cache", "whole", ...NETWORK];

/** The default of `memory`: bytes for the blocks of a file. */
const MEMORY = 512 * 2 ** 20;

/** The options of `READING`, checked, with their defaults; `others` are names that are handled elsewhere. */
export function openOptions(options, others) {
  const refuse = (name, problem) => {
    throw new TetralodError("bad-option", `option \`${name}\`: ${problem}`);
  };
  for (const name of Object.keys(options)) {
    if (!READING.includes(name)) refuse(name, `there is none of this name, only ${[...others, ...READING].join(", ")}`);
  }
  const { fields = [], memory = MEMORY, cache, retries, backoffMs, timeoutMs, gap } = options;
  const isText = (value) => typeof value === "string";
  if (!Array.isArray(fields) || !fields.every(isText)) refuse("fields", "must be a list of names");
  if (cache !== undefined && !isText(cache)) refuse("cache", "must be the name of a cache");
  for (const [name, amount] of Object.entries({ memory, retries, backoffMs, timeoutMs, gap })) {
    if (amount !== undefined && !(amount >= 0)) refuse(name, "must be a number that is not negative");
  }
  return { ...options, fields, memory };
}

const NO_FUNCTION =
  "option `where`: a function cannot be sent to a worker; open with `worker: false`, or give the URL of a module " +
  "whose default export is the function";

/**
 * `options` as they can be sent to a worker, or with functions as they are where there is none.
 *
 * What these hold is checked in wasm, so that every refusal is made in one place.
 */
export function sendable(options, toWorker) {
  if (typeof options !== "object" || options === null) return options;
  const { where, ...rest } = options;
  const sent = plain(rest);
  if (where === undefined) return sent;
  if (typeof where === "function" && toWorker) throw new TetralodError("bad-option", NO_FUNCTION);
  return { ...sent, where: typeof where === "function" ? where : address(where) };
}

/** The same with the function that `where` names. */
export async function received(options) {
  if (typeof options?.where !== "string") return options;
  const module = await import(/* @vite-ignore */ /* webpackIgnore: true */ options.where).catch((error) => {
    throw new TetralodError("bad-option", `option \`where\`: ${options.where} cannot be imported: ${error?.message ?? error}`);
  });
  if (typeof module.default === "function") return { ...options, where: module.default };
  throw new TetralodError("bad-option", `option \`where\`: the default export of ${options.where} is not a function`);
}

/** A URL that means the same in a worker. */
function address(where) {
  try {
    return new URL(where, globalThis.location?.href).href;
  } catch {
    throw new TetralodError("bad-option", "option `where`: must be a function, or the URL of a module that has one");
  }
}

/** Options are nested no deeper than this; objects of other libraries may go round in circles. */
const DEPTH = 6;

/** Vectors, boxes and matrices of three.js and its like as lists of numbers; what no message can carry, as null. */
function plain(value, depth = DEPTH) {
  if (typeof value === "function" || typeof value === "symbol") return null;
  if (typeof value !== "object" || value === null) return value;
  if (depth === 0) return null;
  const inner = (member) => plain(member, depth - 1);
  if (ArrayBuffer.isView(value)) return Array.from(/** @type {any} */ (value));
  if (Array.isArray(value)) return value.map(inner);
  const { x, y, z, min, max, elements } = value;
  if (x !== undefined && y !== undefined && z !== undefined) return [x, y, z];
  if (min !== undefined && max !== undefined) return [inner(min), inner(max)];
  if (elements !== undefined) return inner(elements);
  return Object.fromEntries(Object.entries(value).map(([name, member]) => [name, inner(member)]));
}
