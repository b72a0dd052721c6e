// A small program of somebody who installed the package: it type-checks, and it runs.
import {
  MultiTessellation,
  TetralodError,
  type ErrorCode,
  type IsoSurface,
  type MtInfo,
  type OpenOptions,
  type RefineOptions,
  type RefineResult,
  type Source,
} from "tetralod";

declare const process: { env: Record<string, string | undefined>; exitCode: number };

const fixture = process.env["TETRALOD_FIXTURE"];
if (!fixture) throw new Error("TETRALOD_FIXTURE is not set");

let chunks = 0;
const options: OpenOptions = { onProgress: (progress) => void (chunks += progress.bytes > 0 ? 1 : 0) };
const source: Source = new URL(`file://${fixture}/small.mt`);
const mt: MultiTessellation = await MultiTessellation.open(source, options);
await mt.complete;

const info: MtInfo = mt.info;
const request: RefineOptions = { error: "1%", maxTets: 10_000, box: new Float64Array([-1, -1, -1, 99, 99, 99]) };
const mesh: RefineResult = await mt.refine(request);
const positions: Float32Array = mesh.positions;
const surface: IsoSurface = await mt.isosurface((info.fields[0]!.min + info.fields[0]!.max) / 2);
const hash: string = await mt.hash();

const failed: ErrorCode | undefined = await mt.refine({ error: -1 }).then(
  () => undefined,
  (error: unknown) => (error instanceof TetralodError ? error.code : undefined),
);
mt.free();

const good =
  chunks > 0 &&
  positions.length === 3 * mesh.stats.vertices &&
  mesh.tets.length === 4 * mesh.stats.tetrahedra &&
  surface.indices.length % 3 === 0 &&
  /^[0-9a-f]{16}$/.test(hash) &&
  failed === "bad-option";
console.log(`${info.vertices} vertices, ${mesh.stats.tetrahedra} tetrahedra extracted, hash ${hash}`);
if (!good) throw new Error("the installed package does not do what its types say");
