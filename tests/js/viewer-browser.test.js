// The viewer in a real browser: its mesh as arrays, a mesh that stays, fewer tetrahedra while something moves, a GPU that is lost.
import assert from "node:assert/strict";
import { readFile } from "node:fs/promises";
import { after, before, test } from "node:test";
import { launch, servePackage } from "./browser.js";
import { assertDrawn, distance, study } from "./study.js";

const folder = process.env.TETRALOD_FIXTURE;
assert.ok(folder, "TETRALOD_FIXTURE is not set: run `cargo xtask test e2e`");
const file = await readFile(`${folder}/blocks-half-edge.mt`);
const fields = await readFile(`${folder}/fields.mt`);

const PAGE = `<!doctype html><style>canvas { width: 300px; height: 200px }</style><canvas></canvas>
  <script type="importmap">{ "imports": { "tetralod": "/pkg/index.js", "tetralod/viewer": "/pkg/viewer.js" } }</script>`;

let browser;
let server;
/** Paths that were asked for. */
let asked = [];

/** Answers with a part of the file. */
function endPart(range, response) {
  const [, first, last] = /^bytes=(\d+)-(\d+)$/.exec(range).map(Number);
  const part = file.subarray(first, last + 1);
  response.writeHead(206, { etag: '"1"', "content-range": `bytes ${first}-${first + part.length - 1}/${file.length}` }).end(part);
}

before(async () => {
  server = await servePackage(({ url, headers }, response) => {
    asked.push(url);
    if (url === "/model.mt") response.end(file);
    else if (url === "/parts.mt") endPart(headers.range, response);
    else if (url === "/fields.mt") response.end(fields);
    else if (url === "/nothing.mt") response.writeHead(404).end();
    else response.setHeader("content-type", "text/html").end(PAGE);
  });
  browser = await launch();
});

after(async () => {
  await browser?.close();
  server?.close();
});

/** A page with a viewer of the file, at full resolution. */
async function opened(options = {}) {
  const page = await browser.newPage();
  await page.goto(server.address);
  await page.evaluate(async (options) => {
    const { Viewer } = await import("tetralod/viewer");
    const viewer = await Viewer.create(document.querySelector("canvas"), options);
    const events = [];
    window.tetralodDemo = { viewer, events };
    for (const name of ["error", "restored", "stats", "frame"]) {
      viewer.addEventListener(name, (event) => events.push({ name, detail: /** @type {CustomEvent} */ (event).detail }));
    }
    await viewer.open("/model.mt");
    window.tetralodDemo.full = await viewer.refine({ error: 0 });
  }, options);
  return page;
}

