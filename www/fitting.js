/** What of some words another volume has: of the rest it is said that it was left out. */

import { named } from "./dom.js";
import { rounded } from "./format.js";
import { volume } from "./page.js";
import { isNumbers, numbers, points, show, store } from "./state.js";
import { fieldNames, isInside, rangeOf } from "./volume.js";

/** @typedef {import("./state.js").Words} Words */

/** @param {number} low @param {number} high */
const rangeWords = (low, high) => `${rounded(low, high - low)} to ${rounded(high, high - low)}`;

/** @typedef {[kept: string, lost: string] | undefined} Judgement */

/**
 * What words mean of the volume that has arrived, where that is not all that they say, and what is not there; nothing where all is.
 *
 * @type {Record<string, (words: string, field: string) => Judgement>}
 */
const LIMITS = {
  isovalue(words, field) {
    const [low, high] = rangeOf(field);
    const isThere = !isNumbers(words, 1) || (Number(words) >= low && Number(words) <= high);
    return isThere ? undefined : ["", `isovalue ${words} (${field} is ${rangeWords(low, high)})`];
  },
  range(words, field) {
    const [low, high] = rangeOf(field);
    const [from, to] = numbers(words);
    return !isNumbers(words, 2) || (to >= low && from <= high) ? undefined : ["", `colours of ${rangeWords(from, to)} (${field} is ${rangeWords(low, high)})`];
  },
  threshold(words, field) {
    const [low, high] = rangeOf(field);
    const [from, to] = numbers(words);
    return !isNumbers(words, 2) || (to >= low && from <= high) ? undefined : ["", `cells of ${rangeWords(from, to)} (${field} is ${rangeWords(low, high)})`];
  },
  box(words) {
    const { bounds } = volume();
    const box = numbers(words);
    const meets = [0, 1, 2].every((i) => box[i] <= bounds[i + 3] && box[i + 3] >= bounds[i]);
    return !isNumbers(words, 6) || meets ? undefined : ["", "the box of the region"];
  },
  seeds: (words) => pointsLeft(words, "seeds"),
  probes: (words) => pointsLeft(words, "probes"),
};

/** @param {string} words @param {string} what @returns {Judgement} */
function pointsLeft(words, what) {
  const all = points(words);
  const left = all.filter(isInside);
  return left.length < all.length ? [String(left.flat()), `${all.length - left.length} ${what} outside`] : undefined;
}

/** The words of which the volume has something, and what it has not. @param {Words} words @returns {[kept: Words, lost: string[]]} */
function fitting(words) {
  const { fields, firstField } = volume();
  const field = fieldNames().includes(words.field) ? words.field : fields[firstField].name;
  const [kept, lost] = [{ ...words }, /** @type {string[]} */ ([])];
  for (const [name, judge] of Object.entries(LIMITS)) {
    const judged = words[name] ? judge(words[name], field) : undefined;
    if (!judged) continue;
    kept[name] = judged[0];
    lost.push(judged[1]);
  }
  return [kept, lost];
}

/** What of some words is not in the state. @param {Words} words */
function untaken(words) {
  const { state } = store;
  const label = (/** @type {string} */ name, /** @type {string} */ value) =>
    named(name)
      .find((one) => one.value === value)
      ?.parentElement?.textContent.trim() ?? value;
  const lists = /** @type {const} */ ({ field: "field", "surface-colour": "colours of", vector: "vector", deform: "deformed by", time: "time step" });
  const lost = Object.entries(lists).flatMap(([id, what]) =>
    words[id] && String(state[/** @type {keyof typeof lists} */ (id)]) !== words[id] ? [`${what} ${words[id]}`] : [],
  );
  if (words.view !== state.view && named("mode").some(({ value }) => value === words.view)) lost.push(`view ${label("mode", words.view)}`);
  const also = (words.also ?? "").split(",").filter((name) => named("also").some(({ value }) => value === name) && !state.also.includes(name));
  return [...lost, ...also.map((name) => `${label("also", name)} beside the view`)];
}

/** A volume has arrived: takes the words as far as they mean something there. @param {Words} words @returns {{ lost: string[], ignored: string[] }} */
export function showFitting(words) {
  const [kept, lost] = fitting(words);
  const ignored = show(kept);
  return { lost: [...lost, ...untaken(words)], ignored };
}
