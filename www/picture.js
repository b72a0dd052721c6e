/** The picture as large as the screen. */

import { $ } from "./dom.js";

/** Shows the picture on the whole screen, or no longer. */
export function fullScreen() {
  const change = document.fullscreenElement ? document.exitFullscreen() : $("stages").requestFullscreen?.();
  // Where the browser does not allow it, the page stays as it is.
  change?.catch(() => {});
}

export function attachPicture() {
  $("full").addEventListener("click", fullScreen);
}
