/**
 * Starts the workers of the package: from its own folder, from another origin, from an address that the caller gives, or in
 * a worker that the caller has made. What does not start is a mistake of configuration, and its error says what to do.
 */

import { TetralodError, badOption, known } from "./errors.js";
import { type Endpoint, type Methods, type NodeWorker, type OnEvent, Remote, nodeEndpoint, webEndpoint } from "./rpc.js";
import { nodeModule } from "./stream.js";
import { VERSION } from "./version.js";

/** A worker of the package. */
export interface Kind {
  name: "core" | "viewer" | "build";
  /** What to import it as. */
  entry: string;
  /** Starts it in a page, from the page's own origin. */
  start(): Worker;
  /** Its address, where it is not embedded. */
  script(): URL | undefined;
  /** What else to do when it does not start. */
  remedy: string;
}

/** Which worker is used, and where its script is. */
interface Places {
  worker?: boolean | Worker | NodeWorker;
  workerUrl?: string | URL;
  workerTimeoutMs?: number;
}

/** The options that choose a worker, and the address of the wasm module. */
export const PLACES = ["worker", "workerUrl", "workerTimeoutMs", "wasmUrl"];

/** How long a worker may take to load its script and answer, in milliseconds; its work may take any time. */
const TIMEOUT = 30_000;

/** An address that means the same in a worker. */
export function absoluteUrl(name: string, url: string | URL): URL {
  try {
    return new URL(url, globalThis.location?.href);
  } catch (error) {
    throw badOption(name, `${url} is not a URL`, { cause: error });
  }
}

/** The same as a text; `undefined` where none is given. */
export const absoluteHref = (name: string, url: string | URL | undefined) => (url === undefined ? undefined : absoluteUrl(name, url).href);

/** Starts a worker. */
export function startWorker<M extends Methods>(kind: Kind, { worker = true, workerUrl, workerTimeoutMs = TIMEOUT }: Places, onEvent: OnEvent): Remote<M> {
  if (worker !== true && workerUrl !== undefined) throw badOption("workerUrl", "goes with `worker: true` only");
  if (!(workerTimeoutMs >= 0)) throw badOption("workerTimeoutMs", "must be a number that is not negative");
  const remote = worker === true ? ownWorker<M>(kind, workerUrl, onEvent) : givenWorker<M>(kind, worker, onEvent);
  remote.greet(workerTimeoutMs, `it has not answered within ${workerTimeoutMs / 1000} s; with \`workerTimeoutMs\` it has more time`);
  return remote;
}

const givenWorker = <M extends Methods>(kind: Kind, worker: unknown, onEvent: OnEvent) =>
  new Remote<M>(endpointOf(worker), onEvent, (error) => notStarted(kind, undefined, error));

function ownWorker<M extends Methods>(kind: Kind, workerUrl: string | URL | undefined, onEvent: OnEvent): Remote<M> {
  const url = workerUrl === undefined ? kind.script() : absoluteUrl("workerUrl", workerUrl);
  try {
    const endpoint = begin(kind, url, workerUrl !== undefined);
    return new Remote<M>(endpoint, onEvent, async (error) => notStarted(kind, await findingOf(url), error));
  } catch (error) {
    throw notStarted(kind, url?.href, error);
  }
}

function begin(kind: Kind, url: URL | undefined, isGiven: boolean): Endpoint {
  const node = nodeModule("node:worker_threads");
  if (node && url) return nodeEndpoint(new node.Worker(url));
  if (url && isForeign(url)) return foreignEndpoint(url);
  return endpointOf(isGiven && url ? new Worker(url, { type: "module" }) : kind.start());
}

/** The caller's own worker; in Node one of `worker_threads`. */
function endpointOf(worker: unknown): Endpoint {
  const { postMessage, addEventListener } = (worker ?? {}) as Partial<Worker>;
  if (typeof postMessage !== "function") throw badOption("worker", "must be true, false or a Worker");
  return typeof addEventListener === "function" ? webEndpoint(worker as Worker) : nodeEndpoint(worker as NodeWorker);
}

