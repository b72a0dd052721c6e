/** A script for a worker, as `workerUrl` names it or `new Worker` runs it; there is nothing to import from it. */
export {};
