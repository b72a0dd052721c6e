/** Messages over the picture: errors, what to do, and notes. */

import { $, element, input } from "./dom.js";
import { demo } from "./page.js";
import { isNew, isRemote } from "./source.js";

/** @type {Record<string, string>} */
const TITLES = {
  "no-file": "This file is not part of the link",
  network: "The file could not be downloaded",
  cors: "The server does not allow this page to read the file",
  server: "The server does not send the bytes of the file",
  changed: "The file was replaced on the server",
  "device-lost": "The GPU was reset. Reload the page",
  truncated: "The file is incomplete",
  "too-large": "The mesh is too large for this GPU",
  "bad-option": "This cannot be shown",
  "needs-webgpu": "Volumes are not drawn without WebGPU",
};

/** Errors that may be gone when the same is tried again. */
const PASSING = ["network", "server", "changed", "truncated", "timeout"];
/** Answers to a wrong address, or to a file that is not for this page: they will be the same. */
const LASTING = /HTTP 4(?!08|25|29)\d\d/;

/** Shows what went wrong. What has arrived stays usable. @param {any} error */
export function fail(error) {
  // All but the volume is there.
  if (error.code === "needs-webgpu") return say(TITLES[error.code], error);
  demo.error = { code: error.code, message: error.message };
  demo.state = "failed";
  $("loading").classList.add("done");
  $("retry").hidden = !(PASSING.includes(error.code) && isRemote() && !(LASTING.test(error.message) && isNew()));
  $("choose-file").hidden = error.code !== "no-file";
  // Nothing has come yet: what was said of the opening is over.
  if (!demo.info) $("growth").textContent = "";
  say(TITLES[error.code] ?? "The file could not be opened", error);
}

/** What the message is of: the code of an error. @type {string | undefined} */
let code;

/** Shows a message. It can be closed, and keeps out of the way of what is drawn. @param {string} title @param {any} error */
export function say(title, error) {
  code = error.code;
  $("message-title").textContent = title;
  const words = error.message ?? String(error);
  // A message that starts with a file's name keeps it as it is.
  const start = words.includes(": ") ? words.charAt(0) : words.charAt(0).toUpperCase();
  $("message-text").textContent = `${start}${words.slice(1)}`;
  $("message").classList.toggle("beside", demo.firstFrameBytes !== undefined || demo.state === "unsupported");
  $("message").hidden = false;
}

export function hideMessage() {
  $("message").hidden = true;
}

/** No volume is to be drawn: hides the message that none can be. */
export function hideRefusal() {
  if (code === "needs-webgpu") hideMessage();
}

/** How long a note stays (in ms); longer ones stay longer. */
const NOTE = 4000;
const A_LETTER = 100;

/** @type {ReturnType<typeof setTimeout> | undefined} */
let timer;

/**
 * Shows words for a while; with something to do, until it is done or another note comes. Screen readers announce them.
 *
 * @param {string} words
 * @param {{ label: string, act: () => void }} [action]
 */
export function note(words, action) {
  clearTimeout(timer);
  const hide = () => ($("note").hidden = true);
  $("note").replaceChildren(words);
  $("note").hidden = false;
  if (!action) {
    timer = setTimeout(hide, Math.max(NOTE, A_LETTER * words.length));
    return;
  }
  const close = { label: "Close", act: () => {} };
  for (const { label, act } of [action, close]) {
    const button = element("button", { type: "button", textContent: label });
    button.addEventListener("click", () => {
      hide();
      act();
    });
    $("note").append(" ", button);
  }
}

/** Copies a text, and says so, or that it cannot be. @param {string} text @param {string} words */
export function copied(text, words, otherwise = "") {
  navigator.clipboard.writeText(text).then(
    () => note(words),
    () => note(`The browser does not let this page copy${otherwise}`),
  );
}

/** @param {() => void} onRetry */
export function attachMessages(onRetry) {
  $("dismiss").addEventListener("click", hideMessage);
  $("choose-file").addEventListener("click", () => input("file").click());
  $("retry").addEventListener("click", onRetry);
}
