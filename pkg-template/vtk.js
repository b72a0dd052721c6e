/** Surfaces of a volume as a `vtkPolyData` of vtk.js, which is updated in place. */

import { TetralodError } from "./errors.js";
import { absolute } from "./stored.js";
import { Surface } from "./surfaces.js";
import { checkNames } from "./tools.js";

export async function createSurface(volume, what, options = {}) {
  checkNames(options, ["vtk", "name"]);
  const { vtk = await loaded(), name = "field" } = options;
  const surface = new VtkSurface(volume, what, vtk, name);
  await surface.update();
  return surface;
}

async function loaded() {
  const [polyData, dataArray] = await Promise.all([
    import("@kitware/vtk.js/Common/DataModel/PolyData.js"),
    import("@kitware/vtk.js/Common/Core/DataArray.js"),
  ]);
  return { vtkPolyData: polyData.default, vtkDataArray: dataArray.default };
}

class VtkSurface {
  #vtk;
  #name;
  #surface;
  /** The names of the fields that are there beside the scalars. */
  #fields = [];

  constructor(volume, what, vtk, name) {
    this.#vtk = vtk;
    this.#name = name;
    this.polyData = vtk.vtkPolyData.newInstance();
    this.#surface = new Surface(volume, what, (triangles) => this.#take(triangles));
  }

  async update(what) {
    await this.#surface.update(what);
    return this.polyData;
  }

  dispose() {
    this.#surface.dispose();
    this.polyData.delete();
  }

  [Symbol.dispose ?? Symbol.for("Symbol.dispose")]() {
    this.dispose();
  }

  #take(triangles) {
    const { polyData } = this;
    const { positions, indices, normals, values, fields = [] } = absolute(triangles);
    const taken = fields.find(({ name }) => [this.#name, "Normals"].includes(name));
    if (taken) throw new TetralodError("bad-option", `option \`name\`: there is a field ${taken.name}; give the scalars another name`);
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
  #put(data, kind, name, values, numberOfComponents) {
    const there = data[`get${kind}`]();
    if (!values && there) data.removeArray(name);
    else if (there) there.setData(values, numberOfComponents);
    else if (values) data[`set${kind}`](this.#vtk.vtkDataArray.newInstance({ name, values, numberOfComponents }));
  }
}

/** Triangles as vtk.js has cells: each with the number of its points. */
function cellsOf(indices) {
  const cells = new Uint32Array((indices.length / 3) * 4);
  for (let from = 0, to = 0; from < indices.length; from += 3, to += 4) {
    cells[to] = 3;
    cells.set(indices.subarray(from, from + 3), to + 1);
  }
  return cells;
}
