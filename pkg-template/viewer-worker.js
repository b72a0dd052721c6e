/**
 * The worker behind `Viewer`: decodes, refines and draws, so that the page never waits for any of it.
 *
 * Frames are drawn when something has changed, at most one for each refresh of the screen. Between frames the mesh is
 * refined in steps, so that the camera waits for at most one step.
 */

import init, { Gpu, RangeLoader, Viewer } from "./tetralod_viewer.js";
import { TetralodError, flattenError } from "./errors.js";
import { changedScene, checkFields, fitScene } from "./fit.js";
import { received } from "./options.js";
import { Parts } from "./parts.js";
import { serve, webEndpoint } from "./rpc.js";
import { wasmError, wasmOf } from "./start.js";
import { fieldsOf, withFields } from "./stored.js";
import { limitOf, meshToolMethods } from "./tools.js";
import { VERSION } from "./version.js";

/** While a file streams in, the mesh follows it this often (in ms), and at most half of the time is spent on that. */
const FOLLOW = 120;
/** While something moves a step is as long as the last picture took, but not shorter or longer than this (in ms). */
const STEP = [6, 30];
/** At rest nobody waits for the next picture: a step may take so long (in ms). */
const LONG_STEP = 50;
/** Hidden pages have no frames, slow ones few: after so long without one (in ms) the mesh follows between them. */
const HIDDEN = 100;

/** So many bytes of a file are fetched ahead: as many as its first request asks for. */
const HEAD = 65536;

/** Colours of a legend. */
const COLOURS = 32;
/** A screenshot is the mean of so many pictures at most. */
const MOST_SAMPLES = 256;

/** @type {Viewer | undefined} */
let viewer;
/** Fetches the blocks of a file that is read in parts. @type {Parts | undefined} */
let parts;
/** What a mesh is without a request: what the picture shows, within a budget that any machine can draw. */
const FIRST_REQUEST = { view: { pixels: 1, outside: "10%" }, maxTets: 500_000 };
/** The last request, and whether the viewer has it: it takes none before the base mesh has arrived. */
let request = FIRST_REQUEST;
let isRequested = false;
/** The request before it, which holds again if it is given up. */
let before = FIRST_REQUEST;
/** Counts the requests; steps carry the number of their request. */
let goal = 0;
/** The work for it: the sums over its steps. */
let total = {};
/** When the last refinement ended, and how long it took. */
let lastRefine = { end: -Infinity, took: 0 };
let drawing = 0;
/** When the last picture was begun, while the GPU has not finished it; and how long it took to finish the one before. */
let begun;
let took = 0;
/** Whether the GPU has finished a picture: the first one waits for pipelines to be compiled, so its time says nothing. */
let isWarm = false;
/** The part of the pixels, in each direction, with which a picture takes about as long as it should. */
let scale = 1;
/** Sharpens the picture when nothing changes any more. */
let resting;
let bytes = 0;
let ready = false;
let frameAsked = false;
/** The timer of the next refinement with new data. */
let following;
let hidden;
let broken = false;
/** How long a picture should take while something moves (in ms). */
let frameTime = 60;
/** Tetrahedra of the mesh, and how many a picture can have while something moves. */
let tets = 0;
let affordable = Infinity;
/** The number that the mesh is held to now. @type {number | undefined} */
let held;
/** What is drawn. @type {Record<string, any>} */
let shown = {};
/** The volume that it is drawn of, once its base mesh is there. @type {{ fields: any[], bounds: number[] } | undefined} */
let volume;
/** What is to be drawn of the volume that is being opened, and what did not fit it. */
let wanted;
/** @type {{ part: string, problem: string }[]} */
let dropped = [];
/** Whether a screenshot is being made: frames wait for it. */
let isTaking = false;

/** Pictures have these parts of the pixels, in each direction, while something moves. */
const SCALES = [1, 0.7, 0.5, 0.35, 0.25];
/** After so long without movement, the picture is made sharp again (in ms). */
const REST = 250;
/** Where fewer pixels do not help, a mesh of fewer tetrahedra is drawn while something moves, but of no fewer than these. */
const FEWEST_TETS = 10_000;
/** How often it is looked whether the GPU is lost while nothing is drawn (in ms). */
const CHECK = 1000;
/** Pictures that take longer than this are drawn once, not several times for smooth edges. */
const SLOW = 100;

