// Promise: a page of `tetralod html` shows its volume from `file:`, without a network, within what is in it; asked for more, it says so.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { mkdir, rm, symlink, writeFile } from "node:fs/promises";
import { after, before, test } from "node:test";
import { fileURLToPath } from "node:url";
import { launch, withoutGpu, withoutWebGpu } from "./browser.js";
import { assertDrawn, differing, study } from "./study.js";

const { TETRALOD: tetralod, TETRALOD_FIXTURE: fixture } = process.env;
assert.ok(tetralod && fixture, "TETRALOD and TETRALOD_FIXTURE are not set: run `cargo xtask test e2e`");
const folder = new URL("../../target/e2e/html/", import.meta.url);
const at = (name) => fileURLToPath(new URL(name, folder));

let browser;

/** Makes a page; its address. */
function made(name, source, ...options) {
  execFileSync(tetralod, ["html", `${fixture}/${source}`, "-o", at(name), "--page", at("page"), ...options], { stdio: "pipe" });
  return new URL(name, folder).href;
}

before(async () => {
  await mkdir(new URL("page/", folder), { recursive: true });
  await writeFile(new URL("page/index.html", folder), "");
  await rm(new URL("page/pkg", folder), { force: true });
  await symlink(fileURLToPath(new URL("../../pkg", import.meta.url)), at("page/pkg"));
  browser = await launch();
});
after(() => browser?.close());

/** Opens a page, without a network; what it complains of or asks for is in `complaints`. */
async function opened(address, { viewport = { width: 800, height: 600 }, prepare = undefined } = {}) {
  const context = await browser.newContext({ viewport, offline: true, acceptDownloads: true });
  const page = await context.newPage();
  const complaints = [];
  page.on("pageerror", (error) => complaints.push(String(error)));
  page.on("console", (message) => message.type() === "error" && complaints.push(message.text()));
  page.on("request", (request) => /^(file|data|blob):/.test(request.url()) || complaints.push(request.url()));
  if (prepare) await page.addInitScript(prepare);
  await page.goto(address);
  return { page, complaints, close: () => context.close() };
}

const status = (page) => page.textContent("#status");
/** Waits until the mesh is what was asked for and the picture shows it. */
const settled = async (page) => {
  await page.waitForFunction(() => /tetrahedra/.test(document.querySelector("#status")?.textContent ?? ""));
  await page.evaluate(() => /** @type {any} */ (document.querySelector("tetralod-viewer")).viewer.settled());
};
const picture = async (page, name) => study(page, await page.screenshot({ path: at(`${name}.png`) }));

test("the volume is drawn from file:, without a network; its menu works, and the mesh is no finer than the page", async () => {
  const address = made("page.html", "blocks-half-edge.mt", "--error", "5%", "--isovalue", "0.5", "--poster", "160x120");
  const { page, complaints, close } = await opened(address);
  await settled(page);
  const first = await picture(page, "first");
  assertDrawn(first);
  const coarse = await status(page);
  assert.match(coarse ?? "", /^[\d,]+ tetrahedra, error at most [1-4](\.\d)? % of the range$/);
  assert.ok((await page.isVisible("#legend")) === false, "an isosurface of one colour has no legend");

  await page.click("summary");
  await page.selectOption("[name=detail]", "0%");
  await page.waitForFunction(() => /no more detail/.test(document.querySelector("#status")?.textContent ?? ""));
  await page.selectOption("[name=detail]", "");
  await page.waitForFunction((text) => document.querySelector("#status")?.textContent === text, coarse);

  await page.selectOption("[name=mode]", "slice");
  await settled(page);
  const slice = await picture(page, "slice");
  assertDrawn(slice);
  assert.ok(differing(first, slice) > 0.05 && (await page.isVisible("#legend")));
  await page.locator("[name=position]").fill("300");
  await settled(page);
  assert.ok(differing(slice, await picture(page, "moved")) > 0.02);

  const [download] = await Promise.all([page.waitForEvent("download"), page.click("[name=save]")]);
  assert.equal(download.suggestedFilename(), "blocks-half-edge.png");
  // The element has the focus: keys turn the volume.
  await page.locator("canvas").focus();
  await page.keyboard.press("ArrowLeft");
  await settled(page);
  assert.deepEqual(complaints, []);
  await close();
});

test("on a phone all of the model is in the picture, and the menu leaves room for it", async () => {
  const address = made("phone.html", "fields.mt", "--error", "10%", "--mode", "boundary", "--no-poster");
  const { page, complaints, close } = await opened(address, { viewport: { width: 390, height: 800 } });
  await settled(page);
  assertDrawn(await picture(page, "phone"));
  assert.equal(await page.evaluate(() => document.documentElement.scrollWidth > innerWidth), false);
  await page.click("summary");
  assert.ok(await page.isVisible("[name=field]"));
  const before = await picture(page, "phone-menu");
  await page.selectOption("[name=field]", "1");
  await settled(page);
  assert.ok(differing(before, await picture(page, "phone-field")) > 0.01);
  assert.deepEqual(complaints, []);
  await close();
});

test("a browser without WebGPU draws it with WebGL, and is offered no volume", async () => {
  const { page, complaints, close } = await opened(new URL("page.html", folder).href, { prepare: withoutWebGpu });
  await settled(page);
  assertDrawn(await picture(page, "webgl"));
  assert.ok(await page.isDisabled("option[value=volume]"));
  assert.deepEqual(complaints, []);
  await close();
});

test("a browser without WebGPU and WebGL shows the picture, and says why there is no more", async () => {
  const { page, complaints, close } = await opened(new URL("page.html", folder).href, { prepare: withoutGpu });
  await page.waitForFunction(() => /cannot be shown/.test(document.querySelector("#status")?.textContent ?? ""));
  assert.ok(await page.evaluate(() => document.querySelector("img")?.naturalWidth === 160));
  assert.match((await page.locator("tetralod-viewer").evaluate((element) => element.shadowRoot?.textContent)) ?? "", /WebGPU/);
  assertDrawn(await picture(page, "poster"));
  assert.deepEqual(complaints, []);
  await close();
});
