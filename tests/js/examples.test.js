// The projects of `examples/js`, as somebody has them who copies one: the packed package is installed, the project is built, its
// files are served by a plain static server, and the picture or the output is what it should be. Screenshots: `target/e2e/`.
import assert from "node:assert/strict";
import { execFile, spawn } from "node:child_process";
import { cp, mkdir, readFile, readdir, rm, writeFile } from "node:fs/promises";
import { createServer } from "node:http";
import { after, before, test } from "node:test";
import { fileURLToPath, pathToFileURL } from "node:url";
import { promisify } from "node:util";
import { launch } from "./browser.js";
import { assertDrawn, assertLike, study } from "./study.js";

const fixture = process.env.TETRALOD_FIXTURE;
assert.ok(fixture, "TETRALOD_FIXTURE is not set: run `cargo xtask test examples`");
const volume = `${fixture}/blocks-half-edge.mt`;
const bytes = await readFile(volume);
const root = new URL("../../", import.meta.url);
const source = new URL("examples/js/", root);
const project = new URL("target/examples/", root);
const pictures = new URL("target/e2e/", root);
const at = (name) => fileURLToPath(new URL(name, project));

/** @param {string[]} args @param {string | URL} folder */
const npm = (args, folder = project) =>
  promisify(execFile)("npm", args, { cwd: folder, shell: process.platform === "win32" }).catch((error) =>
    assert.fail(`npm ${args.join(" ")}: ${error.stdout}${error.stderr}`),
  );

let browser;
/** Byte ranges of the volume that were asked for. */
let ranges = 0;

before(async () => {
  await install();
  await mkdir(pictures, { recursive: true });
  browser = await launch();
});

after(() => browser?.close());

/** Copies the projects, installs what they need, once for all of them, and the package as npm would publish it. */
async function install() {
  await mkdir(project, { recursive: true });
  for (const name of await readdir(project)) {
    if (name !== "node_modules" && name !== "installed.json") await rm(new URL(name, project), { recursive: true });
  }
  await cp(source, project, { recursive: true });
  const lock = await readFile(new URL("package-lock.json", source), "utf8");
  const installed = await readFile(at("installed.json"), "utf8").catch(() => "");
  if (lock !== installed) await npm(["ci", "--no-audit", "--no-fund", "--loglevel=error"]);
  await writeFile(at("installed.json"), lock);
  const { stdout } = await npm(["pack", "--silent", "--pack-destination", fileURLToPath(project)], new URL("pkg/", root));
  await npm(["install", "--no-save", "--offline", "--no-audit", "--no-fund", "--loglevel=error", `./${stdout.trim()}`]);
}

const TYPES = { html: "text/html", js: "text/javascript", css: "text/css", wasm: "application/wasm", mt: "application/octet-stream" };

/** A static server of a folder, with byte ranges. The volume is in it, and the modules that are installed for all projects. */
async function serve(folder) {
  const server = createServer((request, response) => answer(folder, request, response));
  await new Promise((resolve) => server.listen(0, "127.0.0.1", () => resolve(undefined)));
  const close = () => {
    server.closeAllConnections();
    server.close();
  };
  return { address: `http://127.0.0.1:${/** @type {any} */ (server.address()).port}/`, close };
}

async function answer(folder, /** @type {import("node:http").IncomingMessage} */ { url = "/", headers }, response) {
  const { pathname } = new URL(url, "http://x");
  const name = pathname === "/" ? "/index.html" : pathname;
  const path = at(name.startsWith("/node_modules/") ? `.${name}` : `${folder}${name}`);
  const content = name === "/bucky.mt" ? bytes : await readFile(path).catch(() => undefined);
  if (!content) return response.writeHead(404).end();
  response.setHeader("content-type", TYPES[name.split(".").pop()] ?? "text/plain");
  const [, start, last] = /^bytes=(\d+)-(\d*)$/.exec(headers.range ?? "") ?? [];
  if (start === undefined) return response.writeHead(200, { "content-length": content.length }).end(content);
  ranges++;
  const [from, end] = [Number(start), last ? Math.min(Number(last) + 1, content.length) : content.length];
  response.writeHead(206, { "content-range": `bytes ${from}-${end - 1}/${content.length}`, "content-length": end - from });
  response.end(content.subarray(from, end));
}

