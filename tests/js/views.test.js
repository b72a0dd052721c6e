// What a caller gets of a mesh, and several callers of one volume: only the arrays that are wanted, without a copy where that is
// possible, what limits the mesh, events, other meshes of the same volume, and answers from them.
import assert from "node:assert/strict";
import { readFile } from "node:fs/promises";
import { createServer } from "node:http";
import { after, before, beforeEach, describe, test } from "node:test";
import { MultiTessellation, TetralodError, applyChanges, emptyMesh } from "../../pkg/index.js";
import { rejects } from "./rejects.js";

const folder = process.env.TETRALOD_FIXTURE;
assert.ok(folder, "TETRALOD_FIXTURE is not set: run `cargo xtask test js`");
const README = await readFile(new URL("../../pkg-template/README.md", import.meta.url), "utf8");
const whole = new Uint8Array(await readFile(`${folder}/small.mt`));
const blocks = new Uint8Array(await readFile(`${folder}/blocks-half-edge.mt`));
const QUICK = { retries: 0, backoffMs: 5 };

let server;
let origin = "";
/** Each test has an address of its own: what the one before has not waited for is not counted. */
let path = "";
let url = "";
let tests = 0;
/** Ranges that the server has sent, and whether it sends more than the first. */
let sent = [];
let works = true;

before(async () => {
  server = createServer(({ headers, url }, response) => {
    const [, start, last] = /^bytes=(\d+)-(\d+)$/.exec(headers.range ?? "") ?? [];
    if (!works) return response.writeHead(404).end();
    const [from, end] = [Number(start), Math.min(Number(last) + 1, blocks.length)];
    if (url === path) sent.push([from, end]);
    response.writeHead(206, { "content-range": `bytes ${from}-${end - 1}/${blocks.length}`, "content-length": end - from, etag: '"a"' });
    response.end(blocks.subarray(from, end));
  });
  // Refinement in this thread holds up the server, which must not take that for the end of a connection.
  server.keepAliveTimeout = 0;
  await new Promise((resolve) => server.listen(0, "127.0.0.1", () => resolve(undefined)));
  origin = `http://127.0.0.1:${/** @type {any} */ (server.address()).port}`;
});

beforeEach(() => {
  sent = [];
  works = true;
  path = `/model.mt?test=${++tests}`;
  url = `${origin}${path}`;
});

after(() => {
  server.closeAllConnections();
  server.close();
});

/** How many bytes have been sent more than once. */
function sentTwice() {
  const counts = new Uint8Array(blocks.length);
  for (const [start, end] of sent) for (let at = start; at < end; at++) counts[at]++;
  return counts.filter((count) => count > 1).length;
}

/** Of some kinds of array, whether their memory is that of wasm. */
const lengths = (mesh) => ["positions", "field", "tets", "neighbors"].map((name) => mesh[name]?.length);

