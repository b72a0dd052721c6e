// The demo page as a person uses it: gallery, keyboard, phone, a lost network, files that are saved; and that it is accessible.
import assert from "node:assert/strict";
import { readFile } from "node:fs/promises";
import { createRequire } from "node:module";
import { after, before, test } from "node:test";
import { fileURLToPath } from "node:url";
import { address } from "./browser.js";
import {
  addressed,
  assertDrawn,
  begin,
  demo,
  differing,
  drop,
  end,
  newPage,
  open,
  PATIENCE,
  picture,
  pictures,
  reach,
  setSlider,
  settle,
  show,
  still,
} from "./drive.js";

before(() => begin());

after(end);

const SMALL = "data/bucky-small.mt";
const PHONE = { viewport: { width: 360, height: 640 }, hasTouch: true, isMobile: true };
/** Software draws large pictures slowly. */
const VIEWPORT = { viewport: { width: 900, height: 620 } };
/** Where all views are drawn, and nobody looks at details. */
const COARSE = { ...VIEWPORT, deviceScaleFactor: 0.5 };

const screenshot = (page, name) => page.screenshot({ path: fileURLToPath(new URL(`${name}.png`, pictures)) });

/** The smallest mesh. */
const TETRAHEDRON = `# vtk DataFile Version 3.0
one
ASCII
DATASET UNSTRUCTURED_GRID
POINTS 4 float
0 0 0 1 0 0 0 1 0 0 0 1
CELLS 1 5
4 0 1 2 3
CELL_TYPES 1
10
POINT_DATA 4
SCALARS p float 1
LOOKUP_TABLE default
0 1 2 3
`;

/** Presses a key outside of the picture. */
async function press(page, key) {
  await page.evaluate(() => document.activeElement instanceof HTMLElement && document.activeElement.blur());
  await page.keyboard.press(key);
}

test("all is reached with keys, and the list of keys has them", async () => {
  const page = await open(SMALL, undefined, VIEWPORT);
  await reach(page, "complete");
  for (const [key, view] of [
    ["4", "slice"],
    ["5", "mesh"],
    ["2", "iso"],
  ]) {
    await press(page, key);
    assert.equal(await page.locator("[name=mode]:checked").getAttribute("value"), view);
  }
  await press(page, "n");
  assert.ok(await page.locator("#data-panel").isVisible());
  await press(page, "i");
  assert.equal(await page.evaluate(() => document.activeElement?.id), "isovalue");
  const before = await page.textContent("#isovalue-text");
  await page.keyboard.press("ArrowRight");
  assert.notEqual(await page.textContent("#isovalue-text"), before);
  await press(page, "v");
  assert.equal(await page.evaluate(() => document.activeElement?.id), "canvas");
  await press(page, "?");
  const listed = await page.locator("#keys-list").innerText();
  for (const words of ["rotate", "undo", "full screen", "copy the link", "Slice", "gallery"]) assert.ok(listed.includes(words), words);
  await screenshot(page, "page-keys");
  await page.keyboard.press("Escape");
  assert.ok(await page.locator("#keys").isHidden());
  await press(page, "o");
  assert.ok(await page.locator("#gallery").isVisible());
  await page.keyboard.press("Escape");

  // The isovalue is a handle on the histogram, too; values carry over, and an empty surface says so.
  const histogram = await page.locator("#histogram").boundingBox();
  await page.mouse.click(histogram.x + histogram.width / 4, histogram.y + 20);
  assert.ok(Math.abs(Number(await page.inputValue("#isovalue")) - 240) < 20, await page.inputValue("#isovalue"));
  await page.evaluate(() => (location.hash = "#isovalue=99"));
  await page.locator("#empty").waitFor({ timeout: PATIENCE });
  assert.match(await page.innerText("#empty"), /99 is outside of the range of density/);
  await screenshot(page, "page-empty");
  // The last step may change nothing: then no frame follows it, and the page must say so all the same.
  const shown = await page.evaluate(() => {
    const { viewer, step, frame } = window.tetralodDemo;
    const after = (name, detail) => {
      viewer.dispatchEvent(new CustomEvent(name, { detail }));
      return !document.getElementById("empty").hidden;
    };
    return [after("stats", { ...step, done: false }), after("frame", frame), after("stats", { ...step, done: true })];
  });
  assert.deepEqual(shown, [false, false, true]);
  await page.click("#empty-act");
  await page.locator("#empty").waitFor({ state: "hidden", timeout: PATIENCE });

  // The region that is a sphere is drawn as one.
  await page.selectOption("#region", "sphere");
  await page.waitForFunction(() => document.querySelectorAll("#overlay .sphere polyline").length === 3, undefined, { timeout: PATIENCE });
  assert.match(await page.innerText("#budget-achieved"), /Achieved: [\d,]+ tetrahedra\. Limited by/);
  assert.deepEqual(page.complaints, []);
  await page.close();
});

/** What the page has measured, by its names. */
async function measures(page) {
  await page.waitForFunction(() => document.querySelector("#measures[aria-busy=false] dt"), undefined, { timeout: PATIENCE });
  return page.evaluate(() =>
    Object.fromEntries([...document.querySelectorAll("#measures dt")].map((term) => [term.textContent, term.nextSibling.textContent])),
  );
}

/** The number of such words, as which `1,234.5` and `−1` are numbers. */
const numberOf = (words) => Number(words.replaceAll(",", "").replaceAll("−", "-").split(" ")[0]);

/** Whether a number is so near to what it should be that six digits may be the same. */
const isNear = (found, wanted, part = 2e-5) => Math.abs(found - wanted) <= part * Math.abs(wanted);

/** What a button saves. */
async function save(page, button) {
  const [download] = await Promise.all([page.waitForEvent("download", { timeout: PATIENCE }), page.click(button)]);
  return { name: download.suggestedFilename(), bytes: await readFile(await download.path()) };
}

/** The rows of a table, which is saved as CSV. */
async function savedRows(page) {
  await press(page, "x");
  const { bytes } = await save(page, "[data-export=csv]");
  return bytes
    .toString()
    .trim()
    .split("\n")
    .map((row) => row.split(","));
}

/** A function that fails where a page has accessibility violations. */
async function checker(page) {
  // As an element it would be refused by the page's policy.
  await page.evaluate(await readFile(createRequire(import.meta.url).resolve("axe-core/axe.min.js"), "utf8"));
  return async (name) => {
    const found = await page.evaluate(async () => {
      const { violations } = await /** @type {any} */ (window).axe.run(document, { resultTypes: ["violations"] });
      return violations.map(({ id, nodes }) => `${id}: ${nodes.map(({ html, failureSummary }) => `${html} ${failureSummary}`).join("; ")}`);
    });
    assert.deepEqual(found, [], name);
  };
}

test("the page has no accessibility violations, light or dark", async () => {
  const page = await open(SMALL, undefined, COARSE);
  await reach(page, "complete");
  const check = await checker(page);
  const dialog = async (name, id, key) => {
    await press(page, key);
    await check(name);
    await screenshot(page, `page-${id}-${name.replace(/\W/g, "-")}`);
    await page.keyboard.press("Escape");
  };
  for (const colorScheme of /** @type {const} */ (["dark", "light"])) {
    await page.emulateMedia({ colorScheme });
    for (const view of ["Isosurface", "Volume", "Slice", "Boundary", "Mesh"]) {
      await press(page, "g");
      await show(page, view);
      await check(`${view}, ${colorScheme}`);
    }
    await press(page, "n");
    await check(`data, ${colorScheme}`);
    await press(page, "x");
    await check(`export, ${colorScheme}`);
    await dialog(`keys, ${colorScheme}`, "keys", "?");
    await dialog(`gallery, ${colorScheme}`, "gallery", "o");
  }
  assert.deepEqual(page.complaints, []);
  await page.close();
});

test("nor has it with several views, probes, a region, messages, the map of blocks, and the dialog of a build", async () => {
  const page = await open("data/abc-flow.mt", undefined, COARSE);
  await reach(page, "complete");
  await setSlider(page, "error", 80);
  const check = await checker(page);
  for (const colorScheme of /** @type {const} */ (["dark", "light"])) {
    await page.emulateMedia({ colorScheme });
    const look = (name) => check(`${name}, ${colorScheme}`);
    await press(page, "6");
    await look("Flow");
    await press(page, "Shift+1");
    await press(page, "Shift+5");
    await look("Flow with surface and wires");
    await press(page, "d");
    await look("a deformed shape");
    await press(page, "d");
    await page.selectOption("#region", "box");
    await press(page, "1");
    await settle(page);
    for (const [i, x] of [0.45, 0.58].entries()) {
      const { x: left, y: top, width, height } = await page.locator("#canvas").boundingBox();
      // On a handle of the region a press that lasts until this is known is a click, too.
      await page.mouse.click(left + x * width, top + 0.5 * height, { delay: 500 });
      await page.locator(".card").nth(i).waitFor({ timeout: PATIENCE });
    }
    await page.locator("#plot path").waitFor({ timeout: PATIENCE });
    await look("probes and a region");
    await screenshot(page, `page-probes-${colorScheme}`);
    await page.click(".card .over-time");
    await page.locator("#plot .mark").first().waitFor({ state: "attached", timeout: PATIENCE });
    await look("probes over time");
    await screenshot(page, `page-over-time-${colorScheme}`);
    await page.selectOption("#over-time", "line");
    await press(page, "n");
    await page.locator("#plot image").waitFor({ state: "attached", timeout: PATIENCE });
    await measures(page);
    await look("values between probes at all times, and measures");
    await screenshot(page, `page-all-times-${colorScheme}`);
    await press(page, "g");
    await page.click(".card .over-time");
    await press(page, "Escape");
    await page.evaluate(() => (location.hash = "#isovalue=99"));
    await page.locator("#empty").waitFor({ timeout: PATIENCE });
    await look("an empty surface");
    await page.click("#empty-act");
    await drop(page, "broken.mt", "hello");
    await page.locator("#message").waitFor({ timeout: PATIENCE });
    await look("a message");
    await page.click("#dismiss");
    await drop(page, "broken.vtu", "hello");
    await page.locator("dialog.build [role=alert]").waitFor({ timeout: PATIENCE });
    await look("a build that fails");
    await page.keyboard.press("Escape");
    await page.locator("dialog.build").waitFor({ state: "detached" });
    await drop(page, "tetrahedron.vtk", TETRAHEDRON);
    await page.locator("dialog.build").getByLabel("Level").selectOption("weld");
    await look("the settings of a build");
    await screenshot(page, `page-repair-${colorScheme}`);
    await page.keyboard.press("Escape");
    await page.locator("dialog.build").waitFor({ state: "detached" });
    await page.click("#share");
    await page.locator("#note").waitFor();
    await look("a note");
    await page.click("#reset");
  }
  assert.deepEqual(page.complaints, []);
  await page.close();
});

test("the gallery opens scenes with the counts of the paper, and files are opened by address and drop", async () => {
  const page = await open(SMALL, undefined, VIEWPORT);
  await reach(page, "complete");
  await page.click("#open-gallery");
  await page.locator("#gallery li").first().waitFor();
  const cards = await page.locator("#gallery li").allInnerTexts();
  assert.ok(cards.length >= 5 && cards.every((card) => /tetrahedra, [\d.]+\sMB as VTU, .*as MT/.test(card)), String(cards));
  const choose = async (title) => {
    await page.evaluate(() => (window.tetralodDemo.stats = undefined));
    await page.locator("#gallery li", { hasText: title }).click();
    await page.waitForFunction(() => window.tetralodDemo.stats, undefined, { timeout: PATIENCE });
    await reach(page, "complete");
    return (await demo(page, "stats")).tetrahedra;
  };
  assert.equal(await choose("Figure 6"), 74_236);
  await settle(page);
  assert.equal(await demo(page, "stats").then(({ tetrahedra }) => tetrahedra), 74_236);
  assert.equal(await page.evaluate(async () => (await window.tetralodDemo.viewer.isosurface(0.81)).indices.length / 3), 18_206);
  await screenshot(page, "page-figure-6");
  await page.click("#open-gallery");
  assert.equal(await choose("Figure 7"), 155_875);

  await page.click("#open-gallery");
  await page.fill("#url", SMALL);
  await page.keyboard.press("Enter");
  await page.waitForFunction(() => window.tetralodDemo.info?.kind === "edge", undefined, { timeout: PATIENCE });
  await page.evaluate(async () => {
    // On a slow machine, the events of the camera come long before the volume is open.
    const { viewer } = window.tetralodDemo;
    const open = viewer.open.bind(viewer);
    viewer.open = async (...wanted) => {
      const opened = await open(...wanted);
      await new Promise((resolve) => setTimeout(resolve, 1000));
      return opened;
    };
    const bytes = await (await fetch("data/sphere-flow-vertex.mt")).arrayBuffer();
    const dataTransfer = new DataTransfer();
    dataTransfer.items.add(new File([bytes], "dropped.mt"));
    window.dispatchEvent(new DragEvent("drop", { dataTransfer, cancelable: true }));
  });
  await page.waitForFunction(() => window.tetralodDemo.info?.kind === "vertex", undefined, { timeout: PATIENCE });
  await addressed(page, /url=file/);
  assert.equal(await page.locator("#volume option:checked").innerText(), "dropped.mt");
  assert.deepEqual(page.complaints, []);
  await page.close();
});

