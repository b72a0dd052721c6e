/** Elements of the page. */

/**
 * The element of an id, which the page has.
 *
 * @template {Element} [T=HTMLElement]
 * @param {string} id
 * @param {new () => T} [kind]
 * @returns {T}
 */
export function $(id, kind) {
  const found = document.getElementById(id);
  if (found instanceof (kind ?? HTMLElement)) return /** @type {T} */ (/** @type {unknown} */ (found));
  throw new Error(`The page has no ${kind?.name ?? "element"} #${id}`);
}

/** @param {string} id */
export const input = (id) => $(id, HTMLInputElement);
/** @param {string} id */
export const select = (id) => $(id, HTMLSelectElement);
/** @param {string} id */
export const button = (id) => $(id, HTMLButtonElement);
/** @param {string} id */
export const svg = (id) => $(id, SVGSVGElement);
/** @param {string} id */
export const dialog = (id) => $(id, HTMLDialogElement);

/** @type {<T extends Element = HTMLElement>(selector: string) => T[]} */
export const all = (selector) => Array.from(document.querySelectorAll(selector));

/** @type {(name: string) => HTMLInputElement[]} */
export const named = (name) => all(`[name=${name}]`);

/** A new element with text or elements in it. @type {<K extends keyof HTMLElementTagNameMap>(name: K, properties?: Partial<HTMLElementTagNameMap[K]>, ...content: (string | Node)[]) => HTMLElementTagNameMap[K]} */
export function element(name, properties = {}, ...content) {
  const made = document.createElement(name);
  Object.assign(made, properties);
  made.append(...content);
  return made;
}

/** A new shape for an SVG element. @param {string} name @param {Record<string, string | number>} [attributes] @param {string} [words] */
export function shape(name, attributes = {}, words) {
  const made = document.createElementNS("http://www.w3.org/2000/svg", name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, String(value));
  if (words !== undefined) made.textContent = words;
  return made;
}

/** Adds terms and what is said of each to a list. @param {HTMLElement} list @param {string[][]} rows */
export function describe(list, rows) {
  list.append(...rows.flatMap(([term, words]) => [element("dt", {}, term), element("dd", {}, words)]));
}

/** Shows the value of a slider, and gives it to screen readers. @param {string} slider @param {string} words */
export function text(slider, words) {
  $(`${slider}-text`).textContent = words;
  $(slider).setAttribute("aria-valuetext", words);
}

/** @type {ReturnType<typeof setTimeout> | undefined} */
let waiting;

/** Announces words to screen readers when they have not changed for a while (in ms). @param {string} words */
export function announce(words, rest = 800) {
  clearTimeout(waiting);
  waiting = setTimeout(() => ($("status").textContent = words), rest);
}

/** Dialogs close with their button, and by a press beside them. */
export function attachDialogs() {
  for (const dialog of /** @type {HTMLDialogElement[]} */ (all("dialog"))) {
    dialog.querySelector("[data-close]")?.addEventListener("click", () => dialog.close());
    dialog.addEventListener("pointerdown", (event) => {
      const { left, right, top, bottom } = dialog.getBoundingClientRect();
      const isInside = event.clientX >= left && event.clientX <= right && event.clientY >= top && event.clientY <= bottom;
      if (event.target === dialog && !isInside) dialog.close();
    });
  }
}
