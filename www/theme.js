/** Light or dark: of the page, and of the picture where that follows the page. */

import { $ } from "./dom.js";
import { store } from "./state.js";

const KEY = "tetralod-theme";
const prefersDark = matchMedia("(prefers-color-scheme: dark)");

/** Chosen by hand, or nothing where the system decides. @type {string | undefined} */
let chosen;

/** The background of the picture. */
export function background() {
  const { background, dark } = store.state;
  return /** @type {"dark" | "light" | "transparent"} */ (background === "page" ? (dark ? "dark" : "light") : background);
}

/** Takes what is chosen. */
const apply = () => store.change({ dark: chosen ? chosen === "dark" : prefersDark.matches });

/** The other of the two. */
export function switchTheme() {
  chosen = store.state.dark ? "light" : "dark";
  try {
    localStorage.setItem(KEY, chosen);
  } catch {
    // Then it is kept for this visit.
  }
  apply();
  showTheme();
}

function showTheme() {
  document.documentElement.style.colorScheme = chosen ?? "";
  for (const stage of ["stage", "stage-beside"]) $(stage).dataset.background = background();
}

export function attachTheme() {
  try {
    chosen = localStorage.getItem(KEY) ?? undefined;
  } catch {
    // The system decides.
  }
  prefersDark.addEventListener("change", apply);
  $("theme").addEventListener("click", switchTheme);
  store.subscribe(["background", "dark"], showTheme);
  apply();
  showTheme();
}
