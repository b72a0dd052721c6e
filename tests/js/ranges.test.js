// Ranges over fetch, from a server that misbehaves: the right bytes come, or an error that says what to do about it, after
// a bounded number of requests.
import assert from "node:assert/strict";
import { readFile } from "node:fs/promises";
import { createServer } from "node:http";
import { after, before, test } from "node:test";
import { crc32, gzipSync } from "node:zlib";
import { loadCore } from "../../pkg/core.js";
import { Ranges } from "../../pkg/ranges.js";
import { RangeLoader } from "../../pkg/tetralod_core.js";

const SIZE = 200_000;
const file = new Uint8Array(SIZE).map((_, at) => (at * 7 + (at >> 8) * 31 + (at >> 16) * 101) & 255);
const WANTED = [
  [0, 1000],
  [1200, 50_000],
  [60_000, 60_010],
  [100_000, 160_000],
  [199_000, SIZE + 7],
];

let server;
let base;
/** What answers now, and what it has been asked. */
let answer;
let asked = [];
/** Requests of earlier rounds may still come when they are over; they do not count. */
let round = 0;

before(async () => {
  await loadCore();
  server = createServer((request, response) => {
    const [path, of] = request.url.split("?");
    if (of && Number(of) !== round) return response.destroy();
    const [, start, last] = /^bytes=(\d+)-(\d*)$/.exec(request.headers.range);
    const range = { start: Number(start), end: Math.min(last ? Number(last) + 1 : SIZE, SIZE), number: asked.length };
    asked.push({ ...range, path, headers: request.headers });
    answer({ ...range, path }, response);
  });
  await new Promise((resolve) => server.listen(0, "127.0.0.1", () => resolve(undefined)));
  base = `http://127.0.0.1:${/** @type {import("node:net").AddressInfo} */ (server.address()).port}/file.mt`;
});

after(() => {
  server.closeAllConnections();
  server.close();
});

const headers = ({ start, end }, more = {}) => ({
  "content-range": `bytes ${start}-${end - 1}/${SIZE}`,
  "content-length": end - start,
  etag: '"one"',
  ...more,
});

function good(range, response) {
  response.writeHead(206, headers(range)).end(file.slice(range.start, range.end));
}

/** `Ranges` that hand each range that is complete to `onRange`. */
function open(url, { onRange, onError }, options) {
  const onComplete = () => {
    for (let range; (range = ranges.loader.take()); ) {
      if (onRange(range.start, range.end, range.bytes) === "closed") return;
    }
  };
  const ranges = new Ranges(RangeLoader, url, { onComplete, onError }, options);
  return ranges;
}

/** What a session does: asks for these ranges from now on. */
function want(ranges, triples) {
  ranges.loader.want(Float64Array.from(triples));
  ranges.go();
}

/** Fetches ranges; gives them as `[start, end, bytes]` when all are there. */
function fetchAll(wanted, options = {}, url = base) {
  const got = [];
  let ranges;
  const all = new Promise((resolve, reject) => {
    const onRange = (start, end, bytes) => {
      got.push([start, end, bytes]);
      if (got.length === wanted.length) resolve({ got, ranges });
    };
    const quick = { retries: 3, backoffMs: 10, timeoutMs: 400, maxRequestBytes: 30_000, gap: 500 };
    ranges = open(url, { onRange, onError: reject }, { ...quick, ...options });
    want(
      ranges,
      wanted.flatMap(([start, end]) => [start, end, -start]),
    );
  });
  return all.finally(() => options.open || ranges.close());
}

/** All comes, every byte of it right, in at most so many requests. */
async function works(most, handler, options) {
  answer = handler;
  asked = [];
  const { got } = await fetchAll(WANTED, options, `${base}?${++round}`);
  const expected = new Map(WANTED.map(([start, end]) => [`${start}-${end}`, file.slice(start, end)]));
  for (const [start, end, bytes] of got) assert.deepEqual(bytes, expected.get(`${start}-${end}`));
  assert.equal(new Set(got.map(([start]) => start)).size, WANTED.length, "each comes once");
  assert.ok(asked.length <= most, `${asked.length} requests`);
}

