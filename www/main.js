/**
 * The demo page: streams a volume, draws it, and makes requests of the settings. `?url=FILE` opens another volume. One file is one
 * purpose, and none imports in a circle:
 *
 * - `store`, `state`, `history`: what is set, in one store; its words; the address, undo and redo, which are made of it
 * - `page`, `volume`, `source`: what has come of the volume, what it has, where it comes from
 * - `opening`, `fitting`, `gallery`, `thumbnails`, `files`, `build`, `repair`: opening a volume, from the list or of the user; what of the settings fits it
 * - `beside`, `linked`: a second file beside it, and what that is shown with
 * - `parts`, `planes`, `fields`, `play`, `region`, `regions`, `request`: controls, and what is asked of the mesh
 * - `scene`, `colours`, `curve`, `transfer`, `histogram`, `bins`, `flow`, `compare`, `theme`: how it looks
 * - `camera`, `controls`, `picture`, `keys`, `tabs`: where it is looked from; mouse, touch and keys
 * - `overlay`, `handles`, `probes`, `path`, `overtime`, `plot`, `empty`, `messages`: what lies over the picture; the field at probes and between them
 * - `numbers`, `data`, `measures`, `blockmap`, `idle`: what has arrived, and what is measured; controls that do nothing now
 * - `export`, `writers`, `compose`: files that are saved
 * - `dom`, `format`, `lengths`, `geometry`: elements, numbers as words, their unit if they are lengths, vectors
 *
 * What shows or uses a part of the state subscribes to it; what changes it, a control or the viewer, changes the store alone. So
 * the address, undo, the controls and the picture cannot disagree. A control that is part of the state has an entry in `state`. Types are
 * checked strictly (`tests/js/tsconfig.page.json`).
 */

import { attachBeside } from "./beside.js";
import { attachBlockMap } from "./blockmap.js";
import { attachCamera, lookFrom } from "./camera.js";
import { attachColours } from "./colours.js";
import { attachComparison } from "./compare.js";
import { attachControls } from "./controls.js";
import { attachData, record } from "./data.js";
import { attachDeform } from "./deform.js";
import { $, announce, attachDialogs, svg } from "./dom.js";
import { attachEmpty } from "./empty.js";
import { attachExport } from "./export.js";
import { attachExtremes } from "./extremes.js";
import { attachFields } from "./fields.js";
import { attachFiles } from "./files.js";
import { addSeed, attachFlow } from "./flow.js";
import { attachGallery, begun, isMaking, openGallery, readVolumes, sceneOf, shown, showPoster } from "./gallery.js";
import { attachHandles } from "./handles.js";
import { attachHistogram } from "./histogram.js";
import { attachHistory, hold } from "./history.js";
import { attachIdle } from "./idle.js";
import { attachKeys } from "./keys.js";
import { attachMeasures } from "./measures.js";
import { attachMessages, fail, say } from "./messages.js";
import { attachMovie } from "./movie.js";
import { showFrame, showProgress, showStats } from "./numbers.js";
import { onOpened, open, retry, showInList } from "./opening.js";
import { OverlayView } from "./overlay.js";
import { demo, page } from "./page.js";
import { attachParts, mode } from "./parts.js";
import { attachPicture } from "./picture.js";
import { attachPlanes } from "./planes.js";
import { attachPlay } from "./play.js";
import { Probes } from "./probes.js";
import { attachRegion, boxWasDragged, useBox } from "./region.js";
import { attachRegions } from "./regionlist.js";
import { attachRequest } from "./request.js";
import { attachScene, draw, showLegend } from "./scene.js";
import { source } from "./source.js";
import { attachState, read, store } from "./state.js";
import { attachTabs } from "./tabs.js";
import { attachTheme } from "./theme.js";
import { attachThreshold } from "./threshold.js";
import { TransferEditor } from "./transfer.js";

