/**
 * The demo page: streams a dataset, draws it, and makes requests of the settings.
 *
 * `?url=FILE` opens another dataset. Tests read the state of the page from `window.tetralodDemo`:
 * `state` is "starting", "opening", "streaming", "complete", "failed" or "unsupported".
 */

import { takeMesh } from "./build.js";
import { ColourSettings } from "./colours.js";
import { Comparison } from "./compare.js";
import { attachControls } from "./controls.js";
import { FlowSettings } from "./flow.js";
import { count, milliseconds, nameOf, percentage, pixels, rounded, size } from "./format.js";
import { OverlayView } from "./overlay.js";
import { attachPicture, lookFrom } from "./picture.js";
import { Probes } from "./probes.js";
import { TransferEditor } from "./transfer.js";

/** @type {(id: string) => any} Each caller knows the type of its element. */
const $ = (id) => document.getElementById(id);
/** @type {(selector: string) => Iterable<any>} */
const all = (selector) => document.querySelectorAll(selector);
const canvas = $("canvas");

const demo = (window.tetralodDemo = {
  state: "starting",
  viewer: undefined,
  info: undefined,
  /** Statistics of the last complete mesh (all its data has arrived), and of the last step of refinement. */
  stats: undefined,
  step: undefined,
  /** The last request. */
  request: undefined,
  frame: undefined,
  frames: 0,
  error: undefined,
  /** At the first picture that shows the dataset: bytes decoded and milliseconds since the page was opened. */
  firstFrameBytes: undefined,
  firstFrameMs: undefined,
  receivedBytes: 0,
  totalBytes: undefined,
  /** Of a file that is fetched in blocks: numbers of its blocks. */
  blocks: undefined,
});

/** @type {import("tetralod/viewer").Viewer} */
let viewer;
/** @type {OverlayView} */
let overlay;
/** @type {Probes} */
let probes;
/** @type {ColourSettings} */
let colours;
/** @type {TransferEditor} */
let transfer;
/** @type {FlowSettings} */
let flow;
/** Whether time steps follow each other by themselves. */
let playing = false;
/** What was opened last: the button "Try again" opens it again. */
let source;
/** @type {Comparison} */
let comparison;
let opening = 0;
/** Corners of the box, [x0, y0, z0, x1, y1, z1]. */
let box;
/** @type {import("tetralod").FieldInfo} */
let field;
/** Fields by name: the numbers of their time steps, or one. @type {Map<string, number[]>} */
let fields = new Map();

start();

async function start() {
  try {
    // Imported here, so that a missing package is reported like other errors.
    const { Viewer } = await import("tetralod/viewer");
    viewer = demo.viewer = await Viewer.create(canvas);
  } catch (error) {
    demo.error = { code: error.code, message: error.message };
    const unsupported = error.code === "no-webgpu";
    demo.state = unsupported ? "unsupported" : "failed";
    $("panel").inert = true;
    $("loading").hidden = true;
    say(unsupported ? "This page needs WebGPU" : "The viewer could not start", error);
    return;
  }
  $("gpu").textContent = viewer.adapter && `GPU: ${viewer.adapter}`;
  viewer.addEventListener("progress", ({ detail }) => showProgress(detail));
  viewer.addEventListener("stats", ({ detail }) => showStats(detail));
  viewer.addEventListener("frame", ({ detail }) => showFrame(detail));
  viewer.addEventListener("legend", ({ detail }) => showLegend(detail));
  viewer.addEventListener("error", ({ detail }) => fail(detail));
  attachOverlay();
  attachControls(canvas, viewer, {
    onHome: home,
    onBox: boxWasDragged,
    onClick: clicked,
    onHover: (point, place) => demo.info && probes.hover(point, place),
    onLeave: () => probes.leave(),
    onSpan: spanBox,
    isFlying: () => $("fly").checked,
  });
  attachColours();
  flow = new FlowSettings({ overlay, onChange: draw });
  attachSettings();
  comparison = new Comparison(viewer, { onChange: draw, onError: fail });
  attachPicture(viewer, { canvas, overlay, onChange: draw, onError: fail });
  attachFiles();
  open(new URLSearchParams(location.search).get("url") ?? $("volume").value);
}

