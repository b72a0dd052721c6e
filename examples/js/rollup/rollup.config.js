import { copyFile } from "node:fs/promises";
import { fileURLToPath } from "node:url";
import resolve from "@rollup/plugin-node-resolve";

/** The wasm files, which the worker looks for beside itself. */
const wasm = ["core", "tools"];

const copy = (name) => copyFile(fileURLToPath(import.meta.resolve(`tetralod/${name}.wasm`)), `dist/tetralod_${name}_bg.wasm`);

export default {
  input: { main: "main.js", worker: "tetralod/worker" },
  output: { dir: "dist", entryFileNames: "[name].js", chunkFileNames: "[name].js" },
  plugins: [resolve(), { name: "wasm", writeBundle: () => Promise.all(wasm.map(copy)) }],
};
