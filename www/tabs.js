/** The panels beside the picture, one at a time. */

import { $, all } from "./dom.js";

/** Told when a panel is shown. @type {((name: string) => void)[]} */
const listeners = [];

export const onTab = (then) => listeners.push(then);

/** @param {"settings" | "data" | "export"} name */
export function showTab(name) {
  for (const tab of all("[role=tab]")) {
    const isShown = tab.id === `tab-${name}`;
    tab.setAttribute("aria-selected", String(isShown));
    tab.tabIndex = isShown ? 0 : -1;
    $(tab.getAttribute("aria-controls")).hidden = !isShown;
  }
  for (const then of listeners) then(name);
}

export const shownTab = () => document.querySelector("[role=tab][aria-selected=true]").id.replace("tab-", "");

export function attachTabs() {
  const tabs = all("[role=tab]");
  for (const [i, tab] of tabs.entries()) {
    tab.addEventListener("click", () => showTab(tab.id.replace("tab-", "")));
    tab.addEventListener("keydown", ({ key }) => {
      const step = { ArrowRight: 1, ArrowLeft: -1 }[key];
      if (!step) return;
      const next = tabs[(i + step + tabs.length) % tabs.length];
      showTab(next.id.replace("tab-", ""));
      next.focus();
    });
  }
}
