/** The demo page: streams a volume, draws it, and makes requests of the settings. `?url=FILE` opens another volume. */

import { ColourSettings } from "./colours.js";
import { Comparison } from "./compare.js";
import { attachControls } from "./controls.js";
import { $, announce, attachDialogs } from "./dom.js";
import { attachData, record } from "./data.js";
import { attachEmpty } from "./empty.js";
import { attachExport } from "./export.js";
import { attachFields, percentilesAtAllTimes } from "./fields.js";
import { attachFiles } from "./files.js";
import { FlowSettings } from "./flow.js";
import { attachGallery, openGallery, readVolumes, sceneOf, shown, showPoster } from "./gallery.js";
import { attachHistogram } from "./histogram.js";
import { attachKeys } from "./keys.js";
import { attachMessages, fail, say } from "./messages.js";
import { showFrame, showProgress, showStats } from "./numbers.js";
import { isNew, isRemote, onOpened, open, retry, setFirst, showInList } from "./opening.js";
import { OverlayView } from "./overlay.js";
import { demo, page } from "./page.js";
import { mode } from "./parts.js";
import { attachPicture, lookFrom } from "./picture.js";
import { Probes } from "./probes.js";
import { attachRegion, boxWasDragged, useBox } from "./region.js";
import { attachRequest } from "./request.js";
import { seedPlane } from "./planes.js";
import { attachScene, draw, fractionOf, isovalue, setIsovalue, showLegend } from "./scene.js";
import { attachShare } from "./share.js";
import { attachState, hold, read } from "./state.js";
import { attachTabs } from "./tabs.js";
import { attachTheme } from "./theme.js";
import { TransferEditor } from "./transfer.js";

const canvas = $("canvas");

