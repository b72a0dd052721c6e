// Building, as a program that installed the package does it: every option in use, and the result opens.
import { MultiTessellation } from "tetralod";
import {
  TetralodError,
  build,
  inspect,
  type AveragedField,
  type BuildOptions,
  type BuildPhase,
  type BuildProgress,
  type BuildReport,
  type InputField,
  type InputFormat,
  type InputInfo,
  type MeshSource,
  type NamedFile,
  type RepairReport,
} from "tetralod/build";

/** For each option of `T` something that has it. */
type Examples<T> = { [Name in keyof T]-?: T & Required<Pick<T, Name>> };

const SAMPLES = Array.from({ length: 64 }, (_, i) => (i * i) % 23);
const GRID = [
  "# vtk DataFile Version 3.0",
  "grid",
  "ASCII",
  "DATASET STRUCTURED_POINTS",
  "DIMENSIONS 4 4 4",
  "ORIGIN 0 0 0",
  "SPACING 1 1 1",
  "POINT_DATA 64",
  "SCALARS p float 1",
  "LOOKUP_TABLE default",
  SAMPLES.join(" "),
].join("\n");

const fractions = new Map<BuildPhase, number>();

const examples: Examples<BuildOptions> = {
  kind: { kind: "edge" },
  method: { method: "insert" },
  criterion: { kind: "vertex", criterion: "delaunay" },
  purpose: { purpose: "regions" },
  tetErrors: { tetErrors: true },
  fields: { fields: ["p"] },
  allFields: { allFields: true },
  cellToPoint: { cellToPoint: false },
  meanAcrossRegions: { meanAcrossRegions: true },
  labels: { labels: { p: true } },
  preserve: { preserve: ["components"] },
  preserveWithin: { preserveWithin: 0.01 },
  repair: { repair: "none" },
  weldDistance: { repair: "weld", weldDistance: 0.25 },
  units: { units: { p: "Pa" } },
  metadata: { metadata: { about: "an example" } },
  positionBits: { positionBits: 12 },
  positionTolerance: { positionTolerance: 0.01 },
  fieldBits: { fieldBits: { p: 12 } },
  fieldTolerance: { fieldTolerance: "1%" },
  lossless: { lossless: ["p"] },
  displacement: { displacement: "20%" },
  displacementEdges: { displacementEdges: Number.POSITIVE_INFINITY },
  minDihedral: { minDihedral: 10 },
  featureAngle: { featureAngle: 45 },
  blockUpdates: { blockUpdates: 64 },
  signal: { signal: AbortSignal.timeout(600_000) },
  memory: { memory: 1e9 },
  workerUrl: { workerUrl: import.meta.resolve("tetralod/build-worker") },
  workerTimeoutMs: { workerTimeoutMs: 60_000 },
  wasmUrl: { wasmUrl: new URL(import.meta.resolve("tetralod/build.wasm")) },
  onProgress: { onProgress: (progress: BuildProgress) => void fractions.set(progress.phase, progress.fraction) },
};

/** Builds with each option. */
export async function checkBuild(): Promise<void> {
  const named: NamedFile = { name: "grid.vtk", data: new Blob([GRID]) };
  const source: MeshSource = named;
  const info: InputInfo = await inspect([source]);
  const format: InputFormat = info.format;
  if (format !== "vtk") throw new Error("this is not its format");
  const field: InputField | undefined = info.fields[0];
  if (field?.name !== "p" || !info.memory.fits || info.bounds?.[3] !== 3) throw new Error("this is not what is in the file");
  for (const options of Object.values(examples)) {
    const { bytes, report }: { bytes: Uint8Array<ArrayBuffer>; report: BuildReport } = await build(source, options);
    const mt = await MultiTessellation.open(bytes);
    if (mt.info.tetrahedra !== report.tetrahedra || report.tetrahedra < 100) throw new Error("it is not what was built");
    mt.free();
    const averaged: AveragedField[] = report.averaged;
    if (averaged.length > 0) throw new Error("no field is at cells");
    const repair: RepairReport | undefined = report.repair;
    if (repair?.level !== (options.repair ?? "safe") || repair.components !== 1 || repair.kept !== "") throw new Error("this is not repaired");
  }
  if (fractions.get("encode") !== 1) throw new Error("the end is not told");
  const refused = await build({ raw: new Uint8Array(8), json: new Blob(["{}"]) }).catch((error: unknown) => error);
  if (!(refused instanceof TetralodError) || refused.code !== "corrupt") throw new Error("this is not refused");
}

export async function misuse(): Promise<void> {
  // @ts-expect-error a number is no file
  await build(7);
  // @ts-expect-error there is no such kind
  await build(new Blob(), { kind: "cubes" });
  // @ts-expect-error raw samples have a JSON beside them
  await inspect({ raw: new Blob() });
  // @ts-expect-error inspecting has no progress
  await inspect(new Blob(), { onProgress() {} });
}
