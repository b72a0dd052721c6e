/**
 * tetralod/build: MT files from the files of a mesh, in a worker that ends with the work. Nothing leaves the machine.
 */

import { TetralodError } from "./errors.js";
import { absoluteUrl, loadWasm, startWorker } from "./start.js";
import { nodeModule } from "./stream.js";

export { TetralodError };

const KINDS = "give a File, Blob, ArrayBuffer, Uint8Array, URL, { raw, json }, or a list of these for time steps";

const BUILDER = {
  name: "build",
  entry: "tetralod/build-worker",
  start: () => new Worker(new URL("./build-worker.js", import.meta.url), { type: "module" }),
  script: () => new URL("./build-worker.js", new URL("./tetralod_build_bg.wasm", import.meta.url)),
  remedy: "",
};

/** How far the work is at the begin of each phase; what changes the mesh takes most of the time. */
const BEGINS = { read: 0, parse: 0.05, repair: 0.1, remove: 0.15, collapse: 0.15, insert: 0.15, order: 0.85, encode: 0.95 };
const ENDS = { read: 0.05, parse: 0.1, repair: 0.15, remove: 0.85, collapse: 0.85, insert: 0.85, order: 0.95, encode: 1 };

export async function build(source, options = {}) {
  const { onProgress = () => {}, ...rest } = options;
  let fraction = 0;
  const tell = ({ phase, done, total, tetrahedra }) => {
    const part = total > 0 ? Math.min(done / total, 1) : 0;
    // Phases may start again, and a phase may turn out to be longer.
    fraction = Math.max(fraction, BEGINS[phase] + part * (ENDS[phase] - BEGINS[phase]));
    onProgress({ phase, fraction, tetrahedra });
  };
  const built = await inWorker("build", source, rest, (_, progress) => tell(progress));
  tell({ phase: "encode", done: 1, total: 1, tetrahedra: undefined });
  return built;
}

export function inspect(source, options = {}) {
  return inWorker("inspect", source, options, () => {});
}

/**
 * One call in a worker of its own: only its end gives its memory back, and nothing else can stop it.
 *
 * @param {string} method
 * @param {import("./build.js").MeshSource} source
 * @param {import("./build.js").InspectOptions} options
 * @param {(name: string, data: any) => void} onEvent
 */
async function inWorker(method, source, { signal, memory, workerUrl, workerTimeoutMs, wasmUrl, ...options }, onEvent) {
  signal?.throwIfAborted();
  if (memory !== undefined && !(memory >= 0)) throw refusedOption("memory", "must be a number that is not negative");
  const wasm = wasmUrl === undefined ? undefined : absoluteUrl("wasmUrl", wasmUrl).href;
  const steps = await stepsOf(source);
  signal?.throwIfAborted();
  const remote = startWorker(BUILDER, { workerUrl, workerTimeoutMs }, onEvent);
  const onAbort = () => remote.close(signal.reason);
  signal?.addEventListener("abort", onAbort, { once: true });
  try {
    await loadWasm(remote, BUILDER, wasm);
    return await remote.call(method, [steps, options, memory]);
  } catch (error) {
    if (error?.name === "DataCloneError") throw refusedOption("options", "must be plain data");
    throw error;
  } finally {
    signal?.removeEventListener("abort", onAbort);
    remote.close(new TetralodError("freed", "the work has ended"));
  }
}

const refusedOption = (name, problem) => new TetralodError("bad-option", `option \`${name}\`: ${problem}`);

/** The files of each time step, as they can be sent to a worker. */
async function stepsOf(source) {
  const steps = await Promise.all(Array.isArray(source) ? pairs(source).map(stepOf) : [stepOf(source)]);
  if (steps.length === 0) throw new TetralodError("bad-source", `there is no file; ${KINDS}`);
  return steps;
}

async function stepOf(source) {
  const { raw, json } = source ?? {};
  if (raw === undefined && json === undefined) return { data: await sendable(source) };
  if (raw === undefined || json === undefined) {
    throw new TetralodError("bad-source", "raw samples are two files: give { raw, json }");
  }
  return { data: await sendable(raw), sidecar: await sendable(json) };
}

/** Samples and the JSON beside them, which are one step, among files that were dropped together. */
function pairs(files) {
  const stem = (file, ending) => (file?.name?.toLowerCase().endsWith(ending) ? file.name.slice(0, -ending.length) : undefined);
  const sidecars = new Map(files.map((file) => [stem(file, ".json"), file]));
  sidecars.delete(undefined);
  const used = new Set();
  const joined = files.map((file) => {
    const json = sidecars.get(stem(file, ".raw"));
    if (json) used.add(json);
    return json ? { raw: file, json } : file;
  });
  return joined.filter((file) => !used.has(file));
}

/** A source that a worker can read, and its name, which not every runtime sends along. */
async function sendable(source) {
  if (typeof Blob === "function" && source instanceof Blob) {
    const { name } = /** @type {{ name?: string }} */ (source);
    // Node 20 crashes when a worker reads a Blob that is backed by a file.
    return { source: nodeModule("node:worker_threads") ? await source.arrayBuffer() : source, name };
  }
  if (source instanceof ArrayBuffer || ArrayBuffer.isView(source)) return { source };
  if (typeof source === "string" || source instanceof URL) return { source: absolute(source) };
  throw new TetralodError("bad-source", `this cannot be read; ${KINDS}`);
}

function absolute(url) {
  try {
    return new URL(url, globalThis.location?.href).href;
  } catch {
    throw new TetralodError("bad-source", `${url}: this is no URL; ${KINDS}`);
  }
}
