/** The worker that holds one session. Runs in browsers and, as a `worker_threads` worker, in Node. */

import { coreMethods } from "./core.js";
import { nodeEndpoint, serve, webEndpoint } from "./rpc.js";
import { nodeModule } from "./stream.js";

const parent = nodeModule("node:worker_threads")?.parentPort;
serve(parent ? nodeEndpoint(parent) : webEndpoint(globalThis), coreMethods());
