// Files on servers that are fetched in parts: the meshes are those of the whole file, at fewer bytes, whatever the server
// does; or there is an error that says what to do about it, and the mesh stays valid.
import assert from "node:assert/strict";
import { execFile } from "node:child_process";
import { mkdir, mkdtemp, readFile, rm, symlink, writeFile } from "node:fs/promises";
import { createServer } from "node:http";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, beforeEach, describe, test } from "node:test";
import { fileURLToPath } from "node:url";
import { promisify } from "node:util";
import { MultiTessellation } from "../../pkg/index.js";
import { rejects } from "./rejects.js";

const folder = process.env.TETRALOD_FIXTURE;
assert.ok(folder, "TETRALOD_FIXTURE is not set: run `cargo xtask test js`");
/** Hundreds of blocks, of the kind of MT whose blocks come one by one. */
const blocks = {};
for (const kind of ["half-edge"]) blocks[kind] = new Uint8Array(await readFile(`${folder}/blocks-${kind}.mt`));
/** With two fields. */
const fields = new Uint8Array(await readFile(`${folder}/fields.mt`));
/** What the server has. */
let bytes;
/** Small parts of the model. */
const REQUESTS = [
  { error: "2%", box: [0.1, 0.1, 0.1, 0.3, 0.3, 0.3] },
  { error: "1%", isovalues: [0.2] },
  { error: "0.5%", box: [0.6, 0.6, 0.6, 0.8, 0.8, 0.8] },
];
/** Blocks of this file are much smaller than those of others, and servers near by. */
const QUICK = { retries: 3, backoffMs: 5, timeoutMs: 2000, gap: 256 };

/** Start and end of all bytes but the last third, which a part of the file does not have, with a gap. */
function partOf(whole) {
  const [first, second] = [Math.floor(whole.length / 2), Math.floor((2 * whole.length) / 3)];
  const ranges = [0, first, first + 9, second];
  const read = (start, end) => {
    assert.ok(end <= first || (start >= first + 9 && end <= second), `${start} to ${end} is not there`);
    return whole.subarray(start, end);
  };
  return { name: "some.mt", size: whole.length, read, ranges };
}

test("a part of a file gives the meshes that it has the blocks of, and says which it lacks", async () => {
  const whole = await MultiTessellation.open(blocks["half-edge"], { worker: false });
  await whole.complete;
  for (const worker of [false, true]) {
    const mt = await MultiTessellation.open(partOf(blocks["half-edge"]), { worker });
    const coarse = await mt.refine({ error: "20%" });
    await whole.refine({ error: "20%" });
    assert.equal(await mt.hash(), await whole.hash());
    assert.deepEqual([coarse.stats.satisfied, coarse.stats.limitedBy, mt.progress.blocks?.absent], [true, "error", 0]);
    const fine = await mt.refine({ error: 0 });
    assert.deepEqual([fine.stats.satisfied, fine.stats.limitedBy, fine.stats.missing], [false, "part", false]);
    assert.ok(mt.progress.blocks?.absent && fine.stats.tetrahedra > coarse.stats.tetrahedra);
    await mt.refine({ error: "20%" });
    assert.equal(await mt.hash(), await whole.hash());
    const view = await mt.view();
    assert.equal((await view.refine({ error: 0 })).stats.limitedBy, "part");
    mt.free();
  }
  whole.free();
});

let server;
let base;
/** What answers now, and what it has been asked and has sent. */
let answer;
let asked = [];
let sent = 0;

before(async () => {
  server = createServer((request, response) => {
    const [, start, last] = /^bytes=(\d+)-(\d*)$/.exec(request.headers.range ?? "") ?? [];
    const range = start !== undefined && {
      start: Number(start),
      end: Math.min(last ? Number(last) + 1 : bytes.length, bytes.length),
    };
    asked.push({ ...range, headers: request.headers });
    const number = asked.length - 1;
    for (const name of ["write", "end"]) {
      const own = response[name].bind(response);
      response[name] = (chunk, ...rest) => {
        sent += chunk?.length ?? 0;
        return own(chunk, ...rest);
      };
    }
    answer({ ...range, number, headers: request.headers }, response);
  });
  await new Promise((resolve) => server.listen(0, "127.0.0.1", resolve));
  base = `http://127.0.0.1:${server.address().port}/model.mt`;
});

