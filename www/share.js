/** The link to what is seen. */

import { $ } from "./dom.js";
import { sourceWords } from "./opening.js";
import { save } from "./state.js";

/** How long a note stays (in ms). */
const NOTE = 4000;

let timer;

/** Shows words for a while. Screen readers announce them. */
export function note(words) {
  clearTimeout(timer);
  $("note").textContent = words;
  $("note").hidden = false;
  timer = setTimeout(() => ($("note").hidden = true), NOTE);
}

/** Copies the address of the page, which has its whole state. */
export async function share() {
  save();
  const isFile = sourceWords().startsWith("file:");
  try {
    await navigator.clipboard.writeText(location.href);
    note(isFile ? "Link copied. It does not contain your file" : "Link copied");
  } catch {
    note("The browser does not let this page copy: the link is in the address bar");
  }
}

export function attachShare() {
  $("share").addEventListener("click", share);
}
