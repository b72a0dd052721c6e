// The files that the demo page saves, read back.
import assert from "node:assert/strict";
import { test } from "node:test";
import { coloursOf, csv, glb, ply, stl, vtk, vtu } from "../../www/writers.js";

const plainly = { origin: [0, 0, 0], offset: 0, scale: 1 };
const mesh = {
  ...plainly,
  positions: Float32Array.of(0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 1, 1, 1),
  field: Float32Array.of(0.5, -1.25, 2, 3, 4),
  tets: Uint32Array.of(0, 1, 2, 3, 1, 2, 3, 4),
};
const surface = {
  ...plainly,
  positions: mesh.positions.slice(0, 12),
  indices: Uint32Array.of(0, 1, 2, 0, 3, 1),
  values: Float32Array.of(1, 2, 3, 4),
  normals: Float32Array.of(0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 1, 0),
  name: "the density",
};

/** The parts of a file as bytes. */
const bytesOf = async (parts) => Buffer.from(await new Blob(parts).arrayBuffer());

/** Numbers of four bytes from `at` on. */
const read = (bytes, at, count, how) => Array.from({ length: count }, (_, i) => bytes[`read${how}`](at + 4 * i));

test("VTU: appended arrays are where the offsets say", async () => {
  const bytes = await bytesOf(vtu(mesh, "the density"));
  const text = bytes.toString("latin1");
  assert.match(text, /NumberOfPoints="5" NumberOfCells="2"/);
  const start = text.indexOf('encoding="raw">_') + 'encoding="raw">_'.length;
  const array = (name) => {
    const offset = Number(new RegExp(`Name="${name}"[^>]* offset="(\\d+)"`).exec(text)?.[1]);
    const length = Number(bytes.readBigUInt64LE(start + offset));
    return bytes.subarray(start + offset + 8, start + offset + 8 + length);
  };
  assert.deepEqual(read(array("the_density"), 0, 5, "FloatLE"), [...mesh.field]);
  assert.deepEqual(read(array("Points"), 0, 15, "FloatLE"), [...mesh.positions]);
  assert.deepEqual(read(array("connectivity"), 0, 8, "UInt32LE"), [...mesh.tets]);
  assert.deepEqual(read(array("offsets"), 0, 2, "UInt32LE"), [4, 8]);
  assert.deepEqual([...array("types")], [10, 10]);
  assert.ok(text.endsWith("</AppendedData></VTKFile>\n"));
});

test("legacy VTK: numbers have the highest byte first", async () => {
  const bytes = await bytesOf(vtk(mesh, "density"));
  const after = (line) => {
    const at = bytes.indexOf(line);
    assert.ok(at > 0, line);
    return at + line.length;
  };
  assert.deepEqual(read(bytes, after("POINTS 5 float\n"), 15, "FloatBE"), [...mesh.positions]);
  assert.deepEqual(read(bytes, after("CELLS 2 10\n"), 10, "UInt32BE"), [4, 0, 1, 2, 3, 4, 1, 2, 3, 4]);
  assert.deepEqual(read(bytes, after("CELL_TYPES 2\n"), 2, "UInt32BE"), [10, 10]);
  assert.deepEqual(read(bytes, after("LOOKUP_TABLE default\n"), 5, "FloatBE"), [...mesh.field]);
});

test("STL: each triangle has its normal and corners", async () => {
  const bytes = await bytesOf(stl(surface));
  assert.equal(bytes.length, 84 + 2 * 50);
  assert.equal(bytes.readUInt32LE(80), 2);
  assert.deepEqual(read(bytes, 84, 12, "FloatLE"), [0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0]);
  assert.deepEqual(read(bytes, 134, 3, "FloatLE"), [0, 1, 0]);
});

test("PLY: vertices with normals and values, and faces", async () => {
  const bytes = await bytesOf(ply(surface));
  const end = bytes.indexOf("end_header\n") + "end_header\n".length;
  const header = bytes.subarray(0, end).toString();
  assert.match(header, /element vertex 4\n.*property float nx\n.*property float the_density\nelement face 2\n/s);
  assert.deepEqual(read(bytes, end, 7, "FloatLE"), [0, 0, 0, 0, 0, 1, 1]);
  const faces = end + 4 * 7 * 4;
  assert.equal(bytes[faces + 13], 3);
  assert.deepEqual(read(bytes, faces + 14, 3, "UInt32LE"), [0, 3, 1]);
  assert.equal(bytes.length, faces + 2 * 13);
});

