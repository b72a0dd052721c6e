/**
 * Calls into a worker and answers out of it. One message a call, answered in the order of the calls, so that a
 * worker's state needs no locks; typed arrays in an answer are moved, not copied.
 */

import { TetralodError, flattenError, reviveError } from "./errors.js";

/**
 * The two ends of a channel look the same to this module.
 *
 * @typedef {object} Endpoint
 * @property {(message: object, transfer?: Transferable[]) => void} post
 * @property {(listener: (message: any) => void) => void} onMessage
 * @property {(listener: (error: any) => void) => void} [onError]
 * @property {() => void} [close]
 * @property {(keepAlive: boolean) => void} [hold] whether the process must wait for this channel (Node only)
 */

/** The end of a browser `Worker` that its owner holds, or the worker's own end (`globalThis`). */
export function webEndpoint(target) {
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

/** The end of a Node `Worker` that its owner holds, or its `parentPort`. */
export function nodeEndpoint(target) {
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

const failure = (error) => new TetralodError("internal", `the worker failed: ${error?.message ?? error ?? "no reason given"}`);

/** One end of a `MessageChannel`, in a page and in Node. @param {any} port */
export function portEndpoint(port) {
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
    hold: (keepAlive) => (keepAlive ? port.ref?.() : port.unref?.()),
  };
}

/** The caller's side. */
export class Remote {
  #endpoint;
  #pending = new Map();
  #next = 0;
  #closed = null;
  /** Other sessions in the worker. @type {Set<Remote>} */
  #views = new Set();
  /** Whether the worker has answered: then it has started. */
  #started = false;
  #notStarted;

  /**
   * @param {Endpoint} endpoint
   * @param {(name: string, data: any) => void} [onEvent] gets what the worker emits unasked
   * @param {(error: any) => Error | Promise<Error>} [notStarted] makes the error for a worker that fails before it has answered
   */
  constructor(endpoint, onEvent = () => {}, notStarted = failure) {
    this.#endpoint = endpoint;
    this.#notStarted = notStarted;
    endpoint.onMessage((message) => ("event" in message ? onEvent(message.event, message.data) : this.#settle(message)));
    endpoint.onError?.((error) => this.#failed(error));
    endpoint.hold?.(false);
  }

  /**
   * Ends a worker that does not answer in time: browsers do not report a script that loads and never listens.
   *
   * @param {number} milliseconds
   * @param {string} problem why it is ended
   */
  async greet(milliseconds, problem) {
    // Timers cannot wait longer.
    const timer = milliseconds < 2 ** 31 ? setTimeout(() => this.#failed(problem), milliseconds) : undefined;
    // Any answer will do, also that of another version; what else ends the worker rejects the calls that follow.
    await this.call("hello").catch(() => {});
    clearTimeout(timer);
  }

  async #failed(error) {
    if (!this.#closed) this.close(await (this.#started ? failure : this.#notStarted)(error));
  }

  /** Calls `method` over there; `transfer` lists the buffers in `args` to move instead of copying. */
  call(method, args = [], transfer = []) {
    if (this.#closed) return Promise.reject(this.#closed);
    const id = this.#next++;
    return new Promise((resolve, reject) => {
      this.#pending.set(id, { resolve, reject });
      this.#endpoint.hold?.(true);
      this.#endpoint.post({ id, method, args }, transfer);
    });
  }

  /** Ends the worker; calls under way and all later ones reject with `reason`. */
  close(reason) {
    if (this.#closed) return;
    this.#closed = reason;
    for (const { reject } of this.#pending.values()) reject(reason);
    this.#pending.clear();
    this.#endpoint.hold?.(false);
    for (const view of this.#views) view.close(reason);
    this.#endpoint.close?.();
  }

  /** Another session in the worker, over the same bytes. */
  view(onEvent) {
    const { port1, port2 } = new MessageChannel();
    const view = new Remote(portEndpoint(port1), onEvent);
    this.#views.add(view);
    this.call("view", [port2], [port2]).catch((error) => view.close(error));
    return view;
  }

  #settle({ id, result, error }) {
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
 * @param {Endpoint} endpoint
 * @param {Record<string, (...args: any[]) => any>} methods
 * @param {string[]} [beside] names of methods that may wait for long: later calls do not wait for them
 * @returns {(name: string, data: any) => void} emits an event that the caller did not ask for
 */
export function serve(endpoint, methods, beside = []) {
  let queue = Promise.resolve();
  endpoint.onMessage((message) => {
    if (message.method === "hello") return endpoint.post({ id: message.id });
    queue = queue.then(() => {
      const answered = answer(endpoint, methods, message);
      return beside.includes(message.method) ? undefined : answered;
    });
  });
  return (event, data) => endpoint.post({ event, data }, buffersOf(data));
}

async function answer(endpoint, methods, { id, method, args }) {
  try {
    const result = await methods[method](...args);
    endpoint.post({ id, result }, buffersOf(result));
  } catch (error) {
    endpoint.post({ id, error: flattenError(error) });
  }
}

/** The buffers of the typed arrays that are direct members of `value`, and of those of its fields: each of ours owns its buffer. */
function buffersOf(value) {
  if (typeof value !== "object" || value === null) return [];
  return [...Object.values(value), ...(value.fields ?? []).map(({ values }) => values)]
    .filter((member) => ArrayBuffer.isView(member))
    .map((member) => member.buffer);
}
