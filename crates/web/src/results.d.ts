/** How much of a file has been decoded. */
export interface Progress {
  /** Whether the base mesh is there, so that meshes can be asked for. */
  ready: boolean;
  /** Whether the whole file is there. */
  complete: boolean;
  /** Bytes taken in. */
  bytes: number;
  /** Bytes of the whole file, as soon as that is known. */
  total: number | undefined;
  /** Updates decoded; `info.updates` is how many there will be. */
  updates: number;
  /** Of a file that is fetched in parts: how its blocks stand. */
  blocks?: BlockProgress;
}

/** A scalar field of the volume. */
export interface FieldInfo {
  name: string;
  /** Smallest and largest value over the reference mesh. */
  min: number;
  max: number;
  /** Bits that a value takes on its lattice. */
  bits: number;
  /** How arrays of single precision hold the values: `offset + scale * v`. 0 and 1 unless the field needs it; see {@link Stored}. */
  offset: number;
  scale: number;
  /** The unit of the values; empty if it is not known. */
  unit: string;
  /** The time that the values are of. Time steps of one field are fields of one name. */
  time: number | undefined;
  /** Which component of which vector or tensor the field is, from 0, if it is one; without a number its length. */
  vector: { name: string; component: number | undefined } | undefined;
  /** The error that is left in the reference mesh, in field units: what storing it rounds off. No bound is smaller. */
  floor: number;
  /**
   * Which share of the volume of the reference mesh has values in each of equal bins from `min` to `max`: 64 numbers from 0 to 1
   * with the sum 1, each within 0.000001. It is in the file's head, so it does not depend on the current mesh; `null` for files
   * that have none, made before there were any.
   *
   * @example
   * const { min, max, histogram } = mt.info.fields[0];
   * const most = histogram && histogram.indexOf(Math.max(...histogram));
   * if (histogram) console.log("most of the volume is near", min + ((most + 0.5) / histogram.length) * (max - min));
   */
  histogram: Float64Array | null;
  /** What a mesh of some error takes. */
  curve: ErrorCurve;
}

/**
 * How many bytes have to be fetched for a mesh that is nowhere further from the reference mesh than some error: known
 * before any block has arrived. For an error in between, the next entry holds.
 *
 * - *Half-edge:* exactly the bytes of the blocks that are fetched for `refine({ error })` or `refine({ relativeError })` of this
 *   field after `open`, with what stands in front of them. It is less where blocks are here or in the cache already, and a little
 *   more where requests reach over gaps (see `gap`).
 * - *Edge and vertex:* these come from front to back and do not say before what is where: one entry, the whole file.
 *
 * @example
 * const { errors, bytes } = mt.info.fields[0].curve;
 * const budget = 5e6;
 * const last = bytes.findLastIndex((count) => count <= budget);
 * if (last >= 0) await mt.refine({ error: errors[last] }); // the best mesh for 5 MB
 */
export interface ErrorCurve {
  /** Errors in field units, falling: at first perhaps `Infinity`, the base mesh; the last is 0, the reference mesh. */
  errors: Float64Array;
  /** Bytes of the file from its beginning on, for each of the errors; growing. */
  bytes: Float64Array;
}

/** How the blocks of a file stand of which only those come that are needed. */
export interface BlockProgress {
  /** Blocks of the file. */
  all: number;
  /** Blocks that are here. */
  here: number;
  /** Blocks that the request needs, as far as the file's index shows. */
  needed: number;
  /** Those of them that are not fetched because there is no room for them. */
  leftOut: number;
  /** Bytes of memory that the blocks take. */
  bytes: number;
}

