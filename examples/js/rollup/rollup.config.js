import { copyFile } from "node:fs/promises";
import { fileURLToPath } from "node:url";
import resolve from "@rollup/plugin-node-resolve";

/** The wasm file, which the worker looks for beside itself. */
const copyCore = () => copyFile(fileURLToPath(import.meta.resolve("tetralod/core.wasm")), "dist/tetralod_core_bg.wasm");

export default {
  input: { main: "main.js", worker: "tetralod/worker" },
  output: { dir: "dist", entryFileNames: "[name].js", chunkFileNames: "[name].js" },
  plugins: [resolve(), { name: "wasm", writeBundle: copyCore }],
};