test("a phone shows the picture while a control is moved, and keeps the state when it is turned", async () => {
  const page = await open(SMALL, undefined, PHONE);
  await reach(page, "complete");
  await page.locator("#focus").scrollIntoViewIfNeeded();
  const seen = async () => {
    const [stage, control] = [await page.locator("#canvas").boundingBox(), await page.locator("#focus").boundingBox()];
    const { width, height } = page.viewportSize();
    return stage.y >= 0 && stage.y + stage.height <= height && stage.width <= width && control.y >= 0 && control.y < height;
  };
  assert.ok(await seen(), "picture and control at once");
  const wide = () =>
    page.evaluate(() =>
      [document.documentElement, ...document.querySelectorAll(".panel:not([hidden]), header, .tools button, .tabs button, .segments span")]
        .filter(({ scrollWidth, clientWidth }) => scrollWidth > clientWidth + 1)
        .map(({ outerHTML }) => outerHTML.slice(0, 80)),
    );
  assert.deepEqual(await wide(), [], "nothing is cut");
  for (const tab of ["data", "export", "settings"]) {
    await page.tap(`#tab-${tab}`);
    await screenshot(page, `page-phone-${tab}`);
    assert.deepEqual(await wide(), [], tab);
  }
  await page.check("#focus");
  await page.selectOption("#axis", "0", { force: true });
  await addressed(page, /axis=0&focus=1/);
  const address = page.url();
  await page.setViewportSize({ width: 740, height: 360 });
  await settle(page);
  assert.ok(await page.isChecked("#focus"));
  assert.deepEqual(await wide(), [], "on its side");
  await page.locator("#focus").scrollIntoViewIfNeeded();
  assert.ok(await seen(), "on its side, too");
  assert.equal(page.url(), address);
  assertDrawn(await picture(page, "phone-side"));
  await screenshot(page, "page-phone-side");
  assert.deepEqual(page.complaints, []);
  await page.close();
});

test("a lost network keeps the picture, and the download continues", async () => {
  const page = await open("data/sphere-flow.mt", undefined, VIEWPORT);
  await reach(page, "complete");
  const before = await still(page, "network-before");
  await page.context().setOffline(true);
  await page.fill("#error", "20");
  await page.locator("#message").waitFor({ timeout: PATIENCE });
  assert.match(await page.innerText("#message"), /could not be downloaded/);
  assert.ok(await page.locator("#retry").isVisible());
  await screenshot(page, "page-offline");
  await page.click("#dismiss");
  assert.ok(await page.locator("#message").isHidden());
  assertDrawn(await picture(page, "network-lost"));
  await page.context().setOffline(false);
  await page.evaluate(() => document.getElementById("retry")?.click());
  await reach(page, "complete");
  const { satisfied } = await setSlider(page, "error", 50);
  assert.ok(satisfied);
  assert.ok(differing(before, await still(page, "network-after")) < 0.01, "as before");
  await page.close();
});

test("pictures, meshes, surfaces, probes and numbers are saved", async () => {
  const page = await open(SMALL, undefined, VIEWPORT);
  await reach(page, "complete");
  const stats = await demo(page, "stats");
  await page.locator("#canvas").focus();
  await page.keyboard.press("p");
  await page.locator(".card").waitFor({ timeout: PATIENCE });
  await press(page, "x");
  const vtu = await save(page, "[data-export=vtu]");
  assert.equal(vtu.name, "bucky-small.vtu");
  assert.ok(vtu.bytes.includes(`NumberOfPoints="${stats.vertices}" NumberOfCells="${stats.tetrahedra}"`));
  assert.ok((await save(page, "[data-export=vtk]")).bytes.includes(`CELL_TYPES ${stats.tetrahedra}\n`));
  const triangles = await page.evaluate(async () => {
    const { viewer } = window.tetralodDemo;
    return (await viewer.isosurface(viewer.state.isosurfaces[0].value)).indices.length / 3;
  });
  assert.ok(triangles > 100);
  assert.equal((await save(page, "[data-export=stl]")).bytes.readUInt32LE(80), triangles);
  assert.ok((await save(page, "[data-export=ply]")).bytes.includes(`element face ${triangles}\n`));
  await page.selectOption("#surface-kind", "boundary");
  const glb = await save(page, "[data-export=glb]");
  assert.deepEqual([glb.name, glb.bytes.toString("latin1", 0, 4)], ["bucky-small-boundary.glb", "glTF"]);
  const { accessors, meshes } = JSON.parse(glb.bytes.toString("utf8", 20, 20 + glb.bytes.readUInt32LE(12)));
  const { COLOR_0: colours, POSITION: places } = meshes[0].primitives[0].attributes;
  assert.equal(accessors[colours].count, accessors[places].count, "each vertex has a colour");
  const rows = await savedRows(page);
  assert.equal(String(rows[0]), "what,x,y,z,distance,density");
  assert.equal(rows[1][0], "probe A");

  // The axes are in the picture, where they are asked for.
  const sizes = [];
  for (const isOverlaid of [true, false]) {
    await page.setChecked("#shot-overlay", isOverlaid);
    const { name, bytes } = await save(page, "#shot");
    assert.match(name, /^bucky-small-\d+x\d+\.png$/);
    sizes.push(
      await page.evaluate(async (base64) => {
        const bytes = Uint8Array.from(atob(base64), (c) => c.charCodeAt(0));
        const image = await createImageBitmap(new Blob([bytes], { type: "image/png" }));
        const context = new OffscreenCanvas(image.width, image.height).getContext("2d");
        context.drawImage(image, 0, 0);
        return Array.from(context.getImageData(0, 0, image.width, image.height).data.filter((_, i) => i % 4 === 1));
      }, bytes.toString("base64")),
    );
  }
  const changed = sizes[0].filter((value, i) => value !== sizes[1][i]).length / sizes[0].length;
  assert.ok(changed > 0.005 && changed < 0.3, `${(100 * changed).toFixed(1)} % of the pixels are axes`);

  await page.context().grantPermissions(["clipboard-read", "clipboard-write"]);
  await press(page, "n");
  await page.click("#copy-data");
  await page.locator("#note").waitFor();
  const copied = JSON.parse(await page.evaluate(() => navigator.clipboard.readText()));
  assert.equal(copied.stats.tetrahedra, stats.tetrahedra);
  assert.ok(copied.meshes.length > 0 && copied.frames.length > 0 && copied.received > 0);
  await screenshot(page, "page-data");
  assert.deepEqual(page.complaints, []);
  await page.close();
});

/** What a video is when it is played: its size, its length, and how many different pictures a player finds, in each of `count` equal parts. */
async function played(bytes, count) {
  const page = await newPage();
  const found = await page.evaluate(
    async ([base64, count]) => {
      const video = document.createElement("video");
      video.muted = true;
      const event = (name) =>
        new Promise((resolve, reject) => {
          video.addEventListener(name, resolve, { once: true });
          video.addEventListener("error", () => reject(new Error(video.error?.message)), { once: true });
        });
      const ready = event("loadeddata");
      video.src = `data:video/webm;base64,${base64}`;
      await ready;
      const { videoWidth: width, videoHeight: height, duration } = video;
      const context = new OffscreenCanvas(width, height).getContext("2d");
      const pictures = new Set();
      const seen = () => {
        context.drawImage(video, 0, 0);
        return context.getImageData(0, 0, width, height).data.reduce((hash, byte) => Math.imul(hash, 31) + byte, 0);
      };
      let last;
      for (let i = 0; i < count; i++) {
        const there = event("seeked");
        video.currentTime = ((i + 0.5) * duration) / count;
        await there;
        // The picture may come some refreshes after the event.
        let picture = seen();
        for (let tries = 0; picture === last && tries < 100; tries++) {
          await new Promise(requestAnimationFrame);
          picture = seen();
        }
        pictures.add((last = picture));
      }
      return { width, height, duration, pictures: pictures.size };
    },
    [bytes.toString("base64"), count],
  );
  await page.close();
  return found;
}

test("movies are recorded from all sides, over time and through a period, and can be played", async () => {
  const page = await open(FLOW, undefined, COARSE);
  await reach(page, "complete");
  await setSlider(page, "error", 80);
  await press(page, "1");
  await press(page, "x");
  const camera = () => page.evaluate(() => window.tetralodDemo.viewer.state.camera);
  const steps = await page.evaluate(() => window.tetralodDemo.info.fields.filter(({ name }) => name === "pressure").length);
  // Nothing swings before a vector displaces.
  assert.deepEqual(await page.locator("#movie-kind option").evaluateAll((all) => all.map(({ disabled }) => disabled)), [false, false, true]);
  await press(page, "d");
  for (const [kind, pictures, rate] of /** @type {const} */ ([
    ["turntable", 7, 12],
    ["steps", undefined, 5],
    ["swing", 5, 24],
  ])) {
    const before = [await camera(), await page.inputValue("#time")];
    await page.selectOption("#movie-kind", kind);
    assert.equal(await page.locator("#movie-pictures").isDisabled(), pictures === undefined);
    if (pictures) await page.fill("#movie-pictures", String(pictures));
    await page.selectOption("#movie-rate", String(rate));
    await page.locator("#movie").focus();
    const [download] = await Promise.all([page.waitForEvent("download", { timeout: PATIENCE }), page.keyboard.press("Enter")]);
    assert.equal(download.suggestedFilename(), `abc-flow-${kind}.webm`);
    const count = pictures ?? steps;
    const found = await played(await readFile(await download.path()), count);
    const size = await page.evaluate(() => {
      const canvas = document.getElementById("canvas");
      return [canvas.clientWidth, canvas.clientHeight].map((length) => Math.round(length * devicePixelRatio) & ~1);
    });
    assert.deepEqual([found.width, found.height], size);
    assert.ok(Math.abs(found.duration - count / rate) < 0.01, `${kind}: ${found.duration} s`);
    // All are different, but at the ends of a period those on the way there and back.
    assert.ok(found.pictures >= (kind === "swing" ? 3 : count), `${kind}: ${found.pictures} of ${count} pictures`);
    // All is as it was.
    await page.waitForFunction(() => document.getElementById("movie").textContent === "Record as WebM", undefined, { timeout: PATIENCE });
    assert.deepEqual([await camera(), await page.inputValue("#time")], before, kind);
  }
  // It can be ended, and what there is is saved.
  await page.selectOption("#movie-kind", "turntable");
  await page.click("#movie");
  await page.waitForFunction(() => /^Picture [3-9]/.test(document.getElementById("movie-words").textContent), undefined, { timeout: PATIENCE });
  const [download] = await Promise.all([page.waitForEvent("download", { timeout: PATIENCE }), page.click("#movie")]);
  const found = await played(await readFile(await download.path()), 1);
  assert.ok(found.duration > 0.1 && found.duration < 2, `${found.duration} s`);
  assert.deepEqual(page.complaints, []);
  await page.close();
});

test("a browser that cannot encode videos says so", async () => {
  const page = await open(SMALL, (page) => page.addInitScript(() => Reflect.deleteProperty(window, "VideoEncoder")), COARSE);
  await reach(page, "complete");
  await press(page, "x");
  await page.click("#movie");
  await page.locator("#message").waitFor({ timeout: PATIENCE });
  assert.match(await page.innerText("#message"), /movie could not be made.*cannot encode videos/s);
  await page.close();
});