/** It ends with an error, after at most so many requests. */
async function fails(most, code, message, handler, options) {
  answer = handler;
  asked = [];
  await assert.rejects(fetchAll(WANTED, options, `${base}?${++round}`), (/** @type {any} */ error) => {
    assert.equal(error.name, "TetralodError", error.stack);
    assert.equal(error.code, code, error.message);
    assert.match(error.message, message);
    assert.ok(error.message.includes(base));
    return true;
  });
  assert.ok(asked.length <= most, `${asked.length} requests`);
}

test("a good server is asked for little more than is wanted", async () => {
  await works(8, good);
  assert.equal(asked[0].headers["accept-encoding"], "identity");
  const total = asked.reduce((sum, { start, end }) => sum + end - start, 0);
  const wanted = WANTED.reduce((sum, [start, end]) => sum + Math.min(end, SIZE) - start, 0);
  assert.ok(total <= wanted + 500, `${total} of ${wanted}`);
});

test("cut connections are taken up where they ended", async () => {
  await works(32, (range, response) => {
    response.writeHead(206, headers(range));
    response.write(file.slice(range.start, Math.min(range.end, range.start + 9000)));
    // Later, because a client may drop what it has not read yet when a connection breaks.
    if (range.end - range.start > 9000) setTimeout(() => response.destroy(), 30);
    else response.end();
  });
  assert.ok(asked.some(({ start }) => start === 9000));
});

test("a server that only ever cuts is given up", async () => {
  await fails(40, "network", /check the address/, (range, response) => {
    response.writeHead(206, headers(range)).flushHeaders();
    response.destroy();
  });
  await fails(4, "network", /check the address/, (range, response) => response.destroy());
});

test("a server that hangs is given up or recovers, slow drips are waited for", async () => {
  await fails(4, "network", /sends nothing any more/, () => {});
  await works(9, (range, response) => {
    if (range.number !== 1) return good(range, response);
    response.writeHead(206, headers(range));
    response.write(file.slice(range.start, range.start + 10));
  });
  answer = (range, response) => {
    response.writeHead(206, headers(range));
    let at = range.start;
    const drip = setInterval(() => {
      response.write(file.slice(at, Math.min(at + 100, range.end)));
      at += 100;
      if (at < range.end) return;
      clearInterval(drip);
      response.end();
    }, 60);
  };
  asked = [];
  const { got } = await fetchAll([[0, 1000]]);
  assert.deepEqual(got[0][2], file.slice(0, 1000));
  assert.equal(asked.length, 1);
});

test("server errors pass or are reported", async () => {
  for (const status of [500, 502, 503, 429]) {
    await works(12, (range, response) => {
      if (range.number % 3 === 1) response.writeHead(status, { "retry-after": 0 }).end("oops");
      else good(range, response);
    });
  }
  await fails(4, "network", /HTTP 500/, (_, response) => response.writeHead(500).end());
  await fails(1, "network", /HTTP 404.*address/, (_, response) => response.writeHead(404).end());
});

test("answers with another range are not taken", async () => {
  const wrong = ({ start, end }, response) => good({ start: start + 1, end: end + 1 }, response);
  await fails(4, "server", /another part.*bytes 1-30000/, wrong);
  await works(10, (range, response) => (range.number === 2 ? wrong : good)(range, response));
});

test("a server without ranges is read once, compressed or not", async () => {
  await works(1, (_, response) => response.writeHead(200, { "content-length": SIZE }).end(file));
  await works(1, (_, response) => response.writeHead(200).end(file));
  const packed = { "content-encoding": "gzip" };
  await works(1, (_, response) => response.writeHead(200, packed).end(gzipSync(file)));
  await works(2, (range, response) => {
    response.writeHead(200, { "content-length": SIZE });
    if (range.number > 0) return response.end(file);
    response.write(file.slice(0, 120_000));
    setTimeout(() => response.destroy(), 100);
  });
});

