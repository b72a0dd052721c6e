/// <reference lib="esnext.disposable" preserve="true" />
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
import { DISPOSE } from "./dispose.js";
import { badOption } from "./errors.js";
import { checkNames } from "./options.js";
import { absolute } from "./stored.js";
import { Surface, type SurfaceOptions, type Triangles } from "./surfaces.js";
import type { MeshTools } from "./tools.js";

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
export async function createSurface(volume: MeshTools, what: SurfaceOptions, options: VtkOptions = {}): Promise<VtkSurface> {
  checkNames(options, ["vtk", "name"]);
  const { vtk = await loaded(), name = "field" } = options;
  const surface = new PolyData(volume, what, vtk, name);
  await surface.update();
  return surface;
}

type Vtk = NonNullable<VtkOptions["vtk"]>;

async function loaded(): Promise<Vtk> {
  const [polyData, dataArray] = await Promise.all([
    import("@kitware/vtk.js/Common/DataModel/PolyData.js"),
    import("@kitware/vtk.js/Common/Core/DataArray.js"),
  ]);
  return { vtkPolyData: polyData.default, vtkDataArray: dataArray.default };
}

class PolyData implements VtkSurface {
  #vtk: Vtk;
  #name: string;
  #surface: Surface;
  /** The names of the fields that are there beside the scalars. */
  #fields: string[] = [];
  /** The classes are given without types. */
  readonly polyData: any;

  constructor(volume: MeshTools, what: SurfaceOptions, vtk: Vtk, name: string) {
    this.#vtk = vtk;
    this.#name = name;
    this.polyData = vtk.vtkPolyData.newInstance();
    this.#surface = new Surface(volume, what, (triangles) => this.#take(triangles));
  }

  async update(what?: SurfaceOptions): Promise<vtkPolyData> {
    await this.#surface.update(what);
    return this.polyData;
  }

  dispose() {
    this.#surface.dispose();
    this.polyData.delete();
  }

  [DISPOSE](): void {
    this.dispose();
  }

  #take(triangles: Triangles) {
    const { polyData } = this;
    const { positions, indices, normals, values, fields = [] } = absolute(triangles);
    const taken = fields.find(({ name }) => [this.#name, "Normals"].includes(name));
    if (taken) throw badOption("name", `there is a field ${taken.name}; give the scalars another name`);
    polyData.getPoints().setData(positions, 3);
    polyData.getPolys().setData(cellsOf(indices), 1);
    const data = polyData.getPointData();
    this.#put(data, "Scalars", this.#name, values, 1);
    this.#put(data, "Normals", "Normals", normals, 3);
    this.#fields.filter((name) => fields.every((field) => field.name !== name)).forEach((name) => data.removeArray(name));
    this.#fields = fields.map(({ name }) => name);
    for (const { name, values } of fields) {
      const there = data.getArrayByName(name);
      if (there) there.setData(values, 1);
      else data.addArray(this.#vtk.vtkDataArray.newInstance({ name, values }));
    }
    polyData.modified();
  }

  /** Writes an array of points into the one that is there. */
  #put(data: any, kind: string, name: string, values: ArrayLike<number> | undefined, numberOfComponents: number) {
    const there = data[`get${kind}`]();
    if (!values && there) data.removeArray(name);
    else if (there) there.setData(values, numberOfComponents);
    else if (values) data[`set${kind}`](this.#vtk.vtkDataArray.newInstance({ name, values, numberOfComponents }));
  }
}

/** Triangles as vtk.js has cells: each with the number of its points. */
function cellsOf(indices: Uint32Array): Uint32Array {
  const cells = new Uint32Array((indices.length / 3) * 4);
  for (let from = 0, to = 0; from < indices.length; from += 3, to += 4) {
    cells[to] = 3;
    cells.set(indices.subarray(from, from + 3), to + 1);
  }
  return cells;
}
