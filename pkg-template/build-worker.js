/** The worker that builds one MT file. Runs in browsers and, as a `worker_threads` worker, in Node. */

import init, { MeshBuilder } from "./tetralod_build.js";
import { TetralodError } from "./errors.js";
import { nodeEndpoint, serve, webEndpoint } from "./rpc.js";
import { wasmError, wasmOf } from "./start.js";
import { nodeModule, openSource } from "./stream.js";
import { VERSION } from "./version.js";

/** Milliseconds between two reports of one phase. */
const PAUSE = 50;

/** The message of the panic that ended the module, if there was one. */
let panic;

/** What the wasm module exports, once it is there. */
let wasm;

/** Runs `work` on the module. A trap becomes an error that says what ended it. */
async function guarded(work) {
  try {
    return await work();
  } catch (error) {
    if (!(error instanceof WebAssembly.RuntimeError) && !(error instanceof RangeError)) throw error;
    // Memory that cannot be had ends the module without a panic, or with one where an array would be too long.
    const isMemory = panic === undefined ? /unreachable|allocation/i.test(error.message) : /capacity overflow/.test(panic);
    if (!isMemory) throw new TetralodError("internal", panic ?? error.message, { cause: error });
    const bytes = Math.ceil(wasm.memory.buffer.byteLength / 1e6);
    const problem = `there is not enough memory: the module has ${bytes} MB and gets no more`;
    throw new TetralodError("memory", `${problem}; use the command \`tetralod build\``, { cause: error });
  }
}

const megabytes = (bytes) => bytes / 2 ** 20;

/** Copies the files of all time steps into the module. */
async function read(builder, steps, report) {
  const opened = [];
  for (const { data, sidecar } of steps) {
    opened.push({ data: await open(data), sidecar: sidecar && (await open(sidecar)) });
  }
  const total = opened.reduce((sum, { data }) => sum + (data.total ?? 0), 0);
  let done = 0;
  for (const { data, sidecar } of opened) {
    builder.addFile(data.name, data.total ?? 0);
    for (let part; !(part = await data.chunks.next()).done; ) {
      builder.append(part.value);
      done += part.value.length;
      report("read", megabytes(done), megabytes(Math.max(total, done)));
    }
    if (sidecar) builder.addSidecar(sidecar.name, await whole(sidecar));
  }
}

async function open({ source, name }) {
  const opened = await openSource(source);
  return { ...opened, name: name || opened.name };
}

/** All bytes of a small file. */
async function whole({ name, chunks }) {
  const parts = [];
  let length = 0;
  for (let part; !(part = await chunks.next()).done; parts.push(part.value)) {
    length += part.value.length;
    if (length > 2 ** 20) throw new TetralodError("corrupt", `${name}: this is too long for the description of raw samples`);
  }
  const bytes = new Uint8Array(length);
  let at = 0;
  for (const part of parts) {
    bytes.set(part, at);
    at += part.length;
  }
  return bytes;
}

/** Emits the progress, not more often than a person can see it. */
function reporter() {
  let [last, when] = ["", 0];
  return (phase, done, total, tetrahedra) => {
    const now = performance.now();
    if (phase !== last || now - when >= PAUSE) {
      [last, when] = [phase, now];
      emit("progress", { phase, done, total, tetrahedra });
    }
    return false;
  };
}

/** One call of the builder with the files in it. */
function withFiles(steps, memory, report, work) {
  return guarded(async () => {
    const builder = new MeshBuilder((message) => (panic = message), memory);
    await read(builder, steps, report);
    return work(builder);
  });
}

const methods = {
  /** Compiles the wasm module; without `source`, its address, the one of the package. */
  async load(source) {
    wasm = await wasmOf(source ?? new URL("./tetralod_build_bg.wasm", import.meta.url))
      .then((found) => init({ module_or_path: found }))
      .catch((error) => Promise.reject(wasmError(error, "tetralod/build.wasm")));
    return { name: "build", version: VERSION };
  },
  inspect: (steps, options, memory) => withFiles(steps, memory, () => {}, (builder) => builder.inspect(options)),
  async build(steps, options, memory) {
    const start = performance.now();
    const report = reporter();
    return withFiles(steps, memory, report, (builder) => {
      const built = builder.build(options, report);
      const seconds = (performance.now() - start) / 1000;
      const memoryBytes = wasm.memory.buffer.byteLength;
      return { bytes: built.bytes, report: { ...built.report, fileBytes: built.bytes.length, seconds, memoryBytes } };
    });
  },
};

const parent = nodeModule("node:worker_threads")?.parentPort;
const emit = serve(parent ? nodeEndpoint(parent) : webEndpoint(globalThis), methods);
