// Promise: the controls of the demo page, its address, undo and redo never disagree, and links of before mean what they meant. The viewer
// is one without a GPU (`fake-viewer.js`).
import assert from "node:assert/strict";
import { readFile } from "node:fs/promises";
import { after, before, test } from "node:test";
import { launch, PATIENCE, servePackage } from "./browser.js";

const LIST = { volumes: [{ url: "flow.mt", title: "Flow", sentence: "", scene: "", isShown: true, vertices: 1000, tetrahedra: 5000, fields: 2, bytes: 1e6 }] };

let browser, server;

before(async () => {
  browser = await launch();
  server = await servePackage((_request, response) => response.writeHead(404).end());
});

after(async () => {
  await browser?.close();
  server?.close();
});

/** A page with the fake viewer; its errors are collected in `complaints`. */
async function open(hash = "") {
  const page = await browser.newPage({ viewport: { width: 1000, height: 800 } });
  page.complaints = [];
  page.on("pageerror", (error) => page.complaints.push(String(error.stack)));
  const body = await readFile(new URL("fake-viewer.js", import.meta.url), "utf8");
  await page.route("**/pkg/viewer.js", (route) => route.fulfill({ contentType: "text/javascript", body }));
  await page.route("**/data/volumes.json", (route) => route.fulfill({ json: LIST }));
  await page.goto(`${server.address}index.html${hash}`);
  await complete(page);
  return page;
}

async function complete(page) {
  await page.waitForFunction(() => window.tetralodDemo?.state === "complete", undefined, { timeout: PATIENCE });
  await rest(page);
}

/** Waits until the state has been written: by a timer of the page, which is due after that of the state, however slow the machine is. */
const rest = (page) => page.evaluate(() => new Promise((resolve) => setTimeout(resolve, 400)));

/** What the page shows: its address, all controls, what is drawn and what is asked of the mesh. */
const seen = (page) =>
  page.evaluate(() => {
    const value = (control) => (["checkbox", "radio"].includes(control.type) ? control.checked : control.value);
    const all = /** @type {HTMLInputElement[]} */ ([...document.querySelectorAll("#settings input, #settings select")]);
    const controls = all.filter(({ id }) => !["split", "difference", "freeze", "region-filter"].includes(id));
    const { request, viewer } = window.tetralodDemo;
    const words = [...document.querySelectorAll("#settings output:not(#transfer-chosen)")].map(({ textContent }) => textContent);
    return {
      hash: location.hash,
      controls: controls.map((one) => [`${one.id || one.name} ${one.type === "radio" ? one.value : ""}`, value(one)]),
      words,
      request,
      scene: viewer.state,
    };
  });

/**
 * Changes each control once as a user does, in the order of the page, which has the views first; and then those that the last view does
 * not have. Gives what is seen after each that was a change of the state.
 */
async function changeAll(page) {
  const states = [await seen(page)];
  const count = await page.locator("#settings input, #settings select").count();
  const ofView = ["#opacity", "#edges"];
  const controls = [
    ...Array.from({ length: count }, (_, i) => [`#settings :is(input, select):not(${ofView})`, i]),
    ["[name=mode][value=slice]", 0],
    ...ofView.map((id) => [id, 0]),
  ];
  for (const which of controls) {
    const isChanged = await page.evaluate(([selector, i]) => {
      const control = /** @type {any} */ (document.querySelectorAll(selector)[i]);
      if (!control || control.disabled || ["split", "difference", "freeze", "region-filter"].includes(control.id)) return false;
      const tell = (name) => control.dispatchEvent(new Event(name, { bubbles: true }));
      if (["checkbox", "radio"].includes(control.type)) control.click();
      else if (control instanceof HTMLSelectElement) {
        const others = [...control.options].filter(({ disabled, value }) => !disabled && value !== control.value);
        if (others.length === 0) return false;
        control.value = others[0].value;
      } else if (control.type === "range") control.value = String(Number(control.value) === Number(control.max) ? control.min : control.max);
      else control.value = String(0.9 * Number(control.value));
      tell("input");
      tell("change");
      return true;
    }, which);
    if (!isChanged) continue;
    await rest(page);
    const now = await seen(page);
    if (now.hash !== states[states.length - 1].hash) states.push(now);
  }
  return states;
}

