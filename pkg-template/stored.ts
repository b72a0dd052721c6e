/** How numbers are stored in arrays of single precision: fields that are asked for, and absolute numbers of all of them. */

import { badOption } from "./errors.js";
import type { FieldInfo, FieldValues, Stored } from "./results.js";

/** What is known of a field that comes with a mesh. */
export type KnownField = Omit<FieldValues, "values">;

/** All fields, or those of these names or numbers. */
export type WantedFields = boolean | readonly (string | number)[];

/** What is known of the fields that `wanted` names, or has numbers of; of all with `true`. */
export function fieldsOf(info: () => { fields: FieldInfo[] } | undefined, wanted: WantedFields = false): KnownField[] {
  if (!wanted) return [];
  const all = (info()?.fields ?? []).map(({ name, unit, time, vector, offset, scale }, index) => ({ index, name, unit, time, vector, offset, scale }));
  if (wanted === true) return all;
  const isOf = (one: string | number) => (field: KnownField) => one === field.index || one === field.name;
  const found = Array.isArray(wanted) ? wanted.map((one) => all.find(isOf(one))) : [undefined];
  if (found.every((field) => field !== undefined)) return found;
  throw badOption("fields", `must be true, or a list of names or numbers of ${all.map(({ name }) => name).join(", ")}; not ${wanted}`);
}

/** Puts fields beside a mesh or a surface, each as it is stored in single precision; `arrays` are their values at its vertices. */
export function withFields<T extends object>(result: T, fields: KnownField[], arrays: Float64Array[]): T & { fields: FieldValues[] } {
  const single = (values: Float64Array, { offset, scale }: KnownField) => Float32Array.from(values, (value) => (value - offset) / scale);
  return Object.assign(result, { fields: fields.map((field, i) => ({ ...field, values: single(arrays[i], field) })) });
}

/** What {@link absolute} makes of a result. */
export type Absolute<T> = {
  [K in keyof T]: K extends "positions" | "values" | "field"
    ? Float32Array | Float64Array | Extract<T[K], undefined>
    : K extends "fields"
      ? Absolute<FieldValues>[]
      : T[K];
};

/** What has numbers that may be relative. */
interface Relative extends Partial<Stored> {
  positions?: ArrayLike<number>;
  values?: ArrayLike<number>;
  field?: ArrayLike<number>;
  fields?: Relative[];
}

/**
 * A mesh or a surface in absolute numbers, as files need them: positions in model units, values in units of their field; `origin`, `offset`
 * and `scale` are 0, 0 and 1. Arrays that were absolute, as most are, are the same ones; others are copies in double precision.
 *
 * @example
 * const { positions, values } = absolute(await mt.slice([0, 0, 1], 0.5));
 */
export function absolute<T extends Partial<Stored>>(stored: T): Absolute<T> {
  const { origin, offset = 0, scale = 1 } = stored;
  const found: Relative = { ...stored, offset: 0, scale: 1 };
  const copy = (name: "positions" | "values" | "field", number: (x: number, i: number) => number) => {
    const array = found[name];
    if (array) found[name] = Float64Array.from(array, number);
  };
  if (offset !== 0 || scale !== 1) for (const name of ["values", "field"] as const) copy(name, (v) => offset + scale * v);
  if (origin) found.origin = [0, 0, 0];
  if (origin?.some(Boolean)) copy("positions", (x, i) => origin[i % 3] + x);
  if (found.fields) found.fields = found.fields.map(absolute);
  return found as Absolute<T>;
}

/**
 * A mesh or a surface displaced by a vector, in absolute numbers: each vertex goes by so many times the values of three of its fields, which
 * are given by names or numbers. Normals, which would be those of before, are left out.
 *
 * @example
 * const surface = displaced(await mt.surface({ fields: ["u_x", "u_y", "u_z"] }), ["u_x", "u_y", "u_z"], 20);
 * @throws {TetralodError} `bad-option` if it comes without one of these fields
 */
export function displaced<T extends Partial<Stored> & { positions: Float32Array; fields: FieldValues[] }>(
  stored: T,
  components: readonly (string | number)[],
  times: number,
): Omit<Absolute<T>, "normals"> {
  const { normals, ...found } = absolute(stored) as Absolute<T> & { normals?: unknown };
  const along = components.map((one) => stored.fields.findIndex(({ index, name }) => one === index || one === name));
  if (along.length !== 3 || along.includes(-1)) throw badOption("components", `must be three fields that come with it; given: ${components.join(", ")}`);
  const values = along.map((i) => (found.fields as Absolute<FieldValues>[])[i].values);
  const positions = found.positions as Float32Array | Float64Array;
  return { ...found, positions: positions.map((x, i) => x + times * values[i % 3][Math.floor(i / 3)]) } as Omit<Absolute<T>, "normals">;
}