const nextFrame =
  typeof requestAnimationFrame === "function" ? requestAnimationFrame : (then) => setTimeout(then, 16);

const methods = {
  /**
   * Compiles the wasm module; without `wasm`, its address, the one of the package. `ahead` is the URL of a file that is opened next:
   * its first bytes are fetched meanwhile.
   */
  async load(wasm, ahead) {
    if (ahead !== undefined) fetchAhead(ahead);
    const source = wasm ?? new URL("./tetralod_viewer_bg.wasm", import.meta.url);
    await wasmOf(source)
      .then((found) => init({ module_or_path: found }))
      .catch((error) => Promise.reject(wasmError(error, "tetralod/viewer.wasm")));
    return { name: "viewer", version: VERSION };
  },

  async create(canvas, width, height, ratio, milliseconds) {
    frameTime = milliseconds;
    viewer = new Viewer(await Gpu.open(canvas, width, height), ratio);
    setInterval(check, CHECK);
    invalidate();
    return { adapter: viewer.adapter() };
  },

  /** Opens the GPU again after it was lost, for another canvas, and draws everything anew. */
  async restore(canvas, width, height, ratio) {
    viewer.setGpu(await Gpu.open(canvas, width, height));
    viewer.resize(width, height, ratio);
    [broken, begun, current, isWarm] = [false, undefined, 1, false];
    invalidate();
    return { adapter: viewer.adapter() };
  },

  clear(fields, state) {
    const first = firstScene(state);
    methods.halt();
    viewer.clear(fields);
    wanted = first;
    forget();
  },

  /** Takes a chunk; the answer to the one that brings the base mesh waits until the first picture is out. */
  async feed(chunk) {
    const progress = viewer.feed(chunk);
    bytes = progress.bytes;
    if (!progress.ready) return { progress };
    meet();
    const first = !ready;
    ready = true;
    const due = performance.now() - lastRefine.end > Math.max(FOLLOW, 2 * lastRefine.took);
    if (first || due) follow();
    if (first) stepAll();
    if (!first) return { progress };
    await drawn();
    // Whoever opened it finds the camera that looks at it, also where the picture takes long.
    report("camera", viewer.camera());
    return { progress, ...met() };
  },

  /**
   * Opens a file in parts; resolves to nothing where the server gives no ranges, and otherwise when it has been drawn. What
   * is shown stays until the first bytes are here.
   */
  async openParts(url, { fields, memory, state, ...options }) {
    const first = firstScene(state);
    methods.halt();
    const make = (loader) => {
      viewer.openParts(fields, memory, loader);
      return {
        /** The first bytes make place for this volume. */
        supply() {
          const before = viewer.isOpening;
          try {
            return viewer.supply();
          } finally {
            if (before && !viewer.isOpening) {
              wanted = first;
              forget();
            }
            if (!viewer.isOpening) meet();
          }
        },
        get isWaiting() {
          return viewer.isWaiting;
        },
        progress: () => viewer.progress(),
        blocks: () => viewer.blocks(),
      };
    };
    const onError = (error) => ready && !viewer.isOpening && emit("error", flattenError(error));
    const mine = (parts = new Parts(RangeLoader, make, url, { ...options, ...takeAhead(url) }, partsCame, onError));
    const served = await mine.begin();
    if (mine !== parts) throw new TetralodError("replaced", "another volume was opened");
    if (!served) {
      parts = undefined;
      return undefined;
    }
    ready = true;
    invalidate();
    await drawn();
    report("camera", viewer.camera());
    return { progress: { ...mine.progress, traffic: mine.traffic }, ...met() };
  },

  /**
   * Resolves when the mesh is what was asked for, for the camera as it is, and all data that it needs has arrived. Arriving blocks may
   * show that others are needed; a mesh that is held to fewer tetrahedra while something moves is not the one.
   */
  async settled() {
    const mine = parts;
    await mine?.settled();
    while (ready && mine === parts && !broken && (following !== undefined || viewer.moving || held !== undefined)) {
      await drawn();
      await mine?.settled();
    }
  },

  /** Resolves when the picture shows what is set, with all its pixels, and the GPU has finished it. */
  async pictured() {
    while (!broken && (viewer.pending || resting !== undefined || viewer.inFlight > 0)) await drawn();
  },

  retry: () => parts?.retry(),

  halt() {
    parts?.close(new TetralodError("replaced", "the download was ended"));
    parts = undefined;
  },

  finish() {
    const progress = viewer.finish();
    follow();
    return progress;
  },

  /** Resolves at once, to the number of the request; its steps are reported as `stats` with this number. */
  async setRequest(options) {
    setRequest(await received(options));
    return goal;
  },

  /** Makes the first request, unless there is one. */
  follow() {
    if (ready && !isRequested) follow();
  },

  /** Gives a request up, if it is the last one: the one before it holds again. */
  abandon(given) {
    if (given === goal && ready) setRequest(before);
  },

  /**
   * Applies what has been set since the last call, in one go.
   *
   * Changes of the scene and the camera are made or refused one by one; what is wrong in one does not keep others back.
   *
   * @param {{ sets?: { id: number, changes: object, camera?: object }[], size?: [number, number, number], orbit?: [number, number], pan?: [number, number],
   *   zoom?: [number, number, number], fly?: [number, number, number], look?: [number, number],
   *   [setting: string]: any }} settings
   */
  update({ sets = [], orbit, zoom, pan, fly, look, home, side, size }) {
    if (size) viewer.resize(...size);
    if (home) viewer.home();
    if (side) viewer.lookFrom(side);
    const refused = sets.flatMap((one) => change(one) ?? []);
    if (orbit) viewer.orbit(...orbit);
    if (zoom) viewer.zoom(...zoom);
    if (pan) viewer.pan(...pan);
    if (fly) viewer.fly(...fly);
    if (look) viewer.look(...look);
    if (size) current = 1;
    else move();
    invalidate();
    return { scene: shown, refused: Object.fromEntries(refused) };
  },

  setFrameTime(milliseconds) {
    frameTime = milliseconds;
  },

  pickRegion: (x, y) => viewer.pickRegion(x, y),

  dragRegion(handle, x, y) {
    const region = Array.from(viewer.dragRegion(handle, x, y));
    shown = { ...shown, region };
    invalidate();
    return region;
  },

  keep() {
    viewer.keep();
    invalidate();
  },

  freeze(on) {
    viewer.freeze(on);
    invalidate();
  },

  /** What is shown at a point of the canvas. */
  pick: (x, y) => reading(viewer.pick(x, y)),

  /** What is at a point of the model. */
  reading: (x, y, z) => reading(viewer.reading(x, y, z)),

  /** A picture of any size; what is on the canvas of the page stays. */
  async screenshot(width, height, samples, background) {
    const canvas = new OffscreenCanvas(width, height);
    isTaking = true;
    try {
      if (background !== undefined) viewer.setScene({ ...shown, background });
      viewer.beginScreenshot(canvas);
      // How much memory transparent parts take is known after a picture.
      do {
        viewer.drawScreenshot(1);
        await idle();
      } while (viewer.isScreenshotShort());
      viewer.drawScreenshot(Math.min(samples, MOST_SAMPLES));
      // At once: the canvas is empty in the next task.
      return await canvas.convertToBlob({ type: "image/png" });
    } finally {
      viewer.endScreenshot();
      if (background !== undefined) viewer.setScene(shown);
      isTaking = false;
      invalidate();
    }
  },

  mesh(wanted) {
    const fields = fieldsOf(() => viewer.info(), wanted);
    return withFields(viewer.mesh(), fields, fields.map(({ index }) => viewer.values(index)));
  },

  /** Where the blocks of the file are, and which of them are here; nothing where it has none. */
  blockMap() {
    const numbers = viewer.blockMap();
    const count = numbers.length / 7;
    if (count === 0) return undefined;
    const bounds = numbers.filter((_, i) => i % 7 < 6);
    return { bounds, states: Uint8Array.from({ length: count }, (_, i) => numbers[7 * i + 6]) };
  },

  ...meshToolMethods(() => viewer),

  /** The same for the same request, whatever moved before: so of the mesh at rest. */
  async hash() {
    await methods.settled();
    return viewer.hash();
  },
};
const emit = serve(webEndpoint(globalThis), methods, ["openParts", "settled", "pictured", "hash"]);

