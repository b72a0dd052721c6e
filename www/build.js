/** Files of meshes, dropped or chosen: a dialog that builds an MT file of them in a worker, opens it, and saves it. */

import { element } from "./dom.js";
import { count, nameOf, size } from "./format.js";
import { mainOf } from "./source.js";
import { averagedWords } from "./averaged.js";
import { RepairControls, repairWords } from "./repair.js";

/** What the phases of the work are called. @type {Record<string, string>} */
const PHASES = {
  wait: "Waiting",
  read: "Reading the file",
  parse: "Decoding",
  repair: "Checking the mesh",
  remove: "Removing vertices",
  collapse: "Collapsing edges",
  insert: "Inserting vertices",
  order: "Putting updates in order",
  encode: "Writing",
};

/** What a phase of the work is called. @param {string} phase */
export const phaseWords = (phase) => PHASES[phase] ?? phase;

/** What is said where there are fields at cells. */
const AT_CELLS =
  "Fields at cells become fields at points: the mean of the cells around each point, weighted by volume. Peaks become lower; by how much is said after the build.";

/** The dialog that is open. @type {BuildDialog | undefined} */
let shown;

/**
 * Shows the dialog for `files`, which are a mesh. `open` gets the MT file that is built of them.
 *
 * @param {import("./source.js").Dropped[]} files
 * @param {(file: File) => unknown} open
 */
export function takeMesh(files, open) {
  shown?.close();
  shown = new BuildDialog(files, open);
}

class BuildDialog {
  #files;
  #open;
  #stop = new AbortController();
  /** Counts the forecasts that were asked for. */
  #asked = 0;
  #name;
  #about = element("p", { textContent: "Reading…" });
  #fields = element("fieldset", { className: "choices", hidden: true });
  #parts = element("select", { id: "build-parts" });
  #partsRow = element("div", { className: "row", hidden: true }, element("label", { htmlFor: "build-parts" }, "Keep parts apart"), this.#parts);
  #repair = new RepairControls();
  #memory = element("p");
  #bar = element("progress", { max: 1, value: 0, ariaLabel: "Progress of the build", hidden: true });
  #status = element("p");
  /** What the repair did, and averaging from cells. */
  #repaired = element("ul", { hidden: true });
  #error = element("p", { className: "bad", role: "alert", hidden: true });
  #start = element("button", { type: "button", textContent: "Build", disabled: true });
  #save = element("a", { className: "button", textContent: "Save .mt", hidden: true });
  #cancel = element("button", { type: "button", textContent: "Cancel" });
  #dialog = element("dialog", { className: "build" });