/** What lies over the picture: axes, probes, the plot. */
function attachOverlay() {
  const covered = ["legend"].map($);
  overlay = new OverlayView($("overlay"), { covered, onSide: (side) => lookFrom(viewer, side).catch(fail) });
  viewer.addEventListener("overlay", ({ detail }) => (overlay.data = detail));
  const parts = { readout: $("readout"), cards: $("cards"), marquee: $("marquee") };
  const plot = { plot: $("plot"), plotTitle: $("plot-title"), plotArea: $("plot-area") };
  const stage = { ...parts, ...plot };
  const svg = $("overlay");
  probes = new Probes({ viewer, overlay, svg, stage, fields: () => demo.info.fields, shown: () => field });
  $("unpin").addEventListener("click", () => probes.clear());
  $("box-of-pins").addEventListener("click", () => {
    const [one, other] = probes.pins;
    if (other) useBox(probes.boxOf(one.position, other.position));
  });
}

/** The colours of values, and the transfer function. */
function attachColours() {
  const parts = { map: $("map"), reversed: $("reversed"), log: $("log"), preset: $("range-preset") };
  const range = { low: $("range-low"), high: $("range-high"), note: $("range-note") };
  const percentiles = async (fractions) => Array.from((await viewer.stats({ bins: 1000, fractions })).percentiles);
  colours = new ColourSettings({ ...parts, ...range }, { percentiles, onChange: draw });
  const ends = { low: $("transfer-low"), high: $("transfer-high"), chosen: $("transfer-chosen"), bar: $("transfer-bar") };
  const buttons = { preset: $("transfer-preset"), add: $("transfer-add"), remove: $("transfer-remove") };
  transfer = new TransferEditor(
    { svg: $("transfer"), ...ends, ...buttons },
    { isovalue: () => $("isovalue").value / 1000, onChange: draw },
  );
}

/** Shows the histogram of the field where the transfer function is edited. */
async function showHistogram() {
  if (mode() !== "volume" || !demo.info) return;
  transfer.volumes = (await viewer.stats({ bins: 100 })).histogram;
}

/** A click on the picture: a seed of a streamline on the plane in the view of the flow, a probe in all others. */
async function clicked(point) {
  if (!demo.info) return;
  if (mode() === "flow") flow.click(point, seedPlane());
  else probes.pin(point).catch(fail);
}

/** The plane of the seeds. */
const seedPlane = () => ({ axis: Number($("axis").value), at: placeOfPlane() });

/** Where the rectangle that is being spanned ends. */
let spanEnd = { x: 0, y: 0 };

/** A rectangle is being spanned on the picture, or has been: makes a box of what is seen at its ends. */
async function spanBox(from, to, points) {
  if (from) spanEnd = to;
  probes.marquee(from, to);
  if (!points) return;
  const spanned = await probes.boxBetween(...points);
  if (spanned) useBox(spanned);
  else probes.note("Both ends of the rectangle must be on what is drawn", spanEnd);
}

/** Refines in this box. */
function useBox(wanted) {
  box = wanted;
  $("region").value = "box";
  showBox();
  applyRoi();
  refine();
}

/* Opening and streaming */

async function open(from) {
  source = from;
  showInList(from);
  const mine = ++opening;
  Object.assign(demo, { state: "opening", error: undefined, info: undefined, stats: undefined });
  Object.assign(demo, { firstFrameBytes: undefined, firstFrameMs: undefined, receivedBytes: 0, totalBytes: undefined });
  demo.blocks = undefined;
  comparison.forget();
  $("message").hidden = true;
  $("legend").hidden = true;
  $("loading").classList.remove("done");
  $("progress").removeAttribute("value");
  $("progress-text").textContent = `Opening ${nameOf(from)}…`;
  try {
    const opened = await viewer.open(from);
    if (mine !== opening) return;
    demo.totalBytes = opened.total;
    if (demo.state === "opening") demo.state = "streaming";
    arrive(opened.info);
    await opened.finished;
    if (mine !== opening) return;
    demo.state = "complete";
    demo.totalBytes ??= demo.receivedBytes;
    $("loading").classList.add("done");
  } catch (error) {
    if (mine === opening && error?.name !== "AbortError") fail(error);
  }
}

