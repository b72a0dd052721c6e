// `<tetralod-viewer>` in a real browser: its pictures, attributes, poster and events; and that nothing is left when it is removed.
import assert from "node:assert/strict";
import { mkdir, readFile } from "node:fs/promises";
import { after, before, test } from "node:test";
import { fileURLToPath } from "node:url";
import { launch, servePackage, withoutGpu } from "./browser.js";
import { assertDrawn, assertLike, differing, study } from "./study.js";

const folder = process.env.TETRALOD_FIXTURE;
assert.ok(folder, "TETRALOD_FIXTURE is not set: run `cargo xtask test e2e`");
const file = await readFile(`${folder}/blocks-half-edge.mt`);
const fields = await readFile(`${folder}/fields.mt`);
const pictures = new URL("../../target/e2e/", import.meta.url);
const README = await readFile(new URL("../../pkg-template/README.md", import.meta.url), "utf8");
const policy = /^Content-Security-Policy: (.*)$/m.exec(README)?.[1] ?? assert.fail("the README has no policy");

const ELEMENT = /```html\n(<tetralod-viewer[^`]*)```/.exec(README)?.[1] ?? assert.fail("the README has no element");
const POSTER = `<svg slot="poster" viewBox="0 0 9 9" width="300" height="225"><rect width="9" height="9" fill="#0a0"/></svg>`;
const page = (body) => `<!doctype html><title>element</title><link rel="stylesheet" href="/element.css">
  <script type="module" src="/pkg/element.js"></script>${body}`;

let browser;
let server;
/** What each path answers. */
const bodies = {};

before(async () => {
  await mkdir(pictures, { recursive: true });
  // The policy of the README: all of the element works under it.
  server = await servePackage(
    ({ url }, response) => {
      if (url === "/model.mt" || url === "/bucky.mt") return response.end(file);
      if (url === "/fields.mt") return response.end(fields);
      if (url === "/element.css") return response.setHeader("content-type", "text/css").end();
      if (bodies[url]) return response.setHeader("content-type", "text/html").end(page(bodies[url]));
      return response.writeHead(404).end();
    },
    { "content-security-policy": policy },
  );
  browser = await launch();
});

after(async () => {
  await browser?.close();
  server?.close();
});

/** A page with `body`; what the browser complains of is in `complaints`. */
async function opened(body, { prepare = undefined, complains = /^$/ } = {}) {
  bodies["/page.html"] = body;
  const page = await browser.newPage({ viewport: { width: 400, height: 300 } });
  const complaints = [];
  const complain = (text) => complains.test(text) || complaints.push(text);
  page.on("pageerror", (error) => complain(String(error)));
  page.on("console", (message) => message.type() === "error" && complain(message.text()));
  if (prepare) await page.addInitScript(prepare);
  await page.goto(`${server.address}page.html`);
  await page.waitForFunction(() => customElements.get("tetralod-viewer"));
  return { page, complaints };
}

const reach = (page, status) =>
  page
    .waitForFunction((status) => document.querySelector("tetralod-viewer").status === status, status, { timeout: 60_000 })
    .catch(async () =>
      assert.fail(
        `not ${status}: ${await page.evaluate(() => {
          const { status, failure } = document.querySelector("tetralod-viewer");
          return `${status} ${failure?.message}`;
        })}`,
      ),
    );

/** The picture at rest: none is drawn any more. */
async function picture(page, name) {
  await page.evaluate(
    () =>
      new Promise((resolve) => {
        const element = document.querySelector("tetralod-viewer");
        let timer = setTimeout(resolve, 700);
        element.addEventListener("frame", () => {
          clearTimeout(timer);
          timer = setTimeout(resolve, 700);
        });
      }),
  );
  const path = fileURLToPath(new URL(`element-${name}.png`, pictures));
  return study(page, await page.locator("tetralod-viewer").screenshot({ path }));
}

test("the element of the README draws what its attributes say, under a strict policy", async () => {
  // There is no picture for the poster, and the policy allows none.
  const { page, complaints } = await opened(ELEMENT, { complains: /bucky\.png/ });
  await reach(page, "ready");
  let last = await picture(page, "isosurface");
  assertDrawn(last, "isosurface");
  const change = async (name, attributes, least) => {
    await page.evaluate((attributes) => Object.assign(document.querySelector("tetralod-viewer"), attributes), attributes);
    const next = await picture(page, name);
    assertDrawn(next, name);
    assertLike(next, `element-${name}`);
    assert.ok(differing(last, next) > least, `${name}: only ${differing(last, next)} of the pixels differ`);
    last = next;
  };
  await change("isovalues", { isovalue: [0.3, 0.7] }, 0.03);
  for (const mode of ["volume", "slice", "boundary", "cells"]) await change(mode, { mode }, 0.02);
  await change("map", { map: "magma" }, 0.02);
  await change("state", { state: { background: "light", cells: { shape: "wire" } } }, 0.05);
  const { map, mode, status, text } = await page.evaluate(() => {
    const element = document.querySelector("tetralod-viewer");
    const text = /** @type {HTMLElement} */ (element.shadowRoot.querySelector(".message")).hidden;
    return { map: element.getAttribute("map"), mode: element.getAttribute("mode"), status: element.status, text };
  });
  assert.deepEqual({ map, mode, status, text }, { map: "magma", mode: "cells", status: "ready", text: true });
  assert.deepEqual(complaints, []);
  await page.close();
});

test("before there is a volume, the background is the one that is asked for", async () => {
  const { page } = await opened(`<tetralod-viewer background="light"></tetralod-viewer>`);
  await page.waitForFunction(() => document.querySelector("tetralod-viewer").viewer !== undefined, undefined, { timeout: 60_000 });
  const isLight = async (name) => Number.parseInt((await picture(page, name)).grid.slice(0, 2), 16) > 128;
  assert.ok(await isLight("empty-light"));
  await page.evaluate(() => document.querySelector("tetralod-viewer").setAttribute("background", "dark"));
  assert.ok(!(await isLight("empty-dark")));
  await page.close();
});

test("pointer, wheel and keys move it; scrolling past it does not", async () => {
  const { page, complaints } = await opened(`<tetralod-viewer src="model.mt" label="Bucky ball"></tetralod-viewer>`);
  await reach(page, "ready");
  const camera = () => page.evaluate(() => document.querySelector("tetralod-viewer").state.camera);
  let last = await camera();
  const moves = async (what, act, ...names) => {
    await act();
    const changed = () => (names.length === 0 ? true : names.some((name) => JSON.stringify(now[name]) !== JSON.stringify(last[name])));
    let now = last;
    for (let i = 0; i < 100 && !changed(); i++) {
      await page.waitForTimeout(30);
      now = await camera();
    }
    assert.ok(changed(), `${what}: ${JSON.stringify(now)}`);
    last = now;
  };
  await page.mouse.move(150, 100);
  const wheel = () => page.mouse.wheel(0, 100);
  await wheel();
  await page.waitForTimeout(200);
  assert.deepEqual(await camera(), last, "without focus the wheel is the page's");
  await moves(
    "drag",
    async () => {
      await page.mouse.down();
      await page.mouse.move(220, 130, { steps: 4 });
      await page.mouse.up();
    },
    "yaw",
    "pitch",
  );
  await moves("wheel with focus", wheel, "distance");
  await moves("arrow", () => page.keyboard.press("ArrowLeft"), "yaw");
  await moves("arrow with Shift", () => page.keyboard.press("Shift+ArrowLeft"), "target");
  await moves("plus", () => page.keyboard.press("+"), "distance");
  await moves("Home", () => page.keyboard.press("Home"), "distance", "target");
  const canvas = page.locator("tetralod-viewer canvas");
  assert.match(await canvas.getAttribute("aria-label"), /^Bucky ball\. Arrow keys/);
  assert.deepEqual(complaints, []);
  await page.close();
});

test("the poster is shown until the first picture, and stays without WebGPU and WebGL, with the reason", async () => {
  const isShown = (page) => page.locator("svg").isVisible();
  const { page } = await opened(`<tetralod-viewer>${POSTER}</tetralod-viewer>`);
  assert.equal(await isShown(page), true);
  assertDrawn({ ...(await picture(page, "poster")), colours: 99 }, "poster");
  await page.evaluate(() => {
    const element = document.querySelector("tetralod-viewer");
    window.tetralodDemo = { events: [] };
    for (const name of ["load", "error"]) element.addEventListener(name, () => window.tetralodDemo.events.push(name));
    element.setAttribute("src", "model.mt");
  });
  await reach(page, "ready");
  assert.equal(await isShown(page), false);
  assert.deepEqual(await page.evaluate(() => window.tetralodDemo.events), ["load"]);
  await page.close();

  const without = await opened(`<tetralod-viewer src="model.mt">${POSTER}</tetralod-viewer>`, { prepare: withoutGpu });
  await reach(without.page, "failed");
  assert.equal(await isShown(without.page), true);
  assert.match(await without.page.locator("[part=message]").textContent(), /no WebGPU/);
  await picture(without.page, "without-webgpu");
  assert.equal(await without.page.evaluate(() => /** @type {any} */ (document.querySelector("tetralod-viewer").failure).code), "no-webgpu");
  assert.deepEqual(without.complaints, []);
  await without.page.close();
});

test("a reader is asked for ranges, and `request` goes before the attributes", async () => {
  const { page, complaints } = await opened(`<tetralod-viewer error="5%"></tetralod-viewer>`);
  const asked = await page.evaluate(async () => {
    const element = document.querySelector("tetralod-viewer");
    const bytes = new Uint8Array(await (await fetch("model.mt")).arrayBuffer());
    const asked = [];
    const read = (start, end) => {
      asked.push(end);
      return bytes.subarray(start, end);
    };
    Object.assign(element, { request: { error: 0, maxTets: 900 }, source: { name: "own.mt", size: bytes.length, read } });
    await new Promise((resolve) => element.addEventListener("load", resolve));
    return asked;
  });
  assert.ok(asked.length > 0 && asked.every((end) => end <= file.length));
  await reach(page, "ready");
  const rested = async () => {
    await page.evaluate(() => document.querySelector("tetralod-viewer").viewer.settled());
    return count();
  };
  const count = () => page.evaluate(async () => (await document.querySelector("tetralod-viewer").viewer.mesh()).tets.length / 4);
  const few = await rested();
  assert.ok(few > 100 && few <= 900, `${few} tetrahedra`);
  await page.evaluate(() => (document.querySelector("tetralod-viewer").request = null));
  await page.waitForFunction(
    (few) =>
      document
        .querySelector("tetralod-viewer")
        .viewer.mesh()
        .then(({ tets }) => tets.length > 4 * few),
    few,
  );
  assert.deepEqual(complaints, []);
  await page.close();
});

test("errors are events, name what is wrong, and go when it is right again", async () => {
  const complains = /404/;
  const { page, complaints } = await opened(`<tetralod-viewer src="none.mt"></tetralod-viewer>`, { complains });
  const message = page.locator("[part=message]");
  await reach(page, "failed");
  assert.match(await message.textContent(), /none\.mt.*404/);
  const set = (name, value) => page.evaluate(([name, value]) => document.querySelector("tetralod-viewer").setAttribute(name, value), [name, value]);
  await set("src", "fields.mt");
  await reach(page, "ready");
  for (const [name, bad, good] of [
    ["mode", "cloud", "volume"],
    ["isovalue", "high", "0.5"],
    ["error", "much", "1%"],
    ["map", "mud", "turbo"],
  ]) {
    await set(name, bad);
    await reach(page, "failed");
    assert.match(await message.textContent(), new RegExp(`${name}|${bad}`));
    await set(name, good);
    await reach(page, "ready");
    assert.equal(await message.isVisible(), false);
  }
  const names = await page.evaluate(() => document.querySelector("tetralod-viewer").info.fields.map(({ name }) => name));
  assert.ok(names.length > 1);
  const first = await picture(page, "field");
  await set("field", names.at(-1));
  assert.ok(differing(first, await picture(page, "other-field")) > 0.02, "another field");
  assert.deepEqual(complaints, []);
  await page.close();
});

/** Browsers take a moment to end a worker. */
async function alone(page, what) {
  for (let i = 0; i < 100 && page.workers().length > 0; i++) await page.waitForTimeout(50);
  assert.equal(page.workers().length, 0, what);
}

test("a removed element ends its worker, one that moves keeps it, and a second module registers nothing", async () => {
  const { page, complaints } = await opened(`<p></p><tetralod-viewer src="model.mt"></tetralod-viewer>`);
  await reach(page, "ready");
  assert.equal(page.workers().length, 1);
  const [worker] = page.workers();
  await page.evaluate(() => document.querySelector("p").append(document.querySelector("tetralod-viewer")));
  await page.waitForTimeout(100);
  assert.deepEqual(page.workers(), [worker], "moved");
  assert.equal(await page.evaluate(() => document.querySelector("tetralod-viewer").status), "ready");

  await page.evaluate(() => {
    const element = document.querySelector("tetralod-viewer");
    window.tetralodDemo = { element };
    element.remove();
  });
  await alone(page, "removed");
  assert.deepEqual(await page.evaluate(() => [window.tetralodDemo.element.status, window.tetralodDemo.element.viewer]), ["empty", undefined]);
  await page.evaluate(() => document.body.append(window.tetralodDemo.element));
  await reach(page, "ready");
  assertDrawn(await picture(page, "again"), "back on the page");

  const second = await page.evaluate(async () => {
    const first = customElements.get("tetralod-viewer");
    const another = "/pkg/element.js?another";
    const { TetralodViewerElement } = await import(another);
    return [first === customElements.get("tetralod-viewer"), first === TetralodViewerElement];
  });
  assert.deepEqual(second, [true, false]);
  // Removed while it starts.
  await page.evaluate(() => window.tetralodDemo.element.remove());
  await page.evaluate(async () => {
    document.body.append(window.tetralodDemo.element);
    await Promise.resolve();
    window.tetralodDemo.element.remove();
  });
  await alone(page, "removed while it starts");
  await page.evaluate(() => {
    document.body.append(window.tetralodDemo.element);
    window.tetralodDemo.element[Symbol.dispose ?? Symbol.for("Symbol.dispose")]();
  });
  await alone(page, "disposed of");
  assert.deepEqual(complaints, []);
  await page.close();
});