beforeEach(() => {
  answer = good;
  asked = [];
  sent = 0;
});

after(() => {
  server.closeAllConnections();
  server.close();
});

function head({ start, end }, response, tag = '"one"') {
  const range = `bytes ${start}-${end - 1}/${bytes.length}`;
  response.writeHead(206, { "content-range": range, "content-length": end - start, etag: tag });
}

function good(range, response) {
  head(range, response);
  response.end(bytes.slice(range.start, range.end));
}

function whole(_, response) {
  response.writeHead(200, { "content-length": bytes.length }).end(bytes);
}

/** The hash of each request's mesh from the whole file. */
const hashesOf = async (file) => {
  const mt = await MultiTessellation.open(file, { worker: false });
  await mt.complete;
  const hashes = [];
  for (const request of REQUESTS) {
    await mt.refine(request);
    hashes.push(await mt.hash());
  }
  mt.free();
  return hashes;
};

/** All faces of the mesh are shared by two tetrahedra that know each other, or on the boundary. */
function checkMesh({ tets, neighbors, positions, stats }) {
  assert.equal(tets.length, 4 * stats.tetrahedra);
  assert.equal(positions.length, 3 * stats.vertices);
  for (let t = 0; t < stats.tetrahedra; t++) {
    for (let i = 0; i < 4; i++) {
      const other = neighbors[4 * t + i];
      if (other !== 0xffffffff) assert.ok(neighbors.subarray(4 * other, 4 * other + 4).includes(t));
    }
  }
}