/** Continues the download if the file comes in blocks and has not been replaced; otherwise opens it again. */
async function retry() {
  if (!demo.info || !demo.blocks || demo.error?.code === "changed") return open(source);
  $("message").hidden = true;
  demo.error = undefined;
  demo.state = "streaming";
  const mine = opening;
  try {
    await viewer.retry();
    await viewer.settled();
    if (mine === opening && demo.state === "streaming") demo.state = "complete";
  } catch (error) {
    if (mine === opening && demo.state === "streaming") fail(error);
  }
}

/** The kinds of MT, with their updates. */
const KINDS = {
  "half-edge": "half-edge (vertex insertions)",
  edge: "edge (vertex splits)",
  vertex: "vertex (vertex insertions)",
  explicit: "explicit (any updates)",
};

/** The base mesh has arrived: sets up the settings for it. */
function arrive(info) {
  demo.info = info;
  probes.clear();
  flow.fields = info.fields;
  stop();
  $("n-kind").textContent = KINDS[info.kind] ?? info.kind;
  fields = new Map();
  info.fields.forEach(({ name }, number) => fields.set(name, [...(fields.get(name) ?? []), number]));
  for (const steps of fields.values()) steps.sort((a, b) => info.fields[a].time - info.fields[b].time);
  $("field").replaceChildren(...[...fields.keys()].map((name) => new Option(name, name)));
  $("field-row").hidden = fields.size < 2;
  $("time").value = 0;
  box = inner(info.bounds);
  chooseField();
  showBox();
  applyMode();
  applyCut();
  applyRoi();
  refine();
}

/** Reads the field and the time step from the settings. */
function chooseField() {
  const steps = fields.get($("field").value);
  $("time").max = steps.length - 1;
  $("time-row").hidden = steps.length < 2;
  field = demo.info.fields[steps[$("time").value]];
  transfer.field = field;
  colours.setField(field).catch(fail);
  if (field.time !== undefined) text("time-text", String(Number(field.time.toPrecision(6))), "time");
  applyIsovalue();
}

/** The middle half of a box. */
function inner(bounds) {
  return bounds.map((value, i) => value + (bounds[(i + 3) % 6] - value) / 4);
}

function fail(error) {
  demo.error = { code: error.code, message: error.message };
  // What has arrived stays usable: only a failure before the first picture hides it.
  demo.state = "failed";
  $("loading").classList.add("done");
  $("retry").hidden = error.code === "device-lost" || error.code === "internal";
  const titles = {
    network: "The file could not be downloaded",
    cors: "The server does not allow this page to read the file",
    server: "The server does not send the bytes of the file",
    changed: "The file was replaced on the server",
    "device-lost": "The GPU was reset. Reload the page",
    truncated: "The file is incomplete",
    "too-large": "The mesh is too large for this GPU",
  };
  say(titles[error.code] ?? "The file could not be opened", error);
}

function say(title, error) {
  $("message-title").textContent = title;
  const words = error.message ?? String(error);
  // A message that starts with a file's name keeps it as it is.
  const start = words.includes(": ") ? words.charAt(0) : words.charAt(0).toUpperCase();
  $("message-text").textContent = `${start}${words.slice(1)}`;
  const seen = demo.firstFrameBytes !== undefined;
  $("message").classList.toggle("beside", seen);
  $("dismiss").hidden = !seen;
  $("message").hidden = false;
}

/* Settings */

const checked = (name) => /** @type {HTMLInputElement} */ (document.querySelector(`[name=${name}]:checked`)).value;
const mode = () => /** @type {"iso" | "volume" | "slice" | "solid" | "mesh" | "flow"} */ (checked("mode"));
const refineBy = () => checked("refine-by");

