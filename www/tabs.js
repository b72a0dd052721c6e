/** The panels beside the picture, one at a time. */

import { $, all } from "./dom.js";

/** @type {((name: string) => void)[]} */
const listeners = [];

/** @param {(name: string) => void} then is told when a panel is shown */
export const onTab = (then) => listeners.push(then);

/** @param {string} name of a panel: settings, data or export */
export function showTab(name) {
  for (const tab of all("[role=tab]")) {
    const isShown = tab.id === `tab-${name}`;
    tab.setAttribute("aria-selected", String(isShown));
    tab.tabIndex = isShown ? 0 : -1;
    $(tab.getAttribute("aria-controls") ?? "").hidden = !isShown;
  }
  for (const then of listeners) then(name);
}

/** @param {HTMLElement} tab */
const nameOf = ({ id }) => id.replace("tab-", "");

export const shownTab = () => all("[role=tab][aria-selected=true]").map(nameOf)[0];

export function attachTabs() {
  const tabs = all("[role=tab]");
  for (const [i, tab] of tabs.entries()) {
    tab.addEventListener("click", () => showTab(nameOf(tab)));
    tab.addEventListener("keydown", ({ key }) => {
      const step = key === "ArrowRight" ? 1 : key === "ArrowLeft" ? -1 : 0;
      if (step === 0) return;
      const next = tabs[(i + step + tabs.length) % tabs.length];
      showTab(nameOf(next));
      next.focus();
    });
  }
}
