// Every option that the types have, in use: the compiler asks for an example of each, and each is run.
import {
  MultiTessellation,
  type Averaged,
  type BlockProgress,
  type ErrorCurve,
  type Extreme,
  type Extremes,
  type FieldInfo,
  type FieldValues,
  type MtInfo,
  type Need,
  type OpenOptions,
  type Progress,
  type RefineOptions,
  type RefineStats,
  type ResultOptions,
  type StepOptions,
  type TransferOptions,
  type ViewOptions,
} from "tetralod";

/** For each option of `T` something that has it. */
type Examples<T, Whole = T> = { [Name in keyof T]-?: Whole & Required<Pick<T, Name>> };

const MATRIX = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 1, -0.5, -0.5, 1, 1];
const VIEW: ViewOptions = { matrix: MATRIX, viewport: [640, 480], pixels: 4 };
const POINTS = [
  [0.2, 0, 0, 0, 0],
  [0.6, 1, 0, 0, 0.5],
];

const views: Examples<ViewOptions> = {
  matrix: { ...VIEW, matrix: { elements: new Float64Array(MATRIX) } },
  viewport: { ...VIEW, viewport: new Uint32Array([640, 480]) },
  pixels: { ...VIEW, pixels: 0.5 },
  outside: { ...VIEW, outside: "20%" },
};

const transfers: Examples<TransferOptions> = {
  points: { points: POINTS },
  unitLength: { points: POINTS.flat(), unitLength: 0.2 },
};

const needs: Examples<Omit<Need, Parted>> = {
  error: { error: 0.01 },
  field: { error: "1%", field: 0 },
  box: { error: "1%", box: { min: { x: 0, y: 0, z: 0 }, max: [0.5, 0.5, 0.5] } },
  sphere: { error: "1%", sphere: { center: new Float32Array([0.5, 0.5, 0.5]), radius: 0.2 } },
  orientedBox: { error: "1%", orientedBox: { center: [0.5, 0.5, 0.5], halfAxes: [{ x: 0.1, y: 0.1, z: 0 }, [-0.1, 0.1, 0], [0, 0, 0.2]] } },
  halfSpace: { error: "1%", halfSpace: { normal: [1, 1, 0], offset: 0.5 } },
  slab: { error: "1%", slab: { normal: { x: 0, y: 0, z: 1 }, offset: 0.5, thickness: 0.01 } },
  planes: {
    error: "1%",
    planes: [
      [1, 0, 0, 0.3],
      [0, 1, 0, 0.3],
    ],
  },
  isovalues: { error: "1%", isovalues: new Float64Array([0.5]) },
  ranges: { error: "1%", ranges: [0.2, 0.3, 0.6, 0.7] },
  view: { view: VIEW },
  transfer: { error: "5%", transfer: { points: POINTS } },
};

const requests: Examples<Omit<RefineOptions, Parted>> = {
  ...needs,
  needs: { needs: Object.values(needs) },
  where: { where: ({ errors }) => errors.map((error) => error / 0.1) },
  whereBox: { where: ({ errors }) => errors.map((error) => error / 0.1), whereBox: [0, 0, 0, 0.5, 0.5, 0.5] },
  maxTets: { error: 0, maxTets: 1000 },
  maxVertices: { error: 0, maxVertices: 500 },
  maxBytes: { error: 0, maxBytes: 100_000 },
};

const ofParts: Examples<Pick<RefineOptions, Parted>> = {
  regions: { regions: ["stator", 4] },
};

const steps: Examples<StepOptions> = {
  budgetMs: { budgetMs: 1 },
  updates: { updates: 50 },
  arrays: { arrays: ["positions", "tets"] },
  signal: { signal: new AbortController().signal },
};

const results: Examples<ResultOptions> = {
  partial: { partial: true },
  arrays: { arrays: ["field"] },
  fields: { fields: [0] },
  zeroCopy: { zeroCopy: true },
  signal: { signal: new AbortController().signal },
};

const openings: Examples<OpenOptions> = {
  fields: { fields: [] },
  memory: { memory: 2 ** 20 },
  cache: { cache: "volumes" },
  whole: { whole: true },
  headers: { headers: { "x-key": "open" } },
  credentials: { credentials: "same-origin" },
  retries: { retries: 1 },
  backoffMs: { backoffMs: 10 },
  timeoutMs: { timeoutMs: 1000 },
  gap: { gap: 256 },
  signal: { signal: new AbortController().signal },
  onProgress: { onProgress: () => {} },
  worker: { worker: false },
  workerUrl: { workerUrl: import.meta.resolve("tetralod/worker") },
  workerTimeoutMs: { workerTimeoutMs: 60_000 },
  wasmUrl: { wasmUrl: new URL(import.meta.resolve("tetralod/core.wasm")) },
};

/** Options of requests to volumes that are parted, which the source is not: it refuses them. */
type Parted = "regions";

/** The members that a result has by its type, each with the kinds of value that it may have. */
type Members<T> = { [Name in keyof T]-?: string };

