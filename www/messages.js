/** Messages over the picture: errors, and what to do. */

import { $ } from "./dom.js";
import { demo } from "./page.js";

const TITLES = {
  "no-file": "This file is not part of the link",
  network: "The file could not be downloaded",
  cors: "The server does not allow this page to read the file",
  server: "The server does not send the bytes of the file",
  changed: "The file was replaced on the server",
  "device-lost": "The GPU was reset. Reload the page",
  truncated: "The file is incomplete",
  "too-large": "The mesh is too large for this GPU",
};

/** Errors that may be gone when the same is tried again. */
const PASSING = ["network", "server", "changed", "truncated", "timeout"];
/** Answers to a wrong address, or to a file that is not for this page: they will be the same. */
const LASTING = /HTTP 4(?!08|25|29)\d\d/;

/** Shows what went wrong. What has arrived stays usable. */
export function fail(error) {
  demo.error = { code: error.code, message: error.message };
  demo.state = "failed";
  $("loading").classList.add("done");
  $("retry").hidden = !(PASSING.includes(error.code) && isElsewhere() && !(LASTING.test(error.message) && isOpening()));
  $("choose-file").hidden = error.code !== "no-file";
  // Nothing has come yet: what was said of the opening is over.
  if (!demo.info) $("growth").textContent = "";
  say(TITLES[error.code] ?? "The file could not be opened", error);
}

/** Shows a message. It can be closed, and keeps out of the way of what is drawn. */
export function say(title, error) {
  $("message-title").textContent = title;
  const words = error.message ?? String(error);
  // A message that starts with a file's name keeps it as it is.
  const start = words.includes(": ") ? words.charAt(0) : words.charAt(0).toUpperCase();
  $("message-text").textContent = `${start}${words.slice(1)}`;
  $("message").classList.toggle("beside", demo.firstFrameBytes !== undefined || demo.state === "unsupported");
  $("message").hidden = false;
}

/** Whether what is opened comes from a server: a file of the user would fail again. */
let isElsewhere = () => true;
/** Whether nothing has come of it: a server that has sent a part of a file has it. */
let isOpening = () => true;

/** @param {{ onRetry: () => void, isRemote: () => boolean, isNew: () => boolean }} page */
export function attachMessages({ onRetry, isRemote, isNew }) {
  isElsewhere = isRemote;
  isOpening = isNew;
  $("dismiss").addEventListener("click", hideMessage);
  $("choose-file").addEventListener("click", () => $("file").click());
  $("retry").addEventListener("click", onRetry);
}

export function hideMessage() {
  $("message").hidden = true;
}