/** Positions of the slider of the field error: by screen error, it applies outside the view and may be coarser. */
const errorPositions = { field: 50, view: 78 };

/** 0 at the left end, then from 0.01 % to 100 % in equal ratios. */
function errorPercent() {
  const place = Number($("error").value);
  return place === 0 ? 0 : 10 ** (-2 + (4 * place) / 100);
}

/** From a quarter of a pixel to 64 pixels in equal ratios. */
function errorPixels() {
  return Number((0.25 * 256 ** ($("pixels").value / 100)).toPrecision(2));
}

/** The number of tetrahedra, or undefined at the right end. */
function budget() {
  const place = Number($("budget").value);
  if (place === 100) return undefined;
  const most = Math.max(demo.info?.tetrahedra ?? 1e6, 2000);
  return Number((1000 * (most / 1000) ** (place / 100)).toPrecision(2));
}

function isovalue() {
  return field.min + ((field.max - field.min) * $("isovalue").value) / 1000;
}

function refine() {
  if (!demo.info) return;
  const percent = errorPercent();
  text("error-text", percent === 0 ? "0 (full resolution)" : percentage(percent), "error");
  text("budget-text", budget() === undefined ? "no limit" : `${count(budget())}`, "budget");
  text("pixels-text", pixels(errorPixels()), "pixels");
  /** @type {import("tetralod/viewer").ViewerRefineOptions} */
  const options = { error: `${percent}%`, field: demo.info.fields.indexOf(field), maxTets: budget(), ...region() };
  if ($("focus").checked) options.isovalues = [isovalue()];
  if (refineBy() === "view") options.needs = [{ view: { pixels: errorPixels() } }];
  // The step that comes next is refined with the one that is shown, so that it is there when it is shown.
  if (playing) options.needs = [...(options.needs ?? []), { error: `${percent}%`, field: followingStep() }];
  demo.request = options;
  return viewer.refine(options).catch((error) => {
    if (error.code !== "freed" && error.code !== "not-ready") fail(error);
  });
}

/** The number of the field at the time step after the one that is shown. */
function followingStep() {
  const steps = fields.get(field.name);
  return steps[(steps.indexOf(demo.info.fields.indexOf(field)) + 1) % steps.length];
}

function applyIsovalue() {
  const value = isovalue();
  text("isovalue-text", `${rounded(value, field.max - field.min)} ${field.unit}`.trim(), "isovalue");
  draw();
  if ($("focus").checked) refine();
}

function applyMode() {
  for (const row of all("[data-mode]")) row.hidden = !row.dataset.mode.split(" ").includes(mode());
  // Slices and seeds have no side.
  $("flip").parentElement.hidden = isPlane();
  $("cut-label").textContent = isPlane() ? "Plane" : "Clip plane";
  overlay.quad = undefined;
  showHistogram().catch(fail);
  // Draws, too.
  applyCut();
}

/** Draws what the settings say. */
function draw() {
  if (!demo.info) return;
  const opacity = $("opacity").value / 100;
  text("opacity-text", `${$("opacity").value} %`, "opacity");
  // The range is one of the field.
  const others = { mesh: $("colour-by").value !== "field", flow: !flow.isByField };
  $("range").hidden = others[mode()] ?? false;
  const nothing = { isosurfaces: [], volume: null, slices: [], boundary: null, cells: null, clips: [] };
  const noFlow = { streamlines: null, arrows: null };
  const shown = {
    iso: () => ({ isosurfaces: [{ value: isovalue(), opacity }] }),
    volume: () => ({ volume: { opacities: transfer.opacities(field, opacity) } }),
    slice: () => ({ slices: [{ ...plane(), opacity, edges: true }] }),
    solid: () => ({ boundary: { opacity, edges: true }, clips: [plane()] }),
    mesh: () => ({ cells: { cut: plane(), colourBy: $("colour-by").value } }),
    flow: () => flow.state({ bounds: demo.info.bounds, plane: seedPlane(), field }),
  }[mode()]();
  const compare = comparison.state;
  // A difference has values on both sides of 0.
  const diverging = compare?.difference ? { map: "coolwarm" } : {};
  const looks = { colours: { ...colours.state, ...diverging }, background: $("background").value, compare };
  viewer.set({ ...nothing, ...noFlow, ...shown, ...looks }).catch(fail);
}

