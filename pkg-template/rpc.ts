/**
 * Calls into a worker and answers out of it. One message a call, answered in the order of the calls, so that a
 * worker's state needs no locks; typed arrays in an answer are moved, not copied.
 */

import { type FlatError, TetralodError, flattenError, known, reviveError } from "./errors.js";

/** The two ends of a channel look the same to this module. */
export interface Endpoint {
  post(message: object, transfer?: Transferable[]): void;
  onMessage(listener: (message: any) => void): void;
  onError?(listener: (error: unknown) => void): void;
  close?(): void;
  /** Whether the process must wait for this channel (Node only). */
  hold?(keepAlive: boolean): void;
}

/** A worker of `worker_threads`, in Node. */
export interface NodeWorker {
  postMessage(message: any, transfer?: readonly any[]): void;
  on(event: string, listener: (value: any) => void): unknown;
  terminate(): unknown;
}

/** What a browser has at each end of a worker. */
interface WebEnd {
  postMessage(message: object, transfer: Transferable[]): void;
  addEventListener(name: string, listener: (event: any) => void): void;
  terminate?(): void;
}

/** What Node has at each end of a worker. */
interface NodeEnd {
  postMessage(message: object, transfer: readonly any[]): void;
  on(name: string, listener: (value: any) => void): unknown;
  terminate?(): unknown;
  ref?(): void;
  unref?(): void;
}

/** The end of a browser `Worker` that its owner holds, or the worker's own end (`globalThis`). */
export function webEndpoint(target: WebEnd): Endpoint {
  return {
    post: (message, transfer = []) => target.postMessage(message, transfer),
    onMessage: (listener) => target.addEventListener("message", (event) => listener(event.data)),
    onError: (listener) => {
      target.addEventListener("error", (event) => listener(event.error ?? event.message));
      target.addEventListener("messageerror", () => listener("a message could not be read"));
    },
    close: () => target.terminate?.(),
  };
}

/** The worker's own end in a page. */
export const ownEndpoint = () => webEndpoint(globalThis as unknown as WebEnd);

/** The end of a Node `Worker` that its owner holds, or its `parentPort`. */
export function nodeEndpoint(target: NodeEnd): Endpoint {
  return {
    post: (message, transfer = []) => target.postMessage(message, transfer),
    onMessage: (listener) => target.on("message", listener),
    onError: (listener) => {
      target.on("error", listener);
      target.on("messageerror", listener);
      target.on("exit", () => listener("the worker ended"));
    },
    close: () => target.terminate?.(),
    hold: (keepAlive) => (keepAlive ? target.ref?.() : target.unref?.()),
  };
}

const failure = (error: unknown): Error =>
  new TetralodError("internal", `the worker failed: ${known(error).message ?? error ?? "no reason given"}`);

/** One end of a `MessageChannel`, in a page and in Node. */
export function portEndpoint(port: MessagePort): Endpoint {
  const node: { ref?(): void; unref?(): void } = port as object;
  return {
    post: (message, transfer = []) => port.postMessage(message, transfer),
    onMessage: (listener) => {
      port.addEventListener("message", (event) => listener(event.data));
      port.start();
    },
    close: () => {
      port.postMessage({ method: "free", args: [] });
      port.close();
    },
    hold: (keepAlive) => (keepAlive ? node.ref?.() : node.unref?.()),
  };
}

/** What a session calls back with: the name of an event, and what it is about. */
export type OnEvent = (name: string, data: any) => void;

/** The methods that a worker answers. */
export type Methods = Record<string, (...args: any[]) => any>;

/** What a call of `Method` takes and gives. */
export type Args<M extends Methods, Method extends keyof M> = Parameters<M[Method]>;
export type Answer<M extends Methods, Method extends keyof M> = Promise<Awaited<ReturnType<M[Method]>>>;

/** The caller's side. */
export class Remote<M extends Methods> {
  #endpoint: Endpoint;
  #pending = new Map<number, { resolve: (result: any) => void; reject: (error: unknown) => void }>();
  #next = 0;
  #closed: Error | undefined;
  /** Other sessions in the worker. */
  #views = new Set<Remote<M>>();
  /** Whether the worker has answered: then it has started. */
  #started = false;
  #notStarted: (error: unknown) => Error | Promise<Error>;

