/** The state in the address of the page, so that a reload or a link shows the same; undo and redo go back and forth in it. */

import { $, button } from "./dom.js";
import { copied } from "./messages.js";
import { open, tell } from "./opening.js";
import { demo } from "./page.js";
import { fileNameIn, sourceWords } from "./source.js";
import { read, show, store, words, written } from "./state.js";

/** The state is written when nothing has changed for so long (in ms). */
const QUIET = 300;
/** So many states can be undone. */
const MOST = 200;

/** States before this one, and those that were undone. */
const [past, future] = [/** @type {string[]} */ ([]), /** @type {string[]} */ ([])];
/** @type {string | undefined} */
let now;
/** @type {ReturnType<typeof setTimeout> | undefined} */
let timer;
/** What belongs to the next state and has not ended. @type {Set<Promise<void>>} */
const pending = new Set();
/** Whether a pointer is pressed: what it drags is one step, however long it rests on the way. */
let isPressed = false;

/** The state of the page now, as a plain object. @returns {import("./state.js").Words} */
export function stateNow() {
  const url = sourceWords();
  return { ...(url && { url }), ...words() };
}

/** Shows a state: opens its volume if that is another one. @param {import("./state.js").Words} words */
function restore(words) {
  const { url = "" } = words;
  if (url !== sourceWords() || !demo.info) return open(url, words);
  tell([], show(words));
}

/** Takes what `work` does into the next state, however late the viewer answers. @param {Promise<void>} work */
export function hold(work) {
  const ended = work
    .catch((error) => {
      if (error?.code !== "freed") console.warn(error);
    })
    .then(() => {
      pending.delete(ended);
      changed();
    });
  pending.add(ended);
}

/** Something may have changed: writes the state when it rests. What is changed first can be undone, too, however soon. */
function changed() {
  clearTimeout(timer);
  if (now === undefined) save();
  else timer = setTimeout(save, QUIET);
}

/** Writes the state into the address, and remembers the one before. */
function save() {
  clearTimeout(timer);
  if (!demo.info || store.state.playing || isPressed || pending.size > 0) return;
  const words = written(stateNow());
  if (words === now) return;
  if (now !== undefined) past.push(now);
  if (past.length > MOST) past.shift();
  future.length = 0;
  set(words);
}

/** @param {string} words */
function set(words) {
  now = words;
  button("undo").disabled = past.length === 0;
  button("redo").disabled = future.length === 0;
  // Without a hash, the address of the page as it is.
  history.replaceState(null, "", words ? `#${words}` : `${location.pathname}${location.search}`);
}

/** @param {string[]} from @param {string[]} to */
async function step(from, to) {
  await Promise.all(pending);
  if (isPressed) return;
  save();
  const words = from.pop();
  if (words === undefined || now === undefined) return;
  to.push(now);
  set(words);
  restore(read(words));
}

export const undo = () => step(past, future);
export const redo = () => step(future, past);

/** Shows the volume as it is by default. */
const reset = () => restore({ url: sourceWords() });

/** Copies the address of the page, which has its whole state. */
export function share() {
  save();
  const isFile = fileNameIn(sourceWords()) !== undefined;
  copied(location.href, isFile ? "Link copied. It does not contain your file, and asks for it" : "Link copied", ": the link is in the address bar");
}

export function attachHistory() {
  for (const name of /** @type {const} */ (["pointerdown", "pointermove", "pointerup", "pointercancel"])) {
    document.addEventListener(name, ({ buttons }) => (isPressed = buttons !== 0), { capture: true });
  }
  for (const name of ["pointerup", "pointercancel"]) document.addEventListener(name, changed);
  store.subscribe(undefined, changed);
  window.addEventListener("hashchange", () => restore(read(location.hash)));
  $("undo").addEventListener("click", undo);
  $("redo").addEventListener("click", redo);
  $("reset").addEventListener("click", reset);
  $("share").addEventListener("click", share);
}
