/** The link to what is seen. */

import { $ } from "./dom.js";
import { sourceWords } from "./opening.js";
import { save } from "./state.js";

/** How long a note stays (in ms); longer ones stay longer. */
const NOTE = 4000;
const A_LETTER = 100;

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
    const button = document.createElement("button");
    button.type = "button";
    button.textContent = label;
    button.addEventListener("click", () => {
      hide();
      act();
    });
    $("note").append(" ", button);
  }
}

/** Copies the address of the page, which has its whole state. */
export async function share() {
  save();
  const isFile = sourceWords().startsWith("file:");
  try {
    await navigator.clipboard.writeText(location.href);
    note(isFile ? "Link copied. It does not contain your file, and asks for it" : "Link copied");
  } catch {
    note("The browser does not let this page copy: the link is in the address bar");
  }
}

export function attachShare() {
  $("share").addEventListener("click", share);
}
