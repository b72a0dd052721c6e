/** What a session tells and hands out: the types of plain objects that wasm makes. */

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
  /**
   * Whether it is a label: whole numbers that say what something is, such as materials, with nothing between two of them. A place has the label of
   * the nearest corner of its tetrahedron.
   */
  isLabel: boolean;
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
  /**
   * The smallest and the largest value of the input at this time, and where the input has them: in the file's head, so it does not depend on the
   * current mesh. `undefined` for files that do not say.
   */
  extremes: Extremes | undefined;
  /** What averaging has done to a field that the input has at cells (`cellToPoint`); `undefined` for others. */
  averaged: Averaged | undefined;
  /**
   * The value whose isosurface is worth to be shown first, in field units, the same at all times: that which parts the histogram of the
   * first time into two groups of values that differ most (Otsu 1979); the middle of the range where there is no histogram.
   */
  isovalue: number;
  /** What a mesh of some error takes. */
  curve: ErrorCurve;
}

/** A value of a field, and where the input has it. */
export interface Extreme {
  /** In field units. */
  value: number;
  /** In model units, before the file's lattice has rounded it; of a value at a cell the centre of the cell's volume. */
  place: [number, number, number];
  /** Of a value at a cell: its number in the input, from 0. */
  cell?: number | undefined;
  /** The part of the input in which cells are numbered so, if it has several. */
  part?: string | undefined;
}

/** The smallest and the largest value of a field. */
export interface Extremes {
  min: Extreme;
  max: Extreme;
}

