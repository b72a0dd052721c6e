/**
 * Everything that an MT can be read from, as one stream of chunks: with abort, with errors that name the source, and
 * with backpressure (the next chunk is read when the last one has been taken).
 *
 * A chunk that comes out of here owns its buffer, so it may be moved into a worker.
 */

import { TetralodError } from "./errors.js";

/** Bytes in memory are handed on in pieces of this size, so that progress shows and abort works. */
const PIECE = 1 << 20;

/**
 * @typedef {object} OpenSource
 * @property {string} name what to call the source in messages
 * @property {number | undefined} total its size in bytes where that is known
 * @property {AsyncIterator<Uint8Array>} chunks
 */

/**
 * Opens `source`; for a URL this waits for the response's status.
 *
 * @param {import("./index.js").Source} source
 * @param {AbortSignal} [signal]
 * @param {{ headers?: HeadersInit, credentials?: RequestCredentials }} [along] goes along with a request
 * @returns {Promise<OpenSource>}
 */
export async function openSource(source, signal, { headers, credentials } = {}) {
  signal?.throwIfAborted();
  const url = urlOf(source);
  if (url !== undefined && nodeModule("node:fs") && isPath(url)) throw new TetralodError("bad-source", `${url}: ${NO_PATH}`);
  if (url?.startsWith("file:") && nodeModule("node:fs")) return openFile(url);
  if (url !== undefined) return openResponse(await request(source, url, { signal, headers, credentials }), url);
  if (isInstance(source, "Response")) return openResponse(source, source.url || "response");
  if (isInstance(source, "Blob")) return open(source.name || "blob", source.size, source.stream());
  const bytes = bytesOf(source);
  if (bytes) return { name: "bytes", total: bytes.byteLength, chunks: pieces(bytes) };
  return open("stream", undefined, source);
}

/**
 * Feeds every chunk to `feed`, waits for each before it reads on, and calls `finish` at the end. Errors of the decoder,
 * which does not know what it decodes, come out with the name of the source.
 *
 * @param {OpenSource} source
 * @param {{ feed: (chunk: Uint8Array) => unknown, finish: () => unknown }} sink
 * @param {AbortSignal} [signal] ends a wait at once; the promise then rejects with the signal's reason
 */
export async function pump({ name, chunks }, { feed, finish }, signal) {
  try {
    for (;;) {
      const { done, value } = await abortable(chunks.next(), signal);
      if (done) break;
      await abortable(feed(value), signal);
    }
    await abortable(finish(), signal);
  } catch (error) {
    throw naming(name, error);
  } finally {
    // Not awaited: a source that hangs must not hold up the error. After the end this does nothing.
    Promise.resolve(chunks.return?.()).catch(() => {});
  }
}

/** What the decoder says of a file. */
const DECODING = ["not-mt", "unsupported-version", "corrupt", "truncated", "limit"];

function naming(name, error) {
  if (!(error instanceof TetralodError) || !DECODING.includes(error.code)) return error;
  return new TetralodError(error.code, `${name}: ${error.message}`, { cause: error });
}

/** `promise`, or the signal's reason as soon as it fires. */
export function abortable(promise, signal) {
  if (!signal) return promise;
  return new Promise((resolve, reject) => {
    const onAbort = () => reject(signal.reason);
    if (signal.aborted) onAbort();
    signal.addEventListener("abort", onAbort, { once: true });
    Promise.resolve(promise)
      .then(resolve, reject)
      .finally(() => signal.removeEventListener("abort", onAbort));
  });
}

async function request(source, url, options) {
  try {
    // A Request keeps what is not said otherwise; undefined would say otherwise.
    const said = Object.entries(options).filter(([, value]) => value !== undefined);
    return await fetch(source, Object.fromEntries(said));
  } catch (error) {
    options.signal?.throwIfAborted();
    if (error?.name === "AbortError") throw error;
    throw new TetralodError("network", `${url}: ${error?.cause?.message ?? error.message}`, { cause: error });
  }
}

function openResponse(response, name) {
  if (!response.ok) {
    response.body?.cancel().catch(() => {});
    throw new TetralodError("network", `${name}: HTTP ${response.status} ${response.statusText}`.trimEnd());
  }
  if (response.bodyUsed || !response.body) throw new TetralodError("bad-source", `${name}: the response has no unread body`);
  // Under a content encoding the length counts the packed bytes, which never pass through here.
  const packed = response.headers.get("content-encoding");
  const length = packed && packed !== "identity" ? null : response.headers.get("content-length");
  return open(name, length === null ? undefined : Number(length), response.body);
}

async function openFile(url) {
  const { promises, createReadStream } = nodeModule("node:fs");
  const { size } = await promises.stat(new URL(url)).catch((error) => {
    throw new TetralodError("network", `${url}: ${error.message}`, { cause: error });
  });
  return open(url, size, createReadStream(new URL(url)));
}

