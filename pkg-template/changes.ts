/** Copies of a mesh that are kept up with what has changed. */

import { TetralodError, badOption } from "./errors.js";
import type { Mesh, MeshChanges, MeshDelta } from "./results.js";

/** The arrays of a mesh. */
export type MeshArray = "positions" | "field" | "tets" | "neighbors";

/** The arrays of a mesh, and how many numbers a vertex or a tetrahedron has in each. */
const ARRAYS: [MeshArray, "vertices" | "tets", number][] = [
  ["positions", "vertices", 3],
  ["field", "vertices", 1],
  ["tets", "tets", 4],
  ["neighbors", "tets", 4],
];

/** How positions and values are stored in the arrays. */
const STORED = ["origin", "offset", "scale"] as const;

type Numbers = Float32Array | Uint32Array;

/** The bits of all arrays. */
const ALL = 2 ** ARRAYS.length - 1;

/** The bits by which wasm knows the arrays of these names; all of them without names. */
export function arrayBits(names?: readonly MeshArray[]): number {
  if (names === undefined) return ALL;
  const all = ARRAYS.map(([name]) => name);
  const isGood = Array.isArray(names) && names.every((name) => all.includes(name));
  if (!isGood) throw badOption("arrays", `must be a list of ${all.join(", ")}`);
  return all.reduce((bits, name, at) => (names.includes(name) ? bits + 2 ** at : bits), 0);
}

/** The arrays of `bits` in the memory of wasm itself; `places` are address and length of each. */
export function arraysIn(buffer: ArrayBuffer, places: Uint32Array, bits: number): Partial<Pick<Mesh, MeshArray>> {
  const kinds = [Float32Array, Float32Array, Uint32Array, Uint32Array];
  const entries = ARRAYS.map(([name], at) => [name, new kinds[at](buffer, places[2 * at], places[2 * at + 1])]);
  return Object.fromEntries(entries.filter((_, at) => (bits >> at) & 1));
}

/** A mesh without tetrahedra: {@link applyChanges} starts with it if no mesh has been returned before. */
export function emptyMesh(): Mesh & { changes: MeshChanges } {
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
 * Applies `delta` to `mesh`, and returns it. The arrays are written where `delta.changes` says. Arrays that are too
 * short are replaced by larger ones, so read them from `mesh` each time.
 *
 * A delta applies to the mesh that was returned right before it, whole or as a delta; other meshes are refused. Arrays that the
 * delta lacks, as its `arrays` say, are removed from the mesh.
 *
 * @example
 * const mesh = emptyMesh();
 * applyChanges(mesh, await mt.refine({ error: "1%" }, { deltas: true }));
 */
export function applyChanges<M extends Partial<Mesh> & { changes: MeshChanges }>(
  mesh: M,
  delta: Partial<MeshDelta> & Pick<MeshDelta, "changes" | "vertexCount" | "tetCount">,
): M {
  const [is, wanted] = [mesh.changes.to, delta.changes.from];
  if (is !== wanted) {
    const problem = `the delta applies to mesh number ${wanted}, and this is number ${is}`;
    throw new TetralodError("bad-option", `applyChanges: ${problem}`);
  }
  const count = { vertices: delta.vertexCount, tets: delta.tetCount };
  const arrays: { [name in MeshArray]?: Numbers } = mesh;
  for (const [name, kind, size] of ARRAYS) {
    const [before, changed] = [arrays[name], delta[name]];
    if (!changed) {
      // It would be that of another mesh.
      delete arrays[name];
      continue;
    }
    if (!before) throw new TetralodError("bad-option", `applyChanges: the delta has \`${name}\`, and the mesh has not`);
    const array = resized(before, size * count[kind]);
    copyRanges(array, changed, delta.changes[kind], size);
    arrays[name] = array;
  }
  // They were those of the mesh before.
  return Object.assign(mesh, Object.fromEntries(STORED.map((name) => [name, delta[name]])), { fields: [], changes: delta.changes });
}

/** `array` with `length` numbers: in the same memory, or moved to a larger one. */
function resized(array: Numbers, length: number): Numbers {
  if (array.length === length) return array;
  const { BYTES_PER_ELEMENT: bytes, byteOffset, buffer } = array;
  const Kind = array.constructor as Float32ArrayConstructor | Uint32ArrayConstructor;
  const room = (buffer.byteLength - byteOffset) / bytes;
  if (length <= room) return new Kind(buffer as ArrayBuffer, byteOffset, length);
  const larger = new Kind(Math.max(length, 2 * room));
  larger.set(array);
  return larger.subarray(0, length);
}

function copyRanges(target: Numbers, source: Numbers, ranges: Uint32Array, size: number) {
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
