// WebGL 2, which draws where there is no WebGPU: each picture beside that of WebGPU, in numbers and in `target/e2e/webgl/`. What Firefox
// draws with WebGL is compared with what Chromium has drawn with WebGPU before.
import assert from "node:assert/strict";
import { mkdir, readFile, writeFile } from "node:fs/promises";
import { after, before, test } from "node:test";
import { launch, PATIENCE, servePackage } from "./browser.js";
import { assertDrawn, differing, distance, study } from "./study.js";

const folder = process.env.TETRALOD_FIXTURE;
assert.ok(folder, "TETRALOD_FIXTURE is not set: run `cargo xtask test e2e`");
const pictures = new URL("../../target/e2e/webgl/", import.meta.url);
const { FIREFOX } = process.env;
const RENDERERS = FIREFOX ? ["webgl"] : ["webgpu", "webgl"];

const PAGE = `<!doctype html><style>canvas { width: 240px; height: 160px }</style><canvas id="webgpu"></canvas><canvas id="webgl"></canvas>
  <script type="importmap">{ "imports": { "tetralod": "/pkg/index.js", "tetralod/viewer": "/pkg/viewer.js" } }</script>`;

let browser;
let server;

before(async () => {
  await mkdir(pictures, { recursive: true });
  server = await servePackage(async ({ url }, response) => {
    const [, name] = /^\/([\w-]+)\.mt$/.exec(url) ?? [];
    if (name) response.end(await readFile(`${folder}/${name}.mt`));
    else response.setHeader("content-type", "text/html").end(PAGE);
  });
  browser = await launch();
});

after(async () => {
  await browser?.close();
  server?.close();
});

/** A page with a viewer of the file for each renderer, at the same mesh. */
async function opened(file) {
  const page = await browser.newPage();
  await page.goto(server.address);
  await page.evaluate(
    async ([file, renderers]) => {
      const { Viewer } = await import("tetralod/viewer");
      const viewers = [];
      const errors = [];
      for (const renderer of renderers) {
        const viewer = await Viewer.create(/** @type {HTMLCanvasElement} */ (document.getElementById(renderer)), { renderer, frameTime: Infinity });
        viewer.addEventListener("error", ({ detail }) => errors.push(`${renderer}: ${/** @type {any} */ (detail).code}: ${detail.message}`));
        await viewer.open(file, { state: { isosurfaces: [], shade: 0 }, request: { error: "5%" } });
        viewers.push(viewer);
      }
      Object.assign(window, { viewers, errors });
    },
    /** @type {const} */ ([file, RENDERERS]),
  );
  return page;
}

/** What WebGPU draws of a scene, and what WebGL does. */
async function drawn(page, name, scene) {
  const seen = [];
  const pngs = await page.evaluate(async (scene) => {
    const { viewers, errors } = /** @type {any} */ (window);
    errors.length = 0;
    const blank = { isosurfaces: [], slices: [], boundary: null, cells: null, streamlines: null, arrows: null, deform: null, clips: [] };
    const rest = { clipBox: null, colours: {}, background: null, outline: true, regions: null, threshold: null, region: null, volume: null };
    const all = [];
    for (const viewer of viewers) {
      await viewer.set({ ...blank, ...rest, ...scene });
      await viewer.settled();
      const bytes = new Uint8Array(await (await viewer.screenshot({ samples: 2 })).arrayBuffer());
      all.push({ renderer: viewer.renderer, bytes: btoa(Array.from(bytes, (byte) => String.fromCharCode(byte)).join("")) });
    }
    return all;
  }, scene);
  if (FIREFOX) seen.push(await study(page, await readFile(new URL(`${name}-webgpu.png`, pictures))));
  for (const { renderer, bytes } of pngs) {
    const png = Buffer.from(bytes, "base64");
    await writeFile(new URL(`${name}-${renderer}${FIREFOX ? "-firefox" : ""}.png`, pictures), png);
    seen.push(await study(page, png));
  }
  return seen;
}

/** Both renderers draw the same: the mean over all channels, of 255, and the share of pixels that differ by more than a little. */
function assertAlike(seen, name) {
  const [one, other] = seen;
  assertDrawn(one, name);
  const apart = distance(one, other);
  const channels = (pixel) => [0, 8, 16].map((shift) => (pixel >> shift) & 255);
  const far = one.pixels.filter((pixel, i) => channels(pixel).some((value, c) => Math.abs(value - channels(other.pixels[i])[c]) > 24)).length;
  console.log(`${name}: ${apart.toFixed(3)} of 255 apart, ${far} of ${one.pixels.length} far`);
  assert.ok(apart < 1.5 && far <= 0.01 * one.pixels.length, `${name}: ${apart.toFixed(2)} of 255 apart, ${far} of ${one.pixels.length} pixels far`);
}

