/**
 * Writes the widget of the Python package: `python/widget/widget.mjs` with the element, the viewer's worker, and the viewer's wasm
 * module (deflated, as text) in it. One file, that imports nothing.
 *
 * node xtask/js/widget.mjs FOLDER_OF_THE_PACKAGE FILE
 */

import { readFile } from "node:fs/promises";
import { createRequire } from "node:module";
import { join, resolve } from "node:path";
import { fileURLToPath } from "node:url";
import { deflateSync } from "node:zlib";

// The tools of the project are those of its tests.
const { build } = createRequire(new URL("../../tests/js/package.json", import.meta.url))("esbuild");

const [folder, outfile] = process.argv.slice(2).map((path) => resolve(path));
const OPTIONS = {
  bundle: true,
  minify: true,
  target: "es2022",
  format: "esm",
  charset: "utf8",
  legalComments: "none",
  logLevel: "warning",
  // It is never asked: the element is given both addresses.
  define: { "import.meta.url": '""' },
};

const worker = await build({ ...OPTIONS, entryPoints: [join(folder, "viewer-worker.js")], write: false });
const wasm = deflateSync(await readFile(join(folder, "tetralod_viewer_bg.wasm")), { level: 9 });
const embedded = { "embedded:worker": worker.outputFiles[0].text.trim(), "embedded:wasm": wasm.toString("base64") };

await build({
  ...OPTIONS,
  outfile,
  entryPoints: [fileURLToPath(new URL("../../python/widget/widget.mjs", import.meta.url))],
  plugins: [
    {
      name: "embedded",
      setup({ onResolve, onLoad }) {
        onResolve({ filter: /^\/pkg\// }, ({ path }) => ({ path: join(folder, path.slice("/pkg/".length)) }));
        onResolve({ filter: /^embedded:/ }, ({ path }) => ({ path, namespace: "embedded" }));
        onLoad({ filter: /.*/, namespace: "embedded" }, ({ path }) => ({ contents: embedded[path], loader: "text" }));
      },
    },
  ],
});
