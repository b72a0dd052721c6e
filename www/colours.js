/** The settings of colours: map, direction, scale and range. */

import { precise } from "./format.js";

/** The fractions of the volume between which the range of percentiles lies. */
const PERCENTILES = [0.02, 0.98];
/** A logarithmic range that begins below this part of its upper end is made to begin at that other part of it. */
const LOG_LEAST = 1e-8;
const LOG_START = 1e-3;

/** @typedef {import("tetralod").FieldInfo} FieldInfo */

export class ColourSettings {
  #parts;
  #percentiles;
  #onChange;
  /** @type {FieldInfo | undefined} */
  #field;
  /** The range of the colours, or undefined for that of the field. @type {[number, number] | undefined} */
  #range;
  /** Whether the range is that of a link, whichever field is shown. */
  #isGiven = false;
  /** Counts the choices of a range: late answers are ignored. */
  #chosen = 0;

  /**
   * @param {Record<"map" | "reversed" | "log" | "low" | "high" | "preset" | "note", any>} parts
   * @param {{ percentiles: (fractions: number[]) => Promise<number[]>, onChange: () => void }} how
   */
  constructor(parts, { percentiles, onChange }) {
    this.#parts = parts;
    this.#percentiles = percentiles;
    this.#onChange = onChange;
    for (const name of ["map", "reversed"]) parts[name].addEventListener("input", onChange);
    parts.log.addEventListener("input", () => this.#choose());
    parts.preset.addEventListener("input", () => this.#choose());
    for (const name of ["low", "high"]) parts[name].addEventListener("input", () => this.#typed());
  }

  /** @returns {import("tetralod/viewer").ColourState} */
  get state() {
    const { map, reversed, log } = this.#parts;
    return { map: map.value, reversed: reversed.checked, log: log.checked, range: this.#range };
  }

  /** The preset of the range, or the numbers that were typed; nothing for the range of the data. */
  get words() {
    const { value } = this.#parts.preset;
    if (value === "custom") return String(this.#range ?? "");
    return value === "data" ? "" : value;
  }

  set words(words) {
    const { preset } = this.#parts;
    const [low, high] = words.split(",").map(Number);
    const isRange = low < high;
    const isPreset = ["percentiles", "symmetric"].includes(words);
    preset.value = isRange ? "custom" : isPreset ? words : "data";
    this.#range = isRange ? [low, high] : undefined;
    // The range is one of the field that is shown next.
    this.#isGiven = isRange;
  }

  /** The gradient over the whole range of the field, of colours that are even over the range of a legend. */
  gradient({ colours, range, log }) {
    const { min, max } = this.#field ?? { min: 0, max: 1 };
    const value = (t) => (log ? range[0] * (range[1] / range[0]) ** t : range[0] + t * (range[1] - range[0]));
    const stops = colours.map((colour, i) => {
      const part = (value(i / (colours.length - 1)) - min) / (max - min);
      return `${colour} ${(100 * part).toFixed(2)}%`;
    });
    return `linear-gradient(90deg, ${stops.join(", ")})`;
  }

  /** Another field is shown: the range that was typed in is not one of its own. @param {FieldInfo} field */
  async setField(field) {
    const isOther = field.name !== this.#field?.name && !this.#isGiven;
    this.#isGiven = false;
    this.#field = field;
    const { preset, log } = this.#parts;
    if (isOther && preset.value === "custom") preset.value = "data";
    log.disabled = field.max <= 0;
    if (log.disabled) log.checked = false;
    await this.#choose();
  }

  /** Takes the range of the preset. */
  async #choose() {
    if (!this.#field) return;
    const mine = ++this.#chosen;
    const { preset, log } = this.#parts;
    // No range of positive numbers has 0 in its middle.
    preset.querySelector("[value=symmetric]").disabled = log.checked;
    if (log.checked && preset.value === "symmetric") preset.value = "data";
    const range = await this.#preset(preset.value);
    if (mine !== this.#chosen) return;
    this.#show(this.#positive(range));
    this.#onChange();
  }

  /** @returns {Promise<[number, number]>} */
  async #preset(name) {
    const { min, max } = this.#field;
    const most = Math.max(Math.abs(min), Math.abs(max));
    if (name === "custom") return this.#range ?? [min, max];
    if (name === "symmetric") return [-most, most];
    if (name !== "percentiles") return [min, max];
    const [low, high] = await this.#percentiles(PERCENTILES).catch(() => [min, max]);
    return low < high ? [low, high] : [min, max];
  }

  /** A range that a logarithmic scale can have, if the scale is one. @returns {[number, number]} */
  #positive([low, high]) {
    const { log, note } = this.#parts;
    const end = high > 0 ? high : this.#field.max;
    const needs = log.checked && low < end * LOG_LEAST;
    note.hidden = !needs;
    return needs ? [end * LOG_START, end] : [low, high];
  }

  #show([low, high]) {
    this.#range = [low, high];
    const { low: lower, high: upper } = this.#parts;
    for (const [input, value] of [[lower, low], [upper, high]]) {
      input.setCustomValidity("");
      if (document.activeElement !== input) input.value = Math.abs(value) < 1e-9 * (high - low) ? 0 : precise(value, high - low, 5);
    }
  }

  /** Takes the numbers that were typed if they are a range. */
  #typed() {
    const { low, high, log, preset, note } = this.#parts;
    const [lower, upper] = [low.valueAsNumber, high.valueAsNumber];
    const isRange = lower < upper;
    const isPositive = !log.checked || lower > 0;
    low.setCustomValidity(isPositive ? "" : "A logarithmic scale needs positive numbers");
    high.setCustomValidity(isRange ? "" : "The second number must be larger than the first");
    for (const input of [low, high]) input.reportValidity();
    if (!isRange || !isPositive) return;
    this.#chosen++;
    preset.value = "custom";
    note.hidden = true;
    this.#range = [lower, upper];
    this.#onChange();
  }
}
