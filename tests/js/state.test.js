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

/** Waits until the state has been written. */
const rest = (page) => page.waitForTimeout(400);

/** What the page shows: its address, all controls, what is drawn and what is asked of the mesh. */
const seen = (page) =>
  page.evaluate(() => {
    const value = (control) => (["checkbox", "radio"].includes(control.type) ? control.checked : control.value);
    const all = /** @type {HTMLInputElement[]} */ ([...document.querySelectorAll("#settings input, #settings select")]);
    const controls = all.filter(({ id }) => !["split", "difference", "freeze"].includes(id));
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
      if (!control || control.disabled || ["split", "difference", "freeze"].includes(control.id)) return false;
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
  "#view=solid&outline=0&shade=10&flip=0&region=cut&background=dark&axes=0&fly=1&probes=1,1,1,0.5,2,7&camera=1,1,1,5,0.2,0.3,orthographic",
];

test("links of before are understood, and written as they were", async () => {
  const page = await open();
  for (const link of LINKS) {
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