function open(name, total, source) {
  const iterator = iteratorOf(source);
  if (!iterator) throw new TetralodError("bad-source", `cannot read from ${describe(source)}: ${KINDS}`);
  return { name, total, chunks: named(iterator, name) };
}

const KINDS = "give a URL, Request, Response, Blob, ArrayBuffer, Uint8Array, ReadableStream or async iterable of Uint8Array";

const NO_PATH = 'a path is no URL; in Node, give pathToFileURL(path) of "node:url"';

/** Whether a text is no URL, or begins with the letter of a drive. */
const isPath = (text) => !URL.canParse(text) || /^[a-z]:[\\/]/i.test(text);

function iteratorOf(source) {
  if (typeof source?.getReader === "function") return readerIterator(source);
  return source?.[Symbol.asyncIterator]?.() ?? source?.[Symbol.iterator]?.();
}

/** Not every browser can iterate a stream; every one has readers. */
function readerIterator(stream) {
  const reader = stream.getReader();
  return { next: () => reader.read(), return: () => reader.cancel() };
}

/** `iterator` with chunks that are checked and own their buffers, and with failures that name the source. */
function named(iterator, name) {
  return {
    async next() {
      const { done, value } = await nextOf(iterator, name);
      return done ? { done, value: undefined } : { done: false, value: owned(value, name) };
    },
    return: () => iterator.return?.(),
  };
}

async function nextOf(iterator, name) {
  try {
    return await iterator.next();
  } catch (error) {
    if (error?.name === "AbortError") throw error;
    throw new TetralodError("network", `${name}: ${error?.message ?? error}`, { cause: error });
  }
}

function owned(chunk, name) {
  const bytes = bytesOf(chunk);
  if (!bytes) throw new TetralodError("bad-source", `${name}: gave ${describe(chunk)} where a Uint8Array belongs`);
  return bytes.slice();
}

async function* pieces(bytes) {
  for (let at = 0; at < bytes.byteLength; at += PIECE) yield bytes.slice(at, at + PIECE);
}

function bytesOf(value) {
  if (value instanceof ArrayBuffer) return new Uint8Array(value);
  if (!ArrayBuffer.isView(value)) return undefined;
  // A plain Uint8Array over the same bytes: `slice` of a Node Buffer would share its pool.
  return new Uint8Array(value.buffer, value.byteOffset, value.byteLength);
}

/**
 * What `Ranges` needs to fetch `source` in parts, if that is a file on a server or of the user: its address, and what goes along.
 *
 * @param {import("./index.js").Source} source
 * @param {{ headers?: HeadersInit, credentials?: RequestCredentials }} [along] goes along with a request
 * @returns {{ url: string, headers?: [string, string][], credentials?: RequestCredentials, blob?: Blob, name?: string } | undefined}
 */
export function rangesOf(source, { headers, credentials } = {}) {
  // A Blob without content is a file that ended too early. Node 20 crashes when a worker reads a Blob that is backed by a file.
  if (isInstance(source, "Blob") && source.size > 0 && !nodeModule("node:worker_threads")) {
    const name = source.name || "blob";
    return { url: `blob:${encodeURIComponent(name)}`, blob: source, name };
  }
  const given = urlOf(source);
  const url = given === undefined ? "" : absolute(given);
  if (!/^https?:/.test(url)) return undefined;
  const request = isInstance(source, "Request") ? source : undefined;
  if (request && request.method !== "GET") return undefined;
  const own = new Headers(request?.headers);
  new Headers(headers).forEach((value, name) => own.set(name, value));
  return { url, headers: [...own], credentials: credentials ?? request?.credentials };
}

/** Whether `source` can be read again. @param {any} source */
export function isRepeatable(source) {
  if (isInstance(source, "Request")) return source.method === "GET";
  return urlOf(source) !== undefined || isInstance(source, "Blob") || source instanceof ArrayBuffer || ArrayBuffer.isView(source);
}

/** `url` as it means the same in a worker; as it is where it means nothing. */
function absolute(url) {
  try {
    return new URL(url, globalThis.location?.href).href;
  } catch {
    return url;
  }
}

function urlOf(source) {
  if (typeof source === "string") return source;
  if (source instanceof URL) return source.href;
  return isInstance(source, "Request") ? source.url : undefined;
}

/**
 * `instanceof` for classes that a runtime may lack.
 *
 * @template {"Request" | "Response" | "Blob"} Name
 * @param {any} value
 * @param {Name} name
 * @returns {value is { Request: Request, Response: Response, Blob: Blob & { name?: string } }[Name]}
 */
function isInstance(value, name) {
  return typeof globalThis[name] === "function" && value instanceof globalThis[name];
}

function describe(value) {
  return value === null ? "null" : typeof value === "object" ? `a ${value.constructor?.name ?? "object"}` : `a ${typeof value}`;
}

/** A built-in module of Node, found in a way that no bundler tries to follow; `undefined` elsewhere. */
export function nodeModule(name) {
  return globalThis.process?.getBuiltinModule?.(name);
}
