// Promise: the page of the extension for VS Code shows MT files and what is built, under its policy, in the colours of the theme; it follows
// changes of the file, and says what is wrong.
import assert from "node:assert/strict";
import { copyFile, mkdir, readFile, writeFile } from "node:fs/promises";
import { createServer } from "node:http";
import { after, before, test } from "node:test";
import { fileURLToPath } from "node:url";
import { launch } from "./browser.js";
import { assertDrawn, differing, study } from "./study.js";
import { start } from "./vscode.js";

const { TETRALOD_FIXTURE: fixture } = process.env;
assert.ok(fixture, "TETRALOD_FIXTURE is not set: run `cargo xtask test e2e`");
const folder = new URL("../../target/vscode/browser/", import.meta.url);
const at = (name) => fileURLToPath(new URL(name, folder));

/** Colours of a theme, as VS Code gives them to pages. */
const THEMES = {
  dark: {
    "--vscode-editor-background": "#1f1f1f",
    "--vscode-editor-foreground": "#cccccc",
    "--vscode-descriptionForeground": "#9d9d9d",
    "--vscode-editorWidget-background": "#202020",
    "--vscode-widget-border": "#313131",
    "--vscode-dropdown-foreground": "#cccccc",
    "--vscode-dropdown-background": "#313131",
    "--vscode-dropdown-border": "#3c3c3c",
    "--vscode-button-foreground": "#ffffff",
    "--vscode-button-background": "#0078d4",
    "--vscode-errorForeground": "#f85149",
    "--vscode-focusBorder": "#0078d4",
  },
  light: {
    "--vscode-editor-background": "#ffffff",
    "--vscode-editor-foreground": "#3b3b3b",
    "--vscode-descriptionForeground": "#3b3b3b",
    "--vscode-editorWidget-background": "#f8f8f8",
    "--vscode-widget-border": "#e5e5e5",
    "--vscode-dropdown-foreground": "#3b3b3b",
    "--vscode-dropdown-background": "#ffffff",
    "--vscode-dropdown-border": "#cecece",
    "--vscode-button-foreground": "#ffffff",
    "--vscode-button-background": "#005fb8",
    "--vscode-errorForeground": "#f85149",
    "--vscode-focusBorder": "#005fb8",
  },
};
const FONT = { "--vscode-font-family": "system-ui, sans-serif", "--vscode-font-size": "13px" };

let browser;
/** @type {Awaited<ReturnType<typeof start>>} */
let editor;
let server;
/** What the server has besides the files of the page: the page itself. */
let html = "";

before(async () => {
  editor = await start(folder);
  await mkdir(at("files"));
  server = createServer(async ({ url = "" }, response) => {
    if (url === "/") return response.writeHead(200, { "content-type": "text/html" }).end(html);
    const content = await readFile(at(`extension${url}`)).catch(() => undefined);
    response.writeHead(content ? 200 : 404, { "content-type": "text/javascript" }).end(content);
  });
  await new Promise((resolve) => server.listen(0, "127.0.0.1", () => resolve(undefined)));
  browser = await launch();
});
after(async () => {
  await browser?.close();
  server?.closeAllConnections();
  server?.close();
});

/** Opens a file in an editor, whose page is in the browser; what the page complains of is in `complaints`. */
async function opened(uri, type, theme) {
  const address = `http://127.0.0.1:${server.address().port}`;
  const shown = await editor.open(uri, type, ({ path }) => address + path.slice(at("extension").length));
  html = shown.webview.html;
  const page = await browser.newPage({ viewport: { width: 1200, height: 700 } });
  const complaints = [];
  page.on("pageerror", (error) => complaints.push(String(error)));
  page.on("console", (message) => message.type() === "error" && !/favicon/.test(message.location().url) && complaints.push(message.text()));
  await page.exposeFunction("tetralodTestSend", shown.send);
  shown.told((message) => void page.evaluate((data) => dispatchEvent(new MessageEvent("message", { data })), message));
  await page.addInitScript(
    ([theme, colours]) => {
      Object.assign(globalThis, { acquireVsCodeApi: () => ({ postMessage: /** @type {any} */ (globalThis).tetralodTestSend }) });
      addEventListener("DOMContentLoaded", () => {
        document.body.className = `vscode-${theme}`;
        for (const [name, colour] of Object.entries(colours)) document.documentElement.style.setProperty(name, colour);
      });
    },
    /** @type {const} */ ([theme, { ...FONT, ...THEMES[theme] }]),
  );
  await page.goto(`${address}/`);
  const close = async () => {
    await page.close();
    shown.close();
  };
  return { ...shown, page, complaints, close };
}

const status = (page) => page.textContent("#status");
/** Waits until the mesh is what was asked for and the picture shows it. */
const settled = async (page) => {
  await page.waitForFunction(() => /tetrahedra/.test(document.querySelector("#status")?.textContent ?? ""));
  await page.evaluate(() => /** @type {any} */ (document.querySelector("tetralod-viewer")).viewer.settled());
};
const picture = async (page, name) => study(page, await page.screenshot({ path: at(`${name}.png`) }));
const here = (name) => editor.Uri.file(at(`files/${name}`));
const camera = (page) => page.evaluate(() => document.querySelector("tetralod-viewer").state.camera);

