// The core in a browser, without a GPU: the same meshes as everywhere, in a worker and in the page, for each kind of MT. Runs in
// Chromium and in Firefox.
import assert from "node:assert/strict";
import { readFile } from "node:fs/promises";
import { after, before, test } from "node:test";
import { launch, servePackage } from "./browser.js";

const folder = process.env.TETRALOD_FIXTURE;
assert.ok(folder, "TETRALOD_FIXTURE is not set: run `cargo xtask test e2e`");

/** Files of the fixture, and what native code makes of them. */
const FILES = { "small.mt": "hashes.json", "small-edge.mt": "hashes-edge.json", "small-vertex.mt": "hashes-vertex.json" };

const PAGE = `<!doctype html><script type="importmap">
  { "imports": { "tetralod": "/pkg/index.js", "tetralod/viewer": "/pkg/viewer.js", "tetralod/inline": "/pkg/inline.js" } }
</script>`;

let browser;
let server;
let page;

before(async () => {
  server = await servePackage(async ({ url }, response) => {
    const name = url.slice(1);
    if (!Object.hasOwn(FILES, name)) return response.setHeader("content-type", "text/html").end(PAGE);
    return response.end(await readFile(`${folder}/${name}`));
  });
  browser = await launch();
  page = await browser.newPage();
  await page.goto(server.address);
});

after(async () => {
  await browser?.close();
  server?.close();
});

for (const [name, hashes] of Object.entries(FILES)) {
  test(`${name} gives the meshes of native code`, async () => {
    const cases = JSON.parse(await readFile(`${folder}/${hashes}`, "utf8"));
    assert.ok(cases.length > 2, "some requests");
    for (const [module, worker] of [
      ["tetralod", true],
      ["tetralod", false],
      ["tetralod/inline", true],
    ]) {
      const run = async ({ module, worker, name, requests }) => {
        const { MultiTessellation } = await import(module);
        const mt = await MultiTessellation.open(`/${name}`, { worker });
        const found = [];
        for (const request of requests) {
          await mt.refine(request);
          found.push(await mt.hash());
        }
        const { positions } = await mt.isosurface(mt.info.fields[0].min * 0.5 + mt.info.fields[0].max * 0.5);
        mt.free();
        return { found, points: positions.length };
      };
      const { found, points } = await page.evaluate(run, { module, worker, name, requests: cases.map(({ options }) => options) });
      assert.deepEqual(
        found,
        cases.map(({ hash }) => hash),
        `${module}, ${worker ? "in a worker" : "in the page"}`,
      );
      assert.ok(points > 0, "an isosurface");
    }
  });
}

test("one wasm file is loaded, whatever the kind of the file and whatever is asked of its mesh", async () => {
  for (const name of ["small.mt", "small-vertex.mt"]) {
    const fresh = await browser.newPage();
    await fresh.goto(server.address);
    const before = server.asked.length;
    await fresh.evaluate(async (name) => {
      const { MultiTessellation } = await import("tetralod");
      const mt = await MultiTessellation.open(`/${name}`);
      await mt.refine({ error: 0 });
      await mt.surface();
      await mt.isosurface(0.5);
      mt.free();
    }, name);
    const loaded = server.asked.slice(before).filter((file) => file.endsWith(".wasm"));
    await fresh.close();
    assert.deepEqual(loaded, ["tetralod_core_bg.wasm"], name);
  }
});

test("what was ended is refused by name", async () => {
  const code = await page.evaluate(async () => {
    const { MultiTessellation } = await import("tetralod");
    const mt = await MultiTessellation.open("/small.mt");
    const refined = mt.refine({ error: 0 }).then(
      () => "none",
      (error) => error.code,
    );
    mt.free();
    return refined;
  });
  assert.equal(code, "freed");
});

test("a browser without WebGPU and WebGL says so", async () => {
  const found = await page.evaluate(async () => {
    const { Viewer } = await import("tetralod/viewer");
    const adapter = await navigator.gpu?.requestAdapter();
    return {
      gpu: Boolean(adapter ?? new OffscreenCanvas(1, 1).getContext("webgl2")),
      answer: await Viewer.check().then(
        () => "drawn",
        (error) => `${error.code}: ${error.message}`,
      ),
    };
  });
  if (found.gpu) assert.equal(found.answer, "drawn");
  else assert.match(found.answer, /^no-webgpu: .*(WebGPU|adapter)/);
});