for (const [kind, worker] of Object.keys(blocks).flatMap(
  (kind) =>
    /** @type {[string, boolean][]} */ ([
      [kind, true],
      [kind, false],
    ]),
)) {
  describe(`${kind} in ${worker ? "a worker" : "the caller's thread"}`, () => {
    let hashes;
    before(async () => (hashes = await hashesOf(blocks[kind])));
    beforeEach(() => (bytes = blocks[kind]));

    const open = (options) => MultiTessellation.open(base, { worker, ...QUICK, ...options });

    test("a request fetches what it needs and gives the mesh of the whole file", async () => {
      const seen = [];
      const mt = await open({ onProgress: (progress) => seen.push(progress) });
      assert.ok(mt.progress.blocks.all > 200, `${mt.progress.blocks.all} blocks`);
      assert.ok(sent < bytes.length / 3, "the base mesh and the index come first");
      assert.equal(mt.progress.total, bytes.length);
      const first = await mt.refine(REQUESTS[0]);
      checkMesh(first);
      assert.deepEqual([first.stats.satisfied, first.stats.missing, first.stats.done], [true, false, true]);
      assert.ok(!("more" in first));
      assert.equal(await mt.hash(), hashes[0]);
      assert.ok(sent < bytes.length / 2, `${sent} of ${bytes.length}`);
      for (const [i, request] of REQUESTS.entries()) {
        await mt.refine(request);
        assert.equal(await mt.hash(), hashes[i], `request ${i}`);
      }
      assert.ok(sent < 0.8 * bytes.length, `${sent} of ${bytes.length}`);
      const { blocks } = mt.progress;
      assert.ok(blocks.here >= blocks.needed && blocks.here < blocks.all && blocks.leftOut === 0);
      assert.ok(seen.every((progress, i) => i === 0 || progress.bytes >= seen[i - 1].bytes));
      await mt.complete;
      const before = sent;
      await mt.refine(REQUESTS[0]);
      assert.equal(sent, before, "what is here is not fetched again");
      mt.free();
    });

    test("the file's head says how values are spread, and what a mesh of some error takes", async () => {
      const mt = await open({ gap: 0 });
      const [{ min, max, histogram, curve }] = mt.info.fields;
      assert.equal(histogram.length, 64);
      assert.ok(Math.abs(histogram.reduce((a, b) => a + b) - 1) < 1e-9 && histogram.every((share) => share >= 0));
      const { errors, bytes: costs } = curve;
      assert.ok(errors instanceof Float64Array && costs instanceof Float64Array && errors.length === costs.length);
      assert.ok(errors.length > 10 && errors.at(-1) === 0 && costs.at(-1) <= bytes.length, `${errors}; ${costs}`);
      for (let i = 1; i < errors.length; i++) assert.ok(errors[i] < errors[i - 1] && costs[i] > costs[i - 1]);
      assert.equal(sent, costs[0], "what comes first");
      for (const i of [2, errors.length >> 1, errors.length - 1]) {
        await mt.refine({ error: errors[i] });
        assert.equal(sent, costs[i], `error ${errors[i]}`);
      }
      const { histogram: volumes } = await mt.stats({ bins: 64, range: [min, max] });
      const volume = volumes.reduce((a, b) => a + b);
      // Views have single precision, so values at the end of a bin may be in the next one.
      let difference = 0;
      volumes.forEach((bin, i) => assert.ok(Math.abs((difference += bin / volume - histogram[i])) < 1e-3, `bin ${i}: ${difference}`));
      const view = await mt.view();
      assert.deepEqual(view.info, mt.info);
      mt.free();
    });

    test("what is here is given at once, and says that more is on its way", async () => {
      const mt = await open();
      let release;
      const gate = new Promise((resolve) => (release = resolve));
      answer = async (range, response) => {
        await gate;
        good(range, response);
      };
      const early = await mt.refine(REQUESTS[0], { partial: true });
      checkMesh(early);
      assert.deepEqual([early.stats.satisfied, early.stats.missing], [false, true]);
      release();
      const late = await mt.refine(REQUESTS[0]);
      assert.deepEqual([late.stats.satisfied, late.stats.missing], [true, false]);
      assert.equal(await mt.hash(), hashes[0]);
      mt.free();
    });

    test("steps go on as blocks arrive", async () => {
      const mt = await open();
      answer = (range, response) => setTimeout(() => good(range, response), 10);
      let steps = 0;
      let last;
      for await (const step of mt.refineSteps(REQUESTS[1], { budgetMs: 50 })) {
        assert.ok(!last || last.stats.missing || !last.stats.done || mt.progress.blocks.needed > 0);
        last = step;
        steps++;
      }
      assert.ok(steps > 1, `${steps} steps`);
      assert.ok(last.stats.done && last.stats.satisfied && !last.stats.missing);
      assert.equal(await mt.hash(), hashes[1]);
      mt.free();
    });

    test("what a module asks for in a box takes a part of the file, as the index says", async () => {
      const where = `data:text/javascript,${encodeURIComponent("export default ({ errors }) => errors.map((error) => error / 0.01);")}`;
      const request = { where, whereBox: REQUESTS[0].box };
      const whole = await MultiTessellation.open(blocks[kind], { worker });
      await whole.complete;
      await whole.refine(request);
      const mt = await open();
      const { stats } = await mt.refine(request);
      const { needed, here, all, missed } = mt.progress.blocks;
      assert.equal(await mt.hash(), await whole.hash());
      assert.ok(stats.satisfied && needed > 0 && here < all, `${needed}, ${here} of ${all}`);
      assert.equal(missed, 0);
      mt.free();
      whole.free();
    });

    test("another request replaces the one before, and what only that needed is cancelled", async () => {
      const mt = await open();
      let closed = 0;
      const held = [];
      answer = (range, response) => {
        held.push(range);
        response.on("close", () => closed++);
      };
      const replaced = mt.refine(REQUESTS[0]);
      replaced.catch(() => {});
      await until(() => held.length > 0, "something is asked for");
      answer = good;
      const second = mt.refine(REQUESTS[2]);
      await rejects(replaced, "replaced");
      checkMesh(await second);
      assert.equal(await mt.hash(), hashes[2]);
      await until(() => closed > 0, "a request is cancelled");
      mt.free();
    });

    test("a request that is given up leaves the mesh, fetches nothing more, and the next one is met", async () => {
      const mt = await open();
      await mt.refine(REQUESTS[0]);
      const before = await mt.hash();
      let closed = 0;
      const held = [];
      answer = (range, response) => {
        held.push(range);
        response.on("close", () => closed++);
      };
      const control = new AbortController();
      const given = mt.refine({ error: 0 }, { signal: control.signal });
      given.catch(() => {});
      await until(() => held.length > 0, "something is asked for");
      control.abort();
      await assert.rejects(given, { name: "AbortError" });
      await until(() => closed > 0, "a request is cancelled");
      const { stats: now } = await mt.refine(REQUESTS[0], { partial: true });
      assert.ok(now.satisfied && now.tetrahedra > 0);
      assert.equal(await mt.hash(), before, "what was there can be made again without a server");
      answer = good;
      const early = { signal: AbortSignal.abort(new Error("enough")) };
      for (const call of [(how) => mt.surface(how), (how) => mt.isosurface(0.2, how), (how) => mt.refine(REQUESTS[2], how)]) {
        await assert.rejects(call(early), /enough/);
        await call({});
      }
      assert.equal(await mt.hash(), hashes[2]);
      held.length = 0;
      answer = (range) => held.push(range);
      const aside = mt.isosurface(0.2, { request: { error: 0 }, signal: AbortSignal.timeout(300) });
      await assert.rejects(aside, { name: "TimeoutError" });
      answer = good;
      assert.ok((await mt.isosurface(0.2, { request: REQUESTS[1] })).indices.length > 0);
      assert.equal(await mt.hash(), hashes[2]);
      mt.free();
    });

    test("a request that is refused replaces none and changes nothing", async () => {
      const mt = await open();
      await mt.refine(REQUESTS[0]);
      const wrong = [{ field: "T" }, { field: 7 }, { error: -1 }, { error: "1%", isovalues: [NaN] }, { box: [1, 1, 1, 0, 0, 0] }];
      for (const request of wrong) await rejects(mt.refine(request), "bad-option");
      await rejects(mt.setField("T"), "bad-option", /T/);
      assert.equal(await mt.hash(), hashes[0]);
      answer = (range, response) => setTimeout(() => good(range, response), 10);
      let steps = 0;
      let refused;
      for await (const step of mt.refineSteps(REQUESTS[1], { budgetMs: 50 })) {
        if (steps++ === 0) await rejects((refused = mt.refine({ field: "T" })), "bad-option");
        assert.ok(step.tets.length > 0);
      }
      assert.ok(refused && steps > 1, `${steps} steps`);
      assert.equal(await mt.hash(), hashes[1], "the steps go on to their end");
      mt.free();
    });

    test("a small memory holds what fits, and other requests find room again", async () => {
      const mt = await open({ memory: 300_000 });
      for (const round of [0, 1]) {
        for (const [i, request] of REQUESTS.entries()) {
          const mesh = await mt.refine(request);
          checkMesh(mesh);
          assert.equal(mesh.stats.missing, false);
          const { leftOut, needed } = mt.progress.blocks;
          assert.equal(mesh.stats.satisfied, leftOut === 0 || mesh.stats.satisfied, `${round} ${i} ${leftOut}/${needed}`);
          if (leftOut === 0) assert.equal(await mt.hash(), hashes[i]);
        }
      }
      mt.free();
    });

    test("cut connections and server errors pass", async () => {
      answer = (range, response) => {
        if (range.number % 4 === 1) return response.writeHead(503, { "retry-after": 0 }).end();
        if (range.number % 4 === 2) return response.destroy();
        if (range.number % 4 === 3 && range.end - range.start > 1000) {
          head(range, response);
          response.write(bytes.slice(range.start, range.start + 900));
          return setTimeout(() => response.destroy(), 20);
        }
        return good(range, response);
      };
      // Three of four answers are none.
      const mt = await open({ retries: 12 });
      for (const [i, request] of REQUESTS.entries()) {
        checkMesh(await mt.refine(request));
        assert.equal(await mt.hash(), hashes[i]);
      }
      mt.free();
    });

    test("a server that fails for good is reported, and gone on with when it is back", async () => {
      const mt = await open();
      answer = (_, response) => response.writeHead(500).end();
      await rejects(mt.refine(REQUESTS[0]), "network", /model\.mt: .*500/);
      await rejects(mt.complete, "network");
      const meanwhile = await mt.refine(REQUESTS[0], { partial: true });
      checkMesh(meanwhile);
      assert.equal(meanwhile.stats.satisfied, false);
      const steps = mt.refineSteps(REQUESTS[0]);
      await rejects(
        (async () => {
          for await (const step of steps) checkMesh(step);
        })(),
        "network",
      );
      answer = good;
      await mt.retry();
      await mt.refine(REQUESTS[0]);
      assert.equal(await mt.hash(), hashes[0]);
      mt.free();
    });

    test("a file that changes is noticed: the mesh stays, and nothing of both is mixed", async () => {
      const mt = await open();
      await mt.refine(REQUESTS[0]);
      answer = (range, response) => {
        head(range, response, '"two"');
        response.end(bytes.slice(range.start, range.end).reverse());
      };
      await rejects(mt.refine(REQUESTS[2]), "changed", /replaced/);
      checkMesh(await mt.refine(REQUESTS[0], { partial: true }));
      assert.equal(await mt.hash(), hashes[0]);
      await rejects(mt.retry(), "changed");
      mt.free();
    });

    test("damaged blocks are refused, and come when they are sound again", async () => {
      const mt = await open();
      answer = (range, response) => {
        head(range, response);
        response.end(bytes.slice(range.start, range.end).map((byte) => byte ^ 1));
      };
      await rejects(mt.refine(REQUESTS[0]), "corrupt", /model\.mt: /);
      checkMesh(await mt.refine(REQUESTS[0], { partial: true }));
      answer = good;
      await mt.retry();
      checkMesh(await mt.refine(REQUESTS[0]));
      assert.equal(await mt.hash(), hashes[0]);
      mt.free();
    });

    test("where there are no ranges, or the whole is wanted, the file comes as a stream", async () => {
      answer = whole;
      const mt = await open();
      await mt.complete;
      assert.equal(mt.progress.complete, true);
      assert.equal(mt.progress.blocks, undefined);
      await rejects(mt.retry(), "bad-source");
      mt.free();

      asked = [];
      const streamed = await open({ whole: true, headers: { "x-key": "open" } });
      const mesh = await streamed.refine(REQUESTS[0]);
      checkMesh(mesh);
      assert.equal(await streamed.hash(), hashes[0]);
      assert.deepEqual(
        asked.map(({ start }) => start),
        [undefined],
      );
      assert.equal(asked[0].headers["x-key"], "open");
      streamed.free();
    });

    test("a reader of the caller's own is asked for the same ranges, and says itself what is wrong", async () => {
      const copy = bytes.slice();
      const [request] = REQUESTS;
      const read = [];
      const reader = {
        name: "own.mt",
        size: bytes.length,
        read(start, end) {
          read.push([start, end]);
          return bytes.subarray(start, end);
        },
      };
      const opened = (source) => MultiTessellation.open(source, { worker, gap: 256 });
      const [mt, other] = [await opened(reader), await opened(reader)];
      await mt.refine(request);
      assert.equal(await mt.hash(), hashes[0]);
      assert.ok(mt.progress.blocks.here < mt.progress.blocks.all, "what is not needed is not read");
      assert.ok(read.every(([start, end]) => 0 <= start && start < end && end <= bytes.length));
      assert.deepEqual(bytes, copy, "the caller keeps the bytes");
      // As a stream, and as a second mesh of the same file.
      const view = await mt.view();
      await view.refine(request);
      assert.equal(await view.hash(), await mt.hash());
      const front = await MultiTessellation.open(reader, { worker, whole: true });
      await front.complete;
      assert.equal(front.progress.bytes, bytes.length);
      // What it throws is the error of whoever waits, with its code; then it is asked again.
      reader.read = () => Promise.reject(Object.assign(new Error("it was replaced"), { code: "changed" }));
      await rejects(other.refine({ error: 0 }), "changed", /^own\.mt: it was replaced$/);
      await rejects(opened({ ...reader, read: () => Promise.reject(new Error("no way")) }), "network", /^own\.mt: no way$/);
      await rejects(opened({ ...reader, read: () => new Uint8Array(3) }), "bad-source", /^own\.mt: `read\(0, \d+\)` gave 3 bytes$/);
      await rejects(opened({ ...reader, read: () => undefined }), "bad-source", /gave no bytes$/);
      for (const one of [mt, other, front]) one.free();
    });

    test("headers go along, and URLs and requests do as well as text", async () => {
      for (const source of [new URL(base), new Request(base, { headers: { "x-key": "open" } })]) {
        asked = [];
        const headers = source instanceof URL ? { "x-key": "open" } : undefined;
        const mt = await MultiTessellation.open(source, { worker, headers });
        await mt.refine(REQUESTS[0]);
        assert.equal(await mt.hash(), hashes[0]);
        assert.ok(asked.every(({ headers, start }) => headers["x-key"] === "open" && start !== undefined));
        mt.free();
      }
    });

    test("fields are chosen by name, and told with what is known of them", async () => {
      const [{ name, floor, unit, time, vector }] = (await open({ fields: [] })).info.fields;
      assert.ok(floor >= 0 && floor < 0.01);
      assert.deepEqual([unit, time, vector], ["", undefined, undefined]);
      const mt = await open({ fields: [name] });
      const { stats } = await mt.refine({ ...REQUESTS[0], field: 0 });
      assert.ok(stats.errorBound >= floor, "no bound is below what storing rounds off");
      await mt.setField(0);
      await rejects(mt.setField(1), "bad-option", /0 to 0/);
      mt.free();
      await rejects(open({ fields: ["none"] }), "bad-option", /none/);
      await rejects(open({ fields: "p" }), "bad-option", /`fields`/);
      await rejects(open({ memory: "much" }), "bad-option", /`memory`/);
    });

    test("of several fields just the wanted ones are fetched, each with an error of its own", async () => {
      bytes = fields;
      const fetched = {};
      for (const names of [["pressure", "speed"], ["speed"]]) {
        const before = sent;
        const mt = await open({ fields: names, gap: 0 });
        assert.deepEqual(
          mt.info.fields.map(({ name }) => name),
          names,
        );
        for (const [number, { name, min, max, floor }] of mt.info.fields.entries()) {
          assert.ok(floor > 0 && floor < 1e-3 * (max - min));
          const { stats } = await mt.refine({ error: "4%", field: number });
          assert.ok(stats.satisfied && stats.relativeErrorBound <= 0.04);
          const byNumber = await mt.hash();
          await mt.refine({ error: "4%", field: name });
          assert.equal(await mt.hash(), byNumber);
        }
        const { floor } = mt.info.fields.at(-1);
        const exact = await mt.refine({ error: 0, field: "speed" });
        assert.equal(exact.stats.tetrahedra, mt.info.tetrahedra);
        assert.ok(exact.stats.errorBound >= floor && exact.stats.bounds[0] >= floor, "what storing rounds off counts");
        fetched[names.length] = sent - before;
        mt.free();
      }
      // What stands in front of the blocks comes as a whole.
      assert.ok(fetched[1] < 0.95 * fetched[2], JSON.stringify(fetched));
    });

    test("a signal ends the fetching, and what has come stays usable", async () => {
      const abort = new AbortController();
      const mt = await open({ signal: abort.signal });
      answer = () => {};
      const never = mt.refine(REQUESTS[0]);
      abort.abort();
      await assert.rejects(never, { name: "AbortError" });
      await assert.rejects(mt.complete, { name: "AbortError" });
      checkMesh(await mt.refine(REQUESTS[0], { partial: true }));
      mt.free();
      await rejects(mt.refine(REQUESTS[0]), "freed");
    });
  });
}

