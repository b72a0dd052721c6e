/** One module of several, with those of the package, whose addresses begin with `/pkg/`. */

import { createRequire } from "node:module";
import { join } from "node:path";

// The tools of the project are those of its tests.
const { build } = createRequire(new URL("../../tests/js/package.json", import.meta.url))("esbuild");

/** The bytes of a module that imports nothing, of `entry` and what it imports; the package is in `folder`. */
export async function bundled(entry, folder) {
  const { outputFiles } = await build({
    entryPoints: [entry],
    bundle: true,
    minify: true,
    target: "es2022",
    format: "esm",
    charset: "utf8",
    legalComments: "none",
    logLevel: "warning",
    write: false,
    plugins: [
      {
        name: "package",
        setup({ onResolve }) {
          onResolve({ filter: /^\/pkg\// }, ({ path }) => ({ path: join(folder, path.slice("/pkg/".length)) }));
        },
      },
    ],
  });
  return outputFiles[0].contents;
}
