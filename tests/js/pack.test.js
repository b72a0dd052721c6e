// Promise: the npm package holds what it needs and nothing else, has no dependencies, and names its licences.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { readFile } from "node:fs/promises";
import { test } from "node:test";
import { fileURLToPath } from "node:url";
import { withSizes, wrongSizes } from "../../xtask/js/stated.mjs";

const pkg = fileURLToPath(new URL("../../pkg/", import.meta.url));

/** Scripts. Files of types alone have none. */
const SCRIPTS = [
  "build-worker",
  "build",
  "changes",
  "core",
  "dispose",
  "element",
  "errors",
  "files",
  "fit",
  "index",
  "inline-viewer",
  "inline",
  "latest",
  "options",
  "parts",
  "ranges",
  "rpc",
  "shards",
  "start",
  "stored",
  "stream",
  "surfaces",
  "tetralod_build",
  "tetralod_core",
  "tetralod_viewer",
  "three",
  "tools",
  "version",
  "viewer-ahead",
  "viewer-files",
  "viewer-frames",
  "viewer-mesh",
  "viewer-pace",
  "viewer-shown",
  "viewer-worker",
  "viewer",
  "vtk",
  "webgl-shaders",
  "webgl",
  "worker",
];

/** Declarations: those of entries, and what they are made of. */
const TYPES = [
  "build",
  "changes",
  "dispose",
  "element",
  "errors",
  "events",
  "index",
  "inline-viewer",
  "inline",
  "options",
  "results",
  "rpc",
  "scene",
  "stored",
  "stream",
  "surfaces",
  "three",
  "tools",
  "viewer",
  "vtk",
  "worker",
];

const FILES = [
  ...["LICENSE-APACHE", "LICENSE-MIT", "README.md", "THIRD-PARTY-LICENSES.txt", "package.json"],
  ...["build", "core", "viewer"].map((name) => `tetralod_${name}_bg.wasm`),
  ...SCRIPTS.map((name) => `${name}.js`),
  ...TYPES.map((name) => `${name}.d.ts`),
];

const [packed] = JSON.parse(execFileSync("npm", ["pack", "--dry-run", "--json"], { cwd: pkg, encoding: "utf8", stdio: ["ignore", "pipe", "ignore"] }));
const manifest = JSON.parse(await readFile(`${pkg}package.json`, "utf8"));

test("the changes on top are those of this version", async () => {
  const changes = await readFile(new URL("../../CHANGELOG.md", import.meta.url), "utf8");
  const [top] = /^## .*$/m.exec(changes) ?? [];
  assert.ok(top?.includes(manifest.version), `CHANGELOG.md begins with ${top}`);
});

test("the package holds these files", () => {
  assert.deepEqual(packed.files.map(({ path }) => path).sort(), FILES.sort());
});

test("nothing is installed or run with it", () => {
  for (const name of ["dependencies", "scripts", "bundleDependencies", "bin"]) assert.equal(manifest[name], undefined, name);
  assert.ok(Object.keys(manifest.peerDependencies ?? {}).every((name) => manifest.peerDependenciesMeta?.[name]?.optional));
});

test("every file that the manifest names is there", () => {
  const names = Object.values(manifest.exports).flatMap((entry) => (typeof entry === "string" ? entry : Object.values(entry)));
  for (const name of [...names, manifest.types, ...manifest.sideEffects]) assert.ok(FILES.includes(name.replace("./", "")), name);
});

test("the licences of what is compiled into it are told", async () => {
  const licences = await readFile(`${pkg}THIRD-PARTY-LICENSES.txt`, "utf8");
  for (const name of ["wasm-bindgen", "crc32fast", "glam", "wgpu"]) assert.match(licences, new RegExp(`^(.*, )?${name} \\d`, "m"));
  // Folders of the machine that it was built on.
  assert.doesNotMatch(licences, /\/(home|root|work|Users)\//);
});

test("sizes that pages state are compared with the build, and written by it", () => {
  const sizes = { "./viewer.wasm": { brotli: 406_400, raw: 1_200_000 }, "./three": { brotli: 1200, raw: 3000 } };
  const page = (viewer, raw) => `wasm <!--kB ./viewer.wasm-->${viewer}<!----> kB, <!--kB ./three-->1<!----> kB; <!--raw kB ./viewer.wasm-->${raw}<!----> kB`;
  assert.deepEqual(wrongSizes(page(406, 1200), sizes), []);
  assert.deepEqual(wrongSizes(page(400, 1210), sizes), [], "a little off");
  assert.deepEqual(wrongSizes(page(443, 1200), sizes), ["./viewer.wasm has 406400 bytes, not 443 kB"]);
  assert.equal(withSizes(page(443, 7), sizes), page(406, 1200));
  assert.match(wrongSizes("<!--kB ./core.wasm-->147<!----> kB", sizes)[0], /no entry/);
  assert.match(wrongSizes("in 195 kB", sizes)[0], /"195 kB" has no mark/);
});
