// Building in wasm, in Node: the same bytes as the native program, and typed errors for everything that is wrong.
// TETRALOD_FIXTURE is the folder of what `cargo xtask test` makes.
import assert from "node:assert/strict";
import { execFile } from "node:child_process";
import { mkdir, mkdtemp, readFile, rm, symlink, writeFile } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, describe, test } from "node:test";
import { fileURLToPath, pathToFileURL } from "node:url";
import { promisify } from "node:util";
import { TetralodError, build, inspect } from "../../pkg/build.js";
import { MultiTessellation } from "../../pkg/index.js";
import { rejects } from "./rejects.js";

const folder = process.env.TETRALOD_FIXTURE;
assert.ok(folder, "TETRALOD_FIXTURE is not set: run `cargo xtask test js`");
const read = async (name) => new Uint8Array(await readFile(`${folder}/${name}`));
const file = async (name) => new File([await read(name)], name);
const cases = JSON.parse(await readFile(`${folder}/builds.json`, "utf8"));

/** Raw samples and the JSON beside them. */
const samples = async (name) => ({ raw: await file(`${name}.raw`), json: await file(`${name}.json`) });
/** Files under their names, which may have a folder. */
const named = (names) => Promise.all(names.map(async (name) => ({ name, data: await file(name) })));

/** All workers that were started and have not ended. */
const alive = new Set();
const threads = process.getBuiltinModule("node:worker_threads");
const { Worker } = threads;
threads.Worker = class extends Worker {
  constructor(...parameters) {
    super(.../** @type {[URL]} */ (parameters));
    alive.add(this);
    this.on("exit", () => alive.delete(this));
  }
};
after(() => {
  threads.Worker = Worker;
});

/** Resolves when no worker is left; the limit of time of the test is that of the wait. */
async function noneAlive() {
  while (alive.size > 0) await new Promise((resolve) => setTimeout(resolve, 10));
}

describe("the bytes are those of the native program", () => {
  assert.ok(cases.length >= 10);
  for (const { inputs, files, options, mt } of cases) {
    test(`${inputs} ${JSON.stringify(options)}`, async () => {
      const seen = [];
      const source = files.length === 1 ? await file(files[0]) : await named(files);
      const { bytes, report } = await build(source, { ...options, onProgress: (p) => seen.push(p) });
      assert.ok(Buffer.from(bytes).equals(await readFile(`${folder}/${mt}`)), "other bytes");
      assert.equal(report.fileBytes, bytes.length);
      assert.ok(report.memoryBytes > 1e6);
      // Of a few cells nothing goes, and nothing is put in order.
      const isFew = report.tetrahedra <= 20;
      if (!isFew) assert.ok(report.tetrahedra > report.baseTetrahedra && report.updates > 0);
      assert.ok(seen.every(({ fraction }, i) => fraction >= 0 && fraction <= 1 && (i === 0 || fraction >= seen[i - 1].fraction)));
      assert.equal(seen.at(-1).fraction, 1);
      const phases = [...new Set(seen.map(({ phase }) => phase))];
      const work = phases.find((phase) => ["remove", "collapse", "insert"].includes(phase));
      // A small edge-based MT is collapsed before the first look at its progress.
      if (!isFew) assert.deepEqual(phases, ["read", "parse", "repair", work, "order", "encode"].filter(Boolean));
      if (options.kind !== "edge")
        assert.ok(
          seen.some(({ tetrahedra }) => tetrahedra > 0),
          "tetrahedra are counted",
        );
    });
  }
});

test("what was built opens, and meshes of it are within their error", async () => {
  const { bytes, report } = await build(await file("fields.vtu"), { allFields: true });
  const mt = await MultiTessellation.open(bytes);
  assert.deepEqual(
    mt.info.fields.map(({ name }) => name),
    ["pressure", "speed"],
  );
  assert.equal(mt.info.tetrahedra, report.tetrahedra);
  const { stats } = await mt.refine({ error: "2%", field: "speed" });
  assert.ok(stats.satisfied && stats.relativeErrorBound <= 0.02);
  assert.ok(stats.tetrahedra < report.tetrahedra);
  mt.free();
});

