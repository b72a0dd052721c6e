/** The worker behind `Viewer`: decodes, refines and draws, so that the page never waits for any of it. */

import init, { Gpu, RangeLoader, Viewer } from "./tetralod_viewer.js";
import { type FlatError, TetralodError, flattenError } from "./errors.js";
import type { Update } from "./latest.js";
import { type Unchecked, received } from "./options.js";
import { Parts } from "./parts.js";
import type { RangesOptions } from "./ranges.js";
import type { BlockMap, FieldInfo, Mesh, Progress } from "./results.js";
import { ownEndpoint, serve } from "./rpc.js";
import type { Reading, SceneState, ViewerChanges } from "./scene.js";
import { type Loaded, type WasmSource, wasmError, wasmOf } from "./start.js";
import { type WantedFields, fieldsOf, withFields } from "./stored.js";
import { meshToolMethods } from "./tools.js";
import { VERSION } from "./version.js";
import { fetchAhead, takeAhead } from "./viewer-ahead.js";
import { Frames } from "./viewer-frames.js";
import { MeshWork } from "./viewer-mesh.js";
import { Pace } from "./viewer-pace.js";
import { type Met, Shown, type Wanted } from "./viewer-shown.js";
import { GlCanvas } from "./webgl.js";

/** A screenshot is the mean of so many pictures at most. */
const MOST_SAMPLES = 256;

/** A viewer, what it shows, the mesh that this is of, and when and how finely it is drawn. */
interface Stage {
  viewer: Viewer;
  shown: Shown;
  mesh: MeshWork;
  pace: Pace;
  frames: Frames;
}

let stage: Stage | undefined;

function on(): Stage {
  if (stage) return stage;
  throw new TetralodError("internal", "there is no viewer yet");
}

const invalidate = () => on().frames.invalidate();

/** What draws. */
const device = () => {
  const { viewer } = on();
  return { renderer: viewer.renderer as RendererName, adapter: viewer.adapter(), isSoftware: viewer.isSoftware };
};

/** A mesh of another viewer, with values in the units of its fields. */
export interface Kept {
  positions: Float64Array;
  tets: Uint32Array;
  fields: { name: string; time: number | undefined; values: Float64Array }[];
  reach: number;
}

/** The fields of a volume that such a mesh has, by their numbers, and their values, one behind the other. */
function keptFields(own: readonly Pick<FieldInfo, "name" | "time">[], kept: Kept["fields"]): [numbers: Uint32Array, values: Float64Array] {
  const found = own.flatMap(({ name, time }, number) => {
    const same = kept.find((one) => one.name === name && one.time === time);
    return same ? [{ number, values: same.values }] : [];
  });
  const length = found.reduce((sum, { values }) => sum + values.length, 0);
  const all = new Float64Array(length);
  let at = 0;
  for (const { values } of found) {
    all.set(values, at);
    at += values.length;
  }
  return [Uint32Array.from(found, ({ number }) => number), all];
}

/** What a viewer draws with. */
export type RendererName = "webgpu" | "webgl";

/** Opens the GPU for a canvas. */
async function opened(renderer: RendererName, canvas: OffscreenCanvas, width: number, height: number): Promise<Gpu> {
  if (renderer === "webgpu") return Gpu.open(canvas, width, height);
  Object.assign(canvas, { width, height });
  return Gpu.webgl(new GlCanvas(canvas), width, height);
}

/** Another volume takes the place of the one before, of which this is drawn. */
function forget(wanted: Wanted) {
  const { shown, mesh, frames } = on();
  shown.forget(wanted);
  mesh.forget(wanted.request);
  frames.forget();
  frames.invalidate();
}

/** What came of a file, and of the volume in it, once its first picture is out. */
type Opened = { progress: Progress & { traffic?: Parts["traffic"] } } & Partial<Met>;

/** Makes the session for a file in parts: what is shown stays until its first bytes are here. */
const sessionFor = (wanted: Wanted, fields: readonly string[], memory: number) => (loader: RangeLoader) => {
  const { viewer, shown } = on();
  viewer.openParts([...fields], memory, loader);
  return {
    supply() {
      const before = viewer.isOpening;
      try {
        return viewer.supply();
      } finally {
        if (before && !viewer.isOpening) forget(wanted);
        if (!viewer.isOpening) shown.meet();
      }
    },
    get isWaiting() {
      return viewer.isWaiting;
    },
    progress: () => viewer.progress(),
    blocks: () => viewer.blocks(),
  };
};