test("an MT file is shown, by ranges; the menu works, and pictures are saved beside it", async () => {
  const uri = here("blocks.mt");
  await copyFile(`${fixture}/blocks-half-edge.mt`, uri.fsPath);
  const { page, complaints, messages, close } = await opened(uri, "tetralod.mt", "dark");
  await settled(page);
  const first = await picture(page, "dark");
  assertDrawn(first);
  assert.equal(await page.textContent("h1"), "blocks.mt");
  const read = messages.filter(({ type }) => type === "bytes");
  assert.ok(read.length > 1 && read.every(({ error }) => error === undefined), `${read.length} ranges`);

  await page.selectOption("[name=mode]", "slice");
  await settled(page);
  const slice = await picture(page, "slice");
  assertDrawn(slice);
  assert.ok(differing(first, slice) > 0.05 && (await page.isVisible("#legend")));
  await page.selectOption("[name=mode]", "");
  await page.selectOption("[name=detail]", "20%");
  await settled(page);
  assert.match(await status(page), /error at most \d+(\.\d+)? % of the range$/);

  await page.click("[name=save]");
  const place = editor.Uri.joinPath(uri, "..", "blocks.png").toString();
  while (!editor.saved.has(place)) await page.waitForTimeout(20);
  assert.deepEqual(
    [...editor.saved.get(place).subarray(1, 4)],
    [..."PNG"].map((letter) => letter.charCodeAt(0)),
  );
  assert.deepEqual(complaints, []);
  await close();
});

test("what is no MT file is built first; fields are chosen, and all is in the colours of the theme", async () => {
  const { page, complaints, messages, close } = await opened(editor.Uri.file(`${fixture}/fields.vtu`), "tetralod.mesh", "light");
  await settled(page);
  const first = await picture(page, "light");
  assertDrawn(first);
  assert.ok(messages.some(({ text }) => /^Building: \w+, \d+ %$/.test(text ?? "")));
  const colours = await page.evaluate(() =>
    ["body", "h1", "select", "button"].flatMap((name) => {
      const { color, backgroundColor } = getComputedStyle(document.querySelector(name));
      return [color, backgroundColor];
    }),
  );
  const [white, text] = ["rgb(255, 255, 255)", "rgb(59, 59, 59)"];
  assert.deepEqual(colours, [text, white, text, "rgba(0, 0, 0, 0)", text, white, white, "rgb(0, 95, 184)"]);

  await page.selectOption("[name=field]", { index: 1 });
  await settled(page);
  assert.ok(differing(first, await picture(page, "field")) > 0.01);

  await page.evaluate(() => (document.body.className = "vscode-dark"));
  await page.waitForFunction(() => document.querySelector("tetralod-viewer").state.background === "dark");
  assert.deepEqual(complaints, []);
  await close();
});

test("a file that changes is shown anew, from the same place; one that is broken leaves the picture, and says why", async () => {
  const uri = here("changes.mt");
  await copyFile(`${fixture}/small.mt`, uri.fsPath);
  const { page, complaints, close } = await opened(uri, "tetralod.mt", "dark");
  await settled(page);
  await page.evaluate(() => document.querySelector("tetralod-viewer").viewer.orbit(0.7, 0.3));
  await settled(page);
  const [before, place] = [await picture(page, "before"), await camera(page)];

  const load = page.evaluate(() => new Promise((resolve) => document.querySelector("tetralod-viewer").addEventListener("load", resolve, { once: true })));
  await copyFile(`${fixture}/blocks-half-edge.mt`, uri.fsPath);
  await editor.changed.fire(uri);
  await load;
  await settled(page);
  assert.ok(differing(before, await picture(page, "after")) > 0.01);
  assert.ok(place);
  assert.deepEqual(await camera(page), place);

  await writeFile(uri.fsPath, "no volume");
  await editor.changed.fire(uri);
  await page.waitForFunction(() => document.querySelector("tetralod-viewer").status === "failed");
  const said = await page.locator("tetralod-viewer").evaluate((element) => element.shadowRoot.textContent);
  assert.match(said, /changes\.mt/);
  assert.match(await status(page), /before the error/);
  assertDrawn(await picture(page, "broken"));
  assert.deepEqual(complaints, []);
  await close();
});

test("what cannot be built is said in the page until it can be, and then what the reader left out", async () => {
  const uri = here("mended.vtk");
  const head = "# vtk DataFile Version 3.0\n\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 4 double\n";
  await writeFile(uri.fsPath, head);
  const { page, complaints, close } = await opened(uri, "tetralod.mesh", "dark");
  await page.waitForSelector("#status.failed");
  assert.match(await status(page), /mended\.vtk/);
  await picture(page, "failed");

  const cells = "CELLS 2 9\n4 0 1 2 3\n3 0 1 2\nCELL_TYPES 2\n10 5\nPOINT_DATA 4\nSCALARS s double 1\nLOOKUP_TABLE default\n0 1 2 3\n";
  await writeFile(uri.fsPath, `${head}0 0 0 1 0 0 0 1 0 0 0 1\n${cells}`);
  await editor.changed.fire(uri);
  await settled(page);
  assertDrawn(await picture(page, "mended"));
  assert.match(await page.textContent("header"), /left out: 1 triangle$/);
  assert.equal(await page.locator("#status.failed").count(), 0);
  assert.deepEqual(complaints, []);
  await close();
});