/** The first bytes of a file that will be opened. @type {{ url: string, range: string, response: Promise<Response> } | undefined} */
let ahead;

/** Fetches them while the wasm module loads. */
function fetchAhead(url) {
  const range = `bytes=0-${HEAD - 1}`;
  const response = fetch(url, { headers: { range }, cache: "no-store" });
  // Whoever opens the file hears of an error.
  response.catch(() => {});
  ahead = { url, range, response };
}

/** A `fetch` whose first answer is already on its way, if it is for this file. */
function takeAhead(url) {
  let mine = ahead;
  ahead = undefined;
  if (mine?.url !== url) return {};
  return {
    fetch(address, init) {
      const isIt = mine && address === mine.url && init.headers.get("range") === mine.range;
      const response = isIt ? mine.response : fetch(address, init);
      mine = undefined;
      return response;
    },
  };
}

/** What a probe has found, made of the numbers of the viewer. */
function reading(numbers) {
  if (!numbers) return undefined;
  const [x, y, z, tet, size, error, shown, ...values] = numbers;
  const { fields } = /** @type {{ fields: any[] }} */ (volume);
  // Of the time steps of a field that which is shown counts, or the first.
  const all = values.map((value, i) => ({ ...fields[i], value })).reverse();
  const now = all.filter(({ time }) => time === fields[shown].time);
  const byName = Object.fromEntries([...all, ...now].map(({ name, value }) => [name, value]));
  return { position: [x, y, z], values: byName, tet, size, error };
}

