/** The keys of the page: one table, from which the overlay with all keys is made. `controls.js` has what those of the picture do. */

import { toggleDeformation } from "./deform.js";
import { $, dialog, element, named } from "./dom.js";
import { toggleExtremes } from "./extremes.js";
import { chooseBeside, openGallery } from "./gallery.js";
import { redo, share, undo } from "./history.js";
import { hideMessage } from "./messages.js";
import { page } from "./page.js";
import { toggle } from "./parts.js";
import { fullScreen } from "./picture.js";
import { showTab } from "./tabs.js";
import { switchTheme } from "./theme.js";
import { toggleCut } from "./threshold.js";

/**
 * A key, or several of the same meaning: letters are those of the key without Shift, `Ctrl` is also the command key. Without `act`,
 * the picture acts on it while it has the focus.
 *
 * @typedef {{ keys: string[], what: string, act?: (event: KeyboardEvent) => void }} Key
 */

const VIEWS = ["Boundary", "Isosurface", "Volume", "Slice", "Mesh", "Flow"];
/** What can be shown beside the view, with Shift and a digit. */
const BESIDE = ["the boundary", "the isosurface", "the volume", "the slice", "mesh wires", "the flow", "points"];

/** Chooses a view by its number. @param {number} number */
function chooseView(number) {
  const radio = named("mode")[number - 1];
  if (radio && !radio.disabled) radio.click();
}

/** @type {Record<string, Key[]>} */
const TABLE = {
  "In the picture": [
    { keys: ["←", "→", "↑", "↓"], what: "rotate" },
    { keys: ["Shift + arrows"], what: "pan" },
    { keys: ["+", "−"], what: "zoom" },
    { keys: ["Home", "R"], what: "reset the camera" },
    { keys: ["P"], what: "probe the middle" },
    { keys: ["Tab"], what: "to the handle of the plane: arrows move and tilt it, with Shift finely" },
    { keys: ["W", "A", "S", "D", "Q", "E"], what: "fly, with the setting Fly; with Shift faster" },
  ],
  "Views": [
    ...VIEWS.map((name, i) => ({ keys: [String(i + 1)], what: name, act: () => chooseView(i + 1) })),
    ...BESIDE.map((name, i) => ({ keys: [`Shift + ${i + 1}`], what: `also show ${name}`, act: () => toggle(i + 1) })),
  ],
  "Everywhere": [
    { keys: ["V"], what: "to the picture", act: () => $("canvas").focus() },
    { keys: ["D"], what: "deformed shape, or as it is", act: toggleDeformation },
    { keys: ["M"], what: "mark the extremes, or not", act: toggleExtremes },
    { keys: ["C"], what: "cut cells at the ends of the range that is shown, or show whole ones", act: toggleCut },
    { keys: ["I"], what: "to the isovalue", act: () => toControl("isovalue") },
    { keys: ["O"], what: "gallery and files", act: openGallery },
    { keys: ["B"], what: "compare with another file", act: chooseBeside },
    { keys: ["G"], what: "settings", act: () => showTab("settings") },
    { keys: ["N"], what: "data: what has arrived", act: () => showTab("data") },
    { keys: ["X"], what: "export", act: () => showTab("export") },
    { keys: ["L"], what: "copy the link", act: share },
    { keys: ["F"], what: "full screen", act: fullScreen },
    { keys: ["T"], what: "light or dark page", act: switchTheme },
    { keys: ["Ctrl + Z"], what: "undo", act: undo },
    { keys: ["Ctrl + Shift + Z", "Ctrl + Y"], what: "redo", act: redo },
    { keys: ["Esc"], what: "remove probes, close a message", act: dismiss },
    { keys: ["?"], what: "this list", act: showKeys },
  ],
};

function toControl(/** @type {string} */ id) {
  showTab("settings");
  $(id).focus();
}

function dismiss() {
  if (!$("message").hidden) hideMessage();
  else page.probes?.clear();
}

export function showKeys() {
  if (dialog("keys").open) return;
  $("keys-list").replaceChildren(
    ...Object.entries(TABLE).map(([title, keys]) => {
      const list = element("dl", {}, ...keys.flatMap(row));
      return element("section", {}, element("h3", {}, title), list);
    }),
  );
  dialog("keys").showModal();
}

/** @param {Key} key */
function row({ keys, what }) {
  const caps = keys.flatMap((key) => [element("kbd", {}, key), " "]);
  return [element("dt", {}, ...caps), element("dd", {}, what)];
}

/** What the table calls the key of an event. @param {KeyboardEvent} event */
function nameOf({ key, code, ctrlKey, metaKey, shiftKey }) {
  const isLetter = /^[a-z]$/i.test(key);
  // With Shift, a digit is another character, which depends on the keyboard.
  const digit = shiftKey && /^Digit\d$/.test(code) ? code.slice(-1) : undefined;
  const modifiers = [(ctrlKey || metaKey) && "Ctrl", (isLetter || digit) && shiftKey && "Shift"].filter(Boolean);
  return [...modifiers, digit ?? (isLetter ? key.toUpperCase() : key === "Escape" ? "Esc" : key)].join(" + ");
}

/** Where letters are text. */
const isTyping = (/** @type {EventTarget | null} */ target) =>
  target instanceof HTMLElement && target.matches("select, input:not([type=range], [type=checkbox], [type=radio]), textarea");

const ACTIONS = new Map(
  Object.values(TABLE)
    .flat()
    .flatMap(({ keys, act }) => (act ? keys.map((key) => /** @type {const} */ ([key, act])) : [])),
);

export function attachKeys() {
  $("keys-open").addEventListener("click", showKeys);
  document.addEventListener("keydown", (event) => {
    if (event.defaultPrevented || event.altKey || isTyping(event.target)) return;
    const act = ACTIONS.get(nameOf(event));
    // Dialogs have their own keys.
    if (!act || document.querySelector("dialog[open]")) return;
    event.preventDefault();
    act(event);
  });
}
