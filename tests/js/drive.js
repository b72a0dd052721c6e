// Driving the demo page: what its tests have in common. Screenshots go to `target/e2e/` for inspection.
import assert from "node:assert/strict";
import { mkdir, writeFile } from "node:fs/promises";
import { fileURLToPath } from "node:url";
import { address, launch, PATIENCE } from "./browser.js";
import { study } from "./study.js";

export { PATIENCE } from "./browser.js";
export { assertDrawn, assertLike, differing, distance, study } from "./study.js";

export const pictures = new URL("../../target/e2e/", import.meta.url);

let browser, deviceScaleFactor;

/** With less than one pixel of the screen for each of the page, software draws faster. */
export async function begin(scale = 1) {
  deviceScaleFactor = scale;
  await mkdir(pictures, { recursive: true });
  browser = await launch();
}

export const end = () => browser?.close();

export async function newPage(given) {
  const options = { deviceScaleFactor, ...given };
  const page = await browser.newPage(options);
  // It is that of the real screen, whatever the scale: without it, a canvas has the pixels that the page believes in.
  if (options.deviceScaleFactor !== 1) await page.addInitScript(() => Reflect.deleteProperty(ResizeObserverEntry.prototype, "devicePixelContentBoxSize"));
  return page;
}

/** A new page with `volume` opened; its errors are collected in `complaints`. */
export async function open(volume, prepare = async (_page) => {}, options = {}) {
  const page = await newPage({ viewport: { width: 960, height: 660 }, ...options });
  page.complaints = [];
  page.on("pageerror", (error) => page.complaints.push(String(error)));
  page.on("console", (message) => message.type() === "error" && page.complaints.push(message.text()));
  await prepare(page);
  await page.goto(`${address()}?url=${encodeURIComponent(volume)}`);
  return page;
}

/** Waits for a state of the page; fails with the state that it is in. */
export async function reach(page, state) {
  const reached = page.waitForFunction((wanted) => window.tetralodDemo?.state === wanted, state, { timeout: PATIENCE });
  await reached.catch(async () => {
    const { viewer, ...found } = await page.evaluate(() => ({ ...window.tetralodDemo, viewer: undefined }));
    assert.fail(`the page is not ${state}: ${JSON.stringify(found)} ${page.complaints}`);
  });
}

export const demo = (page, name) => page.evaluate((name) => JSON.parse(JSON.stringify(window.tetralodDemo[name] ?? null)), name);

/** Changes an input as a user does and waits for the refinement that follows. A value that it has already asks for none. */
export async function setSlider(page, id, value) {
  if ((await page.inputValue(`#${id}`)) === String(value)) return demo(page, "stats");
  await page.evaluate(() => (window.tetralodDemo.stats = undefined));
  await page.fill(`#${id}`, String(value));
  await page.waitForFunction(() => window.tetralodDemo.stats, undefined, { timeout: PATIENCE });
  return demo(page, "stats");
}

/** A screenshot of the canvas without what lies over it, saved as `name`, and its numbers. */
export async function picture(page, name) {
  await settle(page);
  const path = fileURLToPath(new URL(`${name}.png`, pictures));
  const style =
    "#legend, #loading, #growth, #overlay, #handles, #cards, #readout, #divider, #note { visibility: hidden !important } canvas { outline: none !important }";
  // As an element it would be refused by the page's policy.
  await page.evaluate((style) => {
    const sheet = new CSSStyleSheet();
    sheet.replaceSync(style);
    document.adoptedStyleSheets = [sheet];
  }, style);
  const png = await page.locator("#canvas").screenshot({ path });
  await page.evaluate(() => (document.adoptedStyleSheets = []));
  return study(page, png);
}

/**
 * What the viewer draws with a fixed number of samples, saved as `name`, and its numbers. How often the picture on the canvas was drawn
 * again for smooth edges depends on the speed of the machine: pictures that must be the same are compared in this way.
 */
export async function still(page, name) {
  await settle(page);
  const base64 = await page.evaluate(async () => {
    const bytes = new Uint8Array(await (await window.tetralodDemo.viewer.screenshot({ samples: 4 })).arrayBuffer());
    return btoa(Array.from(bytes, (byte) => String.fromCharCode(byte)).join(""));
  });
  const png = Buffer.from(base64, "base64");
  await writeFile(new URL(`${name}.png`, pictures), png);
  return study(page, png);
}

/** Waits until the viewer is at rest, and no frame has been drawn for a while; fails with what still goes on. */
export async function settle(page) {
  const start = performance.now();
  for (let seen = -1; ; ) {
    // What cannot be fetched is the page's to say.
    await page.evaluate((patience) => window.tetralodDemo.viewer?.settled({ signal: AbortSignal.timeout(patience) }).catch(() => {}), PATIENCE);
    const [frames, step] = [await demo(page, "frames"), await demo(page, "step")];
    if (frames === seen && step?.done !== false) return;
    assert.ok(
      performance.now() - start < 2 * PATIENCE,
      `no rest: ${frames} frames, ${frames - seen} of them just now, ${JSON.stringify(step)} ${page.complaints}`,
    );
    seen = frames;
    await page.waitForTimeout(400);
  }
}

/** Turns to a view of the page. */
export const show = (page, view) => page.locator("label", { hasText: view }).first().click();

/** Waits until the address has what a pattern matches. */
export const addressed = (page, pattern) => page.waitForFunction((source) => new RegExp(source).test(location.hash), pattern.source, { timeout: PATIENCE });

/** Drops files on the page, each with its name and text, as a person drags them there from a folder. */
export const dropAll = (page, files) =>
  page.evaluate((files) => {
    const dataTransfer = new DataTransfer();
    for (const [name, text] of files) dataTransfer.items.add(new File([text], name));
    for (const type of ["dragenter", "dragover", "drop"]) window.dispatchEvent(new DragEvent(type, { dataTransfer, cancelable: true }));
  }, files);

export const drop = (page, name, text) => dropAll(page, [[name, text]]);
