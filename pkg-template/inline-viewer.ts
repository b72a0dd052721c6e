/**
 * The same as `tetralod/viewer` and `tetralod/element` together, with the wasm module and the worker in the file: for pages that are one
 * file, for pages from `file:`, and for bundlers that do not follow `new URL(..., import.meta.url)`. Importing it registers
 * `<tetralod-viewer>`.
 *
 * `workerUrl` and `wasmUrl` still choose others. A Content-Security-Policy must allow `blob:` in worker-src.
 */
export * from "./viewer.js";
export * from "./element.js";