test("each control is a step that undo and redo go back and forth in, and a link has all of it", async () => {
  const page = await open();
  const states = await changeAll(page);
  assert.ok(states.length > 40, `${states.length} controls are part of the state`);
  const last = states.length - 1;
  for (let i = last - 1; i >= 0; i--) {
    await page.click("#undo");
    assert.deepEqual(await seen(page), states[i], `undone to ${states[i].hash}, from ${states[i + 1].hash}`);
  }
  assert.ok(await page.isDisabled("#undo"));
  for (let i = 1; i <= last; i++) {
    await page.click("#redo");
    assert.deepEqual(await seen(page), states[i], `done again: ${states[i].hash}`);
  }
  assert.deepEqual(page.complaints, []);
  await page.close();
  for (const state of [states[last], states[last >> 1]]) {
    const other = await open(state.hash);
    assert.deepEqual(await seen(other), state, "the link shows the same");
    assert.deepEqual(other.complaints, []);
    await other.close();
  }
});

/** Links that the page wrote before its state was in a store. */
const LINKS = [
  "#view=flow&also=iso,wires&opacity=40,100,20,100&edges=iso&flow-colour=field&rake=3&arrows=1&seeds=1,2,3,0.5,0.5,0.5",
  "#view=slice&opacity=55&field=velocity_y&cut=250&other-cut=700&map=vik&reversed=1&axis=2&time=2&range=-0.5,0.25",
  "#view=mesh&cut=10&shape=points&shrink=20&colour-by=block",
  "#view=volume&isovalue=4&log=1&range=percentiles&transfer=step",
  "#isovalue=7.5&inside=1&pixels=70&budget=80&region=box&focus=1&frame-time=95&refine=view&error=20&outside=11&box=0.1,0.2,0.3,1,2,3",
  "#view=slice&time=1&probes=1,1,1&over-time=1",
  "#view=solid&deform=velocity&times=-2.5&undeformed=1",
  "#view=solid&outline=0&shade=10&flip=0&region=cut&background=dark&axes=0&fly=1&probes=1,1,1,0.5,2,7&camera=1,1,1,5,0.2,0.3,orthographic",
];

/** Links with planes that are oblique, or several. */
const PLANES = [
  "#view=solid&cut=428.571&normal=1,1,0.5&flip=0",
  "#view=slice&cut=100&other-cut=0&axis=0&planes=1,0,0,0,300,400,0,0,-1,1,1000,500&plane=3&handle=0",
];

test("links are understood, those of before, too, and written as they were", async () => {
  const page = await open();
  for (const link of [...PLANES, ...LINKS]) {
    await page.evaluate((link) => (location.hash = link), link);
    await rest(page);
    assert.equal((await seen(page)).hash, link);
    assert.ok(await page.isHidden("#note"), await page.textContent("#note"));
  }
  const { request, scene } = await seen(page);
  assert.deepEqual([request.error, request.slab], ["1%", { normal: [0, 1, 0], offset: 2 }]);
  assert.deepEqual(scene.boundary, { opacity: 1, edges: true });
  assert.deepEqual(scene.camera, { target: [1, 1, 1], distance: 5, yaw: 0.2, pitch: 0.3, projection: "orthographic" });
  assert.equal(await page.locator(".card").count(), 2);
  assert.deepEqual(page.complaints, []);
  await page.close();
});