for (const worker of [true, false]) {
  describe(worker ? "in a worker" : "in the caller's thread", () => {
    const open = async (source, options = {}) => {
      const mt = await MultiTessellation.open(source, { worker, ...QUICK, ...options });
      if (source === whole) await mt.complete;
      return mt;
    };

    test("only the arrays that are wanted are handed out, whole, in steps and as deltas", async () => {
      const mt = await open(whole);
      const all = await mt.refine({ error: "2%" });
      const some = await mt.refine({ error: "2%" }, { arrays: ["tets", "positions"] });
      // What numbers are relative to stands beside all arrays, and so does the list of the fields that were asked for.
      assert.deepEqual(Object.keys(some).sort(), ["changes", "fields", "offset", "origin", "positions", "scale", "stats", "tets"]);
      assert.deepEqual([some.positions, some.tets], [all.positions, all.tets]);
      assert.deepEqual(Object.keys(await mt.refine({ error: "3%" }, { arrays: [] })).sort(), ["changes", "fields", "offset", "origin", "scale", "stats"]);
      for await (const step of mt.refineSteps({ error: "1%" }, { arrays: ["field"] })) {
        assert.deepEqual(Object.keys(step).sort(), ["changes", "field", "fields", "offset", "origin", "scale", "stats"]);
        assert.equal(step.field.length, step.stats.vertices);
      }
      await mt.refine({ error: "5%" }, { arrays: [] });
      const mesh = await mt.refine({ error: "2%" }, { arrays: ["positions", "tets"] });
      const delta = await mt.refine({ error: "1%" }, { deltas: true, arrays: ["positions", "tets"] });
      assert.ok(!("field" in delta) && delta.tets.length <= 4 * delta.tetCount);
      applyChanges(mesh, delta);
      const now = await mt.refine({ error: "1%" });
      assert.deepEqual([mesh.positions, mesh.tets], [now.positions, now.tets]);
      // What the deltas lack is not left as it was; what the mesh lacks cannot be made up.
      const started = applyChanges(emptyMesh(), { ...delta, changes: { ...delta.changes, from: 0, vertices: new Uint32Array(), tets: new Uint32Array() } });
      assert.deepEqual(
        lengths(started).map((length) => length !== undefined),
        [true, false, true, false],
      );
      assert.throws(() => applyChanges({ changes: { ...delta.changes, to: delta.changes.from } }, delta), /`positions`/);
      await rejects(mt.refine({}, { arrays: /** @type {any} */ (["normals"]) }), "bad-option", /`arrays`.*positions, field, tets, neighbors/);
      await rejects(mt.refine({}, { arrays: /** @type {any} */ ("tets") }), "bad-option", /`arrays`/);
      mt.free();
    });

    test("without a copy, arrays are the memory of wasm; elsewhere that is refused", async () => {
      const mt = await open(whole);
      const copy = await mt.refine({ error: "2%" });
      const zeroCopy = () => mt.refine({ error: "2%" }, { zeroCopy: true });
      if (worker) {
        await rejects(zeroCopy(), "bad-option", /`worker: false`/);
      } else {
        const shared = await zeroCopy();
        assert.equal(shared.positions.buffer, shared.tets.buffer);
        for (const name of ["positions", "field", "tets", "neighbors"]) assert.deepEqual(shared[name], copy[name], name);
        assert.deepEqual([shared.changes.from, shared.changes.to], [1, 2]);
        await rejects(mt.refine({}, /** @type {any} */ ({ zeroCopy: true, deltas: true })), "bad-option", /deltas/);
        const some = await mt.refine({ error: "1%" }, { zeroCopy: true, arrays: ["tets"] });
        assert.deepEqual(lengths(some), [undefined, undefined, 4 * some.stats.tetrahedra, undefined]);
      }
      mt.free();
    });

    test("what limits the mesh is told", async () => {
      const mt = await open(url);
      const limit = async (request, how) => (await mt.refine(request, { arrays: [], ...how })).stats.limitedBy;
      assert.equal(await limit({ error: 0 }, { partial: true }), "network");
      assert.equal(await limit({ error: "1%" }), "error");
      assert.equal(await limit({ error: 0, maxTets: 5000 }), "budget");
      assert.equal(await limit({ error: 0 }), "error");
      const steps = [];
      for await (const { stats } of mt.refineSteps({ error: "3%" }, { updates: 50, arrays: [] })) steps.push(stats);
      assert.ok(steps.length > 1);
      assert.deepEqual(
        steps.map(({ limitedBy }) => limitedBy),
        steps.map(({ done }) => (done ? "error" : undefined)),
      );
      mt.free();
      const small = await open(url, { memory: 100_000 });
      assert.equal((await small.refine({ error: 0 }, { arrays: [] })).stats.limitedBy, "memory");
      small.free();
    });

    test("progress, meshes and errors are events", async () => {
      const mt = await open(url);
      const events = [];
      for (const name of ["progress", "stats", "error"]) {
        mt.addEventListener(name, (event) => events.push([name, /** @type {CustomEvent} */ (event).detail]));
      }
      const { stats } = await mt.refine({ error: "5%", box: [0, 0, 0, 0.2, 0.2, 0.2] });
      const of = (name) => events.filter(([other]) => other === name).map(([, detail]) => detail);
      assert.ok(of("progress").length > 0);
      assert.deepEqual(of("progress").at(-1), mt.progress);
      assert.deepEqual(of("stats"), [stats]);
      works = false;
      await rejects(mt.refine({ error: 0 }), "network");
      assert.deepEqual(
        of("error").map((error) => [error instanceof TetralodError, error.code]),
        [[true, "network"]],
      );
      mt.free();
      const ends = await open(new Blob([whole.subarray(0, whole.length - 5)]));
      const failed = new Promise((resolve) => ends.addEventListener("error", ({ detail }) => resolve(detail)));
      assert.equal(/** @type {any} */ (await failed).code, "truncated");
      ends.free();
    });

    test("no byte is fetched twice, whatever comes with the first range", async () => {
      const mt = await open(url);
      await mt.refine({ error: 0 }, { arrays: [] });
      assert.equal(sentTwice(), 0);
      const sum = sent.reduce((sum, [start, end]) => sum + end - start, 0);
      assert.ok(sent.length > 1 && sum > 0.99 * blocks.length, `${sum} of ${blocks.length}`);
      mt.free();
    });

    test("a view has a mesh of its own, and shares what is fetched", async () => {
      const mt = await open(url);
      const view = await mt.view();
      assert.deepEqual(view.info, mt.info);
      await mt.refine({ error: "0.5%" }, { arrays: [] });
      const before = await mt.hash();
      const again = sent.length;
      const { stats } = await view.refine({ error: "0.5%", maxTets: 3000 });
      assert.ok(stats.tetrahedra <= 3000 && stats.tetrahedra > 100);
      await view.refine({ error: "0.5%" }, { arrays: [] });
      assert.equal(await view.hash(), before);
      assert.equal(await mt.hash(), before);
      assert.equal(sent.length, again, `fetched again: ${JSON.stringify(sent.slice(again))}`);
      await view.refine({ error: 0 }, { arrays: [] });
      const all = sent.length;
      await mt.refine({ error: 0 }, { arrays: [] });
      assert.equal(sent.length, all, "what the view has fetched is there for the volume, too");
      view.free();
      await rejects(view.hash(), "freed");
      assert.equal((await mt.refine({ error: "5%" })).stats.satisfied, true);
      const other = await mt.view();
      const waiting = other.refine({ error: 0 });
      mt.free();
      await rejects(waiting, "freed");
      await rejects(other.hash(), "freed");
      await rejects(mt.view(), "freed");
    });

    test("views of bytes and blobs read them again; a stream has none", async () => {
      for (const source of [whole, new Blob([whole])]) {
        const mt = await open(source);
        await mt.complete;
        const seen = [];
        const view = await mt.view({ onProgress: (progress) => seen.push(progress) });
        await Promise.all([mt.refine({ error: "1%" }), view.refine({ error: "4%" })]);
        assert.notEqual(await mt.hash(), await view.hash());
        await view.refine({ error: "1%" });
        assert.equal(await mt.hash(), await view.hash());
        assert.ok(seen.length > 0);
        mt.free();
      }
      const stream = await open(new Blob([whole]).stream());
      await rejects(stream.view(), "bad-source", /read only once/);
      await rejects(stream.isosurface(0.5, { request: {} }), "bad-source");
      stream.free();
    });

    test("the example of the README runs", async () => {
      const [, code] = /```js\n(\/\/ Two parts of a page[^`]*)```/.exec(README) ?? assert.fail("the README has no example");
      const mt = await open(url);
      const AsyncFunction = /** @type {any} */ (async () => {}).constructor;
      const { stats, positions, tets, cut } = await AsyncFunction("mt", `${code}; return { stats, positions, tets, cut };`)(mt);
      assert.ok(stats.satisfied && positions.length > 0 && tets.length <= 40_000 && cut.indices.length > 0);
      mt.free();
    });

    test("a call with a request of its own answers from that mesh, and the current mesh stays", async () => {
      const mt = await open(url);
      await mt.refine({ error: "1%", isovalues: [0.5] });
      const fine = await mt.isosurface(0.5);
      const volume = await mt.stats({ bins: 3 });
      const mesh = await mt.refine({ error: "20%" });
      const before = await mt.hash();
      const request = { error: "1%", isovalues: [0.5] };
      const [aside, coarse, sums, cut] = await Promise.all([
        mt.isosurface(0.5, { request }),
        mt.isosurface(0.5),
        mt.stats({ bins: 3, request }),
        mt.slice([0, 0, 1], 0.5, { request: { error: "40%" } }),
      ]);
      assert.equal(aside.indices.length, fine.indices.length);
      assert.ok(coarse.indices.length < fine.indices.length / 2);
      assert.deepEqual(sums, volume);
      assert.ok(cut.indices.length > 0);
      assert.equal(await mt.hash(), before);
      const delta = await mt.refine({ error: "20%" }, { deltas: true });
      assert.deepEqual([delta.changes.from, delta.changes.tets.length], [mesh.changes.to, 0]);
      for (const call of [mt.surface({ request }), mt.probe([0.5, 0.5, 0.5], { request }), mt.line([0, 0, 0], [1, 1, 1], { request })]) {
        assert.ok(await call);
      }
      await rejects(mt.surface({ request: /** @type {any} */ ({ eror: 1 }) }), "bad-option", /`eror`/);
      assert.ok((await mt.surface({ request })).indices.length > 0, "after an error");
      await rejects(mt.surface(/** @type {any} */ ({ requests: {} })), "bad-option", /`requests`/);
      mt.free();
    });
  });
}
