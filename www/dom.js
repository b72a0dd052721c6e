/** Elements of the page. */

/** @type {(id: string) => any} Each caller knows the type of its element. */
export const $ = (id) => document.getElementById(id);

/** @type {(selector: string) => any[]} */
export const all = (selector) => Array.from(document.querySelectorAll(selector));

/** A new element with text or elements in it. @type {(name: string, properties?: object, ...content: (string | Node)[]) => any} */
export function element(name, properties = {}, ...content) {
  const made = Object.assign(document.createElement(name), properties);
  made.append(...content);
  return made;
}

/** The value of the chosen one of some radio buttons. @param {string} name */
export const checked = (name) => /** @type {HTMLInputElement} */ (document.querySelector(`[name=${name}]:checked`)).value;

/** Shows the value of a slider, and gives it to screen readers. */
export function text(output, words, slider) {
  $(output).textContent = words;
  $(slider).setAttribute("aria-valuetext", words);
}

let waiting;

/** Announces words to screen readers when they have not changed for a while (in ms). */
export function announce(words, rest = 800) {
  clearTimeout(waiting);
  waiting = setTimeout(() => ($("status").textContent = words), rest);
}

/** Dialogs close with their button, and by a press beside them. */
export function attachDialogs() {
  for (const dialog of all("dialog")) {
    dialog.querySelector("[data-close]").addEventListener("click", () => dialog.close());
    dialog.addEventListener("pointerdown", (event) => {
      const { left, right, top, bottom } = dialog.getBoundingClientRect();
      const isInside = event.clientX >= left && event.clientX <= right && event.clientY >= top && event.clientY <= bottom;
      if (event.target === dialog && !isInside) dialog.close();
    });
  }
}