test("up to six planes are added, chosen and removed, and each has a normal and places of its own", async () => {
  const page = await open("#view=solid");
  const scene = (name) => page.evaluate((name) => window.tetralodDemo.viewer.state[name].map(({ normal, offset }) => [...normal, offset]), name);
  await page.fill("#position", "1");
  assert.equal(await page.inputValue("#cut"), "250");
  await page.click("#add-plane");
  await page.uncheck("#flip");
  await page.fill("#cut", "750");
  assert.deepEqual(await scene("clips"), [
    [0, -1, 0, -1],
    [1, 0, 0, 1.5],
  ]);
  await page.click("#add-plane");
  await page.fill("#normal-y", "1");
  assert.equal(await page.inputValue("#axis"), "");
  const [x, y, z, offset] = (await scene("clips"))[2];
  assert.ok(x === 0 && y === z && Math.abs(y + Math.SQRT1_2) < 1e-12 && Math.abs(offset + 6 / Math.SQRT2) < 1e-12, `${[x, y, z, offset]}`);
  assert.deepEqual(await page.locator("#plane option").allInnerTexts(), ["1: y < 1", "2: x > 1.5", "3: n < 4.24"]);
  // Sections have places of their own, and no side.
  await page.check("[name=mode][value=slice]", { force: true });
  assert.deepEqual(await page.locator("#plane option").allInnerTexts(), ["1: y = 2", "2: x = 1", "3: n = 4.24"]);
  assert.equal((await scene("slices")).length, 3);
  await page.check("[name=mode][value=solid]", { force: true });
  // What is no direction, or outside of the model, is not taken.
  await page.selectOption("#plane", "0");
  const before = await scene("clips");
  for (const [id, typed] of [
    ["#normal-y", "0"],
    ["#position", "4.5"],
  ]) {
    await page.fill(id, typed);
    assert.ok(!(await page.locator(id).evaluate((input) => input.validity.valid)), id);
  }
  assert.deepEqual(await scene("clips"), before);
  await page.locator("#cut").focus();
  assert.equal(await page.inputValue("#position"), "1");
  for (let i = 3; i < 6; i++) await page.click("#add-plane");
  assert.ok(await page.isDisabled("#add-plane"));
  // Each is refined where the region is that of the planes.
  await page.selectOption("#region", "cut");
  const request = await page.evaluate(() => window.tetralodDemo.request);
  assert.deepEqual(
    [request.slab, ...request.needs.map(({ slab }) => slab)].map(({ normal, offset }) => [...normal, offset]),
    await scene("clips"),
  );
  for (let i = 6; i > 1; i--) await page.click("#remove-plane");
  assert.ok(await page.isDisabled("#remove-plane"));
  assert.deepEqual(await scene("clips"), [[0, -1, 0, -1]]);
  assert.deepEqual(page.complaints, []);
  await page.close();
});

test("seeds lie on the chosen plane, where that is oblique, too, and another volume gets the planes at the same parts of its length", async () => {
  const page = await open("#view=flow&cut=300&rake=5&normal=1,0,1&planes=0,0,1,1,500,250&plane=1");
  const seeds = () => page.evaluate(() => window.tetralodDemo.viewer.state.streamlines.seeds);
  const raked = await seeds();
  assert.ok(raked.length > 5 && raked.length <= 25, `${raked.length}`);
  for (const [x, y, z] of raked) assert.ok(x >= 0 && x <= 2 && y >= 0 && y <= 4 && z >= 0 && z <= 8 && Math.abs(x + z - 3) < 1e-9, `${[x, y, z]}`);
  const canvas = await page.locator("#canvas").boundingBox();
  await page.mouse.click(canvas.x + 0.3 * canvas.width, canvas.y + 0.25 * canvas.height);
  const placed = (await seeds()).at(-1);
  [0.6, 3, 2.4].forEach((at, i) => assert.ok(Math.abs(placed[i] - at) < 0.02, `${placed}`));
  await page.selectOption("#plane", "1");
  assert.ok((await seeds()).slice(0, -1).every(([, , z]) => z === 2));
  await page.check("[name=mode][value=slice]", { force: true });
  await page.click("#open-gallery");
  await page.fill("#url", "plain.mt");
  await page.keyboard.press("Enter");
  await page.waitForFunction(() => window.tetralodDemo.info?.kind === "explicit", undefined, { timeout: PATIENCE });
  await complete(page);
  const slices = await page.evaluate(() => window.tetralodDemo.viewer.state.slices.map(({ normal, offset }) => [...normal, offset]));
  assert.deepEqual(slices[1], [0, 0, -1, 0.5]);
  assert.ok(Math.abs(slices[0][3] - 0.4 * Math.SQRT2) < 1e-12, `${slices[0]}`);
  assert.deepEqual(page.complaints, []);
  await page.close();
});