/** @typedef {Promise<import("./gallery.js").Listed | undefined>} Listed the volume that is shown where no address says another one */
/** @typedef {import("./controls.js").Point} Point */
/** @typedef {import("./controls.js").Place} Place */

const canvas = $("canvas", HTMLCanvasElement);

async function start() {
  $("settings").addEventListener("submit", (event) => event.preventDefault());
  attachMessages(retry);
  attachDialogs();
  attachTabs();
  attachTheme();
  attachKeys();
  const listed = readVolumes();
  // A picture of it, until it is drawn: for good where it cannot be.
  listed.then((first) => ["starting", "unsupported"].includes(demo.state) && introduce(wantedUrl() ?? first?.url));
  // Texts and controls are painted first: to start the GPU takes a while.
  await painted();
  const viewer = await makeViewer(listed);
  if (!viewer) return;
  demo.viewer = viewer;
  showDevice(viewer);
  viewer.addEventListener("progress", ({ detail }) => showProgress(detail));
  viewer.addEventListener("stats", ({ detail }) => showStats(detail));
  viewer.addEventListener("frame", ({ detail }) => showFrame(detail));
  for (const name of ["progress", "stats", "frame"]) viewer.addEventListener(name, (event) => record(name, /** @type {CustomEvent} */ (event).detail));
  viewer.addEventListener("legend", ({ detail }) => showLegend(detail));
  viewer.addEventListener("error", ({ detail }) => fail(detail));
  attachOverlay(viewer);
  const actions = {
    onHome: () => viewer.home(),
    onBox: (/** @type {Promise<number[]>} */ box) => hold(box.then(boxWasDragged)),
    onClick: clicked,
    onLeave: () => page.probes.leave(),
  };
  attachControls(canvas, viewer, {
    ...actions,
    onHover: (point, place) => demo.info && page.probes.hover(point, place),
    onSpan: spanBox,
    isFlying: () => store.state.fly,
  });
  page.transfer = new TransferEditor();
  // Controls first, then what is made of their values: the request and the scene, then what is said of these.
  for (const attach of [
    attachState,
    attachParts,
    attachPlanes,
    attachFields,
    attachRegions,
    attachPlay,
    attachFlow,
    attachDeform,
    attachThreshold,
    attachComparison,
    attachHistogram,
  ])
    attach();
  attachColours(draw);
  for (const attach of [attachCamera, attachRegion, attachRequest, attachScene, attachHandles, attachEmpty, attachIdle, attachPicture, attachExtremes])
    attach();
  attachBeside(actions);
  attachFiles();
  attachHistory();
  attachGallery();
  onOpened(shown);
  attachBlockMap();
  attachData();
  attachMeasures();
  attachExport(canvas);
  attachMovie(canvas);
  await begin(listed);
}

/** Shows what will be opened, before there is anything to draw it with. @param {string | undefined} url */
function introduce(url) {
  if (!url) return;
  showPoster(url);
  showInList(url);
}

/** How long a paint is waited for (in ms). */
const PAINT = 1000;

/** Resolves when the page has been painted. */
function painted() {
  // Hidden pages are not painted.
  if (document.hidden) return undefined;
  const twice = new Promise((resolve) => requestAnimationFrame(() => requestAnimationFrame(resolve)));
  return Promise.race([twice, new Promise((resolve) => setTimeout(resolve, PAINT))]);
}

/** What the address of the page asks for. */
function wantedUrl() {
  return read(location.hash).url ?? new URLSearchParams(location.search).get("url") ?? undefined;
}

/** Opens what the address asks for, or the first volume of the list. @param {Listed} listed */
async function begin(listed) {
  const { url = "", ...words } = read(location.hash);
  const asked = new URLSearchParams(location.search).get("url");
  const first = asked ?? (await listed)?.url;
  begun((made) => begin(Promise.resolve(made)));
  if (!first && !url) return isMaking() ? undefined : openGallery();
  source.first = first ?? "";
  const isPlain = !asked && Object.keys(words).length === 0 && !url;
  open(url, isPlain ? sceneOf(first) : words);
}