/** Whether a page may not start a worker from there. */
function isForeign({ protocol, origin }: URL): boolean {
  const page = globalThis.location?.origin;
  return /^https?:$/.test(protocol) && page !== undefined && origin !== page;
}

/** A page starts workers from its own origin only; this one imports the other. */
function foreignEndpoint(url: URL): Endpoint {
  const script = new Blob([`import ${JSON.stringify(url.href)};`], { type: "text/javascript" });
  const own = URL.createObjectURL(script);
  const endpoint = webEndpoint(new Worker(own, { type: "module" }));
  // Only from the first message on is it sure that the browser has read it.
  endpoint.onMessage(() => URL.revokeObjectURL(own));
  endpoint.onError?.(() => URL.revokeObjectURL(own));
  return endpoint;
}

/** What is at the address of a worker that did not start. Browsers do not tell why it did not. */
async function findingOf(url: URL | undefined): Promise<string | undefined> {
  if (!url || !/^https?:$/.test(url.protocol)) return url?.href;
  try {
    const response = await fetch(url);
    response.body?.cancel().catch(() => {});
    if (!response.ok) return `${url} answers HTTP ${response.status}`;
    const type = response.headers.get("content-type") ?? "no type";
    return /javascript/.test(type) ? url.href : `${url} is served as ${type}, not as JavaScript`;
  } catch {
    return `${url} cannot be fetched`;
  }
}

function notStarted(kind: Kind, place: string | undefined, error: unknown): TetralodError {
  const found = [place, known(error).message ?? error].filter((part) => part && typeof part === "string").join("; ");
  const policy = "If the page has a Content-Security-Policy, worker-src must allow it";
  const remedy = `Set \`workerUrl\` to the address of "${kind.entry}" as your server or bundler gives it${kind.remedy}.`;
  const message = `the worker did not start (${found || "no reason given"}). ${remedy} ${policy}.`;
  return new TetralodError("worker", message, { cause: error });
}

/** A wasm module: its address, or its bytes. */
export type WasmSource = string | URL | Uint8Array<ArrayBuffer> | Promise<Uint8Array<ArrayBuffer>>;

/** What a worker says when it has loaded its wasm module. */
export interface Loaded {
  name: string;
  version: string;
}

/** Makes sure that the worker that answers a call of `load` is the one of this package. */
export async function checkWorker(kind: Kind, answer: Promise<Loaded | undefined>) {
  const found = await answer;
  if (found?.name === kind.name && found.version === VERSION) return;
  const other = found ? `tetralod ${found.version}, ${found.name}` : "something else";
  const wanted = `"${kind.entry}" of tetralod ${VERSION} is needed`;
  throw new TetralodError("worker", `the worker is of ${other}; ${wanted}: \`workerUrl\` must lead to the same version`);
}

/** What to instantiate: the response of a server, or bytes. */
export async function wasmOf(source: WasmSource): Promise<Response | Uint8Array<ArrayBuffer>> {
  const given = await source;
  if (given instanceof Uint8Array) return given;
  const url = new URL(given);
  // Node cannot fetch files; browsers compile while they download.
  const fs = url.protocol === "file:" ? nodeModule("node:fs/promises") : undefined;
  if (fs) return fs.readFile(url);
  const response = await fetch(url).catch((error) => {
    throw new Error(`${url}: ${error?.message ?? error}`);
  });
  const type = response.headers.get("content-type") ?? "";
  if (!response.ok) throw new Error(`${url}: HTTP ${response.status}`);
  // What servers of pages with routes of their own answer where there is no file.
  if (type.startsWith("text/html")) throw new Error(`${url}: the server sends a page (${type}), not the wasm file`);
  return response;
}

/** Why no wasm module could be loaded, and what to do. */
export function wasmError(error: unknown, entry: string): TetralodError {
  const problem = known(error).message ?? String(error);
  const remedy = /unsafe-eval|Content.Security.Policy/i.test(problem)
    ? "allow 'wasm-unsafe-eval' in script-src of the Content-Security-Policy of the page and of the worker's file"
    : `set \`wasmUrl\` to the address of "${entry}" as your server or bundler gives it`;
  return new TetralodError("wasm", `the wasm module did not load: ${problem}; ${remedy}`, { cause: error });
}
