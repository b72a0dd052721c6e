/** What of a scene fits a volume: scenes outlive the volumes that they were made for. */

import { TetralodError } from "./errors.js";

/** Lengths that are drawn with are between these parts of the box's diagonal. */
const LEAST = 1e-5;
const MOST = 1e3;

/** What is shown where nothing that fits is left. */
const FIRST = { isosurfaces: [{}] };
const PARTS = ["volume", "boundary", "cells", "streamlines", "arrows"];
const LISTS = ["isosurfaces", "slices"];

/** `scene` with some parts replaced; `null` gives a part its default. */
export function changedScene(scene, changes) {
  const all = Object.entries({ ...scene, ...changes });
  return Object.fromEntries(all.filter(([, value]) => value !== null && value !== undefined));
}

const isKnown = (name, fields) => fields.some((field) => field.name === name);

function unknown(name, fields) {
  const names = [...new Set(fields.map((field) => field.name))].join(", ");
  return `there is no field ${JSON.stringify(name)}; this volume has: ${names}`;
}

/** Refuses a scene that names a field which the volume does not have. */
export function checkFields(scene, { fields }) {
  const named = [...LISTS.flatMap((list) => (scene[list] ?? []).map((one, i) => [`${list}[${i}].field`, one.field]))];
  for (const part of ["streamlines", "arrows"]) {
    if (!scene[part]) continue;
    named.push(...(scene[part].fields ?? []).map((name) => [`${part}.fields`, name]), [`${part}.field`, scene[part].field]);
  }
  const wrong = named.find(([, name]) => typeof name === "string" && !isKnown(name, fields));
  if (wrong) throw new TetralodError("bad-option", `option \`${wrong[0]}\`: ${unknown(wrong[1], fields)}`);
}

/**
 * What of a scene fits a volume: fields that it has, values that one of its fields has, planes, boxes and points that meet its box,
 * lengths of its order. Where nothing is left that shows anything, it is the isosurface in the middle.
 *
 * @param {Record<string, any>} scene one that wasm has taken
 * @param {{ fields: { name: string, min: number, max: number }[], bounds: number[] }} volume
 * @returns {{ scene: Record<string, any>, dropped: { part: string, problem: string }[] }}
 */
export function fitScene(scene, { fields, bounds }) {
  /** @type {{ part: string, problem: string }[]} */
  const dropped = [];
  /** Whether it `fits`; else it is told. */
  const keep = (fits, part, problem) => {
    if (!fits) dropped.push({ part, problem });
    return fits;
  };
  /** `state` without the members that do not fit. */
  const only = (state, part, judge) => {
    const fits = ([name, value]) => {
      const problem = value === undefined || value === null ? undefined : judge[name]?.(value);
      return keep(problem === undefined, part ? `${part}.${name}` : name, problem);
    };
    return Object.fromEntries(Object.entries(state).filter(fits));
  };
  const field = (name) => (isKnown(name, fields) ? undefined : unknown(name, fields));
  const hasValue = (low, high) => fields.some(({ min, max }) => high >= min && low <= max);
  const value = (number) => (hasValue(number, number) ? undefined : `no field has the value ${number}`);
  const values = (points) => {
    const all = points.map(([number]) => number);
    const isThere = all.length === 0 || hasValue(Math.min(...all), Math.max(...all));
    return isThere ? undefined : `no field has a value from ${Math.min(...all)} to ${Math.max(...all)}`;
  };
  const diagonal = Math.hypot(...[0, 1, 2].map((i) => bounds[i + 3] - bounds[i]));
  const length = (number) =>
    number >= LEAST * diagonal && number <= MOST * diagonal ? undefined : `${number} is not of the order of the volume, whose diagonal is ${diagonal}`;
  /** Where the box is along a normal. */
  const along = (normal) => {
    const ends = normal.map((x, i) => [x * bounds[i], x * bounds[i + 3]]);
    return [ends.reduce((sum, pair) => sum + Math.min(...pair), 0), ends.reduce((sum, pair) => sum + Math.max(...pair), 0)];
  };
  const [outside, all] = ["it does not meet the volume", "it cuts all of the volume away"];
  const meets = ({ normal, offset }) => offset >= along(normal)[0] && offset <= along(normal)[1];
  const leaves = ({ normal, offset }) => offset >= along(normal)[0];
  const overlaps = (box) => ([0, 1, 2].every((i) => box[i] <= bounds[i + 3] && box[i + 3] >= bounds[i]) ? undefined : outside);
  const isInside = (point) => point.every((x, i) => x >= bounds[i] && x <= bounds[i + 3]);

  const fitted = only(scene, "", { clipBox: overlaps, region: overlaps });
  for (const list of LISTS) {
    if (fitted[list]) fitted[list] = fitted[list].map((one, i) => only(one, `${list}[${i}]`, { field, value }));
  }
  if (fitted.slices) fitted.slices = fitted.slices.filter((slice, i) => keep(meets(slice), `slices[${i}]`, outside));
  if (fitted.clips) fitted.clips = fitted.clips.filter((clip, i) => keep(leaves(clip), `clips[${i}]`, all));
  if (fitted.volume) fitted.volume = only(fitted.volume, "volume", { opacities: values, points: values, unitLength: length });
  if (fitted.cells) fitted.cells = only(fitted.cells, "cells", { cut: (cut) => (leaves(cut) ? undefined : all) });
  const range = ([low, high]) => (hasValue(low, high) ? undefined : `no field has a value from ${low} to ${high}`);
  if (fitted.colours) fitted.colours = only(fitted.colours, "colours", { range });
  for (const part of ["streamlines", "arrows"]) {
    if (!fitted[part]) continue;
    const missing = (fitted[part].fields ?? []).find((name) => !isKnown(name, fields));
    if (keep(missing === undefined, part, missing === undefined ? "" : unknown(missing, fields))) {
      fitted[part] = only(fitted[part], part, { field, radius: length, spacing: length });
    } else delete fitted[part];
  }
  const { seeds } = fitted.streamlines ?? {};
  if (seeds?.length > 0) {
    const inside = seeds.filter(isInside);
    const out = seeds.length - inside.length;
    keep(out === 0, "streamlines.seeds", `${out} of ${seeds.length} points are outside of the volume`);
    fitted.streamlines = { ...fitted.streamlines, seeds: inside };
    if (inside.length === 0) delete fitted.streamlines;
  }
  const isEmpty = PARTS.every((part) => !fitted[part]) && LISTS.every((list) => !fitted[list]?.length);
  return { scene: isEmpty && dropped.length > 0 ? { ...fitted, ...FIRST } : fitted, dropped };
}
