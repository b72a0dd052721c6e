// Building in a page's worker, in a real browser, on a File: the same bytes as the native program; cancel; and the built volume opens.
import assert from "node:assert/strict";
import { createHash } from "node:crypto";
import { readFile } from "node:fs/promises";
import { after, before, test } from "node:test";
import { launch, servePackage } from "./browser.js";

const folder = process.env.TETRALOD_FIXTURE;
assert.ok(folder, "TETRALOD_FIXTURE is not set: run `cargo xtask test e2e`");
const sha256 = (bytes) => createHash("sha256").update(bytes).digest("hex");

let browser;
let server;
let page;
const complaints = [];

before(async () => {
  server = await servePackage(async (request, response) => {
    if (request.url === "/small.mt") return response.end(await readFile(`${folder}/small.mt`));
    response.setHeader("content-type", "text/html");
    const home = new URL("../../www/index.html", import.meta.url);
    if (request.url.startsWith("/page")) return response.end(await readFile(home));
    response.end("<!doctype html><title>build</title><input type=file>");
  });
  browser = await launch();
  page = await browser.newPage();
  page.on("pageerror", (error) => complaints.push(String(error)));
  await page.goto(server.address);
});

after(async () => {
  await browser?.close();
  server?.close();
});

test("a chosen file is built in a worker of the page, and opens", async () => {
  await page.setInputFiles("input", `${folder}/small.vti`);
  const result = await page.evaluate(async () => {
    const { build, inspect } = await import("/pkg/build.js");
    const { MultiTessellation } = await import("/pkg/index.js");
    const [file] = document.querySelector("input").files;
    const before = performance.getEntriesByType("resource").length;
    const info = await inspect(file);
    const fractions = [];
    const { bytes, report } = await build(file, { onProgress: ({ fraction }) => fractions.push(fraction) });
    const digest = new Uint8Array(await crypto.subtle.digest("SHA-256", bytes));
    const sha256 = [...digest].map((byte) => byte.toString(16).padStart(2, "0")).join("");
    const mt = await MultiTessellation.open(bytes);
    const { stats } = await mt.refine({ error: "1%" });
    mt.free();
    const sent = performance
      .getEntriesByType("resource")
      .slice(before)
      .map(({ name }) => new URL(name).pathname);
    return { info, fractions, sha256, report, stats, sent };
  });
  assert.equal(result.sha256, sha256(await readFile(`${folder}/small.mt`)));
  assert.equal(result.info.format, "vti");
  assert.equal(result.info.tetrahedra, result.report.tetrahedra);
  assert.ok(result.fractions.length > 3 && result.fractions.every((f, i, all) => i === 0 || f >= all[i - 1]));
  assert.ok(result.stats.satisfied && result.stats.tetrahedra < result.report.tetrahedra);
  assert.ok(
    result.sent.every((path) => path.startsWith("/pkg/")),
    `nothing but the package is fetched: ${result.sent}`,
  );
  assert.deepEqual(complaints, []);
});

test("worker and wasm file are found where the options say, and what is wrong there is told", async () => {
  await page.setInputFiles("input", `${folder}/small.vti`);
  const found = await page.evaluate(async () => {
    const { build } = await import("/pkg/build.js");
    const [file] = document.querySelector("input").files;
    const outcome = (options) =>
      build(file, options).then(
        ({ bytes }) => bytes.length,
        ({ code, message }) => `${code}: ${message}`,
      );
    return {
      given: await outcome({ workerUrl: "/pkg/build-worker.js", wasmUrl: "/pkg/tetralod_build_bg.wasm" }),
      page: await outcome({ workerUrl: "/page.html" }),
      other: await outcome({ workerUrl: "/pkg/worker.js" }),
      wasm: await outcome({ wasmUrl: "/page" }),
      address: await outcome({ wasmUrl: "http://[" }),
    };
  });
  assert.equal(found.given, (await readFile(`${folder}/small.mt`)).length);
  assert.match(found.page, /^worker: .*text\/html.*tetralod\/build-worker/);
  assert.match(found.other, /^worker: .*core.*tetralod\/build-worker/);
  assert.match(found.wasm, /^wasm: .*tetralod\/build\.wasm/);
  assert.match(found.address, /^bad-option: .*wasmUrl/);
});

