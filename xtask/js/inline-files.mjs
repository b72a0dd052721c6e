/**
 * In place of `files.js` in `tetralod/inline`, and of `viewer-files.js` in `tetralod/inline-viewer`: the wasm module and the worker are in
 * the bundle. `inline.mjs` gives the content of the two imports, and the names that the package has for these.
 */

import packed from "embedded:wasm";
import script from "embedded:worker";

/** @type {Promise<Uint8Array> | undefined} */
let bytes;
/** @type {string | undefined} */
let url;

/** The bytes of the wasm module. */
export const wasm = () => (bytes ??= unpacked(packed));

async function unpacked(packed) {
  const stream = new Blob([Uint8Array.from(atob(packed), (c) => c.charCodeAt(0))]).stream();
  return new Uint8Array(await new Response(stream.pipeThrough(new DecompressionStream("deflate"))).arrayBuffer());
}

/** Starts the worker from its text: in a page from a blob. */
export function start() {
  const node = globalThis.process?.getBuiltinModule?.("node:worker_threads");
  if (node) return new node.Worker(script, { eval: true });
  url ??= URL.createObjectURL(new Blob([script], { type: "text/javascript" }));
  return new Worker(url);
}

export const place = () => undefined;
