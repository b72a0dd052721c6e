// The files that the demo page saves, read back.
import assert from "node:assert/strict";
import { test } from "node:test";
import { absolute } from "../../pkg/stored.js";
import { coloursOf, csv, glb, ply, stl, vtk, vtu } from "../../www/writers.js";

/** @type {Omit<import("../../www/writers.js").Field, "index" | "values">} */
const scalar = { name: "the density", unit: "", time: undefined, vector: undefined };
const fieldsOf = (count, ...all) =>
  all.map((one, index) => ({ ...scalar, ...one, index, offset: 0, scale: 1, values: Float32Array.from({ length: count }, (_, i) => index + i / 4) }));
const plainly = { origin: [0, 0, 0], offset: 0, scale: 1 };
const mesh = {
  ...plainly,
  positions: Float32Array.of(0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 1, 1, 1),
  fields: fieldsOf(5, {}),
  tets: Uint32Array.of(0, 1, 2, 3, 1, 2, 3, 4),
};
const surface = {
  ...plainly,
  positions: mesh.positions.slice(0, 12),
  indices: Uint32Array.of(0, 1, 2, 0, 3, 1),
  values: Float32Array.of(1, 2, 3, 4),
  fields: fieldsOf(4, {}),
  normals: Float32Array.of(0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 1, 0),
};
const part = (name, component, time) => ({ name: component === undefined ? `|${name}|` : `${name}_${"xyz"[component]}`, vector: { name, component }, time });
/** A vector between scalars, its length, two time steps, and names that formats do not take. */
const many = (count) =>
  fieldsOf(
    count,
    { name: "x" },
    part("u", 0),
    part("u", 1),
    part("u", 2),
    part("u"),
    { name: "T", time: 0.5 },
    { name: "T", time: 2 },
    { name: "a<b" },
    { name: "a>b" },
  );

/** The parts of a file as bytes. */
const bytesOf = async (parts) => Buffer.from(await new Blob(parts).arrayBuffer());

/** Numbers of four bytes from `at` on. */
const read = (bytes, at, count, how) => Array.from({ length: count }, (_, i) => bytes[`read${how}`](at + 4 * i));

/** The arrays of a VTU file. */
function arraysOf(bytes) {
  const text = bytes.toString("latin1");
  const start = text.indexOf('encoding="raw">_') + 'encoding="raw">_'.length;
  const array = (name) => {
    const offset = Number(new RegExp(`Name="${name}"[^>]* offset="(\\d+)"`).exec(text)?.[1]);
    const length = Number(bytes.readBigUInt64LE(start + offset));
    return bytes.subarray(start + offset + 8, start + offset + 8 + length);
  };
  return { text, array };
}

test("VTU: appended arrays are where the offsets say", async () => {
  const { text, array } = arraysOf(await bytesOf(vtu(mesh, 0)));
  assert.match(text, /NumberOfPoints="5" NumberOfCells="2"/);
  assert.match(text, /<PointData Scalars="the density">/);
  assert.deepEqual(read(array("the density"), 0, 5, "FloatLE"), [...mesh.fields[0].values]);
  assert.deepEqual(read(array("Points"), 0, 15, "FloatLE"), [...mesh.positions]);
  assert.deepEqual(read(array("connectivity"), 0, 8, "UInt32LE"), [...mesh.tets]);
  assert.deepEqual(read(array("offsets"), 0, 2, "UInt32LE"), [4, 8]);
  assert.deepEqual([...array("types")], [10, 10]);
  assert.ok(text.endsWith("</AppendedData></VTKFile>\n"));
});

