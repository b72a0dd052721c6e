/** What of a scene fits a volume: scenes outlive the volumes that they were made for. */

import { badOption } from "./errors.js";
import type { FieldInfo } from "./results.js";
import type { ArrowState, ViewerChanges, Misfit, PlaneState, SceneState, StreamlineState, ThresholdState } from "./scene.js";

/** Lengths that are drawn with are between these parts of the box's diagonal. */
const LEAST = 1e-5;
const MOST = 1e3;

const PARTS = ["volume", "boundary", "cells", "streamlines", "arrows"] as const;
const LISTS = ["isosurfaces", "slices"] as const;
const FLOWS = ["streamlines", "arrows"] as const;

/** What is asked of a field. */
type Field = Pick<FieldInfo, "name" | "min" | "max"> & Partial<Pick<FieldInfo, "vector" | "isLabel">>;

/** What is asked of a volume. */
export interface Volume {
  surfaceFirst: boolean;
  regions?: { all: { name: string; labels: number[] }[] } | undefined;
  fields: Field[];
  bounds: number[];
}

/** Whether a scene, or changes of one, say anything of what is drawn. */
export const namesParts = (scene: ViewerChanges | Record<string, unknown>) =>
  [...PARTS, ...LISTS].some((part) => (scene as Record<string, unknown>)[part] !== undefined);

/** A scene that says nothing of it. */
export const withoutParts = (scene: SceneState): SceneState =>
  Object.fromEntries(Object.entries(scene).filter(([name]) => !namesParts({ [name]: true })));

/** What is drawn of a volume where nothing is asked for: its boundary, or an isosurface where that shows more. */
const firstOf = ({ surfaceFirst }: Volume): SceneState => (surfaceFirst ? { isosurfaces: [{}] } : { boundary: {} });

/** `scene` with some parts replaced; `null` gives a part its default. */
export function changedScene<S extends SceneState>(scene: S, changes: ViewerChanges | Record<string, unknown>): S {
  const all = Object.entries({ ...scene, ...changes });
  return Object.fromEntries(all.filter(([, value]) => value !== null && value !== undefined)) as S;
}

const isKnown = (name: string, fields: Field[]) => fields.some((field) => field.name === name);

/** What is wrong with a vector that displaces: nothing if the volume has it. */
function noVector(vector: string, fields: Field[]): string | undefined {
  const has = (axis: string, i: number) => fields.some(({ name, vector: part }) => (part?.name === vector && part.component === i) || name === `${vector}_${axis}`);
  const listed = vector.split(",");
  const isListed = listed.length === 3 && listed.every((name) => isKnown(name, fields));
  return isListed || ["x", "y", "z"].every(has) ? undefined : `there is no vector ${JSON.stringify(vector)} of three components`;
}

function unknown(name: string, fields: Field[]): string {
  const names = [...new Set(fields.map((field) => field.name))].join(", ");
  return `there is no field ${JSON.stringify(name)}; this volume has: ${names}`;
}

/** What is wrong with a list of regions: nothing if the volume has all of them. */
function noRegion(names: (string | number)[], { regions }: Volume): string | undefined {
  const all = regions?.all ?? [];
  const labels = all.filter((one) => one.labels.length === 1).map((one) => String(one.labels[0]));
  const called = new Set([...all.map((one) => one.name), ...labels]);
  const missing = names.find((name) => !called.has(String(name)));
  return missing === undefined ? undefined : `there is no region ${JSON.stringify(missing)}`;
}

/** Refuses a scene that names a field or a region which the volume does not have. */
export function checkNames(scene: SceneState, volume: Volume) {
  const { fields } = volume;
  const named: [string, string | undefined][] = LISTS.flatMap((list) =>
    [...(scene[list] ?? [])].map(({ field }, i): [string, string | undefined] => [`${list}[${i}].field`, field]),
  );
  for (const part of FLOWS) {
    const flow = scene[part];
    if (!flow) continue;
    named.push(...(flow.fields ?? []).map((name): [string, string] => [`${part}.fields`, name]), [`${part}.field`, flow.field]);
  }
  named.push(["threshold.field", scene.threshold?.field]);
  for (const [place, name] of named) {
    if (typeof name === "string" && !isKnown(name, fields)) throw badOption(place, unknown(name, fields));
  }
  const problem = scene.deform && noVector(scene.deform.field, fields);
  if (problem) throw badOption("deform.field", problem);
  const region = scene.regions && noRegion(scene.regions, volume);
  if (region) throw badOption("regions", region);
  const sheer = noRegion(Object.keys(scene.boundary?.regionOpacities ?? {}), volume);
  if (sheer) throw badOption("boundary.regionOpacities", sheer);
}

/** Says what does not fit of a value; nothing where it does. */
type Judge = (value: any) => string | undefined;

/**
 * What of a scene fits a volume: fields that it has, values that one of its fields has, planes, boxes and points that meet its box,
 * lengths of its order. Where no part is named, or nothing is left that shows anything, it is what is drawn first. The scene is one that
 * wasm has taken. `shown` is the field that is shown.
 */