test("what was repaired, and what was found and kept, is reported", async () => {
  const repair = async (options) => (await build(await file("blocks.vtk"), options)).report.repair;
  const open = await repair({});
  assert.deepEqual([open.level, open.components, open.openSeamFaces, open.kept], ["safe", 2, 0, "kept: 2 parts that share no face"]);
  const welded = await repair({ repair: "weld", weldDistance: 0.25 });
  assert.deepEqual([welded.weldedPoints, welded.differingValues, welded.components, welded.kept], [4, 4, 1, ""]);
  await rejects(repair({ repair: "weld", weldDistance: 1 }), "bad-mesh", /blocks\.vtk.*smaller distance/);
  await rejects(repair({ weldDistance: 1 }), "bad-option", /`weldDistance`.*"weld"/);
  await rejects(repair({ repair: "all" }), "bad-option", /`repair`.*"none", "safe", "weld"/);
});

test("what was left out of a file is reported", async () => {
  const text =
    "# vtk DataFile Version 3.0\nt\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 4 float\n0 0 0 1 0 0 0 1 0 0 0 1\nCELLS 2 9\n4 0 1 2 3\n3 0 1 2\nCELL_TYPES 2\n10\n5\nPOINT_DATA 4\nSCALARS v float 1\nLOOKUP_TABLE default\n1 2 3 4\n";
  const { report } = await build(new TextEncoder().encode(text));
  assert.deepEqual(report.notes, ["left out: 1 triangle"]);
  assert.deepEqual((await build(await file("tets.vtk"))).report.notes, []);
});

test("a request that names no field is of the first that tells something", async () => {
  const points = "POINTS 4 double\n0 0 0 1 0 0 0 1 0 0 0 1\nCELLS 1 5\n4 0 1 2 3\nCELL_TYPES 1\n10\n";
  const data = "POINT_DATA 4\nVECTORS u double\n0 1 2 3 4 5 6 7 8 9 10 11\nSCALARS p double 1\nLOOKUP_TABLE default\n20 21 22 23\n";
  const source = new TextEncoder().encode(`# vtk DataFile Version 3.0\nt\nASCII\nDATASET UNSTRUCTURED_GRID\n${points}${data}`);
  const { bytes } = await build(source, { allFields: true });
  const mt = await MultiTessellation.open(bytes);
  const { name, min, max } = mt.info.fields[mt.info.firstField];
  assert.deepEqual([name, min, max], ["p", 20, 23]);
  for (const request of [undefined, {}, { error: 0 }, { needs: [{ error: 0 }] }]) {
    const { field, scale, offset } = await mt.refine(request);
    assert.deepEqual(Array.from(field, (value) => Math.round(value * scale + offset)).sort(), [20, 21, 22, 23]);
  }
  mt.free();
});

test("labels at cells, and parts that do not touch, become regions", async () => {
  const corners = [0, 5].flatMap((x) => [`${x} 0 0`, `${x + 1} 0 0`, `${x} 1 0`, `${x} 0 1`]);
  const cells = "CELLS 2 10\n4 0 1 2 3\n4 4 5 6 7\nCELL_TYPES 2\n10\n10\n";
  const points = `POINTS 8 double\n${corners.join("\n")}\n`;
  const data = "CELL_DATA 2\nSCALARS part int 1\nLOOKUP_TABLE default\n8 -4\nPOINT_DATA 8\nSCALARS p double 1\nLOOKUP_TABLE default\n0 1 2 3 4 5 6 7\n";
  const source = new TextEncoder().encode(`# vtk DataFile Version 3.0\nt\nASCII\nDATASET UNSTRUCTURED_GRID\n${points}${cells}${data}`);
  for (const [preserve, names] of [
    [["part"], ["-4", "8"]],
    [["components"], ["1", "2"]],
  ]) {
    const { bytes } = await build(source.slice(), { preserve });
    const mt = await MultiTessellation.open(bytes);
    assert.deepEqual([mt.info.regions.arrays, mt.info.regions.all.map(({ name }) => name)], [preserve, names]);
    assert.deepEqual(
      mt.info.fields.map(({ name }) => name),
      ["p"],
    );
    mt.free();
  }
  await assert.rejects(build(source.slice(), { preserve: ["rotor"] }), { code: "bad-option", message: /rotor/ });
});

