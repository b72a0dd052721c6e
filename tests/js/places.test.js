// Where the package's files are, in Node: options for other places, errors that say what to change, and imports without a page.
import assert from "node:assert/strict";
import { readFile } from "node:fs/promises";
import { createServer } from "node:http";
import { after, before, test } from "node:test";
import { Worker } from "node:worker_threads";
import { build, inspect } from "../../pkg/build.js";
import { MultiTessellation, TetralodError } from "../../pkg/index.js";
import { VERSION } from "../../pkg/version.js";

const folder = process.env.TETRALOD_FIXTURE;
assert.ok(folder, "TETRALOD_FIXTURE is not set: run `cargo xtask test js`");
const bytes = new Uint8Array(await readFile(`${folder}/small.mt`));
const [{ options, hash }] = JSON.parse(await readFile(`${folder}/hashes.json`, "utf8"));
const pkg = new URL("../../pkg/", import.meta.url);
const at = (name) => new URL(name, pkg);

let server;
let base;

before(async () => {
  server = createServer(async ({ url }, response) => {
    if (url === "/core.wasm") return response.end(await readFile(at("tetralod_core_bg.wasm")));
    if (url === "/page.wasm") return response.writeHead(200, { "content-type": "text/html" }).end("<!doctype html>");
    if (url === "/text.wasm") return response.writeHead(200, { "content-type": "application/wasm" }).end("not wasm");
    return response.writeHead(404).end();
  });
  await new Promise((resolve) => server.listen(0, "127.0.0.1", () => resolve(undefined)));
  base = `http://127.0.0.1:${server.address().port}`;
});

after(() => {
  server.closeAllConnections();
  server.close();
});

const rejects = (promise, code, message) =>
  assert.rejects(promise, (error) => {
    assert.ok(error instanceof TetralodError, String(error));
    assert.equal(error.code, code, error.message);
    assert.match(error.message, message);
    return true;
  });

async function works(how) {
  const mt = await MultiTessellation.open(bytes, how);
  await mt.complete;
  await mt.refine(options);
  assert.equal(await mt.hash(), hash);
  mt.free();
}

test("the version of the workers is that of the package", async () => {
  const { version } = JSON.parse(await readFile(at("package.json"), "utf8"));
  assert.equal(VERSION, version, "pkg-template/version.ts");
});

test("worker and wasm are taken from other places, or from a worker that is passed in", async () => {
  await works({ workerUrl: at("worker.js"), wasmUrl: at("tetralod_core_bg.wasm") });
  await works({ workerUrl: at("worker.js").href, wasmUrl: `${base}/core.wasm` });
  await works({ worker: new Worker(at("worker.js")) });
  await works({ worker: new Worker(at("worker.js")), wasmUrl: at("tetralod_core_bg.wasm").href });
});

test("files of any kind are read by the one module, whole or in pieces, and have all tools", async () => {
  const other = new Uint8Array(await readFile(`${folder}/small-vertex.mt`));
  const [first] = JSON.parse(await readFile(`${folder}/hashes-vertex.json`, "utf8"));
  const pieces = async function* () {
    for (let at = 0; at < other.length; at += 100) yield other.slice(at, at + 100);
  };
  /** @type {[import("../../pkg/index.js").Source, object][]} */
  const ways = [
    [other, {}],
    [pieces(), {}],
    [pieces(), { worker: false }],
    [new Blob([other]), {}],
  ];
  for (const [source, how] of ways) {
    const mt = await MultiTessellation.open(source, how);
    await mt.complete;
    await mt.refine(first.options);
    assert.equal(await mt.hash(), first.hash);
    assert.ok((await mt.surface()).indices.length > 0);
    mt.free();
  }
});

test("the inline entry needs no other file, in a worker and in the caller's thread", async () => {
  const text = await readFile(at("inline.js"), "utf8");
  const inline = await import(`data:text/javascript;base64,${Buffer.from(text).toString("base64")}`);
  assert.deepEqual(Object.keys(inline).sort(), Object.keys(await import(at("index.js").href)).sort());
  const other = new Uint8Array(await readFile(`${folder}/small-vertex.mt`));
  const [expectedOfOther] = JSON.parse(await readFile(`${folder}/hashes-vertex.json`, "utf8"));
  for (const worker of [true, false]) {
    for (const [source, expected] of [
      [bytes, { options, hash }],
      [other, expectedOfOther],
    ]) {
      const mt = await inline.MultiTessellation.open(source, { worker });
      await mt.complete;
      await mt.refine(expected.options);
      assert.equal(await mt.hash(), expected.hash);
      assert.ok((await mt.surface()).indices.length > 0, "the tools are in it, too");
      mt.free();
    }
  }
});