  /** @param {import("./source.js").Dropped[]} files @param {(file: File) => unknown} open */
  constructor(files, open) {
    this.#files = files;
    this.#open = open;
    this.#name = nameOf(mainOf(files).name);
    const title = element("h2", { textContent: `Build an MT file of ${this.#name}` });
    title.id = "build-title";
    this.#dialog.setAttribute("aria-labelledby", title.id);
    const buttons = element("div", { className: "buttons" }, this.#start, this.#save, this.#cancel);
    const said = element("div", { role: "status" }, this.#status, this.#repaired);
    const settings = [this.#fields, this.#partsRow, this.#repair.fieldset, this.#memory];
    this.#dialog.append(title, this.#about, ...settings, this.#bar, said, this.#error, buttons);
    this.#start.addEventListener("click", () => this.#build());
    this.#cancel.addEventListener("click", () => this.close());
    this.#dialog.addEventListener("close", () => this.#leave());
    document.body.append(this.#dialog);
    this.#dialog.showModal();
    this.#inspect();
  }

  close() {
    this.#dialog.close();
  }

  /** Ends all work. */
  #leave() {
    this.#stop.abort();
    this.#dialog.remove();
    if (this.#save.href) URL.revokeObjectURL(this.#save.href);
    if (shown === this) shown = undefined;
  }

  /** The chosen fields. */
  get #options() {
    const boxes = [...this.#fields.querySelectorAll("input")].filter((box) => box.checked);
    const cellToPoint = boxes.some((box) => box.dataset.at === "cells");
    const preserve = this.#parts.value ? [this.#parts.value] : [];
    return { fields: boxes.map((box) => box.value), cellToPoint, preserve, signal: this.#stop.signal };
  }

  async #inspect() {
    try {
      const { inspect } = await import("tetralod/build");
      const info = await inspect(this.#files, { signal: this.#stop.signal });
      const { format, points, tetrahedra, fields } = info;
      this.#about.textContent = `${format}, ${count(points)} points, ${count(tetrahedra)} tetrahedra`;
      this.#showFields(fields);
      this.#showParts(fields);
      for (const part of [this.#partsRow, this.#repair.fieldset]) part.hidden = tetrahedra === 0;
      this.#showMemory(info.memory);
      await this.#leaveWhatDoesNotFit(info.memory.needed);
      this.#start.focus();
    } catch (error) {
      // It is not being read any more.
      this.#about.hidden = true;
      this.#fail(error);
    }
  }

  /** @param {import("tetralod/build").InputInfo["fields"]} fields */
  #showFields(fields) {
    // Values at cells are changed on their way to the points: only where there are no others they are taken unasked.
    const areAtPoints = fields.some(({ at }) => at === "points");
    const boxes = fields.map(({ name, at, unit, vector }) => {
      const checked = (at === "points") === areAtPoints;
      const box = element("input", { type: "checkbox", value: name, checked });
      box.dataset.at = at;
      if (vector && vector.component === undefined) box.dataset.follows = vector.name;
      const label = `${name}${unit && ` (${unit})`}${at === "cells" ? ", at cells" : ""}`;
      return element("label", {}, box, ` ${label}`);
    });
    const note = element("small", { textContent: AT_CELLS, hidden: fields.every(({ at }) => at === "points") });
    this.#fields.replaceChildren(element("legend", { textContent: "Fields" }), ...boxes, note);
    this.#fields.hidden = boxes.length === 0;
    this.#fields.addEventListener("change", () => this.#forecast());
  }

  /** Labels of parts are whole numbers at cells; which are is known when they are read. @param {import("tetralod/build").InputInfo["fields"]} fields */
  #showParts(fields) {
    const names = fields.filter(({ at, vector }) => at === "cells" && !vector).map(({ name }) => name);
    const named = names.map((name) => new Option(`by ${name}`, name));
    // An array of this name is what is meant by it.
    const connected = names.includes("components") ? [] : [new Option("that do not touch", "components")];
    this.#parts.replaceChildren(new Option("none", ""), ...connected, ...named);
    this.#parts.addEventListener("change", () => this.#forecast());
  }

  /** Leaves out the last of the chosen fields, as many as memory has no room for; the first is kept in any case. @param {number} ofOne what the build needs with one field */
  async #leaveWhatDoesNotFit(ofOne) {
    const chosen = [...this.#fields.querySelectorAll("input")].filter((box) => box.checked);
    const memory = chosen.length > 1 ? await this.#forecast() : undefined;
    if (!memory || memory.fits) return;
    const each = (memory.needed - ofOne) / (chosen.length - 1);
    const more = Math.max(0, Math.floor((memory.available - ofOne) / each));
    // What follows from others goes first, and then the last.
    const inOrder = [...chosen.filter((box) => !box.dataset.follows), ...chosen.filter((box) => box.dataset.follows)];
    for (const box of inOrder.slice(1 + more)) box.checked = false;
    await this.#forecast();
  }

  /** The memory depends on the fields. */
  async #forecast() {
    this.#start.disabled = true;
    const mine = ++this.#asked;
    const { fields } = this.#options;
    if (fields.length === 0) return;
    try {
      const { inspect } = await import("tetralod/build");
      const { memory } = await inspect(this.#files, this.#options);
      if (mine !== this.#asked) return;
      this.#showMemory(memory);
      return memory;
    } catch (error) {
      this.#fail(error);
    }
  }

  /** @param {import("tetralod/build").InputInfo["memory"]} memory */
  #showMemory({ needed, available, fits }) {
    const much = `about ${size(needed)} of memory`;
    this.#memory.textContent = fits
      ? `The build needs ${much}. Nothing leaves this machine.`
      : `The build needs ${much}, more than the ${size(available)} that a page has: use the command "tetralod build".`;
    this.#memory.classList.toggle("bad", !fits);
    this.#start.disabled = !fits;
  }

  async #build() {
    if (!this.#repair.isValid()) return;
    const options = { ...this.#options, ...this.#repair.options };
    this.#setBusy(true);
    for (const part of [this.#error, this.#repaired, this.#save]) part.hidden = true;
    this.#cancel.textContent = "Cancel";
    try {
      const { build } = await import("tetralod/build");
      const onProgress = (/** @type {import("tetralod/build").BuildProgress} */ progress) => this.#showProgress(progress);
      const { bytes, report } = await build(this.#files, { ...options, onProgress });
      this.#setBusy(false);
      this.#finish(new File([bytes], `${this.#name.replace(/(\.[^.]+)(\.gz)?$/i, "")}.mt`), report);
    } catch (/** @type {any} */ error) {
      this.#setBusy(false);
      this.#status.textContent = "";
      this.#fail(error);
      if (error?.code === "bad-mesh") this.#repair.focus();
      else this.#start.focus();
    }
  }

  /** Nothing can be chosen while the build runs. @param {boolean} isBusy */
  #setBusy(isBusy) {
    for (const control of [this.#start, this.#fields, this.#parts, this.#repair.fieldset]) control.disabled = isBusy;
    this.#bar.hidden = !isBusy;
  }

  /** @param {import("tetralod/build").BuildProgress} progress */
  #showProgress({ phase, fraction, tetrahedra }) {
    this.#bar.value = fraction;
    const left = tetrahedra === undefined ? "" : `, ${count(tetrahedra)} tetrahedra`;
    this.#status.textContent = `${phaseWords(phase)}${left}`;
  }

  /** @param {File} file @param {import("tetralod/build").BuildReport} report */
  #finish(file, report) {
    const { tetrahedra, seconds } = report;
    this.#status.textContent = `${count(tetrahedra)} tetrahedra in ${size(file.size)}, built in ${seconds.toFixed(1)} s`;
    const words = [...repairWords(report), ...averagedWords(report.averaged)].map((textContent) => element("li", { textContent }));
    this.#repaired.replaceChildren(...words);
    this.#repaired.hidden = words.length === 0;
    // Other fields, or another repair, may turn out to be better.
    this.#start.textContent = "Build again";
    this.#save.hidden = false;
    if (this.#save.href) URL.revokeObjectURL(this.#save.href);
    this.#save.href = URL.createObjectURL(file);
    this.#save.download = file.name;
    this.#cancel.textContent = "Close";
    this.#cancel.focus();
    this.#open(file);
  }

  #fail(/** @type {any} */ error) {
    if (error?.name === "AbortError") return;
    this.#error.textContent = error.message;
    this.#error.hidden = false;
    this.#bar.hidden = true;
  }
}