test("the handle of a plane moves and tilts it, by pointer and by keys, as one step each", async () => {
  const page = await open("#view=solid");
  const handle = (name) => page.locator(`#handles .${name}`);
  const state = () => page.evaluate(() => window.tetralodDemo.viewer.state.clips[0]);
  /** Drags it as far as that, in pixels. */
  const drag = async (name, right, down) => {
    const { x, y, width, height } = await handle(name).boundingBox();
    const from = [x + width / 2, y + height / 2];
    await page.mouse.move(from[0], from[1]);
    await page.mouse.down();
    await page.mouse.move(from[0] + right / 3, from[1] + down / 3);
    await page.mouse.move(from[0] + right, from[1] + down);
    await page.mouse.up();
    await rest(page);
  };
  const { height } = await page.locator("#canvas").boundingBox();
  const hashes = [await page.evaluate(() => location.hash)];
  const step = async (act) => {
    await act();
    await rest(page);
    hashes.push(await page.evaluate(() => location.hash));
  };
  // The arrow points to what is hidden, here down; the whole height of the picture is 4 units.
  await step(() => drag("arrow", 20, height / 4));
  const moved = await state();
  assert.deepEqual(moved.normal, [0, -1, 0]);
  assert.ok(Math.abs(moved.offset + 1) < 0.01, `${moved.offset}`);
  assert.equal(await handle("arrow").getAttribute("aria-valuenow"), String(-moved.offset));
  // By half the length of the arrow to the right: the ball, above the plane, goes along the circle around its middle.
  await step(() => drag("ball", 32, 0));
  const tilted = await state();
  assert.ok(Math.abs(tilted.normal[0] / tilted.normal[1] - 0.5) < 0.01 && tilted.normal[2] === 0, `${tilted.normal}`);
  // It turns around its middle.
  const middle = tilted.normal[0] * 1 - tilted.normal[1] * moved.offset;
  assert.ok(Math.abs(middle - tilted.offset) < 0.01, `${middle} is not ${tilted.offset}`);
  await step(() => handle("arrow").press("ArrowRight"));
  await step(() => handle("ball").press("ArrowUp"));
  assert.ok((await state()).normal[2] !== 0);
  assert.equal(new Set(hashes).size, hashes.length, `each is a step: ${hashes}`);
  for (const hash of hashes.slice(0, -1).reverse()) {
    await page.keyboard.press("Control+z");
    await page.waitForFunction((hash) => location.hash === hash, hash, { timeout: PATIENCE });
  }
  // The wheel zooms over it as elsewhere.
  const before = await page.evaluate(() => window.tetralodDemo.viewer.state.camera.distance);
  await handle("arrow").hover();
  await page.mouse.wheel(0, 100);
  await page.waitForFunction((before) => window.tetralodDemo.viewer.state.camera.distance > before, before, { timeout: PATIENCE });
  // A plane that cuts nothing has none, nor views without planes.
  await page.fill("#cut", "0");
  assert.ok(await page.locator("#handles").isHidden());
  await page.fill("#cut", "10");
  assert.ok(await page.locator("#handles").isVisible());
  await page.uncheck("#handle");
  assert.ok(await page.locator("#handles").isHidden());
  await page.check("#handle");
  await page.check("[name=mode][value=iso]", { force: true });
  assert.ok(await page.locator("#handles").isHidden());
  assert.deepEqual(page.complaints, []);
  await page.close();
});

