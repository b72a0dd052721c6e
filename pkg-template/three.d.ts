/// <reference lib="esnext.disposable" />
/**
 * Surfaces of a volume in three.js (an optional peer dependency).
 *
 * ```js
 * import { createSurface } from "tetralod/three";
 *
 * const surface = await createSurface(mt, { isosurface: 0.5 });
 * const object = new THREE.Mesh(surface.geometry, new THREE.MeshStandardMaterial());
 * object.position.set(...surface.origin); // not 0 in volumes far from their origin
 * scene.add(object);
 * await mt.refine({ error: "0.1%", isovalues: [0.5] });
 * await surface.update(); // writes into the same geometry
 * ```
 */

import type { BufferGeometry } from "three";
import type { FieldValues, MeshTools, SurfaceOptions } from "./index.js";

export type { SurfaceOptions };

/** A geometry that shows a surface of the current mesh. */
export interface ThreeSurface {
  /**
   * Always the same object. Its attributes are `position` (relative to `origin`), `normal` (of isosurfaces; others want `flatShading`),
   * `value` (relative to `offset`), with the option `color`, `color`, and `field0`, `field1`, … of `fields`. They are longer than what is drawn: the draw range and the bounding box
   * and sphere are set.
   */
  readonly geometry: BufferGeometry;
  /**
   * What positions are relative to, in model units: `object.position.set(...surface.origin)` puts an object with the geometry where it is.
   * 0 unless the volume is far from its origin for its size; the same as `info.origin`.
   */
  readonly origin: [number, number, number];
  /** What the attribute `value` is relative to: a value is `offset + scale * v`, in field units. 0 and 1 unless the field needs it. */
  readonly offset: number;
  readonly scale: number;
  /**
   * The fields that `what` asked for (`fields`), in its order: each is the attribute of this name, of one number a vertex, and a value is
   * `offset + scale * v` in its own units. Empty if none were asked for.
   */
  readonly fields: readonly (Omit<FieldValues, "values"> & { attribute: string })[];
  /**
   * Extracts the surface from the mesh as it is now, and writes it into `geometry`. Where arrays are too short, it replaces
   * them. `what` asks for another surface, now and later. Of calls that are faster than the worker, the last one counts.
   *
   * @throws {TetralodError} `bad-option` if `what` is wrong, `freed` if the volume has been freed
   */
  update(what?: SurfaceOptions): Promise<BufferGeometry>;
  /** Frees the memory on the GPU. The volume stays open. */
  dispose(): void;
  [Symbol.dispose](): void;
}

export interface ThreeOptions {
  /** The module `three`, for a page that has loaded it in its own way. Default: it is imported by this name. */
  three?: typeof import("three");
  /**
   * The colour of a value in field units: red, green and blue, 0 to 1, in the working colour space of three.js; for materials with `vertexColors`.
   * Default: no colours.
   */
  color?: (value: number) => ArrayLike<number>;
}

/**
 * A geometry with a surface of the current mesh of `volume`: a `MultiTessellation` or a `Viewer`.
 *
 * @throws {TetralodError} `bad-option` if `what` is wrong, `not-ready` if the base mesh has not arrived
 */
export function createSurface(volume: MeshTools, what: SurfaceOptions, options?: ThreeOptions): Promise<ThreeSurface>;