test("VTU: units and the time of all fields are told as VTK does", async () => {
  const of = async (...fields) => (await bytesOf(vtu({ ...mesh, fields: fieldsOf(5, ...fields) }, 0))).toString("latin1");
  const both = await of({ name: "p", unit: "kg/(m<s>)", time: 0.25 }, { name: "q", time: 0.25 });
  assert.match(both, /Name="p"[^>]*><InformationKey name="UNITS_LABEL" location="vtkDataArray">kg\/\(m&#60;s&#62;\)<\/InformationKey><\/DataArray>/);
  assert.match(both, /Name="q"[^>]*\/>/);
  assert.match(both, /<FieldData><DataArray type="Float64" Name="TimeValue" NumberOfTuples="1" format="ascii">0.25<\/DataArray><\/FieldData>/);
  assert.doesNotMatch(await of({ name: "p", time: 0.25 }, { name: "p", time: 0.5 }), /TimeValue/);
  assert.doesNotMatch(await of({ name: "p" }), /TimeValue|UNITS/);
});

test("legacy VTK: numbers have the highest byte first", async () => {
  const bytes = await bytesOf(vtk(mesh, 0));
  const after = (line) => {
    const at = bytes.indexOf(line);
    assert.ok(at > 0, line);
    return at + line.length;
  };
  assert.deepEqual(read(bytes, after("POINTS 5 float\n"), 15, "FloatBE"), [...mesh.positions]);
  assert.deepEqual(read(bytes, after("CELLS 2 10\n"), 10, "UInt32BE"), [4, 0, 1, 2, 3, 4, 1, 2, 3, 4]);
  assert.deepEqual(read(bytes, after("CELL_TYPES 2\n"), 2, "UInt32BE"), [10, 10]);
  assert.deepEqual(read(bytes, after("SCALARS the_density float 1\nLOOKUP_TABLE default\n"), 5, "FloatBE"), [...mesh.fields[0].values]);
  assert.equal(bytes.indexOf("FIELD"), -1);
});

test("meshes are saved with all fields: components as vectors, times in the names", async () => {
  const fields = many(5);
  const all = { ...mesh, fields };
  const values = (index) => [...fields[index].values];
  const vector = values(1).flatMap((x, i) => [x, values(2)[i], values(3)[i]]);
  // The number of the field that is shown: a scalar, and one that is part of a vector.
  const { text, array } = arraysOf(await bytesOf(vtu(all, 7)));
  assert.match(text, /<PointData Scalars="a&#60;b">/);
  const names = [...text.slice(0, text.indexOf("</PointData>")).matchAll(/Name="([^"]*)" NumberOfComponents="(\d)"/g)].map(([, ...found]) => found);
  assert.deepEqual(names, [
    ["x", "1"],
    ["u", "3"],
    ["T@0.5", "1"],
    ["T@2.0", "1"],
    ["a&#60;b", "1"],
    ["a&#62;b", "1"],
  ]);
  assert.deepEqual(read(array("u"), 0, 15, "FloatLE"), vector);
  for (const [name, index] of /** @type {[string, number][]} */ ([
    ["x", 0],
    ["T@0.5", 5],
    ["T@2.0", 6],
    ["a&#60;b", 7],
    ["a&#62;b", 8],
  ])) {
    assert.deepEqual(read(array(name), 0, 5, "FloatLE"), values(index), name);
  }
  assert.doesNotMatch(arraysOf(await bytesOf(vtu(all, 2))).text, /Scalars/);

  const bytes = await bytesOf(vtk(all, 7));
  const heads = [...bytes.toString("latin1").matchAll(/^(?:SCALARS (\w+) float (\d)\nLOOKUP_TABLE default|(\w+) (\d) 5 float|FIELD .*)\n/gm)];
  assert.deepEqual(
    heads.map(([whole, ...found]) => found.filter(Boolean).join(" ") || whole),
    ["a_b 1", "FIELD FieldData 5\n", "x 1", "u 3", "T_0_5 1", "T_2_0 1", "a_b_1 1"],
  );
  const data = heads.map(({ 0: head, index }) => read(bytes, index + head.length, head.startsWith("u ") ? 15 : 5, "FloatBE"));
  assert.deepEqual([data[0], ...data.slice(2)], [values(7), values(0), vector, values(5), values(6), values(8)]);
});

test("components of which one is missing, or that are named otherwise, stay scalars", async () => {
  const namesOf = async (...fields) =>
    [...arraysOf(await bytesOf(vtu({ ...mesh, fields: fieldsOf(5, ...fields) }, 0))).text.matchAll(/Name="([^"]*)"/g)].map(([, name]) => name).slice(0, -4);
  assert.deepEqual(await namesOf(part("u", 0), part("u", 2), part("u")), ["u_x", "u_z", "|u|"]);
  assert.deepEqual(await namesOf({ ...part("u", 0), name: "ux" }, { ...part("u", 1), name: "uy" }), ["ux", "uy"]);
  assert.deepEqual(await namesOf(part("u", 0, 1), part("u", 1, 1), part("u", 0, 2), part("u", 1, 2)), ["u@1.0", "u@2.0"]);
  const six = ["xx", "yy", "zz", "xy", "yz", "xz"].map((name, component) => ({ name: `s_${name}`, vector: { name: "s", component } }));
  assert.deepEqual(await namesOf(...six), ["s"]);
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
  assert.deepEqual(read(bytes, end, 7, "FloatLE"), [0, 0, 0, 0, 0, 1, 0]);
  const faces = end + 4 * 7 * 4;
  assert.equal(bytes[faces + 13], 3);
  assert.deepEqual(read(bytes, faces + 14, 3, "UInt32LE"), [0, 3, 1]);
  assert.equal(bytes.length, faces + 2 * 13);
});

test("PLY: all fields, with names that no other property has", async () => {
  const fields = many(4);
  const bytes = await bytesOf(ply({ ...surface, fields }));
  const end = bytes.indexOf("end_header\n") + "end_header\n".length;
  const properties = [
    ...bytes
      .subarray(0, end)
      .toString()
      .matchAll(/property float (\w+)/g),
  ].map(([, name]) => name);
  assert.deepEqual(properties, ["x", "y", "z", "nx", "ny", "nz", "x_1", "u_x", "u_y", "u_z", "_u_", "T_0_5", "T_2_0", "a_b", "a_b_1"]);
  const last = read(bytes, end + 3 * 4 * properties.length, properties.length, "FloatLE");
  assert.deepEqual(
    last.slice(6),
    fields.map(({ values }) => values[3]),
  );
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
  const colours = coloursOf(Float64Array.of(-7, 1, 10, 100, 401), legend);
  const near = (found, wanted) =>
    assert.ok(
      wanted.every((x, i) => Math.abs(found[i] - x) < 1e-5),
      `${found}: ${wanted}`,
    );
  near(colours, [0, 0, 0, 0, 0, 0, 1, 0.215861, 0, 1, 1, 1, 1, 1, 1]);
  // Half of the way in sRGB is a fifth of the light.
  near(coloursOf(Float32Array.of(0.5), { ...legend, range: [0, 1], log: false, colours: ["#000000", "#ffffff"] }), [0.214041, 0.214041, 0.214041]);
  // Labels have colours of their own, and none between.
  const labels = [
    { value: -3, colour: "#ff0000" },
    { value: 9, colour: "#0000ff" },
  ];
  near(coloursOf(Float32Array.of(9, -3), { ...legend, labels }), [0, 0, 1, 1, 0, 0]);
  const bytes = await bytesOf(glb({ ...surface, colours: colours.subarray(0, 12) }));
  const { meshes, accessors } = JSON.parse(bytes.toString("utf8", 20, 20 + bytes.readUInt32LE(12)));
  const { type, componentType, count } = accessors[meshes[0].primitives[0].attributes.COLOR_0];
  assert.deepEqual([type, componentType, count], ["VEC3", 5126, 4]);
});

test("CSV: words with commas are in quotes, missing numbers are empty", async () => {
  assert.equal(
    (
      await bytesOf(
        csv([
          ["a,b", 'c"d'],
          [1.5, undefined],
        ]),
      )
    ).toString(),
    '"a,b","c""d"\n1.5,\n',
  );
});

test("what is relative to an origin is saved in absolute numbers of double precision, or the origin with it", async () => {
  /** @type {import("../../pkg/index.js").Stored} */
  const stored = { origin: [600_000, 5_800_000.25, 0], offset: 1.7e9, scale: 1 };
  const far = absolute({ ...mesh, ...stored, fields: mesh.fields.map((field) => ({ ...field, name: "t", offset: stored.offset })) });
  const places = [...mesh.positions].map((x, i) => stored.origin[i % 3] + x);
  const values = [...mesh.fields[0].values].map((v) => stored.offset + v);
  const doubles = (bytes, at, count, how) => Array.from({ length: count }, (_, i) => bytes[`readDouble${how}`](at + 8 * i));

  const grid = await bytesOf(vtu(far, 0));
  const text = grid.toString("latin1");
  assert.match(text, /type="Float64" Name="t"/);
  assert.match(text, /type="Float64" Name="Points"/);
  const start = text.indexOf('encoding="raw">_') + 'encoding="raw">_'.length + 8;
  assert.deepEqual(doubles(grid, start, 5, "LE"), values);
  assert.deepEqual(doubles(grid, start + 5 * 8 + 8, 15, "LE"), places);

  const legacy = await bytesOf(vtk(far, 0));
  const head = "POINTS 5 double\n";
  assert.deepEqual(doubles(legacy, legacy.indexOf(head) + head.length, 15, "BE"), places);
  const lookup = "SCALARS t double 1\nLOOKUP_TABLE default\n";
  assert.deepEqual(doubles(legacy, legacy.indexOf(lookup) + lookup.length, 5, "BE"), values);

  const farSurface = { ...surface, ...stored, fields: surface.fields.map((field) => ({ ...field, offset: stored.offset })) };
  const polygons = await bytesOf(ply(absolute(farSurface)));
  const end = "end_header\n";
  const body = polygons.indexOf(end) + end.length;
  assert.match(polygons.toString("latin1"), /property double x\n[\s\S]*property float nx\n[\s\S]*property double the_density\n/);
  assert.deepEqual(doubles(polygons, body + 44, 3, "LE"), places.slice(3, 6));
  assert.deepEqual(doubles(polygons, body + 36, 1, "LE"), [stored.offset]);

  const triangles = await bytesOf(stl(farSurface));
  assert.match(triangles.toString("latin1", 0, 80), /relative to 600000 5800000.25 0/);
  assert.deepEqual(read(triangles, 84 + 12, 9, "FloatLE"), [0, 0, 0, 1, 0, 0, 0, 1, 0]);

  const bytes = await bytesOf(glb(farSurface));
  const json = JSON.parse(bytes.toString("utf8", 20, 20 + bytes.readUInt32LE(12)));
  assert.deepEqual(json.nodes, [{ mesh: 0, translation: stored.origin }]);
  assert.deepEqual(json.meshes[0].extras, { offset: stored.offset, scale: 1 });
});
