// The tools of the built package on a mesh with linear fields, whose values anywhere are known.
import assert from "node:assert/strict";
import { readFile } from "node:fs/promises";
import { test } from "node:test";
import { arraysIn } from "../../pkg/changes.js";
import { absolute } from "../../pkg/stored.js";
import initTools, { MeshTools } from "../../pkg/tetralod_tools.js";
import { copyToolMethods } from "../../pkg/tools.js";

const { memory } = await initTools({ module_or_path: await readFile(new URL("../../pkg/tetralod_tools_bg.wasm", import.meta.url)) });

/** The corners of a cube far from the origin, and the six tetrahedra around a diagonal of it. */
const ORIGIN = [600_000, 0, 0];
const corners = [0, 1, 2, 3, 4, 5, 6, 7].map((v) => ORIGIN.map((x, axis) => x + ((v >> axis) & 1)));
const tets = [[0, 1, 3, 7], [0, 3, 2, 7], [0, 2, 6, 7], [0, 6, 4, 7], [0, 4, 5, 7], [0, 5, 1, 7]];
const linear = ([x, y, z]) => x - ORIGIN[0] + 2 * y + 3 * z;
const time = ([x, y, z]) => 1.7e9 + 5 * (x - ORIGIN[0]) - y + 2 * z;
const plain = { unit: "", time: undefined, vector: undefined, offset: 0, scale: 1 };
const fields = [{ ...plain, name: "p" }, { ...plain, name: "t", unit: "s", offset: 1.7e9, scale: 2 }];
const functions = [linear, time];

/** Of each face the tetrahedron behind it. */
const neighbors = tets.flatMap((tet, t) =>
  tet.map((apex) => {
    const face = tet.filter((v) => v !== apex);
    const behind = tets.findIndex((other, o) => o !== t && face.every((v) => other.includes(v)));
    return behind < 0 ? 0xffffffff : behind;
  }),
);

/** The calls of a session with this mesh. */
function calls() {
  const tools = new MeshTools();
  tools.setStored(Float64Array.of(...ORIGIN, 0, 1));
  const places = Uint32Array.from(tools.change(8, 6, Uint32Array.of(0, 8), Uint32Array.of(0, 6)));
  const arrays = { positions: corners.flat(), field: corners.map(linear), tets: tets.flat(), neighbors };
  const kept = arraysIn(memory.buffer, places, 0b1111, Float64Array);
  for (const [name, numbers] of Object.entries(arrays)) kept[name].set(numbers);
  const session = { info: () => ({ fields }), values: (index) => Float64Array.from(corners, functions[index]) };
  return copyToolMethods(() => session, async (use) => use(tools));
}

test("fields on surfaces are those of the mesh, each stored in its own way", async () => {
  const on = calls();
  const surfaces = {
    isosurface: await on.isosurface(Float64Array.of(1.5, 4), false, true),
    slice: await on.slice(Float64Array.of(1, 1, 0), ORIGIN[0] + 0.7, ["p", 1]),
    boundary: await on.surface(true),
  };
  for (const [name, surface] of Object.entries(surfaces)) {
    assert.ok(surface.indices.length > 0, name);
    assert.deepEqual(surface.fields.map(({ index, unit, offset, scale }) => [index, unit, offset, scale]), [[0, "", 0, 1], [1, "s", 1.7e9, 2]], name);
    const { positions, fields: [p, t] } = absolute(surface);
    assert.ok(p.values instanceof Float32Array && t.values instanceof Float64Array, name);
    for (let i = 0; i < p.values.length; i++) {
      const point = positions.subarray(3 * i, 3 * i + 3);
      assert.ok(Math.abs(p.values[i] - linear(point)) < 1e-6, `${name}: ${p.values[i]} at ${point}`);
      assert.ok(Math.abs(t.values[i] - time(point)) < 1e-3, `${name}: ${t.values[i]} at ${point}`);
    }
  }
  const { fields: [only, ...none] } = await on.surface(["t"]);
  assert.deepEqual([only.name, none.length], ["t", 0]);
  assert.deepEqual((await on.isosurface(Float64Array.of(1.5), false)).fields, []);
  await assert.rejects(async () => on.surface(["q"]), { code: "bad-option", message: /`fields`.* p, t; not q/ });
});