/** Blocks have arrived: refines with them, as with a stream. */
function partsCame(progress) {
  bytes = progress.bytes;
  emit("progress", { ...progress, traffic: parts?.traffic });
  if (!ready || !isRequested) return;
  const wait = Math.max(FOLLOW, 2 * lastRefine.took) - (performance.now() - lastRefine.end);
  following ??= setTimeout(followParts, Math.max(wait, 0));
}

function followParts() {
  following = undefined;
  if (!parts || !ready || !isRequested) return;
  viewer.requestAgain();
  invalidate();
}

/**
 * Makes a change of the scene or the camera, or nothing and its number with what is wrong.
 *
 * @param {{ id: number, changes: object, camera?: any }} set
 * @returns {[number, object][] | undefined}
 */
function change({ id, changes, camera }) {
  try {
    const scene = changedScene(shown, changes);
    if (volume) checkFields(scene, volume);
    viewer.setScene(scene);
    try {
      if (camera) viewer.setCamera(camera);
    } catch (error) {
      viewer.setScene(shown);
      throw error;
    }
    shown = scene;
    return undefined;
  } catch (error) {
    return [[id, flattenError(error)]];
  }
}

/**
 * What is to be drawn of a volume that is opened with this state; throws where that is wrong for any volume.
 *
 * @param {Record<string, any>} [state]
 */
function firstScene({ camera, ...changes } = {}) {
  const scene = changedScene(shown, changes);
  viewer.setScene(scene);
  viewer.setScene(shown);
  return { scene, camera };
}

/** The base mesh has arrived: draws of it what fits. */
function meet() {
  const info = volume ? undefined : viewer.info();
  if (!info) return;
  volume = { ...info, bounds: Array.from(viewer.bounds()) };
  const { scene = shown, camera } = wanted ?? {};
  wanted = undefined;
  ({ scene: shown, dropped } = fitScene(scene, volume));
  viewer.setScene(shown);
  try {
    if (camera) viewer.setCamera(camera);
  } catch (error) {
    dropped.push({ part: "camera", problem: error.message });
  }
}

/** What is told of a volume that has been opened. */
const met = () => ({ info: volume, scene: shown, dropped });

/** Another volume has taken the place of the one before. */
function forget() {
  [request, before, volume, dropped] = [FIRST_REQUEST, FIRST_REQUEST, undefined, []];
  // What is reported next is of another volume, even if it is the same.
  reported.clear();
  isRequested = false;
  bytes = 0;
  ready = false;
  held = undefined;
  lastRefine = { end: -Infinity, took: 0 };
  invalidate();
}

