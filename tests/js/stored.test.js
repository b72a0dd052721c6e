// Arrays of single precision that are relative to an origin, and what libraries of graphics get of them.
import assert from "node:assert/strict";
import { test } from "node:test";
import { applyChanges, emptyMesh } from "../../pkg/changes.js";
import { absolute, displaced, fieldsOf, withFields } from "../../pkg/stored.js";

// By their addresses: the declarations beside them name types of libraries that are not here.
const adapter = (name) => import(new URL(`../../pkg/${name}.js`, import.meta.url).href);
const [{ createSurface: createThreeSurface }, { createSurface: createVtkSurface }] = await Promise.all(["three", "vtk"].map(adapter));

/** @type {import("../../pkg/index.js").Stored} */
const FAR = { origin: [600_000, 5_800_000.25, 0], offset: 1.7e9, scale: 2 };
/** @type {import("../../pkg/index.js").Stored} */
const NEAR = { origin: [0, 0, 0], offset: 0, scale: 1 };
const triangle = {
  positions: Float32Array.of(0.1, 0.2, 0.3, 1, 0, 0, 0, 1, 0),
  normals: Float32Array.of(0, 0, 1, 0, 0, 1, 0, 0, 1),
  values: Float32Array.of(-1, 0.5, 2),
  indices: Uint32Array.of(0, 1, 2),
};
const places = [...triangle.positions].map((x, i) => FAR.origin[i % 3] + x);
const values = [...triangle.values].map((v) => FAR.offset + FAR.scale * v);

test("absolute numbers are copies in double precision only where they must be", () => {
  const near = absolute({ ...triangle, ...NEAR });
  assert.equal(near.positions, triangle.positions);
  assert.equal(near.values, triangle.values);
  const far = absolute({ ...triangle, ...FAR });
  assert.ok(far.positions instanceof Float64Array && far.values instanceof Float64Array);
  assert.deepEqual([...far.positions], places);
  assert.deepEqual([...far.values], values);
  assert.equal("values" in absolute({ positions: triangle.positions, ...NEAR }), false);
  assert.deepEqual([far.origin, far.offset, far.scale], [NEAR.origin, NEAR.offset, NEAR.scale]);
  assert.equal(far.indices, triangle.indices);
  const { field } = absolute({ positions: triangle.positions, field: triangle.values, ...FAR });
  assert.deepEqual([...field], values);
});

test("fields are stored each in its own way, and absolute again", () => {
  const own = (name, offset, scale) => ({ name, unit: "", time: undefined, vector: undefined, offset, scale, min: 0, max: 1 });
  const info = /** @type {any} */ ({ fields: [own("p", 0, 1), own("t", FAR.offset, FAR.scale), own("p", 0, 1)] });
  const numbersOf = (wanted) => fieldsOf(() => info, wanted).map(({ index }) => index);
  assert.deepEqual([undefined, false, true, [], ["t", "p", 2]].map(numbersOf), [[], [], [0, 1, 2], [], [1, 0, 2]]);
  for (const wrong of [["q"], [3], ["p", null], "p", 1]) {
    assert.throws(() => fieldsOf(() => info, /** @type {any} */ (wrong)), { code: "bad-option", message: /`fields`/ });
  }

  const wanted = fieldsOf(() => info, ["t", "p"]);
  const stored = withFields(
    { ...triangle, ...NEAR },
    wanted,
    [values, triangle.values].map((numbers) => Float64Array.from(numbers)),
  );
  assert.deepEqual(
    stored.fields.map(({ index, name }) => [index, name]),
    [
      [1, "t"],
      [0, "p"],
    ],
  );
  for (const field of stored.fields) assert.deepEqual(field.values, triangle.values);
  const [t, p] = absolute(stored).fields;
  assert.deepEqual([[...t.values], t.offset, t.scale], [values, 0, 1]);
  assert.equal(p.values, stored.fields[1].values);
});

