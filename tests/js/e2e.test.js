// The demo page in a real browser, with WebGPU, on the demo's data. Screenshots go to `target/e2e/` for inspection.
import assert from "node:assert/strict";
import { readFile } from "node:fs/promises";
import { after, before, test } from "node:test";
import { fileURLToPath } from "node:url";
import { address, withoutGpu } from "./browser.js";
import {
  addressed,
  assertDrawn,
  assertLike,
  begin,
  demo,
  differing,
  distance,
  end,
  newPage,
  open,
  PATIENCE,
  picture,
  pictures,
  reach,
  setSlider,
  settle,
  show,
  still,
  study,
} from "./drive.js";

before(() => begin(0.6));

after(end);

test("the page streams a volume, draws it, and its settings change mesh and picture", async () => {
  const page = await open("data/bucky.mt");
  await reach(page, "complete");
  const info = await demo(page, "info");
  assert.ok(info.tetrahedra > 100_000);
  const [received, total, blocks] = [await demo(page, "receivedBytes"), await demo(page, "totalBytes"), await demo(page, "blocks")];
  assert.ok(received < total && blocks.here < blocks.all, `${received} of ${total} bytes for a part of the blocks`);

  const isSoftware = await page.evaluate(() => window.tetralodDemo.viewer.isSoftware);
  assert.equal((await page.innerText("#growth")).includes("drawn in software"), isSoftware, "it is said where there is no GPU");

  const surface = await picture(page, "isosurface");
  assertDrawn(surface);
  assertLike(surface, "isosurface");
  assert.ok((await demo(page, "frame")).triangles > 500);

  const coarse = await setSlider(page, "error", 90);
  const fine = await setSlider(page, "error", 40);
  assert.ok(coarse.tetrahedra < fine.tetrahedra, `${coarse.tetrahedra} < ${fine.tetrahedra}`);
  assert.ok(fine.relativeErrorBound < coarse.relativeErrorBound);
  const budgeted = await setSlider(page, "budget", 30);
  assert.ok(budgeted.tetrahedra < fine.tetrahedra);
  await setSlider(page, "budget", 100);

  await page.fill("#isovalue", "250");
  assert.ok(differing(surface, await picture(page, "isovalue")) > 0.01, "the isovalue changes the picture");

  let cut = surface;
  for (const view of ["Volume", "Slice", "Boundary", "Mesh"]) {
    await page.locator("label", { hasText: view }).first().click();
    const shown = await picture(page, view.toLowerCase());
    assertDrawn(shown);
    assertLike(shown, view.toLowerCase());
    assert.ok(differing(cut, shown) > 0.03, `${view} is another picture`);
    const labels = await page.locator("#legend-ticks span").allTextContents();
    assert.ok(labels.length >= 2 && new Set(labels).size === labels.length, `the colour bar has ticks: ${labels}`);
    cut = shown;
  }
  await page.selectOption("#colour-by", "depth");
  const depths = await picture(page, "depth");
  assert.ok(differing(cut, depths) > 0.03, "the depth of refinement has other colours");
  assertLike(depths, "depth");
  await page.waitForFunction(() => document.querySelector("#legend-name").textContent === "depth");
  await page.selectOption("#colour-by", "field");
  cut = await picture(page, "mesh-again");

  const canvas = await page.locator("#canvas").boundingBox();
  await page.mouse.move(canvas.x + 20, canvas.y + 20);
  await page.mouse.down();
  await page.mouse.move(canvas.x + 160, canvas.y + 60, { steps: 5 });
  await page.mouse.up();
  const turned = await picture(page, "turned");
  assert.ok(differing(cut, turned) > 0.01, "dragging turns the volume");
  await page.locator("#canvas").focus();
  await page.keyboard.press("ArrowLeft");
  assert.ok(differing(turned, await picture(page, "turned-by-key")) > 0.005, "the arrow keys turn the volume");

  const panel = await page.evaluate(() => {
    const { scrollWidth, clientWidth } = document.querySelector(".panel");
    return scrollWidth - clientWidth;
  });
  assert.ok(panel <= 0, `the settings are ${panel} pixels wider than their column`);
  await page.screenshot({ path: fileURLToPath(new URL("page.png", pictures)) });
  await page.locator("#tab-data").click();
  await page.locator("#n-blocks").scrollIntoViewIfNeeded();
  await page.screenshot({ path: fileURLToPath(new URL("page-numbers.png", pictures)) });
  assert.deepEqual(page.complaints, []);
  await page.close();
});

/** The block of a page in the repository that begins like this. */
async function block(page, start) {
  const text = await readFile(new URL(`../../${page}`, import.meta.url), "utf8");
  return text.slice(text.indexOf(start) + start.indexOf("\n") + 1).split("```")[0];
}

/** A page that draws, around the example of the package's README. */
const around = (code) => `<!doctype html>
<canvas style="width: 100%; height: 90vh"></canvas>
<script type="importmap">{ "imports": { "tetralod/viewer": "./pkg/viewer.js" } }</script>
<script type="module">${code}</script>`;