test("fields at cells keep their jump between regions, or get a mean across them", async () => {
  const points = "POINTS 5 double\n0 0 0 1 0 0 0 1 0 0 0 1 0 0 -3\nCELLS 2 10\n4 0 1 2 3\n4 0 2 1 4\nCELL_TYPES 2\n10\n10\n";
  const data = "CELL_DATA 2\nSCALARS part int 1\nLOOKUP_TABLE default\n7 9\nSCALARS m double 1\nLOOKUP_TABLE default\n8 4\n";
  const source = new TextEncoder().encode(`# vtk DataFile Version 3.0\nt\nASCII\nDATASET UNSTRUCTURED_GRID\n${points}${data}`);
  const options = { cellToPoint: true, preserve: ["part"], fields: ["m"] };
  /** The values at each place, and the largest difference that averaging has made. */
  const read = async (more) => {
    const { bytes, report } = await build(source.slice(), { ...options, ...more });
    const mt = await MultiTessellation.open(bytes);
    const { positions, field, scale, offset, tets, neighbors } = await mt.refine({ error: 0 });
    mt.free();
    const values = new Map();
    field.forEach((value, v) => {
      const place = Array.from(positions.slice(3 * v, 3 * v + 3), Math.round).join(" ");
      values.set(place, [...(values.get(place) ?? []), Math.round(value * scale + offset)].sort());
    });
    // Each cell has the other one behind one face, whatever points it has there.
    for (const t of [0, 1]) assert.equal(neighbors.slice(4 * t, 4 * t + 4).filter((n) => n === 1 - t).length, 1);
    assert.equal(new Set(tets).size, field.length);
    return [Object.fromEntries(values), report.averaged[0].difference.largest];
  };
  const [apart, difference] = await read({});
  assert.deepEqual(apart, { "0 0 0": [4, 8], "1 0 0": [4, 8], "0 1 0": [4, 8], "0 0 1": [8], "0 0 -3": [4] });
  assert.equal(difference, 0);
  const [across, more] = await read({ meanAcrossRegions: true });
  assert.deepEqual(across, { "0 0 0": [5], "1 0 0": [5], "0 1 0": [5], "0 0 1": [8], "0 0 -3": [4] });
  assert.equal(more, 2.25);
});

test("labels are told from other fields by their names, or by what is said", async () => {
  const points = "POINTS 5 double\n0 0 0 1 0 0 0 1 0 0 0 1 0 0 -3\n";
  const cells = "CELLS 2 10\n4 0 1 2 3\n4 0 2 1 4\nCELL_TYPES 2\n10\n10\n";
  const array = (name) => `SCALARS ${name} int 1\nLOOKUP_TABLE default\n8 4\n`;
  const text = `# vtk DataFile Version 3.0\nt\nASCII\nDATASET UNSTRUCTURED_GRID\n${points}${cells}CELL_DATA 2\n${array("material")}${array("load")}`;
  const built = async (options) => {
    const source = new TextEncoder().encode(text);
    const { bytes, report } = await build(source, { allFields: true, cellToPoint: true, ...options });
    const mt = await MultiTessellation.open(bytes);
    const labels = mt.info.fields.map(({ isLabel }) => isLabel);
    await mt.refine({ error: 0, field: options.fields[0] });
    const inside = await mt.probe([0.2, 0.2, 0.1]);
    mt.free();
    assert.deepEqual(
      report.averaged.map(({ isLabel }) => isLabel),
      labels,
    );
    return [...labels, inside[0]];
  };
  // The second cell has three quarters of the volume around the three common corners.
  assert.deepEqual(await built({ fields: ["material", "load"] }), [true, false, 4]);
  assert.deepEqual(await built({ fields: ["load", "material"], labels: { load: true, material: false } }), [true, false, 4]);
  const [isLabel, , inside] = await built({ fields: ["load", "material"] });
  const between = Number(inside);
  assert.ok(!isLabel && between > 5 && between < 8, `${between}`);
  for (const [labels, message] of [
    [{ nothing: true }, /nothing/],
    [["material"], /`labels`.*true or false/],
    [{ material: 1 }, /`labels`.*true or false/],
  ]) {
    await assert.rejects(built({ fields: ["load"], labels }), { code: "bad-option", message });
  }
  await assert.rejects(built({ fields: ["load"], labels: { load: true }, kind: "edge" }), { code: "bad-option", message: /'load'.*kind edge/ });
});

