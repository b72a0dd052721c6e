// The page in a real browser, on a file that is fetched in parts from a server that the test plays.
import assert from "node:assert/strict";
import { readFile } from "node:fs/promises";
import { after, before, test } from "node:test";
import { launch, servePackage } from "./browser.js";

const folder = process.env.TETRALOD_FIXTURE;
assert.ok(folder, "TETRALOD_FIXTURE is not set: run `cargo xtask test e2e`");
const bytes = await readFile(`${folder}/blocks-half-edge.mt`);
const PATIENCE = 60_000;

let browser;
let server;
let base;
/** Whether the server gives the file, and what it has sent of it. */
let works = true;
let sent = 0;

before(async () => {
  server = await servePackage((request, response) => {
    if (request.url === "/model.mt") return sendModel(request, response);
    const home = new URL("../../www/index.html", import.meta.url);
    readFile(home).then((page) => response.setHeader("content-type", "text/html").end(page));
  });
  base = server.address;
  browser = await launch();
});

after(async () => {
  await browser?.close();
  server?.close();
});

function sendModel({ headers }, response) {
  if (!works) return response.writeHead(404).end();
  const [, start, last] = /^bytes=(\d+)-(\d+)$/.exec(headers.range);
  const [from, end] = [Number(start), Math.min(Number(last) + 1, bytes.length)];
  sent += end - from;
  const range = `bytes ${from}-${end - 1}/${bytes.length}`;
  response.writeHead(206, { etag: '"one"', "content-range": range, "content-length": end - from });
  response.end(bytes.subarray(from, end));
}

const demo = (page, name) => page.evaluate((name) => JSON.parse(JSON.stringify(window.tetralodDemo[name] ?? null)), name);

async function reach(page, state) {
  const reached = page.waitForFunction((wanted) => window.tetralodDemo?.state === wanted, state, { timeout: PATIENCE });
  await reached.catch(async () => {
    const found = await page.evaluate(() => JSON.stringify({ ...window.tetralodDemo, viewer: undefined }));
    assert.fail(`the page is not ${state}: ${found}`);
  });
}

/** Waits for a mesh that is what was asked for. */
const satisfied = (page) => page.waitForFunction(() => window.tetralodDemo.stats?.satisfied, undefined, { timeout: PATIENCE });

test("the page fetches what it shows, tells when the network fails, and goes on when asked to", async () => {
  const page = await browser.newPage({ viewport: { width: 1100, height: 760 } });
  const complaints = [];
  page.on("pageerror", (error) => complaints.push(String(error)));
  // A coarse mesh at first.
  await page.goto(`${base}?url=model.mt`);
  await reach(page, "complete");
  await satisfied(page);
  const blocks = await demo(page, "blocks");
  assert.ok(blocks.here >= blocks.needed && blocks.all > 200, JSON.stringify(blocks));
  assert.ok(blocks.here < blocks.all && sent < bytes.length, `${blocks.here} of ${blocks.all} blocks`);
  assert.match(await page.textContent("#n-blocks"), /^\d+ of \d+$/);

  works = false;
  await page.evaluate(() => (window.tetralodDemo.stats = undefined));
  await page.fill("#error", "0");
  await reach(page, "failed");
  assert.equal((await demo(page, "error")).code, "network");
  assert.match(await page.textContent("#message-text"), /model\.mt: .*404/);
  assert.ok(await page.isVisible("#retry"));
  assert.ok((await demo(page, "step")).tetrahedra > 0, "the mesh stays");

  works = true;
  await page.click("#retry");
  await reach(page, "complete");
  await satisfied(page);
  assert.ok(await page.isHidden("#message"));
  const [stats, info] = [await demo(page, "stats"), await demo(page, "info")];
  assert.equal(stats.tetrahedra, info.tetrahedra, "the reference mesh");
  assert.equal((await demo(page, "blocks")).here, blocks.all);
  assert.deepEqual(complaints, []);
  await page.close();
});
