// The viewer in a real browser: its mesh as arrays, a mesh that stays, fewer tetrahedra while something moves, a GPU that is lost.
import assert from "node:assert/strict";
import { readFile } from "node:fs/promises";
import { after, before, test } from "node:test";
import { launch, servePackage } from "./browser.js";
import { assertDrawn, distance, study } from "./study.js";

const folder = process.env.TETRALOD_FIXTURE;
assert.ok(folder, "TETRALOD_FIXTURE is not set: run `cargo xtask test e2e`");
const file = await readFile(`${folder}/blocks-half-edge.mt`);

const PAGE = `<!doctype html><style>canvas { width: 300px; height: 200px }</style><canvas></canvas>
  <script type="importmap">{ "imports": { "tetralod": "/pkg/index.js", "tetralod/viewer": "/pkg/viewer.js" } }</script>`;

let browser;
let server;
/** Paths that were asked for. */
let asked = [];

before(async () => {
  server = await servePackage(({ url }, response) => {
    asked.push(url);
    if (url === "/model.mt") response.end(file);
    else response.setHeader("content-type", "text/html").end(PAGE);
  });
  browser = await launch();
});

after(async () => {
  await browser?.close();
  server?.close();
});

/** A page with a viewer of the file, at full resolution. */
async function opened(options = {}) {
  const page = await browser.newPage();
  await page.goto(server.address);
  await page.evaluate(async (options) => {
    const { Viewer } = await import("tetralod/viewer");
    const viewer = await Viewer.create(document.querySelector("canvas"), options);
    const events = [];
    window.tetralodDemo = { viewer, events };
    for (const name of ["error", "restored", "stats", "frame"]) {
      viewer.addEventListener(name, (event) => events.push({ name, detail: /** @type {CustomEvent} */ (event).detail }));
    }
    await viewer.open("/model.mt");
    window.tetralodDemo.full = await viewer.refine({ error: 0 });
  }, options);
  return page;
}

test("what a viewer gives of its mesh is what MultiTessellation gives, with one module and one download", async () => {
  const page = await opened();
  const own = () => page.evaluate(async () => {
    const mt = window.tetralodDemo.mt ?? window.tetralodDemo.viewer;
    const { positions } = await mt.slice([0, 0, 1], 0.5);
    const [[p], line, surface, lines] = [
      await mt.probe([0.5, 0.5, 0.5]), await mt.line([0, 0, 0], [1, 1, 1]), await mt.surface(), await mt.isosurface(0.5),
    ];
    const { volume, histogram } = await mt.stats({ bins: 4 });
    const sizes = [positions, line.at, surface.indices, lines.positions, lines.normals].map((array) => array.length);
    return JSON.stringify({ sizes, p, volume, bins: Array.from(histogram), hash: await mt.hash() });
  });
  asked = [];
  const ofViewer = await own();
  assert.ok(JSON.parse(ofViewer).sizes.every((size) => size > 0), ofViewer);
  assert.deepEqual(asked, [], "nothing is downloaded again");
  assert.deepEqual(server.asked.filter((name) => name.endsWith(".wasm")), ["tetralod_viewer_bg.wasm"], "one module");
  const same = await page.evaluate(async () => {
    const { MultiTessellation } = await import("tetralod");
    window.tetralodDemo.mt = await MultiTessellation.open("/model.mt");
    const whole = await window.tetralodDemo.mt.refine({ error: 0 });
    const shown = await window.tetralodDemo.viewer.mesh();
    return ["positions", "field", "tets", "neighbors"].map((name) => whole[name].length === shown[name].length);
  });
  assert.deepEqual(same, [true, true, true, true]);
  assert.equal(await own(), ofViewer);
  const codes = await page.evaluate(() => {
    const code = (promise) => promise.then(() => "none", (error) => error.code);
    const { viewer } = window.tetralodDemo;
    return Promise.all([viewer.probe([1, 2]), viewer.stats({ bin: 1 }), viewer.slice([0, 0, 0], 1)].map(code));
  });
  assert.deepEqual(codes, ["bad-option", "bad-option", "bad-option"]);
  await page.close();
});

