// A small program of somebody who installed the package: it type-checks, and it runs.
import {
  MultiTessellation,
  TetralodError,
  absolute,
  applyChanges,
  emptyMesh,
  type ErrorCode,
  type FilePart,
  type IsoSurface,
  type Mesh,
  type MtInfo,
  type Need,
  type OpenOptions,
  type RefineOptions,
  type RefineResult,
  type Source,
  type Where,
} from "tetralod";
import { checkBuild } from "./build.js";
import { checkOptions } from "./options.js";
import { refusal } from "./viewer.js";

declare const process: { env: Record<string, string | undefined>; exitCode: number };

const fixture = process.env["TETRALOD_FIXTURE"];
if (!fixture) throw new Error("TETRALOD_FIXTURE is not set");

let chunks = 0;
const options: OpenOptions = { onProgress: (progress) => void (chunks += progress.bytes > 0 ? 1 : 0) };
const source: Source = new URL(`file://${fixture}/small.mt`);
const mt: MultiTessellation = await MultiTessellation.open(source, options);

const info: MtInfo = mt.info;
const request: RefineOptions = { error: "1%", maxTets: 10_000, box: new Float64Array([-1, -1, -1, 99, 99, 99]) };
const mesh: RefineResult = await mt.refine(request);
const positions: Float32Array = mesh.positions;
const surface: IsoSurface = await mt.isosurface((info.fields[0]!.min + info.fields[0]!.max) / 2);
const { fields: onIt } = absolute(await mt.isosurface(0.5, { fields: true }));
onIt satisfies { name: string; values: Float32Array | Float64Array }[];
const hash: string = await mt.hash();

// What three.js has, without three.js.
const matrix = { elements: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 1, -0.5, -0.5, 1, 1] };
const probe: Need = { error: "2%", sphere: { center: { x: 0.5, y: 0.5, z: 0.5 }, radius: 0.2 } };
const copy: RefineResult = await mt.refine({ error: "50%" });
const plain: Mesh = copy;
let steps = 0;
const seen: RefineOptions = { view: { matrix, viewport: [640, 480], pixels: 4, outside: "20%" }, needs: [probe] };
for await (const step of mt.refineSteps(seen, { budgetMs: 2, deltas: true })) {
  applyChanges(copy, step);
  steps++;
}
const whole: RefineResult = await mt.refine(seen);
const followed = copy.tets.length === whole.tets.length && copy.tets.every((vertex, i) => vertex === whole.tets[i]);

mt.addEventListener("progress", ({ detail }) => void (detail.bytes satisfies number));
mt.addEventListener("stats", ({ detail }) => void (detail.limitedBy satisfies string | undefined));
mt.addEventListener("error", ({ detail }) => void detail.message);
const view: MultiTessellation = await mt.view({ onProgress: () => {} });
const { tets: some, stats: limited } = await view.refine({ error: "5%" }, { arrays: ["tets"] });
const beside: IsoSurface = await mt.isosurface(0.5, { normals: "smooth", request: { error: "10%" } });

const local = await MultiTessellation.open(source, { worker: false });
// Compiled only: pages of `tetralod html` have such parts.
export const part: FilePart = { blob: new Blob(), ranges: [0, 99], total: 999, name: "small.mt" };
part satisfies Source;
const where: Where = ({ errors }) => errors.map((error) => error / 0.1);
const asked = await local.refine({ where }, { deltas: true });
const told: Mesh = applyChanges(emptyMesh(), asked);
local.free();

// A call that is given up leaves a mesh that is valid.
const ended = AbortSignal.abort(new Error("enough"));
const why: string[] = await Promise.all(
  [mt.refine({ error: 0 }, { signal: ended }), mt.isosurface(0.5, { signal: ended }), mt.surface({ signal: ended })].map((call) =>
    call.then(
      () => "",
      (error: unknown) => String(error),
    ),
  ),
);

const failed: ErrorCode | undefined = await mt.refine({ error: -1 }).then(
  () => undefined,
  (error: unknown) => (error instanceof TetralodError ? error.code : undefined),
);
mt.free();

// They throw where an option does not do what its type says; the compiler asks for an example of each.
await checkOptions(source);
await checkBuild();

const good =
  chunks > 0 &&
  positions.length === 3 * mesh.stats.vertices &&
  mesh.tets.length === 4 * mesh.stats.tetrahedra &&
  surface.indices.length % 3 === 0 &&
  /^[0-9a-f]{16}$/.test(hash) &&
  steps > 0 &&
  followed &&
  whole.stats.bounds.length === 3 &&
  some.length === 4 * limited.tetrahedra &&
  limited.limitedBy === "error" &&
  beside.indices.length > 0 &&
  asked.stats.satisfied &&
  told.tets.length === 4 * asked.tetCount &&
  plain.tets === copy.tets &&
  why.every((words) => words === "Error: enough") &&
  failed === "bad-option" &&
  (await refusal()) === "no-webgpu";
console.log(`${info.vertices} vertices, ${mesh.stats.tetrahedra} tetrahedra extracted, hash ${hash}`);
if (!good) throw new Error("the installed package does not do what its types say");
