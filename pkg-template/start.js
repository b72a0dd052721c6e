/**
 * Starts the workers of the package: from its own folder, from another origin, from an address that the caller gives, or in
 * a worker that the caller has made. What does not start is a mistake of configuration, and its error says what to do.
 */

import { TetralodError } from "./errors.js";
import { Remote, nodeEndpoint, webEndpoint } from "./rpc.js";
import { nodeModule } from "./stream.js";
import { VERSION } from "./version.js";

/**
 * A worker of the package.
 *
 * @typedef {object} Kind
 * @property {string} name `core` or `viewer`
 * @property {string} entry what to import it as
 * @property {() => Worker} start starts it in a page, from the page's own origin
 * @property {() => URL | undefined} script its address, where it is not embedded
 * @property {string} remedy what else to do when it does not start
 */

/** The options that choose a worker, and the address of the wasm module. */
export const PLACES = ["worker", "workerUrl", "workerTimeoutMs", "wasmUrl"];

/** How long a worker may take to load its script and answer, in milliseconds; its work may take any time. */
const TIMEOUT = 30_000;

/** An address that means the same in a worker. */
export function absoluteUrl(name, url) {
  try {
    return new URL(url, globalThis.location?.href);
  } catch (error) {
    throw new TetralodError("bad-option", `option \`${name}\`: ${url} is not a URL`, { cause: error });
  }
}

/**
 * Starts a worker.
 *
 * @param {Kind} kind
 * @param {{ worker?: any, workerUrl?: string | URL, workerTimeoutMs?: number }} options
 * @param {(name: string, data: any) => void} onEvent
 */
export function startWorker(kind, { worker = true, workerUrl, workerTimeoutMs = TIMEOUT }, onEvent) {
  if (worker !== true && workerUrl !== undefined) {
    throw new TetralodError("bad-option", "option `workerUrl`: goes with `worker: true` only");
  }
  if (!(workerTimeoutMs >= 0)) throw new TetralodError("bad-option", "option `workerTimeoutMs`: must be a number that is not negative");
  const remote = worker === true ? ownWorker(kind, workerUrl, onEvent) : givenWorker(kind, worker, onEvent);
  remote.greet(workerTimeoutMs, `it has not answered within ${workerTimeoutMs / 1000} s; with \`workerTimeoutMs\` it has more time`);
  return remote;
}

const givenWorker = (kind, worker, onEvent) => new Remote(endpointOf(worker), onEvent, (error) => notStarted(kind, undefined, error));

function ownWorker(kind, workerUrl, onEvent) {
  const url = workerUrl === undefined ? kind.script() : absoluteUrl("workerUrl", workerUrl);
  try {
    const endpoint = begin(kind, url, workerUrl !== undefined);
    return new Remote(endpoint, onEvent, async (error) => notStarted(kind, await findingOf(url), error));
  } catch (error) {
    throw notStarted(kind, url?.href, error);
  }
}

function begin(kind, url, isGiven) {
  const node = nodeModule("node:worker_threads");
  if (node && url) return nodeEndpoint(new node.Worker(url));
  if (url && isForeign(url)) return foreignEndpoint(url);
  return endpointOf(isGiven ? new Worker(url, { type: "module" }) : kind.start());
}

/** The caller's own worker; in Node one of `worker_threads`. */
function endpointOf(worker) {
  if (typeof worker?.postMessage === "function") {
    return typeof worker.addEventListener === "function" ? webEndpoint(worker) : nodeEndpoint(worker);
  }
  throw new TetralodError("bad-option", "option `worker`: must be true, false or a Worker");
}

/** Whether a page may not start a worker from there. */
function isForeign({ protocol, origin }) {
  const page = globalThis.location?.origin;
  return /^https?:$/.test(protocol) && page !== undefined && origin !== page;
}

/** A page starts workers from its own origin only; this one imports the other. */
function foreignEndpoint(url) {
  const script = new Blob([`import ${JSON.stringify(url.href)};`], { type: "text/javascript" });
  const own = URL.createObjectURL(script);
  const endpoint = webEndpoint(new Worker(own, { type: "module" }));
  // Only from the first message on is it sure that the browser has read it.
  endpoint.onMessage(() => URL.revokeObjectURL(own));
  endpoint.onError?.(() => URL.revokeObjectURL(own));
  return endpoint;
}

/** What is at the address of a worker that did not start. Browsers do not tell why it did not. */
async function findingOf(url) {
  if (!/^https?:$/.test(url?.protocol)) return url?.href;
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

function notStarted(kind, place, error) {
  const found = [place, error?.message ?? error].filter((part) => part && typeof part === "string").join("; ");
  const policy = "If the page has a Content-Security-Policy, worker-src must allow it";
  const remedy = `Set \`workerUrl\` to the address of "${kind.entry}" as your server or bundler gives it${kind.remedy}.`;
  const message = `the worker did not start (${found || "no reason given"}). ${remedy} ${policy}.`;
  return new TetralodError("worker", message, { cause: error });
}

/**
 * Loads the wasm module, and makes sure that the worker is the one of this package.
 *
 * @param {{ call: (method: string, args: any[]) => Promise<any> }} core
 * @param {Kind} kind
 * @param {any} wasm its address or its bytes; without it the one beside the worker
 * @param {string} [ahead] for viewers, the URL of a file that is opened next, whose first bytes are fetched meanwhile
 */
export async function loadWasm(core, kind, wasm, ahead = undefined) {
  const found = await core.call("load", [wasm, ahead]);
  if (found?.name === kind.name && found.version === VERSION) return;
  const other = found ? `tetralod ${found.version}, ${found.name}` : "something else";
  const wanted = `"${kind.entry}" of tetralod ${VERSION} is needed`;
  throw new TetralodError("worker", `the worker is of ${other}; ${wanted}: \`workerUrl\` must lead to the same version`);
}

/**
 * What to instantiate: the response of a server, or bytes.
 *
 * @param {string | URL | Uint8Array | Promise<Uint8Array>} source
 */
export async function wasmOf(source) {
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
export function wasmError(error, entry) {
  const isPolicy = /unsafe-eval|Content.Security.Policy/i.test(String(error?.message));
  const remedy = isPolicy
    ? "allow 'wasm-unsafe-eval' in script-src of the Content-Security-Policy of the page and of the worker's file"
    : `set \`wasmUrl\` to the address of "${entry}" as your server or bundler gives it`;
  return new TetralodError("wasm", `the wasm module did not load: ${error?.message ?? error}; ${remedy}`, { cause: error });
}