const stats: Members<RefineStats> = {
  vertices: "number",
  tetrahedra: "number",
  applied: "number",
  refined: "number",
  coarsened: "number",
  forced: "number",
  judged: "number",
  errorBound: "number",
  relativeErrorBound: "number",
  fieldBound: "number",
  boundaryBound: "number",
  bounds: "object",
  excess: "number",
  satisfied: "boolean",
  missing: "boolean",
  done: "boolean",
  milliseconds: "number",
  limitedBy: "string undefined",
};

const infos: Members<MtInfo> = {
  kind: "string",
  fields: "object",
  bounds: "object",
  origin: "object",
  vertices: "number",
  tetrahedra: "number",
  exactValues: "string",
  firstField: "number",
  surfaceFirst: "boolean",
  regions: "object undefined",
  updates: "number",
};

const fields: Members<FieldInfo> = {
  name: "string",
  min: "number",
  max: "number",
  bits: "number",
  offset: "number",
  scale: "number",
  unit: "string",
  time: "number undefined",
  vector: "object undefined",
  floor: "number",
  histogram: "object",
  extremes: "object undefined",
  averaged: "object undefined",
  isovalue: "number",
  curve: "object",
  isLabel: "boolean",
};

const values: Members<FieldValues> = {
  index: "number",
  name: "string",
  unit: "string",
  time: "number undefined",
  vector: "object undefined",
  values: "object",
  offset: "number",
  scale: "number",
};

const curves: Members<ErrorCurve> = {
  errors: "object",
  bytes: "object",
};

const extremes: Members<Extremes> = {
  min: "object",
  max: "object",
};

const points: Members<Extreme> = {
  value: "number",
  place: "object",
  cell: "number undefined",
  part: "string undefined",
};

/** Compiled only: the file has no field that was averaged from cells. */
export const averages: Members<Averaged> = {
  input: "object",
  difference: "object",
};

const progresses: Members<Progress> = {
  ready: "boolean",
  complete: "boolean",
  bytes: "number",
  total: "number undefined",
  updates: "number",
  blocks: "object undefined",
};

/** Compiled only: blocks are those of files on servers. */
export const blocks: Members<BlockProgress> = {
  all: "number",
  here: "number",
  needed: "number",
  leftOut: "number",
  absent: "number",
  bytes: "number",
  missed: "number",
};

/** A result has the members of its type, of these kinds, and no others. */
function hasMembers(name: string, result: object, members: Record<string, string>): void {
  for (const [member, kinds] of Object.entries(members)) {
    const kind = typeof (result as Record<string, unknown>)[member];
    if (!kinds.split(" ").includes(kind)) throw new Error(`${name}.${member} is of kind ${kind}, not ${kinds}`);
  }
  const unknown = Object.keys(result).filter((member) => !(member in members));
  if (unknown.length > 0) throw new Error(`the type of ${name} lacks ${unknown.join(", ")}`);
}

/** Runs every option; throws where one does not do what it should. */
export async function checkOptions(source: URL): Promise<void> {
  for (const options of Object.values(openings)) {
    const opened = await MultiTessellation.open(source, options);
    opened.free();
  }
  const mt = await MultiTessellation.open(source, { worker: false });
  await mt.complete;
  hasMembers("info", mt.info, infos);
  for (const field of mt.info.fields) {
    hasMembers("field", field, fields);
    hasMembers("curve", field.curve, curves);
    if (!field.extremes) throw new Error("the file does not say where its extremes are");
    hasMembers("extremes", field.extremes, extremes);
    hasMembers("extreme", field.extremes.max, points);
  }
  hasMembers("progress", mt.progress, progresses);
  const all: RefineOptions[] = Object.values(requests);
  all.push(...Object.values(views).map((view) => ({ view })), ...Object.values(transfers).map((transfer) => ({ error: 0.1, transfer })));
  for (const options of all) {
    const { stats: done } = await mt.refine(options);
    const isBudgeted = [options.maxTets, options.maxVertices, options.maxBytes].some((most) => most !== undefined);
    if (!done.satisfied && !isBudgeted) throw new Error(`not satisfied: ${Object.keys(options).join(", ")}`);
    hasMembers("stats", done, stats);
  }
  for (const options of Object.values(ofParts)) {
    const refused = await mt.refine({ error: 0.5, ...options }).then(
      () => false,
      () => true,
    );
    if (!refused) throw new Error("regions of a volume that has none");
  }
  for (const how of Object.values(results)) {
    const { stats: done, fields: found } = await mt.refine({ error: "5%" }, how);
    if (!done.done) throw new Error("not done");
    for (const field of found) hasMembers("values", field, values);
    if (how.fields && found.length === 0) throw new Error("there are no fields");
  }
  // Each from another mesh, so that there are steps.
  for (const [i, options] of Object.values(steps).entries()) {
    let last: RefineStats | undefined;
    for await (const step of mt.refineSteps({ error: `${40 + i}%` }, options)) last = step.stats;
    if (!last?.done) throw new Error("the steps do not come to an end");
  }
  mt.free();
}
