// The built package in Node, on the small MT that `cargo xtask test` makes: TETRALOD_FIXTURE is its folder.
import assert from "node:assert/strict";
import { createReadStream } from "node:fs";
import { mkdtemp, readFile, rm, writeFile } from "node:fs/promises";
import { createServer } from "node:http";
import { tmpdir } from "node:os";
import { dirname, join } from "node:path";
import { after, before, describe, test } from "node:test";
import { pathToFileURL } from "node:url";
import { MultiTessellation, TetralodError, absolute } from "../../pkg/index.js";
import { Viewer } from "../../pkg/viewer.js";
import { rejects } from "./rejects.js";

const folder = process.env.TETRALOD_FIXTURE;
assert.ok(folder, "TETRALOD_FIXTURE is not set: run `cargo xtask test js`");
const path = `${folder}/small.mt`;
const bytes = new Uint8Array(await readFile(path));
const cases = JSON.parse(await readFile(`${folder}/hashes.json`, "utf8"));

/** The same file in three shards. */
const size = Math.ceil(bytes.length / 3);
const shards = [0, 1, 2].map((number) => bytes.subarray(number * size, (number + 1) * size));
const inShards = join(await mkdtemp(join(tmpdir(), "tetralod-")), "small.mt");
for (const [number, shard] of shards.entries()) await writeFile(`${inShards}${number ? `.000${number}` : ""}`, shard);

/** A server whose answers the tests choose; `held` answers stay open until they are released. */
let server;
let base;
const held = new Set();

before(async () => {
  server = createServer((request, response) => {
    const { pathname } = new URL(request.url, "http://x");
    if (pathname === "/good") return response.writeHead(200, { "content-length": bytes.length }).end(bytes);
    const [, name, number = "0"] = /^\/(sharded|gap|short)\.mt(?:\.(\d{4}))?$/.exec(pathname) ?? [];
    const found = name && pathname !== "/gap.mt.0001" && shards[Number(number)];
    if (found) return response.writeHead(200).end(pathname === "/short.mt.0001" ? found.subarray(0, -1) : found);
    if (pathname === "/page") return response.writeHead(200).end("<!doctype html><title>oops</title>");
    if (pathname === "/breaks") {
      response.writeHead(200, { "content-length": bytes.length });
      response.write(bytes.slice(0, bytes.length >> 1));
      // Later, because a client may drop what it has not read yet when a connection breaks.
      return setTimeout(() => response.destroy(), 500);
    }
    if (pathname === "/holds") {
      response.writeHead(200, { "content-length": bytes.length });
      response.write(bytes.slice(0, bytes.length - 1));
      held.add(response);
      return response.on("close", () => held.delete(response));
    }
    return response.writeHead(404).end();
  });
  await new Promise((resolve) => server.listen(0, "127.0.0.1", resolve));
  base = `http://127.0.0.1:${server.address().port}`;
});

after(() => {
  server.closeAllConnections();
  server.close();
  return rm(dirname(inShards), { recursive: true });
});

/** The area of triangles. */
function area({ positions, indices }) {
  let sum = 0;
  for (let i = 0; i < indices.length; i += 3) {
    const [a, b, c] = [0, 1, 2].map((k) => positions.subarray(3 * indices[i + k], 3 * indices[i + k] + 3));
    const [u, v] = [b, c].map((p) => [0, 1, 2].map((axis) => p[axis] - a[axis]));
    sum += Math.hypot(u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]) / 2;
  }
  return sum;
}

async function* pieces(size) {
  for (let at = 0; at < bytes.length; at += size) yield bytes.slice(at, at + size);
}