for (const [name, html] of [
  ["README", await block("README.md", "```html\n<!doctype html>")],
  ["README with the element", await block("README.md", "```html\n<script")],
  ["package's README", around(await block("pkg-template/README.md", "```js\nimport { Viewer }"))],
]) {
  test(`the page of the ${name} draws the volume`, async () => {
    const page = await newPage({ viewport: { width: 500, height: 500 } });
    const complaints = [];
    page.on("pageerror", (error) => complaints.push(String(error)));
    // The package and the volume are on the server; the page lies beside them.
    await page.route("**/readme.html", (route) => route.fulfill({ contentType: "text/html", body: html }));
    await page.route(/(bucky|combustor)\.mt$/, (route) => route.continue({ url: `${address()}data/bucky.mt` }));
    await page.goto(`${address()}readme.html`);
    // Until the picture shows the volume and does not change any more.
    let seen;
    for (let [before, still] = [[], 0]; still < 3; before = seen.pixels) {
      await page.waitForTimeout(500);
      const path = fileURLToPath(new URL(`${name.replaceAll(/\W/g, "-")}.png`, pictures));
      seen = await study(page, await page.locator("canvas").screenshot({ path }));
      still = seen.covered > 0.1 && String(seen.pixels) === String(before) ? still + 1 : 0;
    }
    assertDrawn(seen);
    assert.deepEqual(complaints, []);
    await page.close();
  });
}

test("the first picture is drawn before the file has arrived", async () => {
  const page = await open("data/bucky.mt?throttle=100000");
  await page.waitForFunction(() => window.tetralodDemo?.firstFrameBytes, undefined, { timeout: PATIENCE });
  const [first, state] = [await demo(page, "firstFrameBytes"), await demo(page, "state")];
  assert.equal(state, "streaming");
  assertDrawn(await picture(page, "streaming"));
  const total = await demo(page, "totalBytes");
  assert.ok(first < total / 2, `${first} of ${total} bytes had arrived`);
  await reach(page, "complete");
  assert.deepEqual(page.complaints, []);
  await page.close();
});

test("the page draws every dataset of the demo, of every kind of MT", async () => {
  const seen = {};
  for (const [name, kind, title] of [
    ["sphere-flow", "half-edge", "Flow past a sphere"],
    ["sphere-flow-edge", "edge", "Flow past a sphere (edge-based MT)"],
    ["sphere-flow-vertex", "vertex", "Flow past a sphere (vertex-based MT)"],
    ["bucky-small", "edge", "Small bucky ball (edge-based MT)"],
  ]) {
    const page = await open(`data/${name}.mt`);
    await reach(page, "complete");
    assert.equal((await demo(page, "info")).kind, kind);
    assert.equal(await page.locator("#volume option:checked").innerText(), title);
    const first = await picture(page, name);
    assertDrawn(first);
    assertLike(first, name);
    const coarse = await setSlider(page, "error", 90);
    seen[name] = await setSlider(page, "error", 0);
    assert.ok(coarse.tetrahedra < seen[name].tetrahedra, name);
    seen[name].picture = await still(page, `${name}-reference`);
    await page.screenshot({ path: fileURLToPath(new URL(`page-${name}.png`, pictures)) });
    assert.deepEqual(page.complaints, []);
    await page.close();
  }
  // Built from the same mesh, all kinds have the same reference mesh: up to the lattice, one picture.
  for (const other of ["sphere-flow-edge", "sphere-flow-vertex"]) {
    assert.equal(seen["sphere-flow"].tetrahedra, seen[other].tetrahedra);
    assert.ok(differing(seen["sphere-flow"].picture, seen[other].picture) < 0.02, other);
  }
});

test("a browser without WebGPU and WebGL gets a message, not a blank page", async () => {
  const page = await open("data/sphere-flow.mt", async (page) => {
    await page.addInitScript(withoutGpu);
    // Whoever made the volumes had a GPU.
    await page.route("**/data/volumes.json", async (route) => {
      const list = await (await route.fetch()).json();
      for (const volume of list.volumes) volume.picture = `${volume.url}.svg`;
      await route.fulfill({ json: list });
    });
    const body = '<svg xmlns="http://www.w3.org/2000/svg" width="9" height="9"/>';
    await page.route("**/*.mt.svg", (route) => route.fulfill({ contentType: "image/svg+xml", body }));
  });
  await reach(page, "unsupported");
  await page.locator("#poster").waitFor();
  assert.equal(await page.locator("#poster").getAttribute("src"), "data/sphere-flow.mt.svg", "a picture of what was asked for");
  assert.equal(await page.locator("#volume option:checked").innerText(), "Flow past a sphere");
  assert.ok(await page.locator("#open-gallery").isDisabled(), "nothing can be opened");
  const message = page.locator("#message");
  assert.ok(await message.isVisible());
  assert.match(await message.innerText(), /WebGPU/);
  await page.screenshot({ path: fileURLToPath(new URL("no-webgpu.png", pictures)) });
  await page.close();
});

