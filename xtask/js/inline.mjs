/**
 * Writes `inline.js` of the package in a folder that has all its other files: `index.js` with the wasm module
 * (deflated, as text) and the worker in it. One file, that imports nothing.
 *
 * node xtask/js/inline.mjs FOLDER
 */

import { readFile } from "node:fs/promises";
import { createRequire } from "node:module";
import { join, resolve } from "node:path";
import { fileURLToPath } from "node:url";
import { deflateSync } from "node:zlib";

// The tools of the project are those of its tests.
const { build } = createRequire(new URL("../../tests/js/package.json", import.meta.url))("esbuild");

const folder = resolve(process.argv[2]);
const OPTIONS = {
  bundle: true,
  minify: true,
  target: "es2022",
  charset: "utf8",
  legalComments: "none",
  logLevel: "warning",
  // Of the glue, which is never asked for the address of its module.
  define: { "import.meta.url": '""' },
};

/** Puts other content in place of modules. */
const replacing = (modules) => ({
  name: "replacing",
  setup({ onResolve, onLoad }) {
    onResolve({ filter: /^(embedded:.*|\.\/files\.js)$/ }, ({ path }) => ({ path, namespace: "replaced" }));
    onLoad({ filter: /.*/, namespace: "replaced" }, ({ path }) => ({ resolveDir: folder, ...modules[path] }));
  },
});

/** The wasm module as text. */
const packed = deflateSync(await readFile(join(folder, "tetralod_core_bg.wasm")), { level: 9 }).toString("base64");

const worker = await build({
  ...OPTIONS,
  entryPoints: [join(folder, "worker.js")],
  format: "iife",
  write: false,
  // The page sends it the bytes.
  plugins: [replacing({ "./files.js": { contents: "export const coreWasm = () => undefined;" } })],
});

await build({
  ...OPTIONS,
  entryPoints: [join(folder, "index.js")],
  format: "esm",
  outfile: join(folder, "inline.js"),
  plugins: [
    replacing({
      "./files.js": { contents: await readFile(fileURLToPath(new URL("inline-files.mjs", import.meta.url)), "utf8") },
      "embedded:wasm": { contents: packed, loader: "text" },
      "embedded:worker": { contents: worker.outputFiles[0].text.trim(), loader: "text" },
    }),
  ],
});
