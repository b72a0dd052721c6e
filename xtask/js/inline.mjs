/**
 * Writes `inline.js` and `inline-viewer.js` of the package in a folder that has all its other files: `index.js`, or `viewer.js` and
 * `element.js`, with the wasm module (deflated, as text) and the worker in it. Each is one file, that imports nothing.
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
    onResolve({ filter: /^(embedded:.*|\.\/(viewer-)?files\.js)$/ }, ({ path }) => ({ path, namespace: "replaced" }));
    onLoad({ filter: /.*/, namespace: "replaced" }, ({ path }) => ({ resolveDir: folder, ...modules[path] }));
  },
});

/** What `inline-files.mjs` exports, by the names that the package has for it. */
const names = (module, start) => `
  export { wasm as ${module}Wasm, start as start${start}, place as ${module}Script } from "embedded:files";
  export const ${module}Remedy = ", allow blob: in worker-src, or ${module === "core" ? "open with `worker: false`" : "pass a `worker` that you have made"}";`;

async function embed(output, entry, workerEntry, module, start, files) {
  const packed = deflateSync(await readFile(join(folder, `tetralod_${module}_bg.wasm`)), { level: 9 }).toString("base64");
  const worker = await build({
    ...OPTIONS,
    entryPoints: [join(folder, workerEntry)],
    format: "iife",
    write: false,
    // The page sends it the bytes.
    plugins: [replacing({ "./files.js": { contents: "export const coreWasm = () => undefined;" } })],
  });
  await build({
    ...OPTIONS,
    stdin: { contents: entry, resolveDir: folder },
    format: "esm",
    outfile: join(folder, output),
    plugins: [
      replacing({
        [files]: { contents: names(module, start) },
        "embedded:files": { contents: await readFile(fileURLToPath(new URL("inline-files.mjs", import.meta.url)), "utf8") },
        "embedded:wasm": { contents: packed, loader: "text" },
        "embedded:worker": { contents: worker.outputFiles[0].text.trim(), loader: "text" },
      }),
    ],
  });
}

await embed("inline.js", 'export * from "./index.js";', "worker.js", "core", "Core", "./files.js");
const viewer = 'export * from "./viewer.js"; export * from "./element.js";';
await embed("inline-viewer.js", viewer, "viewer-worker.js", "viewer", "Viewer", "./viewer-files.js");