test("meshes that are kept up know what they are relative to", () => {
  const none = new Uint32Array();
  const delta = {
    ...FAR,
    vertexCount: 1,
    tetCount: 0,
    positions: Float32Array.of(1, 2, 3),
    field: Float32Array.of(4),
    tets: none,
    neighbors: none,
    changes: { from: 0, to: 1, vertices: Uint32Array.of(0, 1), tets: none },
  };
  const empty = emptyMesh();
  assert.deepEqual([empty.origin, empty.offset, empty.scale], [[0, 0, 0], 0, 1]);
  const { origin, offset, scale, fields } = applyChanges({ ...empty, fields: [/** @type {any} */ ({})] }, delta);
  assert.deepEqual({ origin, offset, scale, fields }, { ...FAR, fields: [] });
});

/** As much of three.js as an adapter takes. */
class BufferGeometry {
  attributes = {};
  index = null;
  getAttribute = (name) => this.attributes[name];
  hasAttribute = (name) => name in this.attributes;
  setAttribute = (name, attribute) => (this.attributes[name] = attribute);
  deleteAttribute = (name) => delete this.attributes[name];
  setIndex = (attribute) => (this.index = attribute);
  setDrawRange() {}
  dispose() {}
}
class BufferAttribute {
  constructor(array, size) {
    Object.assign(this, { array, size });
  }
  setUsage() {}
  clearUpdateRanges() {}
  addUpdateRange() {}
}
class Box3 {
  setFromArray() {}
  getBoundingSphere() {}
}
const three = { BufferGeometry, BufferAttribute, Box3, Sphere: class {} };

test("three.js gets positions relative to an origin, and colours of absolute values", async () => {
  const volume = { isosurface: async () => ({ ...triangle, ...FAR }) };
  const seen = [];
  const color = (value) => {
    seen.push(value);
    return [0, 0, 0];
  };
  const surface = await createThreeSurface(/** @type {any} */ (volume), { isosurface: 1 }, { three: /** @type {any} */ (three), color });
  assert.deepEqual([surface.origin, surface.offset, surface.scale], [FAR.origin, FAR.offset, FAR.scale]);
  assert.deepEqual([...surface.geometry.getAttribute("position").array], [...triangle.positions]);
  assert.deepEqual(seen, values);
});

/** Fields of the triangle as surfaces have them. */
const beside = [
  { index: 1, name: "p", offset: 100, scale: 2, values: Float32Array.of(1, 2, 3) },
  { index: 2, name: "q", offset: 0, scale: 1, values: Float32Array.of(4, 5, 6) },
];

test("three.js gets an attribute for each field that is asked for, and none of one that no longer is", async () => {
  const asked = [];
  const volume = {
    surface: async (how) => {
      asked.push(how);
      return { ...triangle, ...FAR, fields: beside.slice(0, how.fields?.length ?? 0) };
    },
  };
  const surface = await createThreeSurface(/** @type {any} */ (volume), { boundary: true, fields: ["p", "q"] }, { three: /** @type {any} */ (three) });
  // Arrays that take the place of others have room for more.
  const values = (name) => surface.geometry.hasAttribute(name) && [...surface.geometry.getAttribute(name).array.subarray(0, 3)];
  assert.deepEqual(
    surface.fields.map(({ name, attribute, offset, scale }) => [name, attribute, offset, scale]),
    [
      ["p", "field0", 100, 2],
      ["q", "field1", 0, 1],
    ],
  );
  assert.deepEqual(
    [values("field0"), values("field1")],
    [
      [1, 2, 3],
      [4, 5, 6],
    ],
  );
  await surface.update({ boundary: true, fields: ["p"] });
  assert.deepEqual([values("field0"), values("field1")], [[1, 2, 3], false]);
  await surface.update({ boundary: true });
  assert.deepEqual([surface.fields, values("field0")], [[], false]);
  assert.deepEqual(asked, [{ fields: ["p", "q"] }, { fields: ["p"] }, {}]);
});

