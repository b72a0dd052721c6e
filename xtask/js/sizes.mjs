/**
 * The size of each entry of the package as a page downloads it: bundled, minified and compressed by brotli. What it
 * loads later (workers and wasm files) is an entry of its own; optional peers are not counted. Fails where an entry is larger
 * than its limit, or has none, and where a page states another size.
 *
 * node xtask/js/sizes.mjs FOLDER           compares
 * node xtask/js/sizes.mjs FOLDER --write   writes the sizes into the pages
 */

import { readFile, writeFile } from "node:fs/promises";
import { createRequire } from "node:module";
import { join, resolve } from "node:path";
import { brotliCompressSync } from "node:zlib";
import { withSizes, wrongSizes } from "./stated.mjs";

const { build } = createRequire(new URL("../../tests/js/package.json", import.meta.url))("esbuild");

/** Bytes. An entry that outgrows its limit needs a reason for a higher one, in the message of the commit that raises it. */
const LIMITS = {
  ".": 16_900,
  "./viewer": 9_000,
  "./element": 11_500,
  "./three": 2_500,
  "./vtk": 2_500,
  "./build": 4_000,
  "./inline": 416_000,
  "./inline-viewer": 690_000,
  "./worker": 10_800,
  "./viewer-worker": 29_600,
  "./build-worker": 5_500,
  "./core.wasm": 316_000,
  "./viewer.wasm": 503_000,
  "./build.wasm": 898_000,
};

const folder = resolve(process.argv[2]);
const { exports } = JSON.parse(await readFile(join(folder, "package.json"), "utf8"));

/** Pages that state sizes. */
const PAGES = ["pkg-template/README.md"].map((page) => new URL(`../../${page}`, import.meta.url));

const sizesOf = (bytes) => ({ brotli: brotliCompressSync(bytes).length, raw: bytes.length });

async function sizeOf(file) {
  if (file.endsWith(".wasm")) return sizesOf(await readFile(join(folder, file)));
  const { outputFiles } = await build({
    entryPoints: [join(folder, file)],
    bundle: true,
    minify: true,
    format: "esm",
    target: "es2022",
    write: false,
    external: ["three", "@kitware/vtk.js/*"],
  });
  return sizesOf(outputFiles[0].contents);
}

let isGood = true;
/** @type {import("./stated.mjs").Sizes} */
const sizes = {};
console.log(`${"entry".padEnd(20)} ${"brotli".padStart(9)} ${"limit".padStart(9)}`);
for (const [name, files] of Object.entries(exports)) {
  const file = files.default ?? files;
  if (file.endsWith(".json")) continue;
  sizes[name] = await sizeOf(file);
  const [size, limit] = [sizes[name].brotli, LIMITS[name]];
  const isSmall = size <= limit;
  isGood &&= isSmall;
  console.log(`${name.padEnd(20)} ${String(size).padStart(9)} ${String(limit ?? "none").padStart(9)}${isSmall ? "" : "  too large"}`);
}
if (!isGood) {
  console.error("an entry of the package is larger than its limit in xtask/js/sizes.mjs, or has none there");
  process.exitCode = 1;
}
for (const page of PAGES) {
  const text = await readFile(page, "utf8");
  if (process.argv[3] === "--write") await writeFile(page, withSizes(text, sizes));
  else for (const words of wrongSizes(text, sizes)) {
    console.error(`${page.pathname}: ${words}; \`node xtask/js/sizes.mjs ${process.argv[2]} --write\` writes the sizes`);
    process.exitCode = 1;
  }
}