test("an MT file of the user is read by slices, as far as it is needed", async () => {
  await page.setInputFiles("input", `${folder}/blocks-half-edge.mt`);
  const result = await page.evaluate(async () => {
    const { MultiTessellation } = await import("/pkg/index.js");
    const [file] = document.querySelector("input").files;
    const code = (content, name) =>
      MultiTessellation.open(new File(content, name)).then(
        () => "opened",
        (e) => `${e.code}: ${e.message}`,
      );
    const read = [];
    for (const worker of [true, false]) {
      const mt = await MultiTessellation.open(file, { worker });
      const { stats } = await mt.refine({ error: "5%" });
      read.push({ satisfied: stats.satisfied, early: mt.progress.bytes });
      const all = await mt.refine({ error: 0 });
      read.at(-1).rest = all.stats.tetrahedra === mt.info.tetrahedra && mt.progress.bytes > read.at(-1).early;
      mt.free();
    }
    const whole = await MultiTessellation.open(file, { whole: true });
    await whole.complete;
    const complete = whole.progress.complete;
    whole.free();
    const bytes = await file.arrayBuffer();
    const broken = [
      await code(["no mesh at all"], "other.mt"),
      await code([bytes.slice(0, 1000)], "cut.mt"),
      await code([], "empty.mt"),
      await code(["<!doctype html>"], "page.mt"),
    ];
    return { read, complete, size: file.size, broken };
  });
  for (const { satisfied, early, rest } of result.read) {
    assert.ok(satisfied && rest);
    assert.ok(early < result.size / 2, `${early} of ${result.size} bytes`);
  }
  assert.ok(result.complete);
  const codes = result.broken.map((message) => message.split(": ").slice(0, 2).join(" "));
  assert.deepEqual(codes, ["not-mt other.mt", "truncated cut.mt", "truncated empty.mt", "not-mt page.mt"]);
});

test("samples and their JSON are one mesh when they are chosen together", async () => {
  await page.setInputFiles("input", []);
  await page.evaluate(() => document.querySelector("input").setAttribute("multiple", ""));
  await page.setInputFiles("input", [`${folder}/grid.json`, `${folder}/grid.raw`]);
  const tetrahedra = await page.evaluate(async () => {
    const { build } = await import("/pkg/build.js");
    return (await build([...document.querySelector("input").files])).report.tetrahedra;
  });
  assert.equal(tetrahedra, 6 * 5 * 4 * 3);
});

test("a signal ends the work in the middle", async () => {
  await page.setInputFiles("input", `${folder}/blocks-half-edge.vti`);
  const outcome = await page.evaluate(async () => {
    const { build } = await import("/pkg/build.js");
    const stop = new AbortController();
    let after = 0;
    const onProgress = ({ phase }) => {
      if (stop.signal.aborted) after++;
      if (phase === "remove") stop.abort();
    };
    const [file] = document.querySelector("input").files;
    const failed = await build(file, { signal: stop.signal, onProgress }).catch((error) => error);
    await new Promise((resolve) => setTimeout(resolve, 500));
    return { name: failed.name, after };
  });
  assert.deepEqual(outcome, { name: "AbortError", after: 0 });
});

test("broken files and too little memory give typed errors in the page, too", async () => {
  const codes = await page.evaluate(async () => {
    const { build } = await import("/pkg/build.js");
    const code = (source, options) =>
      build(source, options).then(
        () => "built",
        (error) => error.code,
      );
    const [file] = document.querySelector("input").files;
    return [
      await code(new File(["hello"], "x.vtu")),
      await code(file.slice(0, file.size >> 1)),
      await code(file, { memory: 1e7 }),
      await code(file, { kind: "cube" }),
    ];
  });
  assert.equal(codes[0], "unknown-format");
  assert.ok(["truncated", "corrupt"].includes(codes[1]), codes[1]);
  assert.deepEqual(codes.slice(2), ["memory", "bad-option"]);
  assert.deepEqual(complaints, []);
});

/** The demo page with a small volume. */
async function openDemo() {
  const demo = await browser.newPage({ viewport: { width: 1100, height: 760 } });
  demo.on("pageerror", (error) => complaints.push(String(error)));
  await demo.goto(`${server.address}page?url=small.mt`);
  const reach = (tetrahedra) =>
    demo.waitForFunction((wanted) => window.tetralodDemo?.state === "complete" && window.tetralodDemo.info?.tetrahedra === wanted, tetrahedra, {
      timeout: 120_000,
    });
  await reach(24_576);
  return { demo, reach, choose: (files) => demo.setInputFiles("#file", files), dialog: demo.locator("dialog.build") };
}