test("the message about a missing or wrong file names the file", async () => {
  for (const [file, words] of /** @type {[string, RegExp][]} */ ([
    ["data/none.mt", /none\.mt.*404/],
    ["style.css", /style\.css.*not an MT file/i],
  ])) {
    const page = await open(file);
    await reach(page, "failed");
    assert.match(await page.locator("#message").innerText(), words);
    assert.equal(await page.innerText("#growth"), "", "nothing is being opened any more");
    assert.equal(await page.locator("#canvas").evaluate((canvas) => getComputedStyle(canvas).opacity), "0", "the background is that of the page");
    assert.ok(await page.locator("#retry").isHidden(), "the answer would be the same");
    await page.close();
  }
});

test("the mesh follows the camera, and stays within its budget", async () => {
  const page = await open("data/bucky.mt");
  await reach(page, "complete");
  await settle(page);
  const before = await demo(page, "stats");
  await page.evaluate(() => (window.tetralodDemo.stats = undefined));
  await page.locator("label", { hasText: "By screen error" }).click();
  await page.waitForFunction(() => window.tetralodDemo.stats, undefined, { timeout: PATIENCE });
  const seen = await setSlider(page, "pixels", 20);
  assert.ok(seen.satisfied && seen.bounds.length === 2 && seen.bounds[1] <= 0.76, JSON.stringify(seen));
  assertDrawn(await picture(page, "view"));
  await page.screenshot({ path: fileURLToPath(new URL("page-view.png", pictures)) });

  // Close up, the visible part needs a finer mesh and the rest a coarser one, without another request.
  const canvas = await page.locator("#canvas").boundingBox();
  await page.mouse.move(canvas.x + canvas.width / 2, canvas.y + canvas.height / 2);
  await page.evaluate(() => (window.tetralodDemo.stats = undefined));
  for (let i = 0; i < 3; i++) await page.mouse.wheel(0, -240);
  await page.waitForFunction(() => window.tetralodDemo.stats, undefined, { timeout: PATIENCE });
  await settle(page);
  const near = await demo(page, "stats");
  assert.ok(near.satisfied && near.tetrahedra !== seen.tetrahedra, `${near.tetrahedra} and ${seen.tetrahedra}`);
  assertDrawn(await picture(page, "view-near"));

  // The mesh does not depend on the earlier positions of the camera.
  await page.locator("#canvas").focus();
  for (const key of ["ArrowLeft", "ArrowUp", "ArrowLeft", "+", "ArrowRight"]) await page.keyboard.press(key);
  await settle(page);
  const hashes = await page.evaluate(async () => {
    const { viewer, request } = window.tetralodDemo;
    const followed = await viewer.hash();
    await viewer.refine({ error: "20%" });
    await viewer.refine(request);
    return [followed, await viewer.hash()];
  });
  assert.equal(hashes[0], hashes[1]);

  const budgeted = await setSlider(page, "budget", 40);
  assert.ok(!budgeted.satisfied && budgeted.tetrahedra < near.tetrahedra && budgeted.bounds[1] > 0.76);
  await page.screenshot({ path: fileURLToPath(new URL("page-view-budget.png", pictures)) });
  await setSlider(page, "budget", 100);

  await page.locator("label", { hasText: "By field error" }).click();
  await settle(page);
  assert.equal((await demo(page, "stats")).tetrahedra, before.tetrahedra);
  assert.deepEqual(page.complaints, []);
  await page.close();
});

test("each region that the page offers is refined", async () => {
  const page = await open("data/bucky.mt");
  await reach(page, "complete");
  const everywhere = await setSlider(page, "error", 20);
  const sizes = {};
  for (const region of ["box", "sphere", "cut"]) {
    await page.evaluate(() => (window.tetralodDemo.stats = undefined));
    await page.selectOption("#region", region);
    await page.waitForFunction(() => window.tetralodDemo.stats, undefined, { timeout: PATIENCE });
    sizes[region] = (await demo(page, "stats")).tetrahedra;
    assert.ok(sizes[region] < everywhere.tetrahedra, region);
    await page.locator("label", { hasText: "Mesh" }).first().click();
    await settle(page);
    await page.screenshot({ path: fileURLToPath(new URL(`page-region-${region}.png`, pictures)) });
  }
  assert.ok(sizes.sphere < sizes.box, "the sphere is in the box");
  assert.deepEqual(page.complaints, []);
  await page.close();
});

/** The small volume at a coarse mesh, so that pictures come soon, in a view of the page. */
async function openSmall(view = "Isosurface") {
  const page = await open("data/bucky-small.mt");
  await reach(page, "complete");
  await setSlider(page, "error", 70);
  await show(page, view);
  await settle(page);
  return page;
}

/** The middle of the canvas on the page. @returns {Promise<[number, number]>} */
async function middle(page) {
  const { x, y, width, height } = await page.locator("#canvas").boundingBox();
  return [x + width / 2, y + height / 2];
}

/** The boxes of elements on the screen. */
const boxes = (page, selector) =>
  page.locator(selector).evaluateAll((found) =>
    found
      .map((one) => one.getBoundingClientRect())
      .filter(({ width }) => width > 0)
      .map(({ left, top, right, bottom }) => ({ left, top, right, bottom })),
  );

