// Ranges in a real browser, from a server of another origin: what CORS lets through, and Cache Storage.
import assert from "node:assert/strict";
import { readFile } from "node:fs/promises";
import { createServer } from "node:http";
import { after, before, beforeEach, test } from "node:test";
import { launch } from "./browser.js";

const SIZE = 200_000;
const file = new Uint8Array(SIZE).map((_, at) => (at * 7 + (at >> 8) * 31) & 255);
const TYPES = { html: "text/html", js: "text/javascript", wasm: "application/wasm" };

let browser;
let page;
let base;
let asked = [];
const servers = [];

async function listen(answer) {
  const server = createServer(answer);
  servers.push(server);
  await new Promise((resolve) => server.listen(0, "127.0.0.1", () => resolve(undefined)));
  return `http://127.0.0.1:${/** @type {import("node:net").AddressInfo} */ (server.address()).port}`;
}

async function servePage({ url }, response) {
  const [, name, type] = /^\/pkg\/([\w.-]+\.(js|wasm))$/.exec(url) ?? [undefined, undefined, "html"];
  response.setHeader("content-type", TYPES[type]);
  response.end(name ? await readFile(new URL(`../../pkg/${name}`, import.meta.url)) : "<!doctype html>");
}

function serveFile({ method, url, headers }, response) {
  const [, start, last] = /^bytes=(\d+)-(\d+)$/.exec(headers.range ?? "bytes=0-0");
  const [from, end] = [Number(start), Math.min(Number(last) + 1, SIZE)];
  asked.push({ method, bytes: end - from });
  if (url !== "/closed") response.setHeader("access-control-allow-origin", "*");
  if (url === "/exposed") response.setHeader("access-control-expose-headers", "content-range, etag");
  response.writeHead(206, { etag: '"one"', "content-range": `bytes ${from}-${end - 1}/${SIZE}`, "content-length": end - from });
  response.end(file.slice(from, end));
}

before(async () => {
  base = await listen(serveFile);
  const origin = await listen(servePage);
  browser = await launch();
  page = await browser.newPage();
  await page.goto(`${origin}/`);
});

beforeEach(() => {
  asked = [];
});

after(async () => {
  await browser?.close();
  for (const server of servers) {
    server.closeAllConnections();
    server.close();
  }
});

/** Fetches the first bytes, then the ranges; gives the sums of their bytes, or the error. */
function fetchIn(path, ranges, options = {}) {
  const run = async ({ url, ranges, options }) => {
    const [{ Ranges }, core] = await Promise.all([import("/pkg/ranges.js"), import("/pkg/tetralod_core.js")]);
    await core.default();
    const sums = {};
    let total;
    try {
      await new Promise((resolve, reject) => {
        const onRange = (start, end, bytes) => {
          sums[start] = bytes.reduce((sum, byte) => sum + byte, 0);
          // Later, so that the cache has been opened.
          if (start === 0) setTimeout(() => want(ranges.flatMap(([a, b]) => [a, b, 0])), 200);
          if (Object.keys(sums).length > ranges.length) setTimeout(resolve, 200);
        };
        const onComplete = () => {
          for (let range; (range = source.loader.take()); ) onRange(range.start, range.end, range.bytes);
        };
        const want = (triples) => {
          source.loader.want(Float64Array.from(triples));
          source.go();
        };
        const source = new Ranges(core.RangeLoader, url, { onComplete, onError: reject }, { retries: 1, backoffMs: 10, ...options });
        want([0, 100, 0]);
        total = () => source.total;
      });
      return { sums, total: total() };
    } catch (error) {
      return { code: error.code, message: error.message };
    }
  };
  return page.evaluate(run, { url: base + path, ranges, options });
}

/** @type {[number, number][]} */
const RANGES = [
  [1000, 50_000],
  [100_000, 160_000],
  [199_000, SIZE + 9],
];
const sum = (start, end) => file.slice(start, end).reduce((total, byte) => total + byte, 0);
const expected = Object.fromEntries([[0, 100], ...RANGES].map(([start, end]) => [start, sum(start, end)]));

test("ranges of another origin need no preflight, and no header but the one that allows reading", async () => {
  const hidden = await fetchIn("/open", RANGES.slice(0, 2));
  assert.deepEqual(hidden.sums, Object.fromEntries(Object.entries(expected).slice(0, 3)), hidden.message);
  const exposed = await fetchIn("/exposed", RANGES);
  assert.deepEqual([exposed.sums, exposed.total], [expected, SIZE], exposed.message);
  assert.ok(
    asked.every(({ method }) => method === "GET"),
    JSON.stringify(asked),
  );
});

test("headers of the caller go to no other origin", async () => {
  const told = [];
  const there = await listen((request, response) => {
    if (request.method !== "OPTIONS") told.push(request.headers.authorization);
    response.setHeader("access-control-allow-headers", "range, authorization");
    if (request.method === "OPTIONS") response.setHeader("access-control-allow-origin", "*").end();
    else serveFile(request, response);
  });
  const redirected = [];
  const here = await listen((request, response) => {
    response.setHeader("access-control-allow-origin", "*").setHeader("access-control-allow-headers", "range, authorization");
    if (request.method === "OPTIONS") return response.end();
    redirected.push(request.headers.authorization);
    response.writeHead(302, { location: `${there}/exposed` }).end();
  });
  const url = base;
  base = here;
  const { sums, message } = await fetchIn("/x", RANGES, { headers: { authorization: "Bearer secret" } });
  base = url;
  assert.deepEqual(sums, expected, message);
  assert.ok(redirected.length < told.length && redirected.every((header) => header === "Bearer secret"), JSON.stringify(redirected));
  assert.ok(
    told.every((header) => header === undefined),
    JSON.stringify(told),
  );
});

test("what the browser forbids is told from a server that is away", async () => {
  const closed = await fetchIn("/closed", RANGES);
  assert.equal(closed.code, "cors", closed.message);
  assert.match(closed.message, /Access-Control-Allow-Origin/);
  assert.ok(asked.length <= 2, JSON.stringify(asked));
  const url = base;
  const away = createServer();
  await new Promise((resolve) => away.listen(0, "127.0.0.1", () => resolve(undefined)));
  base = `http://127.0.0.1:${/** @type {import("node:net").AddressInfo} */ (away.address()).port}`;
  await new Promise((resolve) => away.close(resolve));
  const nobody = await fetchIn("/x", RANGES);
  base = url;
  assert.equal(nobody.code, "network", nobody.message);
});

test("what was fetched once is kept in Cache Storage", async () => {
  const bytes = async () => {
    asked = [];
    const { sums, message } = await fetchIn("/exposed", RANGES, { cache: "mt" });
    assert.deepEqual(sums, expected, message);
    return asked.reduce((total, { bytes }) => total + bytes, 0);
  };
  assert.ok((await bytes()) > 100_000);
  assert.equal(await bytes(), 100);
});