for (const worker of [true, false]) {
  describe(worker ? "in a worker" : "in the caller's thread", () => {
    const open = (source, options) => MultiTessellation.open(source, { worker, ...options });

    test("the meshes are those of the native program", async () => {
      const mt = await open(bytes);
      await mt.complete;
      assert.ok(cases.length >= 5);
      for (const { options, hash, tetrahedra } of cases) {
        const { stats, tets } = await mt.refine(options);
        assert.equal(stats.tetrahedra, tetrahedra, JSON.stringify(options));
        assert.equal(tets.length, 4 * tetrahedra);
        assert.equal(await mt.hash(), hash, JSON.stringify(options));
      }
      mt.free();
    });

    test("the meshes of other kinds of MT are those of the native program, too", async () => {
      for (const kind of ["edge", "vertex"]) {
        const mt = await open(new Uint8Array(await readFile(`${folder}/small-${kind}.mt`)));
        await mt.complete;
        for (const { options, hash } of JSON.parse(await readFile(`${folder}/hashes-${kind}.json`, "utf8"))) {
          await mt.refine(options);
          assert.equal(await mt.hash(), hash, `${kind}: ${JSON.stringify(options)}`);
        }
        mt.free();
      }
    });

    test("every kind of source gives the same mesh and leaves the caller's bytes alone", async () => {
      const sources = {
        "a URL as text": `${base}/good`,
        "a URL": new URL(`${base}/good`),
        "a file URL": pathToFileURL(path),
        "a URL of shards": `${base}/sharded.mt?key`,
        "a file URL of shards": pathToFileURL(inShards),
        "a request": new Request(`${base}/good`),
        // Asked for when it is read: the server does not wait for who does not read.
        "a response": () => fetch(`${base}/good`),
        "a blob": new Blob([bytes]),
        "a buffer": bytes.buffer.slice(),
        "bytes": bytes,
        "a Node buffer": Buffer.from(bytes),
        "a stream": new Blob([bytes]).stream(),
        "a Node stream": createReadStream(path, { highWaterMark: 100 }),
        "an async iterable": pieces(13),
      };
      const copy = bytes.slice();
      for (const [name, source] of Object.entries(sources)) {
        const mt = await open(typeof source === "function" ? await source() : source);
        await mt.complete;
        assert.equal((await mt.refine({ error: 0 })).stats.tetrahedra, mt.info.tetrahedra, name);
        assert.equal(mt.progress.bytes, bytes.length, name);
        assert.equal(mt.progress.complete, true, name);
        mt.free();
      }
      assert.deepEqual(bytes, copy);
    });

    test("arrays are consistent and the mesh is closed", async () => {
      const mt = await open(bytes);
      await mt.complete;
      const { positions, field, tets, neighbors, stats } = await mt.refine({ error: "2%" });
      assert.ok(positions instanceof Float32Array && field instanceof Float32Array);
      assert.ok(tets instanceof Uint32Array && neighbors instanceof Uint32Array);
      assert.equal(positions.length, 3 * stats.vertices);
      assert.equal(field.length, stats.vertices);
      assert.equal(neighbors.length, tets.length);
      assert.ok(stats.satisfied && stats.relativeErrorBound <= 0.02 && stats.milliseconds >= 0);
      const { min, max } = mt.info.fields[0];
      assert.ok(Math.abs(stats.errorBound - stats.relativeErrorBound * (max - min)) < 1e-9 * (max - min));
      for (let t = 0; t < stats.tetrahedra; t++) {
        for (let i = 0; i < 4; i++) {
          const other = neighbors[4 * t + i];
          if (other === 0xffffffff) continue;
          assert.ok(neighbors.subarray(4 * other, 4 * other + 4).includes(t), "neighbours know each other");
        }
      }
      mt.free();
    });

    test("an absolute error is the same request as the relative one", async () => {
      const mt = await open(bytes);
      await mt.complete;
      const { min, max } = mt.info.fields[0];
      await mt.refine({ error: "4%" });
      const relative = await mt.hash();
      await mt.refine({ error: 0 });
      await mt.refine({ error: 0.04 * (max - min) });
      assert.equal(await mt.hash(), relative);
      mt.free();
    });

    test("sections, boundary, probes, lines, streamlines and sums agree with one another on a unit cube", async () => {
      const mt = await open(bytes);
      await mt.complete;
      await mt.refine({ error: "0.5%" });
      const near = (a, b, within) => assert.ok(Math.abs(a - b) <= within, `${a} is not ${b}`);
      const [x0, y0, z0, x1, y1, z1] = mt.info.bounds;
      const [dx, dy, dz] = [x1 - x0, y1 - y0, z1 - z0];
      const z = z0 + 0.43 * dz;

      const cut = await mt.slice([0, 0, 2], 2 * z);
      near(area(cut), dx * dy, 1e-4 * dx * dy);
      for (let v = 2; v < cut.positions.length; v += 3) near(cut.positions[v], z, 1e-5 * dz);
      assert.equal(cut.values.length, cut.positions.length / 3);
      assert.ok(cut.edges.length > cut.indices.length / 2 && cut.edges.length % 2 === 0);
      const probed = await mt.probe(cut.positions);
      for (let v = 0; v < probed.length; v++) {
        // On the boundary a point may be a rounding error outside.
        if (!Number.isNaN(probed[v])) near(probed[v], cut.values[v], 1e-4);
      }
      // Asked for again, after another mesh, it is the section of that.
      await mt.refine({ error: "3%" });
      near(area(await mt.slice([0, 0, 2], 2 * z)), dx * dy, 1e-4 * dx * dy);

      const surface = await mt.surface();
      near(area(surface), 2 * (dx * dy + dy * dz + dz * dx), 1e-4);

      const { at, values, tets } = await mt.line([x0 - dx, y0 + dy / 2, z], [x1 + dx, y0 + dy / 2, z]);
      near(at[0], 1 / 3, 1e-6);
      near(at.at(-1), 2 / 3, 1e-6);
      assert.equal(values.length, 2 * tets.length);
      const middle = await mt.probe([x0 + dx / 2, y0 + dy / 2, z, x0 - dx, y0, z]);
      assert.ok(Number.isNaN(middle[1]), "outside");
      const part = at.findIndex((t, i) => i % 2 === 0 && t <= 0.5 && at[i + 1] >= 0.5);
      const t = (0.5 - at[part]) / (at[part + 1] - at[part]);
      near(values[part] + t * (values[part + 1] - values[part]), middle[0], 1e-5);

      const stats = await mt.stats({ bins: 16 });
      near(stats.volume, dx * dy * dz, 1e-6);
      near(stats.mean * stats.volume, stats.integral, 1e-9);
      near(
        [...stats.histogram, stats.below, stats.above].reduce((a, b) => a + b),
        stats.volume,
        1e-9,
      );
      assert.equal(stats.edges.length, 17);

      const { name } = mt.info.fields[0];
      const [line, none] = await mt.streamlines([name, name, name], [x0 + dx / 3, y0 + dy / 3, z, x0 - 1, y0, z]);
      assert.equal(none, undefined);
      assert.equal(line.positions.length, 3 * line.times.length);
      // All three components are the same number.
      const step = (axis) => line.positions[line.positions.length - 3 + axis] - line.positions[axis];
      near(step(0), step(1), 1e-9);
      near(step(0), step(2), 1e-9);

      const both = await mt.isosurface([0.4, 0.6], { normals: "smooth" });
      const [one, other] = [await mt.isosurface(0.4), await mt.isosurface(0.6)];
      assert.equal(both.indices.length, one.indices.length + other.indices.length);
      assert.deepEqual([...new Set(both.values)].sort(), [...new Float32Array([0.4, 0.6])]);

      await rejects(mt.slice([0, 0, 0], 1), "bad-option");
      await rejects(mt.slice([0, 0, 1], NaN), "bad-option");
      await rejects(mt.probe([1, 2]), "bad-option");
      await rejects(mt.probe(/** @type {any} */ ("1, 2, 3")), "bad-option");
      await rejects(mt.line([0, 0, 0], [1, 1]), "bad-option");
      await rejects(mt.streamlines(/** @type {any} */ ([name, name]), [0, 0, 0]), "bad-option");
      await rejects(mt.streamlines([name, name, "none"], [0, 0, 0]), "bad-option", /none/);
      await rejects(mt.stats({ bins: 0 }), "bad-option");
      await rejects(mt.stats({ range: [1, 0] }), "bad-option");
      await rejects(mt.isosurface(0.5, /** @type {any} */ ({ normals: "flat" })), "bad-option");
      mt.free();
    });

    test("all fields come with meshes and surfaces", async () => {
      const mt = await open(new Uint8Array(await readFile(`${folder}/fields.mt`)));
      await mt.complete;
      const needs = [{ error: "2%", field: 1 }];
      const request = { needs, field: 1 };
      const mesh = await mt.refine(request, { fields: true });
      const all = mt.info.fields;
      assert.ok(all.length > 1);
      assert.deepEqual(
        mesh.fields.map(({ values, ...field }) => field),
        all.map(({ name, unit, time, vector, offset, scale }, index) => ({ index, name, unit, time, vector, offset, scale })),
      );
      assert.deepEqual(mesh.fields[1].values, mesh.field);
      for (const { index, values } of mesh.fields) {
        assert.deepEqual(values, (await mt.refine({ needs, field: index })).field);
      }

      await mt.refine(request);
      const [x0, y0, z0, x1] = mt.info.bounds;
      const { min, max } = all[1];
      const how = { fields: [1, all[0].name] };
      const slice = await mt.slice([1, 0.2, 0.1], x0 + 0.3 * (x1 - x0) + 0.2 * y0 + 0.1 * z0, how);
      const surfaces = {
        slice,
        isosurface: await mt.isosurface(
          [0.3, 0.6].map((part) => min + part * (max - min)),
          how,
        ),
        boundary: await mt.surface(how),
      };
      for (const [name, surface] of Object.entries(surfaces)) {
        const { positions, values, fields } = absolute(surface);
        assert.ok(values.length > 50, name);
        assert.deepEqual(
          fields.map(({ index }) => index),
          [1, 0],
          name,
        );
        for (const field of fields) {
          await mt.setField(field.index);
          const probed = await mt.probe(positions);
          const near = 1e-5 * (all[field.index].max - all[field.index].min);
          // Vertices are rounded to single precision: some are outside then.
          const inside = [...probed.keys()].filter((i) => !Number.isNaN(probed[i]));
          assert.ok(inside.length > 0.9 * values.length, `${name}: ${inside.length} of ${values.length}`);
          for (const i of inside) assert.ok(Math.abs(field.values[i] - probed[i]) < near, `${name}: ${field.values[i]}, ${probed[i]}`);
        }
        assert.ok(
          values.every((value, i) => Math.abs(value - fields[0].values[i]) < 1e-6 * (max - min)),
          name,
        );
        await mt.setField(1);
      }

      assert.deepEqual([(await mt.surface()).fields, (await mt.refine(request)).fields], [[], []]);
      const aside = await mt.surface({ fields: [0], request: { error: "50%" } });
      assert.equal(aside.fields[0].values.length, aside.values.length);
      await rejects(mt.surface({ fields: ["none"] }), "bad-option", /none/);
      await rejects(mt.refine(request, /** @type {any} */ ({ fields: true, deltas: true })), "bad-option", /`fields`/);
      mt.free();
    });

    test("an isosurface has vertices on it and unit normals", async () => {
      const mt = await open(bytes);
      await mt.complete;
      await mt.refine({ error: "1%" });
      const { min, max } = mt.info.fields[0];
      const { positions, normals, indices } = await mt.isosurface((min + max) / 2);
      assert.ok(indices.length > 0 && indices.length % 3 === 0);
      assert.equal(normals.length, positions.length);
      assert.ok(indices.every((index) => 3 * index < positions.length));
      assert.ok(Math.abs(Math.hypot(...normals.subarray(0, 3)) - 1) < 1e-4);
      await rejects(mt.isosurface(NaN), "bad-option");
      await rejects(mt.isosurface(/** @type {any} */ ("0.5")), "bad-option");
      mt.free();
    });

    test("progress is told chunk by chunk", async () => {
      const seen = [];
      const mt = await open(pieces(50), { onProgress: (progress) => seen.push(progress) });
      await mt.complete;
      assert.ok(seen.length >= bytes.length / 50);
      assert.ok(seen.every((progress, i) => i === 0 || progress.bytes >= seen[i - 1].bytes));
      assert.equal(seen.at(-1).complete, true);
      assert.equal(seen.at(-1).updates, mt.info.updates);
      assert.deepEqual(seen.at(-1), mt.progress);
      mt.free();
    });

    test("the total is known from the first chunk of a download", async () => {
      const seen = [];
      const mt = await open(`${base}/good`, { onProgress: (progress) => seen.push(progress) });
      await mt.complete;
      assert.equal(seen[0].total, bytes.length);
      mt.free();
    });

    test("it works while the file is still arriving, and says what is missing", async () => {
      let release;
      const gate = new Promise((resolve) => (release = resolve));
      async function* slow() {
        const half = bytes.length >> 1;
        yield bytes.slice(0, half);
        await gate;
        yield bytes.slice(half);
      }
      const mt = await open(slow());
      assert.equal(mt.progress.complete, false);
      const early = await mt.refine({ error: 0 }, { partial: true });
      assert.ok(early.stats.tetrahedra > 0 && early.stats.tetrahedra < mt.info.tetrahedra);
      assert.equal(early.stats.satisfied, false);
      // What has come is enough for this one.
      assert.equal((await mt.refine({ error: "100%" })).stats.satisfied, true);
      const waiting = mt.refine({ error: 0 });
      const replaced = rejects(waiting, "replaced");
      const late = mt.refine({ error: "0.01%" }).then(() => mt.refine({ error: 0 }));
      release();
      await replaced;
      assert.equal((await late).stats.tetrahedra, mt.info.tetrahedra);
      assert.equal((await late).stats.satisfied, true);
      mt.free();
    });

    test("what cannot be opened is refused with a code and the name of the source", async () => {
      await rejects(open(`${base}/none`), "network", /\/none: .*HTTP 404/);
      await rejects(open("http://127.0.0.1:9/closed", { retries: 0 }), "network", /127\.0\.0\.1:9/);
      await rejects(open(new URL("file:///no/such.mt")), "network", /no\/such\.mt/);
      await rejects(open(`${base}/page`), "not-mt", /\/page: /);
      await rejects(open(bytes.slice(0, 10)), "truncated");
      await rejects(open(new Uint8Array()), "truncated");
      await rejects(Viewer.create(/** @type {any} */ ({})), "no-webgpu", /MultiTessellation/);
      await rejects(open(7), "bad-source", /URL, Request/);
      await rejects(open("models/none.mt"), "bad-source", /none\.mt: .*pathToFileURL/);
      await rejects(open("C:\\models\\none.mt"), "bad-source", /pathToFileURL/);
      const named = new File(["no mesh at all"], "dropped.mt");
      await rejects(open(named), "not-mt", /^dropped\.mt: /);
      await rejects(open(null), "bad-source");
      await rejects(
        open(
          (async function* () {
            yield "text";
          })(),
        ),
        "bad-source",
        /string/,
      );
      const used = await fetch(`${base}/good`);
      await used.arrayBuffer();
      await rejects(open(used), "bad-source");
      await rejects(open(bytes, { onprogress() {} }), "bad-option", /onprogress/);
    });

    test("a file that breaks off stays usable as far as it came", async () => {
      const mt = await open(`${base}/breaks`);
      await rejects(mt.complete, "network", /\/breaks/);
      assert.ok((await mt.refine({ error: 0 }, { partial: true })).stats.tetrahedra > 0);
      await rejects(mt.refine({ error: 0 }), "network", /\/breaks/);
      mt.free();

      for (const name of ["gap", "short"]) {
        const opened = open(`${base}/${name}.mt`);
        await rejects(
          opened.then((mt) => mt.complete.finally(() => mt.free())),
          "truncated",
          new RegExp(`${name}\\.mt: .*\\.0001`),
        );
      }

      const cut = await open(bytes.slice(0, bytes.length - 5));
      await rejects(cut.complete, "truncated");
      assert.ok((await cut.refine({ error: 0 }, { partial: true })).stats.tetrahedra > 0);
      cut.free();
    });

    test("a damaged file is reported", async () => {
      const damaged = bytes.slice();
      damaged[damaged.length >> 1] ^= 0x10;
      const mt = await open(damaged).catch((error) => error);
      if (mt instanceof TetralodError) return assert.equal(mt.code, "corrupt");
      await rejects(mt.complete, "corrupt", /bytes: /);
      mt.free();
    });

    test("options with impossible values are refused by name", async () => {
      const mt = await open(bytes);
      await rejects(mt.refine(/** @type {any} */ ({ eror: 1 })), "bad-option", /`eror`/);
      await rejects(mt.refine({ error: "lots" }), "bad-option", /`error`.*given: lots/);
      await rejects(mt.refine({ box: [0, 0, 0] }), "bad-option", /`box`.*given: 0,0,0/);
      await rejects(mt.refine({ field: "no such" }), "bad-option", /no such/);
      await rejects(mt.refine({ maxTets: -1 }), "bad-option", /`maxTets`/);
      await rejects(mt.refine(/** @type {any} */ (7)), "bad-option", /object/);
      await rejects(mt.setField("no such"), "bad-option", /no such/);
      assert.ok((await mt.refine({ box: new Float32Array([0, 0, 0, 1, 1, 1]), isovalues: new Float64Array([0.5]) })).stats);
      mt.free();
    });

    test("a signal ends the download and the wait for it", async () => {
      const early = AbortSignal.abort();
      await assert.rejects(open(bytes, { signal: early }), { name: "AbortError" });

      const abort = new AbortController();
      const mt = await open(`${base}/holds`, { signal: abort.signal });
      await until(() => held.size === 1, "only the stream is left of the requests");
      abort.abort();
      await assert.rejects(mt.complete, { name: "AbortError" });
      assert.ok((await mt.refine({ error: 0 }, { partial: true })).stats.tetrahedra > 0, "what arrived stays usable");
      mt.free();
      await until(() => held.size === 0, "the connection is closed");

      const waiting = new AbortController();
      const never = open(
        (async function* () {
          await new Promise(() => {});
        })(),
        { signal: waiting.signal },
      );
      waiting.abort(new Error("changed my mind"));
      await assert.rejects(never, /changed my mind/);
    });

    test("free ends the download, and all later calls say so", async () => {
      const mt = await open(`${base}/holds`);
      const underWay = mt.refine({ error: 0 }, { partial: true });
      mt.free();
      mt.free();
      if (worker) await rejects(underWay, "freed");
      else await underWay.catch((error) => assert.equal(error.code, "freed"));
      await rejects(mt.complete, "freed");
      await rejects(mt.refine(), "freed");
      await rejects(mt.isosurface(0), "freed");
      await rejects(mt.hash(), "freed");
      await until(() => held.size === 0, "the connection is closed");
      const other = await open(bytes);
      other[Symbol.dispose ?? Symbol.for("Symbol.dispose")]();
      await rejects(other.hash(), "freed");
    });
  });
}

async function until(condition, what) {
  for (let i = 0; i < 200; i++) {
    if (condition()) return;
    await new Promise((resolve) => setTimeout(resolve, 10));
  }
  assert.fail(`waited in vain until ${what}`);
}
