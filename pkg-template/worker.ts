/** The worker that holds one session. Runs in browsers and, as a `worker_threads` worker, in Node. There is nothing to import from it. */

import { WAITING, coreMethods } from "./core.js";
import { nodeEndpoint, ownEndpoint, serve } from "./rpc.js";
import { nodeModule } from "./stream.js";

const parent = nodeModule("node:worker_threads")?.parentPort;
const methods = coreMethods((name, data) => emit(name, data));
const emit = serve(parent ? nodeEndpoint(parent) : ownEndpoint(), methods, WAITING);