test("a frozen mesh stays, and catches up afterwards", async () => {
  const page = await opened();
  const counts = await page.evaluate(async () => {
    const { viewer } = window.tetralodDemo;
    const before = await viewer.hash();
    await viewer.freeze();
    const waiting = viewer.refine({ error: "20%" });
    await viewer.orbit(0.3, 0.1);
    await new Promise((resolve) => setTimeout(resolve, 400));
    const frozen = await viewer.hash();
    await viewer.freeze(false);
    const { tetrahedra } = await waiting;
    return { same: before === frozen, tetrahedra, full: window.tetralodDemo.full.tetrahedra };
  });
  assert.ok(counts.same, "it stays");
  assert.ok(counts.tetrahedra < counts.full / 2, JSON.stringify(counts));
  await page.close();
});

test("where pictures take too long the mesh is coarser while something moves, and whole at rest", async () => {
  // No adapter draws a picture in a millisecond, with all that is around it.
  const page = await opened({ frameTime: 1 });
  const seen = await page.evaluate(async () => {
    const { viewer, events } = window.tetralodDemo;
    const before = await viewer.hash();
    const least = () => Math.min(...events.filter(({ name }) => name === "stats").map(({ detail }) => detail.tetrahedra));
    events.length = 0;
    for (let i = 0; i < 300 && !(least() < window.tetralodDemo.full.tetrahedra / 2); i++) {
      await viewer.orbit(0.05, 0);
      await new Promise(requestAnimationFrame);
    }
    // On a busy machine there may be time for the whole mesh between two movements.
    const { full } = window.tetralodDemo;
    const done = events.filter(({ name, detail }) => name === "stats" && detail.done);
    const early = done.filter(({ detail }) => detail.tetrahedra !== full.tetrahedra).length;
    const moving = least();
    await new Promise((resolve) => viewer.addEventListener("stats", ({ detail }) => detail.done && resolve(detail)));
    return { early, moving, full: full.tetrahedra, same: before === (await viewer.hash()) };
  });
  assert.ok(seen.moving < seen.full / 2, JSON.stringify(seen));
  assert.equal(seen.early, 0, "a mesh for movement is not the one that was asked for");
  assert.ok(seen.same, "at rest it is what was asked for");
  await page.close();
});

test("a GPU that is lost is opened again, and draws what it drew", async () => {
  const page = await opened();
  const show = (isosurfaces) => page.evaluate((scene) => window.tetralodDemo.viewer.set(scene), { isosurfaces, outline: false });
  /** What the viewer draws with a fixed number of samples, byte for byte. */
  const drawn = () => page.evaluate(async () => {
    const bytes = new Uint8Array(await (await window.tetralodDemo.viewer.screenshot({ samples: 4 })).arrayBuffer());
    return String(bytes);
  });
  /** What is on the screen. How often a picture was drawn again for smooth edges depends on the speed of the machine. */
  const picture = async () => study(page, await page.locator("canvas").first().screenshot());
  const pictureWhere = async (holds) => {
    for (const until = Date.now() + 30_000; ; ) {
      const seen = await picture();
      if (holds(seen)) return seen;
      assert.ok(Date.now() < until, `${holds} does not hold within 30 s`);
    }
  };
  await show([]);
  await drawn();
  const empty = await picture();
  await show([{ value: 0.4 }]);
  const before = await drawn();
  // A canvas comes to the screen later than its frames are drawn.
  const onScreen = await pictureWhere((seen) => distance(seen, empty) > 4);
  assertDrawn(onScreen, "before");
  const session = await browser.newBrowserCDPSession();
  await session.send("Browser.crashGpuProcess").catch(() => {});
  await page.waitForFunction(() => window.tetralodDemo.events.some(({ name }) => name === "restored"), undefined, { timeout: 60_000 });
  assert.ok((await drawn()) === before, "the same is drawn");
  await pictureWhere((seen) => distance(seen, onScreen) < 1);
  const errors = await page.evaluate(() => window.tetralodDemo.events.filter(({ name }) => name === "error").length);
  assert.equal(errors, 0);
  await page.close();
});