test("vtk.js gets an array for each field that is asked for, in absolute numbers", async () => {
  const arrays = new Map();
  const newInstance = ({ name, values }) => ({ getName: () => name, getData: () => values, setData: (next) => (values = next) });
  const scalars = newInstance({ name: "field", values: [] });
  const data = {
    getScalars: () => scalars,
    getNormals: () => scalars,
    getArrayByName: (name) => arrays.get(name) ?? null,
    addArray: (array) => arrays.set(array.getName(), array),
    removeArray: (name) => arrays.delete(name),
  };
  const put = { setData() {} };
  const polyData = { getPoints: () => put, getPolys: () => put, getPointData: () => data, modified() {} };
  const vtk = { vtkPolyData: { newInstance: () => polyData }, vtkDataArray: { newInstance } };
  const volume = { slice: async (_normal, _offset, how) => ({ ...triangle, ...FAR, fields: beside.slice(0, how.fields?.length ?? 0) }) };
  const slice = { normal: [0, 0, 1], offset: 0 };
  const surface = await createVtkSurface(/** @type {any} */ (volume), { slice, fields: ["p", "q"] }, { vtk });
  const found = () => Object.fromEntries([...arrays].map(([name, array]) => [name, [...array.getData()]]));
  assert.deepEqual(found(), { p: [102, 104, 106], q: [4, 5, 6] });
  await surface.update({ slice, fields: ["p"] });
  assert.deepEqual(found(), { p: [102, 104, 106] });
  await surface.update({ slice });
  assert.deepEqual(found(), {});
  const named = createVtkSurface(/** @type {any} */ (volume), { slice, fields: ["p"] }, { vtk, name: "p" });
  await assert.rejects(named, { code: "bad-option", message: /a field p; give the scalars another name/ });
});

test("vtk.js gets absolute numbers in double precision", async () => {
  const given = {};
  const put = (name) => ({ setData: (array) => (given[name] = array) });
  const data = { getScalars: () => put("values"), getNormals: () => put("normals") };
  const polyData = { getPoints: () => put("points"), getPolys: () => put("cells"), getPointData: () => data, modified() {} };
  const vtk = { vtkPolyData: { newInstance: () => polyData }, vtkDataArray: { newInstance: () => ({}) } };
  const volume = { isosurface: async () => ({ ...triangle, ...FAR }) };
  await createVtkSurface(/** @type {any} */ (volume), { isosurface: 1 }, { vtk });
  assert.deepEqual([...given.points], places);
  assert.deepEqual([...given.values], values);
  assert.equal(given.normals, triangle.normals);
});

test("a surface is displaced by three of its fields, in absolute numbers", () => {
  const own = (name, index) => ({ index, name, unit: "", time: undefined, vector: undefined, offset: 0, scale: 1 });
  const ways = [Float64Array.of(1, 2, 3), Float64Array.of(0, 0, 1), Float64Array.of(-1, 0, 0)];
  const stored = withFields({ ...triangle, ...FAR }, ["x", "y", "z"].map(own), ways);
  const known = (times) => places.map((x, i) => x + times * ways[i % 3][Math.floor(i / 3)]);
  const moved = displaced(stored, ["x", "y", "z"], -2);
  assert.deepEqual([...moved.positions], known(-2));
  assert.deepEqual([moved.origin, moved.indices, "normals" in moved], [[0, 0, 0], triangle.indices, false]);
  assert.deepEqual([...displaced(stored, [0, 1, 2], 0.5).positions], known(0.5));
  for (const wrong of [
    ["x", "y"],
    ["x", "y", "w"],
    [0, 1, 3],
    ["x", "y", "z", "x"],
  ]) {
    assert.throws(() => displaced(stored, wrong, 1), { code: "bad-option" });
  }
});
