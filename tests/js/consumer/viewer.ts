// What a page does with the viewer: each option and event type-checks, and without a page there is a clear error.
import type { MtInfo } from "tetralod";
import {
  TetralodError,
  Viewer,
  type ClipPlane,
  type OpenedVolume,
  type OwnView,
  type ViewerFrame,
  type ViewerProgress,
  type ViewerRefineOptions,
  type ViewerStats,
} from "tetralod/viewer";

const half: ClipPlane = { normal: [0, 1, 0], offset: 0.5 };
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
  const { info, finished }: OpenedVolume = await viewer.open("volume.mt", { fields: ["p"] });
  const known: MtInfo | undefined = viewer.info ?? info;
  for (const request of requests) (await viewer.refine(request)) satisfies ViewerStats;
  await viewer.setMode("cutaway");
  await viewer.setIsovalue(known.fields[0]?.min ?? 0);
  await viewer.setClip(half);
  await viewer.setRoi(new Float64Array(6));
  await Promise.all([viewer.orbit(0.1, 0), viewer.zoom(2), viewer.pan(0.1, 0), viewer.home()]);
  const box: number[] = await viewer.dragRoi(await viewer.pickRoi(0, 0), 0.1, 0);
  await Promise.all([finished, viewer.settled(), viewer.retry(), viewer.setRoi(box), viewer.setClip(null)]);
  const texts: string[] = [viewer.adapter, ...viewer.palette, await viewer.hash()];
  texts.length satisfies number;
  viewer.free();
}

/** What must not compile. */
export async function misuse(viewer: Viewer): Promise<void> {
  // @ts-expect-error there is no such mode
  await viewer.setMode("iso-surface");
  // @ts-expect-error a plane has an offset
  await viewer.setClip({ normal: [0, 1, 0] });
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
