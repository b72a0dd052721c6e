/** Triangles out of the current mesh for `tetralod/three` and `tetralod/vtk`, which keep them in objects of these libraries. */

import { TetralodError } from "./errors.js";
import { Latest } from "./latest.js";
import { checkNames } from "./options.js";
import type { Surface as SurfaceArrays } from "./results.js";
import type { FieldOptions, MeshTools } from "./tools.js";

/** Which surface `tetralod/three` and `tetralod/vtk` show: one of these, with fields beside the values that are drawn. */
export type SurfaceOptions = FieldOptions & (
  | {
      /** At one value or several, in units of the field. */
      isosurface: number | ArrayLike<number>;
      /** Those of the field's gradient (default), or of the triangles. */
      normals?: "gradient" | "smooth";
    }
  | {
      /** The section with the plane of all points with `normal · p = offset`. */
      slice: { normal: ArrayLike<number>; offset: number };
    }
  | {
      /** The boundary of the mesh. */
      boundary: true;
    }
);

/** Triangles, and where there are any, normals, values and fields. */
export type Triangles = SurfaceArrays & { normals?: Float32Array };

const KINDS = ["isosurface", "slice", "boundary"];

/** The triangles that `what` asks for. */
async function extract(volume: MeshTools, what: SurfaceOptions): Promise<Triangles> {
  checkNames(what, [...KINDS, "normals", "fields"]);
  const { isosurface, slice, boundary, normals, fields } = what as {
    isosurface?: number | ArrayLike<number>;
    slice?: { normal: ArrayLike<number>; offset: number };
    boundary?: true;
    normals?: "gradient" | "smooth";
  } & FieldOptions;
  const asked = [isosurface !== undefined, slice !== undefined, Boolean(boundary)];
  if (asked.filter(Boolean).length !== 1) {
    throw new TetralodError("bad-option", `one of ${KINDS.join(", ")} is needed, and no second one`);
  }
  const how = fields === undefined ? {} : { fields };
  if (slice !== undefined) return volume.slice(slice?.normal, slice?.offset, how);
  if (isosurface !== undefined) return volume.isosurface(isosurface, normals === undefined ? how : { ...how, normals });
  return volume.surface(how);
}

/** What keeps `take` supplied: later updates replace those that wait. */
export class Surface {
  #volume: MeshTools;
  #what: SurfaceOptions;
  #take: (triangles: Triangles) => void;
  #updates = new Latest<SurfaceOptions | undefined, void>((what) => this.#update(what), (a, b) => b ?? a);
  #disposed = false;

  constructor(volume: MeshTools, what: SurfaceOptions, take: (triangles: Triangles) => void) {
    this.#volume = volume;
    this.#what = what;
    this.#take = take;
  }

  /** Extracts from the mesh as it is now; `what` asks for something else from now on. */
  update(what?: SurfaceOptions): Promise<void> {
    return this.#updates.call(what);
  }

  async #update(what = this.#what) {
    const triangles = await extract(this.#volume, what);
    this.#what = what;
    if (!this.#disposed) this.#take(triangles);
  }

  dispose() {
    this.#disposed = true;
  }
}