/** The colour bar of what is drawn. */
function showLegend(legend) {
  $("legend").hidden = !legend;
  if (!legend) return overlay.refresh();
  const { label, ticks } = legend;
  const unit = unitOf(label);
  $("legend-name").textContent = unit ? `${label} in ${unit}` : label;
  if (label === field?.name) transfer.colours = colours.gradient(legend);
  $("legend-bar").style.background = `linear-gradient(90deg, ${legend.colours.join(", ")})`;
  $("legend-ticks").replaceChildren(
    ...ticks.map(({ label: value, fraction }) => {
      const tick = document.createElement("span");
      tick.textContent = value;
      tick.style.left = `${100 * fraction}%`;
      return tick;
    }),
  );
  leaveOutOverlaps($("legend-ticks"));
  overlay.refresh();
}

/** The unit of what a legend is of: a field, or the length of the vector that is shown. */
function unitOf(label) {
  if (field?.name === label) return field.unit;
  return mode() === "flow" ? flow.unit : "";
}

/** Hides the ticks whose words would touch those of the one before. */
function leaveOutOverlaps(ticks) {
  let end = Number.NEGATIVE_INFINITY;
  for (const tick of ticks.children) {
    const { left, right } = tick.getBoundingClientRect();
    tick.hidden = left < end + 4;
    if (!tick.hidden) end = right;
  }
}

/** Whether the plane is one to look at, and cuts nothing away. */
const isPlane = () => mode() === "slice" || mode() === "flow";

/** The coordinate of the plane along its axis. */
function placeOfPlane() {
  const axis = Number($("axis").value);
  const [low, high] = [demo.info.bounds[axis], demo.info.bounds[axis + 3]];
  return low + ((high - low) * $("cut").value) / 1000;
}

/** The clip plane. @returns {{ normal: [number, number, number], offset: number }} */
function plane() {
  const axis = Number($("axis").value);
  const sign = $("flip").checked ? -1 : 1;
  const along = (other) => (other === axis ? sign : 0);
  return { normal: [along(0), along(1), along(2)], offset: sign * placeOfPlane() };
}

function applyCut() {
  if (!demo.info) return;
  const axis = Number($("axis").value);
  const [low, high] = [demo.info.bounds[axis], demo.info.bounds[axis + 3]];
  const { normal, offset } = plane();
  const at = normal[axis] * offset;
  const where = Math.abs(at) < (high - low) * 1e-4 ? 0 : Number(at.toPrecision(3));
  const side = $("flip").checked ? "<" : ">";
  const shown = isPlane() ? `${"xyz"[axis]} = ${where}` : `Hide ${"xyz"[axis]} ${side} ${where}`;
  text("cut-text", shown, "cut");
  draw();
  if ($("region").value === "cut") refine();
}

/** The region of the request. */
function region() {
  const center = [0, 1, 2].map((i) => (box[i] + box[i + 3]) / 2);
  const radius = Math.min(...[0, 1, 2].map((i) => box[i + 3] - box[i])) / 2;
  switch ($("region").value) {
    case "box":
      return { box };
    case "sphere":
      return { sphere: { center, radius } };
    case "cut":
      return { slab: plane() };
    default:
      return {};
  }
}

function applyRoi() {
  const on = ["box", "sphere"].includes($("region").value);
  $("box").hidden = !on;
  viewer.set({ region: on ? box : null }).catch(fail);
}

function applyRefineBy() {
  const view = refineBy() === "view";
  for (const row of all("[data-refine-by]")) row.hidden = !view;
  $("error-label").textContent = view ? "Maximum field error outside the view" : "Maximum field error";
  $("error").value = errorPositions[refineBy()];
  refine();
}

function showBox() {
  for (const input of $("box").querySelectorAll("input")) {
    if (document.activeElement !== input) input.value = Number(box[input.dataset.i].toPrecision(5));
  }
}

