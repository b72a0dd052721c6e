// Promise: the extension for VS Code gives its pages the ranges of MT files that they ask for, whatever their size, builds what is none, reads
// again what has changed, and says what is wrong.
import assert from "node:assert/strict";
import { copyFile, mkdir, open, readdir, readFile, rm, truncate, writeFile } from "node:fs/promises";
import { before, test } from "node:test";
import { fileURLToPath } from "node:url";
import { build } from "../../pkg/build.js";
import { start } from "./vscode.js";

const { TETRALOD: tetralod, TETRALOD_FIXTURE: fixture } = process.env;
assert.ok(tetralod && fixture, "TETRALOD and TETRALOD_FIXTURE are not set: run `cargo xtask test js`");
const folder = new URL("../../target/vscode/node/", import.meta.url);
const at = (name) => fileURLToPath(new URL(name, folder));

/** @type {Awaited<ReturnType<typeof start>>} */
let editor;
before(async () => {
  editor = await start(folder);
  await mkdir(at("files"));
  // What is made for a time is made there.
  await mkdir(at("temporary"));
  process.env.TMPDIR = at("temporary");
});

const here = (name) => editor.Uri.file(at(`files/${name}`));
const isOpened = ({ type }) => type === "opened";
const isFailed = ({ type }) => type === "failed";
let count = 0;

/** What a page gets that asks for a range. */
async function range({ send, message }, { version }, begin, end) {
  const id = ++count;
  send({ type: "read", id, version, start: begin, end });
  return message((told) => told.type === "bytes" && told.id === id);
}

/** Opens a file as its page does, and reads all of it. */
async function content(uri, type) {
  const shown = await editor.open(uri, type);
  shown.send({ type: "ready" });
  const opened = await shown.message((told) => isOpened(told) || isFailed(told));
  assert.equal(opened.type, "opened", opened.text);
  const { bytes } = await range(shown, opened, 0, opened.size);
  return { ...shown, opened, bytes };
}

test("it has just the editors that it announces", () => {
  const { customEditors } = editor.manifest.contributes;
  assert.deepEqual([...editor.providers.keys()].sort(), customEditors.map(({ viewType }) => viewType).sort());
  assert.equal(editor.subscriptions.length, customEditors.length);
});

test("ranges of a file of 8 GiB are read where they are", async () => {
  const path = at("files/large.mt");
  await writeFile(path, "");
  await truncate(path, 8 * 2 ** 30);
  const place = 7 * 2 ** 30 + 5;
  const file = await open(path, "r+");
  await file.write("here", place);
  await file.close();
  const shown = await editor.open(here("large.mt"));
  shown.send({ type: "ready" });
  const opened = await shown.message(isOpened);
  assert.deepEqual([opened.name, opened.size, opened.notes], ["large.mt", 8 * 2 ** 30, []]);
  const { bytes } = await range(shown, opened, place - 1, place + 5);
  assert.deepEqual(Buffer.from(bytes), Buffer.from("\0here\0"));
  shown.close();
  await rm(path);
});

test("a file that has changed is read anew, and ranges of the one before are refused", async () => {
  const uri = here("changes.mt");
  await copyFile(`${fixture}/small.mt`, uri.fsPath);
  const shown = await content(uri);
  assert.deepEqual(Buffer.from(shown.bytes), await readFile(`${fixture}/small.mt`));
  await copyFile(`${fixture}/fields.mt`, uri.fsPath);
  await editor.changed.fire(here("another.mt"));
  await editor.changed.fire(uri);
  const now = await shown.message((told) => isOpened(told) && told.version === shown.opened.version + 1);
  assert.deepEqual(Buffer.from((await range(shown, now, 0, now.size)).bytes), await readFile(`${fixture}/fields.mt`));
  const { bytes, error } = await range(shown, shown.opened, 0, 4);
  assert.deepEqual([bytes, error.code], [undefined, "replaced"]);
  assert.equal(shown.messages.filter(isOpened).length, 2, "files beside it change nothing");

  await rm(uri.fsPath);
  await editor.changed.fire(uri);
  assert.match((await shown.message(isFailed)).text, /ENOENT.*changes\.mt/);
  shown.close();
  await editor.changed.fire(uri);
  assert.equal(editor.changed.listeners.size, 0, "nothing is watched any more");
});

test("a file that two editors show is open once, and one that is closed is told nothing", async () => {
  const uri = here("two.mt");
  await copyFile(`${fixture}/small.mt`, uri.fsPath);
  const first = await content(uri);
  const second = await first.another();
  second.send({ type: "ready" });
  const { version, size } = await second.message(isOpened);
  assert.equal(version, first.opened.version);
  first.hide();
  const told = first.messages.length;
  await editor.changed.fire(uri);
  const now = await second.message((message) => isOpened(message) && message.version === version + 1);
  assert.deepEqual(Buffer.from((await range(second, now, 0, size)).bytes), await readFile(uri.fsPath));
  assert.equal(first.messages.length, told);
  first.close();
});