/** Passes a request to the viewer; throws if it is not valid, and the one before it holds. */
function setRequest(next) {
  viewer.request(next);
  [before, request] = [request, next];
  parts?.turn();
  isRequested = true;
  goal++;
  total = { refined: 0, coarsened: 0, forced: 0, judged: 0, milliseconds: 0 };
  invalidate();
}

/** Applies the last request to new data; an error of the request is reported, not thrown. */
function follow() {
  try {
    if (!isRequested) setRequest(request);
    viewer.requestAgain();
    invalidate();
  } catch (error) {
    emit("error", flattenError(error));
  }
}

/** Refines for about so many milliseconds, and reports the result. */
function step(budget) {
  const start = performance.now();
  try {
    const stats = /** @type {any} */ (viewer.step(budget));
    const end = performance.now();
    // A view that follows the camera may need other blocks.
    parts?.follow();
    stats.milliseconds = end - start;
    for (const name of Object.keys(total)) total[name] += stats[name];
    tets = stats.tetrahedra;
    // A mesh that is held to fewer tetrahedra while something moves is not the one that was asked for.
    const done = stats.done && held === undefined;
    if (done) lastRefine = { end, took: total.milliseconds };
    const { blocks } = parts?.progress ?? {};
    emit("stats", { ...stats, ...total, done, bytes, goal, blocks, limitedBy: limitOf({ ...stats, done }, blocks, request) });
    if (done) Object.keys(total).forEach((name) => (total[name] = 0));
  } catch (error) {
    emit("failed", { goal, error: flattenError(error) });
  }
}

/** Steps until nothing is left to do: for the first picture. */
function stepAll() {
  while (viewer.moving) step(Infinity);
}

function invalidate() {
  if (broken) return;
  if (ready && viewer.moving) hidden ??= setTimeout(stepUnseen, HIDDEN);
  if (frameAsked) return;
  frameAsked = true;
  nextFrame(draw);
}

/** No frame was drawn: the page is hidden, or slow. */
function stepUnseen() {
  hidden = undefined;
  if (broken || !ready || !viewer.moving) return;
  step(LONG_STEP);
  hidden = setTimeout(stepUnseen, resting === undefined ? 0 : LONG_STEP);
}

/** Resolves when the GPU has finished all pictures. */
async function idle() {
  do await new Promise((resolve) => setTimeout(resolve, 16));
  while (viewer.inFlight > 0);
}

function draw() {
  frameAsked = false;
  // It is drawn when the screenshot is ready.
  if (isTaking) return;
  clearTimeout(hidden);
  hidden = undefined;
  if (ready && viewer.moving) step(resting === undefined ? LONG_STEP : Math.min(Math.max(drawing, STEP[0]), STEP[1]));
  try {
    observe();
    const start = performance.now();
    const drew = viewer.frame();
    const milliseconds = performance.now() - start;
    if (drew) {
      drawing = milliseconds;
      begun = start;
      const uploaded = viewer.takeUploaded();
      emit("frame", { milliseconds, triangles: viewer.triangles, uploaded, gpuBytes: viewer.gpuBytes, bytes, ready });
      report("camera", viewer.camera());
      report("legend", legend());
      report("overlay", overlay());
    }
    // The canvas may be hidden just now: then try again with the next refresh.
    else if (viewer.pending) invalidate();
    // At rest the picture gets better with every refresh.
    else if (canImprove() && viewer.improve() && took === 0) begun = start;
    if (begun !== undefined || canImprove()) invalidate();
  } catch (error) {
    failed(error);
  }
  if (ready && viewer.moving) invalidate();
}

/** A frame that fails would fail again: wait for a change, for a GPU in place of a lost one, or stop if the worker is lost. */
function failed(error) {
  const isLost = error?.code === "device-lost";
  broken = isLost || error?.code === undefined;
  emit(isLost ? "lost" : "error", flattenError(error));
}

/** Looks whether the GPU is lost while nothing is drawn: what the canvas shows is lost with it. */
function check() {
  if (broken) return;
  try {
    viewer.check();
  } catch (error) {
    failed(error);
  }
}