function boxWasDragged(moved) {
  box = moved;
  showBox();
  refine();
}

/** Takes the number that was typed if the box stays valid. */
function boxWasTyped(input) {
  const typed = box.slice();
  typed[input.dataset.i] = input.valueAsNumber;
  const valid = [0, 1, 2].every((i) => typed[i] <= typed[i + 3]);
  input.setCustomValidity(valid ? "" : "“min” must not be larger than “max”");
  input.reportValidity();
  if (!valid) return;
  box = typed;
  applyRoi();
  refine();
}

function home() {
  viewer.home();
}

/** Shows the time steps one after the other, each when the mesh of the one before is complete. */
function play() {
  playing = true;
  showPlaying();
  nextStep();
}

function stop() {
  playing = false;
  showPlaying();
}

function showPlaying() {
  $("play").textContent = playing ? "Pause" : "Play";
  $("play").setAttribute("aria-pressed", String(playing));
}

/** How long a time step is shown at least (in ms). */
const STEP_TIME = 150;

async function nextStep() {
  const shownFor = new Promise((resolve) => setTimeout(resolve, STEP_TIME));
  $("time").value = (Number($("time").value) + 1) % (Number($("time").max) + 1);
  chooseField();
  await Promise.all([refine(), shownFor]);
  if (playing) nextStep();
}

function attachSettings() {
  const on = (id, then, name = "input") => $(id).addEventListener(name, then);
  $("panel").addEventListener("submit", (event) => event.preventDefault());
  for (const radio of document.querySelectorAll("[name=mode]")) radio.addEventListener("change", applyMode);
  on("isovalue", () => field && applyIsovalue());
  on("cut", applyCut);
  for (const id of ["opacity", "colour-by"]) on(id, draw);
  document.addEventListener("keydown", (event) => event.key === "Escape" && probes.clear());
  on("play", () => (playing ? stop() : play()), "click");
  on("axis", applyCut);
  on("flip", applyCut);
  for (const radio of document.querySelectorAll("[name=refine-by]")) radio.addEventListener("change", applyRefineBy);
  on("error", () => {
    errorPositions[refineBy()] = $("error").value;
    refine();
  });
  on("pixels", refine);
  on("budget", refine);
  on("focus", refine);
  for (const id of ["field", "time"]) {
    on(id, () => {
      chooseField();
      refine();
    });
  }
  on("region", () => {
    if (!box) return;
    applyRoi();
    refine();
  });
  for (const input of $("box").querySelectorAll("input")) {
    input.addEventListener("input", () => boxWasTyped(input));
    input.addEventListener("blur", showBox);
  }
  on("home", home, "click");
  on("dismiss", () => ($("message").hidden = true), "click");
  on("retry", retry, "click");
}

function attachFiles() {
  $("volume").addEventListener("change", () => open($("volume").value));
  $("choose").addEventListener("click", () => $("file").click());
  $("file").addEventListener("change", () => {
    const files = [...$("file").files];
    $("file").value = "";
    if (files.length > 0 && !takeMesh(files, open)) open(files[0]);
  });
  const carriesFile = (event) => event.dataTransfer?.types.includes("Files");
  window.addEventListener("dragover", (event) => {
    if (!carriesFile(event)) return;
    event.preventDefault();
    $("drop").hidden = false;
  });
  window.addEventListener("dragleave", (event) => {
    if (!event.relatedTarget) $("drop").hidden = true;
  });
  window.addEventListener("drop", (event) => {
    $("drop").hidden = true;
    if (!carriesFile(event)) return;
    event.preventDefault();
    const files = [...event.dataTransfer.files];
    if (files.length > 0 && !takeMesh(files, open)) open(files[0]);
  });
}

/** Selects in the list what is open; a file or URL that is not in the list replaces the last one that was added. */
function showInList(from) {
  const list = $("volume");
  const listed = [...list.options].find(({ value }) => value && value === from);
  if (listed) {
    listed.selected = true;
    return;
  }
  list.querySelector("[data-other]")?.remove();
  const option = new Option(nameOf(from), "", true, true);
  option.dataset.other = "";
  option.disabled = true;
  list.append(option);
}