test("an empty picture says why, and what does nothing is disabled", async () => {
  const page = await open(SMALL, undefined, VIEWPORT);
  await reach(page, "complete");
  const says = async (pattern) => {
    await page.locator("#empty").waitFor({ timeout: PATIENCE });
    assert.match(await page.innerText("#empty"), pattern);
    await page.click("#empty-act");
    await page.locator("#empty").waitFor({ state: "hidden", timeout: PATIENCE });
  };
  const isDisabled = (id) => page.locator(`#${id}`).isDisabled();
  await show(page, "Boundary");
  await page.fill("#cut", "1000");
  await says(/Everything is cut away: the model lies between y = .* and /);
  // The section has a place of its own: what hid nothing of the solid does not hide it.
  await page.fill("#cut", "0");
  await show(page, "Slice");
  await settle(page);
  assert.ok(await page.locator("#empty").isHidden());
  assert.ok((await demo(page, "frame")).triangles > 0);
  await show(page, "Boundary");
  assert.equal(await page.inputValue("#cut"), "0");
  await show(page, "Slice");
  // The box of the region cuts sections, too.
  await page.selectOption("#region", "box");
  await settle(page);
  const whole = await still(page, "section-whole");
  await page.check("#inside");
  await settle(page);
  assert.ok(differing(whole, await still(page, "section-inside")) > 0.02, "what is outside of the box is cut away");
  await page.fill("#cut", "900");
  await says(/There is no section: the plane y = .* is outside of the box/);
  assert.ok(!(await page.isChecked("#inside")));
  await page.check("#inside");
  await page.evaluate(() => (location.hash = "#view=volume&region=box&inside=1&box=7,7,7,8,8,8"));
  await says(/Everything is cut away: nothing of the model is in the box/);
  await page.evaluate(() => (location.hash = "#view=volume&transfer=0,0,1,0"));
  await says(/The volume is transparent/);

  assert.ok(await isDisabled("shade"), "shade falls on surfaces");
  assert.match(await page.locator("#shade").getAttribute("aria-description"), /opaque/);
  await show(page, "Mesh");
  assert.ok(!(await isDisabled("shade")) && !(await isDisabled("shrink")));
  await page.selectOption("#shape", "wire");
  assert.ok((await isDisabled("shrink")) && (await isDisabled("edges")), "wires are not shrunk");
  await press(page, "n");
  await press(page, "x");
  assert.ok(await page.locator("[data-export=csv]").isDisabled(), "there is no probe");

  // The ends of the range are on the colour bar.
  const ticks = await page.locator("#legend-ticks span:visible").allInnerTexts();
  const { min, max } = (await demo(page, "info")).fields[0];
  const numbers = ticks.map((words) => Number(words.replaceAll("−", "-")));
  const off = Math.max(Math.abs(Math.min(...numbers) - min), Math.abs(Math.max(...numbers) - max));
  assert.ok(off < 0.002 * (max - min), `${ticks}: ${min} to ${max}`);
  assert.deepEqual(page.complaints, []);
  await page.close();
});

/** The planes that are drawn, when there are so many. @param {"clips" | "slices"} name @param {number} count */
async function planesOf(page, name, count) {
  await page.waitForFunction(([name, count]) => window.tetralodDemo.viewer.state[name]?.length === count, [name, count], { timeout: PATIENCE });
  return page.evaluate((name) => window.tetralodDemo.viewer.state[name].map(({ normal, offset }) => [...normal, offset]), name);
}

test("planes are oblique and several, with numbers and a handle, and a link shows the same", async () => {
  const page = await open(SMALL, undefined, VIEWPORT);
  await reach(page, "complete");
  assert.ok(await page.locator("#handles").isHidden(), "nothing is cut");
  await show(page, "Boundary");
  const across = await still(page, "planes-across");
  await page.fill("#normal-x", "1");
  await page.fill("#position", "0.6");
  const [[x, y, z, offset]] = await planesOf(page, "clips", 1);
  assert.ok(x === y && z === 0 && Math.abs(x + Math.SQRT1_2) < 1e-12 && Math.abs(offset + 0.6) < 1e-9, `${[x, y, z, offset]}`);
  assert.equal(await page.locator("#axis option:checked").innerText(), "oblique");
  const oblique = await still(page, "planes-oblique");
  assert.ok(differing(across, oblique) > 0.05, "another part is cut away");
  await page.click("#add-plane");
  const corner = await still(page, "planes-two");
  assert.ok(differing(oblique, corner) > 0.02, "both cut");

  // The arrow is dragged along, and stays under the pointer; that is one step.
  await addressed(page, /planes=/);
  const before = page.url();
  const arrow = page.locator("#handles .arrow");
  const middle = async () => {
    const { x, y, width, height } = await arrow.boundingBox();
    return [x + width / 2, y + height / 2];
  };
  const [from, foot] = [await middle(), await page.locator("#handles .ball").boundingBox()];
  const way = [from[0] - foot.x - foot.width / 2, from[1] - foot.y - foot.height / 2];
  const to = from.map((at, i) => at + way[i] / 3);
  await page.mouse.move(from[0], from[1]);
  await page.mouse.down();
  await page.mouse.move(to[0], to[1], { steps: 5 });
  const off = (await middle()).map((at, i) => at - to[i]);
  assert.ok(Math.hypot(...off) < 6, `the arrow is ${off} from the pointer`);
  await page.mouse.up();
  const moved = await planesOf(page, "clips", 2);
  assert.ok(moved[1][3] !== -0.5 && moved[0][3] === offset, "the chosen one has moved");
  await page.waitForFunction((url) => location.href !== url, before, { timeout: PATIENCE });
  await page.keyboard.press("Control+z");
  await page.waitForFunction((url) => location.href === url, before, { timeout: PATIENCE });

  // The ball tilts it, by keys, too; the plane that faces the eye has a normal of its own.
  await page.locator("#handles .ball").focus();
  await page.keyboard.press("ArrowRight");
  const tilted = await planesOf(page, "clips", 2);
  assert.ok(Math.abs(Math.hypot(...tilted[1].slice(0, 3)) - 1) < 1e-12 && tilted[1][0] > -0.999, `${tilted[1]}`);
  await screenshot(page, "page-planes");
  await page.selectOption("#axis", "view");
  const facing = (await planesOf(page, "clips", 2))[1];
  const [, , towards] = await page.evaluate(() => window.tetralodDemo.viewer.overlay.rotation);
  assert.ok(
    towards.every((part, i) => Math.abs(part - facing[i]) < 2e-3),
    "what is near is hidden",
  );

  await addressed(page, /normal=1,1,0&planes=-0\.45\d,.*&plane=2/);
  const [address, shown] = [page.url(), await still(page, "planes-facing")];
  await page.reload();
  await reach(page, "complete");
  assert.equal(differing(shown, await still(page, "planes-reloaded")), 0, "a link shows the same");
  assert.equal(page.url(), address);
  assert.deepEqual((await planesOf(page, "clips", 2))[1], facing);

  // As sections they have places of their own; the mesh leaves out whole cells at the first.
  await show(page, "Slice");
  await planesOf(page, "slices", 2);
  await settle(page);
  assert.ok((await demo(page, "frame")).triangles > 0);
  await screenshot(page, "page-planes-slice");
  await show(page, "Mesh");
  await planesOf(page, "clips", 1);
  assert.deepEqual(await page.evaluate(() => window.tetralodDemo.viewer.state.cells.cut.offset), offset);
  await page.click("#remove-plane");
  await planesOf(page, "clips", 0);

  // One that leaves nothing says so, whichever is chosen.
  await page.evaluate(() => (location.hash = "#view=solid&cut=400&planes=1,0,0,1,1000,500"));
  await page.locator("#empty").waitFor({ timeout: PATIENCE });
  assert.match(await page.innerText("#empty"), /Everything is cut away: the model lies between x = 0 and 1/);
  await page.click("#empty-act");
  await page.locator("#empty").waitFor({ state: "hidden", timeout: PATIENCE });
  assert.equal((await planesOf(page, "clips", 2))[1][3], -0.5);
  await page.evaluate(() => (location.hash = "#view=solid&cut=600&planes=0,1,0,0,400,500"));
  await page.locator("#empty").waitFor({ timeout: PATIENCE });
  assert.match(await page.innerText("#empty"), /together the planes leave nothing/);
  await page.click("#empty-act");
  await page.locator("#empty").waitFor({ state: "hidden", timeout: PATIENCE });
  await planesOf(page, "clips", 1);
  assert.deepEqual(page.complaints, []);
  await page.close();
});

test("the handle of a plane is dragged with a finger", async () => {
  const page = await open(SMALL, undefined, PHONE);
  await reach(page, "complete");
  await show(page, "Boundary");
  await page.locator("#handles .arrow").waitFor({ timeout: PATIENCE });
  await settle(page);
  const [before, camera] = [await planesOf(page, "clips", 1), await page.evaluate(() => window.tetralodDemo.viewer.state.camera)];
  const touch = await page.context().newCDPSession(page);
  for (const name of ["arrow", "ball"]) {
    const { x, y, width, height } = await page.locator(`#handles .${name}`).boundingBox();
    const at = (part) => [{ x: x + width / 2 + 25 * part, y: y + height / 2 + 15 * part }];
    await touch.send("Input.dispatchTouchEvent", { type: "touchStart", touchPoints: at(0) });
    for (const part of [0.5, 1]) await touch.send("Input.dispatchTouchEvent", { type: "touchMove", touchPoints: at(part) });
    await touch.send("Input.dispatchTouchEvent", { type: "touchEnd", touchPoints: [] });
    await page.waitForFunction(
      ([name, before]) => {
        const { normal, offset } = window.tetralodDemo.viewer.state.clips[0];
        return name === "arrow" ? offset !== before[3] : normal[1] !== before[1];
      },
      [name, before[0]],
      { timeout: PATIENCE },
    );
  }
  assert.deepEqual(await page.evaluate(() => window.tetralodDemo.viewer.state.camera), camera, "the camera stays");
  await page.locator("#position").scrollIntoViewIfNeeded();
  const panel = await page.locator("#panel").evaluate(({ scrollWidth, clientWidth }) => scrollWidth - clientWidth);
  assert.ok(panel <= 1, "the settings fit");
  await screenshot(page, "page-phone-planes");
  assert.deepEqual(page.complaints, []);
  await page.close();
});

/** The box of what can be shown beside the view. */
const also = (page, name) => page.locator(`[name=also][value=${name}]`);

test("any views are shown together, and what is beside the view stays when its settings are turned to", async () => {
  const page = await open(SMALL, undefined, VIEWPORT);
  await reach(page, "complete");
  await setSlider(page, "error", 70);
  const scene = () =>
    page.evaluate(() =>
      Object.entries(window.tetralodDemo.viewer.state)
        .filter(([, part]) => (Array.isArray(part) ? part.length > 0 : true))
        .map(([name]) => name),
    );
  const parts = ["isosurfaces", "volume", "slices", "boundary", "cells", "streamlines"];
  const has = async (...names) => {
    const found = async () => (await scene()).filter((part) => parts.includes(part)).sort();
    // The viewer gets a scene some time after a control was changed.
    for (const until = Date.now() + PATIENCE; String(await found()) !== String([...names].sort()) && Date.now() < until; ) await page.waitForTimeout(50);
    assert.deepEqual(await found(), [...names].sort());
  };
  await has("isosurfaces");
  const alone = await still(page, "together-surface");
  assert.ok(await also(page, "iso").isHidden(), "the view itself needs no box");
  assert.ok(await also(page, "flow").isDisabled(), "there are no vectors");
  await also(page, "slice").check();
  await press(page, "Shift+1");
  await has("isosurfaces", "slices", "boundary");
  await addressed(page, /also=solid,slice/);
  const together = await still(page, "together-three");
  assert.ok(differing(alone, together) > 0.05, "there is more to see");
  await screenshot(page, "page-together");

  // To the settings of the slice: the surface stays beside it, and each has an opacity of its own.
  await show(page, "Slice");
  await has("isosurfaces", "slices", "boundary");
  assert.ok(await also(page, "iso").isChecked());
  assert.equal(differing(together, await still(page, "together-turned")), 0, "the picture stays");
  await page.fill("#opacity", "40");
  await addressed(page, /view=slice&also=solid,iso&opacity=40/);
  const opacities = () =>
    page.evaluate(() => [window.tetralodDemo.viewer.state.isosurfaces[0], window.tetralodDemo.viewer.state.slices[0]].map(({ opacity }) => opacity));
  assert.deepEqual(await opacities(), [1, 0.4]);
  // What is not shown beside the view takes its place.
  await show(page, "Mesh");
  await has("isosurfaces", "boundary", "cells");
  await page.selectOption("#shape", "points");
  assert.equal(await page.evaluate(() => window.tetralodDemo.viewer.state.cells.shape), "points");
  await show(page, "Isosurface");
  await has("isosurfaces", "boundary", "cells");
  assert.ok(await also(page, "points").isChecked(), "the points stay, too");
  await also(page, "wires").check();
  assert.ok(!(await also(page, "points").isChecked()), "a mesh is drawn in one way");
  await has("isosurfaces", "boundary", "cells");

  await addressed(page, /also=solid,wires/);
  const [address, before] = [page.url(), await still(page, "together-before")];
  await page.reload();
  await reach(page, "complete");
  assert.equal(differing(before, await still(page, "together-reloaded")), 0, "a link shows the same");
  assert.equal(page.url(), address);
  await press(page, "Shift+5");
  await has("isosurfaces", "boundary");
  await addressed(page, /also=solid(&|$)/);
  await press(page, "Control+z");
  await has("isosurfaces", "boundary", "cells");
  await page.click("#reset");
  await has("isosurfaces");
  assert.deepEqual(page.complaints, []);
  await page.close();
});

