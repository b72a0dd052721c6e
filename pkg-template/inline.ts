/**
 * The same as `tetralod`, with the wasm module and the worker in the file: for bundlers that do not follow
 * `new URL(..., import.meta.url)`, such as esbuild and Rollup, for pages from `file:` and for single-file pages.
 *
 * `workerUrl` and `wasmUrl` still choose others. Errors are of the `TetralodError` of this entry: do not mix it with
 * `tetralod` in one program.
 */
export * from "./index.js";