/** What averaging has done to a field at cells: a point has the mean of the cells around it, weighted by volume. */
export interface Averaged {
  /** The smallest and the largest value at cells. */
  input: Extremes;
  /**
   * How far the field at points is from the values at cells, of each cell the mean over its volume less its value: the square root of the mean of
   * the squares over the volume, and the largest.
   */
  difference: { rms: number; largest: number };
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

/** What has been asked of a server, and has come. */
export interface Traffic {
  /** Requests so far. */
  requests: number;
  /** Bytes that have come. */
  received: number;
  /** Those of them that were needed when they came. */
  used: number;
  /** Those that had come before. */
  repeated: number;
  /** How often something was asked for while nothing was on its way. */
  rounds: number;
  /** Milliseconds for which something was. */
  waitedMs: number;
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
  /** Those of them that cannot come: a part of a file is open (`RangeReader` with `ranges`), which does not have them. */
  absent: number;
  /** Bytes of memory that the blocks take. */
  bytes: number;
  /** Blocks that meshes needed although the file's index says that they cannot: 0 for every sound file. */
  missed: number;
}

/** A part of a volume that all meshes keep apart, such as a material. */
export interface RegionInfo {
  /** Its name in the input, or its labels as text. No two regions have the same. */
  name: string;
  /** The whole number that each of the arrays of {@link Regions} has in it. */
  labels: number[];
  /** Its tetrahedra in the reference mesh. */
  tetrahedra: number;
  /** Its volume there, in cubed model units. */
  volume: number;
  /** The box around it there: `[x0, y0, z0, x1, y1, z1]` in model units. */
  bounds: number[];
  /** `"#rrggbb"`: another than those of the regions that it touches. */
  color: string;
}

/** The parts of a volume that all meshes keep apart. */
export interface Regions {
  /** The arrays of the input that tell them apart. */
  arrays: string[];
  /** How far interfaces between them are from those of the input in any mesh, in model units: 0 if they are the same sets of points. */
  deviation: number;
  all: RegionInfo[];
}

/** What is known of a volume as soon as it is open. */
export interface MtInfo {
  /** The kind of Multi-Tessellation: what its updates are. */
  kind: "half-edge" | "edge" | "vertex";
  fields: FieldInfo[];
  /**
   * The number of the field that is shown where none is asked for: the first that varies, is no label, no component of a vector, and, by its name,
   * neither numbers something nor says where it is.
   */
  firstField: number;
  /**
   * Whether an isosurface of that field shows more than the boundary, and is drawn first: where the domain fills the box around it, but for
   * a fiftieth of its volume, as that of a grid, and the field is not linear, so that its isosurfaces are no planes.
   */
  surfaceFirst: boolean;
  /** The parts that all meshes keep apart; `undefined` for files that were built without `--preserve`. */
  regions: Regions | undefined;
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
  /**
   * Four tetrahedra a tetrahedron: the i-th lies across from its i-th vertex; 0xffffffff at the boundary. Where fields jump between regions, neighbours have
   * vertices of their own at the same places.
   */
  neighbors: Uint32Array;
}

/**
 * How numbers are stored in arrays of single precision, which graphics take: relative to numbers near them where single precision would lose
 * steps of the positions or levels of the field otherwise, as in UTM coordinates or a field of seconds since 1970. This depends on the file
 * alone, so it never changes for a field while the file is open. Stored so, numbers are those of the mesh within half a step or level.
 */
export interface Stored {
  /** What positions are relative to, in model units: a vertex is at `origin + positions`. 0 unless the data needs it. */
  origin: [number, number, number];
  /** What values are relative to: a value is `offset + scale * v`, in field units. 0 and 1 unless the data needs them. */
  offset: number;
  scale: number;
}

/**
 * A field of the volume at the vertices of a mesh or a surface, and what `info.fields` says of it. Each field has an `offset` and a `scale` of
 * its own.
 */
export interface FieldValues {
  /** Its number in `info.fields`. */
  index: number;
  name: string;
  unit: string;
  /** The time that the values are of. Time steps of one field are fields of one name. */
  time: number | undefined;
  /** Which component of which vector or tensor it is, from 0, if it is one; without a number its length. */
  vector: { name: string; component: number | undefined } | undefined;
  /** One value a vertex, in the order of the vertices: `offset + scale * v` in field units. */
  values: Float32Array;
  offset: number;
  scale: number;
}

/** Triangles with one value a vertex. */
export interface Surface extends Stored {
  /** Three coordinates a vertex, relative to `origin`. */
  positions: Float32Array;
  /** One value a vertex, relative to `offset`. */
  values: Float32Array;
  /** The fields that were asked for with `fields`, interpolated linearly in each tetrahedron; none unless some were. */
  fields: FieldValues[];
  /** Three vertices a triangle, counter-clockwise when seen from the side that they face. */
  indices: Uint32Array;
}

/** Triangles of isosurfaces; the value of a vertex is its isovalue. */
export interface IsoSurface extends Surface {
  /** Three components a vertex, of unit length. */
  normals: Float32Array;
}

/** The mesh in a plane. */
export interface Slice extends Surface {
  /** Two vertices an edge of a cell. */
  edges: Uint32Array;
}

/** A field along a line: linear in each of the parts, which are in the order of the line; gaps are outside of the domain. */
export interface LineProfile {
  /** Where each part begins and ends, as fractions of the line: two numbers a part. */
  at: Float64Array;
  /** The values there: two a part, in field units. */
  values: Float64Array;
  /** The tetrahedron of each part. */
  tets: Uint32Array;
}

/** A line that follows a vector field. */
export interface Streamline {
  /** Three coordinates a point; the seed is the first. */
  positions: Float64Array;
  /** When a particle that starts at the seed is there. */
  times: Float64Array;
  /** The value of the chosen field at each point, in field units. */
  values: Float64Array;
  /** Why it ends. */
  end: "boundary" | "stagnation" | "length" | "steps";
}

/** Sums over tetrahedra; exact for a field that is linear in each. */
export interface FieldSums {
  /** In model units, cubed. */
  volume: number;
  /** The field's integral, its mean and its standard deviation by volume, in field units. */
  integral: number;
  mean: number;
  deviation: number;
  /** Smallest and largest value. */
  min: number;
  max: number;
}

/** The same over a region. */
export interface RegionStats extends FieldSums {
  /** As in `info.regions`. */
  name: string;
  /** How many it has in the current mesh. */
  tetrahedra: number;
  /** The error of the field that is guaranteed in it, in field units, whatever was asked for. */
  errorBound: number;
}

/** Sums over the mesh. */
export interface FieldStats extends FieldSums {
  /** The volume of each bin of the histogram, and below the first and above the last one. */
  histogram: Float64Array;
  below: number;
  above: number;
  /** Ends of the bins: one more than there are bins. */
  edges: Float64Array;
  /** The values below which the fractions of the volume lie that were asked for. */
  percentiles: Float64Array;
  /** Of a volume with regions, those of which something is shown, in the order of `info.regions`. */
  regions: RegionStats[] | undefined;
}

/** The work of a refinement, or of a step of one, and the quality of the mesh. */
export interface RefineStats extends CoreStats {
  /** Time of refinement, without making and sending the arrays. */
  milliseconds: number;
  /**
   * What keeps the mesh from being finer: `error`: it is as accurate as was asked for, or the finest that there is; `budget`: it has
   * as many tetrahedra as were allowed; `network`: data is on its way; `memory`: blocks that it needs do not fit into `memory`;
   * `part`: a part of a file is open (`RangeReader` with `ranges`), which does not have them. `undefined` until `done`.
   */
  limitedBy: "error" | "budget" | "network" | "memory" | "part" | undefined;
}

/** The blocks of a file in space, in the order of the file. */
export interface BlockMap {
  /**
   * Six numbers for each block, in model units: the lower and the upper corner of a box that holds all tetrahedra that the
   * block, or what depends on it, changes. Boxes overlap; those of the first blocks, which are the coarsest, are as large as the volume.
   */
  bounds: Float64Array;
  /** For each block 0: not fetched, 1: fetched, 2: fetched, and the current mesh uses it. */
  states: Uint8Array;
}