/** That no label lies over another one or over the legend; how high the name of an axis is. */
async function assertLabelsAreFree(page, where) {
  const legend = await boxes(page, "#legend");
  const labels = await boxes(page, "#overlay .axis text, #overlay .scale-bar text");
  assert.ok(labels.length >= 5, `${where}: ${labels.length} labels`);
  const all = [...legend, ...labels];
  const overlaps = (a, b) => a.left < b.right - 1 && b.left < a.right - 1 && a.top < b.bottom - 3 && b.top < a.bottom - 3;
  for (const [i, one] of all.entries()) {
    for (const other of all.slice(i + 1)) assert.ok(!overlaps(one, other), `${where}: ${JSON.stringify([one, other])}`);
  }
  const [name] = await boxes(page, "#overlay .axis .name");
  return name.bottom - name.top;
}

test("axes are larger on large screens", async () => {
  const page = await openSmall("Slice");
  await settle(page);
  const height = await assertLabelsAreFree(page, "small");
  await page.setViewportSize({ width: 2600, height: 1200 });
  await settle(page);
  const large = await assertLabelsAreFree(page, "large");
  assert.ok(Math.abs(large / height - 1.5) < 0.1, `${large} and ${height} pixels`);
  await page.screenshot({ path: fileURLToPath(new URL("page-axes-large.png", pictures)) });
  await page.close();
});

test("axes, scale bar and cube lie over the picture, and labels over nothing", async () => {
  const page = await openSmall("Slice");
  for (const side of ["home", "alongX", "againstZ"]) {
    await page.selectOption("#side", side);
    await settle(page);
    await assertLabelsAreFree(page, side);
    await page.screenshot({ path: fileURLToPath(new URL(`page-axes-${side}.png`, pictures)) });
  }
  // A click on a face of the cube looks at it from the front.
  await page.selectOption("#side", "home");
  await settle(page);
  await page.locator("#overlay .face-z:not([hidden]) text").click();
  await settle(page);
  const { camera } = await page.evaluate(() => window.tetralodDemo.viewer.state);
  assert.ok(camera.pitch > 1.5, `from above: ${camera.pitch}`);
  await page.check("#orthographic");
  await settle(page);
  assert.equal(await page.evaluate(() => window.tetralodDemo.viewer.overlay.scaleBar.everywhere), true);
  await page.uncheck("#axes");
  assert.equal(await page.locator("#overlay .axis").count(), 0);
  await page.selectOption("#background", "light");
  await page.check("#axes");
  await settle(page);
  await page.screenshot({ path: fileURLToPath(new URL("page-light.png", pictures)) });
  assert.deepEqual(page.complaints, []);
  await page.close();
});

test("the pointer reads values, clicks keep probes, and two of them give a plot", async () => {
  const page = await openSmall("Slice");
  const canvas = await page.locator("#canvas").boundingBox();
  const at = (x, y) => /** @type {[number, number]} */ ([canvas.x + x * canvas.width, canvas.y + y * canvas.height]);
  await page.mouse.move(...at(0.5, 0.5));
  await page.locator("#readout").waitFor({ timeout: PATIENCE });
  assert.match(await page.locator("#readout").innerText(), /density\s+[\d.]+\s+position\s.*cell size\s.*cell error\s+[\d.]+ %/s);
  await page.mouse.click(...at(0.45, 0.5));
  await page.locator(".card").waitFor();
  await page.mouse.click(...at(0.4, 0.42));
  await page.locator("#plot path").waitFor();
  assert.equal(await page.locator(".card").count(), 2);
  const before = await boxes(page, ".pins circle");
  await page.locator("#canvas").focus();
  await page.keyboard.press("ArrowLeft");
  await settle(page);
  await page.screenshot({ path: fileURLToPath(new URL("page-probes.png", pictures)) });
  assert.notDeepEqual(await boxes(page, ".pins circle"), before, "probes follow the camera");
  // What the plot shows: the ends of the profile are the values of the probes.
  const [ends, outside, wrong] = await page.evaluate(async () => {
    const { viewer, info } = window.tetralodDemo;
    const [x0, y0, z0, x1, y1, z1] = info.bounds;
    const middle = [(x0 + x1) / 2, (y0 + y1) / 2, (z0 + z1) / 2];
    const corner = [x0 + (x1 - x0) / 8, y0 + (y1 - y0) / 8, z0 + (z1 - z0) / 8];
    const readings = [await viewer.reading(corner), await viewer.reading(middle)];
    const { at, values } = await viewer.line(corner, middle);
    const beyond = await viewer.line([x0 - 1, y0, z0], middle);
    const wrong = await viewer.line(corner, [1]).catch(({ code, message }) => [code, message]);
    const ends = [readings.map(({ values }) => values.density), at[0], values[0], values.at(-1)];
    return [ends, beyond.at[0] > 0, wrong];
  });
  assert.ok(Math.abs(ends[0][0] - ends[2]) < 1e-6 && Math.abs(ends[0][1] - ends[3]) < 1e-6 && ends[1] === 0, JSON.stringify(ends));
  assert.ok(outside, "there is no value outside");
  assert.equal(wrong[0], "bad-option");
  assert.match(wrong[1], /`to`/);
  // What is cut open is closed: the cut is in front of the boundary behind it. Cells are hit, too.
  for (const view of ["Boundary", "Mesh"]) {
    await show(page, view);
    await settle(page);
    const [found, cut] = await page.evaluate(async () => {
      const { viewer, info } = window.tetralodDemo;
      return [await viewer.pick(0, 0), (info.bounds[1] + info.bounds[4]) / 2];
    });
    assert.ok(Math.abs(found.position[1] - cut) < (view === "Boundary" ? 1e-6 : found.size), `${view}: ${JSON.stringify(found)}`);
  }
  await show(page, "Slice");
  await page.locator("#box-of-pins").click();
  assert.equal(await page.locator("#region").inputValue(), "box");
  await page.keyboard.press("Escape");
  assert.equal(await page.locator(".card").count(), 0);
  // A drag with Alt makes a box of what is at its ends.
  await page.selectOption("#region", "");
  await page.keyboard.down("Alt");
  await page.mouse.move(...at(0.4, 0.42));
  await page.mouse.down();
  await page.mouse.move(...at(0.55, 0.55), { steps: 3 });
  await page.mouse.up();
  await page.keyboard.up("Alt");
  await page.waitForFunction(() => document.querySelector("#region").matches(":has([value=box]:checked)"), undefined, { timeout: PATIENCE });
  assert.ok(await page.locator("#marquee").isHidden());
  assert.deepEqual(page.complaints, []);
  await page.close();
});

