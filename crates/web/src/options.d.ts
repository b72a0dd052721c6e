/** A point or a direction: three numbers, or an object such as the `Vector3` of three.js. */
export type Vector = ArrayLike<number> | { readonly x: number; readonly y: number; readonly z: number };

/** A number in the field's own units, or a string such as `"1%"` relative to the field's range. */
export type FieldError = number | string;

/** What a camera sees. */
export interface ViewOptions {
  /**
   * From the space of the model to clip space, 16 numbers column by column. In three.js
   * `new Matrix4().multiplyMatrices(camera.projectionMatrix, camera.matrixWorldInverse)`, or its `elements`.
   */
  matrix: ArrayLike<number> | { readonly elements: ArrayLike<number> };
  /** Width and height of the picture in pixels. */
  viewport: ArrayLike<number>;
  /** The largest error that may be seen, in pixels: the displacement that the field's error counts as. */
  pixels: number;
  /** The error that is good enough everywhere, seen or not. Default: what is not seen is left as coarse as it can be. */
  outside?: FieldError;
}

/** The colour and opacity of each value of a field, linear between its points and constant beyond. */
export interface TransferOptions {
  /** `[value, red, green, blue, opacity]` of each point: values in field units, ascending, the others from 0 to 1. */
  points: ArrayLike<ArrayLike<number>> | ArrayLike<number>;
  /** The way through the model, in parts of its diagonal, along which the opacities are what they say. Default 1. */
  unitLength?: number;
}

/**
 * A part of the volume and the error that the mesh may have there. A need is one of three: the field within `error`, in
 * one region or around values or both; what a camera sees, within `view.pixels`; or what a transfer function shows,
 * within `error`.
 */
export interface Need {
  /**
   * The largest error that the mesh may have where it counts. Default 0: the reference mesh. With `transfer`: of colour
   * and opacity, 0 to 1 or a percentage, along a ray through the whole model.
   */
  error?: FieldError;
  /** The field that the need speaks of: its name, or its number in `info.fields`. Default: the field of the request. */
  field?: string | number;
  /** Only tetrahedra that meet this box count: `[x0, y0, z0, x1, y1, z1]`, or the `Box3` of three.js. */
  box?: ArrayLike<number> | { readonly min: Vector; readonly max: Vector };
  /** Only what meets this ball counts. */
  sphere?: { readonly center: Vector; readonly radius: number };
  /** Only what meets this box counts: its center, and from there the ways to the middles of three faces. */
  orientedBox?: { readonly center: Vector; readonly halfAxes: ArrayLike<number> | readonly [Vector, Vector, Vector] };
  /** Only what meets the half-space of all p with `normal · p <= offset` counts. */
  halfSpace?: { readonly normal: Vector; readonly offset: number };
  /** Only what is close to a plane counts: all p with `|normal · p - offset| <= thickness / 2 · |normal|`. */
  slab?: { readonly normal: Vector; readonly offset: number; readonly thickness?: number };
  /** Only what lies behind all of these planes, `[nx, ny, nz, d]`, counts: all p with `n · p <= d`. At most 16. */
  planes?: ArrayLike<ArrayLike<number>> | ArrayLike<number>;
  /** Only tetrahedra whose values may span one of these values, in field units, count. */
  isovalues?: ArrayLike<number>;
  /** Only tetrahedra whose values may meet one of these ranges, `[low, high]` in field units, count. */
  ranges?: ArrayLike<ArrayLike<number>> | ArrayLike<number>;
  /** What a camera sees. */
  view?: ViewOptions;
  /** What a transfer function shows. */
  transfer?: TransferOptions;
}

/** Many tetrahedra at once, for a function that says where the mesh is too coarse. */
export interface TetBatch {
  /** Number of tetrahedra. */
  count: number;
  /** Twelve coordinates a tetrahedron. */
  positions: Float64Array;
  /** Four values a tetrahedron, in field units. */
  values: Float64Array;
  /** The error of each tetrahedron, in field units: what is removed with it differs from the reference by so much. */
  errors: Float64Array;
}

/** How often the error of each tetrahedron exceeds what is wanted there: above 1 it is refined. */
export type Where = (batch: TetBatch) => ArrayLike<number>;

/**
 * Which mesh is wanted: the coarsest one that meets every need. The options of a {@link Need} describe the first one.
 * Every option may be left out, and names that are not listed here are refused.
 */
export interface RefineOptions extends Need {
  /**
   * The field that errors and values speak of and that the mesh carries: its name (the first time step of that name), or
   * its number in `info.fields`. Default: the first.
   */
  field?: string | number;
  /** More needs. If they are given and nothing else is, they are the only ones. */
  needs?: readonly Need[];
  /**
   * A need of your own, answered from the base mesh with every request. A function where the MT runs in the caller's
   * thread (`worker: false`); otherwise the URL of a module whose default export is the function.
   */
  where?: Where | string | URL;
  /** The mesh may have at most so many tetrahedra; the error is then as small as that allows. Default: no limit. */
  maxTets?: number;
  /** At most so many vertices. Default: no limit. */
  maxVertices?: number;
  /** At most so many bytes of arrays: 32 a tetrahedron and 16 a vertex. Default: no limit. */
  maxBytes?: number;
}
