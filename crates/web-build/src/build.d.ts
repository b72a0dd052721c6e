/** A field in the files of a mesh. */
export interface InputField {
  /** Its name; a component of a vector has a name of its own, as `v_x`. */
  name: string;
  /** Fields at cells are left out unless `cellToPoint` makes fields at points of them. */
  at: "points" | "cells";
  /** Empty if it is not known. */
  unit: string;
  /** The vector that it is a part of: which component, or its length without one. `undefined` for a scalar. */
  vector: { name: string; component: number | undefined } | undefined;
}

/** What is in the files of a mesh. */
export interface InputInfo {
  /** The format, by content: VTK XML unstructured grid or image data, legacy VTK, or raw samples. */
  format: "vtu" | "vti" | "vtk" | "raw";
  points: number;
  /** Cells; of a grid the tetrahedra that it is split into. */
  tetrahedra: number;
  /** Points along x, y and z of a grid. */
  dims: [number, number, number] | undefined;
  /** Smallest and largest x, y and z. `undefined` without points, or where there is not enough memory to read them. */
  bounds: [number, number, number, number, number, number] | undefined;
  fields: InputField[];
  /** What building needs of memory, in bytes, about; what there is; and whether that is enough. */
  memory: { needed: number; available: number; fits: boolean };
}

/** How an MT is built: the options of the command `tetralod build`, under the same names. */
export interface CoreBuildOptions {
  /** The kind of MT. Default: what goes with the other options, else `"half-edge"`. */
  kind?: "half-edge" | "edge" | "vertex";
  /** How it is built. Default: `"collapse"` for kind edge, `"decimate"` for kinds half-edge and vertex. */
  method?: "collapse" | "insert" | "decimate";
  /** By what criterion vertices go or come. Default: `"half-edge"` with method decimate. */
  criterion?: "delaunay" | "half-edge";
  /** What it is for, with method decimate. Default: `"uniform"`. */
  purpose?: "uniform" | "regions";
  /** Whether tetrahedra have errors of their own, with method insert. */
  tetErrors?: boolean;
  /** Names of the fields to keep, in this order; a vector's name for its components. Default: the first field. */
  fields?: readonly string[];
  /** Whether to keep all fields but the lengths of vectors. */
  allFields?: boolean;
  /** Whether fields at cells become fields at points: the mean of the cells around, weighted by volume. */
  cellToPoint?: boolean;
  /**
   * What is repaired: nothing (a mesh that needs it is refused), what has only one sensible repair, or also points that lie on each other,
   * where that closes open seams or joins blocks that touch. Default: `"safe"`.
   */
  repair?: "none" | "safe" | "weld";
  /** How far apart points may be that `"weld"` makes one, in model units; less than the shortest edge. Default: 0. */
  weldDistance?: number;
  /** The units of fields or vectors, by name. */
  units?: Readonly<Record<string, string>>;
  /** Entries of the file's metadata. */
  metadata?: Readonly<Record<string, string>>;
  /** Bits of the position lattice, 1 to 30. Default: as few as the thinnest cells allow, at least 16. */
  positionBits?: number;
  /** How far positions may be rounded, in the units of the model. */
  positionTolerance?: number;
  /** Bits of the field lattices, 1 to 24: of all fields, or by name. Default: 16; integers are exact. */
  fieldBits?: number | Readonly<Record<string, number>>;
  /** How far values may be rounded, in units of the field or as `"1%"` of its range: of all fields, or by name. */
  fieldTolerance?: number | string | Readonly<Record<string, number | string>>;
  /** Whether the exact values of all fields are kept, or of which. */
  lossless?: boolean | readonly string[];
  /** The displacement of the boundary that counts as an error of 100 %, as `"20%"` of the diagonal, or a fraction of it. */
  displacement?: number | string;
  /** The same in lengths of the shortest edge at each place, where that is less. Default: 10. */
  displacementEdges?: number;
  /** No cell gets a dihedral angle below so many degrees, 0 to 70, except in the place of one that has a smaller one already. */
  minDihedral?: number;
  /** Creases and corners where flat parts of the boundary meet at so many degrees or more stay, 1 to 90. Default: 60. */
  featureAngle?: number;
  /** Updates in a block: a power of two from 16 to 65536. */
  blockUpdates?: number;
}

/** What was done to a mesh before it was built, and what of it is kept though it is unusual: counts. */
export interface RepairReport {
  level: "none" | "safe" | "weld";
  weldDistance: number;
  /** Points at one place that an edge joined. */
  mergedPoints: number;
  /** Points replaced by another one so that open seams closed. */
  weldedPoints: number;
  /** Those of both which had another field value than the point that stayed. */
  differingValues: number;
  /** Dropped, because two of their points are one. */
  collapsedTetrahedra: number;
  /** Dropped, because an earlier one has the same points. */
  duplicateTetrahedra: number;
  /** Turned, because they were inside out. */
  turnedTetrahedra: number;
  /** Dropped from the boundary, because they have no volume. */
  flatTetrahedra: number;
  /** Dropped, because no tetrahedron uses them. */
  unusedPoints: number;
  /** What follows in words; empty for a mesh of one part whose boundary is a surface without open seams. */
  kept: string;
  /** Parts that hang together by faces. */
  components: number;
  /** Edges with more than two faces of the boundary, which touches itself there. */
  nonManifoldEdges: number;
  /** Points at which the boundary touches itself, the ends of such edges among them. */
  nonManifoldVertices: number;
  /**
   * Faces of the boundary that lie on others: with the same three corners, or two with the same four corners as two others, which meet
   * in the other diagonal.
   */
  openSeamFaces: number;
  /** Those of the first kind, which `repair: "weld"` closes. */
  weldableFaces: number;
}

/** What was built. */
export interface CoreBuildReport {
  kind: "half-edge" | "edge" | "vertex";
  method: "collapse" | "insert" | "decimate";
  criterion: "delaunay" | "half-edge" | undefined;
  /** Of the reference mesh. */
  vertices: number;
  tetrahedra: number;
  baseVertices: number;
  baseTetrahedra: number;
  updates: number;
  /** The longest chain of updates, each of which depends on the one before. */
  depth: number;
  positionBits: number;
  /** What was mended in the mesh, in words; empty if nothing was. */
  repaired: string;
  /** The same in numbers, and what was found and kept. `undefined` for points without cells. */
  repair: RepairReport | undefined;
  /** What the reader left out of the files or changed, in words. */
  notes: string[];
}