test("the demo page builds a mesh that is chosen, shows it, and saves it", async () => {
  const { demo, reach, choose, dialog } = await openDemo();

  // A broken file says what is wrong, and the dialog can be closed.
  await choose({ name: "broken.vtu", mimeType: "", buffer: Buffer.from("hello") });
  await dialog.locator("[role=alert]").waitFor();
  assert.match(await dialog.locator("[role=alert]").textContent(), /broken\.vtu: not a format/);
  assert.ok(await dialog.getByRole("button", { name: "Build" }).isDisabled());
  await dialog.getByRole("button", { name: "Cancel" }).click();
  await dialog.waitFor({ state: "detached" });

  // Cancelled in the middle: the volume stays.
  await choose(`${folder}/blocks-half-edge.vti`);
  await dialog.getByRole("button", { name: "Build" }).click();
  await dialog.locator("progress").waitFor();
  await dialog.getByRole("button", { name: "Cancel" }).click();
  await dialog.waitFor({ state: "detached" });
  await reach(24_576);

  await choose(`${folder}/fields.vtu`);
  await dialog.getByText("vtu, 14,224 points, 79,092 tetrahedra").waitFor();
  assert.deepEqual(await dialog.getByRole("group", { name: "Fields" }).locator("label").allTextContents(), [" pressure", " speed"]);
  await dialog.getByLabel("speed").check();
  await dialog.getByRole("button", { name: "Build" }).click();
  await reach(79_092);
  assert.deepEqual(await demo.evaluate(() => window.tetralodDemo.info.fields.map(({ name }) => name)), ["pressure", "speed"]);
  const [download] = await Promise.all([demo.waitForEvent("download"), dialog.getByRole("link", { name: "Save .mt" }).click()]);
  assert.equal(download.suggestedFilename(), "fields.mt");
  const saved = await readFile(await download.path());
  assert.ok(saved.length > 100_000, "all of the file is saved");
  await dialog.getByRole("button", { name: "Close" }).click();
  await dialog.waitFor({ state: "detached" });
  assert.deepEqual(complaints, []);
  await demo.close();
});

test("the demo page repairs a chosen mesh as it is told, and says what it did or what would help", async () => {
  const { demo, reach, choose, dialog } = await openDemo();
  const level = dialog.getByLabel("Level");
  const distance = dialog.getByLabel("Weld distance");
  const said = () => dialog.locator("[role=status] li").allTextContents();
  const build = (name) => dialog.getByRole("button", { name, exact: true }).click();
  const hasFocus = (control) => control.evaluate((element) => element === document.activeElement);

  // Two cubes with points of their own: apart, unless they are welded.
  await choose(`${folder}/blocks.vtk`);
  assert.equal(await level.inputValue(), "safe");
  assert.ok(await distance.isHidden(), "a distance without welding means nothing");
  await build("Build");
  await reach(12);
  assert.deepEqual(await said(), ["Kept: 2 parts that share no face"]);

  await level.selectOption("weld");
  await distance.fill("-1");
  await build("Build again");
  assert.ok((await hasFocus(distance)) && (await dialog.locator("progress").isHidden()), "nothing is built with such a distance");
  await distance.fill("1");
  await build("Build again");
  await dialog.locator("[role=alert]").waitFor();
  assert.match(await dialog.locator("[role=alert]").textContent(), /blocks\.vtk.*cell \d+.*give a smaller distance/);
  assert.ok(await hasFocus(distance));
  assert.ok(await dialog.getByRole("link", { name: "Save .mt" }).isHidden(), "what is saved is what was built last");
  await distance.fill("0.25");
  await build("Build again");
  await dialog.getByRole("link", { name: "Save .mt" }).waitFor();
  assert.deepEqual(await said(), ["Repaired: welded 4 points of open seams, of which 4 had other field values"]);
  await dialog.getByRole("button", { name: "Close" }).click();

  const inverted = (await readFile(`${folder}/blocks.vtk`, "utf8")).replace("4 0 1 3 7", "4 1 0 3 7");
  await choose({ name: "inverted.vtk", mimeType: "", buffer: Buffer.from(inverted) });
  await level.selectOption("none");
  await build("Build");
  await dialog.locator("[role=alert]").waitFor();
  assert.match(await dialog.locator("[role=alert]").textContent(), /level "safe" repairs it: turned 1 inverted tetrahedron/);
  assert.ok(await hasFocus(level));
  await level.selectOption("safe");
  await build("Build");
  await dialog.getByRole("link", { name: "Save .mt" }).waitFor();
  assert.deepEqual(await said(), ["Repaired: turned 1 inverted tetrahedron", "Kept: 2 parts that share no face"]);
  assert.deepEqual(complaints, []);
  await demo.close();
});