test("compressed ranges and web pages are refused with advice", async () => {
  await fails(1, "server", /compression off/, (range, response) => {
    response.writeHead(206, { ...headers(range), "content-encoding": "gzip", "content-length": 20 }).end(new Uint8Array(20));
  });
  await fails(1, "server", /404/, (_, response) => response.writeHead(200, { "content-type": "text/html" }).end("<p>"));
});

test("a file that changes is noticed, and can be read anew", async () => {
  const changed = (range, response) => response.writeHead(206, headers(range, { etag: '"two"' })).end(file.slice(range.start, range.end));
  await fails(8, "changed", /replaced/, (range, response) => (range.number ? changed : good)(range, response));
  answer = good;
  const errors = [];
  const first = await fetchAll([[0, 10]], { open: true });
  answer = changed;
  await new Promise((resolve, reject) => {
    const ranges = open(
      base,
      {
        onRange: (start, end, bytes) => {
          assert.deepEqual(bytes, file.slice(start, end));
          if (start === 0) answer = good;
          if (start === 0) return queueMicrotask(() => want(ranges, [100_000, 100_010, 0]));
          ranges.close();
          resolve(undefined);
          return "closed";
        },
        onError: (error) => {
          errors.push(error.code);
          if (errors.length > 1) return reject(error);
          ranges.retry();
        },
      },
      { maxRequestBytes: 100 },
    );
    want(ranges, [0, 10, 0]);
  });
  assert.deepEqual(errors, ["changed"]);
  first.ranges.close();
});

test("redirects are followed once, and again when they expire", async () => {
  await works(14, (range, response) => {
    if (range.path === "/file.mt") return response.writeHead(302, { location: `/elsewhere-${range.number}` }).end();
    if (range.path === "/elsewhere-0" && range.number > 3) return response.writeHead(403).end();
    return good(range, response);
  });
  const firsts = asked.filter(({ path }) => path === "/file.mt").length;
  assert.ok(firsts > 1 && firsts < asked.length / 2, `redirected ${firsts} times`);
});

for (const lasts of [true, false]) {
  const what = lasts ? "which is asked directly" : "and one that refuses without them is asked by way of the given one";
  test(`headers of the caller go to no other origin, ${what}`, async () => {
    const [told, used] = [[], new Set()];
    const other = createServer((request, response) => {
      told.push([request.headers.authorization, request.headers.range]);
      const isNew = !used.has(request.url);
      used.add(request.url);
      const [, start, last] = /^bytes=(\d+)-(\d*)$/.exec(request.headers.range);
      if (lasts || isNew) good({ start: Number(start), end: Math.min(Number(last) + 1, SIZE) }, response);
      else response.writeHead(403).end();
    });
    await new Promise((resolve) => other.listen(0, "127.0.0.1", () => resolve(undefined)));
    const there = `http://127.0.0.1:${/** @type {import("node:net").AddressInfo} */ (other.address()).port}`;
    const redirect = (range, response) => response.writeHead(302, { location: `${there}/${range.number}` }).end();
    try {
      await works(20, redirect, { headers: { authorization: "Bearer secret" } });
    } finally {
      other.closeAllConnections();
      other.close();
    }
    assert.ok(asked.every(({ headers }) => headers.authorization === "Bearer secret"));
    assert.ok(
      told.every(([authorization]) => authorization === undefined),
      JSON.stringify(told),
    );
    if (lasts) assert.ok(asked.length < told.length, `redirected ${asked.length} of ${told.length} times`);
    else assert.ok(told.length <= asked.length + 6, `${told.length} requests, ${asked.length} of them redirected`);
  });
}