test("a worker that does not start, or is another one, is an error of configuration that says what to do", async () => {
  const open = (how) => MultiTessellation.open(bytes, how);
  await rejects(open({ workerUrl: at("no-such-worker.js") }), "worker", /no-such-worker\.js.*Set `workerUrl`.*"tetralod\/worker".*inline/);
  const other = (found) =>
    `data:text/javascript,${encodeURIComponent(`
    import { parentPort } from "node:worker_threads";
    parentPort.on("message", ({ id }) => parentPort.postMessage({ id, result: ${JSON.stringify(found)} }));`)}`;
  await rejects(open({ workerUrl: other({ name: "core", version: "0.0.1" }) }), "worker", /tetralod 0\.0\.1/);
  await rejects(open({ workerUrl: other({ name: "viewer", version: VERSION }) }), "worker", /viewer; "tetralod\/worker"/);
  const ends = new URL("data:text/javascript,process.exit(0)");
  await rejects(open({ worker: new Worker(ends) }), "worker", /the worker ended/);
});

test("a worker that loads but never answers ends in time, with an error that says so", async () => {
  const silent = new URL("data:text/javascript,setInterval(() => {}, 1000)");
  const unheard = /it has not answered within 0\.3 s.*`workerTimeoutMs`.*Set `workerUrl`/;
  const how = { workerTimeoutMs: 300 };
  await rejects(MultiTessellation.open(bytes, { workerUrl: silent, ...how }), "worker", unheard);
  await rejects(MultiTessellation.open(bytes, { worker: new Worker(silent), ...how }), "worker", unheard);
  await rejects(build(new URL("no-such.vtu", base), { workerUrl: silent, ...how }), "worker", /0\.3 s.*"tetralod\/build-worker"/);
  await rejects(inspect(new URL("no-such.vtu", base), { workerUrl: silent, ...how }), "worker", /0\.3 s.*"tetralod\/build-worker"/);
  for (const workerTimeoutMs of [-1, NaN, "soon"]) {
    await rejects(MultiTessellation.open(bytes, { workerTimeoutMs: /** @type {any} */ (workerTimeoutMs) }), "bad-option", /workerTimeoutMs/);
  }
  // The time is for the first answer: what comes later may take longer.
  const slow = `data:text/javascript,${encodeURIComponent(`
    import { parentPort } from "node:worker_threads";
    const answer = (id) => parentPort.postMessage({ id, result: { name: "core", version: "0.0.1" } });
    parentPort.on("message", ({ id, method }) => (method === "hello" ? answer(id) : setTimeout(answer, 6000, id)));`)}`;
  await rejects(MultiTessellation.open(bytes, { workerUrl: slow, workerTimeoutMs: 5000 }), "worker", /tetralod 0\.0\.1/);
  await works({ workerTimeoutMs: Infinity });
});

test("a wasm module that does not load is an error of configuration that names its address and what came", async () => {
  // In the caller's thread the module is there already.
  const open = (wasmUrl) => MultiTessellation.open(bytes, { wasmUrl });
  await rejects(open(`${base}/none.wasm`), "wasm", /none\.wasm: HTTP 404.*`wasmUrl`.*"tetralod\/core\.wasm"/);
  await rejects(open(`${base}/page.wasm`), "wasm", /page\.wasm: the server sends a page \(text\/html\)/);
  await rejects(open(`${base}/text.wasm`), "wasm", /did not load/);
  await rejects(open(at("none.wasm")), "wasm", /none\.wasm/);
});

test("impossible places are refused by name", async () => {
  const open = (how) => MultiTessellation.open(bytes, how);
  await rejects(open({ workerUrl: "worker.js" }), "bad-option", /`workerUrl`: worker\.js is not a URL/);
  await rejects(open({ wasmUrl: "core.wasm" }), "bad-option", /`wasmUrl`/);
  await rejects(open({ worker: /** @type {any} */ ("worker.js") }), "bad-option", /`worker`: must be/);
  await rejects(open({ worker: false, workerUrl: at("worker.js") }), "bad-option", /`workerUrl`/);
});

test("every entry is imported where there is no page, and says what is missing when it is used", async () => {
  const { exports } = JSON.parse(await readFile(at("package.json"), "utf8"));
  const entries = Object.entries(exports).map(([name, files]) => [name, files.default]);
  // Workers serve the thread that imports them.
  const imported = entries.filter(([name, file]) => file && !name.endsWith("worker"));
  assert.ok(imported.length >= 2);
  for (const [, file] of imported) await import(at(file).href);
  const { Viewer } = await import(at("viewer.js").href);
  await rejects(Viewer.create(/** @type {any} */ ({})), "no-webgpu", /MultiTessellation/);
});