test("colours have ranges, and the transfer function is edited", async () => {
  const page = await openSmall("Boundary");
  const range = () => page.evaluate(() => window.tetralodDemo.viewer.legend.range);
  const whole = await range();
  await page.selectOption("#range-preset", "percentiles");
  await settle(page);
  const middle = await range();
  assert.ok(middle[0] > whole[0] && middle[1] < whole[1], `${middle} within ${whole}`);
  await page.selectOption("#range-preset", "symmetric");
  await settle(page);
  assert.equal((await range())[0], -whole[1]);
  await page.fill("#range-low", "0.25");
  await settle(page);
  assert.deepEqual(await range(), [0.25, Number(whole[1].toPrecision(5))]);
  await page.check("#log");
  await page.check("#reversed");
  await settle(page);
  assert.ok(await page.evaluate(() => window.tetralodDemo.viewer.legend.log));
  await page.selectOption("#range-preset", "data");
  await page.uncheck("#log");

  await show(page, "Volume");
  await page.locator("#transfer .volumes").waitFor();
  const opacities = () => page.evaluate(() => window.tetralodDemo.viewer.state.volume.opacities);
  const ramp = await opacities();
  await page.selectOption("#transfer-preset", "peak");
  assert.equal((await opacities()).length, ramp.length + 2);
  const editor = await page.locator("#transfer").boundingBox();
  // A press beside the points adds one, and takes it along.
  await page.mouse.move(editor.x + 0.2 * editor.width, editor.y + 0.5 * editor.height);
  await page.mouse.down();
  await page.mouse.move(editor.x + 0.25 * editor.width, editor.y + 0.3 * editor.height, { steps: 3 });
  await page.mouse.up();
  const added = await opacities();
  assert.equal(added.length, ramp.length + 3);
  assert.ok(added[1][1] > 0.6 && added[1][1] < 0.85, String(added[1]));
  await page.keyboard.press("ArrowDown");
  assert.ok((await opacities())[1][1] < added[1][1], "the keyboard moves points");
  await page.keyboard.press("Delete");
  assert.equal((await opacities()).length, ramp.length + 2);
  await page.locator("#transfer-add").click();
  assert.equal((await opacities()).length, ramp.length + 3);
  const volume = await picture(page, "transfer");
  assertDrawn(volume);
  assertLike(volume, "transfer");
  await page.screenshot({ path: fileURLToPath(new URL("page-transfer.png", pictures)) });
  assert.deepEqual(page.complaints, []);
  await page.close();
});

test("screenshots have any size and background, and leave the canvas as it is", async () => {
  const page = await openSmall();
  const [before, onScreen] = [await still(page, "before-screenshot"), await picture(page, "canvas-before-screenshot")];
  const seen = await page.evaluate(async () => {
    const { viewer } = window.tetralodDemo;
    const look = async (options) => {
      const image = await createImageBitmap(await viewer.screenshot(options));
      const context = new OffscreenCanvas(image.width, image.height).getContext("2d");
      context.drawImage(image, 0, 0);
      const pixel = (x, y) => Array.from(context.getImageData(x, y, 1, 1).data);
      return { size: [image.width, image.height], corner: pixel(2, 2), middle: pixel(image.width / 2, image.height / 2) };
    };
    const refused = await viewer.screenshot({ width: 0 }).catch(({ code }) => code);
    const huge = await viewer.screenshot({ width: 100_000, height: 8 }).catch(({ code }) => code);
    const light = await look({ width: 640, height: 360, samples: 4, background: "light" });
    const clear = await look({ width: 200, height: 300, samples: 1, background: "transparent" });
    return { light, clear, refused, huge, state: viewer.state.background };
  });
  assert.deepEqual(seen.light.size, [640, 360]);
  assert.ok(Math.min(...seen.light.corner) > 240, `light: ${seen.light.corner}`);
  assert.deepEqual(seen.clear.size, [200, 300]);
  assert.equal(seen.clear.corner[3], 0, "the background is transparent");
  assert.equal(seen.clear.middle[3], 255, "the surface is not");
  assert.equal(seen.refused, "bad-option");
  assert.equal(seen.huge, "bad-option");
  assert.ok(distance(onScreen, await picture(page, "canvas-after-screenshot")) < 1, "the canvas is as it was");
  assert.equal(differing(before, await still(page, "after-screenshot")), 0, "and so is what is drawn");
  const download = page.waitForEvent("download");
  await page.locator("#tab-export").click();
  await page.locator("#shot").click();
  assert.match((await download).suggestedFilename(), /^bucky-small-\d+x\d+\.png$/);
  assert.deepEqual(page.complaints, []);
  await page.close();
});

