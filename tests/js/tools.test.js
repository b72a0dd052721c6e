// The tools for meshes of the built package on a mesh with linear fields, whose values anywhere are known.
import assert from "node:assert/strict";
import { test } from "node:test";
import { build } from "../../pkg/build.js";
import { MultiTessellation, absolute } from "../../pkg/index.js";

/** The corners of a cube far from the origin, and the six tetrahedra around a diagonal of it. */
const ORIGIN = [600_000, 0, 0];
const corners = [0, 1, 2, 3, 4, 5, 6, 7].map((v) => ORIGIN.map((x, axis) => x + ((v >> axis) & 1)));
const tets = [
  [0, 1, 3, 7],
  [0, 3, 2, 7],
  [0, 2, 6, 7],
  [0, 6, 4, 7],
  [0, 4, 5, 7],
  [0, 5, 1, 7],
];
const linear = (/** @type {ArrayLike<number>} */ { 0: x, 1: y, 2: z }) => x - ORIGIN[0] + 2 * y + 3 * z;
const time = (/** @type {ArrayLike<number>} */ { 0: x, 1: y, 2: z }) => 1.7e9 + 5 * (x - ORIGIN[0]) - y + 2 * z;

/** The mesh as VTK's XML has it. */
function vtu() {
  const array = (type, name, numbers, more = "") => `<DataArray type="${type}" Name="${name}" format="ascii" ${more}>${numbers.join(" ")}</DataArray>`;
  return `<?xml version="1.0"?><VTKFile type="UnstructuredGrid" version="1.0"><UnstructuredGrid>
    <Piece NumberOfPoints="8" NumberOfCells="6">
    <PointData>${array("Float64", "p", corners.map(linear))}${array("Float64", "t", corners.map(time))}</PointData>
    <Points>${array("Float64", "Points", corners.flat(), 'NumberOfComponents="3"')}</Points>
    <Cells>${array("Int64", "connectivity", tets.flat())}${array(
      "Int64",
      "offsets",
      tets.map((_, i) => 4 * i + 4),
    )}${array(
      "UInt8",
      "types",
      tets.map(() => 10),
    )}</Cells>
    </Piece></UnstructuredGrid></VTKFile>`;
}

test("fields on surfaces are those of the mesh, each stored in its own way", async () => {
  const { bytes } = await build(new File([vtu()], "cube.vtu"), { allFields: true, units: { t: "s" }, positionBits: 30, fieldBits: 24 });
  for (const worker of [true, false]) {
    const mt = await MultiTessellation.open(bytes, { worker });
    await mt.refine({ error: 0 });
    const stored = mt.info.fields.map(({ unit, offset, scale }, index) => [index, unit, offset, scale]);
    assert.deepEqual(stored[0], [0, "", 0, 1]);
    assert.ok(stored[1][1] === "s" && Math.abs(Number(stored[1][2]) - 1.7e9) < 10, `times are relative to ${stored[1][2]}`);
    const surfaces = {
      isosurface: await mt.isosurface([1.5, 4], { fields: true }),
      slice: await mt.slice([1, 1, 0], ORIGIN[0] + 0.7, { fields: ["p", 1] }),
      boundary: await mt.surface({ fields: true }),
    };
    for (const [name, surface] of Object.entries(surfaces)) {
      assert.ok(surface.indices.length > 0, name);
      assert.deepEqual(
        surface.fields.map(({ index, unit, offset, scale }) => [index, unit, offset, scale]),
        stored,
        name,
      );
      const {
        positions,
        fields: [p, t],
      } = absolute(surface);
      assert.ok(p.values instanceof Float32Array && t.values instanceof Float64Array, name);
      for (let i = 0; i < p.values.length; i++) {
        const point = positions.subarray(3 * i, 3 * i + 3);
        assert.ok(Math.abs(p.values[i] - linear(point)) < 3e-6, `${name}: ${p.values[i]} at ${point}`);
        assert.ok(Math.abs(t.values[i] - time(point)) < 1e-3, `${name}: ${t.values[i]} at ${point}`);
      }
    }
    const {
      fields: [only, ...none],
    } = await mt.surface({ fields: ["t"] });
    assert.deepEqual([only.name, none.length], ["t", 0]);
    assert.deepEqual((await mt.isosurface(1.5)).fields, []);
    await assert.rejects(async () => mt.surface({ fields: ["q"] }), { code: "bad-option", message: /`fields`.* p, t; not q/ });
    mt.free();
  }
});