test("glTF: the chunks hold what the accessors name", async () => {
  const bytes = await bytesOf(glb(surface));
  assert.equal(bytes.toString("latin1", 0, 4), "glTF");
  assert.equal(bytes.readUInt32LE(8), bytes.length);
  const length = bytes.readUInt32LE(12);
  const json = JSON.parse(bytes.toString("utf8", 20, 20 + length));
  const start = 20 + length + 8;
  assert.equal(json.buffers[0].byteLength, bytes.length - start);
  const [{ attributes, indices }] = json.meshes[0].primitives;
  const at = (accessor) => start + json.bufferViews[json.accessors[accessor].bufferView].byteOffset;
  assert.deepEqual(read(bytes, at(indices), 6, "UInt32LE"), [...surface.indices]);
  assert.deepEqual(read(bytes, at(attributes.POSITION), 12, "FloatLE"), [...surface.positions]);
  assert.deepEqual(read(bytes, at(attributes.NORMAL), 12, "FloatLE"), [...surface.normals]);
  assert.deepEqual(read(bytes, at(attributes._VALUE), 4, "FloatLE"), [...surface.values]);
  assert.deepEqual(json.accessors[attributes.POSITION].max, [1, 1, 1]);
});

test("glTF: colours of vertices are linear light, on the scale of the legend", async () => {
  const legend = { range: /** @type {[number, number]} */ ([1, 100]), log: true, colours: ["#000000", "#ff8000", "#ffffff"] };
  const values = Float32Array.of(-4, 0, 4.5, 49.5, 200);
  // Values are 1 + 2 v: -7, 1, 10, 100, 401.
  const colours = coloursOf({ values, origin: [0, 0, 0], offset: 1, scale: 2 }, legend);
  const near = (found, wanted) => assert.ok(wanted.every((x, i) => Math.abs(found[i] - x) < 1e-5), `${found}: ${wanted}`);
  near(colours, [0, 0, 0, 0, 0, 0, 1, 0.215861, 0, 1, 1, 1, 1, 1, 1]);
  // Half of the way in sRGB is a fifth of the light.
  near(coloursOf({ values: Float32Array.of(0.5), origin: [0, 0, 0], offset: 0, scale: 1 }, { ...legend, range: [0, 1], log: false, colours: ["#000000", "#ffffff"] }), [0.214041, 0.214041, 0.214041]);
  const bytes = await bytesOf(glb({ ...surface, colours: colours.subarray(0, 12) }));
  const { meshes, accessors } = JSON.parse(bytes.toString("utf8", 20, 20 + bytes.readUInt32LE(12)));
  const { type, componentType, count } = accessors[meshes[0].primitives[0].attributes.COLOR_0];
  assert.deepEqual([type, componentType, count], ["VEC3", 5126, 4]);
});

test("CSV: words with commas are in quotes, missing numbers are empty", async () => {
  assert.equal((await bytesOf(csv([["a,b", 'c"d'], [1.5, undefined]]))).toString(), '"a,b","c""d"\n1.5,\n');
});

test("what is relative to an origin is saved in absolute numbers of double precision, or the origin with it", async () => {
  const stored = { origin: [600_000, 5_800_000.25, 0], offset: 1.7e9, scale: 1 };
  const far = { ...mesh, ...stored };
  const places = [...mesh.positions].map((x, i) => stored.origin[i % 3] + x);
  const values = [...mesh.field].map((v) => stored.offset + v);
  const doubles = (bytes, at, count, how) => Array.from({ length: count }, (_, i) => bytes[`readDouble${how}`](at + 8 * i));

  const grid = await bytesOf(vtu(far, "t"));
  const text = grid.toString("latin1");
  assert.match(text, /type="Float64" Name="t"/);
  assert.match(text, /type="Float64" Name="Points"/);
  const start = text.indexOf('encoding="raw">_') + 'encoding="raw">_'.length + 8;
  assert.deepEqual(doubles(grid, start, 5, "LE"), values);
  assert.deepEqual(doubles(grid, start + 5 * 8 + 8, 15, "LE"), places);

  const legacy = await bytesOf(vtk(far, "t"));
  const head = "POINTS 5 double\n";
  assert.deepEqual(doubles(legacy, legacy.indexOf(head) + head.length, 15, "BE"), places);
  const lookup = "SCALARS t double 1\nLOOKUP_TABLE default\n";
  assert.deepEqual(doubles(legacy, legacy.indexOf(lookup) + lookup.length, 5, "BE"), values);

  const farSurface = { ...surface, ...stored };
  const polygons = await bytesOf(ply(farSurface));
  const end = "end_header\n";
  const body = polygons.indexOf(end) + end.length;
  assert.match(polygons.toString("latin1"), /property double x\n[\s\S]*property float nx\n[\s\S]*property double the_density\n/);
  assert.deepEqual(doubles(polygons, body + 44, 3, "LE"), places.slice(3, 6));
  assert.deepEqual(doubles(polygons, body + 36, 1, "LE"), [stored.offset + 1]);

  const triangles = await bytesOf(stl(farSurface));
  assert.match(triangles.toString("latin1", 0, 80), /relative to 600000 5800000.25 0/);
  assert.deepEqual(read(triangles, 84 + 12, 9, "FloatLE"), [0, 0, 0, 1, 0, 0, 0, 1, 0]);

  const bytes = await bytesOf(glb(farSurface));
  const json = JSON.parse(bytes.toString("utf8", 20, 20 + bytes.readUInt32LE(12)));
  assert.deepEqual(json.nodes, [{ mesh: 0, translation: stored.origin }]);
  assert.deepEqual(json.meshes[0].extras, { offset: stored.offset, scale: 1 });
});
