// Visits the page with a file of any size behind a network, and prints what requests take, as a table for docs/: started by
// `cargo xtask bench --first-visit FILE.mt`.
import { readFile, open } from "node:fs/promises";
import { createServer } from "node:http";
import { setTimeout as wait } from "node:timers/promises";
import { launch } from "../../tests/js/browser.js";

const { TETRALOD_PAGE: address, TETRALOD_FILE: path } = process.env;
/** Each a network: ms until an answer begins, and Mbit/s of all answers together. */
const NETWORKS = [
  { latency: 0, rate: Number.POSITIVE_INFINITY },
  { latency: 100, rate: 20 },
];
/** Bytes that are sent at a time. */
const PIECE = 1 << 14;
const PATIENCE = 600_000;

/** Serves the file alone. A round is what is asked for while something is under way. */
async function serveFile({ latency, rate }) {
  const file = await open(path);
  const { size } = await file.stat();
  const counts = { requests: 0, rounds: 0, bytes: 0 };
  let [pending, freeAt] = [0, 0];
  const server = createServer(async (request, response) => {
    counts.requests++;
    if (pending++ === 0) counts.rounds++;
    response.on("close", () => pending--);
    const [, first = "0", last = ""] = /bytes=(\d+)-(\d*)/.exec(request.headers.range ?? "") ?? [];
    const [from, end] = [Number(first), Math.min(last ? Number(last) + 1 : size, size)];
    await wait(latency);
    response.writeHead(request.headers.range ? 206 : 200, {
      "access-control-allow-origin": "*",
      "access-control-expose-headers": "content-range, etag",
      "content-range": `bytes ${from}-${end - 1}/${size}`,
      "content-length": end - from,
      etag: '"file"',
    });
    for (let at = from; at < end && !response.destroyed; at += PIECE) {
      const length = Math.min(PIECE, end - at);
      const { buffer } = await file.read(Buffer.alloc(length), 0, length, at);
      freeAt = Math.max(freeAt, performance.now()) + (length * 8) / (rate * 1000);
      await wait(freeAt - performance.now());
      counts.bytes += length;
      response.write(buffer);
    }
    response.end();
  });
  await new Promise((resolve) => server.listen(0, "127.0.0.1", () => resolve(undefined)));
  const close = async () => {
    server.closeAllConnections();
    server.close();
    await file.close();
  };
  return { url: `http://127.0.0.1:${server.address().port}/file.mt`, size, counts, close };
}

/** The memory in bytes of the browser's processes that pages run in. */
async function pageMemory(control) {
  const { processInfo } = await control.send("SystemInfo.getProcessInfo");
  const pages = processInfo.filter(({ type }) => type === "renderer");
  const statuses = await Promise.all(pages.map(({ id }) => readFile(`/proc/${id}/status`, "utf8")));
  return statuses.reduce((sum, status) => sum + 1024 * Number(/VmRSS:\s+(\d+)/.exec(status)?.[1]), 0);
}

/** A part of the box's sides about the middle of the lower half. */
function boxOf(bounds, part) {
  const at = (i, share) => bounds[i] + share * (bounds[i + 3] - bounds[i]);
  const along = (sign) => [0, 1, 2].map((i) => at(i, 0.5 - 0.25 * Number(i === 2) + (sign * part) / 2));
  return [...along(-1), ...along(1)];
}

/** One visit: rows of what was done, with what it took. */
async function visit(network) {
  const file = await serveFile(network);
  const browser = await launch();
  try {
    const control = await browser.newBrowserCDPSession();
    const page = await browser.newPage({ viewport: { width: 1280, height: 800 } });
    page.setDefaultTimeout(PATIENCE);
    const rows = [];
    const measure = async (name, what) => {
      const [before, start] = [{ ...file.counts }, performance.now()];
      const stats = (await what()) ?? (await page.evaluate(() => window.tetralodDemo.step ?? window.tetralodDemo.stats));
      const seconds = (performance.now() - start) / 1000;
      const taken = Object.keys(before).map((key) => file.counts[key] - before[key]);
      const { tetrahedra } = stats;
      rows.push([name, ...taken, seconds, tetrahedra, await pageMemory(control)]);
      console.error(network, rows.at(-1));
    };
    const refine = (request) =>
      page.evaluate(async (options) => {
        const { viewer } = window.tetralodDemo;
        const stats = new Promise((resolve) => viewer.addEventListener("stats", ({ detail }) => detail.satisfied && resolve(detail)));
        await viewer.refine(options);
        return stats;
      }, request);
    const reached = async (condition) => void (await page.waitForFunction(condition, undefined, { polling: 20 }));
    await measure("the first picture", async () => {
      await page.goto(`${address}?url=${encodeURIComponent(file.url)}`);
      await reached(() => window.tetralodDemo?.firstFrameMs !== undefined || window.tetralodDemo?.state === "failed");
    });
    await measure("what the page asks for first", () => reached(() => ["complete", "failed"].includes(window.tetralodDemo.state)));
    const failed = await page.evaluate(() => window.tetralodDemo.error?.message);
    if (failed) throw new Error(failed);
    for (const error of ["5%", "2%", "1%"]) await measure(`a mesh within ${error.replace("%", " %")}`, () => refine({ error }));
    const bounds = await page.evaluate(() => window.tetralodDemo.info.bounds);
    await measure("within 0.1 % in a box of an eighth of each side", () => refine({ error: "0.1%", box: boxOf(bounds, 1 / 8) }));
    if (process.env.TETRALOD_PICTURE) await page.screenshot({ path: `${process.env.TETRALOD_PICTURE}-${network.latency}.png` });
    return { rows, size: file.size };
  } finally {
    await browser.close();
    await file.close();
  }
}

const thousands = (number) => Math.round(number).toLocaleString("en");
for (const network of NETWORKS) {
  const { rows, size } = await visit(network);
  const speed = network.latency === 0 ? "from this machine" : `${network.latency} ms, ${network.rate} Mbit/s`;
  console.log(`| ${speed}, file of ${thousands(size / 1e6)} MB | requests | rounds | kB | s | tetrahedra | MB of the tab |`);
  console.log("|---|--:|--:|--:|--:|--:|--:|");
  for (const [name, requests, rounds, bytes, seconds, tetrahedra, memory] of rows) {
    console.log(`| ${name} | ${requests} | ${rounds} | ${thousands(bytes / 1000)} | ${seconds.toFixed(2)} | ${thousands(tetrahedra)} | ${thousands(memory / 1e6)} |`);
  }
  console.log("");
}