/** Opens a page and waits for a picture that stays; it is kept as `example-NAME.png`. */
async function draws(name, { folder = name, what = "canvas", prepare = async (_page) => {}, development = undefined } = {}) {
  const server = await serve(folder);
  const page = await browser.newPage({ viewport: { width: 520, height: 460 } });
  const complaints = [];
  page.on("pageerror", (error) => complaints.push(String(error)));
  page.on("console", (message) => message.type() === "error" && !/favicon/.test(message.location().url) && complaints.push(message.text()));
  await prepare(page);
  if (development) await page.route("**/bucky.mt", (route) => route.continue({ url: `${server.address}bucky.mt` }));
  ranges = 0;
  await page.goto(development ?? server.address);
  const canvas = page.locator(what).first();
  let [seen, last, same] = [{ covered: 0, colours: 0, grid: "" }, "", 0];
  for (let tries = 0; same < 2 && tries < 80 && complaints.length === 0; tries++) {
    await page.waitForTimeout(500);
    const png = await canvas.screenshot({ timeout: 30_000 });
    seen = await study(page, png);
    const now = png.toString("base64");
    same = now === last && seen.covered > 0.03 ? same + 1 : 0;
    last = now;
  }
  await page.screenshot({ path: fileURLToPath(new URL(`example-${name}.png`, pictures)) });
  assert.deepEqual(complaints, [], name);
  assert.equal(same, 2, `${name}: the picture never comes to rest`);
  assertDrawn(seen, name);
  assertLike(seen, `example-${name}`);
  await page.close();
  server.close();
}

const build = (name) => npm(["run", "build", "--workspace", name]);

test("plain: an import map, without a bundler", async () => {
  await draws("plain");
  assert.ok(ranges > 0, "the volume is fetched in parts");
});

test("vite: built, and by its development server", async () => {
  await build("vite");
  await draws("vite", { folder: "vite/dist" });
  const vite = spawn(process.execPath, [at("node_modules/vite/bin/vite.js"), "--port", "0", "--host", "127.0.0.1", "--clearScreen", "false"], {
    cwd: at("vite"),
    stdio: ["ignore", "pipe", "inherit"],
    env: { ...process.env, NO_COLOR: "1" },
  });
  try {
    const development = await new Promise((resolve, reject) => {
      vite.on("exit", () => reject(new Error("vite ended")));
      let said = "";
      vite.stdout.on("data", (text) => {
        said += text;
        const [found] = /http:\/\/127\.0\.0\.1:\d+\//.exec(said) ?? [];
        if (found) resolve(found);
      });
    });
    await draws("vite-dev", { folder: "vite", development });
  } finally {
    vite.kill();
  }
});

test("webpack: without configuration", async () => {
  await build("webpack");
  await draws("webpack");
});

test("esbuild: with the inline entry", async () => {
  await build("esbuild");
  await draws("esbuild");
});

test("rollup: with the worker as an entry point, and the wasm file beside it", async () => {
  await build("rollup");
  await draws("rollup");
});

test("node: a mesh in numbers", async () => {
  const { stdout } = await promisify(execFile)(process.execPath, ["main.js", volume], { cwd: at("node") });
  const [, tetrahedra, all] = /: (\d+) of (\d+) tetrahedra within [\d.]+/.exec(stdout) ?? assert.fail(stdout);
  assert.ok(Number(tetrahedra) > 1000 && Number(tetrahedra) < Number(all), stdout);
  const [, triangles] = /(\d+) triangles/.exec(stdout) ?? assert.fail(stdout);
  assert.ok(Number(triangles) > 500, stdout);
});

test("three: a geometry that is updated in place", async () => {
  await draws("three");
});

test("vtk: polydata that are updated in place", async () => {
  await build("vtk");
  await draws("vtk", { folder: "vtk/dist" });
});

test("react: the element, and a canvas that StrictMode uses twice", async () => {
  await build("react");
  await draws("react", { folder: "react/dist", what: "tetralod-viewer" });
  await draws("react-canvas", { folder: "react/dist", what: "canvas" });
});

test("online: a volume that the page builds itself", async () => {
  await npm(["run", "build"], at("online"));
  await draws("online", { folder: "online/dist" });
});

test("notebook: a cell that imports from another origin and runs again", async () => {
  const prepare = (page) =>
    page.route("https://cdn.jsdelivr.net/npm/tetralod/*", async (route) => {
      const name = new URL(route.request().url()).pathname.split("/").pop();
      const headers = { "access-control-allow-origin": "*", "content-type": TYPES[name.split(".").pop()] };
      await route.fulfill({ body: await readFile(at(`node_modules/tetralod/${name}`)), headers });
    });
  await draws("notebook", { prepare, what: "tetralod-viewer" });
});

/** The block of the package's README that begins with the import of this entry. */
async function readme(entry) {
  const text = await readFile(new URL("pkg-template/README.md", root), "utf8");
  const [, block] = new RegExp(`\`\`\`js\n(import [^\n]*"tetralod/${entry}";[^\`]*)`).exec(text) ?? assert.fail(`no example of ${entry}`);
  return block;
}

const OPEN = `import { readFile } from "node:fs/promises";
  const bytes = await readFile(${JSON.stringify(volume)});`;
const MT = `import { MultiTessellation } from "tetralod";
  ${OPEN}
  const mt = await MultiTessellation.open(bytes);
  await mt.complete;`;

