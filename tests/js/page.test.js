// The demo page as a person uses it: gallery, keyboard, phone, a lost network, files that are saved; and that it is accessible.
import assert from "node:assert/strict";
import { readFile } from "node:fs/promises";
import { createRequire } from "node:module";
import { after, before, test } from "node:test";
import { fileURLToPath } from "node:url";
import { addressed, assertDrawn, begin, demo, differing, end, open, PATIENCE, picture, pictures, reach, setSlider, settle, show } from "./drive.js";

before(begin);

after(end);

const SMALL = "data/bucky-explicit.mt";
/** Software draws large pictures slowly. */
const VIEWPORT = { viewport: { width: 900, height: 620 } };

const screenshot = (page, name) => page.screenshot({ path: fileURLToPath(new URL(`${name}.png`, pictures)) });

/** Presses a key outside of the picture. */
async function press(page, key) {
  await page.evaluate(() => document.activeElement instanceof HTMLElement && document.activeElement.blur());
  await page.keyboard.press(key);
}

test("all is reached with keys, and the list of keys has them", async () => {
  const page = await open(SMALL, undefined, VIEWPORT);
  await reach(page, "complete");
  for (const [key, view] of [["3", "slice"], ["5", "mesh"], ["1", "iso"]]) {
    await press(page, key);
    assert.equal(await page.locator("[name=mode]:checked").getAttribute("value"), view);
  }
  await press(page, "n");
  assert.ok(await page.locator("#data-panel").isVisible());
  await press(page, "i");
  assert.equal(await page.evaluate(() => document.activeElement?.id), "isovalue");
  const before = await page.textContent("#isovalue-text");
  await page.keyboard.press("ArrowRight");
  assert.notEqual(await page.textContent("#isovalue-text"), before);
  await press(page, "v");
  assert.equal(await page.evaluate(() => document.activeElement?.id), "canvas");
  await press(page, "?");
  const listed = await page.locator("#keys-list").innerText();
  for (const words of ["rotate", "undo", "full screen", "copy the link", "Slice", "gallery"]) assert.ok(listed.includes(words), words);
  await screenshot(page, "page-keys");
  await page.keyboard.press("Escape");
  assert.ok(await page.locator("#keys").isHidden());
  await press(page, "o");
  assert.ok(await page.locator("#gallery").isVisible());
  await page.keyboard.press("Escape");

  // The isovalue is a handle on the histogram, too; values carry over, and an empty surface says so.
  const histogram = await page.locator("#histogram").boundingBox();
  await page.mouse.click(histogram.x + histogram.width / 4, histogram.y + 20);
  assert.ok(Math.abs(Number(await page.inputValue("#isovalue")) - 240) < 20, await page.inputValue("#isovalue"));
  await page.evaluate(() => (location.hash = "#isovalue=99"));
  await page.locator("#empty").waitFor({ timeout: PATIENCE });
  assert.match(await page.innerText("#empty"), /99 is outside of the range of density/);
  await screenshot(page, "page-empty");
  await page.click("#empty-middle");
  await page.locator("#empty").waitFor({ state: "hidden", timeout: PATIENCE });

  // The region that is a sphere is drawn as one.
  await page.selectOption("#region", "sphere");
  await page.waitForFunction(() => document.querySelectorAll("#overlay .sphere polyline").length === 3, undefined, { timeout: PATIENCE });
  assert.match(await page.innerText("#budget-achieved"), /Achieved: [\d,]+ tetrahedra\. Limited by/);
  assert.deepEqual(page.complaints, []);
  await page.close();
});

test("the page has no accessibility violations, light or dark", async () => {
  const page = await open(SMALL, undefined, VIEWPORT);
  await reach(page, "complete");
  await page.addScriptTag({ content: await readFile(createRequire(import.meta.url).resolve("axe-core/axe.min.js"), "utf8") });
  const check = async (name) => {
    const found = await page.evaluate(async () => {
      const { violations } = await /** @type {any} */ (window).axe.run(document, { resultTypes: ["violations"] });
      return violations.map(({ id, nodes }) => `${id}: ${nodes.map(({ html, failureSummary }) => `${html} ${failureSummary}`).join("; ")}`);
    });
    assert.deepEqual(found, [], name);
  };
  const dialog = async (name, id, key) => {
    await press(page, key);
    await check(name);
    await screenshot(page, `page-${id}-${name.replace(/\W/g, "-")}`);
    await page.keyboard.press("Escape");
  };
  for (const colorScheme of /** @type {const} */ (["dark", "light"])) {
    await page.emulateMedia({ colorScheme });
    for (const view of ["Surface", "Volume", "Slice", "Mesh"]) {
      await press(page, "g");
      await show(page, view);
      await check(`${view}, ${colorScheme}`);
    }
    await press(page, "n");
    await check(`data, ${colorScheme}`);
    await press(page, "x");
    await check(`export, ${colorScheme}`);
    await dialog(`keys, ${colorScheme}`, "keys", "?");
    await dialog(`gallery, ${colorScheme}`, "gallery", "o");
  }
  assert.deepEqual(page.complaints, []);
  await page.close();
});