test("what a viewer gives of its mesh is what MultiTessellation gives, with one module and one download", async () => {
  const page = await opened();
  const own = () =>
    page.evaluate(async () => {
      const mt = window.tetralodDemo.mt ?? window.tetralodDemo.viewer;
      const how = { fields: true };
      const slice = await mt.slice([0, 0, 1], 0.5, how);
      const { positions } = slice;
      const [[p], line, surface, lines] = [
        await mt.probe([0.5, 0.5, 0.5]),
        await mt.line([0, 0, 0], [1, 1, 1]),
        await mt.surface(how),
        await mt.isosurface(0.5, how),
      ];
      const { volume, histogram } = await mt.stats({ bins: 4 });
      const sizes = [positions, line.at, surface.indices, lines.positions, lines.normals].map((array) => array.length);
      // The order of vertices depends on what was asked for before.
      const fields = [slice, surface, lines].map(({ fields }) =>
        fields.map(({ index, name, values }) => [index, name, Array.from(values).sort((a, b) => a - b)]),
      );
      return JSON.stringify({ sizes, fields, p, volume, bins: Array.from(histogram), hash: await mt.hash() });
    });
  asked = [];
  const ofViewer = await own();
  assert.ok(
    JSON.parse(ofViewer).sizes.every((size) => size > 0),
    ofViewer,
  );
  assert.deepEqual(asked, [], "nothing is downloaded again");
  assert.deepEqual(
    server.asked.filter((name) => name.endsWith(".wasm")),
    ["tetralod_viewer_bg.wasm"],
    "one module",
  );
  const same = await page.evaluate(async () => {
    const { MultiTessellation } = await import("tetralod");
    window.tetralodDemo.mt = await MultiTessellation.open("/model.mt");
    const whole = await window.tetralodDemo.mt.refine({ error: 0 }, { fields: true });
    const shown = await window.tetralodDemo.viewer.mesh({ fields: true });
    const arrays = ["positions", "field", "tets", "neighbors"].map((name) => whole[name].length === shown[name].length);
    const own = [whole, shown].map(({ field, fields: [{ values }] }) => values.every((value, i) => value === field[i]));
    const vertices = ({ positions, fields: [{ values }] }) =>
      Array.from(values, (value, i) => [...positions.subarray(3 * i, 3 * i + 3), value].join())
        .sort()
        .join(" ");
    return [...arrays, ...own, vertices(whole) === vertices(shown)];
  });
  assert.deepEqual(same, Array(7).fill(true));
  assert.equal(await own(), ofViewer);
  const codes = await page.evaluate(() => {
    const code = (promise) =>
      promise.then(
        () => "none",
        (error) => error.code,
      );
    const { viewer } = window.tetralodDemo;
    return Promise.all([viewer.probe([1, 2]), viewer.stats({ bin: 1 }), viewer.slice([0, 0, 0], 1)].map(code));
  });
  assert.deepEqual(codes, ["bad-option", "bad-option", "bad-option"]);
  await page.close();
});

/** What a call is rejected with: its code, or its name. */
const CODES = "window.codeOf = (promise) => promise.then(() => 'none', (error) => error.code ?? error.name)";

test("what is wrong is refused and changes nothing, what comes with it is not, and another volume gets what fits it", async () => {
  const page = await opened();
  await page.evaluate(CODES);
  const seen = await page.evaluate(async () => {
    const {
      codeOf,
      tetralodDemo: { viewer, events },
    } = /** @type {any} */ (window);
    const [x] = viewer.info.fields.map(({ name }) => name);
    await viewer.set({ isosurfaces: [{ field: x }], boundary: { opacity: 0.5 } });
    const before = JSON.stringify(viewer.state);
    const wrong = [
      { isosurfaces: [{ field: "T" }] },
      { slices: [{ normal: [0, 0, 1], offset: 0.5, field: "T" }] },
      { streamlines: { fields: ["u", "v", "w"], seeds: [[0, 0, 0]] } },
      { arrows: { fields: [x, x, x], field: "T" } },
      { arrows: { fields: [x, x, x], spacing: -1 } },
      { cells: { colourBy: "T" } },
      { colours: { range: [2, 1] } },
      { colours: { range: [0, 1], log: true } },
      { camera: { target: [0, 0, 0], distance: 1, yaw: 0, pitch: 0, projection: "round" }, outline: false },
    ];
    // At once: they go to the worker together, with one that is right between them.
    const codes = Promise.all(wrong.map((state) => codeOf(viewer.set(state))));
    const good = await codeOf(viewer.set({ outline: false }));
    const refused = await codes;
    const after = viewer.state;
    const isSame = JSON.stringify({ ...after, outline: undefined }) === JSON.stringify({ ...JSON.parse(before), outline: undefined });
    const meshes = [await codeOf(viewer.refine({ field: "T" })), await codeOf(viewer.refine({ error: "5%" }))];
    return { refused, good, isSame, outline: after.outline, meshes, errors: events.filter(({ name }) => name === "error").length };
  });
  assert.deepEqual(seen, { refused: Array(9).fill("bad-option"), good: "none", isSame: true, outline: false, meshes: ["bad-option", "none"], errors: 0 });

  const other = await page.evaluate(async () => {
    const {
      codeOf,
      tetralodDemo: { viewer, events },
    } = /** @type {any} */ (window);
    const [x] = viewer.info.fields.map(({ name }) => name);
    await viewer.set({
      isosurfaces: [],
      boundary: null,
      colours: { range: [0.1, 0.2] },
      streamlines: { fields: [x, x, x], seeds: [[0.5, 0.5, 0.5]], field: x },
    });
    await viewer.refine({ error: "5%" });
    const { dropped, info } = await viewer.open("/fields.mt");
    const { state } = viewer;
    const again = await codeOf(viewer.set(state));
    const mesh = await codeOf(viewer.refine({ error: "5%" }));
    const own = await viewer.open("/fields.mt", { state: { isosurfaces: null, slices: [{ normal: [0, 0, 1], offset: 1e9 }], boundary: {} } });
    const failed = await codeOf(viewer.open("/nothing.mt"));
    return {
      names: info.fields.map(({ name }) => name),
      parts: dropped.map(({ part }) => part),
      problem: dropped[0]?.problem,
      isosurfaces: state.isosurfaces,
      streamlines: state.streamlines,
      again,
      mesh,
      own: own.dropped.map(({ part }) => part),
      boundary: viewer.state.boundary,
      slices: viewer.state.slices,
      failed,
      still: await codeOf(viewer.refine({ error: "5%" })),
      errors: events.filter(({ name }) => name === "error").length,
    };
  });
  assert.ok(other.parts.includes("streamlines"), JSON.stringify(other));
  assert.match(other.problem, /there is no field ".*"; this volume has: /);
  assert.deepEqual([other.isosurfaces, other.streamlines, other.again, other.mesh], [[{}], undefined, "none", "none"]);
  assert.deepEqual([other.own, other.boundary, other.slices], [["slices[0]"], {}, []]);
  assert.notEqual(other.failed, "none");
  assert.deepEqual([other.still, other.errors], ["none", 0]);
  await page.close();
});

