/** Copies of a mesh that are kept up with what has changed. */

import { TetralodError } from "./errors.js";

/**
 * The arrays of a mesh, and how many numbers a vertex or a tetrahedron has in each.
 *
 * @type {["positions" | "field" | "tets" | "neighbors", "vertices" | "tets", number][]}
 */
const ARRAYS = [
  ["positions", "vertices", 3],
  ["field", "vertices", 1],
  ["tets", "tets", 4],
  ["neighbors", "tets", 4],
];

/** How positions and values are stored in the arrays. */
const STORED = ["origin", "offset", "scale"];

/** The bits of all arrays. */
const ALL = 2 ** ARRAYS.length - 1;

/** The bits by which wasm knows the arrays of these names; all of them without names. */
export function arrayBits(names) {
  if (names === undefined) return ALL;
  const all = ARRAYS.map(([name]) => name);
  const isGood = Array.isArray(names) && names.every((name) => all.includes(name));
  if (!isGood) throw new TetralodError("bad-option", `option \`arrays\`: must be a list of ${all.join(", ")}`);
  return all.reduce((bits, name, at) => (names.includes(name) ? bits + 2 ** at : bits), 0);
}

/**
 * The arrays in the memory of wasm itself.
 *
 * @param {ArrayBuffer} buffer
 * @param {Uint32Array} places address and length of each
 * @param {number} bits
 */
export function arraysIn(buffer, places, bits) {
  const kinds = [Float32Array, Float32Array, Uint32Array, Uint32Array];
  const entries = ARRAYS.map(([name], at) => [name, new kinds[at](buffer, places[2 * at], places[2 * at + 1])]);
  return Object.fromEntries(entries.filter((_, at) => (bits >> at) & 1));
}

/** A mesh of no tetrahedra, for `applyChanges` to begin with. */
export function emptyMesh() {
  return {
    positions: new Float32Array(),
    field: new Float32Array(),
    fields: [],
    tets: new Uint32Array(),
    neighbors: new Uint32Array(),
    origin: [0, 0, 0],
    offset: 0,
    scale: 1,
    changes: { from: 0, to: 0, vertices: new Uint32Array(), tets: new Uint32Array() },
  };
}

/**
 * Makes of `mesh` the mesh that `delta` leads to, and returns it. Its arrays are written where `delta.changes` says; those
 * that are too short are replaced by others with room to grow, those that the delta lacks are removed.
 */
export function applyChanges(mesh, delta) {
  const [is, wanted] = [mesh.changes.to, delta.changes.from];
  if (is !== wanted) {
    const problem = `the delta applies to mesh number ${wanted}, and this is number ${is}`;
    throw new TetralodError("bad-option", `applyChanges: ${problem}`);
  }
  const count = { vertices: delta.vertexCount, tets: delta.tetCount };
  for (const [name, kind, size] of ARRAYS) {
    if (!delta[name]) {
      // It would be that of another mesh.
      delete mesh[name];
      continue;
    }
    if (!mesh[name]) throw new TetralodError("bad-option", `applyChanges: the delta has \`${name}\`, and the mesh has not`);
    const array = resized(mesh[name], size * count[kind]);
    copyRanges(array, delta[name], delta.changes[kind], size);
    mesh[name] = array;
  }
  for (const name of STORED) mesh[name] = delta[name];
  // They were those of the mesh before.
  mesh.fields = [];
  mesh.changes = delta.changes;
  return mesh;
}

/** `array` with `length` numbers: in the same memory, or moved to a larger one. */
function resized(array, length) {
  if (array.length === length) return array;
  const { BYTES_PER_ELEMENT: bytes, byteOffset, buffer } = array;
  const room = (buffer.byteLength - byteOffset) / bytes;
  if (length <= room) return new array.constructor(buffer, byteOffset, length);
  const larger = new array.constructor(Math.max(length, 2 * room));
  larger.set(array);
  return larger.subarray(0, length);
}

function copyRanges(target, source, ranges, size) {
  let at = 0;
  for (let i = 0; i < ranges.length; i += 2) {
    const [start, end] = [size * ranges[i], size * ranges[i + 1]];
    const part = source.subarray(at, at + end - start);
    if (end > target.length || part.length < end - start) {
      throw new TetralodError("bad-option", "applyChanges: the ranges do not fit the arrays");
    }
    target.set(part, start);
    at += end - start;
  }
}