test("a mesh that was kept is shown beside the current one, or the difference of their fields", async () => {
  const page = await openSmall();
  const coarse = await still(page, "compare-coarse");
  await page.locator("#keep").click();
  await setSlider(page, "error", 0);
  const both = await still(page, "compare");
  /** How many of the sampled pixels of a half differ; the two pixels of the divider are hidden. */
  const differing = (left) => {
    const isHere = (i) => (97 * i) % both.width < both.width / 2 === left;
    return both.pixels.filter((pixel, i) => isHere(i) && pixel !== coarse.pixels[i]).length;
  };
  assert.equal(differing(true), 0, "on the left is the mesh that was kept");
  assert.ok(differing(false) > 20, "on the right the current one");
  await page.screenshot({ path: fileURLToPath(new URL("page-compare.png", pictures)) });
  await page.locator("#difference").check();
  await show(page, "Slice");
  await settle(page);
  assert.match(await page.textContent("#legend-name"), /^difference of density/);
  const [low, high] = await page.evaluate(() => window.tetralodDemo.viewer.legend.range);
  assert.ok(low === -high && high > 0, `${low} to ${high}`);
  assert.ok(await page.isHidden("#divider"), "all of the picture shows the difference");
  await page.screenshot({ path: fileURLToPath(new URL("page-difference.png", pictures)) });
  await page.locator("#difference").uncheck();
  await settle(page);
  assert.ok(await page.isVisible("#divider"));
  await page.locator("#keep").click();
  await settle(page);
  assert.ok(await page.isHidden("#divider"));
  assert.equal(await page.textContent("#legend-name"), "density");
  assert.deepEqual(page.complaints, []);
  await page.close();
});

test("the eye flies, and rotations run out unless less motion is asked for", async () => {
  const page = await openSmall();
  const camera = () => page.evaluate(() => window.tetralodDemo.viewer.state.camera);
  // The moves come 8 ms apart, and the pointer is let go of right behind the last one: so their times say, however busy the machine is.
  const swing = async () => {
    const canvas = await page.locator("#canvas").boundingBox();
    await page.mouse.move(canvas.x + 50, canvas.y + 60);
    await page.mouse.down();
    await page.waitForSelector("#canvas.turning");
    await page.evaluate(
      ([left, top]) => {
        const start = performance.now();
        const at = (name, x, i) => {
          const event = new PointerEvent(name, { clientX: left + x, clientY: top + 60, pointerId: 1, buttons: 1 });
          Object.defineProperty(event, "timeStamp", { value: start + 8 * i });
          document.querySelector("#canvas").dispatchEvent(event);
        };
        for (let i = 1; i < 8; i++) at("pointermove", 50 + 12 * i, i);
        at("pointerup", 50 + 12 * 7, 8);
      },
      [canvas.x, canvas.y],
    );
    await page.mouse.up();
    await settle(page);
    return camera();
  };
  const first = await camera();
  await page.emulateMedia({ reducedMotion: "reduce" });
  const still = await swing();
  // As far as the pointer went: 84 pixels.
  const height = await page.locator("#canvas").evaluate((canvas) => canvas.clientHeight);
  const turned = (from, to) => Math.abs(Math.atan2(Math.sin(to.yaw - from.yaw), Math.cos(to.yaw - from.yaw)));
  assert.ok(Math.abs(turned(first, still) - (3.2 * 84) / height) < 0.01, `${turned(first, still)}`);
  await page.emulateMedia({ reducedMotion: "no-preference" });
  await swing();
  // It goes on from frame to frame, and the first of these may be late.
  const goesOn = ([from, least]) => {
    const right = window.tetralodDemo.viewer.state.camera.yaw - from;
    return Math.abs(Math.atan2(Math.sin(right), Math.cos(right))) > least;
  };
  await page.waitForFunction(goesOn, [still.yaw, turned(first, still) + 0.005], { timeout: PATIENCE });
  await page.check("#fly");
  await page.locator("#canvas").focus();
  const start = await camera();
  await page.keyboard.down("w");
  await page.waitForFunction((target) => window.tetralodDemo.viewer.state.camera.target.some((x, i) => x !== target[i]), start.target, { timeout: PATIENCE });
  await page.keyboard.up("w");
  assert.deepEqual(page.complaints, []);
  await page.close();
});