/** The viewer; nothing where it cannot start, with a message. @param {Listed} listed */
async function makeViewer(listed) {
  try {
    // Imported here, so that a missing package is reported like other errors.
    const [{ Viewer }, prefetch] = await Promise.all([import("tetralod/viewer"), wantedUrl() ?? listed.then((first) => first?.url)]);
    const renderer = /** @type {"webgpu" | "webgl" | null} */ (new URLSearchParams(location.search).get("renderer")) ?? undefined;
    return await Viewer.create(canvas, { renderer, ...(!prefetch?.startsWith("file:") && { prefetch }) });
  } catch (/** @type {any} */ error) {
    demo.error = { code: error.code, message: error.message };
    const unsupported = error.code === "no-webgpu";
    demo.state = unsupported ? "unsupported" : "failed";
    $("side-panel").inert = true;
    for (const id of ["volume", "open-gallery", "reset", "share"]) $(id).toggleAttribute("disabled", true);
    $("loading").hidden = true;
    $("growth").textContent = "";
    say(unsupported ? "This page needs WebGPU or WebGL 2" : "The viewer could not start", error);
    return undefined;
  }
}

/** What draws. @param {import("tetralod/viewer").Viewer} viewer */
function showDevice({ adapter, isSoftware, renderer }) {
  const without = renderer === "webgl" && "This browser has no WebGPU: drawn with WebGL 2, without volumes and without shade in hollows.";
  const words = isSoftware && "Drawn in software, since this browser uses no GPU: allow hardware acceleration in its settings, or update the graphics driver.";
  $("gpu").textContent = [without, words, adapter && `GPU: ${adapter}`].filter(Boolean).join(" ");
}

/** What lies over the picture: axes, probes, the plot. @param {import("tetralod/viewer").Viewer} viewer */
function attachOverlay(viewer) {
  const covered = [$("legend")];
  page.overlay = new OverlayView(svg("overlay"), { covered, onSide: lookFrom });
  page.overlayBeside = new OverlayView(svg("overlay-beside"), { covered: [$("growth-beside")], onSide: lookFrom });
  page.probes = new Probes();
  viewer.addEventListener("overlay", ({ detail }) => (page.overlay.data = detail));
  for (const overlay of [page.overlay, page.overlayBeside]) {
    store.subscribe(["axes"], () => (overlay.showsAxes = store.state.axes));
    store.subscribe(["unit"], () => (overlay.unit = store.state.unit));
  }
  $("unpin").addEventListener("click", () => page.probes.clear());
  $("box-of-pins").addEventListener("click", () => useBox(page.probes.boxOf(...page.probes.pins.map(({ position }) => position))));
}

/**
 * A click on a picture, or its key: a seed of a streamline on the plane in the view of the flow, a probe in all others.
 *
 * @param {Point} point
 * @param {import("tetralod/viewer").Viewer} [from] whose picture it is
 */
async function clicked(point, from) {
  if (!demo.info) return;
  try {
    announce(mode() === "flow" ? seed(point) : ((await page.probes.pin(point, from)) ?? "Nothing is shown there"), 0);
  } catch (error) {
    fail(error);
  }
}

const seed = (/** @type {Point} */ point) => (addSeed(point) ? "One more seed on the plane" : "The plane of the seeds is not there");

/** Where the rectangle that is being spanned ends. */
let spanEnd = { x: 0, y: 0 };

/** A rectangle is being spanned on the picture, or has been: makes a box of what is seen at its ends. @type {import("./controls.js").Actions["onSpan"]} */
async function spanBox(from, to, points) {
  const { probes } = page;
  if (to) spanEnd = to;
  probes.marquee(from, to);
  if (!points) return;
  const spanned = await probes.boxBetween(...points);
  if (spanned) useBox(spanned);
  else probes.note("Both ends of the rectangle must be on what is drawn", spanEnd);
}

start();