test("the gallery opens scenes with the counts of the paper, and files are opened by address and drop", async () => {
  const page = await open(SMALL, undefined, VIEWPORT);
  await reach(page, "complete");
  await page.click("#open-gallery");
  await page.locator("#gallery li").first().waitFor();
  const cards = await page.locator("#gallery li").allInnerTexts();
  assert.ok(cards.length >= 5 && cards.every((card) => /tetrahedra, [\d.]+\sMB as VTU, .*as MT/.test(card)), String(cards));
  const choose = async (title) => {
    await page.evaluate(() => (window.tetralodDemo.stats = undefined));
    await page.locator("#gallery li", { hasText: title }).click();
    await page.waitForFunction(() => window.tetralodDemo.stats, undefined, { timeout: PATIENCE });
    await reach(page, "complete");
    return (await demo(page, "stats")).tetrahedra;
  };
  assert.equal(await choose("Figure 6"), 74_236);
  await settle(page);
  assert.equal(await demo(page, "stats").then(({ tetrahedra }) => tetrahedra), 74_236);
  assert.equal(await page.evaluate(async () => (await window.tetralodDemo.viewer.isosurface(0.81)).indices.length / 3), 18_206);
  await screenshot(page, "page-figure-6");
  await page.click("#open-gallery");
  assert.equal(await choose("Figure 7"), 155_875);

  await page.click("#open-gallery");
  await page.fill("#url", SMALL);
  await page.keyboard.press("Enter");
  await page.waitForFunction(() => window.tetralodDemo.info?.kind === "explicit", undefined, { timeout: PATIENCE });
  await page.evaluate(async () => {
    const bytes = await (await fetch("data/sphere-flow-vertex.mt")).arrayBuffer();
    const dataTransfer = new DataTransfer();
    dataTransfer.items.add(new File([bytes], "dropped.mt"));
    window.dispatchEvent(new DragEvent("drop", { dataTransfer, cancelable: true }));
  });
  await page.waitForFunction(() => window.tetralodDemo.info?.kind === "vertex", undefined, { timeout: PATIENCE });
  await addressed(page, /url=file/);
  assert.equal(await page.locator("#volume option:checked").innerText(), "dropped.mt");
  assert.deepEqual(page.complaints, []);
  await page.close();
});

test("a phone shows the picture while a control is moved, and keeps the state when it is turned", async () => {
  const options = { viewport: { width: 360, height: 640 }, hasTouch: true, isMobile: true };
  const page = await open(SMALL, undefined, options);
  await reach(page, "complete");
  await page.locator("#focus").scrollIntoViewIfNeeded();
  const seen = async () => {
    const [stage, control] = [await page.locator("#canvas").boundingBox(), await page.locator("#focus").boundingBox()];
    const { width, height } = page.viewportSize();
    return stage.y >= 0 && stage.y + stage.height <= height && stage.width <= width && control.y >= 0 && control.y < height;
  };
  assert.ok(await seen(), "picture and control at once");
  const wide = () =>
    page.evaluate(() => [document.documentElement, ...document.querySelectorAll(".panel:not([hidden]), header, .tools button, .tabs button, .segments span")]
      .filter(({ scrollWidth, clientWidth }) => scrollWidth > clientWidth + 1)
      .map(({ outerHTML }) => outerHTML.slice(0, 80)));
  assert.deepEqual(await wide(), [], "nothing is cut");
  for (const tab of ["data", "export", "settings"]) {
    await page.tap(`#tab-${tab}`);
    await screenshot(page, `page-phone-${tab}`);
    assert.deepEqual(await wide(), [], tab);
  }
  await page.check("#focus");
  await page.selectOption("#axis", "0", { force: true });
  await addressed(page, /focus=1/);
  const address = page.url();
  await page.setViewportSize({ width: 740, height: 360 });
  await settle(page);
  assert.ok(await page.isChecked("#focus"));
  assert.deepEqual(await wide(), [], "on its side");
  await page.locator("#focus").scrollIntoViewIfNeeded();
  assert.ok(await seen(), "on its side, too");
  assert.equal(page.url(), address);
  assertDrawn(await picture(page, "phone-side"));
  await screenshot(page, "page-phone-side");
  assert.deepEqual(page.complaints, []);
  await page.close();
});