test("parts are hidden, shown alone and coloured, and a link shows the same", async () => {
  const page = await open("data/turbine.mt", undefined, VIEWPORT);
  await reach(page, "complete");
  const boxes = page.locator("#region-list [type=checkbox]");
  assert.equal(await boxes.count(), 12);
  const shown = () => page.evaluate(() => window.tetralodDemo.viewer.state.regions ?? "all");
  const has = async (wanted) => {
    for (const until = Date.now() + PATIENCE; String(await shown()) !== String(wanted) && Date.now() < until; ) await page.waitForTimeout(50);
    assert.deepEqual(await shown(), wanted);
  };
  const whole = await still(page, "parts-all");
  await boxes.nth(11).focus();
  await page.keyboard.press("Space");
  await has(["1", "2", "3", "4", "5", "6", "7", "8", "9", "10", "11"]);
  await addressed(page, /hidden=11(&|$)/);
  await page.getByRole("button", { name: "only 2" }).click();
  await has(["2"]);
  await settle(page);
  const hub = await still(page, "parts-hub");
  assert.ok(differing(whole, hub) > 0.05, "the others are gone");
  const mesh = await page.evaluate(async () => {
    const { tets, neighbors, positions } = await window.tetralodDemo.viewer.mesh();
    const inRange = (array, count) => array.every((x) => x < count || x === 0xffffffff);
    return {
      count: tets.length / 4,
      all: window.tetralodDemo.step.tetrahedra,
      fits: tets.every((v) => v < positions.length / 3) && inRange(neighbors, tets.length / 4),
    };
  });
  assert.ok(mesh.fits && mesh.count > 0 && mesh.count < mesh.all, "the mesh is that of the part");
  await page.click("#other-regions");
  await has(["1", "3", "4", "5", "6", "7", "8", "9", "10", "11", "12"]);
  await page.click("#other-regions");
  await has(["2"]);
  await addressed(page, /hidden=0,2-11(&|$)/);
  await page.getByRole("checkbox", { name: "2", exact: true }).uncheck();
  await has([]);
  await page.getByRole("button", { name: "Show all parts" }).click();
  await has("all");
  await page.selectOption("#boundary-colour", "region");
  await page.getByRole("button", { name: "only 5" }).click();
  await has(["5"]);
  await settle(page);
  assert.ok(await page.locator("#legend").isHidden(), "the colours mean no values");
  await screenshot(page, "page-parts");
  const [address, coloured] = [page.url(), await still(page, "parts-coloured")];
  await page.reload();
  await reach(page, "complete");
  await has(["5"]);
  assert.equal(differing(coloured, await still(page, "parts-reloaded")), 0, "a link shows the same");
  assert.equal(page.url(), address);
  // By a label, too, and by both.
  await page.evaluate(() => window.tetralodDemo.viewer.set({ regions: [2, "3"] }));
  assert.equal(await page.evaluate(() => window.tetralodDemo.viewer.set({ regions: [13] }).catch(({ code }) => code)), "bad-option");
  // What a probe is in is hidden, and shown alone. The hub is in the middle.
  await page.getByRole("button", { name: "only 2" }).click();
  await has(["2"]);
  await settle(page);
  // On its top: its wall is an interface, where other parts are as near.
  const canvas = await page.locator("#canvas").boundingBox();
  await page.mouse.click(canvas.x + 0.6175 * canvas.width, canvas.y + 0.2717 * canvas.height);
  await page.locator(".card").waitFor({ timeout: PATIENCE });
  assert.match(await page.innerText(".card"), /part\s+2/);
  await page.click("#all-regions");
  await has("all");
  await page.getByRole("button", { name: "Hide this part: 2" }).click();
  await has(["1", "3", "4", "5", "6", "7", "8", "9", "10", "11", "12"]);
  await page.getByRole("button", { name: "Show it alone: 2" }).click();
  await has(["2"]);
  // Another volume has no such parts.
  await page.evaluate(() => void (location.search = "?url=data/bucky-small.mt"));
  await reach(page, "complete");
  assert.ok(await page.locator("#regions").isHidden());
  assert.deepEqual(page.complaints, []);
  await page.close();
});

test("one sees through a part to those behind it, and each is measured and refined", async () => {
  const page = await open("data/turbine.mt", undefined, VIEWPORT);
  await reach(page, "complete");
  const state = () => page.evaluate(() => window.tetralodDemo.viewer.state);
  await show(page, "Boundary");
  await page.click("#all-regions");
  await page.selectOption("#boundary-colour", "region");
  await settle(page);
  const opaque = await still(page, "sheer-none");
  await page.getByRole("button", { name: "Opacities" }).click();
  for (const name of ["11", "12"]) await page.getByRole("slider", { name: `opacity of ${name}`, exact: true }).fill("20");
  await addressed(page, /part-opacities=10-11%3A20/);
  await settle(page);
  assert.deepEqual((await state()).boundary.regionOpacities, { 11: 0.2, 12: 0.2 });
  const sheer = await still(page, "sheer-casing");
  assert.ok(differing(opaque, sheer) > 0.05, "one sees through the casing");
  await screenshot(page, "page-sheer");
  const address = page.url();
  await page.reload();
  await reach(page, "complete");
  await settle(page);
  assert.equal(differing(sheer, await still(page, "sheer-reloaded")), 0, "a link shows the same");
  assert.equal(page.url(), address);

  await page.selectOption("#region", "part");
  await page.selectOption("#part", "2");
  assert.deepEqual((await demo(page, "request")).regions, ["2"]);
  await settle(page);
  await press(page, "n");
  await measures(page);
  const rows = await page.locator("#part-stats tbody tr").evaluateAll((rows) => rows.map((row) => [...row.children].map((cell) => cell.textContent)));
  const { regions } = await demo(page, "info");
  assert.equal(rows.length, regions.all.length);
  for (const [i, [name, tetrahedra, volume]] of rows.entries()) {
    assert.equal(name, regions.all[i].name);
    assert.ok(numberOf(volume) > 0 && numberOf(tetrahedra) <= regions.all[i].tetrahedra, `${tetrahedra} ${volume}`);
  }
  // Parts that are not refined are much smaller or larger than in the input; together they are the mesh.
  assert.ok(isNear(numberOf(rows[1][2]), regions.all[1].volume, 0.01), rows[1][2]);
  const [count, whole] = await page.evaluate(async () => {
    const { positions, tets } = await window.tetralodDemo.viewer.mesh();
    const from = (a, b) => [0, 1, 2].map((k) => positions[3 * b + k] - positions[3 * a + k]);
    const sixfold = (a, b, c, d) => {
      const [u, v, w] = [from(a, b), from(a, c), from(a, d)];
      return Math.abs([0, 1, 2].reduce((sum, k) => sum + u[k] * (v[(k + 1) % 3] * w[(k + 2) % 3] - v[(k + 2) % 3] * w[(k + 1) % 3]), 0));
    };
    let volume = 0;
    for (let t = 0; t < tets.length; t += 4) volume += sixfold(...tets.subarray(t, t + 4)) / 6;
    return [tets.length / 4, volume];
  });
  const total = (column) => rows.reduce((sum, row) => sum + numberOf(row[column]), 0);
  assert.equal(total(1), count);
  assert.ok(isNear(total(2), whole), `${total(2)} ${whole}`);
  const errors = rows.map((row) => numberOf(row[7].replace(/e.*/, "")));
  assert.ok(errors[1] < errors[10], "the hub alone is refined");
  await screenshot(page, "page-part-stats");
  assert.deepEqual(page.complaints, []);
  await page.close();
});