test("a vector deforms what is drawn, by a factor or by itself, and swings", async () => {
  const page = await open("data/abc-flow.mt");
  await reach(page, "complete");
  await show(page, "Boundary");
  const rest = await picture(page, "rest");
  await page.locator("#canvas").focus();
  await page.keyboard.press("d");
  const bent = await picture(page, "deformed");
  assertDrawn(bent);
  assert.ok(differing(rest, bent) > 0.02, "it is another shape");
  const deformation = () => page.evaluate(() => window.tetralodDemo.viewer.overlay.deformation);
  const { factor, part } = await deformation();
  assert.ok(factor > 0 && part === 1);
  assert.match(await page.innerText("#times-text"), /^Automatic: [\d.]+ times/);
  await page.fill("#times", String(2 * factor));
  await page.keyboard.press("Enter");
  await page.check("#undeformed");
  const twice = await picture(page, "deformed-twice");
  assert.ok(differing(bent, twice) > 0.02, "by more, and with the shape of before");
  assert.match(await page.evaluate(() => location.hash), /deform=velocity&times=.*&undeformed=1/);
  // A probe is where the shape is, and says where that is without displacement.
  await page.mouse.click(...(await middle(page)));
  await page.locator(".card").waitFor({ timeout: PATIENCE });
  const [x, y] = await page.evaluate(() => ["cx", "cy"].map((name) => Number(document.querySelector(".pins circle").getAttribute(name))));
  const { width, height } = await page.locator("#canvas").boundingBox();
  assert.ok(Math.abs(x - width / 2) < 3 && Math.abs(y - height / 2) < 3, `${x}, ${y} of ${width}, ${height}`);
  await page.keyboard.press("Escape");
  await page.click("#swing");
  await page.waitForFunction(() => window.tetralodDemo.viewer.overlay.deformation.part < 0.5, undefined, { timeout: PATIENCE });
  assert.equal(await page.getAttribute("#swing", "aria-pressed"), "true");
  await page.click("#swing");
  await page.waitForFunction(() => window.tetralodDemo.viewer.overlay.deformation.part === 1, undefined, { timeout: PATIENCE });
  await page.selectOption("#deform", "");
  await page.waitForFunction(() => !window.tetralodDemo.viewer.overlay.deformation, undefined, { timeout: PATIENCE });
  assert.deepEqual(page.complaints, []);
  await page.close();
});

test("a flow has streamlines, arrows and time steps that play", async () => {
  const page = await open("data/bucky-small.mt");
  await reach(page, "complete");
  assert.ok(await page.locator("#flow").isDisabled(), "there are no vectors");
  await page.close();

  const flow = await open("data/abc-flow.mt");
  await reach(flow, "complete");
  await show(flow, "Flow");
  const tubes = await picture(flow, "flow");
  assertDrawn(tubes);
  assertLike(tubes, "flow");
  assert.match(await flow.locator("#legend-name").innerText(), /^speed in m\/s$/);
  const seeds = () => flow.evaluate(() => window.tetralodDemo.viewer.state.streamlines.seeds.length);
  assert.equal(await seeds(), 64);
  await flow.mouse.click(...(await middle(flow)));
  await flow.waitForFunction(() => window.tetralodDemo.viewer.state.streamlines.seeds.length === 65);
  const placed = await flow.evaluate(() => window.tetralodDemo.viewer.state.streamlines.seeds[64]);
  assert.ok(Math.abs(placed[1] - Math.PI) < 1e-6, `on the plane: ${placed}`);
  await flow.locator("#no-seeds").click();
  await flow.check("#arrows");
  await flow.selectOption("#flow-colour", "field");
  const arrows = await picture(flow, "arrows");
  assert.ok(differing(tubes, arrows) > 0.03, "there are arrows");
  assertLike(arrows, "arrows");
  assert.equal(await flow.locator("#legend-name").innerText(), "pressure");
  await flow.uncheck("#arrows");
  await flow.screenshot({ path: fileURLToPath(new URL("page-flow.png", pictures)) });

  // Each step has vectors of its own; the one that comes next is refined with it.
  const first = await picture(flow, "flow-step");
  await setSlider(flow, "time", 2);
  assert.ok(differing(first, await picture(flow, "flow-later")) > 0.01, "other vectors");
  // A step may be over before a slow page is asked again.
  await flow.evaluate(() => {
    const text = document.querySelector("#time-text");
    const seen = (window.stepsSeen = new Set());
    new MutationObserver(() => seen.add(text.textContent)).observe(text, { childList: true, characterData: true, subtree: true });
  });
  await flow.locator("#play").click();
  await flow.waitForFunction(() => window.stepsSeen.has("5"), undefined, { timeout: PATIENCE });
  assert.equal((await demo(flow, "request")).needs.length, 1);
  await flow.locator("#play").click();
  assert.equal(await flow.locator("#play").innerText(), "Play");
  assert.deepEqual(flow.complaints, []);
  await flow.close();
});