export function fitScene(scene: SceneState, volume: Volume, shown?: string): { scene: SceneState; dropped: Misfit[]; isFirst: boolean } {
  const { fields, bounds } = volume;
  const dropped: Misfit[] = [];
  /** Whether it fits: without a problem; else that is told. */
  const keep = (part: string, problem: string | undefined) => {
    if (problem !== undefined) dropped.push({ part, problem });
    return problem === undefined;
  };
  /** `state` without the members that do not fit. */
  const only = <S extends object>(state: S, part: string, judge: Record<string, Judge>): S => {
    const fits = ([name, value]: [string, unknown]) => {
      const problem = value === undefined || value === null ? undefined : judge[name]?.(value);
      return keep(part ? `${part}.${name}` : name, problem);
    };
    return Object.fromEntries(Object.entries(state).filter(fits)) as S;
  };
  const field = (name: string) => (isKnown(name, fields) ? undefined : unknown(name, fields));
  /** What has values between two others: no label. */
  const between = (name = shown) => (fields.some((one) => one.name === name && one.isLabel) ? `'${name}' is a label: between two labels there is no value` : undefined);
  const hasValue = (low: number, high: number) => fields.some(({ min, max }) => high >= min && low <= max);
  const value = (number: number) => (hasValue(number, number) ? undefined : `no field has the value ${number}`);
  const range = ([low, high]: [number, number]) => (hasValue(low, high) ? undefined : `no field has a value from ${low} to ${high}`);
  const values = (points: number[][]) => {
    const all = points.map(([number]) => number);
    return all.length === 0 ? undefined : range([Math.min(...all), Math.max(...all)]);
  };
  const diagonal = Math.hypot(...[0, 1, 2].map((i) => bounds[i + 3] - bounds[i]));
  const length = (number: number) =>
    number >= LEAST * diagonal && number <= MOST * diagonal ? undefined : `${number} is not of the order of the volume, whose diagonal is ${diagonal}`;
  /** Where the box is along a normal. */
  const along = (normal: number[]) => {
    const ends = normal.map((x, i) => [x * bounds[i], x * bounds[i + 3]]);
    return [ends.reduce((sum, pair) => sum + Math.min(...pair), 0), ends.reduce((sum, pair) => sum + Math.max(...pair), 0)];
  };
  const [outside, all] = ["it does not meet the volume", "it cuts all of the volume away"];
  const meets = ({ normal, offset }: PlaneState) => (offset >= along(normal)[0] && offset <= along(normal)[1] ? undefined : outside);
  const leaves = ({ normal, offset }: PlaneState) => (offset >= along(normal)[0] ? undefined : all);
  const overlaps = (box: ArrayLike<number>) => ([0, 1, 2].every((i) => box[i] <= bounds[i + 3] && box[i + 3] >= bounds[i]) ? undefined : outside);
  const isInside = (point: number[]) => point.every((x, i) => x >= bounds[i] && x <= bounds[i + 3]);

  const known = (names: (string | number)[]) => noRegion(names, volume);
  const threshold: Judge = (one: ThresholdState) => (one.field && field(one.field)) || range(one.range) || (one.cut ? between(one.field) : undefined);
  const deform: Judge = ({ field }) => noVector(field, fields);
  const fitted = only(scene, "", { clipBox: overlaps, region: overlaps, regions: known, deform, threshold });
  fitted.isosurfaces &&= fitted.isosurfaces.filter((_, i) => keep(`isosurfaces[${i}]`, between()));
  fitted.isosurfaces &&= fitted.isosurfaces.map((one, i) => only(one, `isosurfaces[${i}]`, { field, value }));
  fitted.slices &&= fitted.slices.map((one, i) => only(one, `slices[${i}]`, { field }));
  fitted.slices &&= fitted.slices.filter((slice, i) => keep(`slices[${i}]`, meets(slice)));
  fitted.clips &&= fitted.clips.filter((clip, i) => keep(`clips[${i}]`, leaves(clip)));
  if (fitted.volume && !keep("volume", between())) delete fitted.volume;
  fitted.volume &&= only(fitted.volume, "volume", { opacities: values, points: values, unitLength: length });
  const sheer: Judge = (opacities) => known(Object.keys(opacities));
  fitted.boundary &&= only(fitted.boundary, "boundary", { regionOpacities: sheer });
  fitted.cells &&= only(fitted.cells, "cells", { cut: leaves });
  fitted.colours &&= only(fitted.colours, "colours", { range });
  /** Tubes or arrows, if the volume has their field. */
  const flow = <F extends StreamlineState | ArrowState>(state: F, part: string): F | undefined => {
    const missing = (state.fields ?? []).find((name) => !isKnown(name, fields));
    const fits = keep(part, missing === undefined ? undefined : unknown(missing, fields));
    const coloured = (name: string) => field(name) ?? between(name);
    return fits ? only(state, part, { field: coloured, radius: length, spacing: length }) : undefined;
  };
  fitted.streamlines &&= flow(fitted.streamlines, "streamlines");
  fitted.arrows &&= flow(fitted.arrows, "arrows");
  const { seeds = [] } = fitted.streamlines ?? {};
  if (fitted.streamlines && seeds.length > 0) {
    const inside = seeds.filter(isInside);
    const out = seeds.length - inside.length;
    keep("streamlines.seeds", out === 0 ? undefined : `${out} of ${seeds.length} points are outside of the volume`);
    fitted.streamlines = inside.length === 0 ? undefined : { ...fitted.streamlines, seeds: inside };
  }
  for (const part of FLOWS) if (fitted[part] === undefined) delete fitted[part];
  const isEmpty = PARTS.every((part) => !fitted[part]) && LISTS.every((list) => !fitted[list]?.length);
  const isFirst = !namesParts(scene) || (isEmpty && dropped.length > 0);
  return { scene: isFirst ? { ...fitted, ...firstOf(volume) } : fitted, dropped, isFirst };
}
