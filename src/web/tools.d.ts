/** Triangles of an isosurface. */
export interface IsoSurface {
  /** Three coordinates a vertex. */
  positions: Float32Array;
  /** Three components a vertex, of unit length. */
  normals: Float32Array;
  /** Three vertices a triangle. */
  indices: Uint32Array;
}

/** Triangles with one value a vertex. */
export interface Surface {
  /** Three coordinates a vertex. */
  positions: Float32Array;
  /** One value a vertex, in field units. */
  values: Float32Array;
  /** Three vertices a triangle, counter-clockwise when seen from the side that they face. */
  indices: Uint32Array;
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

/** Sums over the mesh; exact for a field that is linear in each tetrahedron. */
export interface FieldStats {
  /** In model units, cubed. */
  volume: number;
  /** The field's integral, its mean and its standard deviation by volume, in field units. */
  integral: number;
  mean: number;
  deviation: number;
  /** Smallest and largest value. */
  min: number;
  max: number;
  /** The volume of each bin of the histogram, and below the first and above the last one. */
  histogram: Float64Array;
  below: number;
  above: number;
  /** Ends of the bins: one more than there are bins. */
  edges: Float64Array;
  /** The values below which the fractions of the volume lie that were asked for. */
  percentiles: Float64Array;
}
