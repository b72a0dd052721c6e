/// <reference lib="esnext.disposable" />
/**
 * Surfaces of a volume in vtk.js (`@kitware/vtk.js`, an optional peer dependency).
 *
 * ```js
 * import { createSurface } from "tetralod/vtk";
 *
 * const surface = await createSurface(mt, { isosurface: 0.5 });
 * const mapper = vtkMapper.newInstance();
 * mapper.setInputData(surface.polyData);
 * await mt.refine({ error: "0.1%", isovalues: [0.5] });
 * await surface.update(); // writes into the same polydata
 * renderWindow.render();
 * ```
 */

import type { vtkPolyData } from "@kitware/vtk.js/Common/DataModel/PolyData.js";
import type { MeshTools, SurfaceOptions } from "./index.js";

export type { SurfaceOptions };

/** Polydata that show a surface of the current mesh. */
export interface VtkSurface {
  /**
   * Always the same object: points, triangles, the values as scalars, normals of isosurfaces, and the fields that `what` asks for (`fields`) as arrays of their names. Points and values are absolute: in double
   * precision where single precision would lose digits of the volume.
   */
  readonly polyData: vtkPolyData;
  /**
   * Extracts the surface from the mesh as it is now, writes it into `polyData`, and marks that as modified. `what` asks for
   * another surface, now and later. Of calls that are faster than the worker, the last one counts.
   *
   * @throws {TetralodError} `bad-option` if `what` is wrong, `freed` if the volume has been freed
   */
  update(what?: SurfaceOptions): Promise<vtkPolyData>;
  /** Deletes the polydata. The volume stays open. */
  dispose(): void;
  [Symbol.dispose](): void;
}

export interface VtkOptions {
  /** Classes of vtk.js, for a page that has loaded it in its own way. Default: they are imported from `@kitware/vtk.js`. */
  vtk?: { vtkPolyData: { newInstance(): any }; vtkDataArray: { newInstance(initial?: object): any } };
  /** The name of the array of scalars, which no field that is asked for may have. Default: `field`. */
  name?: string;
}

/**
 * Polydata with a surface of the current mesh of `volume`: a `MultiTessellation` or a `Viewer`.
 *
 * @throws {TetralodError} `bad-option` if `what` is wrong, `not-ready` if the base mesh has not arrived
 */
export function createSurface(volume: MeshTools, what: SurfaceOptions, options?: VtkOptions): Promise<VtkSurface>;
