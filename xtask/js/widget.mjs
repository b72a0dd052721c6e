/**
 * Writes the widget of the Python package: `python/widget/widget.mjs` with `tetralod/inline-viewer` in it. One file, that imports nothing.
 *
 * node xtask/js/widget.mjs FOLDER_OF_THE_PACKAGE FILE
 */

import { mkdir, writeFile } from "node:fs/promises";
import { dirname, resolve } from "node:path";
import { fileURLToPath } from "node:url";
import { bundled } from "./bundle.mjs";

const [folder, file] = process.argv.slice(2).map((path) => resolve(path));
await mkdir(dirname(file), { recursive: true });
await writeFile(file, await bundled(fileURLToPath(new URL("../../python/widget/widget.mjs", import.meta.url)), folder));