test("of anything else an MT file is built, by the package or the command: the same, with all fields", async () => {
  const uri = editor.Uri.file(`${fixture}/fields.vtu`);
  const expected = await build({ name: "fields.vtu", data: await readFile(uri.fsPath) }, { allFields: true, cellToPoint: true });
  const byPackage = await content(uri, "tetralod.mesh");
  assert.deepEqual(Buffer.from(byPackage.bytes), Buffer.from(expected.bytes));
  assert.match(byPackage.messages[0].text, /^Reading|^Building/);
  byPackage.close();

  editor.settings.set("tetralod.command", tetralod);
  const byCommand = await content(uri, "tetralod.mesh");
  editor.settings.clear();
  assert.deepEqual(Buffer.from(byCommand.bytes), Buffer.from(expected.bytes));
  assert.deepEqual([byCommand.opened.notes, byPackage.opened.notes], [[], []]);
  assert.deepEqual(await readdir(at("temporary")), [], "nothing stays on the disk");
  byCommand.close();
});

test("what the reader left out is told, by the package and by the command", async () => {
  const uri = editor.Uri.file(at("files/triangle.vtk"));
  const header = "# vtk DataFile Version 3.0\n\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 4 double\n0 0 0 1 0 0 0 1 0 0 0 1\n";
  const cells = "CELLS 2 9\n4 0 1 2 3\n3 0 1 2\nCELL_TYPES 2\n10 5\nPOINT_DATA 4\nSCALARS s double 1\nLOOKUP_TABLE default\n0 1 2 3\n";
  await writeFile(uri.fsPath, header + cells);
  for (const command of ["", tetralod]) {
    editor.settings.set("tetralod.command", command);
    const { opened, close } = await content(uri, "tetralod.mesh");
    assert.deepEqual(opened.notes, [`${command && "triangle.vtk: "}left out: 1 triangle`]);
    close();
  }
  editor.settings.clear();
});

test("what cannot be shown is said, with its name", async () => {
  await writeFile(at("files/broken.vtu"), "<VTKFile");
  const failure = async (uri, type = "tetralod.mesh") => {
    const shown = await editor.open(uri, type);
    shown.send({ type: "ready" });
    const { text } = await shown.message((told) => isFailed(told) || isOpened(told));
    shown.close();
    return text;
  };
  assert.match(await failure(here("broken.vtu")), /broken\.vtu/);
  assert.match(await failure(here("nowhere.mt"), "tetralod.mt"), /ENOENT.*nowhere\.mt/);
  editor.settings.set("tetralod.command", at("no-such-program"));
  assert.match(await failure(here("broken.vtu")), /^tetralod\.command: .*no-such-program does not start: .*ENOENT/);
  editor.settings.set("tetralod.command", tetralod);
  assert.match(await failure(here("broken.vtu")), /^broken\.vtu: /);
  editor.settings.clear();
});

test("files elsewhere are read as a whole, up to a limit; what goes to the page is no more than was asked for", async () => {
  editor.memory.set("/small.mt", await readFile(`${fixture}/small.mt`));
  editor.memory.set("/fields.vtu", await readFile(`${fixture}/fields.vtu`));
  editor.memory.set("/large.mt", { length: 512 * 2 ** 20 + 1 });
  const elsewhere = (name) => new editor.Uri("git", `/${name}`);
  const small = await content(elsewhere("small.mt"));
  assert.deepEqual(Buffer.from(small.bytes), editor.memory.get("/small.mt"));
  const { bytes } = await range(small, small.opened, 8, 16);
  assert.equal(bytes.buffer.byteLength, 8);
  small.close();
  const built = await content(elsewhere("fields.vtu"), "tetralod.mesh");
  assert.ok(built.opened.size > 1000);
  built.close();
  const large = await editor.open(elsewhere("large.mt"));
  large.send({ type: "ready" });
  assert.match((await large.message(isFailed)).text, /^large\.mt: it has 513 MiB, and files of "git:" are read as a whole, up to 512 MiB; copy/);
  large.close();
});

test("a page runs its own script alone, from its own folder, and names are text in it", async () => {
  const uri = here('a<b>&"c.mt');
  await copyFile(`${fixture}/small.mt`, uri.fsPath);
  const pages = [];
  for (const _ of [0, 1]) {
    const { webview, close } = await editor.open(uri);
    pages.push(webview.html);
    assert.deepEqual(String(/** @type {any} */ (webview.options).localResourceRoots), `file://${at("extension/page")}`);
    close();
  }
  const nonces = pages.map((page) => {
    const [, nonce] = /script-src 'nonce-([^']+)' 'wasm-unsafe-eval'/.exec(page) ?? assert.fail("no policy");
    assert.deepEqual(
      [...page.matchAll(/<(script|style)[^>]*>/g)].map(([tag]) => tag.includes(`nonce="${nonce}"`)),
      [true, true],
    );
    return nonce;
  });
  assert.notEqual(nonces[0], nonces[1]);
  assert.match(pages[0], /default-src 'none'/);
  assert.doesNotMatch(pages[0], /unsafe-inline|'unsafe-eval'|\{\w+\}|<b>| (style|on\w+)="/);
  assert.match(pages[0], /<title>a&#60;b>&#38;&#34;c\.mt<\/title>/);
});