test("what is done in the picture is part of the state: probes, seeds, and the camera", async () => {
  const page = await open();
  const canvas = await page.locator("#canvas").boundingBox();
  const click = (x) => page.mouse.click(canvas.x + x * canvas.width, canvas.y + canvas.height / 2);
  const steps = [];
  const step = async (act) => {
    await act();
    await rest(page);
    steps.push({ ...(await seen(page)), cards: await page.locator(".card").count() });
  };
  await step(() => click(0.4));
  await step(() => click(0.6));
  await step(() => page.locator("#canvas").press("ArrowLeft"));
  await step(() => page.locator(".card button").first().click());
  await step(() => page.check("#orthographic"));
  await step(() => page.click("#home"));
  await step(() => page.click("#reset"));
  assert.deepEqual(
    steps.map(({ cards }) => cards),
    [1, 2, 2, 1, 1, 1, 0],
  );
  assert.equal(new Set(steps.map(({ hash }) => hash)).size, steps.length, "each is a step");
  for (const [button, order] of [
    ["#undo", steps.slice(0, -1).reverse()],
    ["#redo", steps.slice(1)],
  ]) {
    for (const wanted of order) {
      await page.click(button);
      await page.waitForFunction((cards) => document.querySelectorAll(".card").length === cards, wanted.cards, { timeout: PATIENCE });
      assert.deepEqual({ ...(await seen(page)), cards: wanted.cards }, wanted);
    }
  }
  assert.deepEqual(page.complaints, []);
  await page.close();
});

test("a second file, and the difference to it, are part of the state, and are shown and asked for what the first one is", async () => {
  const page = await open("#view=slice&error=25&beside=flow.mt");
  const isBeside = () => page.waitForFunction(() => window.tetralodDemo.beside?.state === "complete", undefined, { timeout: PATIENCE });
  await isBeside();
  const both = () =>
    page.evaluate(() => {
      const { viewer, request, beside } = window.tetralodDemo;
      const { clipBox, region, compare, ...there } = beside.viewer.state;
      return { here: viewer.state, there, asked: [request, beside.request], compare };
    });
  const assertLinked = async () => {
    await rest(page);
    const { here, there, asked, compare } = await both();
    for (const name of ["camera", "slices", "isosurfaces", "clips", "colours", "background", "threshold"]) assert.deepEqual(there[name], here[name], name);
    assert.equal(compare, undefined);
    // At all times from 1 to 12, of which this is one.
    const { min, max } = await page.evaluate((number) => window.tetralodDemo.info.fields[number], asked[0].field);
    assert.deepEqual([asked[1].field, asked[1].error], [asked[0].field, (Number.parseFloat(asked[0].error) / 100) * (max - min)]);
    return asked[0];
  };
  await assertLinked();
  for (const [id, value] of [
    ["cut", "700"],
    ["time", "2"],
    ["error", "75"],
  ])
    await page.fill(`#${id}`, value);
  await page.evaluate(() => window.tetralodDemo.viewer.orbit(0.5));
  const asked = await assertLinked();
  assert.notEqual(asked.field, 0);
  const link = await page.evaluate(() => location.hash);
  assert.match(link, /beside=flow\.mt/);
  assert.ok(await page.isDisabled("#keep"), "the file beside is compared with");

  await page.check("#difference");
  await rest(page);
  assert.equal(await page.evaluate(() => location.hash.includes("difference=1")), true);
  assert.deepEqual((await both()).here.compare, { at: 0, difference: true });
  await page.click("#undo");
  await rest(page);
  assert.deepEqual([await page.evaluate(() => location.hash), (await both()).here.compare], [link, undefined]);
  await page.click("#not-beside");
  await rest(page);
  assert.ok((await page.isHidden("#stage-beside")) && (await page.isEnabled("#keep")));
  await page.click("#undo");
  await isBeside();
  assert.equal(await page.evaluate(() => location.hash), link);
  await assertLinked();
  assert.deepEqual(page.complaints, []);
  await page.close();
});

