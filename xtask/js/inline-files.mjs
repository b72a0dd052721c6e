/**
 * In place of `files.js` in `tetralod/inline`: the wasm modules and the worker are in the bundle. `inline.mjs` gives the content
 * of the two imports.
 */

import packed from "embedded:wasm";
import script from "embedded:worker";

/** @type {Promise<Uint8Array> | undefined} */
let bytes;
/** @type {string | undefined} */
let url;

/** The bytes of the wasm module. */
export const coreWasm = () => (bytes ??= unpacked(packed));

async function unpacked(packed) {
  const stream = new Blob([Uint8Array.from(atob(packed), (c) => c.charCodeAt(0))]).stream();
  return new Uint8Array(await new Response(stream.pipeThrough(new DecompressionStream("deflate"))).arrayBuffer());
}

/** Starts the worker from its text: in a page from a blob. */
export function startCore() {
  const node = globalThis.process?.getBuiltinModule?.("node:worker_threads");
  if (node) return new node.Worker(script, { eval: true });
  url ??= URL.createObjectURL(new Blob([script], { type: "text/javascript" }));
  return new Worker(url);
}

export const coreScript = () => undefined;

/** What else helps when it does not start. */
export const coreRemedy = ", allow blob: in worker-src, or open with `worker: false`";
