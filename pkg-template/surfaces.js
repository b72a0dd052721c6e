/** Triangles out of the current mesh for `tetralod/three` and `tetralod/vtk`, which keep them in objects of these libraries. */

import { TetralodError } from "./errors.js";
import { Latest } from "./latest.js";
import { checkNames } from "./tools.js";

const KINDS = ["isosurface", "slice", "boundary"];

/** The triangles that `what` asks for. */
async function extract(volume, what) {
  checkNames(what, [...KINDS, "normals", "fields"]);
  const { isosurface, slice, boundary, normals, fields } = what;
  const asked = [isosurface !== undefined, slice !== undefined, Boolean(boundary)];
  if (asked.filter(Boolean).length !== 1) {
    throw new TetralodError("bad-option", `one of ${KINDS.join(", ")} is needed, and no second one`);
  }
  const how = fields === undefined ? {} : { fields };
  if (boundary) return volume.surface(how);
  if (slice !== undefined) return volume.slice(slice?.normal, slice?.offset, how);
  return volume.isosurface(isosurface, normals === undefined ? how : { ...how, normals });
}

/** What keeps `take` supplied: later updates replace those that wait. */
export class Surface {
  #volume;
  #what;
  #take;
  #updates = new Latest((what) => this.#update(what), (a, b) => b ?? a);
  #disposed = false;

  /**
   * @param {import("./index.js").MeshTools} volume
   * @param {object} what
   * @param {(triangles: any) => void} take gets positions, indices, and where there are any normals, values and fields
   */
  constructor(volume, what, take) {
    this.#volume = volume;
    this.#what = what;
    this.#take = take;
  }

  /** Extracts from the mesh as it is now; `what` asks for something else from now on. */
  update(what) {
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
