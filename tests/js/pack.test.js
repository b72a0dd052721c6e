// Promise: the npm package holds what it needs and nothing else, has no dependencies, and names its licences.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { readFile } from "node:fs/promises";
import { test } from "node:test";
import { fileURLToPath } from "node:url";
import { withSizes, wrongSizes } from "../../xtask/js/stated.mjs";

const pkg = fileURLToPath(new URL("../../pkg/", import.meta.url));

const FILES = [
  "LICENSE-APACHE",
  "LICENSE-MIT",
  "README.md",
  "THIRD-PARTY-LICENSES.txt",
  "build-worker.js",
  "build.d.ts",
  "build.js",
  "changes.js",
  "core.js",
  "element.d.ts",
  "element.js",
  "errors.js",
  "files.js",
  "fit.js",
  "index.d.ts",
  "index.js",
  "inline.d.ts",
  "inline.js",
  "latest.js",
  "options.js",
  "package.json",
  "parts.js",
  "ranges.js",
  "rpc.js",
  "start.js",
  "stored.js",
  "stream.js",
  "surfaces.js",
  "tetralod_build.d.ts",
  "tetralod_build.js",
  "tetralod_build_bg.wasm",
  "tetralod_core.d.ts",
  "tetralod_core.js",
  "tetralod_core_bg.wasm",
  // The types of this module are not public.
  "tetralod_viewer.js",
  "tetralod_viewer_bg.wasm",
  "three.d.ts",
  "three.js",
  "tools.js",
  "version.js",
  "viewer-worker.js",
  "viewer.d.ts",
  "viewer.js",
  "vtk.d.ts",
  "vtk.js",
  "worker.d.ts",
  "worker.js",
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