const cut = { normal: [0, 0, 1], offset: 3.3 };
const FLOW = { fields: ["velocity_x", "velocity_y", "velocity_z"] };
const SEEDS = [1, 2, 3, 4, 5].flatMap((x) => [1, 3, 5].map((y) => [x, y, 3]));

/** Each mode, and the kinds of scenes that code of their own draws. */
const SCENES = {
  isosurface: { isosurfaces: [{ value: -1 }] },
  "isosurface-by-value": { isosurfaces: [{ value: -1, field: "velocity_x" }], colours: { map: "turbo", bands: 8 } },
  slice: { slices: [{ ...cut, edges: true }] },
  boundary: { boundary: {}, colours: { map: "magma" } },
  "boundary-clipped": { boundary: {}, clips: [{ normal: [0, -1, 0.2], offset: -2 }] },
  "clip-box": { boundary: { edges: true }, clipBox: [1, 0, 0, 5, 6, 4] },
  cells: { cells: {} },
  "cells-cut": { cells: { cut, colourBy: "size" } },
  "cells-clipped": { cells: {}, clips: [cut] },
  "cells-shrunk": { cells: { shrink: 0.4, cut } },
  wire: { cells: { shape: "wire", cut } },
  points: { cells: { shape: "points" } },
  streamlines: { streamlines: { ...FLOW, seeds: SEEDS } },
  arrows: { arrows: { ...FLOW, spacing: 1.5 } },
  deformed: { boundary: { edges: true }, deform: { field: "velocity", undeformed: true } },
  "deformed-isosurface": { isosurfaces: [{ value: -1 }], deform: { field: "velocity" } },
  "deformed-cells": { cells: {}, deform: { field: "velocity" } },
  threshold: { boundary: {}, threshold: { range: [-1.2, 0], cut: true } },
  "region-and-light-background": { slices: [cut], region: [1, 1, 1, 4, 5, 5], background: "light" },
  translucent: { isosurfaces: [-1.6, -1.2, -0.8, -0.4].map((value) => ({ value, opacity: 0.4 })), boundary: { opacity: 0.2 } },
  "translucent-among-opaque": {
    isosurfaces: [{ value: -1 }],
    slices: [{ ...cut, opacity: 0.5 }],
    boundary: { opacity: 0.15 },
    streamlines: { ...FLOW, seeds: SEEDS },
  },
};

test("WebGL draws each mode as WebGPU does", async () => {
  const page = await opened("/data/abc-flow.mt");
  const failed = [];
  let before;
  for (const [name, scene] of Object.entries(SCENES)) {
    const seen = await drawn(page, name, scene);
    const errors = await page.evaluate(() => /** @type {any} */ (window).errors);
    try {
      assert.deepEqual(errors, []);
      assertAlike(seen, name);
      if (before) assert.ok(differing(before, seen[0]) > 0.005, `${name} is another picture than the one before`);
    } catch (error) {
      failed.push(`${name}: ${error.message}`);
    }
    before = seen[0];
  }
  assert.deepEqual(failed, []);
  await page.close();
});

test("WebGL draws two meshes beside one another, their difference, and regions as WebGPU does", async () => {
  const page = await opened("/parts.mt");
  await page.evaluate(async () => {
    for (const viewer of /** @type {any} */ (window).viewers) {
      await viewer.keep();
      await viewer.refine({ error: "40%" });
    }
  });
  const cells = { cells: {}, colours: { map: "coolwarm" } };
  for (const [name, scene] of Object.entries({
    beside: { ...cells, compare: { at: 0.4 } },
    difference: { ...cells, compare: { at: 0, difference: true } },
    regions: { boundary: { colourBy: "region", regionOpacities: { 12: 0.3 } }, regions: ["1", "2", "11", "12"], compare: null },
  })) {
    const seen = await drawn(page, name, scene);
    assert.deepEqual(await page.evaluate(() => /** @type {any} */ (window).errors), []);
    assertAlike(seen, name);
  }
  await page.close();
});

test("WebGL says what draws, picks the same points, and refuses volumes while it draws all else", async () => {
  const page = await opened("/blocks-half-edge.mt");
  const scene = { isosurfaces: [{ value: 0.5 }], slices: [{ normal: [0, 0, 1], offset: 0.4, opacity: 0.5 }] };
  await drawn(page, "picked", scene);
  const seen = await page.evaluate(() => {
    const { viewers } = /** @type {any} */ (window);
    const points = [-0.4, -0.1, 0.1, 0.3].flatMap((x) => [-0.3, 0, 0.3].map((y) => [x, y]));
    // One after the other: picks that are faster than the worker replace each other.
    const all = async (viewer) => {
      const picked = [];
      for (const [x, y] of points) picked.push(await viewer.pick(x, y));
      return { renderer: viewer.renderer, picked };
    };
    return Promise.all(viewers.map(all));
  });
  assert.deepEqual(
    seen.map(({ renderer }) => renderer),
    RENDERERS,
  );
  assert.ok(seen[0].picked.filter(Boolean).length > 4, JSON.stringify(seen[0]));
  const picks = new URL("picks.json", pictures);
  if (!FIREFOX) await writeFile(picks, JSON.stringify(seen[0].picked));
  const expected = JSON.parse(await readFile(picks, "utf8"));
  for (const { picked } of seen) assert.deepEqual(JSON.parse(JSON.stringify(picked)), expected);

  const before = (await drawn(page, "without-volume", scene)).at(-1);
  const [after] = (await drawn(page, "with-volume", { ...scene, volume: {} })).slice(-1);
  assert.deepEqual(
    (await page.evaluate(() => /** @type {any} */ (window).errors)).map((error) => error.split(": ", 2).join(": ")),
    ["webgl: needs-webgpu"],
  );
  assert.ok(distance(before, after) < 0.1, "all else is drawn as before");
  await page.close();
});

