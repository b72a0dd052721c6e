/**
 * The size of each entry of the package as a page downloads it: bundled, minified and compressed by brotli. What it
 * loads later (workers and wasm files) is an entry of its own; optional peers are not counted. Fails where an entry is larger
 * than its limit, or has none.
 *
 * node xtask/js/sizes.mjs FOLDER
 */

import { readFile } from "node:fs/promises";
import { createRequire } from "node:module";
import { join, resolve } from "node:path";
import { brotliCompressSync } from "node:zlib";

const { build } = createRequire(new URL("../../tests/js/package.json", import.meta.url))("esbuild");

/** Bytes. An entry that outgrows its limit needs a reason for a higher one, in the message of the commit that raises it. */
const LIMITS = {
  ".": 15_900,
  "./viewer": 7_500,
  "./element": 10_000,
  "./three": 2_500,
  "./vtk": 2_500,
  "./build": 4_000,
  "./inline": 365_000,
  "./worker": 10_300,
  "./viewer-worker": 18_000,
  "./build-worker": 5_500,
  "./core.wasm": 148_000,
  "./all-kinds.wasm": 216_000,
  "./tools.wasm": 56_000,
  "./viewer.wasm": 409_000,
  "./build.wasm": 530_000,
};

const folder = resolve(process.argv[2]);
const { exports } = JSON.parse(await readFile(join(folder, "package.json"), "utf8"));

async function sizeOf(file) {
  if (file.endsWith(".wasm")) return brotliCompressSync(await readFile(join(folder, file))).length;
  const { outputFiles } = await build({
    entryPoints: [join(folder, file)],
    bundle: true,
    minify: true,
    format: "esm",
    target: "es2022",
    write: false,
    external: ["three", "@kitware/vtk.js/*"],
  });
  return brotliCompressSync(outputFiles[0].contents).length;
}

let isGood = true;
console.log(`${"entry".padEnd(20)} ${"brotli".padStart(9)} ${"limit".padStart(9)}`);
for (const [name, files] of Object.entries(exports)) {
  const file = files.default ?? files;
  if (file.endsWith(".json")) continue;
  const [size, limit] = [await sizeOf(file), LIMITS[name]];
  const isSmall = size <= limit;
  isGood &&= isSmall;
  console.log(`${name.padEnd(20)} ${String(size).padStart(9)} ${String(limit ?? "none").padStart(9)}${isSmall ? "" : "  too large"}`);
}
if (!isGood) {
  console.error("an entry of the package is larger than its limit in xtask/js/sizes.mjs, or has none there");
  process.exitCode = 1;
}
