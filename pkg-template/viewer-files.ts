/**
 * Where the files of the viewer are: beside this module, in forms that bundlers know. `tetralod/inline-viewer` has another module in
 * place of this one (`xtask/js/inline.mjs`).
 */

/** The bytes of the wasm module, where they are in this file; elsewhere the worker finds its own. */
export const viewerWasm = (): Promise<Uint8Array<ArrayBuffer>> | undefined => undefined;

/** The worker of the viewer, from the page's own origin. */
export const startViewer = (): Worker => new Worker(new URL("./viewer-worker.js", import.meta.url), { type: "module" });

/** The address of that worker where nothing is bundled. */
export const viewerScript = (): URL | undefined => new URL("./viewer-worker.js", new URL("./tetralod_viewer_bg.wasm", import.meta.url));

/** What else helps when it does not start. */
export const viewerRemedy = ', import "tetralod/inline-viewer", which needs no other file, or pass a `worker` that you have made';