for (const [entry, prelude, ending] of [
  [
    "three",
    `import * as THREE from "three"; ${MT} const scene = new THREE.Scene();`,
    "console.log(scene.children.length === 2 && scene.children.every(({ geometry }) => geometry.drawRange.count > 100));",
  ],
  [
    "vtk",
    `import vtkMapper from "@kitware/vtk.js/Rendering/Core/Mapper.js"; ${MT} const mapper = vtkMapper.newInstance();`,
    "console.log(mapper.getInputData().getNumberOfPolys() > 10);",
  ],
  ["inline", OPEN, "await mt.complete; console.log((await mt.refine({ error: '1%' })).stats.satisfied);"],
]) {
  test(`${entry}: the example of the README runs`, async () => {
    const path = at(`node/readme-${entry}.js`);
    const end = `${ending}\nmt.free();`;
    await writeFile(path, `${prelude}\n${await readme(entry)}\n${end}`);
    const { stdout } = await promisify(execFile)(process.execPath, [path]);
    assert.equal(stdout.trim(), "true");
  });
}

/** Modules as the projects import them. */
const imported = (name) => import(pathToFileURL(at(`node_modules/${name}`)).href);

test("surfaces for three.js and vtk.js are written into what is there, and are what the mesh has", async () => {
  const { MultiTessellation } = await imported("tetralod/index.js");
  const mt = await MultiTessellation.open(bytes, { worker: false });
  await mt.complete;
  await mt.refine({ error: "10%" });
  const rejects = (promise, message) => assert.rejects(promise, { code: "bad-option", message });

  const three = await imported("tetralod/three.js");
  const color = (value) => [value, 0, 1];
  const surface = await three.createSurface(mt, { isosurface: 0.5 }, { color });
  const { geometry } = surface;
  const drawn = (name, count) => (name === "index" ? geometry.index : geometry.getAttribute(name)).array.subarray(0, count);
  const is = (triangles, values) => {
    assert.deepEqual(drawn("position", triangles.positions.length), triangles.positions);
    assert.deepEqual(drawn("index", triangles.indices.length), triangles.indices);
    assert.deepEqual(geometry.drawRange, { start: 0, count: triangles.indices.length });
    if (triangles.normals) assert.deepEqual(drawn("normal", triangles.normals.length), triangles.normals);
    assert.deepEqual([...drawn("color", 3)], [...new Float32Array([values[0], 0, 1])]);
  };
  const coarse = await mt.isosurface(0.5);
  is(coarse, [0.5]);
  await mt.refine({ error: "1%" });
  await surface.update();
  const fine = await mt.isosurface(0.5);
  assert.ok(fine.indices.length > 2 * coarse.indices.length);
  is(fine, [0.5]);
  const { array } = geometry.getAttribute("position");
  await mt.refine({ error: "10%" });
  assert.equal(await surface.update(), geometry);
  is(await mt.isosurface(0.5), [0.5]);
  assert.equal(geometry.getAttribute("position").array, array, "the same memory");
  assert.ok(geometry.boundingSphere.radius > 0.1 && geometry.boundingBox.max.x <= mt.info.bounds[3] + 1e-6);
  await surface.update({ boundary: true });
  const boundary = await mt.surface();
  is(boundary, boundary.values);
  assert.equal(geometry.getAttribute("normal"), undefined);
  await surface.update({ slice: { normal: [0, 0, 1], offset: 0.5 } });
  const slice = await mt.slice([0, 0, 1], 0.5);
  is(slice, slice.values);
  await rejects(surface.update({}), /isosurface, slice, boundary/);
  await rejects(surface.update({ isosurface: 0.5, boundary: true }), /no second one/);
  await rejects(surface.update({ isosurfaces: 0.5 }), /`isosurfaces`/);
  await rejects(three.createSurface(mt, { boundary: true }, { colour: color }), /`colour`/);
  surface.dispose();

  const vtk = await imported("tetralod/vtk.js");
  const poly = await vtk.createSurface(mt, { isosurface: 0.5 }, { name: "density" });
  const has = (triangles) => {
    assert.deepEqual(poly.polyData.getPoints().getData(), triangles.positions);
    assert.equal(poly.polyData.getNumberOfPolys(), triangles.indices.length / 3);
    const cells = poly.polyData.getPolys().getData();
    assert.deepEqual([...cells.subarray(0, 4)], [3, ...triangles.indices.subarray(0, 3)]);
    assert.deepEqual(poly.polyData.getPointData().getNormals()?.getData(), triangles.normals);
    assert.deepEqual(poly.polyData.getPointData().getScalars().getData(), triangles.values);
  };
  has(await mt.isosurface(0.5));
  const changed = poly.polyData.getMTime();
  await mt.refine({ error: "1%" });
  assert.equal(await poly.update(), poly.polyData);
  has(await mt.isosurface(0.5));
  assert.ok(poly.polyData.getMTime() > changed, "modified");
  assert.equal(poly.polyData.getPointData().getScalars().getName(), "density");
  await poly.update({ boundary: true });
  has({ ...(await mt.surface()), normals: undefined });
  await poly.update({ isosurface: 0.5 });
  has(await mt.isosurface(0.5));
  poly.dispose();
  mt.free();
});
