/** How a dropped mesh is repaired: the controls in the dialog of a build, and what the repair did in words. */

import { element } from "./dom.js";

/** What is said of each level; the first is chosen. @type {Record<string, { title: string, note: string }>} */
const LEVELS = {
  safe: {
    title: "safe (default)",
    note: "Only what cannot be wrong: turns inverted cells; drops flat cells of the boundary, copies and unused points. The domain stays as it is.",
  },
  weld: {
    title: "weld: close seams",
    note: "As safe; and where two faces lie on each other without sharing points, their points become one.",
  },
  none: {
    title: "none: refuse defects",
    note: "A mesh with defects is refused, and the message says what level safe would do.",
  },
};

export class RepairControls {
  #level = element("select", { id: "repair-level" });
  #note = element("small", { id: "repair-note" });
  #distance = element("input", { id: "weld-distance", type: "number", min: "0", step: "any", value: "0", required: true });
  #distanceRow = element("div", {});
  /** What the dialog shows. */
  fieldset = element("fieldset", { hidden: true });

  constructor() {
    this.#level.append(...Object.entries(LEVELS).map(([level, { title }]) => new Option(title, level)));
    this.#level.setAttribute("aria-describedby", this.#note.id);
    this.#level.addEventListener("change", () => this.#showLevel());
    const about = element("small", { id: "weld-note", textContent: "In units of the model, less than the shortest edge. 0: points at one place" });
    this.#distance.setAttribute("aria-describedby", about.id);
    this.#distanceRow.append(row("Weld distance", this.#distance), about);
    this.fieldset.append(element("legend", { textContent: "Repair" }), row("Level", this.#level), this.#note, this.#distanceRow);
    this.#showLevel();
  }

  #showLevel() {
    this.#note.textContent = LEVELS[this.#level.value].note;
    this.#distanceRow.hidden = this.#level.value !== "weld";
  }

  /** As `build` takes them. */
  get options() {
    const repair = /** @type {import("tetralod/build").BuildOptions["repair"]} */ (this.#level.value);
    return repair === "weld" ? { repair, weldDistance: this.#distance.valueAsNumber } : { repair };
  }

  /** Whether the distance is one; if not, says so at its input. */
  isValid() {
    return this.#distanceRow.hidden || this.#distance.reportValidity();
  }

  /** Goes to the control that a refused mesh needs changed, if one of these can help. */
  focus() {
    const control = this.#distanceRow.hidden ? this.#level : this.#distance;
    control.focus();
  }
}

const row = (/** @type {string} */ label, /** @type {HTMLElement} */ control) =>
  element("div", { className: "row" }, element("label", { htmlFor: control.id, textContent: label }), control);

/**
 * What was left out of the file, what the repair did and what it left as it is, a sentence each.
 *
 * @param {import("tetralod/build").BuildReport} report
 */
export function repairWords({ repaired, repair, notes }) {
  const found = repair ? [repaired, repair.kept].filter(Boolean) : [];
  if (repair && found.length === 0) found.push("The mesh needed no repair, and nothing about it is unusual");
  return [...notes, ...found].map((words) => words.charAt(0).toUpperCase() + words.slice(1));
}