/** What is known of a volume as soon as it is open. */
export interface MtInfo {
  /** The kind of Multi-Tessellation: what its updates are. */
  kind: "half-edge" | "edge" | "vertex";
  fields: FieldInfo[];
  /**
   * The box around the reference mesh, which holds every mesh of the volume: `[x0, y0, z0, x1, y1, z1]` in model units. Of files that were
   * made before they stated it, it may be larger by a 256th of the lattice at each side.
   */
  bounds: number[];
  /** What positions in arrays of single precision are relative to. 0 unless the volume needs it; see {@link Stored}. */
  origin: [number, number, number];
  /** Size of the reference mesh, the finest one. */
  vertices: number;
  tetrahedra: number;
  /**
   * Whether the file keeps exact values behind all else (`--lossless`), and whether they have arrived. Files that come by blocks do not
   * need them, and a file that is cut off has lost them.
   */
  exactValues: "none" | "missing" | "here";
  /** Updates between the base mesh and the reference mesh. */
  updates: number;
}

/** What a refinement did and how good the mesh is now. */
export interface CoreStats {
  /** Size of the current mesh. */
  vertices: number;
  tetrahedra: number;
  /** Updates that are applied in the current mesh. */
  applied: number;
  /** Updates applied and undone by this call. */
  refined: number;
  coarsened: number;
  /** Updates that were applied only because others depend on them, and tetrahedra and updates that were looked at. */
  forced: number;
  judged: number;
  /**
   * Guaranteed largest error where it counts, in field units, and relative to the field's range: of the needs that ask
   * for an error of the field, the largest.
   */
  errorBound: number;
  relativeErrorBound: number;
  /** The same at the vertices of the input inside the mesh, in field units: `errorBound`, or what rounding leaves. */
  fieldBound: number;
  /** How far the boundary of the mesh is from that of the input at most, in model units. */
  boundaryBound: number;
  /**
   * The error that is guaranteed for each need: in field units, in pixels for views, of colour and opacity for transfer
   * functions. In the order of the request, `outside` of a view behind it. Empty until `done`.
   */
  bounds: number[];
  /** How often an error exceeds what was asked for, at most; not above 1 if the request is satisfied. */
  excess: number;
  /** False where a budget, or data that has not arrived yet, kept the mesh from what was asked for. */
  satisfied: boolean;
  /** Whether the mesh is not yet what was asked for because data is on its way. */
  missing: boolean;
  /** False while there is more to do: only in the steps of `refineSteps`, and the bounds are not known then. */
  done: boolean;
}

/**
 * Where a mesh differs from the one that was handed out before: ranges `[start, end, start, end, …]` of vertices and of
 * tetrahedra, ascending. What lies beyond the ends of the arrays is gone. Meshes are numbered as they are handed out,
 * whole or as deltas; number 0 is the one without tetrahedra.
 */
export interface MeshChanges {
  /** The number of the mesh that was handed out before. */
  from: number;
  /** The number of this one. */
  to: number;
  vertices: Uint32Array;
  tets: Uint32Array;
}

/** Only what has changed in a mesh. `applyChanges` makes the mesh of it. */
export interface MeshDelta extends Stored {
  /** Size of the mesh. */
  vertexCount: number;
  tetCount: number;
  changes: MeshChanges;
  /** The arrays of {@link Mesh}, of which only the ranges are there, one behind the other. */
  positions: Float32Array;
  field: Float32Array;
  tets: Uint32Array;
  neighbors: Uint32Array;
}

/**
 * A conforming tetrahedral mesh with one value per vertex: what `Viewer.mesh` gives. What `refine` gives (`RefineResult`) is a `Mesh`
 * with what has changed in it and the numbers.
 */
export interface Mesh extends Stored {
  /** Three coordinates a vertex, relative to `origin`. */
  positions: Float32Array;
  /** One value a vertex, relative to `offset`: `offset + scale * v` in field units. */
  field: Float32Array;
  /** The fields that were asked for with `fields`; none unless some were. */
  fields: FieldValues[];
  /** Four vertices a tetrahedron, positive: (b - a) x (c - a) . (d - a) > 0. */
  tets: Uint32Array;
  /** Four tetrahedra a tetrahedron: the i-th lies across from its i-th vertex; 0xffffffff at the boundary. */
  neighbors: Uint32Array;
}