test("after `open` alone the mesh becomes the one that the picture needs", async () => {
  const page = await opened();
  const seen = await page.evaluate(async () => {
    const { viewer, events } = window.tetralodDemo;
    const after = async (options) => {
      events.length = 0;
      const { finished } = await viewer.open("/model.mt", options);
      await finished;
      await viewer.settled();
      return (await viewer.mesh()).tets.length / 4;
    };
    const [parts, whole] = [await after({}), await after({ whole: true })];
    const { tetrahedra } = await viewer.refine({ view: { pixels: 1, outside: "10%" }, maxTets: 500_000 });
    return { parts, whole, tetrahedra };
  });
  assert.ok(seen.tetrahedra > 1000, JSON.stringify(seen));
  assert.deepEqual([seen.parts, seen.whole], [seen.tetrahedra, seen.tetrahedra]);
  await page.close();
});

test("a request that comes with `open` is the first one, and a later one replaces it", async () => {
  const page = await opened();
  await page.evaluate(CODES);
  const seen = await page.evaluate(async () => {
    const {
      codeOf,
      tetralodDemo: { viewer },
    } = /** @type {any} */ (window);
    const settled = async () => {
      await viewer.settled();
      return (await viewer.mesh()).tets.length / 4;
    };
    const counts = [];
    for (const file of ["/model.mt", "/parts.mt"]) {
      const { finished } = await viewer.open(file, { request: { error: "10%" } });
      await finished;
      const first = await settled();
      await viewer.refine({ error: "10%" });
      const asked = await settled();
      await viewer.open(file, { request: { error: "10%" } });
      await viewer.refine({ error: 0 });
      counts.push({ first, asked, later: await settled() });
    }
    return { counts, wrong: await codeOf(viewer.open("/model.mt", { request: { where: () => true } })) };
  });
  const full = await page.evaluate(() => window.tetralodDemo.full.tetrahedra);
  for (const { first, asked, later } of seen.counts) {
    assert.ok(first < full / 2, JSON.stringify(seen));
    assert.deepEqual([first, later], [asked, full]);
  }
  assert.equal(seen.wrong, "bad-option");
  await page.close();
});