test("damage is not kept in the cache", async () => {
  bytes = blocks["half-edge"];
  const hashes = await hashesOf(bytes);
  // Node has no Cache Storage: as much of one as is needed.
  const store = new Map();
  let listed = 0;
  globalThis.caches = /** @type {any} */ ({
    open: async () => ({
      keys: async () => {
        listed++;
        return [...store.keys()].map((url) => new Request(url));
      },
      match: async (url) => store.get(url)?.clone(),
      put: async (url, response) => void store.set(url, response),
      delete: async (url) => store.delete(url),
    }),
  });
  try {
    const open = () => MultiTessellation.open(base, { worker: false, cache: "mt", ...QUICK });
    const mt = await open();
    answer = (range, response) => {
      head(range, response);
      response.end(bytes.slice(range.start, range.end).map((byte) => byte ^ 1));
    };
    await rejects(mt.refine(REQUESTS[2]), "corrupt");
    answer = good;
    await mt.retry();
    await mt.refine(REQUESTS[2]);
    assert.equal(await mt.hash(), hashes[2]);
    mt.free();
    const [before, earlier] = [sent, listed];
    const other = await open();
    await until(() => listed > earlier, "the cache, which opens beside, is looked at");
    await other.refine(REQUESTS[2]);
    assert.equal(await other.hash(), hashes[2]);
    assert.ok(sent - before < 0.5 * before, "most comes from the cache");
    other.free();
  } finally {
    delete globalThis.caches;
  }
});