test("a lost network keeps the picture, and the download continues", async () => {
  const page = await open("data/sphere-flow.mt", undefined, VIEWPORT);
  await reach(page, "complete");
  const before = await picture(page, "network-before");
  await page.context().setOffline(true);
  await page.fill("#error", "20");
  await page.locator("#message").waitFor({ timeout: PATIENCE });
  assert.match(await page.innerText("#message"), /could not be downloaded/);
  assert.ok(await page.locator("#retry").isVisible());
  await screenshot(page, "page-offline");
  await page.click("#dismiss");
  assert.ok(await page.locator("#message").isHidden());
  assertDrawn(await picture(page, "network-lost"));
  await page.context().setOffline(false);
  await page.evaluate(() => document.getElementById("retry")?.click());
  await reach(page, "complete");
  const { satisfied } = await setSlider(page, "error", 50);
  assert.ok(satisfied);
  assert.ok(differing(before, await picture(page, "network-after")) < 0.01, "as before");
  await page.close();
});

test("pictures, meshes, surfaces, probes and numbers are saved", async () => {
  const page = await open(SMALL, undefined, VIEWPORT);
  await reach(page, "complete");
  const stats = await demo(page, "stats");
  await page.locator("#canvas").focus();
  await page.keyboard.press("p");
  await page.locator(".card").waitFor({ timeout: PATIENCE });
  await press(page, "x");
  const save = async (button) => {
    const [download] = await Promise.all([page.waitForEvent("download", { timeout: PATIENCE }), page.click(button)]);
    return { name: download.suggestedFilename(), bytes: await readFile(await download.path()) };
  };
  const vtu = await save("[data-export=vtu]");
  assert.equal(vtu.name, "tetralod.vtu");
  assert.ok(vtu.bytes.includes(`NumberOfPoints="${stats.vertices}" NumberOfCells="${stats.tetrahedra}"`));
  assert.ok((await save("[data-export=vtk]")).bytes.includes(`CELL_TYPES ${stats.tetrahedra}\n`));
  const triangles = await page.evaluate(async () => {
    const { viewer } = window.tetralodDemo;
    return (await viewer.isosurface(viewer.state.isosurfaces[0].value)).indices.length / 3;
  });
  assert.ok(triangles > 100);
  assert.equal((await save("[data-export=stl]")).bytes.readUInt32LE(80), triangles);
  assert.ok((await save("[data-export=ply]")).bytes.includes(`element face ${triangles}\n`));
  await page.selectOption("#surface-kind", "boundary");
  assert.equal((await save("[data-export=glb]")).bytes.toString("latin1", 0, 4), "glTF");
  const rows = (await save("[data-export=csv]")).bytes.toString().trim().split("\n");
  assert.equal(rows[0], "what,x,y,z,distance,density");
  assert.match(rows[1], /^probe A,/);

  // The axes are in the picture, where they are asked for.
  const sizes = [];
  for (const isOverlaid of [true, false]) {
    await page.setChecked("#shot-overlay", isOverlaid);
    const { name, bytes } = await save("#shot");
    assert.match(name, /^tetralod-\d+x\d+\.png$/);
    sizes.push(await page.evaluate(async (base64) => {
      const image = await createImageBitmap(await (await fetch(`data:image/png;base64,${base64}`)).blob());
      const context = new OffscreenCanvas(image.width, image.height).getContext("2d");
      context.drawImage(image, 0, 0);
      return Array.from(context.getImageData(0, 0, image.width, image.height).data.filter((_, i) => i % 4 === 1));
    }, bytes.toString("base64")));
  }
  const changed = sizes[0].filter((value, i) => value !== sizes[1][i]).length / sizes[0].length;
  assert.ok(changed > 0.005 && changed < 0.3, `${(100 * changed).toFixed(1)} % of the pixels are axes`);

  await page.context().grantPermissions(["clipboard-read", "clipboard-write"]);
  await press(page, "n");
  await page.click("#copy-data");
  await page.locator("#note").waitFor();
  const copied = JSON.parse(await page.evaluate(() => navigator.clipboard.readText()));
  assert.equal(copied.stats.tetrahedra, stats.tetrahedra);
  assert.ok(copied.meshes.length > 0 && copied.frames.length > 0 && copied.received > 0);
  await screenshot(page, "page-data");
  assert.deepEqual(page.complaints, []);
  await page.close();
});