test("what averaging does to fields at cells is in the report and in the file", async () => {
  const text =
    "# vtk DataFile Version 3.0\nt\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 5 double\n0 0 0 1 0 0 0 1 0 0 0 1 0 0 -3\nCELLS 2 10\n4 0 1 2 3\n4 0 2 1 4\nCELL_TYPES 2\n10\n10\nCELL_DATA 2\nSCALARS m double 1\nLOOKUP_TABLE default\n8 4\n";
  const { bytes, report } = await build(new TextEncoder().encode(text), { cellToPoint: true, units: { m: "kg" } });
  const [{ name, unit, input, points, difference }] = report.averaged;
  assert.deepEqual([name, unit, report.averaged.length], ["m", "kg", 1]);
  const at = ({ value, place, cell }) => [value, place, cell];
  assert.deepEqual([input.min, input.max].map(at), [
    [4, [0.25, 0.25, -0.75], 1],
    [8, [0.25, 0.25, 0.25], 0],
  ]);
  assert.deepEqual([points.min, points.max].map(at), [
    [4, [0, 0, -3], undefined],
    [8, [0, 0, 1], undefined],
  ]);
  assert.ok(Math.abs(difference.rms - Math.sqrt(1.6875)) < 1e-12 && difference.largest === 2.25);
  const mt = await MultiTessellation.open(bytes);
  const [field] = mt.info.fields;
  assert.deepEqual([field.extremes.min, field.extremes.max].map(at), [points.min, points.max].map(at));
  assert.deepEqual([field.averaged.input.min, field.averaged.input.max].map(at), [input.min, input.max].map(at));
  assert.deepEqual(field.averaged.difference, difference);
  mt.free();
  const plain = await build(await file("small.vti"));
  assert.deepEqual(plain.report.averaged, []);
  const other = await MultiTessellation.open(plain.bytes);
  assert.equal(other.info.fields[0].averaged, undefined);
  assert.equal(other.info.fields[0].extremes.max.value, other.info.fields[0].max);
  other.free();
});

test("files are inspected before they are built", async () => {
  const grid = await inspect(await file("small.vti"));
  assert.deepEqual([grid.format, grid.dims, grid.points, grid.tetrahedra], ["vti", [17, 17, 17], 17 ** 3, 6 * 16 ** 3]);
  assert.deepEqual(
    grid.fields.map(({ name, at }) => [name, at]),
    [["density", "points"]],
  );
  assert.ok(grid.memory.fits && grid.memory.needed > 1e6 && grid.memory.available > 3e9);

  const { format, dims, fields, bounds, tetrahedra } = await inspect(await file("fields.vtu"));
  assert.deepEqual([format, dims, fields.map(({ name }) => name)], ["vtu", undefined, ["pressure", "speed"]]);
  assert.ok(tetrahedra > 70_000);
  const near = (a, b) => assert.ok(Math.abs(a - b) < 1e-3, `${a} is not ${b}`);
  [-4, -4, -4, 6, 4, 4].forEach((x, i) => near(bounds[i], x));

  const raw = await inspect(await samples("grid"));
  assert.deepEqual([raw.format, raw.points, raw.bounds], ["raw", 120, [0, 0, 0, 5, 4, 6]]);
  assert.deepEqual([raw.fields[0].name, raw.fields[0].unit], ["density", "kg"]);
  const legacy = await inspect(await file("grid.vtk"));
  assert.deepEqual([legacy.format, legacy.dims, legacy.bounds], ["vtk", raw.dims, raw.bounds]);

  const tets = await inspect(await file("tets.vtk"));
  assert.equal(tets.tetrahedra, 6 * 5 * 4 * 3);
  assert.deepEqual(tets.bounds, [0, 0, 0, 5, 4, 3]);
  const named = tets.fields.map(({ name, at, vector }) => [name, at, vector?.component]);
  const vector = [
    ["v_x", "points", 0],
    ["v_y", "points", 1],
    ["v_z", "points", 2],
    ["v_magnitude", "points", undefined],
  ];
  assert.deepEqual(named, [...vector, ["material", "cells", undefined]]);
});

