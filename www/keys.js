/** The keys of the page outside of the picture; `controls.js` has those of the picture. */

import { redo, undo } from "./state.js";

/** Where letters are text. */
const isTyping = (target) => target instanceof HTMLElement && target.matches("input:not([type=range], [type=checkbox], [type=radio]), textarea");

export function attachKeys() {
  document.addEventListener("keydown", (event) => {
    if (!(event.ctrlKey || event.metaKey) || event.altKey || isTyping(event.target)) return;
    const key = event.key.toLowerCase();
    if (key === "z") (event.shiftKey ? redo : undo)();
    else if (key === "y") redo();
    else return;
    event.preventDefault();
  });
}