test("the package runs in a worker of the page, without a viewer", async () => {
  const page = await open("data/bucky.mt");
  await reach(page, "complete");
  const seen = await page.evaluate(async () => {
    const { MultiTessellation, applyChanges } = await import("tetralod");
    const mt = await MultiTessellation.open("data/bucky.mt");
    const { stats, tets } = await mt.refine({ error: "5%", maxTets: 20_000 });
    const one = await mt.hash();
    await mt.refine({ error: "0%" });
    await mt.refine({ error: "5%", maxTets: 20_000 });
    const two = await mt.hash();
    // Deltas over a walk of a box, in steps and whole.
    const at = (place) => place.map((x, i) => mt.info.bounds[i] + x * (mt.info.bounds[i + 3] - mt.info.bounds[i]));
    const mesh = await mt.refine({ error: "100%" });
    let followed = true;
    for (let i = 0; i < 12; i++) {
      const [lower, upper] = [
        [0.1 + 0.05 * i, 0.2, 0.2],
        [0.3 + 0.05 * i, 0.5, 0.5],
      ];
      const options = { error: "0.5%", box: [...at(lower), ...at(upper)] };
      const updates = 200 + 500 * i;
      for await (const step of mt.refineSteps(options, { deltas: true, updates })) applyChanges(mesh, step);
      if (i % 3 > 0) continue;
      const full = await mt.refine(options);
      mesh.changes = full.changes;
      for (const name of ["positions", "field", "tets", "neighbors"]) {
        followed &&= full[name].length === mesh[name].length && full[name].every((x, i) => x === mesh[name][i]);
      }
    }
    // Errors name the option, or what to do.
    const { Viewer } = await import("tetralod/viewer");
    const canvas = document.createElement("canvas");
    const viewer = await Viewer.create(canvas);
    const flat = await viewer.set({ clips: [{ normal: [0, 0, 0], offset: 1 }] }).catch(({ message }) => message);
    viewer.free();
    // The canvas can be used again.
    const again = await Viewer.create(canvas);
    again.free();
    const abort = new AbortController();
    abort.abort();
    const aborted = await MultiTessellation.open("data/bucky.mt", { signal: abort.signal }).catch((error) => error.name);
    mt.free();
    return { tetrahedra: stats.tetrahedra, length: tets.length, same: one === two, followed, aborted, flat };
  });
  assert.ok(seen.tetrahedra > 0 && seen.tetrahedra <= 20_000);
  assert.match(seen.flat, /`clips\[0\]`/);
  assert.equal(seen.length, 4 * seen.tetrahedra);
  assert.ok(seen.same, "the same request gives the same mesh from wherever one starts");
  assert.ok(seen.followed, "deltas add up to the mesh");
  assert.equal(seen.aborted, "AbortError");
  await page.close();
});

test("the address has the whole state: a reload gives the same picture, undo and redo go back and forth", async () => {
  const page = await openSmall();
  const first = await still(page, "state-first");
  await page.fill("#isovalue", "250");
  await addressed(page, /isovalue=/);
  await show(page, "Boundary");
  await page.selectOption("#map", "magma");
  await page.selectOption("#region", "box");
  await addressed(page, /view=solid.*map=magma.*region=box/);
  await page.locator("#canvas").focus();
  for (const key of ["ArrowLeft", "ArrowUp", "+"]) await page.keyboard.press(key);
  await addressed(page, /camera=/);
  const before = await still(page, "state-before");
  const [address, request] = [page.url(), await demo(page, "request")];
  await page.reload();
  await reach(page, "complete");
  assert.equal(differing(before, await still(page, "state-after")), 0, "the same picture");
  assert.deepEqual(await demo(page, "request"), request);
  await settle(page);
  assert.equal(page.url(), address, "the state stays as it was");

  // Another page with the copied link shows the same, and steps of what is done there are undone.
  await page.locator("#share").click();
  await page.locator("#note").waitFor();
  await page.selectOption("#map", "viridis");
  await page.waitForFunction(() => !location.hash.includes("magma"), undefined, { timeout: PATIENCE });
  await page.locator("#undo").click();
  assert.equal(page.url(), address);
  assert.equal(await page.inputValue("#map"), "magma");
  assert.ok(await page.locator("#undo").isDisabled(), "there is no more to undo");
  await page.keyboard.press("Control+Shift+Z");
  assert.equal(await page.inputValue("#map"), "viridis");
  await page.keyboard.press("Control+Z");
  assert.equal(differing(before, await still(page, "state-undone")), 0, "the same picture again");
  await page.locator("#reset").click();
  await page.waitForFunction(() => location.hash === "", undefined, { timeout: PATIENCE });
  await setSlider(page, "error", 70);
  assert.ok(differing(first, await still(page, "state-reset")) < 0.005, "the first picture");

  // The isovalue carries over by value.
  await page.fill("#isovalue", "250");
  const value = await page.textContent("#isovalue-text");
  await page.selectOption("#volume", "data/bucky.mt");
  await reach(page, "complete");
  assert.equal(Number(await page.textContent("#isovalue-text")).toFixed(2), Number(value).toFixed(2));
  await addressed(page, /url=data\/bucky.mt.*isovalue=/);
  assert.deepEqual(page.complaints, []);
  await page.close();
});