test("every kind of source gives the same bytes and leaves the caller's alone", async () => {
  const bytes = await read("grid.vtk");
  const padded = new Uint8Array(bytes.length + 10);
  padded.set(bytes, 5);
  const sources = {
    "a file": await file("grid.vtk"),
    "a blob": new Blob([bytes]),
    "a buffer": bytes.buffer.slice(),
    "a part of a buffer": padded.subarray(5, 5 + bytes.length),
    "a Node buffer": Buffer.from(bytes),
    "a file URL": pathToFileURL(`${folder}/grid.vtk`),
    "a file URL as text": pathToFileURL(`${folder}/grid.vtk`).href,
  };
  const expected = (await build(bytes)).bytes;
  for (const [name, source] of Object.entries(sources)) {
    assert.deepEqual((await build(source)).bytes, expected, name);
  }
  assert.deepEqual(bytes, await read("grid.vtk"));
  // Two files that were dropped together.
  const pair = [await file("grid.json"), await file("grid.raw")];
  const { raw, json } = await samples("grid");
  const unnamed = { raw: await raw.arrayBuffer(), json: await json.arrayBuffer() };
  for (const together of [await samples("grid"), unnamed]) assert.deepEqual((await build(pair)).bytes, (await build(together)).bytes);
  await rejects(build(/** @type {any} */ (7)), "bad-source", /File/);
  await rejects(build([]), "bad-source", /no file/);
  await rejects(build("no-url.vtu"), "bad-source", /no-url\.vtu/);
  await rejects(build(/** @type {any} */ ({ raw: bytes })), "bad-source", /raw, json/);
  await rejects(build(new URL("file:///no/such.vtu")), "network", /no\/such\.vtu/);
});

