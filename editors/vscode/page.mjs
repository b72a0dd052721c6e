/** The page of an editor: what `tetralod html` has around the element. The bytes come from the extension, by messages. */

import "/pkg/inline-viewer.js";
import { present } from "../../cli/src/html/page.js";

// @ts-expect-error: VS Code gives it to each page.
const vscode = acquireVsCodeApi();
const element = document.querySelector("tetralod-viewer");
const status = document.getElementById("status");
const notes = document.querySelector("header").appendChild(document.createElement("p"));

/** Ranges that have been asked for. */
const waiting = new Map();
let count = 0;

const readerOf = ({ name, size, version }) => ({
  name,
  size,
  read: (start, end) =>
    new Promise((resolve, reject) => {
      waiting.set(++count, { resolve, reject });
      vscode.postMessage({ type: "read", id: count, version, start, end });
    }),
});

const HEARS = {
  bytes({ id, bytes, error }) {
    const { resolve, reject } = waiting.get(id);
    waiting.delete(id);
    if (error) reject(Object.assign(new Error(error.message), error));
    else resolve(bytes);
  },
  status({ text }) {
    status.textContent = text;
    status.classList.remove("failed");
  },
  failed({ text }) {
    status.textContent = text;
    status.classList.add("failed");
  },
  opened(file) {
    HEARS.status({ text: "Opening …" });
    notes.textContent = file.notes.join("\n");
    // Of a file that has changed, the same is seen from the same place.
    const { info, state } = element;
    if (info) element.state = state;
    element.source = readerOf(file);
  },
};
element.addEventListener("error", () => element.info && HEARS.failed({ text: "The picture is of before the error below." }));
element.addEventListener("stats", () => status.classList.remove("failed"));
addEventListener("message", ({ data }) => HEARS[data.type](data));
// Keys and the wheel are for the picture when nothing else of the page has the focus.
const QUIETLY = { preventScroll: true, focusVisible: false };
addEventListener("focus", () => document.activeElement === document.body && element.shadowRoot.querySelector("canvas")?.focus(QUIETLY));

/** The picture has the background that goes with the theme. */
const theme = () => (element.background = /vscode-(high-contrast-)?light/.test(document.body.className) ? "light" : "dark");
new MutationObserver(theme).observe(document.body, { attributeFilter: ["class"] });
theme();

const save = async (blob, name) => vscode.postMessage({ type: "save", name, bytes: new Uint8Array(await blob.arrayBuffer()) });
present({ name: document.title, request: { view: { pixels: 1, outside: "10%" }, maxTets: 500_000 } }, undefined, save);
vscode.postMessage({ type: "ready" });