test("a viewer draws with WebGL where there is no WebGPU, and with what it is asked for alone", async () => {
  const page = await browser.newPage();
  await page.goto(server.address);
  const seen = await page.evaluate(async () => {
    const { Viewer } = await import("tetralod/viewer");
    Object.defineProperty(navigator, "gpu", { value: undefined });
    const canvas = /** @type {HTMLCanvasElement} */ (document.getElementById("webgl"));
    const code = (promise) =>
      promise.then(
        () => "none",
        (error) => error.code,
      );
    const refused = await Promise.all([
      code(Viewer.create(canvas, { renderer: "webgpu" })),
      code(Viewer.create(canvas, { renderer: /** @type {any} */ ("vulkan") })),
    ]);
    await Viewer.check();
    const viewer = await Viewer.create(canvas);
    return { refused, renderer: viewer.renderer, isSoftware: viewer.isSoftware, adapter: viewer.adapter };
  });
  assert.deepEqual(seen.refused, ["no-webgpu", "bad-option"]);
  assert.equal(seen.renderer, "webgl");
  assert.ok(seen.adapter.length > 0);
  if (/SwiftShader|llvmpipe/.test(seen.adapter)) assert.equal(seen.isSoftware, true);
  await page.close();
});

/** Waits until something holds in a page; Playwright and Puppeteer have the words of this in different orders. */
const until = (page, holds, ...words) =>
  FIREFOX ? page.waitForFunction(holds, { timeout: PATIENCE }, ...words) : page.waitForFunction(holds, words[0], { timeout: PATIENCE });

test("the page draws with WebGL, says so, and why it draws no volume", async () => {
  const page = await browser.newPage();
  await page.goto(`${server.address}index.html?renderer=webgl&url=${encodeURIComponent("/data/abc-flow.mt")}`);
  await until(page, () => /complete|failed|unsupported/.test(/** @type {any} */ (window).tetralodDemo?.state));
  const seen = [];
  for (const mode of ["iso", "slice", "solid", "mesh", "flow"]) {
    const base64 = await page.evaluate(async (mode) => {
      /** @type {HTMLElement} */ (document.querySelector(`[name=mode][value=${mode}]`)).click();
      const { viewer } = /** @type {any} */ (window).tetralodDemo;
      await viewer.settled();
      const bytes = new Uint8Array(await (await viewer.screenshot({ samples: 1 })).arrayBuffer());
      return btoa(Array.from(bytes, (byte) => String.fromCharCode(byte)).join(""));
    }, mode);
    const png = Buffer.from(base64, "base64");
    await writeFile(new URL(`page-${mode}${FIREFOX ? "-firefox" : ""}.png`, pictures), png);
    seen.push(await study(page, png));
    assertDrawn(seen[seen.length - 1], mode);
    if (seen.length > 1) assert.ok(differing(seen[seen.length - 2], seen[seen.length - 1]) > 0.01, mode);
  }
  await writeFile(new URL(`page${FIREFOX ? "-firefox" : ""}.png`, pictures), await page.screenshot());
  const { renderer, said } = await page.evaluate(() => ({
    renderer: /** @type {any} */ (window).tetralodDemo.viewer.renderer,
    said: document.querySelector("#gpu")?.textContent ?? "",
  }));
  assert.equal(renderer, "webgl");
  assert.match(said, /no WebGPU: drawn with WebGL 2/);
  const turnTo = (mode) => page.evaluate((mode) => /** @type {HTMLElement} */ (document.querySelector(`[name=mode][value=${mode}]`)).click(), mode);
  const message = (isHidden) => until(page, (isHidden) => /** @type {HTMLElement} */ (document.querySelector("#message")).hidden === isHidden, isHidden);
  await turnTo("volume");
  await message(false);
  assert.match(
    await page.evaluate(() => document.querySelector("#message")?.textContent ?? ""),
    /Volumes are not drawn without WebGPU.*slices or an isosurface/s,
  );
  await turnTo("slice");
  await message(true);
  await page.close();
});