test("files belong together by what they name, under names, as URLs and without their folders", async () => {
  const names = ["tets.pvtu", "tets/0.vtu", "tets/1.vtu"];
  const { bytes } = await build(await named(names));
  const urls = names.map((name) => pathToFileURL(`${folder}/${name}`));
  const flat = names.map(async (name) => new File([await read(name)], name.replace(/.*\//, "")));
  const alike = {
    urls,
    reversed: [...urls].reverse(),
    flat: await Promise.all(flat),
    deeper: (await named(names)).map(({ name, data }) => ({ name: `x/${name}`, data })),
  };
  for (const [what, source] of Object.entries(alike)) assert.deepEqual((await build(source)).bytes, bytes, what);
  const { format, points, tetrahedra, fields, bounds } = await inspect(urls);
  assert.deepEqual([format, points, tetrahedra, bounds], ["pvtu", 2 * 6 * 5 * 4, 6 * 5 * 4 * 3, [0, 0, 0, 5, 4, 3]]);
  assert.deepEqual(
    fields.map(({ name, at }) => [name, at]),
    [["p", "points"]],
  );
  await rejects(build(urls.slice(0, 2)), "bad-source", /tets\.pvtu: piece 1: it needs the file "tets\/1\.vtu".*give them together/);
  await rejects(build(urls[0]), "bad-source", /tets\/0\.vtu/);
  await rejects(build([...urls, new File(["words"], "README.txt")]), "unknown-format", /README\.txt/);
  const inFolder = [...(await named(names)), { name: "tets/README.txt", data: new Blob(["words"]) }];
  const { bytes: same, report } = await build(inFolder);
  assert.deepEqual([same, report.notes], [bytes, ["left out of the folder, for it is no mesh: tets/README.txt"]]);
});

test("every format is inspected", async () => {
  const seen = {};
  for (const { inputs, files } of cases) {
    const { format, points, tetrahedra, bounds, fields } = await inspect(await named(files));
    assert.ok(points > 0 && tetrahedra > 0 && fields.length > 0 && bounds.every(Number.isFinite), inputs[0]);
    seen[inputs[0]] = format;
  }
  assert.deepEqual(
    ["grid.nhdr", "grid.mhd", "tets.msh", "tets.node", "tets.mesh", "tets.vol", "tets.pvtu", "tets.pvd", "steps.vtkhdf", "netcdf4.exo"].map(
      (name) => seen[name],
    ),
    ["nrrd", "metaimage", "gmsh", "tetgen", "medit", "netgen", "pvtu", "vtk", "vtkhdf", "exodus"],
  );
});

test("a signal ends the work and its worker", async () => {
  const reason = new Error("enough");
  await assert.rejects(build(await file("small.vti"), { signal: AbortSignal.abort(reason) }), reason);
  for (const phase of ["read", "remove", "order"]) {
    const stop = new AbortController();
    const onProgress = (progress) => progress.phase === phase && stop.abort(reason);
    await assert.rejects(build(await file("blocks-half-edge.vti"), { signal: stop.signal, onProgress }), reason, phase);
    await noneAlive();
  }
  // A finished build leaves nothing either.
  await build(await file("grid.vtk"));
  await noneAlive();
});

/** Codes of what may be wrong with a file. */
const OF_FILES = ["unknown-format", "unsupported", "corrupt", "truncated", "bad-mesh", "limit", "memory"];

/** Builds a file that may be broken: a typed error, or bytes. */
async function attempt(source, name) {
  try {
    const { bytes } = await build(source);
    return bytes;
  } catch (error) {
    assert.ok(error instanceof TetralodError, `${name}: ${error}`);
    assert.ok(OF_FILES.includes(error.code), `${name}: ${error.code}: ${error.message}`);
    return error;
  }
}

describe("broken files give typed errors", () => {
  for (const name of ["small.vti", "fields.vtu", "grid.vtk", "tets.vtk"]) {
    test(`parts of ${name}, and flipped bits`, async () => {
      const bytes = await read(name);
      const lengths = [0, 1, 20, ...[0.1, 0.5, 0.9].map((part) => Math.floor(part * bytes.length)), bytes.length - 5];
      for (const length of lengths) {
        const result = await attempt(new File([bytes.subarray(0, length)], name), `${name} to ${length}`);
        if (length < bytes.length / 2 + 1) assert.ok(result instanceof Error, `${name} to ${length} is built`);
        if (result instanceof Error) assert.ok(result.message.startsWith(`${name}: `), result.message);
      }
      for (const part of [0.05, 0.3, 0.6, 0.95]) {
        const flipped = bytes.slice();
        flipped[Math.floor(part * bytes.length)] ^= 0x10;
        await attempt(new File([flipped], name), `${name} flipped at ${part}`);
      }
    });
  }

  const vtk = (lines) => ["# vtk DataFile Version 3.0", "x", "ASCII", ...lines, ""].join("\n");
  const vti = (extent, values, more = "") =>
    `<VTKFile type="ImageData"><ImageData WholeExtent="${extent}"><Piece Extent="${extent}"><PointData>` +
    `<DataArray type="Float32" Name="f" format="ascii"${more}>${values}</DataArray></PointData></Piece></ImageData></VTKFile>`;
  const vtu = (points, cells) =>
    `<VTKFile type="UnstructuredGrid"><UnstructuredGrid><Piece NumberOfPoints="${points}" NumberOfCells="${cells}"><Points>` +
    `<DataArray type="Float32" NumberOfComponents="3" format="ascii">0 0 0</DataArray></Points><Cells>` +
    `<DataArray type="UInt8" Name="types" format="ascii">10</DataArray></Cells></Piece></UnstructuredGrid></VTKFile>`;
  const eight = "1 2 3 4 5 6 7 8";
  const one = ["DATASET UNSTRUCTURED_GRID", "POINTS 4 float", "0 0 0 1 0 0 0 1 0 0 0 1"];
  const broken = {
    "nothing known": ["hello", "unknown-format", /\.vtu/],
    "no number": [vti("0 1 0 1 0 1", "1 2 3 4 5 6 7 x"), "corrupt", /array "f".*"x"/],
    "too few values": [vti("0 1 0 1 0 1", "1 2 3"), "corrupt", /expected 8, found 3/],
    "a value that is no number": [vti("0 1 0 1 0 1", eight.replace("3", "nan")), "bad-mesh", /point 2/],
    "too many components": [vti("0 1 0 1 0 1", eight, ' NumberOfComponents="4294967295"'), "limit", /components/],
    "a flat grid": [vti("0 1 0 1 0 0", eight), "unsupported", /2 x 2 x 1/],
    "a grid beyond all memory": [vti("0 511 0 511 0 511", eight), "memory", /800596986 tetrahedra/],
    "a grid beyond 64 bits": [vti("0 9223372036854775807 0 1 0 1", eight), "limit", /grid points/],
    "a data set of another type": ['<VTKFile type="PolyData"><PolyData/></VTKFile>', "unsupported", /PolyData/],
    "a list of time steps": ['<VTKFile type="Collection"><Collection/></VTKFile>', "unsupported", /files that it lists/],
    "points of 32 bits": [vtu(4294967295, 1), "memory", /tetrahedra/],
    "cells of 32 bits": [vtu(1, 4294967295), "corrupt", /array "types".*expected 4294967295, found 1/],
    "counts of 64 bits": [vtu("18446744073709551615", 1), "corrupt", /not a count/],
    "more points than there are": [vtu(1000, 1), "corrupt", /array "offsets"/],
    "a convex point set": [
      vtk([...one, "CELLS 1 5", "4 0 1 2 3", "CELL_TYPES 1", "41", "POINT_DATA 4", "SCALARS f float", "LOOKUP_TABLE default", "1 2 3 4"]),
      "unsupported",
      /convex point set/,
    ],
    "an open polyhedron": [
      vtk([
        ...one,
        "CELLS 1 18",
        "17 4 3 0 1 2 3 0 1 3 3 0 2 3 3 1 2 2",
        "CELL_TYPES 1",
        "42",
        "POINT_DATA 4",
        "SCALARS f float",
        "LOOKUP_TABLE default",
        "1 2 3 4",
      ]),
      "bad-mesh",
      /cell 0, a polyhedron, .* point 2 twice/,
    ],
    "a point that is not there": [
      vtk([...one, "CELLS 1 5", "4 0 1 2 9", "CELL_TYPES 1", "10", "POINT_DATA 4", "SCALARS f float", "LOOKUP_TABLE default", "1 2 3 4"]),
      "corrupt",
      /point 9/,
    ],
    "points that wrap around": [vtk(["DATASET UNSTRUCTURED_GRID", "POINTS 1431655766 float", "0 0 0"]), "truncated", /POINTS/],
    "cells that wrap around": [vtk([...one, "CELLS 858993460 4294967300", "4 0 1 2 3"]), "corrupt", /not a count/],
    "a flat mesh": [
      vtk([
        "DATASET UNSTRUCTURED_GRID",
        "POINTS 4 float",
        "0 0 0 1 0 0 0 1 0 1 1 0",
        "CELLS 1 5",
        "4 0 1 2 3",
        "CELL_TYPES 1",
        "10",
        "POINT_DATA 4",
        "SCALARS f float",
        "LOOKUP_TABLE default",
        "1 2 3 4",
      ]),
      "bad-mesh",
      /tetrahedr/,
    ],
    "no field": [vtk([...one, "CELLS 1 5", "4 0 1 2 3", "CELL_TYPES 1", "10"]), "bad-mesh", /point field/],
    "no cells": [vtk([...one, "POINT_DATA 4", "SCALARS f float", "LOOKUP_TABLE default", "1 2 3 4", "CELLS 0 0", "CELL_TYPES 0"]), "bad-mesh", /insert/],
  };
  for (const [what, [text, code, message]] of Object.entries(broken)) {
    test(what, async () => {
      const source = new File([/** @type {string} */ (text)], "broken.dat");
      await rejects(build(source), code, /** @type {RegExp} */ (message));
      await assert.rejects(build(source), /^TetralodError: broken\.dat: |memory/);
    });
  }

  test("raw samples whose JSON is wrong", async () => {
    const raw = await read("grid.raw");
    const json = (text) => ({ raw, json: new File([text], "grid.json") });
    await rejects(build(json("{")), "corrupt", /grid\.json: not valid JSON/);
    await rejects(build(json("{}")), "corrupt", /"dims"/);
    await rejects(build(json('{"dims":[2,2,2],"type":"uint8"}')), "corrupt", /expected 8, found 120/);
    await rejects(build(json('{"dims":[4294967296,4294967296,4294967296],"type":"uint8"}')), "limit", /grid points/);
    await rejects(build(json('{"dims":[512,512,512],"type":"float64"}')), "memory", /MB/);
    await rejects(build(json(" ".repeat(2 ** 21))), "corrupt", /grid\.json: not valid JSON/);
  });
});

test("what needs too much memory is refused before it is built", async () => {
  const source = await file("blocks-half-edge.vti");
  const info = await inspect(source, { memory: 2e7 });
  assert.ok(!info.memory.fits && info.memory.needed > 2e7 && info.memory.available === 2e7);
  const phases = new Set();
  const limited = build(source, { memory: 2e7, onProgress: ({ phase }) => phases.add(phase) });
  await rejects(limited, "memory", /196608 tetrahedra needs about \d+ MB.*20 MB/);
  assert.deepEqual([...phases], ["read"]);
  await rejects(build(source, { memory: 1000 }), "memory", /blocks-half-edge\.vti: the files have 1 MB/);
  await rejects(inspect(source, { memory: 1000 }), "memory");
  // More fields, more memory.
  const needed = async (options) => (await inspect(await file("fields.vtu"), options)).memory.needed;
  assert.ok((await needed({ allFields: true })) > (await needed({})));
});

test("the forecast is not less than the memory that was used, and not much more", async () => {
  /** @type {[string, import("tetralod/build").BuildOptions][]} */
  const all = [
    ["blocks-half-edge.vti", {}],
    ["blocks-half-edge.vti", { kind: "edge" }],
    ["small.vti", { kind: "vertex" }],
    ["small.vti", { method: "insert" }],
    ["fields.vtu", { allFields: true }],
    ["fields.vtu", { allFields: true, kind: "edge" }],
  ];
  for (const [name, options] of all) {
    const source = await file(name);
    const { memory } = await inspect(source, options);
    const { report } = await build(source, options);
    const ratio = report.memoryBytes / memory.needed;
    assert.ok(ratio <= 1.02 && ratio > 0.5, `${name} ${JSON.stringify(options)}: ${report.memoryBytes} of ${memory.needed}`);
  }
});

test("a module that gets no more memory ends with a typed error", async () => {
  const script = `
    import { build } from ${JSON.stringify(new URL("../../pkg/build.js", import.meta.url).href)};
    build(${JSON.stringify(pathToFileURL(`${folder}/blocks-half-edge.vti`).href)}).then(
      () => console.log("built"),
      (error) => console.log(error.code + ": " + error.message));`;
  const place = await mkdtemp(join(tmpdir(), "tetralod-memory-"));
  const main = join(place, "main.mjs");
  try {
    await writeFile(main, script);
    // In pages of 64 KiB: up to half of what this build takes, so that memory ends at different stages of it.
    for (const pages of [60, 120, 200]) {
      const { stdout } = await promisify(execFile)(process.execPath, [`--wasm-max-mem-pages=${pages}`, main]);
      assert.match(stdout, /^memory: there is not enough memory: the module has \d+ MB/, `${pages} pages`);
    }
  } finally {
    await rm(place, { recursive: true });
  }
});

test("the example of the package's README does what its text says", async () => {
  const page = await readFile(new URL("../../pkg-template/README.md", import.meta.url), "utf8");
  const code = page
    .split("```js\n")
    .map((block) => block.split("```")[0])
    .find((block) => block.startsWith("import { build, inspect }"));
  assert.ok(code, "there is an example");
  const project = await mkdtemp(join(tmpdir(), "tetralod-build-"));
  try {
    await mkdir(join(project, "node_modules"));
    await symlink(fileURLToPath(new URL("../../pkg", import.meta.url)), join(project, "node_modules/tetralod"));
    const url = JSON.stringify(pathToFileURL(`${folder}/fields.vtu`).href);
    await writeFile(join(project, "example.mjs"), `const file = new URL(${url});\n${code}\nconsole.log(mt.info.fields.length);\nmt.free();`);
    const { stdout, stderr } = await promisify(execFile)("node", ["example.mjs"], { cwd: project });
    assert.equal(stderr, "");
    const lines = stdout.trim().split("\n");
    assert.match(lines[0], /^7\d{4} tetrahedra; fields: pressure, speed$/);
    assert.ok(lines.includes("encode 1"));
    assert.match(lines.at(-2), /^1\d{4} updates in \d{6} bytes$/);
    assert.equal(lines.at(-1), "1");
  } finally {
    await rm(project, { recursive: true });
  }
});

test("options that make no sense are refused by name", async () => {
  const source = await file("tets.vtk");
  const refused = {
    kind: ["cubes", /"half-edge"/],
    method: [7, /text/],
    fields: ["v", /list of names/],
    allFields: ["yes", /true or false/],
    positionBits: [31, /1 to 30/],
    positionTolerance: [-1, /not negative/],
    fieldBits: [{ v: 0.5 }, /fieldBits\.v/],
    fieldTolerance: ["much", /percentage/],
    lossless: [7, /list of names/],
    displacement: ["20", /percentage/],
    displacementEdges: [Number.NaN, /not negative/],
    blockUpdates: [100, /power of two/],
    metadata: [{ method: "magic" }, /reserved/],
    units: [{ none: "Pa" }, /none/],
    memory: ["all", /not negative/],
    colour: ["red", /none of this name/],
    onprogress: [() => {}, /plain data/],
  };
  for (const [name, [value, message]] of Object.entries(refused)) {
    await rejects(build(source, /** @type {any} */ ({ [name]: value })), "bad-option", /** @type {RegExp} */ (message));
  }
  await rejects(build(source, { fields: ["w"] }), "bad-option", /'w'; the mesh has: v_x, v_y, v_z/);
  await rejects(build(source, { fields: ["material"] }), "bad-option", /field at cells.*`cellToPoint`/);
  await rejects(build(source, { kind: "edge", method: "insert" }), "bad-option", /collapse/);
  await rejects(build(source, { positionBits: 8, positionTolerance: 1 }), "bad-option");
});
