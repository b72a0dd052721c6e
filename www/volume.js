/** What the volume that is open has: fields and their times, vectors, and boxes in it. */

import { diagonalOf, precise } from "./format.js";
import { demo, volume } from "./page.js";

/** @typedef {import("tetralod").FieldInfo} FieldInfo */
/** @typedef {[number, number, number]} Point */
/** A box: its corner of the least numbers, and that of the largest ones. @typedef {[number, number, number, number, number, number]} Box */

/** The axes: where their numbers are in a point. */
export const AXES = /** @type {const} */ ([0, 1, 2]);

/** Numbers of boxes have so many digits: as many as links keep. */
const DIGITS = 6;

/** The names of the fields, each once however many times it has. */
export const fieldNames = () => [...new Set(volume().fields.map(({ name }) => name))];

/** The numbers of a field at its times, in order. @param {string} name */
export function stepsOf(name) {
  const { fields } = volume();
  const numbers = [...fields.keys()].filter((number) => fields[number].name === name);
  return numbers.sort((a, b) => (fields[a].time ?? 0) - (fields[b].time ?? 0));
}

/** The smallest and the largest value of a field at all of its times. @param {string} name @returns {[number, number]} */
export function rangeOf(name) {
  const steps = volume().fields.filter((field) => field.name === name);
  return [Math.min(...steps.map(({ min }) => min)), Math.max(...steps.map(({ max }) => max))];
}

/** The same of both files, where the one beside has the field, too. @param {string} name @returns {[number, number]} */
export function commonRange(name) {
  const steps = [...volume().fields, ...(demo.beside?.info?.fields ?? [])].filter((field) => field.name === name);
  return [Math.min(...steps.map(({ min }) => min)), Math.max(...steps.map(({ max }) => max))];
}

/** The vectors of three components: the names of the fields that these are, by the name of the vector. Tensors have more. */
export function vectors() {
  /** @type {Map<string, string[]>} */
  const found = new Map();
  for (const { name, vector } of volume().fields) {
    if (typeof vector?.component !== "number") continue;
    const components = found.get(vector.name) ?? [];
    components[vector.component] = name;
    found.set(vector.name, components);
  }
  const whole = [...found].filter(([, components]) => components.length === 3 && AXES.every((i) => components[i]));
  return new Map(/** @type {[string, [string, string, string]][]} */ (whole));
}

/** Six numbers as a box. @param {ArrayLike<number>} numbers @returns {Box} */
export function boxOf(numbers) {
  const length = diagonalOf(volume().bounds);
  return /** @type {Box} */ (Array.from(numbers, (x) => precise(x, length, DIGITS)));
}

/** The middle half of the volume. */
export function inner() {
  const { bounds } = volume();
  return boxOf(bounds.map((value, i) => value + (bounds[(i + 3) % 6] - value) / 4));
}

/** Whether a point is in the volume's box. @param {Point} point */
export function isInside(point) {
  const { bounds } = volume();
  return point.every((x, i) => x >= bounds[i] && x <= bounds[i + 3]);
}