async function until(condition, what) {
  for (let i = 0; i < 300; i++) {
    if (condition()) return;
    await new Promise((resolve) => setTimeout(resolve, 10));
  }
  assert.fail(`waited in vain until ${what}`);
}

/** The first block of JavaScript of a page that begins like this. */
async function example(page, start) {
  const blocks = (await readFile(new URL(`../../${page}`, import.meta.url), "utf8")).split("```js\n").slice(1);
  const found = blocks.map((block) => block.split("```")[0]).find((block) => block.startsWith(start));
  assert.ok(found, `${page} has an example that begins with ${start}`);
  return found;
}

/** What a module prints, line by line and word by word, that imports the package as a project of its own does. */
async function printed(code) {
  const project = await mkdtemp(join(tmpdir(), "tetralod-readme-"));
  try {
    await mkdir(join(project, "node_modules"));
    await symlink(fileURLToPath(new URL("../../pkg", import.meta.url)), join(project, "node_modules/tetralod"));
    await writeFile(join(project, "example.mjs"), code.replace("import.meta.url", JSON.stringify(base)));
    const { stdout, stderr } = await promisify(execFile)("node", ["example.mjs"], { cwd: project });
    assert.equal(stderr, "");
    return stdout
      .trim()
      .split("\n")
      .map((line) => line.split(" "));
  } finally {
    await rm(project, { recursive: true });
  }
}

