/**
 * Writes the widget of the Python package: `python/widget/widget.mjs` with `tetralod/inline-viewer` in it. One file, that imports nothing.
 *
 * node xtask/js/widget.mjs FOLDER_OF_THE_PACKAGE FILE
 */

import { createRequire } from "node:module";
import { join, resolve } from "node:path";
import { fileURLToPath } from "node:url";

// The tools of the project are those of its tests.
const { build } = createRequire(new URL("../../tests/js/package.json", import.meta.url))("esbuild");

const [folder, outfile] = process.argv.slice(2).map((path) => resolve(path));

await build({
  entryPoints: [fileURLToPath(new URL("../../python/widget/widget.mjs", import.meta.url))],
  outfile,
  bundle: true,
  minify: true,
  target: "es2022",
  format: "esm",
  charset: "utf8",
  legalComments: "none",
  logLevel: "warning",
  plugins: [
    {
      name: "package",
      setup({ onResolve }) {
        onResolve({ filter: /^\/pkg\// }, ({ path }) => ({ path: join(folder, path.slice("/pkg/".length)) }));
      },
    },
  ],
});