/** Blocks have arrived. */
function blocksCame(progress: Progress) {
  const { mesh } = on();
  mesh.bytes = progress.bytes;
  emit("progress", { ...progress, traffic: mesh.parts?.traffic });
  mesh.blocksCame();
}

const methods = {
  /**
   * Compiles the wasm module; without `wasm`, its address, the one of the package. `ahead` is the URL of a file that is opened next:
   * its first bytes are fetched meanwhile.
   */
  async load(wasm?: WasmSource, ahead?: string): Promise<Loaded> {
    if (ahead !== undefined) fetchAhead(ahead);
    const source = wasm ?? new URL("./tetralod_viewer_bg.wasm", import.meta.url);
    await wasmOf(source)
      .then((found) => init({ module_or_path: found }))
      .catch((error) => Promise.reject(wasmError(error, "tetralod/viewer.wasm")));
    return { name: "viewer", version: VERSION };
  },

  async create(canvas: OffscreenCanvas, width: number, height: number, ratio: number, frameTime: number, renderer: RendererName) {
    const viewer = new Viewer(await opened(renderer, canvas, width, height), ratio);
    const mesh = new MeshWork(viewer, emit, invalidate);
    const pace = new Pace(viewer, mesh, frameTime, invalidate);
    stage = { viewer, mesh, pace, shown: new Shown(viewer), frames: new Frames(viewer, mesh, pace, emit) };
    invalidate();
    return device();
  },

  /** Opens the GPU again after it was lost, for another canvas, and draws everything anew. */
  async restore(canvas: OffscreenCanvas, width: number, height: number, ratio: number) {
    const { viewer, frames } = on();
    frames.restart(await opened(viewer.renderer as RendererName, canvas, width, height));
    viewer.resize(width, height, ratio);
    invalidate();
    return device();
  },

  async clear(fields: readonly string[], state: ViewerChanges, request?: Unchecked) {
    const { viewer, shown } = on();
    const wanted = { ...shown.first(state), request: request && (await received(request)) };
    methods.halt();
    viewer.clear([...fields]);
    forget(wanted);
  },

  /** Takes a chunk; the answer to the one that brings the base mesh waits until the first picture is out. */
  async feed(chunk: Uint8Array): Promise<Opened> {
    const { viewer, shown, mesh, frames } = on();
    const progress = viewer.feed(chunk);
    mesh.bytes = progress.bytes;
    if (!progress.ready) return { progress };
    shown.meet();
    if (mesh.ready) {
      mesh.came();
      return { progress };
    }
    mesh.ready = true;
    mesh.follow();
    mesh.stepAll();
    await frames.drawn();
    // Whoever opened it finds the camera that looks at it, also where the picture takes long.
    frames.reportCamera();
    return { progress, ...shown.met() };
  },

  /** Opens a file in parts; resolves to nothing where the server gives no ranges, and otherwise when it has been drawn. */
  async openParts(
    url: string,
    { fields, memory, state, request, ...options }: RangesOptions & { fields: readonly string[]; memory: number; state: ViewerChanges; request?: Unchecked | undefined },
  ): Promise<Opened | undefined> {
    const { viewer, shown, mesh, frames } = on();
    const wanted = { ...shown.first(state), request: request && (await received(request)) };
    methods.halt();
    const onError = (error: TetralodError) => {
      if (mesh.ready && !viewer.isOpening) emit("error", flattenError(error));
    };
    const make = sessionFor(wanted, fields, memory);
    const mine = (mesh.parts = new Parts(RangeLoader, make, url, { ...options, ...takeAhead(url) }, blocksCame, onError));
    const served = await mine.begin();
    if (mine !== mesh.parts) throw new TetralodError("replaced", "another volume was opened");
    if (!served) {
      mesh.parts = undefined;
      return undefined;
    }
    mesh.ready = true;
    // What a request needs is fetched while the first picture is drawn.
    if (request) mesh.follow();
    invalidate();
    await frames.drawn();
    frames.reportCamera();
    return { progress: { ...mine.progress, traffic: mine.traffic }, ...shown.met() };
  },

  /**
   * Resolves when the mesh is what was asked for, for the camera as it is, and all data that it needs has arrived. Arriving blocks may
   * show that others are needed; a mesh that is held to fewer tetrahedra while something moves is not the one.
   */
  async settled() {
    const { mesh, frames } = on();
    const mine = mesh.parts;
    await mine?.settled();
    while (mesh.ready && mine === mesh.parts && !frames.isBroken && mesh.isBehind) {
      await frames.drawn();
      await mine?.settled();
    }
  },

  /** Resolves when the picture shows what is set, with all its pixels, and the GPU has finished it. */
  async pictured() {
    const { frames } = on();
    while (!frames.isBroken && frames.isBehind) await frames.drawn();
  },

  retry: () => on().mesh.parts?.retry(),

  halt() {
    const { mesh } = on();
    mesh.parts?.close(new TetralodError("replaced", "the download was ended"));
    mesh.parts = undefined;
  },

  finish(): Progress {
    const progress = on().viewer.finish();
    on().mesh.follow();
    return progress;
  },

  /** Resolves at once, to the number of the request; its steps are reported as `stats` with this number. */
  async setRequest(options: Unchecked): Promise<number> {
    on().mesh.request(await received(options));
    return on().mesh.goal;
  },

  /** Makes the first request, unless there is one. */
  follow: () => on().mesh.begin(),

  /** Gives a request up, if it is the last one: the one before it holds again. */
  abandon: (given: number) => on().mesh.abandon(given),

  /**
   * Applies what has been set since the last call, in one go.
   *
   * Changes of the scene and the camera are made or refused one by one; what is wrong in one does not keep others back.
   */
  update({ sets = [], orbit, zoom, pan, fly, look, home, side, size }: Update): { scene: SceneState; refused: Record<number, FlatError> } {
    const { viewer, shown, pace } = on();
    if (size) viewer.resize(...size);
    if (home) viewer.home();
    if (side) viewer.lookFrom(side);
    const refused: Record<number, FlatError> = {};
    for (const set of sets) {
      const error = shown.change(set);
      if (error) refused[set.id] = error;
    }
    if (orbit) viewer.orbit(...orbit);
    if (zoom) viewer.zoom(...zoom);
    if (pan) viewer.pan(...pan);
    if (fly) viewer.fly(...fly);
    if (look) viewer.look(...look);
    if (size) pace.resized();
    else pace.move();
    invalidate();
    return { scene: shown.scene, refused };
  },

  setFrameTime(milliseconds: number) {
    on().pace.frameTime = milliseconds;
  },

  pickRegion: (x: number, y: number): number => on().viewer.pickRegion(x, y),

  dragRegion(handle: number, x: number, y: number): number[] {
    const { viewer, shown } = on();
    const region = Array.from(viewer.dragRegion(handle, x, y));
    shown.scene = { ...shown.scene, region };
    invalidate();
    return region;
  },

  keep(other?: Kept) {
    const { viewer } = on();
    if (other) viewer.keepOther(other.positions, other.tets, ...keptFields(viewer.info()?.fields ?? [], other.fields), other.reach);
    else viewer.keep();
    invalidate();
  },

  freeze(isFrozen: boolean) {
    on().viewer.freeze(isFrozen);
    invalidate();
  },

  /** What is shown at a point of the canvas. */
  pick: (x: number, y: number): Reading | undefined => on().viewer.pick(x, y),

  /** What is at a point of the model. */
  reading: (x: number, y: number, z: number): Reading | undefined => on().viewer.reading(x, y, z),

  /** A picture of any size; what is on the canvas of the page stays. */
  async screenshot(width: number, height: number, samples: number, background: SceneState["background"]): Promise<Blob> {
    const { viewer, shown, frames } = on();
    const canvas = new OffscreenCanvas(width, height);
    return frames.whileHeld(async () => {
      try {
        if (background !== undefined) viewer.setScene({ ...shown.scene, background });
        viewer.beginScreenshot(canvas);
        // How much memory transparent parts take is known after a picture.
        do {
          viewer.drawScreenshot(1);
          await frames.idle();
        } while (viewer.isScreenshotShort());
        viewer.drawScreenshot(Math.min(samples, MOST_SAMPLES));
        // At once: the canvas is empty in the next task.
        return await canvas.convertToBlob({ type: "image/png" });
      } finally {
        viewer.endScreenshot();
        if (background !== undefined) viewer.setScene(shown.scene);
      }
    });
  },

  mesh(wanted?: WantedFields): Mesh {
    const { viewer } = on();
    const fields = fieldsOf(() => viewer.info(), wanted);
    return withFields(viewer.mesh(), fields, fields.map(({ index }) => viewer.values(index)));
  },

  /** Where the blocks of the file are, and which of them are here; nothing where it has none. */
  blockMap: (): BlockMap | undefined => on().viewer.blockMap(),

  ...meshToolMethods(() => on().viewer),

  /** The same for the same request, whatever moved before: so of the mesh at rest. */
  async hash(): Promise<string> {
    await methods.settled();
    return on().viewer.hash();
  },
};

export type ViewerMethods = typeof methods;

const emit = serve(ownEndpoint(), methods, ["openParts", "settled", "pictured", "hash"]);
