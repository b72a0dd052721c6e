/** What averaging fields at cells to points has done, in words. */

import { count, grouped } from "./format.js";

/** @typedef {import("tetralod").Extreme} Extreme */

/** @param {{ min: Extreme, max: Extreme }} extremes */
const range = ({ min, max }) => `${grouped(min.value)} to ${grouped(max.value)}`;

/** @param {Extreme} extreme */
const inCell = ({ value, cell, part }) => grouped(value) + (cell === undefined ? "" : ` (cell ${count(cell)}${part ? ` of ${part}` : ""})`);

/**
 * A sentence for each field that was averaged; of time steps for the one that averaging has changed most.
 *
 * @param {import("tetralod/build").AveragedField[]} fields
 */
export function averagedWords(fields) {
  /** @type {Map<string, import("tetralod/build").AveragedField>} */
  const most = new Map();
  for (const field of fields) {
    const known = most.get(field.name);
    if (!known || field.difference.largest > known.difference.largest) most.set(field.name, field);
  }
  return [...most.values()].map(({ name, unit, isLabel, input, points, difference: { rms, largest } }) => {
    const words = `input ${inCell(input.min)} to ${inCell(input.max)}, at points ${range(points)}`;
    const [at, mean] = [largest, rms].map((share) => (isLabel ? `${grouped(100 * share)} %` : grouped(share)));
    const differs = `${isLabel ? `another label in ${at} of a cell` : `differs by ${at}`} at most, root mean square ${mean}`;
    return `${name}${unit ? ` in ${unit}` : ""} is averaged from cells: ${words}; ${differs}`;
  });
}

/**
 * What a colour bar says of a field, all whose time steps these are: nothing if it is not averaged.
 *
 * @param {Pick<import("tetralod").FieldInfo, "averaged">[]} steps
 */
export function averagedNote(steps) {
  const inputs = steps.flatMap(({ averaged }) => (averaged ? [averaged.input] : []));
  if (inputs.length === 0) return [];
  const by = (/** @type {Extreme} */ a, /** @type {Extreme} */ b) => a.value - b.value;
  const [min] = inputs.map((input) => input.min).sort(by);
  const max = inputs.map((input) => input.max).sort(by)[inputs.length - 1];
  return ["averaged from cells", `input ${range({ min, max })}`];
}
