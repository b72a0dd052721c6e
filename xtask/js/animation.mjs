/**
 * Records the animated picture with which the README begins: the demo page, driven as by hand, with a flow past a sphere that is refined,
 * cut and probed.
 *
 * TETRALOD_PAGE=… CHROMIUM=… node xtask/js/animation.mjs FILE.gif
 */

import { writeFile } from "node:fs/promises";
import { createRequire } from "node:module";
import { demo, reach, settle } from "../../tests/js/drive.js";
import { address, launch } from "../../tests/js/browser.js";

const { GIFEncoder, applyPalette, quantize } = createRequire(new URL("../../tests/js/package.json", import.meta.url))("gifenc");

const SIZE = { width: 960, height: 600 };
/** Where the flow is looked at from, in the state of the page. */
const VIEW = "#view=solid&map=turbo&axes=0&outline=0&handle=0&error=90";
/** Milliseconds that a picture is shown, while something changes and where there is something to read. */
const [SHORT, LONG] = [130, 1800];

/** Pixels of each picture, four bytes each, and how long it is shown. @type {{ pixels: Uint8Array, delay: number }[]} */
const frames = [];

const browser = await launch();
const page = await browser.newPage({ viewport: SIZE });
page.complaints = [];
page.on("pageerror", (error) => page.complaints.push(String(error)));

/** @param {number} delay */
async function record(delay) {
  await settle(page);
  const png = (await page.screenshot()).toString("base64");
  const base64 = await page.evaluate(async ({ png, width, height }) => {
    const bytes = Uint8Array.from(atob(png), (letter) => letter.charCodeAt(0));
    const context = new OffscreenCanvas(width, height).getContext("2d");
    context.drawImage(await createImageBitmap(new Blob([bytes], { type: "image/png" })), 0, 0);
    const { data } = context.getImageData(0, 0, width, height);
    return btoa(Array.from(data, (byte) => String.fromCharCode(byte)).join(""));
  }, { png, ...SIZE });
  frames.push({ pixels: new Uint8Array(Buffer.from(base64, "base64")), delay });
}

/** Moves a slider as a person does. @param {string} id @param {number[]} values */
async function slide(id, values) {
  await page.locator(`#${id}`).scrollIntoViewIfNeeded();
  for (const value of values) {
    await page.fill(`#${id}`, String(value));
    await record(SHORT);
  }
}

const steps = (from, to, count) => Array.from({ length: count }, (_, i) => Math.round(from + ((to - from) * (i + 1)) / count));

await page.goto(`${address()}?url=data/sphere-flow.mt${VIEW}`);
await reach(page, "complete");
await page.evaluate(() => {
  window.tetralodDemo.viewer.zoom(0.6);
  // What this machine lacks says nothing of others.
  const sheet = new CSSStyleSheet();
  sheet.replaceSync("#growth small { display: none }");
  document.adoptedStyleSheets = [sheet];
});
await record(LONG);
await slide("error", steps(90, 30, 6));
await record(LONG);
await slide("cut", [...steps(500, 430, 2), ...steps(430, 620, 4), ...steps(620, 500, 3)]);
await page.mouse.click(370, 330);
await record(LONG);
await page.mouse.click(120, 250);
await record(2 * LONG);
console.log(`${frames.length} pictures, ${(await demo(page, "stats")).tetrahedra} tetrahedra at the end`);
await browser.close();

// One palette for all pictures, of a sample of their pixels: one for each would flicker.
const sample = new Uint8Array(frames.length * (SIZE.width * SIZE.height * 4) / 16);
frames.forEach(({ pixels }, k) => {
  const part = sample.length / frames.length;
  for (let i = 0; i < part; i += 4) sample.set(pixels.subarray(16 * i, 16 * i + 4), k * part + i);
});
const palette = quantize(sample, 255);
const UNCHANGED = 255;
const gif = GIFEncoder();
let before;
for (const { pixels, delay } of frames) {
  const colours = applyPalette(pixels, palette);
  const shown = before ? colours.map((colour, i) => (colour === before[i] ? UNCHANGED : colour)) : colours;
  const first = before ? {} : { palette: [...palette, [0, 0, 0]] };
  gif.writeFrame(shown, SIZE.width, SIZE.height, { ...first, delay, transparent: Boolean(before), transparentIndex: UNCHANGED, dispose: 1 });
  before = colours;
}
gif.finish();
await writeFile(process.argv[2], gif.bytes());
console.log(`${gif.bytes().length} bytes`);