/* Numbers */

/** @param {import("tetralod/viewer").ViewerProgress} progress */
function showProgress({ bytes, total, complete, blocks }) {
  demo.receivedBytes = bytes;
  demo.blocks = blocks;
  for (const row of all(".of-blocks")) row.hidden = !blocks;
  if (blocks) return showBlocks(blocks, bytes);
  const known = total ?? demo.totalBytes;
  demo.totalBytes ??= total;
  if (known) $("progress").value = bytes / known;
  const amount = known ? `${size(bytes)} of ${size(known)}` : size(bytes);
  $("progress-text").textContent = complete ? `${size(bytes)} received` : amount;
  $("n-bytes").textContent = complete ? size(bytes) : amount;
}

/** Shows the progress of a file that is fetched in blocks: only those that the mesh needs. */
function showBlocks({ here, all, needed, leftOut }, bytes) {
  if (needed > 0) $("progress").value = Math.min(here / needed, 1);
  $("progress-text").textContent = `${count(here)} of ${count(all)} blocks`;
  const excess = leftOut > 0 ? `, ${count(leftOut)} do not fit in memory` : "";
  $("n-blocks").textContent = `${count(here)} of ${count(all)}${excess}`;
  $("n-bytes").textContent = size(bytes);
}

function showStats(stats) {
  demo.step = stats;
  const { info } = demo;
  $("n-current").textContent = count(stats.tetrahedra);
  const all = info ? ` of ${count(info.updates)}` : "";
  $("n-applied").textContent = `${count(stats.applied)}${all}`;
  $("n-updates").textContent = `+${count(stats.refined)} −${count(stats.coarsened)}`;
  $("n-refine").textContent = `${milliseconds(stats.milliseconds)}${stats.done ? "" : "…"}`;
  if (info) {
    $("n-reference").textContent = count(info.tetrahedra);
    $("fill").style.width = `${(100 * stats.tetrahedra) / info.tetrahedra}%`;
  }
  // No error is guaranteed before the last step.
  if (!stats.done) return;
  // The mesh is not complete while data is missing.
  if (!stats.missing) demo.stats = stats;
  probes.refresh();
  showHistogram().catch(fail);
  const bound = percentage(stats.relativeErrorBound * 100);
  $("n-error").textContent = bound;
  $("budget-note").textContent = stats.satisfied || budget() === undefined ? BUDGET_NOTE : achieved(stats);
  const seen = stats.bounds[1];
  $("n-pixels").textContent = seen === undefined ? "–" : pixels(seen);
  $("n-pixels").classList.toggle("short", seen > errorPixels());
  announce(`${count(stats.tetrahedra)} tetrahedra, error ${bound}`);
}

function showFrame(frame) {
  demo.frame = frame;
  demo.frames++;
  if (!frame.ready) return;
  if (demo.firstFrameBytes === undefined) {
    demo.firstFrameBytes = frame.bytes;
    demo.firstFrameMs = performance.now();
  }
  $("n-triangles").textContent = count(frame.triangles);
  $("n-uploaded").textContent = size(frame.uploaded);
  $("n-draw").textContent = milliseconds(frame.milliseconds);
}

const BUDGET_NOTE = "If the mesh would be larger, its error is as small as this number allows";

/** The errors that the budget allows. */
function achieved({ relativeErrorBound, bounds }) {
  const seen = bounds[1] === undefined ? "" : ` and ${pixels(bounds[1])} on screen`;
  return `Too few for the requested error: the error is at most ${percentage(relativeErrorBound * 100)}${seen}`;
}

let waiting;

/** Announces the numbers to screen readers when they have not changed for a while. */
function announce(words) {
  clearTimeout(waiting);
  waiting = setTimeout(() => ($("status").textContent = words), 800);
}

/** Shows the value of a slider, and gives it to screen readers. */
function text(output, words, slider) {
  $(output).textContent = words;
  $(slider).setAttribute("aria-valuetext", words);
}