test("at rest the picture shows what was set", async () => {
  const page = await opened();
  const drawn = await page.evaluate(async () => {
    const { viewer } = window.tetralodDemo;
    await viewer.settled();
    let frames = 0;
    viewer.addEventListener("frame", () => frames++);
    const counts = [];
    for (const outline of [false, true, false, true]) {
      frames = 0;
      viewer.set({ outline });
      await viewer.settled();
      counts.push(frames);
    }
    return counts;
  });
  assert.ok(
    drawn.every((frames) => frames > 0),
    `pictures after each change: ${drawn}`,
  );
  await page.close();
});

test("the legend comes again with a volume that is opened again", async () => {
  const page = await opened();
  const legends = await page.evaluate(async () => {
    const { viewer } = window.tetralodDemo;
    // Before the base mesh is there, there may be a picture without one.
    const next = () => new Promise((resolve) => viewer.addEventListener("legend", ({ detail }) => detail && resolve(detail.label)));
    const first = next();
    await viewer.set({ boundary: {} });
    const [label] = [await first];
    const second = next();
    await viewer.open("/model.mt");
    return [label, await second];
  });
  assert.ok(legends[0]);
  assert.equal(legends[1], legends[0]);
  await page.close();
});

test("the field of another mesh is taken from this one where both are", async () => {
  const page = await opened();
  const found = await page.evaluate(async () => {
    const { viewer } = window.tetralodDemo;
    const mesh = await viewer.mesh({ fields: true });
    const [low, , , high] = viewer.info.bounds;
    const less = mesh.fields.map((field) => ({ ...field, values: field.values.map((value) => value - 2 / field.scale) }));
    const aside = mesh.positions.map((x, i) => x + (i % 3 === 0 ? (high - low) / 2 : 0));
    await viewer.set({ boundary: {}, compare: { at: 0, difference: true } });
    const shown = async (other, how) => {
      await viewer.keep(other, how);
      // The picture that shows it.
      await viewer.settled();
      await viewer.screenshot({ width: 8, height: 8, samples: 1 });
      const { label, range, apart } = viewer.legend;
      return { label, range, apart };
    };
    const refused = async (other, how) =>
      viewer.keep(other, how).then(
        () => "",
        ({ code }) => code,
      );
    return {
      name: viewer.info.fields[0].name,
      points: mesh.positions.length / 3,
      same: await shown({ ...mesh, fields: less }),
      half: await shown({ ...mesh, fields: less, positions: aside }, { reach: 0 }),
      other: await shown({ ...mesh, fields: less.map((field) => ({ ...field, name: "another" })) }),
      refused: [
        await refused({ ...mesh, tets: Uint32Array.of(0, 1, 2, mesh.positions.length) }),
        await refused(mesh, { reach: -1 }),
        await refused(mesh, { far: 1 }),
      ],
    };
  });
  const { name, points, same, half, other, refused } = found;
  assert.deepEqual([same.label, same.apart], [`difference of ${name}`, 0]);
  assert.ok(Math.abs(same.range[1] - 2) < 1e-5 && same.range[0] === -same.range[1], `${same.range}`);
  assert.ok(half.apart > 0 && half.apart < points, `${half.apart} of ${points}`);
  assert.deepEqual([other.label, other.apart], [name, 0], "it has no such field");
  assert.deepEqual(refused, ["bad-option", "bad-option", "bad-option"]);
  await page.close();
});