async function start() {
  $("settings").addEventListener("submit", (event) => event.preventDefault());
  attachMessages({ onRetry: retry, isRemote, isNew });
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
  page.viewer = demo.viewer = viewer;
  $("gpu").textContent = viewer.adapter && `GPU: ${viewer.adapter}`;
  viewer.addEventListener("progress", ({ detail }) => showProgress(detail));
  viewer.addEventListener("stats", ({ detail }) => showStats(detail));
  viewer.addEventListener("frame", ({ detail }) => showFrame(detail));
  for (const name of ["progress", "stats", "frame"]) viewer.addEventListener(name, (event) => record(name, /** @type {CustomEvent} */ (event).detail));
  viewer.addEventListener("legend", ({ detail }) => showLegend(detail));
  viewer.addEventListener("error", ({ detail }) => fail(detail));
  attachOverlay(viewer);
  attachControls(canvas, viewer, {
    onHome: () => viewer.home(),
    onBox: (box) => hold(box.then(boxWasDragged)),
    onClick: clicked,
    onHover: (point, place) => demo.info && page.probes.hover(point, place),
    onLeave: () => page.probes.leave(),
    onSpan: spanBox,
    isFlying: () => $("fly").checked,
  });
  attachColours(viewer);
  page.flow = new FlowSettings({ overlay: page.overlay, onChange: draw });
  page.comparison = new Comparison(viewer, { onChange: draw, onError: fail });
  attachScene();
  attachEmpty();
  attachFields();
  attachRequest();
  attachRegion();
  attachPicture(viewer, { overlay: page.overlay, onError: fail });
  attachFiles();
  attachState(viewer);
  attachShare();
  attachGallery();
  onOpened(shown);
  attachHistogram();
  attachData();
  attachExport(canvas);
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

/** Opens what the address asks for, or the first volume of the list. */
async function begin(listed) {
  const { url = "", ...words } = read(location.hash);
  const asked = new URLSearchParams(location.search).get("url");
  const first = asked ?? (await listed)?.url;
  if (!first && !url) {
    $("growth").textContent = "";
    return openGallery();
  }
  setFirst(first ?? "");
  const isPlain = !asked && Object.keys(words).length === 0 && !url;
  open(url, isPlain ? sceneOf(first) : words);
}

/** The viewer; nothing where it cannot start, with a message. */
async function makeViewer(listed) {
  try {
    // Imported here, so that a missing package is reported like other errors.
    const [{ Viewer }, prefetch] = await Promise.all([import("tetralod/viewer"), wantedUrl() ?? listed.then((first) => first?.url)]);
    return await Viewer.create(canvas, prefetch?.startsWith("file:") ? {} : { prefetch });
  } catch (error) {
    demo.error = { code: error.code, message: error.message };
    const unsupported = error.code === "no-webgpu";
    demo.state = unsupported ? "unsupported" : "failed";
    $("side-panel").inert = true;
    for (const id of ["volume", "open-gallery", "reset", "share"]) $(id).disabled = true;
    $("loading").hidden = true;
    $("growth").textContent = "";
    say(unsupported ? "This page needs WebGPU" : "The viewer could not start", error);
    return undefined;
  }
}

/** What lies over the picture: axes, probes, the plot. */
function attachOverlay(viewer) {
  const covered = ["legend", "growth"].map($);
  const overlay = new OverlayView($("overlay"), { covered, onSide: (side) => lookFrom(viewer, side).catch(fail) });
  viewer.addEventListener("overlay", ({ detail }) => (overlay.data = detail));
  const parts = { readout: $("readout"), cards: $("cards"), marquee: $("marquee") };
  const plot = { plot: $("plot"), plotTitle: $("plot-title"), plotArea: $("plot-area") };
  const stage = { ...parts, ...plot };
  const svg = $("overlay");
  const probes = new Probes({ viewer, overlay, svg, stage, fields: () => demo.info?.fields, shown: () => page.field });
  Object.assign(page, { overlay, probes });
  $("unpin").addEventListener("click", () => probes.clear());
  $("box-of-pins").addEventListener("click", () => {
    const [one, other] = probes.pins;
    if (other) useBox(probes.boxOf(one.position, other.position));
  });
}

/** The colours of values, and the transfer function. */
function attachColours(viewer) {
  const parts = { map: $("map"), reversed: $("reversed"), log: $("log"), preset: $("range-preset") };
  const range = { low: $("range-low"), high: $("range-high"), note: $("range-note") };
  const percentiles = async (fractions) =>
    percentilesAtAllTimes(fractions) ?? Array.from((await viewer.stats({ bins: 1000, fractions })).percentiles);
  page.colours = new ColourSettings({ ...parts, ...range }, { percentiles, onChange: draw });
  const ends = { low: $("transfer-low"), high: $("transfer-high"), chosen: $("transfer-chosen"), bar: $("transfer-bar") };
  const buttons = { preset: $("transfer-preset"), add: $("transfer-add"), remove: $("transfer-remove") };
  page.transfer = new TransferEditor(
    { svg: $("transfer"), ...ends, ...buttons },
    { isovalue: () => (page.field ? fractionOf(isovalue()) : 0.5), onIsovalue: setIsovalue, onChange: draw },
  );
}

/** A click on the picture, or its key: a seed of a streamline on the plane in the view of the flow, a probe in all others. */
async function clicked(point) {
  if (!demo.info) return;
  try {
    announce(await (mode() === "flow" ? addSeed(point) : addProbe(point)), 0);
  } catch (error) {
    fail(error);
  }
}

const addSeed = (point) => (page.flow.click(point, seedPlane()) ? "One more seed on the plane" : "The plane of the seeds is not there");

const addProbe = async (point) => ((await page.probes.pin(point)) ? page.probes.spoken : "Nothing is shown there");

/** Where the rectangle that is being spanned ends. */
let spanEnd = { x: 0, y: 0 };

/** A rectangle is being spanned on the picture, or has been: makes a box of what is seen at its ends. */
async function spanBox(from, to, points) {
  const { probes } = page;
  if (from) spanEnd = to;
  probes.marquee(from, to);
  if (!points) return;
  const spanned = await probes.boxBetween(...points);
  if (spanned) useBox(spanned);
  else probes.note("Both ends of the rectangle must be on what is drawn", spanEnd);
}

start();
