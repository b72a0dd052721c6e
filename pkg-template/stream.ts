/**
 * Everything that an MT can be read from, as one stream of chunks: with abort, with errors that name the source, and
 * with backpressure (the next chunk is read when the last one has been taken).
 *
 * A chunk that comes out of here owns its buffer, so it may be moved into a worker.
 */

import { TetralodError, known, ofFile } from "./errors.js";
import { portEndpoint, serve } from "./rpc.js";
import { STATED, shardAddress, shardSuffix, statedBytes } from "./shards.js";

/** Everything that an MT can be read from. Bytes in memory are copied, not taken away. */
export type Source =
  | string
  | URL
  | Request
  | Response
  | Blob
  | ArrayBuffer
  | ArrayBufferView
  | ReadableStream<Uint8Array>
  | AsyncIterable<Uint8Array>
  | RangeReader;

/** A file of which the page's own code reads byte ranges: out of an archive, or over a connection of its own. */
export interface RangeReader {
  /** What to call the file in messages. */
  name: string;
  /** In bytes. */
  size: number;
  /**
   * The bytes from `start` to just before `end`, which is at most `size`; several calls may wait at a time. They are copied, not taken
   * away. What it throws ends the reading, and is the error of whoever waits; with a `code` of `ErrorCode` it keeps that.
   */
  read(start: number, end: number): Uint8Array | Promise<Uint8Array>;
  /**
   * Where the file is not all there, as in pages of `tetralod html`: start and end of each range that is, ascending; the first has all in
   * front of the blocks. A request that needs others gives the best mesh without them, with `limitedBy: "part"`.
   */
  ranges?: readonly number[];
}

/** Bytes in memory are handed on in pieces of this size, so that progress shows and abort works. */
const PIECE = 1 << 20;

/** Bytes that own their buffer. */
type Bytes = Uint8Array<ArrayBuffer>;

/** Chunks of a source, checked. */
interface Chunks {
  next(): Promise<IteratorResult<Bytes, undefined>>;
  return?(value?: undefined): unknown;
}

/** A source that is open. */
export interface OpenSource {
  /** What to call the source in messages. */
  name: string;
  /** Its size in bytes where that is known. */
  total: number | undefined;
  chunks: Chunks;
}

/** What goes along with a request. */
export interface Along {
  headers?: HeadersInit;
  credentials?: RequestCredentials;
}

/** Opens `source`; for a URL this waits for the response's status. */
export async function openSource(source: Source, signal?: AbortSignal, { headers, credentials }: Along = {}): Promise<OpenSource> {
  signal?.throwIfAborted();
  const url = urlOf(source);
  if (url !== undefined && nodeModule("node:fs") && isPath(url)) throw new TetralodError("bad-source", `${url}: ${NO_PATH}`);
  if (url?.startsWith("file:") && nodeModule("node:fs")) return withShards(await openFile(url), (next) => openFile(next).catch(() => undefined), url);
  if (url !== undefined) {
    const given = source as string | URL | Request;
    const along = { signal, headers, credentials };
    const openNext = async (next: string) => {
      const response = await request(isInstance(given, "Request") ? new Request(next, given) : next, next, along);
      const isThere = response.ok && !/^text\/html/i.test(response.headers.get("content-type") ?? "");
      if (isThere) return openResponse(response, next);
      response.body?.cancel().catch(() => {});
      return undefined;
    };
    return withShards(openResponse(await request(given, url, along), url), openNext, url);
  }
  if (isInstance(source, "Response")) return openResponse(source, source.url || "response");
  if (isInstance(source, "Blob")) return open(source.name || "blob", source.size, source.stream());
  if (isReader(source)) {
    if (source.ranges) throw new TetralodError("bad-source", `${source.name} is a part of a file, which cannot be read as a whole`);
    return { name: source.name, total: source.size, chunks: piecesOf(source) };
  }
  const bytes = bytesOf(source);
  if (bytes) return { name: "bytes", total: bytes.byteLength, chunks: pieces(bytes) };
  return open("stream", undefined, source);
}

/** A source with the shards that its header says that it goes on in, if it does. */
function withShards(first: OpenSource, openNext: (url: string) => Promise<OpenSource | undefined>, url: string): OpenSource {
  const start = new Uint8Array(STATED);
  let [shard, number, at, size] = [first, 0, 0, 0];
  // Where the shard begins and ends.
  let [from, end] = [0, Infinity];
  const check = (length: number) => {
    if (length !== end - from) throw wrongShard(number, length, end - from);
  };
  const next = async (): Promise<IteratorResult<Bytes, undefined>> => {
    for (;;) {
      const found = await shard.chunks.next();
      if (!found.done) {
        if (at < STATED) start.set(found.value.subarray(0, STATED - at), at);
        at += found.value.length;
        if (at > end) check(at - from);
        return found;
      }
      const total = statedBytes(start) ?? 0;
      if (number === 0) size = at;
      else check(at - from);
      if (at >= total) return found;
      const opened = await openNext(shardAddress(url, ++number));
      if (!opened) throw missingShard(number, at, total);
      [shard, from, end] = [opened, at, Math.min(at + size, total)];
      if (opened.total !== undefined) check(opened.total);
    }
  };
  return { ...first, chunks: { next, return: () => shard.chunks.return?.() } };
}