test("a request that is given up leaves the one before it", async () => {
  const page = await opened();
  await page.evaluate(CODES);
  const seen = await page.evaluate(async () => {
    const {
      codeOf,
      tetralodDemo: { viewer },
    } = /** @type {any} */ (window);
    const { tetrahedra } = await viewer.refine({ error: "20%" });
    await viewer.freeze();
    const control = new AbortController();
    const given = codeOf(viewer.refine({ error: 0 }, { signal: control.signal }));
    const other = codeOf(viewer.refine({ error: 0 }, { signal: AbortSignal.timeout(60_000) }));
    await viewer.reading([0, 0, 0]);
    control.abort();
    const first = await given;
    await viewer.freeze(false);
    const second = await other;
    const whole = (await viewer.mesh()).tets.length / 4;
    await viewer.refine({ error: "20%" });
    await viewer.freeze();
    const alone = new AbortController();
    const gone = codeOf(viewer.refine({ error: 0 }, { signal: alone.signal }));
    await viewer.reading([0, 0, 0]);
    alone.abort();
    const third = await gone;
    await viewer.freeze(false);
    await viewer.settled();
    return {
      first,
      second,
      third,
      whole,
      tetrahedra,
      now: (await viewer.mesh()).tets.length / 4,
      early: await codeOf(viewer.surface({ signal: AbortSignal.abort() })),
    };
  });
  const { first, second, third, whole, tetrahedra, now, early } = seen;
  assert.deepEqual(
    [first, second, third, early].map((code) => (code === 20 ? "AbortError" : code)),
    ["AbortError", "none", "AbortError", "AbortError"],
  );
  assert.ok(whole > 2 * tetrahedra, "who waits for the same mesh gets it");
  assert.equal(now, tetrahedra);
  await page.close();
});

test("a canvas is used again by another viewer, as StrictMode does, and stays under the pointer", async () => {
  const page = await browser.newPage();
  await page.goto(server.address);
  const codes = await page.evaluate(async () => {
    const { Viewer } = await import("tetralod/viewer");
    const canvas = document.querySelector("canvas");
    const aborted = new AbortController();
    // An effect, its end, and the effect again, before anything has happened.
    const first = Viewer.create(canvas, { signal: aborted.signal });
    aborted.abort();
    const code = (promise) =>
      promise.then(
        () => "none",
        (error) => (error instanceof DOMException ? error.name : error.code),
      );
    const seen = [await code(first)];
    const mine = await Viewer.create(canvas);
    seen.push(await code(Viewer.create(canvas)));
    await mine.open("/model.mt");
    mine.free();
    for (let i = 0; i < 2; i++) {
      const next = await Viewer.create(canvas);
      await next.open("/model.mt", { state: { boundary: {}, isosurfaces: null } });
      await next.refine({ error: 0 });
      if (i === 0) next.free();
      else window.tetralodDemo = { viewer: next };
    }
    const { left, top, width, height } = canvas.getBoundingClientRect();
    const isUnder = document.elementFromPoint(left + width / 2, top + height / 2) === canvas;
    return [...seen, isUnder, document.querySelectorAll("canvas").length];
  });
  assert.deepEqual(codes, ["AbortError", "bad-option", true, 2]);
  let seen;
  for (let i = 0; i < 60; i++) {
    seen = await study(page, await page.locator("canvas").first().screenshot());
    if (seen.covered > 0.03) break;
    await page.waitForTimeout(250);
  }
  assertDrawn(seen, "the canvas again");
  await page.evaluate(() => window.tetralodDemo.viewer.free());
  assert.equal(await page.locator("canvas").count(), 1);
  await page.close();
});

test("a frozen mesh stays, and catches up afterwards", async () => {
  const page = await opened();
  const counts = await page.evaluate(async () => {
    const { viewer } = window.tetralodDemo;
    const before = await viewer.hash();
    await viewer.freeze();
    const waiting = viewer.refine({ error: "20%" });
    await viewer.orbit(0.3, 0.1);
    await new Promise((resolve) => setTimeout(resolve, 400));
    const frozen = await viewer.hash();
    await viewer.freeze(false);
    const { tetrahedra } = await waiting;
    return { same: before === frozen, tetrahedra, full: window.tetralodDemo.full.tetrahedra };
  });
  assert.ok(counts.same, "it stays");
  assert.ok(counts.tetrahedra < counts.full / 2, JSON.stringify(counts));
  await page.close();
});