test("what the caller's own function makes of a request goes to the given address alone", async () => {
  const other = createServer((request, response) => {
    const [, start, last] = /^bytes=(\d+)-(\d*)$/.exec(request.headers.range);
    good({ start: Number(start), end: Math.min(Number(last) + 1, SIZE) }, response);
  });
  await new Promise((resolve) => other.listen(0, "127.0.0.1", () => resolve(undefined)));
  const there = `http://127.0.0.1:${/** @type {import("node:net").AddressInfo} */ (other.address()).port}`;
  const called = [];
  const sign = (url, init) => {
    called.push(url);
    return fetch(url, { ...init, headers: { ...Object.fromEntries(init.headers), "x-signature": "secret" } });
  };
  try {
    await works(20, (_, response) => response.writeHead(302, { location: `${there}/` }).end(), { fetch: sign });
  } finally {
    other.closeAllConnections();
    other.close();
  }
  assert.ok(called.length > 1 && called.every((url) => url.startsWith(base)), JSON.stringify(called));
});

test("no server is reported", async () => {
  const other = createServer();
  await new Promise((resolve) => other.listen(0, "127.0.0.1", () => resolve(undefined)));
  const url = `http://127.0.0.1:${/** @type {import("node:net").AddressInfo} */ (other.address()).port}/x`;
  await new Promise((resolve) => other.close(resolve));
  await assert.rejects(fetchAll(WANTED, {}, url), { code: "network", message: /ECONNREFUSED/ });
});

test("what is wanted no longer is cancelled, and nothing comes after the end", async () => {
  let closed = 0;
  answer = (range, response) => {
    if (range.start < 100_000) return good(range, response);
    response.on("close", () => (closed += 1));
  };
  asked = [];
  const { ranges } = await fetchAll([[0, 10]], { open: true });
  want(ranges, [100_000, 100_100, 1]);
  while (asked.length < 2) await new Promise((resolve) => setTimeout(resolve, 5));
  want(ranges, []);
  while (closed < 1) await new Promise((resolve) => setTimeout(resolve, 5));
  assert.deepEqual([ranges.total, ranges.servesRanges, ranges.traffic.requests], [SIZE, true, 2]);
  want(ranges, [100_000, 100_100, 1]);
  ranges.close();
  ranges.go();
  assert.equal(ranges.total, undefined);
});

/** The file with a header that says how long it is. */
const headed = file.slice();
headed.set([0x89, 0x54, 0x4c, 0x4f, 0x44, 0x0d, 0x0a, 0x1a, 2, 0, 0, 0, 0, 0, 0, 0]);
headed.fill(0, 16, 28);
new DataView(headed.buffer).setUint32(16, SIZE, true);
new DataView(headed.buffer).setUint32(28, crc32(headed.subarray(0, 28)), true);

/** Answers with shards of so many bytes; `told` says whether the server tells how long they are, `missing` which is not there. */
function inShards(size, { told = true, ranges = true, missing = -1 } = {}) {
  return ({ start, end, path }, response) => {
    const number = Number(/\.mt(?:\.(\d{4}))?$/.exec(path)?.[1] ?? 0);
    const shard = headed.subarray(number * size, (number + 1) * size);
    if (shard.length === 0 || number === missing) return response.writeHead(404).end();
    if (!ranges) return response.writeHead(200, { "content-length": shard.length }).end(shard);
    const total = told ? { "content-range": `bytes */${shard.length}` } : {};
    if (start >= shard.length) return response.writeHead(416, total).end();
    const part = shard.subarray(start, end);
    const place = told ? { "content-range": `bytes ${start}-${start + part.length - 1}/${shard.length}` } : {};
    response.writeHead(206, { ...place, "content-length": part.length }).end(part);
  };
}

test("a file in shards comes as one, whatever the server tells of them", async () => {
  for (const size of [70_000, 150_000, SIZE - 1, SIZE]) {
    for (const server of [{}, { told: false }, { ranges: false }]) {
      answer = inShards(size, server);
      asked = [];
      const { got, ranges } = await fetchAll(WANTED, { open: true }, `${base}?${++round}`);
      const what = `${size} ${JSON.stringify(server)}`;
      for (const [start, end, bytes] of got) assert.deepEqual(bytes, headed.slice(start, end), `${what}: ${start} to ${end}`);
      // Of one object whose length is not told nothing but its end is known.
      const isHidden = size === SIZE && server.told === false;
      assert.equal(ranges.total, isHidden ? undefined : SIZE, what);
      ranges.close();
      // The shards that are needed, and one request at most to learn that there are some, and how long they are.
      const paths = new Set(asked.map(({ path }) => path));
      assert.deepEqual(
        [...paths].sort(),
        Array.from({ length: Math.ceil(SIZE / size) }, (_, i) => `/file.mt${i ? `.000${i}` : ""}`),
        what,
      );
      assert.ok(asked.length <= 16, `${what}: ${asked.length} requests`);
    }
  }
});