test("the example of the README does what its text says, from a server with ranges", async () => {
  bytes = blocks["half-edge"];
  const code = await example("README.md", "import { MultiTessellation }");
  assert.ok(code.includes('"bucky.mt", import.meta.url'));
  const [early, sharp, surface] = await printed(code);
  assert.ok(Number(early[0]) > 0 && ["true", "false"].includes(early[1]));
  assert.ok(Number(sharp[0]) > 0 && Number(sharp[1]) <= 0.01 && sharp[2] === "true", "what is asked for is there without more ado");
  assert.ok(Number(surface[0]) > 0 && surface[1] === "triangles");
  assert.ok(sent < bytes.length, "not all of the file is fetched");
});

test("the first example of the package's README does what its text says", async () => {
  bytes = blocks["half-edge"];
  const code = await example("pkg-template/README.md", "import { MultiTessellation }");
  const lines = await printed(`${code}
    console.log(coarse.stats.tetrahedra < sharp.stats.tetrahedra, sharp.stats.satisfied, surface.indices.length > 0);`);
  assert.deepEqual(lines.pop(), ["true", "true", "true"]);
  assert.ok(lines.length > 0 && lines.every(([received, , total]) => Number(received) <= bytes.length && Number(total) === bytes.length));
});

test("the example of the package's README for three.js takes what that library has", async () => {
  bytes = blocks["half-edge"];
  const code = await example("pkg-template/README.md", "// three.js");
  const [[steps, done, most]] = await printed(`
    import { MultiTessellation, applyChanges } from "tetralod";
    const mt = await MultiTessellation.open(new URL("model.mt", import.meta.url));
    const matrix4 = { elements: [2, 0, 0, 0, 0, 2, 0, 0, 0, 0, -1, -1, -1, -1, 2, 3], clone: () => matrix4, multiply: () => matrix4 };
    const camera = { projectionMatrix: matrix4, matrixWorldInverse: matrix4 };
    const [canvas, probe] = [{ width: 640, height: 480 }, { position: { x: 0.5, y: 0.5, z: 0.5 } }];
    let steps = 0;
    const upload = (mesh, changes) => (steps += mesh.tets.length > 0 && changes !== undefined);
    ${code.replace("const mesh =", "let last;\n    const mesh =").replace("upload(", "last = step.stats;\n  upload(")}
    console.log(steps, last.done, last.tetrahedra);
    mt.free();`);
  assert.ok(Number(steps) > 0 && done === "true" && Number(most) > 0);
});