/** Numbers and labels of the viewer. @returns {[Float64Array, string[]]} */
const numbersAndLabels = (/** @type {any} */ answer) => answer;

/** What the colours mean, made of the numbers and labels of the viewer. */
function legend() {
  const [numbers, [label, ...labels]] = numbersAndLabels(viewer.legend());
  if (numbers.length === 0) return undefined;
  const [low, high, log, ...rest] = numbers;
  const parts = rest.splice(0, 3 * COLOURS).map((part) => part.toString(16).padStart(2, "0"));
  const colours = Array.from({ length: COLOURS }, (_, i) => `#${parts.slice(3 * i, 3 * i + 3).join("")}`);
  const ticks = labels.map((words, i) => ({ value: rest[2 * i + 1], label: words, fraction: rest[2 * i] }));
  return { label, range: [low, high], log: log > 0, colours, ticks };
}

/** What an overlay draws, made of the numbers and labels of the viewer. */
function overlay() {
  const [numbers, [barLabel, ...labels]] = numbersAndLabels(viewer.overlay());
  if (numbers.length === 0) return undefined;
  let at = 0;
  const take = (count) => Array.from(numbers.subarray(at, (at += count)));
  const [length, width, everywhere] = take(3);
  const rotation = [take(3), take(3), take(3)];
  const matrix = take(16);
  const axes = [];
  while (at < numbers.length) {
    const [axis, ends, outward, [count]] = [take(1)[0], [take(2), take(2)], take(2), take(1)];
    const ticks = labels.splice(0, count).map((label) => ({ label, at: take(2) }));
    axes.push({ axis, ends, outward, ticks });
  }
  return { axes, scaleBar: { label: barLabel, length, width, everywhere: everywhere > 0 }, rotation, matrix };
}

const canImprove = () => viewer.canImprove && !viewer.moving && took < SLOW && resting === undefined;

/** Looks whether the GPU has finished the last picture, and chooses the scale of the next ones by its time. */
function observe() {
  if (begun === undefined || viewer.inFlight > 0) return;
  took = isWarm ? performance.now() - begun : 0;
  [begun, isWarm] = [undefined, true];
  const wanted = current * Math.sqrt(frameTime / took);
  scale = SCALES.find((one) => one <= wanted) ?? SCALES.at(-1);
  if (resting === undefined) return;
  // Where the fewest pixels still take too long, fewer tetrahedra help.
  if (took > 1.5 * frameTime && current === SCALES.at(-1)) affordable = Math.max(FEWEST_TETS, (tets * frameTime) / took);
  else if (took < frameTime / 2 && held !== undefined) affordable = Math.min(1.5 * affordable, 2 ** 31);
}

/** Holds the mesh to what can be drawn while something moves, or lets it become what was asked for. */
function limit(on) {
  const most = on && (held !== undefined || tets > affordable) ? Math.round(affordable) : undefined;
  if (!ready || !isRequested || most === held) return;
  held = most;
  viewer.limit(most);
  parts?.follow();
}

/** The scale that is set. */
let current = 1;

function setScale(wanted) {
  if (wanted === current) return;
  current = wanted;
  viewer.setScale(wanted);
}

/** Something moves: draws as finely as there is time for, and finely a little later. */
function move() {
  setScale(scale);
  limit(true);
  clearTimeout(resting);
  resting = setTimeout(() => {
    resting = undefined;
    setScale(1);
    limit(false);
    invalidate();
  }, REST);
}

/** The last reports, as JSON. */
const reported = new Map();

/** Reports `data` if they differ from the last ones of this name. */
function report(name, data) {
  const text = JSON.stringify(data) ?? "";
  if (reported.get(name) === text) return;
  reported.set(name, text);
  emit(name, data);
}

/** Resolves after a frame has been handed to the screen; soon in any case, since hidden pages have no frames. */
async function drawn() {
  invalidate();
  const patience = new Promise((resolve) => setTimeout(resolve, 250));
  // The first of two refreshes draws, the second follows when the picture is shown.
  const twice = new Promise((resolve) => nextFrame(() => nextFrame(resolve)));
  await Promise.race([twice, patience]);
}