  /**
   * @param onEvent gets what the worker emits unasked
   * @param notStarted makes the error for a worker that fails before it has answered
   */
  constructor(endpoint: Endpoint, onEvent: OnEvent = () => {}, notStarted: (error: unknown) => Error | Promise<Error> = failure) {
    this.#endpoint = endpoint;
    this.#notStarted = notStarted;
    endpoint.onMessage((message) => ("event" in message ? onEvent(message.event, message.data) : this.#settle(message)));
    endpoint.onError?.((error) => this.#failed(error));
    endpoint.hold?.(false);
  }

  /** Ends a worker that does not answer in time, for `problem`: browsers do not report a script that loads and never listens. */
  async greet(milliseconds: number, problem: string) {
    // Timers cannot wait longer.
    const timer = milliseconds < 2 ** 31 ? setTimeout(() => this.#failed(problem), milliseconds) : undefined;
    // Any answer will do, also that of another version; what else ends the worker rejects the calls that follow.
    await this.#post("hello", [], []).catch(() => {});
    clearTimeout(timer);
  }

  async #failed(error: unknown) {
    if (!this.#closed) this.close(await (this.#started ? failure : this.#notStarted)(error));
  }

  /** Calls `method` over there; `transfer` lists the buffers in `args` to move instead of copying. */
  call<Method extends keyof M & string>(method: Method, args: Args<M, Method>, transfer: Transferable[] = []): Answer<M, Method> {
    return this.#post(method, args, transfer);
  }

  #post(method: string, args: any[], transfer: Transferable[]): Promise<any> {
    if (this.#closed) return Promise.reject(this.#closed);
    const id = this.#next++;
    return new Promise((resolve, reject) => {
      this.#pending.set(id, { resolve, reject });
      this.#endpoint.hold?.(true);
      this.#endpoint.post({ id, method, args }, transfer);
    });
  }

  /** Ends the worker; calls under way and all later ones reject with `reason`. */
  close(reason: Error) {
    if (this.#closed) return;
    this.#closed = reason;
    for (const { reject } of this.#pending.values()) reject(reason);
    this.#pending.clear();
    this.#endpoint.hold?.(false);
    for (const view of this.#views) view.close(reason);
    this.#endpoint.close?.();
  }

  /** Another session in the worker, over the same bytes. */
  view(onEvent: OnEvent): Remote<M> {
    const { port1, port2 } = new MessageChannel();
    const view = new Remote<M>(portEndpoint(port1), onEvent);
    this.#views.add(view);
    this.#post("view", [port2], [port2]).catch((error) => view.close(error));
    return view;
  }

  #settle({ id, result, error }: { id: number; result?: unknown; error?: FlatError }) {
    this.#started = true;
    const call = this.#pending.get(id);
    if (!call) return;
    this.#pending.delete(id);
    if (this.#pending.size === 0) this.#endpoint.hold?.(false);
    if (error) call.reject(reviveError(error));
    else call.resolve(result);
  }
}

/**
 * The worker's side: answers each call with `methods[name](...args)`, one after another.
 *
 * @param beside names of methods that may wait for long: later calls do not wait for them
 * @returns what emits an event that the caller did not ask for
 */
export function serve(endpoint: Endpoint, methods: Methods, beside: string[] = []): OnEvent {
  let queue: Promise<unknown> = Promise.resolve();
  endpoint.onMessage((message) => {
    if (message.method === "hello") return endpoint.post({ id: message.id });
    queue = queue.then(() => {
      const answered = answer(endpoint, methods, message);
      return beside.includes(message.method) ? undefined : answered;
    });
  });
  return (event, data) => endpoint.post({ event, data }, buffersOf(data));
}

async function answer(endpoint: Endpoint, methods: Methods, { id, method, args }: { id: number; method: string; args: any[] }) {
  try {
    const result = await methods[method](...args);
    endpoint.post({ id, result }, buffersOf(result));
  } catch (error) {
    endpoint.post({ id, error: flattenError(error) });
  }
}

/** The buffers of the typed arrays that are direct members of `value`, and of those of its fields: each of ours owns its buffer. */
function buffersOf(value: unknown): Transferable[] {
  if (typeof value !== "object" || value === null) return [];
  const { fields = [] } = value as { fields?: { values: unknown }[] };
  const members = [...Object.values(value), ...fields.map(({ values }) => values)];
  return members.filter((member) => ArrayBuffer.isView(member)).map(({ buffer }) => buffer as ArrayBuffer);
}