test("the page lets people choose all shards of a file", async () => {
  const page = await readFile(new URL("../../www/index.html", import.meta.url), "utf8");
  const [chooser] = /<input type="file" id="file"[^>]*>/.exec(page);
  assert.match(chooser, / multiple /);
  // Endings cannot name shards: `.0001` and all that follow.
  assert.doesNotMatch(chooser, / accept=/);
});

test("a shard that is missing or has another length is named", async () => {
  const fails = (handler, options) => {
    answer = handler;
    return fetchAll(WANTED, options, `${base}?${++round}`).then(assert.fail, (error) => [error.code, /`(\.\d+)`/.exec(error.message)?.[1]]);
  };
  assert.deepEqual(await fails(inShards(70_000, { missing: 2 })), ["truncated", ".0002"]);
  assert.deepEqual(await fails(inShards(70_000, { missing: 1, told: false })), ["truncated", ".0001"]);
  const short = inShards(70_000);
  const other = inShards(69_000);
  const mixed = (request, response) => (request.path.endsWith(".0001") ? other : short)(request, response);
  assert.deepEqual(await fails(mixed), ["truncated", ".0001"]);
  // A file of the user has no shards beside it.
  assert.deepEqual(await fails(good, { blob: new Blob([headed.subarray(0, 70_000)]) }), ["truncated", ".0001"]);
});

test("what was fetched once is kept for the next time", async () => {
  // Node has no Cache Storage: as much of one as is needed.
  const stores = new Map();
  globalThis.caches = /** @type {any} */ ({
    async open(name) {
      if (!stores.has(name)) stores.set(name, new Map());
      const store = stores.get(name);
      return {
        keys: async () => [...store.keys()].map((url) => new Request(url)),
        match: async (url) => store.get(url)?.clone(),
        put: async (url, response) => void store.set(url, response),
        delete: async (url) => store.delete(url),
      };
    },
  });
  try {
    let tag = '"one"';
    answer = (range, response) => response.writeHead(206, headers(range, { etag: tag })).end(file.slice(range.start, range.end));
    const bytes = async () => {
      const { ranges } = await fetchAll([[0, 10]], { cache: "mt", open: true });
      await new Promise((resolve) => setTimeout(resolve, 20));
      ranges.close();
      // The first range of a session always comes from the server: it tells which version that has.
      const before = asked.length;
      const got = new Map();
      let second;
      await new Promise((resolve, reject) => {
        const onRange = (start, end, bytes) => {
          got.set(start, bytes);
          if (start === 0 && got.size === 1)
            setTimeout(
              () =>
                want(
                  second,
                  WANTED.slice(1).flatMap(([a, b]) => [a, b, 0]),
                ),
              20,
            );
          if (got.size === WANTED.length) resolve(undefined);
        };
        second = open(base, { onRange, onError: reject }, { cache: "mt" });
        want(second, [0, 1000, 0]);
      });
      second.close();
      for (const [start, end] of WANTED) assert.deepEqual(got.get(start), file.slice(start, end));
      return asked.slice(before).reduce((sum, { start, end }) => sum + end - start, 0);
    };
    assert.ok((await bytes()) > 100_000);
    assert.equal(await bytes(), 1000);
    tag = '"two"';
    assert.ok((await bytes()) > 100_000);
    assert.ok([...stores.get("mt").keys()].every((url) => url.includes("two")));
  } finally {
    delete globalThis.caches;
  }
});