test("where pictures take too long the mesh is coarser while something moves, and whole at rest", async () => {
  // No adapter draws a picture in a millisecond, with all that is around it.
  const page = await opened({ frameTime: 1 });
  const seen = await page.evaluate(async () => {
    const { viewer, events } = window.tetralodDemo;
    const before = await viewer.hash();
    const least = () => Math.min(...events.filter(({ name }) => name === "stats").map(({ detail }) => detail.tetrahedra));
    events.length = 0;
    for (let i = 0; i < 300 && !(least() < window.tetralodDemo.full.tetrahedra / 2); i++) {
      await viewer.orbit(0.05, 0);
      await new Promise(requestAnimationFrame);
    }
    // On a busy machine there may be time for the whole mesh between two movements.
    const { full } = window.tetralodDemo;
    const done = events.filter(({ name, detail }) => name === "stats" && detail.done);
    const early = done.filter(({ detail }) => detail.tetrahedra !== full.tetrahedra).length;
    const moving = least();
    await new Promise((resolve) => viewer.addEventListener("stats", ({ detail }) => detail.done && resolve(detail)));
    return { early, moving, full: full.tetrahedra, same: before === (await viewer.hash()) };
  });
  assert.ok(seen.moving < seen.full / 2, JSON.stringify(seen));
  assert.equal(seen.early, 0, "a mesh for movement is not the one that was asked for");
  assert.ok(seen.same, "at rest it is what was asked for");
  await page.close();
});

test("a viewer says whether it draws in software, and pictures have fewer pixels only while something moves", async () => {
  const page = await opened({ frameTime: 1 });
  const seen = await page.evaluate(async () => {
    const { viewer, events } = window.tetralodDemo;
    const scales = () => events.filter(({ name }) => name === "frame").map(({ detail }) => detail.scale);
    await viewer.settled();
    events.length = 0;
    for (let i = 0; i < 300 && !scales().some((scale) => scale < 1); i++) {
      await viewer.orbit(0.05, 0);
      await new Promise(requestAnimationFrame);
    }
    const least = Math.min(...scales());
    await viewer.settled();
    const { info } = await navigator.gpu.requestAdapter();
    return { least, last: scales().at(-1), said: viewer.isSoftware, is: info.isFallbackAdapter };
  });
  assert.ok(seen.least < 1, JSON.stringify(seen));
  assert.equal(seen.last, 1);
  assert.equal(seen.said, seen.is);
  await page.close();
});

test("a GPU that is lost is opened again, and draws what it drew", async () => {
  const page = await opened();
  const show = (isosurfaces) => page.evaluate((scene) => window.tetralodDemo.viewer.set(scene), { isosurfaces, outline: false });
  /** What the viewer draws with a fixed number of samples, byte for byte. */
  const drawn = () =>
    page.evaluate(async () => {
      const bytes = new Uint8Array(await (await window.tetralodDemo.viewer.screenshot({ samples: 4 })).arrayBuffer());
      return String(bytes);
    });
  /** What is on the screen. How often a picture was drawn again for smooth edges depends on the speed of the machine. */
  const picture = async () => study(page, await page.locator("canvas").first().screenshot());
  const pictureWhere = async (holds) => {
    for (const until = Date.now() + 30_000; ; ) {
      const seen = await picture();
      if (holds(seen)) return seen;
      assert.ok(Date.now() < until, `${holds} does not hold within 30 s`);
    }
  };
  await show([]);
  await drawn();
  const empty = await picture();
  await show([{ value: 0.4 }]);
  const before = await drawn();
  // A canvas comes to the screen later than its frames are drawn.
  const onScreen = await pictureWhere((seen) => distance(seen, empty) > 4);
  assertDrawn(onScreen, "before");
  const session = await browser.newBrowserCDPSession();
  await session.send("Browser.crashGpuProcess").catch(() => {});
  await page.waitForFunction(() => window.tetralodDemo.events.some(({ name }) => name === "restored"), undefined, { timeout: 60_000 });
  assert.ok((await drawn()) === before, "the same is drawn");
  await pictureWhere((seen) => distance(seen, onScreen) < 1);
  const errors = await page.evaluate(() => window.tetralodDemo.events.filter(({ name }) => name === "error").length);
  assert.equal(errors, 0);
  await page.close();
});
