/** The worker that builds one MT file. Runs in browsers and, as a `worker_threads` worker, in Node. */

import init, { MeshBuilder } from "./tetralod_build.js";
import type { BuildPhase, BuildReport, CoreBuildOptions, InputInfo } from "./build.js";
import { TetralodError } from "./errors.js";
import { nodeEndpoint, ownEndpoint, serve } from "./rpc.js";
import { type Loaded, type WasmSource, wasmError, wasmOf } from "./start.js";
import { type OpenSource, type Source, nodeModule, openSource } from "./stream.js";
import { VERSION } from "./version.js";

/** Milliseconds between two reports of one phase. */
const PAUSE = 50;

/** A file, and its name where its source has none that is sent along. */
export interface InputFile {
  source: Source;
  name?: string;
}

/** The message of the panic that ended the module, if there was one. */
let panic: string | undefined;

/** What the wasm module exports, once it is there. */
let wasm: { memory: WebAssembly.Memory } | undefined;

const memoryBytes = () => wasm?.memory.buffer.byteLength ?? 0;

/** Runs `work` on the module. A trap becomes an error that says what ended it. */
async function guarded<T>(work: () => Promise<T>): Promise<T> {
  try {
    return await work();
  } catch (error) {
    if (!(error instanceof WebAssembly.RuntimeError) && !(error instanceof RangeError)) throw error;
    // Memory that cannot be had ends the module without a panic, or with one where an array would be too long.
    const isMemory = panic === undefined ? /unreachable|allocation/i.test(error.message) : /capacity overflow/.test(panic);
    if (!isMemory) throw new TetralodError("internal", panic ?? error.message, { cause: error });
    const problem = `there is not enough memory: the module has ${Math.ceil(memoryBytes() / 1e6)} MB and gets no more`;
    throw new TetralodError("memory", `${problem}; use the command \`tetralod build\``, { cause: error });
  }
}

const megabytes = (bytes: number) => bytes / 2 ** 20;

/** Hears of the progress, and never ends the work. */
type Report = (phase: BuildPhase, done: number, total: number, tetrahedra?: number) => boolean;

/** Copies all files into the module. */
async function read(builder: MeshBuilder, files: InputFile[], report: Report) {
  const opened: OpenSource[] = [];
  for (const file of files) opened.push(await open(file));
  const total = opened.reduce((sum, file) => sum + (file.total ?? 0), 0);
  let done = 0;
  for (const file of opened) {
    builder.addFile(file.name, file.total ?? 0);
    for await (const bytes of chunksOf(file)) {
      builder.append(bytes);
      done += bytes.length;
      report("read", megabytes(done), megabytes(Math.max(total, done)));
    }
  }
}

async function open({ source, name }: InputFile): Promise<OpenSource> {
  const opened = await openSource(source);
  return { ...opened, name: name || opened.name };
}

async function* chunksOf({ chunks }: OpenSource) {
  for (let part = await chunks.next(); !part.done; part = await chunks.next()) yield part.value;
}

/** Emits the progress, not more often than a person can see it. */
function reporter(): Report {
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
function withFiles<T>(files: InputFile[], memory: number | undefined, report: Report, work: (builder: MeshBuilder) => T): Promise<T> {
  return guarded(async () => {
    const builder = new MeshBuilder((message: string) => (panic = message), memory);
    await read(builder, files, report);
    return work(builder);
  });
}

const methods = {
  /** Compiles the wasm module; without `source`, its address, the one of the package. */
  async load(source?: WasmSource): Promise<Loaded> {
    wasm = await wasmOf(source ?? new URL("./tetralod_build_bg.wasm", import.meta.url))
      .then((found) => init({ module_or_path: found }))
      .catch((error) => Promise.reject(wasmError(error, "tetralod/build.wasm")));
    return { name: "build", version: VERSION };
  },
  inspect: (files: InputFile[], options: CoreBuildOptions, memory?: number): Promise<InputInfo> =>
    withFiles(files, memory, () => false, (builder) => builder.inspect(options)),
  async build(files: InputFile[], options: CoreBuildOptions, memory?: number): Promise<{ bytes: Uint8Array<ArrayBuffer>; report: BuildReport }> {
    const start = performance.now();
    const report = reporter();
    return withFiles(files, memory, report, (builder) => {
      const built = builder.build(options, report);
      const seconds = (performance.now() - start) / 1000;
      return { bytes: built.bytes, report: { ...built.report, fileBytes: built.bytes.length, seconds, memoryBytes: memoryBytes() } };
    });
  },
};

export type BuildMethods = typeof methods;

const parent = nodeModule("node:worker_threads")?.parentPort;
const emit = serve(parent ? nodeEndpoint(parent) : ownEndpoint(), methods);