test("parts whose names have steps are a tree, which is filtered, made translucent, measured and refined", async () => {
  const page = await open("?url=parts.mt");
  const [blades, vanes] = ["rotor/blade", "stator/vane"].map((name) => Array.from({ length: 12 }, (_, i) => `${name} ${i + 1}`));
  const names = [...blades, "rotor/hub", ...vanes, "casing"];
  const state = () => page.evaluate(() => window.tetralodDemo.viewer.state);
  const shown = async () => (await state()).regions ?? "all";
  const sheer = async () => (await state()).boundary.regionOpacities ?? {};
  const but = (hidden) => names.filter((name) => !hidden.includes(name));
  const box = (name) => page.getByRole("checkbox", { name, exact: true });
  const mixed = (name) => box(name).evaluate((one) => one.indeterminate);
  assert.equal(await page.locator("#region-list > li").count(), 3);
  assert.ok(await box("rotor/hub").isHidden(), "branches of a long list are closed");
  // By keys alone.
  await box("rotor").focus();
  for (const key of ["ArrowRight", "ArrowDown", "ArrowDown", "Space"]) await page.keyboard.press(key);
  assert.deepEqual(await shown(), but(["rotor/blade 2"]));
  assert.deepEqual([await mixed("rotor"), await mixed("stator"), await box("stator").isChecked()], [true, false, true]);
  await box("stator").uncheck();
  assert.deepEqual([await shown(), await mixed("stator")], [but(["rotor/blade 2", ...vanes]), false]);
  await box("rotor").click();
  assert.deepEqual(await shown(), but(vanes), "what shows some shows all");
  await page.getByRole("button", { name: "only stator", exact: true }).click();
  assert.deepEqual(await shown(), vanes);
  await rest(page);
  assert.match(page.url(), /hidden=0-12,25(&|$)/);
  await page.click("#all-regions");
  assert.equal(await shown(), "all");

  await page.fill("#region-filter", "NE 1");
  assert.ok((await box("stator/vane 11").isVisible()) && (await box("rotor").isHidden()));
  assert.equal(await page.innerText("#region-count"), "4 of 26 parts");
  await page.click("#only-found");
  assert.deepEqual(
    await shown(),
    vanes.filter((name) => name.includes("ne 1")),
  );
  await page.fill("#region-filter", "");
  await page.click("#all-regions");

  const slider = (name) => page.getByRole("slider", { name: `opacity of ${name}`, exact: true });
  assert.ok(await slider("casing").isHidden());
  await page.getByRole("button", { name: "Opacities" }).click();
  await slider("stator").fill("20");
  await slider("casing").fill("50");
  assert.deepEqual(await sheer(), { ...Object.fromEntries(vanes.map((name) => [name, 0.2])), casing: 0.5 });
  await rest(page);
  assert.match(page.url(), /part-opacities=13-24%3A20,25%3A50/);
  // Those of the whole boundary count, too.
  await page.fill("#opacity", "50");
  assert.equal((await sheer()).casing, 0.25);
  await page.fill("#opacity", "100");
  await slider("stator").fill("100");
  assert.deepEqual(await sheer(), { casing: 0.5 });
  await page.evaluate(() => (location.hash = "#part-opacities=0-1:30,2:5&region=part&part=stator/"));
  await rest(page);
  assert.deepEqual(await sheer(), { "rotor/blade 1": 0.3, "rotor/blade 2": 0.3, "rotor/blade 3": 0.05 });
  const request = () => page.evaluate(() => window.tetralodDemo.request.regions);
  assert.deepEqual(await request(), vanes);
  await page.selectOption("#part", "casing");
  assert.deepEqual(await request(), ["casing"]);
  await page.evaluate(() => (location.hash = "#part-opacities=3:2,40:50&hidden=0"));
  await rest(page);
  assert.match(await page.innerText("#note"), /means nothing: part-opacities/);

  await page.keyboard.press("n");
  await page.locator("#part-stats td").first().waitFor();
  const table = await page.locator("#part-stats tr").evaluateAll((rows) => rows.map((row) => [...row.children].map((cell) => cell.textContent)));
  assert.deepEqual(table[0].slice(0, 3), ["part", "tetrahedra", "volume"]);
  assert.deepEqual(
    table.slice(1),
    names.map((name, i) => [name, "100", String(i + 1), "0", "2", "1", "0.5", "0.01"]),
  );
  // Another volume has no such parts.
  await page.evaluate(() => (location.search = "?url=plain.mt"));
  await complete(page);
  assert.ok(await page.locator("#regions").isHidden());
  assert.deepEqual(page.complaints, []);
  await page.close();
});
