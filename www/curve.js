/** Transfer functions: the name of one to begin with, or points. */

/** A value as a fraction of the field's range, and its opacity. @typedef {[at: number, opacity: number]} Point */
/** @typedef {string | readonly Point[]} Curve */

/** The one that there is first. */
export const FIRST = "ramp";

/** Those that have names; `at` is the fraction of the isovalue. @type {Record<string, (at: number) => Point[]>} */
const PRESETS = {
  ramp: () => [
    [0, 0],
    [0.3, 0],
    [1, 0.8],
  ],
  peak: () => [
    [0, 0],
    [0.38, 0],
    [0.5, 0.8],
    [0.62, 0],
    [1, 0],
  ],
  step: (at) => [
    [0, 0],
    [at, 0],
    [at, 0.5],
    [1, 0.5],
  ],
  shells: () => [
    [0, 0],
    [0.3, 0],
    [0.34, 0.25],
    [0.38, 0],
    [0.62, 0],
    [0.66, 0.7],
    [0.7, 0],
    [1, 0],
  ],
};

/** @param {Curve} curve @param {number} isovalue as a fraction of the field's range @returns {readonly Point[]} */
export const pointsOf = (curve, isovalue) => (typeof curve === "string" ? PRESETS[curve](isovalue) : curve);

/** @param {Curve} curve */
export const curveWords = (curve) => (curve === FIRST ? "" : String(curve));

/** What words mean; the first one where they mean none. @param {string} words @returns {Curve} */
export function curveOf(words) {
  if (Object.hasOwn(PRESETS, words)) return words;
  const values = words.split(",").map(Number);
  if (values.length < 4 || values.length % 2 === 1 || !values.every((x) => x >= 0 && x <= 1)) return FIRST;
  return values.flatMap((at, i) => (i % 2 === 0 ? [/** @type {Point} */ ([at, values[i + 1]])] : []));
}
