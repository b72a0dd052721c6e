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
