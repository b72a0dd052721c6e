/** Light or dark: of the page, and of the picture where that follows the page. */

import { $ } from "./dom.js";
import { draw } from "./scene.js";

const KEY = "tetralod-theme";
const prefersDark = matchMedia("(prefers-color-scheme: dark)");

/** Chosen by hand, or nothing where the system decides. @type {string | undefined} */
let chosen;

const isDark = () => (chosen ? chosen === "dark" : prefersDark.matches);

/** The background of the picture. @returns {"dark" | "light" | "transparent"} */
export function background() {
  const { value } = $("background");
  return value === "page" ? (isDark() ? "dark" : "light") : value;
}

/** Shows what is chosen; the picture follows. */
export function applyTheme() {
  document.documentElement.style.colorScheme = chosen ?? "";
  $("stage").dataset.background = background();
  draw();
}

/** The other of the two. */
export function switchTheme() {
  chosen = isDark() ? "light" : "dark";
  try {
    localStorage.setItem(KEY, chosen);
  } catch {
    // Then it is kept for this visit.
  }
  applyTheme();
}

export function attachTheme() {
  try {
    chosen = localStorage.getItem(KEY) ?? undefined;
  } catch {
    // The system decides.
  }
  prefersDark.addEventListener("change", applyTheme);
  $("theme").addEventListener("click", switchTheme);
  $("background").addEventListener("input", applyTheme);
  applyTheme();
}