test("cells of a range, bands and extremes are shown, and a link shows the same", async () => {
  const page = await open("data/bucky.mt", undefined, VIEWPORT);
  await reach(page, "complete");
  await show(page, "Boundary");
  await settle(page);
  const whole = await still(page, "threshold-none");
  await page.check("#thresholded");
  await settle(page);
  const { min, max } = (await demo(page, "info")).fields[0];
  const state = () => page.evaluate(() => window.tetralodDemo.viewer.state);
  assert.deepEqual((await state()).threshold, { field: "density", range: [Number((min + (max - min) / 2).toPrecision(5)), max] });
  assert.ok(differing(whole, await still(page, "threshold-half")) > 0.05, "cells below the range are gone");
  await page.fill("#threshold-low", "0.3");
  await addressed(page, /threshold=0.3,/);
  assert.deepEqual((await demo(page, "request")).ranges, [[0.3, max]]);
  await settle(page);
  const within = await page.evaluate(async () => {
    const { tets, field, offset, scale } = await window.tetralodDemo.viewer.mesh();
    const shown = tets.filter((v) => v !== 0xffffffff);
    const { volume } = await window.tetralodDemo.viewer.stats();
    return { count: shown.length, volume, least: shown.reduce((least, v) => Math.min(least, offset + scale * field[v]), Infinity) };
  });
  assert.ok(within.count > 0 && within.least >= 0.3 - 1e-6, JSON.stringify(within));

  await page.selectOption("#bands", "5");
  await settle(page);
  assert.equal((await state()).colours.bands, 5);
  const colours = await page.evaluate(() => window.tetralodDemo.viewer.legend.colours);
  assert.equal(new Set(colours).size, 5);
  assert.equal(await page.locator("#legend-ticks span").count(), 6);
  const banded = await still(page, "threshold-bands");

  await page.locator("#canvas").focus();
  await press(page, "m");
  await page.locator("#overlay .extremes path").nth(1).waitFor({ timeout: PATIENCE });
  const words = await page.locator("#overlay .extremes text").allTextContents();
  assert.match(words.join("; "), /^min of all .*; max of all 1\.\d+$/);
  assert.equal(await page.locator("#legend-marks span").count(), 2);
  await screenshot(page, "page-inspect");

  await addressed(page, /extremes=1/);
  const address = page.url();
  await page.reload();
  await reach(page, "complete");
  await settle(page);
  assert.equal(differing(banded, await still(page, "threshold-reloaded")), 0, "a link shows the same");
  assert.equal(page.url(), address);
  assert.equal(await page.locator("#overlay .extremes path").count(), 2);

  // Cells are cut: what is left has all values of the range, and no others.
  await page.locator("#canvas").focus();
  await press(page, "c");
  await addressed(page, /threshold-cut=1/);
  await settle(page);
  assert.ok(await page.isChecked("#threshold-cut"));
  assert.deepEqual((await state()).threshold, { field: "density", range: [0.3, max], cut: true });
  const cut = await page.evaluate(async () => {
    const { viewer } = window.tetralodDemo;
    const { tets, field, offset, scale } = await viewer.mesh();
    const least = tets.reduce((least, v) => Math.min(least, offset + scale * field[v]), Infinity);
    return { count: tets.length, least, volume: (await viewer.stats()).volume };
  });
  assert.ok(cut.count > within.count && Math.abs(cut.least - 0.3) < 1e-6, JSON.stringify(cut));
  assert.ok(cut.volume > within.volume, "cells at the ends count in part");
  assert.ok(differing(banded, await still(page, "threshold-cut")) > 0.005);
  await screenshot(page, "page-threshold-cut");
  await page.uncheck("#threshold-cut");
  await addressed(page, /#(?!.*threshold-cut)/);

  // No cell has such values.
  await page.fill("#threshold-high", "0.1");
  assert.ok(!(await page.locator("#threshold-high").evaluate((input) => input.validity.valid)));
  await page.evaluate(() => (location.hash = "#view=solid&threshold=1.2,1.21"));
  await page.locator("#empty").waitFor({ timeout: PATIENCE });
  assert.match(await page.innerText("#empty"), /No cell has all values of density from 1.2/);
  await page.click("#empty-act");
  await page.locator("#empty").waitFor({ state: "hidden", timeout: PATIENCE });
  assert.ok(!(await page.isChecked("#thresholded")));
  assert.deepEqual(page.complaints, []);
  await page.close();
});

test("a handle of the region is dragged, and the mesh follows", async () => {
  const page = await open("data/bucky.mt", undefined, VIEWPORT);
  await reach(page, "complete");
  await setSlider(page, "error", 40);
  await page.evaluate(() => (window.tetralodDemo.stats = undefined));
  await page.selectOption("#region", "box");
  await page.waitForFunction(() => window.tetralodDemo.stats, undefined, { timeout: PATIENCE });
  await settle(page);
  const [before, box] = [await demo(page, "stats"), (await demo(page, "request")).box];
  // Where the handle in the middle of the face of largest x is on the screen.
  const [x, y] = await page.evaluate(([x0, y0, z0, x1, y1, z1]) => {
    const { matrix } = window.tetralodDemo.viewer.overlay;
    const point = [x1, (y0 + y1) / 2, (z0 + z1) / 2, 1];
    const [cx, cy, , cw] = [0, 1, 2, 3].map((i) => point.reduce((sum, value, k) => sum + value * matrix[4 * k + i], 0));
    const { left, top, width, height } = document.querySelector("#canvas").getBoundingClientRect();
    return [left + ((cx / cw + 1) / 2) * width, top + ((1 - cy / cw) / 2) * height];
  }, box);
  await page.mouse.move(x, y);
  await page.waitForFunction(() => document.querySelector("#canvas").classList.contains("on-handle"), undefined, { timeout: PATIENCE });
  const camera = await page.evaluate(() => window.tetralodDemo.viewer.state.camera);
  await page.mouse.down();
  // The page asks the viewer what was pressed.
  await settle(page);
  // A viewer that answers late, so that the state rests between its answers: the drag is one step to undo all the same.
  await page.evaluate(() => {
    const { viewer } = window.tetralodDemo;
    const answers = [];
    const drag = viewer.dragRegion.bind(viewer);
    viewer.dragRegion = (...where) => {
      const wait = 500 * (answers.length + 1);
      const answer = drag(...where).then((box) => new Promise((resolve) => setTimeout(resolve, wait, box)));
      answers.push(answer);
      return answer;
    };
    /** @type {any} */ (window).answered = () => Promise.all(answers);
  });
  await page.mouse.move(x - 40, y - 8, { steps: 6 });
  await page.mouse.up();
  await page.evaluate(() => /** @type {any} */ (window).answered());
  await page.waitForFunction((x1) => window.tetralodDemo.request.box[3] < x1 - 0.02, box[3], { timeout: PATIENCE });
  await settle(page);
  const moved = (await demo(page, "request")).box;
  assert.deepEqual(moved.toSpliced(3, 1), box.toSpliced(3, 1), "only this face");
  assert.equal(Number(await page.inputValue("#box [data-i='3']")), Number(moved[3].toPrecision(5)));
  assert.ok((await demo(page, "stats")).tetrahedra < before.tetrahedra, "a smaller box needs fewer tetrahedra");
  assert.deepEqual(await page.evaluate(() => window.tetralodDemo.viewer.state.camera), camera, "the camera stays");
  await screenshot(page, "page-dragged");
  await page.keyboard.press("Control+z");
  await page.waitForFunction((x1) => window.tetralodDemo.request.box[3] === x1, box[3], { timeout: PATIENCE });
  await page.check("#inside");
  await addressed(page, /inside=1/);
  assert.deepEqual(await page.evaluate(() => window.tetralodDemo.viewer.state.clipBox), box);
  const inside = await picture(page, "region-inside");
  await page.uncheck("#inside");
  assert.ok(differing(inside, await picture(page, "region-outside")) > 0.02, "what is outside was cut away");
  assert.deepEqual(page.complaints, []);
  await page.close();
});

test("the data view shows where the blocks are, and the memory of the GPU", async () => {
  const page = await open("data/bucky.mt", undefined, VIEWPORT);
  await reach(page, "complete");
  await press(page, "n");
  const counts = () =>
    page.evaluate(() => [...document.querySelectorAll("#blocks-counts b")].map(({ textContent }) => Number(textContent.replaceAll(",", ""))));
  await page.locator("#blocks-canvas").waitFor({ timeout: PATIENCE });
  await settle(page);
  const map = await page.evaluate(async () => {
    const { viewer, info } = window.tetralodDemo;
    const { bounds, states } = await viewer.blockMap();
    const isInside = bounds.every((value, i) => value >= info.bounds[i % 3] && value <= info.bounds[3 + (i % 3)]);
    const isBox = bounds.every((value, i) => i % 6 > 2 || value < bounds[i + 3]);
    return { count: states.length, boxes: bounds.length / 6, isInside, isBox, states: [...new Set(states)].sort() };
  });
  const { all } = await demo(page, "blocks");
  assert.deepEqual([map.count, map.boxes, map.isInside, map.isBox], [all, all, true, true]);
  assert.ok(map.states.includes(0) && map.states.includes(2));
  const [inUse, fetched, missing] = await counts();
  assert.ok(inUse > 0 && missing > 0 && inUse + fetched + missing === all, `${[inUse, fetched, missing]} of ${all}`);
  // The map is drawn, and turns with the picture.
  const drawn = () => page.evaluate(() => /** @type {HTMLCanvasElement} */ (document.querySelector("#blocks-canvas")).toDataURL());
  const first = await drawn();
  await page.evaluate(() => window.tetralodDemo.viewer.orbit(0.5, 0));
  await settle(page);
  assert.notEqual(await drawn(), first);
  await page.locator("#blocks-canvas").scrollIntoViewIfNeeded();
  await screenshot(page, "page-blocks");
  await page.evaluate(() => window.tetralodDemo.viewer.refine({ error: "0.03%" }).then(() => window.tetralodDemo.viewer.settled()));
  await page.waitForFunction((missing) => Number(document.querySelector("#blocks-counts .missing b").textContent) < missing, missing, { timeout: PATIENCE });

  const row = () =>
    page.evaluate(
      () => [...document.querySelectorAll("#traffic dt")].find(({ textContent }) => textContent === "Memory on the GPU")?.nextElementSibling.textContent,
    );
  assert.match(await row(), /^[\d.]+ [kMG]B$/);
  const { gpuBytes: surface } = await demo(page, "frame");
  await press(page, "5");
  await page.waitForFunction((before) => window.tetralodDemo.frame.gpuBytes > before, surface, { timeout: PATIENCE });
  const pixels = await page.locator("#canvas").evaluate(({ clientWidth, clientHeight }) => clientWidth * clientHeight);
  // Four samples and their depths alone are 32 bytes a pixel.
  assert.ok(surface > 32 * pixels, `${surface} bytes for ${pixels} pixels`);
  assert.deepEqual(page.complaints, []);
  await page.close();
});

test("a volume that is being made is named, and can be opened once it is there", async () => {
  let asked = 0;
  const prepare = (page) =>
    page.route("**/data/volumes.json", async (route) => {
      const list = await (await route.fetch()).json();
      const [{ title }, ...others] = list.volumes;
      // It is there the second time; what is not shown in the gallery is not named.
      const pending = [
        { title, isShown: true },
        { title: "Hidden", isShown: false },
      ];
      await route.fulfill({ json: asked++ === 0 ? { volumes: others, pending } : list });
    });
  const page = await open(SMALL, prepare, VIEWPORT);
  await reach(page, "complete");
  const first = await page.evaluate(async () => (await (await fetch("data/volumes.json?")).json()).volumes[0]);
  const listed = () => page.locator("#volume option").allInnerTexts();
  assert.ok(!(await listed()).includes(first.title));
  assert.match(await page.locator("#gallery-pending").textContent(), new RegExp(`: ${first.title}\\.$`));
  // The page looks for a new list when it gets the focus.
  await page.evaluate(() => window.dispatchEvent(new Event("focus")));
  await page.locator("#note", { hasText: `${first.title} is ready` }).waitFor();
  assert.ok((await listed()).includes(first.title));
  assert.notEqual(await page.locator("#gallery-pending").getAttribute("hidden"), null);
  await page.locator("#note").getByText("Open").click();
  await page.waitForFunction((url) => new URLSearchParams(location.search).get("url") === url || location.href.includes(url), first.url);
  await reach(page, "complete");
  assert.equal(await page.locator("#volume").inputValue(), first.url);
  assert.deepEqual(page.complaints, []);
  await page.close();
});

test("the page follows a list that changes: how far a build is, its volume, a file that has changed, and one that cannot be built", async () => {
  // As `tetralod view` gives it.
  const listed = (await fetch(new URL("data/volumes.json", address())).then((answer) => answer.json())).volumes.find(({ url }) => url === SMALL);
  const made = { ...listed, title: "part.vtu", sentence: "part.vtu", scene: "", version: "1" };
  const empty = { volumes: [], pending: [], failed: [], look: 100 };
  let list = { ...empty, pending: [{ title: "part.vtu", isShown: true, stage: "remove", done: 1, total: 4 }] };
  const page = await newPage({ viewport: VIEWPORT.viewport });
  page.complaints = [];
  page.on("pageerror", (error) => page.complaints.push(String(error)));
  await page.route("**/data/volumes.json", (route) => route.fulfill({ json: list }));
  await page.goto(`${address()}#view=slice`);
  const told = (words) => page.locator("#growth", { hasText: words }).waitFor({ timeout: PATIENCE });
  await told("Building an MT file of part.vtu: removing vertices, 25 %");
  assert.equal(await page.locator("#progress").evaluate(({ value }) => value), 0.25);
  assert.ok(await page.locator("#gallery").isHidden());
  list = { ...empty, pending: [{ title: "part.vtu", isShown: true, stage: "order", done: 0, total: 0 }] };
  await told("part.vtu: putting updates in order");

  // The volume comes as the address says.
  list = { ...empty, volumes: [made] };
  await reach(page, "complete");
  assert.equal(await page.locator("[name=mode]:checked").getAttribute("value"), "slice");
  assert.deepEqual(await page.locator("#volume option").allInnerTexts(), ["part.vtu"]);
  await setSlider(page, "error", 60);

  // What has changed is shown as it was; a build that goes on beside it is not in the way.
  await page.evaluate(() => (window.tetralodDemo.state = "before"));
  list = { ...empty, volumes: [{ ...made, version: "2" }], pending: [{ title: "part.vtu", isShown: true, stage: "remove", done: 1, total: 4 }] };
  await page.locator("#note", { hasText: "part.vtu has changed, and is shown anew" }).waitFor({ timeout: PATIENCE });
  await reach(page, "complete");
  assert.equal(await page.inputValue("#error"), "60");
  assert.equal(await page.locator("[name=mode]:checked").getAttribute("value"), "slice");

  // What cannot be built leaves what is shown as it is.
  list = { ...empty, volumes: [{ ...made, version: "2" }], failed: [{ title: "part.vtu", message: "part.vtu: cell 3 has no volume" }] };
  await page.locator("#message", { hasText: "cell 3 has no volume" }).waitFor({ timeout: PATIENCE });
  assert.match(await page.locator("#message").innerText(), /No MT file could be built of part.vtu/);
  assert.equal(await demo(page, "state"), "complete");
  await screenshot(page, "page-view");
  assert.deepEqual(page.complaints, []);
  await page.close();
});

test("volumes without pictures get some: drawn ones, then those that the page has taken", async () => {
  const prepare = (page) =>
    page.route("**/data/volumes.json", async (route) => {
      const list = await (await route.fetch()).json();
      for (const volume of list.volumes) Object.assign(volume, { picture: null, isShown: true });
      await route.fulfill({ json: list });
    });
  const page = await open(SMALL, prepare, { viewport: { width: 400, height: 400 } });
  await reach(page, "complete");
  const pictures = async () => {
    await page.click("#open-gallery");
    await page.locator("#gallery li").first().waitFor();
    await page.waitForFunction(() => {
      const images = [...document.querySelectorAll("#gallery img")].filter((image) => image instanceof HTMLImageElement);
      // Those that are not in sight would be loaded later; the list may be made again meanwhile.
      for (const image of images) image.loading = "eager";
      return images.length > 0 && images.every((image) => image.complete);
    });
    return page.evaluate(() =>
      [...document.querySelectorAll("#gallery img")].map((image) => image instanceof HTMLImageElement && [image.src.slice(0, 14), image.naturalWidth]),
    );
  };
  const drawn = await pictures();
  assert.ok(drawn.length > 3 && drawn.every(([, width]) => width > 0), JSON.stringify(drawn));
  await screenshot(page, "page-drawn-pictures");
  await page.keyboard.press("Escape");
  await page.waitForFunction(() => Object.keys(localStorage).some((key) => key.startsWith("tetralod-picture data/bucky-small.mt")), undefined, {
    timeout: PATIENCE,
  });
  const taken = await pictures();
  assert.equal(taken.filter(([start]) => start.startsWith("data:image/web")).length, 1, "of the volume that was shown");
  await screenshot(page, "page-taken-pictures");
  assert.deepEqual(page.complaints, []);
  await page.close();
});

const FLOW = "data/abc-flow.mt";

/** Opens a volume in the place of the one that is there, as the page does with what is typed. */
async function openAnother(page, url, kind) {
  await page.click("#open-gallery");
  await page.fill("#url", url);
  await page.keyboard.press("Enter");
  await page.waitForFunction((kind) => window.tetralodDemo.info?.kind === kind, kind, { timeout: PATIENCE });
  await reach(page, "complete");
}

/** Waits for a note, which hides again after a while. */
const noted = (page, { source }) =>
  page.waitForFunction((source) => new RegExp(source).test(document.getElementById("note").textContent), source, { timeout: PATIENCE });

test("another volume gets what fits it of the settings before, is told what does not, and undo goes back to all of it", async () => {
  const page = await open(FLOW, undefined, VIEWPORT);
  await reach(page, "complete");
  const view = () => page.locator("[name=mode]:checked").getAttribute("value");
  await press(page, "6");
  await addressed(page, /view=flow/);
  await settle(page);
  await page.locator("#canvas").focus();
  await openAnother(page, SMALL, "edge");
  await noted(page, /does not have it: .*view Flow/);
  assert.equal(await view(), "iso");
  assert.ok(await page.locator("#message").isHidden(), await page.locator("#message").innerText());
  assert.equal(await demo(page, "error"), null);
  assertDrawn(await picture(page, "another-volume"));
  assert.deepEqual(await page.evaluate(() => [window.tetralodDemo.viewer.info.kind, "streamlines" in window.tetralodDemo.viewer.state]), ["edge", false]);
  await addressed(page, /^(?!.*flow)/);

  await page.click("#undo");
  await page.waitForFunction(() => window.tetralodDemo.info?.kind === "half-edge", undefined, { timeout: PATIENCE });
  await reach(page, "complete");
  assert.equal(await view(), "flow");
  await page.click("#redo");
  await page.waitForFunction(() => window.tetralodDemo.info?.kind === "edge", undefined, { timeout: PATIENCE });
  await reach(page, "complete");
  assert.equal(await view(), "iso");
  assert.equal(await demo(page, "error"), null);

  // A link that names what is not there is shown as far as it has a meaning.
  await page.evaluate(
    (url) => (location.hash = `#url=${url}&view=flow&surface-colour=T&field=T&isovalue=99&range=500,600&time=5&probes=9,9,9&seeds=9,9,9`),
    FLOW,
  );
  await page.waitForFunction(() => window.tetralodDemo.info?.kind === "half-edge", undefined, { timeout: PATIENCE });
  await reach(page, "complete");
  for (const words of [/field T/, /colours of T/, /isovalue 99 \(pressure is /, /colours of 500 to 600/, /1 probes outside/, /1 seeds outside/])
    await noted(page, words);
  assert.equal(await view(), "flow");
  assert.equal(await demo(page, "error"), null);
  assertDrawn(await picture(page, "link-of-another-volume"));
  assert.deepEqual(page.complaints, []);
  await page.close();
});

test("what means nothing in the address is ignored, and said", async () => {
  const page = await open(SMALL, undefined, VIEWPORT);
  await reach(page, "complete");
  const before = await page.evaluate(() => ["background", "pixels", "map"].map((id) => /** @type {HTMLInputElement} */ (document.getElementById(id)).value));
  await page.evaluate(
    (url) => (location.hash = `#url=${url}&background=x&box=1,1,1,0,0,0&pixels=abc&map=none&nonsense=1&axes=7&camera=1,2&view=iso&refine=none&range=symmetric`),
    SMALL,
  );
  for (const word of ["background=x", "box=1,1,1,0,0,0", "pixels=abc", "map=none", "nonsense=1", "axes=7", "camera=1,2", "refine=none"])
    await noted(page, new RegExp(`means nothing: .*${word}`));
  assert.doesNotMatch(await page.innerText("#note"), /view=|url=|range=/);
  await settle(page);
  assert.deepEqual(
    await page.evaluate(() => ["background", "pixels", "map"].map((id) => /** @type {HTMLInputElement} */ (document.getElementById(id)).value)),
    before,
  );
  assert.deepEqual(page.complaints, []);
  await page.close();
});

test("a surface coloured by a field, with probes, gives way to another volume", async () => {
  const page = await open(FLOW, undefined, VIEWPORT);
  await reach(page, "complete");
  await press(page, "2");
  await page.selectOption("#surface-colour", { index: 2 });
  await settle(page);
  await page.locator("#canvas").focus();
  await page.keyboard.press("p");
  await page.locator(".card").waitFor({ timeout: PATIENCE });
  // By keyboard, what is found is told.
  await page.waitForFunction(() => /^Probe A: pressure [−\d.]+.*; velocity/.test(document.getElementById("status").textContent), undefined, {
    timeout: PATIENCE,
  });
  await openAnother(page, SMALL, "edge");
  await noted(page, /does not have it: .*colours of velocity/);
  assert.equal(await page.locator(".card").count(), 0);
  assert.ok(await page.locator("#message").isHidden());
  assert.equal(await page.inputValue("#surface-colour"), "");
  assertDrawn(await picture(page, "another-surface"));
  assert.deepEqual(page.complaints, []);
  await page.close();
});

test("the colour bar is there again when the same file is opened again", async () => {
  const page = await open(SMALL, undefined, VIEWPORT);
  await reach(page, "complete");
  await press(page, "3");
  await page.locator("#legend").waitFor({ timeout: PATIENCE });
  const words = await page.innerText("#legend");
  await page.evaluate(() => (window.tetralodDemo.stats = undefined));
  await openAnother(page, SMALL, "edge");
  await page.waitForFunction(() => window.tetralodDemo.stats, undefined, { timeout: PATIENCE });
  await page.locator("#legend").waitFor({ timeout: PATIENCE });
  assert.equal(await page.innerText("#legend"), words);
  assert.deepEqual(page.complaints, []);
  await page.close();
});

test("colours and values mean the same at all times", async () => {
  const page = await open(FLOW, undefined, VIEWPORT);
  await reach(page, "complete");
  const [low, high, speed] = await page.evaluate(() => {
    const { fields } = window.tetralodDemo.info;
    const most = (name) => Math.max(...fields.filter((field) => field.name === name).flatMap(({ min, max }) => [Math.abs(min), Math.abs(max)]));
    const pressure = fields.filter(({ name }) => name === "pressure");
    const components = [...new Set(fields.filter(({ vector }) => vector).map(({ name }) => name))];
    return [Math.min(...pressure.map(({ min }) => min)), Math.max(...pressure.map(({ max }) => max)), Math.hypot(...components.map(most))];
  });
  const range = () => page.evaluate(() => window.tetralodDemo.viewer.legend?.range);
  const near = (found, wanted) => found.every((value, i) => Math.abs(value - wanted[i]) <= 1e-4 * (wanted[1] - wanted[0]));
  for (const [key, wanted] of [
    ["3", [low, high]],
    ["6", [0, speed]],
  ]) {
    await press(page, key);
    for (const time of [0, 5]) {
      await setSlider(page, "time", time);
      await settle(page);
      const found = await range();
      assert.ok(near(found, wanted), `key ${key}, time ${time}: ${found}, not ${wanted}`);
    }
  }
  await press(page, "1");
  const words = await page.innerText("#isovalue-text");
  await setSlider(page, "time", 2);
  assert.equal(await page.innerText("#isovalue-text"), words);
  assert.equal(await page.inputValue("#isovalue"), "500");
  assert.deepEqual(page.complaints, []);
  await page.close();
});

test("the value at a probe is shown over time, and only the probe is refined for it", async () => {
  const page = await open(FLOW, undefined, COARSE);
  await reach(page, "complete");
  await setSlider(page, "error", 80);
  await press(page, "4");
  await press(page, "v");
  await page.keyboard.press("p");
  await page.locator(".card .over-time").waitFor({ timeout: PATIENCE });
  const before = await settle(page).then(() => demo(page, "stats"));
  await page.locator(".card .over-time").focus();
  await page.keyboard.press("Enter");
  await page.locator("#plot .mark").first().waitFor({ state: "attached", timeout: PATIENCE });
  assert.equal(await page.evaluate(() => document.activeElement?.className), "over-time");
  assert.match(await page.innerText("#plot-title"), /^pressure over time at A$/);
  assert.equal(await page.inputValue("#over-time"), "1");
  await settle(page);
  const [steps, range] = await page.evaluate(() => {
    const own = window.tetralodDemo.info.fields.filter(({ name }) => name === "pressure");
    return [own.length, Math.max(...own.map(({ max }) => max)) - Math.min(...own.map(({ min }) => min))];
  });
  // A part between each two times.
  const path = await page.locator("#plot path").getAttribute("d");
  assert.equal(path.split(/[ML]/).length - 1, 2 * (steps - 1));
  const { needs, error } = await demo(page, "request");
  assert.equal(needs.length, steps - 1);
  const after = await demo(page, "stats");
  assert.ok(after.tetrahedra < 1.5 * before.tetrahedra + 500, `${before.tetrahedra}, then ${after.tetrahedra} tetrahedra`);
  const values = () =>
    page.evaluate(async () => {
      const { viewer, info, request } = window.tetralodDemo;
      const { all } = await viewer.reading(request.needs[0].box.slice(0, 3));
      return all.filter((_, i) => info.fields[i].name === "pressure");
    });
  const found = await values();
  const rows = await savedRows(page);
  const [time, pressure] = ["time", "pressure"].map((name) => rows[0].indexOf(name));
  const overTime = rows.filter(([what]) => what === "probe A over time");
  assert.deepEqual(
    overTime.map((row) => Number(row[time])),
    Array.from({ length: steps }, (_, i) => i),
  );
  assert.ok(overTime.every((row, i) => Math.abs(Number(row[pressure]) - found[i]) < 1e-5 * range));
  // They are as good as was asked for, at all times.
  await press(page, "g");
  await setSlider(page, "error", 0);
  await settle(page);
  const exact = await values();
  const most = Math.max(...exact.map((value, i) => Math.abs(value - found[i])));
  assert.ok(most > 0 && most <= (2 * Number.parseFloat(error) * range) / 100, `${most} of ${range}, ${error} asked for`);
  // A link has it, and without it there is nothing to plot for one probe.
  assert.match(new URL(page.url()).hash, /over-time=1/);
  await page.selectOption("#over-time", "");
  assert.ok(await page.locator("#plot").isHidden());
  assert.deepEqual(page.complaints, []);
  await page.close();
});

test("the values between probes are shown at all times, and only the way between them is refined", async () => {
  const page = await open(FLOW, undefined, COARSE);
  await reach(page, "complete");
  await setSlider(page, "error", 80);
  const before = await settle(page).then(() => demo(page, "stats"));
  await addressed(page, /error=80/);
  // A link has it. Of one probe alone there is the value over time.
  await page.evaluate(() => (location.hash += "&view=slice&probes=1,1,1,5,1,1&over-time=line"));
  await page.locator("#plot image").waitFor({ state: "attached", timeout: PATIENCE });
  assert.equal(await page.inputValue("#over-time"), "line");
  assert.match(await page.innerText("#plot-title"), /^pressure from A to B, 4 apart, at all times$/);
  await settle(page);
  const steps = await page.evaluate(() => window.tetralodDemo.info.fields.filter(({ name }) => name === "pressure").length);
  const { needs, error } = await demo(page, "request");
  assert.equal(needs.length, steps - 1);
  assert.ok(needs.every(({ orientedBox }) => String(orientedBox.center) === "3,1,1" && String(orientedBox.halfAxes[0]) === "2,0,0"));
  const along = await demo(page, "stats");
  const everywhere = await page.evaluate(
    ([needs, error]) => window.tetralodDemo.viewer.refine({ error, needs: needs.map(({ error, field }) => ({ error, field })) }),
    [needs, error],
  );
  const [more, most] = [along, everywhere].map(({ tetrahedra }) => tetrahedra - before.tetrahedra);
  assert.ok(more < most / 2, `${before.tetrahedra} tetrahedra, and ${more} more; ${most} for all times everywhere`);

  // The mesh of the page's own request again.
  await setSlider(page, "error", 79);
  await settle(page);
  // The picture has a frame around the time that is shown.
  const frame = () => page.locator("#plot .step").getAttribute("y").then(Number);
  const first = await frame();
  await setSlider(page, "time", steps - 1);
  await settle(page);
  assert.ok((await frame()) < first, "later is higher");
  await page.waitForFunction(() => window.tetralodDemo.viewer.legend?.label === "pressure", undefined, { timeout: PATIENCE });
  const colours = await page.evaluate(async () => {
    const image = new Image();
    image.src = document.querySelector("#plot image").getAttribute("href");
    await image.decode();
    const context = new OffscreenCanvas(image.width, image.height).getContext("2d");
    context.drawImage(image, 0, 0);
    const { data } = context.getImageData(0, 0, image.width, image.height);
    const hex = (i) => `#${[...data.subarray(i, i + 3)].map((byte) => byte.toString(16).padStart(2, "0")).join("")}`;
    const found = new Set(Array.from({ length: data.length / 4 }, (_, i) => 4 * i).flatMap((i) => (data[i + 3] === 255 ? hex(i) : [])));
    return { found: found.size, others: [...found].filter((colour) => !window.tetralodDemo.viewer.legend.colours.includes(colour)) };
  });
  assert.ok(colours.found > 10 && colours.others.length === 0, JSON.stringify(colours));

  const rows = await savedRows(page);
  const [x, distance, time, pressure] = ["x", "distance", "time", "pressure"].map((name) => rows[0].indexOf(name));
  const all = rows.filter(([what]) => what === "line over time");
  assert.equal(all.length, 65 * steps);
  assert.ok(all.every((row) => Math.abs(Number(row[x]) - 1 - Number(row[distance])) < 1e-9));
  const ofLast = all.filter((row) => Number(row[time]) === steps - 1);
  // At the time that is shown they are those of the line itself.
  const shown = rows.filter(([what]) => what === "line");
  for (const end of [0, 4]) {
    const [one, other] = [ofLast, shown].map((rows) => Number(rows.find((row) => Math.abs(Number(row[distance]) - end) < 1e-9)[pressure]));
    assert.ok(Math.abs(one - other) < 1e-6, `${one} and ${other} at ${end}`);
  }

  // By keyboard, with a third probe, and back.
  await page.evaluate(() => (location.hash = location.hash.replace("5,1,1", "5,1,1,5,4,1")));
  await page.waitForFunction((count) => window.tetralodDemo.request.needs.length === count, 2 * (steps - 1), { timeout: PATIENCE });
  await page.waitForFunction(() => /7 long, 90° at B, at all times$/.test(document.querySelector("#plot-title").textContent), undefined, { timeout: PATIENCE });
  await page.locator("#over-time").focus();
  await page.keyboard.press("Home");
  await addressed(page, /^(?!.*over-time)/);
  assert.equal((await demo(page, "request")).needs, undefined);
  await page.locator("#plot path").waitFor({ state: "attached", timeout: PATIENCE });
  await press(page, "Control+z");
  await addressed(page, /over-time=line/);
  await page.locator(".card button").first().click();
  await page.locator(".card button").first().click();
  await page.waitForFunction(() => /over time at A$/.test(document.querySelector("#plot-title").textContent), undefined, { timeout: PATIENCE });
  assert.ok(await page.locator("#over-time option[value=line]").evaluate((option) => option.disabled));
  assert.deepEqual(page.complaints, []);
  await page.close();
});

test("distances, the angle, areas and the volume are measured, in the unit that is said", async () => {
  const page = await open(FLOW, undefined, COARSE);
  await reach(page, "complete");
  await setSlider(page, "error", 80);
  await addressed(page, /error=80/);
  await page.evaluate(() => (location.hash += "&view=slice&probes=4,1,1,1,1,1,1,5,1"));
  await page.locator(".card").nth(2).waitFor({ timeout: PATIENCE });
  // As the page writes it: what follows is another step.
  await addressed(page, /^#view=slice&error=80&probes=/);
  await page.fill("#unit", "mm");
  await addressed(page, /unit=mm/);
  const names = () => page.locator("#overlay .name").allTextContents();
  assert.ok(
    (await names()).every((name) => /^[xyz] in mm$/.test(name)),
    String(await names()),
  );
  assert.match(await page.textContent("#overlay .scale-bar"), /^[\d.]+ mm/);
  assert.match(await page.locator(".card").first().innerText(), /position\s+4, 1, 1 mm\s+cell size\s+[\d.]+ mm/);
  assert.match(await page.innerText("#plot-title"), /7 mm long, 90° at B$/);
  await press(page, "n");
  const found = await measures(page);
  assert.deepEqual(
    ["A to B", "B to C", "Angle at B"].map((what) => found[what]),
    ["3 mm", "4 mm", "90°"],
  );
  // The domain is a cube, and the plane is one of its own.
  const [, , low, , , high] = (await demo(page, "info")).bounds;
  const side = high - low;
  for (const [what, wanted, unit] of /** @type {const} */ ([
    ["Area of the section", side ** 2, "mm²"],
    ["Area of the boundary", 6 * side ** 2, "mm²"],
    ["Volume", side ** 3, "mm³"],
  ]))
    assert.ok(isNear(numberOf(found[what]), wanted) && found[what].endsWith(` ${unit}`), `${what}: ${found[what]}, ${wanted}`);
  await page.context().grantPermissions(["clipboard-read", "clipboard-write"]);
  await page.locator("#copy-measures").focus();
  await page.keyboard.press("Enter");
  await page.locator("#note", { hasText: "Measures copied" }).waitFor();
  const rows = (await page.evaluate(() => navigator.clipboard.readText())).trim().split("\n");
  assert.deepEqual([rows[0], rows[1], rows.length], ["what,value,unit", "A to B,3,mm", Object.keys(found).length + 1]);
  await screenshot(page, "page-measures");
  assert.deepEqual((await savedRows(page))[0].slice(0, 5), ["what", "x in mm", "y in mm", "z in mm", "distance in mm"]);

  // A step to undo, and part of a link; of another model nobody knows it.
  await press(page, "Control+z");
  await addressed(page, /^(?!.*unit)/);
  assert.equal(await page.inputValue("#unit"), "");
  await press(page, "n");
  assert.equal((await measures(page))["A to B"], "3");
  await press(page, "Control+Shift+z");
  await addressed(page, /unit=mm/);
  await page.reload();
  await reach(page, "complete");
  assert.equal(await page.inputValue("#unit"), "mm");
  await openAnother(page, SMALL, "edge");
  assert.equal(await page.inputValue("#unit"), "");
  await page.evaluate(() => (location.hash += "&unit=much-too-long-for-one"));
  await noted(page, /means nothing: .*unit=/);
  assert.deepEqual(page.complaints, []);
  await page.close();
});

test("what is measured is that of the parts and cells that are shown", async () => {
  const page = await open("data/turbine.mt", undefined, COARSE);
  await reach(page, "complete");
  const { regions } = await demo(page, "info");
  await press(page, "n");
  const volumes = regions.all.map(({ volume }) => volume);
  const near = async (wanted, part) => {
    const found = await measures(page);
    assert.ok(isNear(numberOf(found.Volume), wanted, part), `${found.Volume}, ${wanted}`);
    return found;
  };
  const whole = await near(
    volumes.reduce((sum, volume) => sum + volume),
    1e-2,
  );
  await page.evaluate(() => (location.hash = "#hidden=0-3,5-11"));
  await settle(page);
  const part = await near(volumes[4], 1e-2);
  assert.ok(numberOf(part["Area of the boundary"]) < numberOf(whole["Area of the boundary"]));
  await page.evaluate(() => {
    const [{ min, max }] = window.tetralodDemo.info.fields;
    location.hash = `#threshold=${(min + max) / 2},${max}`;
  });
  await settle(page);
  const wanted = await page.evaluate(async () => {
    const { tets, positions, field, offset, scale } = await window.tetralodDemo.viewer.mesh();
    let [volume, integral] = [0, 0];
    for (let t = 0; t < tets.length; t += 4) {
      const corners = [...tets.subarray(t, t + 4)];
      if (corners.includes(0xffffffff)) continue;
      const [a, b, c, d] = corners.map((v) => positions.subarray(3 * v, 3 * v + 3));
      const [u, v, w] = [b, c, d].map((p) => [0, 1, 2].map((i) => p[i] - a[i]));
      const own = (u[0] * (v[1] * w[2] - v[2] * w[1]) + u[1] * (v[2] * w[0] - v[0] * w[2]) + u[2] * (v[0] * w[1] - v[1] * w[0])) / 6;
      volume += own;
      integral += (own * corners.reduce((sum, v) => sum + offset + scale * field[v], 0)) / 4;
    }
    return { volume, mean: integral / volume };
  });
  const found = await near(wanted.volume, 2e-5);
  const mean = Object.keys(found).find((name) => name.startsWith("Mean of "));
  assert.ok(isNear(numberOf(found[mean]), wanted.mean), `${found[mean]}, ${wanted.mean}`);
  assert.deepEqual(page.complaints, []);
  await page.close();
});

test("a tetrahedron has the volume, the areas and the mean that it must have", async () => {
  const page = await open(SMALL, undefined, COARSE);
  await reach(page, "complete");
  await drop(page, "tetrahedron.vtk", TETRAHEDRON);
  const dialog = page.locator("dialog.build");
  await dialog.getByRole("button", { name: "Build" }).click();
  await page.waitForFunction(() => window.tetralodDemo.info?.tetrahedra === 1 && window.tetralodDemo.state === "complete", undefined, { timeout: PATIENCE });
  await dialog.getByRole("button", { name: "Close" }).click();
  // The address is written when the page rests.
  await page.waitForFunction(() => location.hash.includes("tetrahedron.mt"), undefined, { timeout: PATIENCE });
  await page.evaluate(() => (location.hash += "&view=iso&isovalue=1"));
  await press(page, "n");
  await settle(page);
  const found = await measures(page);
  // Its field is x + 2 y + 3 z, of which 1 is a triangle.
  for (const [what, wanted] of /** @type {const} */ ([
    ["Volume", 1 / 6],
    ["Area of the boundary", (3 + Math.sqrt(3)) / 2],
    ["Area of the isosurface", Math.sqrt(14) / 12],
    ["Mean of p", 1.5],
  ]))
    assert.ok(isNear(numberOf(found[what]), wanted, 1e-3), `${what}: ${found[what]}, ${wanted}`);
  assert.deepEqual(page.complaints, []);
  await page.close();
});

test("a link to a file of the user asks for it, and shows it as in the link", async () => {
  const page = await open(SMALL, undefined, VIEWPORT);
  await reach(page, "complete");
  const { origin, pathname } = new URL(page.url());
  await page.goto("about:blank");
  await page.goto(`${origin}${pathname}#url=file:mine.mt&view=slice&map=grey`);
  await page.locator("#message").waitFor({ timeout: PATIENCE });
  assert.match(await page.innerText("#message"), /mine\.mt.*Drop it on the page/s);
  assert.ok(await page.locator("#choose-file").isVisible());
  assert.equal(await demo(page, "info"), null, "nothing else is opened");
  await screenshot(page, "page-link-to-file");
  await page.evaluate(async (url) => {
    const dataTransfer = new DataTransfer();
    dataTransfer.items.add(new File([await (await fetch(url)).arrayBuffer()], "mine.mt"));
    window.dispatchEvent(new DragEvent("drop", { dataTransfer, cancelable: true }));
  }, SMALL);
  await page.waitForFunction(() => window.tetralodDemo.info?.kind === "edge", undefined, { timeout: PATIENCE });
  await reach(page, "complete");
  assert.ok(await page.locator("#message").isHidden());
  assert.deepEqual([await page.locator("[name=mode]:checked").getAttribute("value"), await page.inputValue("#map")], ["slice", "grey"]);
  assert.deepEqual(page.complaints, []);
  await page.close();
});

test("on a phone the card of a probe stays in the picture", async () => {
  const page = await open(FLOW, undefined, PHONE);
  await reach(page, "complete");
  await page.locator("label", { hasText: "Boundary" }).first().tap();
  await settle(page);
  const stage = await page.locator("#canvas").boundingBox();
  let cards = 0;
  for (const [x, y] of [
    [0.5, 0.5],
    [0.35, 0.45],
    [0.62, 0.55],
  ]) {
    await page.touchscreen.tap(stage.x + x * stage.width, stage.y + y * stage.height);
    await page.waitForTimeout(700);
    for (const card of await page.locator(".card").all()) {
      const box = await card.boundingBox();
      cards++;
      assert.ok(box.x >= stage.x && box.x + box.width <= stage.x + stage.width, JSON.stringify({ box, stage }));
      assert.ok(box.y >= stage.y && box.y + box.height <= stage.y + stage.height, JSON.stringify({ box, stage }));
    }
  }
  assert.ok(cards > 1, "there are probes");
  assert.ok(await page.locator("#plot").evaluate(({ scrollWidth, clientWidth }) => scrollWidth <= clientWidth), "nothing of the plot is cut");
  await screenshot(page, "page-phone-probe");
  assert.deepEqual(page.complaints, []);
  await page.close();
});

/** Two MTs of one input. */
const [ONE, OTHER] = ["data/sphere-flow.mt", "data/sphere-flow-vertex.mt"];

/** What the page has of the file beside, and of what both viewers show. */
const bothShown = (page) =>
  page.evaluate(() => {
    const { viewer, request, beside } = window.tetralodDemo;
    const of = ({ state, legend, info }) => ({ camera: state.camera, clips: state.clips, isosurfaces: state.isosurfaces, legend, name: info.kind });
    return { here: of(viewer.state ? viewer : {}), there: of(beside.viewer), request, other: beside.request, state: beside.state };
  });

const reachBeside = (page, state) =>
  page
    .waitForFunction((wanted) => window.tetralodDemo.beside?.state === wanted, state, { timeout: PATIENCE })
    .catch(async () => {
      const { viewer, ...beside } = await page.evaluate(() => ({ ...window.tetralodDemo.beside, viewer: undefined }));
      assert.fail(`the file beside is not ${state}: ${JSON.stringify(beside)} ${page.complaints}`);
    });

/** Waits until both viewers are at rest. */
async function settleBoth(page) {
  await settle(page);
  await page.evaluate((patience) => window.tetralodDemo.beside.viewer.settled({ signal: AbortSignal.timeout(patience) }), PATIENCE);
}

for (const renderer of ["webgpu", "webgl"]) {
  test(`two files are beside each other with linked cameras and settings, in ${renderer}`, async () => {
    const page = await newPage(COARSE);
    page.complaints = [];
    page.on("pageerror", (error) => page.complaints.push(String(error)));
    page.on("console", (message) => message.type() === "error" && page.complaints.push(message.text()));
    await page.goto(`${address()}?renderer=${renderer}#url=${ONE}&view=solid&error=60&beside=${OTHER}`);
    await reach(page, "complete");
    await reachBeside(page, "complete");
    await settleBoth(page);
    const names = await page.evaluate(() => [window.tetralodDemo.viewer.renderer, window.tetralodDemo.beside.viewer.renderer]);
    assert.deepEqual(names, [renderer, renderer]);
    assert.match(await page.innerText("#growth"), /^sphere-flow\.mt: [\d,]+ tetrahedra, shown within [\d.]+ %$/);
    assert.match(await page.innerText("#growth-beside"), /^sphere-flow-vertex\.mt: [\d,]+ tetrahedra, shown within [\d.]+ %$/);
    const [left, right] = await Promise.all(["#canvas", "#canvas-beside"].map((id) => page.locator(id).boundingBox()));
    assert.ok(Math.abs(left.width - right.width) < 2 && left.height === right.height && right.x >= left.x + left.width, JSON.stringify([left, right]));

    // The mouse and keys on either one move both.
    const camera = async () => {
      await settleBoth(page);
      const { here, there } = await bothShown(page);
      for (const [name, value] of Object.entries(here.camera)) assert.deepEqual(there.camera[name], value, name);
      return here.camera;
    };
    const first = await camera();
    await page.locator("#canvas-beside").focus();
    await page.keyboard.press("ArrowLeft");
    const second = await camera();
    assert.notEqual(second.yaw, first.yaw);
    await page.mouse.move(left.x + left.width / 2, left.y + left.height / 2);
    await page.mouse.wheel(0, -200);
    const third = await camera();
    assert.ok(third.distance < second.distance);

    // One range of colours, one plane, one error in units of the field.
    await page.fill("#cut", "600");
    await settleBoth(page);
    const { here, there, request, other } = await bothShown(page);
    assert.deepEqual(there.clips, here.clips);
    assert.deepEqual(there.legend.range, here.legend.range);
    const range = await page.evaluate((number) => {
      const { min, max } = window.tetralodDemo.info.fields[number];
      return max - min;
    }, request.field);
    assert.ok(Math.abs(other.error - (Number.parseFloat(request.error) / 100) * range) < 1e-9 * range, `${other.error} of ${range}`);

    // A click in either one reads both.
    for (const [i, box] of [right, left].entries()) {
      await page.mouse.click(box.x + box.width / 2, box.y + box.height / 2);
      await page.locator(".card").nth(i).waitFor({ timeout: PATIENCE });
      const words = await page.locator(".card").nth(i).innerText();
      assert.match(words, /… beside\s+[−\d]/);
    }
    assert.equal(await page.locator("#overlay-beside .pins circle").count(), 2);
    const pins = await page.evaluate(() => location.hash);
    await addressed(page, /probes=/);
    assert.match(await page.evaluate(() => location.hash), /beside=data\/sphere-flow-vertex\.mt/, pins);
    await screenshot(page, `page-beside-${renderer}`);
    await press(page, "Escape");

    // The difference, whose errors add up.
    await page.locator("#difference").check();
    await page.waitForFunction(() => /^difference of/.test(window.tetralodDemo.viewer.legend?.label), undefined, { timeout: PATIENCE });
    await settleBoth(page);
    const found = await page.evaluate(() => {
      const { viewer, stats, beside } = window.tetralodDemo;
      return { range: viewer.legend.range, apart: viewer.legend.apart, bound: stats.fieldBound + beside.stats.fieldBound };
    });
    // Both are of one input.
    assert.ok(found.range[1] <= found.bound * (1 + 1e-6) && found.range[0] === -found.range[1], JSON.stringify(found));
    assert.equal(found.apart, 0);
    assert.match(await page.innerText("#legend-note"), /sphere-flow\.mt − sphere-flow-vertex\.mt\s*right within/);
    assert.ok(await page.locator("#canvas-beside").isHidden());
    await addressed(page, /difference=1/);
    await screenshot(page, `page-beside-difference-${renderer}`);
    await page.locator("#difference").uncheck();
    await page.locator("#canvas-beside").waitFor();
    await page.click("#not-beside");
    await page.waitForFunction(() => window.tetralodDemo.beside === undefined && !/beside/.test(location.hash), undefined, { timeout: PATIENCE });
    assert.ok(await page.isHidden("#stage-beside"));
    assert.deepEqual(page.complaints, []);
    await page.close();
  });
}

test("a file is chosen to be beside by address, by a drop and from the gallery, and what it does not have is said", async () => {
  const page = await open(SMALL, undefined, COARSE);
  await reach(page, "complete");
  await press(page, "b");
  assert.equal(await page.innerText("#gallery-title"), "Compare with…");
  await page.fill("#url", "data/no-such.mt");
  await page.keyboard.press("Enter");
  await reachBeside(page, "failed");
  assert.match(await page.innerText("#growth-beside"), /^no-such\.mt: .*404/);
  assert.equal(await demo(page, "state"), "complete", "the other one stays");
  page.complaints.length = 0;
  await page.route("**/no-such.mt", (route) => route.continue({ url: new URL(SMALL, address()).href }));
  await page.click("#retry-beside");
  await reachBeside(page, "complete");
  assert.ok(await page.isHidden("#retry-beside"));

  await press(page, "b");
  await page.locator("#gallery-list button").first().click();
  await reachBeside(page, "complete");
  assert.match(await page.evaluate(() => location.hash), /beside=data/);
  const other = await page.evaluate(() => ({
    names: window.tetralodDemo.beside.info.fields.map(({ name }) => name),
    own: window.tetralodDemo.info.fields[0].name,
  }));
  if (!other.names.includes(other.own)) assert.match(await page.innerText("#growth-beside"), new RegExp(`does not have ${other.own}`));

  // The same file is the same.
  const bytes = Array.from(await readFile(new URL(`../../www/${SMALL}`, import.meta.url)));
  await page.evaluate((bytes) => {
    const dataTransfer = new DataTransfer();
    dataTransfer.items.add(new File([new Uint8Array(bytes)], "bucky-small.mt"));
    document.getElementById("canvas-beside")?.dispatchEvent(new DragEvent("drop", { dataTransfer, cancelable: true, bubbles: true }));
  }, bytes);
  await page.waitForFunction(() => window.tetralodDemo.beside?.name === "bucky-small.mt", undefined, { timeout: PATIENCE });
  await reachBeside(page, "complete");
  assert.equal(await page.evaluate(() => location.hash.includes("beside=file%3Abucky-small.mt")), true);
  await settleBoth(page);
  const hashes = await page.evaluate(() => Promise.all([window.tetralodDemo.viewer.hash(), window.tetralodDemo.beside.viewer.hash()]));
  assert.equal(hashes[0], hashes[1]);
  await page.locator("#difference").check();
  await page.waitForFunction(() => window.tetralodDemo.viewer.legend?.label === "difference of density", undefined, { timeout: PATIENCE });
  const check = await checker(page);
  for (const colorScheme of /** @type {const} */ (["dark", "light"])) {
    await page.emulateMedia({ colorScheme });
    await check(`the difference, ${colorScheme}`);
  }
  await page.locator("#difference").uncheck();
  await page.locator("#canvas-beside").waitFor();
  for (const colorScheme of /** @type {const} */ (["dark", "light"])) {
    await page.emulateMedia({ colorScheme });
    await check(`two files, ${colorScheme}`);
  }
  // A picture has both.
  const download = page.waitForEvent("download");
  await page.locator("#tab-export").click();
  await page.locator("#shot").click();
  const [, width, height] = /-(\d+)x(\d+)\.png$/.exec((await download).suggestedFilename()) ?? [];
  assert.ok(Number(width) > Number(height), `${width} x ${height}`);
  // The difference and back are two steps, the file is the third one.
  for (const step of ["difference=1", "file%3Abucky-small.mt$", "beside=data"]) {
    await page.click("#undo");
    await addressed(page, new RegExp(step));
  }
  await reachBeside(page, "complete");
  assert.notEqual(await page.evaluate(() => window.tetralodDemo.beside.name), "bucky-small.mt");
  assert.deepEqual(page.complaints, []);
  await page.close();
});

test("two files are looked at with fingers on a phone", async () => {
  const page = await open(SMALL, undefined, PHONE);
  await reach(page, "complete");
  await page.evaluate(() => (location.hash = "#beside=data/bucky-small.mt"));
  await reachBeside(page, "complete");
  await settleBoth(page);
  const box = await page.locator("#canvas-beside").boundingBox();
  assert.ok(box.width > 150 && box.height > 150, JSON.stringify(box));
  await page.touchscreen.tap(box.x + box.width / 2, box.y + box.height / 2);
  await page.locator(".card").waitFor({ timeout: PATIENCE });
  assert.deepEqual(await page.locator(".card dt:visible").allInnerTexts(), ["density", "… beside"]);
  await screenshot(page, "page-beside-phone");
  assert.deepEqual(page.complaints, []);
  await page.close();
});
