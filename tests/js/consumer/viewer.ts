// What a page does with the viewer: each option and event type-checks, and without a page there is a clear error.
import type { FieldSums, LineProfile, Mesh, MtInfo, RegionStats } from "tetralod";
import {
  TetralodError,
  Viewer,
  absolute,
  displaced,
  type BlockMap,
  type DeformState,
  type Misfit,
  type OpenedVolume,
  type Overlay,
  type OwnView,
  type PlaneState,
  type ThresholdState,
  type ViewerFrame,
  type ViewerProgress,
  type Reading,
  type ViewerRefineOptions,
  type ViewerState,
  type ViewerStats,
} from "tetralod/viewer";

const half: PlaneState = { normal: [0, 1, 0], offset: 0.5 };
const own: OwnView = { pixels: 2, outside: "10%" };
const requests: ViewerRefineOptions[] = [
  { error: "1%", box: [0, 0, 0, 1, 1, 1], maxTets: 300_000 },
  { view: own, needs: [{ view: { pixels: 1 }, isovalues: [0.5] }] },
  { view: { ...own, matrix: new Float32Array(16), viewport: [640, 480] } },
  { where: new URL("https://example.org/where.js") },
];

/** Never called here: there is no canvas in Node. */
export async function page(canvas: HTMLCanvasElement): Promise<void> {
  await Viewer.check();
  const viewer: Viewer = await Viewer.create(canvas, { signal: AbortSignal.timeout(1000) });
  viewer.addEventListener("progress", ({ detail }) => void (detail satisfies ViewerProgress));
  viewer.addEventListener("stats", ({ detail }) => void (detail satisfies ViewerStats));
  viewer.addEventListener("frame", ({ detail }) => void (detail satisfies ViewerFrame));
  viewer.addEventListener("error", ({ detail }) => void detail.message);
  const { signal } = new AbortController();
  const first: ViewerState = { streamlines: { fields: ["u", "v", "w"], seeds: [] } };
  const { info, dropped, finished }: OpenedVolume = await viewer.open("volume.mt", {
    fields: ["p"],
    signal,
    state: { ...first, boundary: null },
    request: { error: "5%" },
  });
  dropped.map(({ part, problem }: Misfit) => `${part}: ${problem}`) satisfies string[];
  await viewer.refine({ error: "1%" }, { signal });
  await Promise.all([viewer.settled({ signal }), viewer.isosurface(0.5, { signal }), viewer.screenshot({ signal })]);
  const whole: Mesh = await viewer.mesh({ fields: true });
  whole.tets satisfies Uint32Array;
  absolute(whole).fields[0]?.values satisfies Float32Array | Float64Array | undefined;
  const known: MtInfo | undefined = viewer.info ?? info;
  for (const request of requests) (await viewer.refine(request)) satisfies ViewerStats;
  const value: number = known.fields[0]?.min ?? 0;
  await viewer.set({ isosurfaces: [{ value, opacity: 0.5, edges: true }, { colour: "#ff0000" }, { field: "p" }] });
  await viewer.set({
    volume: {
      opacities: [
        [0, 0],
        [1, 0.5],
      ],
      unitLength: 0.1,
      clipped: false,
    },
  });
  await viewer.set({ slices: [{ ...half, opacity: 0.5, edges: true, field: "p", clipped: false }], clips: [half] });
  await viewer.set({ boundary: { opacity: 0.2, edges: true, colour: "#ffffff" }, clipBox: [0, 0, 0, 1, 1, 1] });
  await viewer.set({ boundary: { colourBy: "region", regionOpacities: { casing: 0.2, 4: 0.5 } } });
  await viewer.set({ cells: { shape: "wire", shrink: 0.2, cut: half, colourBy: "error", width: 2 } });
  await viewer.set({ streamlines: { fields: ["u", "v", "w"], seeds: [[0, 0, 0]], radius: 0.1, field: "p" } });
  const deform: DeformState = { field: "u", factor: 20, phase: 0.25, undeformed: true };
  await viewer.set({ deform });
  await viewer.set({ deform: null });
  const threshold: ThresholdState = { range: [0.2, 0.8], field: "pressure", cut: true };
  await viewer.set({ threshold });
  const bent = displaced(whole, ["u_x", "u_y", "u_z"], 20);
  [bent.positions, bent.tets, viewer.overlay?.deformation?.factor] satisfies [Float32Array | Float64Array, Uint32Array, number | undefined];
  await viewer.set({ arrows: { fields: ["u", "v", "w"], spacing: 0.1, constant: true }, outline: false });
  await viewer.set({ colours: { map: "magma", range: [0, 1], reversed: true, log: true, bands: 8 }, background: "light", shade: 0 });
  await Promise.all([viewer.orbit(0.1, 0), viewer.zoom(2, 0, 0), viewer.pan(0.1, 0), viewer.home()]);
  await Promise.all([viewer.fly(0, 0, 1), viewer.look(0.1, 0), viewer.lookFrom("alongX")]);
  const box: number[] = await viewer.dragRegion(await viewer.pickRegion(0, 0), 0.1, 0);
  await Promise.all([finished, viewer.settled(), viewer.retry(), viewer.set({ region: box, volume: null })]);
  const state: ViewerState = viewer.state;
  await viewer.set(JSON.parse(JSON.stringify(state)) as ViewerState);
  await Promise.all([viewer.keep(), viewer.set({ compare: { at: 0.3, difference: true } }), viewer.freeze(), viewer.freeze(false)]);
  await viewer.keep(await viewer.mesh({ fields: true }), { reach: 0.1 });
  viewer.legend?.apart satisfies number | undefined;
  viewer.legend?.labels satisfies { value: number; colour: string }[] | undefined;
  const blocks: BlockMap | undefined = await viewer.blockMap();
  [blocks?.bounds.length, blocks?.states[0]] satisfies (number | undefined)[];
  const [{ tets }, slice] = await Promise.all([viewer.mesh(), viewer.slice([0, 0, 1], 0.5)]);
  [tets, slice.indices] satisfies Uint32Array[];
  const fast = await Viewer.create(canvas, {
    frameTime: Infinity,
    renderer: "webgl",
    prefetch: "bucky.mt",
    workerUrl: "/viewer-worker.js",
    workerTimeoutMs: Number.POSITIVE_INFINITY,
    wasmUrl: new URL("https://example.org/v.wasm"),
  });
  fast.frameTime = 30;
  await Viewer.create(canvas, { worker: new Worker("/viewer-worker.js", { type: "module" }) });
  const found: Reading | undefined = await viewer.pick(0, 0);
  viewer.addEventListener("overlay", ({ detail }) => void (detail satisfies Overlay | undefined));
  const label: string | undefined = viewer.overlay?.axes[0]?.ticks[0]?.label ?? viewer.overlay?.scaleBar.label;
  const again: Reading | undefined = await viewer.reading(found?.position ?? [0, 0, 0]);
  const along: LineProfile = await viewer.line([0, 0, 0], new Float32Array(3));
  const { percentiles, regions } = await viewer.stats({ bins: 10, range: [0, 1], fractions: [0.02, 0.98] });
  const part: RegionStats | undefined = regions?.[0];
  const sums: FieldSums | undefined = part;
  [part?.name, part?.errorBound, sums?.mean] satisfies (string | number | undefined)[];
  const shots: Blob[] = [await viewer.screenshot(), await viewer.screenshot({ width: 9, height: 9, background: "light" })];
  [label, again?.size, again?.region, again?.all[0], along.at[0], percentiles[0], shots.length] satisfies (string | number | undefined)[];
  const texts: string[] = [
    viewer.adapter,
    String(viewer.isSoftware satisfies boolean),
    viewer.renderer satisfies "webgpu" | "webgl",
    viewer.legend?.label ?? "",
    `${found?.values["p"]}`,
    await viewer.hash(),
  ];
  texts.length satisfies number;
  viewer.free();
}

/** What must not compile. */
export async function misuse(viewer: Viewer): Promise<void> {
  // @ts-expect-error there is no such shape
  await viewer.set({ cells: { shape: "round" } });
  // @ts-expect-error a viewer has one mesh
  await viewer.surface({ request: { error: "1%" } });
  // @ts-expect-error a plane has an offset
  await viewer.set({ clips: [{ normal: [0, 1, 0] }] });
  // @ts-expect-error functions cannot go to the viewer's worker: it takes the URL of a module
  await viewer.refine({ where: () => [] });
  // @ts-expect-error the constructor is private
  new Viewer(document.createElement("canvas"));
}

/** The code of the error with which a viewer is refused where there is no WebGPU. */
export async function refusal(): Promise<string | undefined> {
  return Viewer.check().then(
    () => undefined,
    (error: unknown) => (error instanceof TetralodError ? error.code : undefined),
  );
}
