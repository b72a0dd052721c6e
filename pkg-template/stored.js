/** How numbers are stored in arrays of single precision: fields that are asked for, and absolute numbers of all of them. */

import { TetralodError } from "./errors.js";

/**
 * What is known of the fields that `wanted` names, or has numbers of; of all with `true`.
 *
 * @param {() => import("./index.js").MtInfo} info
 * @param {boolean | readonly (string | number)[]} [wanted]
 */
export function fieldsOf(info, wanted = false) {
  if (!wanted) return [];
  const all = info().fields.map(({ name, unit, time, vector, offset, scale }, index) => ({ index, name, unit, time, vector, offset, scale }));
  if (wanted === true) return all;
  const isOf = (one) => ({ index, name }) => one === index || one === name;
  const found = Array.isArray(wanted) ? wanted.map((one) => all.find(isOf(one))) : [undefined];
  if (found.every(Boolean)) return found;
  const names = all.map(({ name }) => name).join(", ");
  throw new TetralodError("bad-option", `option \`fields\`: must be true, or a list of names or numbers of ${names}; not ${wanted}`);
}

/**
 * Puts fields beside a mesh or a surface, each as it is stored in single precision.
 *
 * @template {object} T
 * @param {T} result
 * @param {ReturnType<typeof fieldsOf>} fields
 * @param {Float64Array[]} arrays their values at its vertices
 */
export function withFields(result, fields, arrays) {
  const single = (values, { offset, scale }) => Float32Array.from(values, (value) => (value - offset) / scale);
  return Object.assign(result, { fields: fields.map((field, i) => ({ ...field, values: single(arrays[i], field) })) });
}

/** The arrays of a result in absolute numbers: themselves where they are, else copies in double precision. */
export function absolute(stored) {
  const { origin, offset, scale } = stored;
  const found = { ...stored, offset: 0, scale: 1 };
  const copy = (name, number) => found[name] && (found[name] = Float64Array.from(found[name], number));
  if (offset !== 0 || scale !== 1) for (const name of ["values", "field"]) copy(name, (v) => offset + scale * v);
  if (origin) found.origin = [0, 0, 0];
  if (origin?.some(Boolean)) copy("positions", (x, i) => origin[i % 3] + x);
  if (found.fields) found.fields = found.fields.map(absolute);
  return found;
}
