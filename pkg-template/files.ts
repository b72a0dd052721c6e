/**
 * Where the files of the core are: beside this module. Vite and webpack know these two forms, and put the files where the
 * URLs lead. `tetralod/inline` has another module in place of this one (`xtask/js/inline-files.mjs`).
 */

/** The wasm module of the core, or its bytes where they are in this file. */
export const coreWasm = (): URL | Promise<Uint8Array<ArrayBuffer>> => new URL("./tetralod_core_bg.wasm", import.meta.url);

/** The worker of the core in a page, from the page's own origin. */
export const startCore = (): Worker => new Worker(new URL("./worker.js", import.meta.url), { type: "module" });

/** The address of that worker where nothing is bundled. No form that a bundler knows: it would copy the file once more. */
export const coreScript = (): URL | undefined => new URL("./worker.js", coreWasm() as URL);

/** What else helps when it does not start. */
export const coreRemedy = ', import "tetralod/inline", which needs no other file, or open with `worker: false`';