/** The same errors as those of the loader, which reads files in parts. */
function missingShard(number: number, from: number, total: number) {
  const what = `the file should have ${total} bytes, and those from ${from} on are missing`;
  const why = `either it was cut off, or it is in shards, and the one whose name ends in \`${shardSuffix(number)}\` is not there`;
  return new TetralodError("truncated", `${what}: ${why}; copy it again, with all files whose names begin with its name`);
}

function wrongShard(number: number, found: number, expected: number) {
  const what = `the shard whose name ends in \`${shardSuffix(number)}\` has ${found} bytes instead of ${expected}`;
  const why = "it was cut off, or belongs to another version of the file";
  const remedy = "copy all files again whose names begin with the name of the first one";
  return new TetralodError(found < expected ? "truncated" : "corrupt", `${what}: ${why}; ${remedy}`);
}

/** What takes the chunks of a source. */
interface Sink {
  feed(chunk: Bytes): unknown;
  finish(): unknown;
}

/**
 * Feeds every chunk to `feed`, waits for each before it reads on, and calls `finish` at the end. Errors of the decoder,
 * which does not know what it decodes, come out with the name of the source. The end of the signal ends a wait at once; the promise then
 * rejects with its reason.
 */
export async function pump({ name, chunks }: OpenSource, { feed, finish }: Sink, signal?: AbortSignal) {
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

const naming = (name: string, error: unknown) =>
  error instanceof TetralodError && DECODING.includes(error.code) ? ofFile(name, error) : error;

/** `promise`, or the signal's reason as soon as it fires. */
export async function abortable<T>(promise: T | Promise<T>, signal: AbortSignal | undefined): Promise<T> {
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

async function request(source: string | URL | Request, url: string, options: Along & { signal?: AbortSignal }): Promise<Response> {
  try {
    // A Request keeps what is not said otherwise; undefined would say otherwise.
    const said = Object.entries(options).filter(([, value]) => value !== undefined);
    return await fetch(source, Object.fromEntries(said));
  } catch (error) {
    options.signal?.throwIfAborted();
    const { name, message, cause } = known(error);
    if (name === "AbortError") throw error;
    throw new TetralodError("network", `${url}: ${cause?.message ?? message}`, { cause: error });
  }
}

function openResponse(response: Response, name: string): OpenSource {
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

async function openFile(url: string): Promise<OpenSource> {
  const { promises, createReadStream } = nodeModule("node:fs");
  const { size } = await promises.stat(new URL(url)).catch((error: Error) => {
    throw new TetralodError("network", `${url}: ${error.message}`, { cause: error });
  });
  return open(url, size, createReadStream(new URL(url)));
}

function open(name: string, total: number | undefined, source: unknown): OpenSource {
  const iterator = iteratorOf(source);
  if (!iterator) throw new TetralodError("bad-source", `cannot read from ${describe(source)}: ${KINDS}`);
  return { name, total, chunks: named(iterator, name) };
}

const KINDS = "give a URL, Request, Response, Blob, ArrayBuffer, Uint8Array, ReadableStream, async iterable of Uint8Array, or { name, size, read(start, end) }";

const NO_PATH = 'a path is no URL; in Node, give pathToFileURL(path) of "node:url"';

/** Whether a text is no URL, or begins with the letter of a drive. */
const isPath = (text: string) => !URL.canParse(text) || /^[a-z]:[\\/]/i.test(text);

/** What gives chunks, of which nothing is known. */
interface Unknowns {
  next(): IteratorResult<unknown> | Promise<IteratorResult<unknown>>;
  return?(): unknown;
}

function iteratorOf(source: unknown): Unknowns | undefined {
  const { getReader, [Symbol.asyncIterator]: later, [Symbol.iterator]: now } = Object(source);
  if (typeof getReader === "function") return readerIterator(source as ReadableStream);
  return (later ?? now)?.call(source);
}

/** Not every browser can iterate a stream; every one has readers. */
function readerIterator(stream: ReadableStream<unknown>): Unknowns {
  const reader = stream.getReader();
  return { next: () => reader.read() as Promise<IteratorResult<unknown>>, return: () => reader.cancel() };
}

/** `iterator` with chunks that are checked and own their buffers, and with failures that name the source. */
function named(iterator: Unknowns, name: string): Chunks {
  return {
    async next() {
      const { done, value } = await nextOf(iterator, name);
      return done ? { done, value: undefined } : { done: false, value: owned(value, name) };
    },
    return: () => iterator.return?.(),
  };
}

async function nextOf(iterator: Unknowns, name: string): Promise<IteratorResult<unknown>> {
  try {
    return await iterator.next();
  } catch (error) {
    const { name: kind, message } = known(error);
    if (kind === "AbortError") throw error;
    throw new TetralodError("network", `${name}: ${message ?? error}`, { cause: error });
  }
}

function owned(chunk: unknown, name: string): Bytes {
  const bytes = bytesOf(chunk);
  if (!bytes) throw new TetralodError("bad-source", `${name}: gave ${describe(chunk)} where a Uint8Array belongs`);
  return bytes.slice();
}

async function* pieces(bytes: Uint8Array): AsyncGenerator<Bytes, undefined> {
  for (let at = 0; at < bytes.byteLength; at += PIECE) yield bytes.slice(at, at + PIECE);
}

async function* piecesOf(source: RangeReader): AsyncGenerator<Bytes, undefined> {
  for (let at = 0; at < source.size; at += PIECE) yield readOf(source, at, Math.min(at + PIECE, source.size));
}

/** The bytes of a range, checked. */
async function readOf(source: RangeReader, start: number, end: number): Promise<Bytes> {
  let bytes: Uint8Array | undefined;
  try {
    bytes = bytesOf(await source.read(start, end));
  } catch (error) {
    const { code, message } = known(error);
    if (typeof code === "string") throw error;
    throw new TetralodError("network", message ?? String(error), { cause: error });
  }
  if (bytes?.byteLength === end - start) return bytes.slice();
  throw new TetralodError("bad-source", `\`read(${start}, ${end})\` gave ${bytes ? `${bytes.byteLength} bytes` : "no bytes"}`);
}

function bytesOf(value: unknown): Uint8Array | undefined {
  if (value instanceof ArrayBuffer) return new Uint8Array(value);
  if (!ArrayBuffer.isView(value)) return undefined;
  // A plain Uint8Array over the same bytes: `slice` of a Node Buffer would share its pool.
  return new Uint8Array(value.buffer, value.byteOffset, value.byteLength);
}

/** What `Ranges` needs to fetch a file in parts: its address, and what goes along; or a file of the user or a reader, and its name. */
export interface RangesSource {
  url: string;
  headers?: [string, string][];
  credentials?: RequestCredentials;
  blob?: Blob;
  reader?: ReaderPort;
  name?: string;
}

/** A reader in another thread, which is asked through a port. */
export interface ReaderPort {
  size: number;
  port: MessagePort;
  ranges?: readonly number[];
}

/** What is answered there. */
export type ReaderMethods = { read(start: number, end: number): Promise<{ bytes: Bytes }> };

/** Answers for `source` until the other end closes. */
function portOf(source: RangeReader): MessagePort {
  const { port1, port2 } = new MessageChannel();
  const endpoint = portEndpoint(port1);
  const read = async (start: number, end: number) => ({ bytes: await readOf(source, start, end) });
  serve(endpoint, { read, free: () => port1.close() }, ["read"]);
  endpoint.hold?.(false);
  return port2;
}

/** What goes to a worker with such a source. */
export const transferOf = ({ reader }: Partial<RangesSource>) => (reader ? [reader.port] : []);

/** The same of `source`, if that is a file on a server or of the user. */
export function rangesOf(source: Source, { headers, credentials }: Along = {}): RangesSource | undefined {
  // A Blob without content is a file that ended too early. Node 20 crashes when a worker reads a Blob that is backed by a file.
  if (isInstance(source, "Blob") && source.size > 0 && !nodeModule("node:worker_threads")) {
    const name = source.name || "blob";
    return { url: `blob:${encodeURIComponent(name)}`, blob: source, name };
  }
  if (isReader(source)) {
    const { name, size, ranges } = source;
    return { url: `reader:${encodeURIComponent(name)}`, reader: { size, port: portOf(source), ...(ranges && { ranges: [...ranges] }) }, name };
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

/** Whether `source` can be read again. */
export function isRepeatable(source: Source): boolean {
  if (isInstance(source, "Request")) return source.method === "GET";
  return urlOf(source) !== undefined || isReader(source) || isInstance(source, "Blob") || source instanceof ArrayBuffer || ArrayBuffer.isView(source);
}

/** `url` as it means the same in a worker; as it is where it means nothing. */
function absolute(url: string): string {
  try {
    return new URL(url, globalThis.location?.href).href;
  } catch {
    return url;
  }
}

function urlOf(source: Source): string | undefined {
  if (typeof source === "string") return source;
  if (source instanceof URL) return source.href;
  return isInstance(source, "Request") ? source.url : undefined;
}

/** Streams of Node have `read`, too, but no size. */
function isReader(source: Source): source is RangeReader {
  const { read, size } = Object(source);
  return typeof read === "function" && Number.isSafeInteger(size);
}

/** Classes that a runtime may lack. */
interface Classes {
  Request: Request;
  Response: Response;
  Blob: Blob & { name?: string };
}

/** `instanceof` for these. */
function isInstance<Name extends keyof Classes>(value: unknown, name: Name): value is Classes[Name] {
  return typeof globalThis[name] === "function" && value instanceof globalThis[name];
}

function describe(value: unknown): string {
  return value === null ? "null" : typeof value === "object" ? `a ${value.constructor?.name ?? "object"}` : `a ${typeof value}`;
}

/** A built-in module of Node, found in a way that no bundler tries to follow; `undefined` elsewhere. */
export function nodeModule(name: string): any {
  const { process } = globalThis as { process?: { getBuiltinModule?(name: string): unknown } };
  return process?.getBuiltinModule?.(name);
}
