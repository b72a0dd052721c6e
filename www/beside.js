/** A second file beside the one that is open, with its camera, field, colours and request; or the difference of both. */

import { attachControls } from "./controls.js";
import { $, announce, button } from "./dom.js";
import { shownField } from "./fields.js";
import { count, diagonalOf, nameOf, percentage } from "./format.js";
import { chooseBeside } from "./gallery.js";
import { linkedRequest, linkedScene, numberIn } from "./linked.js";
import { fail } from "./messages.js";
import { pictureWords, showGrowth } from "./numbers.js";
import { demo, page, viewer, volume } from "./page.js";
import { boxWithHandles, cutBox } from "./region.js";
import { ASKED, options } from "./request.js";
import { LOOKS, scene, showLegend } from "./scene.js";
import { fileNameIn, sourceOf } from "./source.js";
import { store } from "./state.js";

/** @typedef {import("./page.js").Beside} Beside */
/** @typedef {import("tetralod/viewer").Viewer} Viewer */

/** Points that are farther outside than this part of the diagonal, and the errors of both boundaries, have no difference. */
const REACH = 0.005;

const canvas = () => $("canvas-beside", HTMLCanvasElement);

/** The words of the file that is open, or being opened. */
let wanted = "";
let opening = 0;
/** The viewer, while there is one, and when the one before is gone. @type {Promise<Viewer> | undefined} */
let made;
let gone = Promise.resolve();
/** What it was asked for last. */
let [asked, drawn] = ["", ""];
/** Counts what is subtracted: late answers are ignored. */
let subtracting = 0;

/** What was shown, and is not. */
function close() {
  const old = made;
  made = undefined;
  gone = gone.then(async () => (await old?.catch(() => undefined))?.free());
  demo.beside = undefined;
  page.overlayBeside.data = undefined;
}

/** The viewer of a file: made when it is asked for first. */
function theViewer() {
  made ??= gone.then(async () => {
    const { Viewer } = await import("tetralod/viewer");
    const made = await Viewer.create(canvas(), { renderer: viewer().renderer, frameTime: store.state["frame-time"] });
    listen(made);
    return made;
  });
  return made;
}

/** @param {Viewer} made */
function listen(made) {
  /** What is shown with it, unless it is on its way out. */
  const own = () => (demo.beside?.viewer === made ? demo.beside : undefined);
  made.addEventListener("stats", ({ detail }) => {
    const beside = own();
    if (!beside || !detail.done) return;
    beside.stats = detail;
    showBeside();
    announce(`${beside.name}: ${count(detail.tetrahedra)} tetrahedra, error ${percentage(100 * detail.relativeErrorBound)}`);
    subtract();
    page.probes.refresh();
  });
  made.addEventListener("frame", ({ detail }) => {
    const beside = own();
    if (!beside) return;
    beside.frame = detail;
    if (detail.ready) $("stage-beside").dataset.shows = "volume";
  });
  made.addEventListener("overlay", ({ detail }) => (page.overlayBeside.data = own() && detail));
  made.addEventListener("error", ({ detail }) => own() && failBeside(detail));
}

/** @param {any} error */
function failBeside(error) {
  const { beside } = demo;
  if (!beside || error.name === "AbortError" || error.code === "freed") return;
  Object.assign(beside, { state: "failed", error: { code: error.code, message: error.message } });
  showBeside();
  announce(`${beside.name}: ${error.message}`, 0);
}

/** Opens what the state says, if that is another file. */
async function follow() {
  if (store.state.beside === wanted) return;
  wanted = store.state.beside;
  const mine = ++opening;
  [asked, drawn] = ["", ""];
  store.change({ met: false, subtracted: false, ...(wanted ? { kept: false } : {}) });
  if (!wanted) close();
  showLayout();
  if (!wanted) return;
  const from = sourceOf(wanted);
  const name = nameOf(from ?? fileNameIn(wanted) ?? wanted);
  /** @type {Beside} */
  const beside = { state: "opening", name, missing: [] };
  demo.beside = beside;
  showBeside();
  try {
    if (!from) throw Object.assign(new Error("this file on a disk is not part of the link: choose it with “Compare with another file…”"), { code: "no-file" });
    const own = await theViewer();
    if (mine !== opening) return;
    beside.viewer = own;
    const { info, finished } = await own.open(from, { state: { camera: store.state.camera ?? page.home ?? null, outline: false } });
    if (mine !== opening) return;
    Object.assign(beside, { info, state: "streaming" });
    store.change({ met: true });
    await finished;
    await own.settled();
    if (mine !== opening) return;
    beside.state = "complete";
    showBeside();
  } catch (error) {
    if (mine === opening) failBeside(error);
  }
}

/** Opens the file again that could not be opened, or goes on with it. */
function retry() {
  const words = wanted;
  wanted = "";
  close();
  store.change({ beside: words });
  follow();
}

/** Where both are: beside each other, or the difference in the place of the first. */
function showLayout() {
  const { beside, subtracted } = store.state;
  $("stage-beside").hidden = beside === "";
  $("stages").dataset.shows = beside === "" ? "one" : subtracted ? "difference" : "both";
  $("not-beside").hidden = beside === "";
  showGrowth();
}

/** Says what is beside, and how good that is. */
function showBeside() {
  const { beside } = demo;
  $("retry-beside").hidden = beside?.state !== "failed" || beside.error?.code === "no-file";
  if (!beside) return;
  const { info, name, state, stats, error, missing } = beside;
  const field = demo.info && info?.fields[numberIn(info, shownField())];
  const isOtherTime = field !== undefined && field.time !== shownField().time;
  const more = [
    ...(isOtherTime ? [field.time === undefined ? "without a time" : `at time ${Number(field.time.toPrecision(6))}`] : []),
    ...(missing.length > 0 ? [`does not have ${missing.join(", ")}`] : []),
    ...(error ? [error.message] : []),
  ];
  $("growth-beside").replaceChildren(...pictureWords({ name, info, stats: state === "failed" ? undefined : stats }, more));
}

/** What is drawn beside: nothing while the difference is shown in its place. */
function drawBeside() {
  const { beside } = demo;
  if (!demo.info || !beside?.info || !beside.viewer || !store.state.met) return;
  const linked = linkedScene(scene(), store.state.field, demo.info, beside.info);
  beside.missing = linked.missing;
  showBeside();
  const { factor } = page.overlay.deformation ?? {};
  const { deform } = linked.scene;
  const whole = {
    ...linked.scene,
    region: boxWithHandles() ?? null,
    clipBox: cutBox() ?? null,
    // What is automatic is that of the first file.
    ...(deform && factor !== undefined ? { deform: { ...deform, factor } } : {}),
  };
  const words = JSON.stringify(whole);
  if (words === drawn) return;
  drawn = words;
  beside.viewer.set(whole).catch(failBeside);
}

/** What is asked of its mesh. */
function refineBeside() {
  const { beside } = demo;
  if (!demo.info || !beside?.info || !beside.viewer || !store.state.met) return;
  const request = linkedRequest(options(), demo.info, beside.info);
  const words = JSON.stringify(request);
  if (words === asked) return;
  asked = words;
  beside.request = request;
  beside.viewer.refine(request).catch(failBeside);
}

function look() {
  const camera = store.state.camera ?? page.home;
  if (camera) demo.beside?.viewer?.set({ camera }).catch(failBeside);
}

/** Gives the mesh beside to the viewer of the first file, so that this shows the difference; or the difference is shown no more. */
async function subtract() {
  const mine = ++subtracting;
  const { beside } = demo;
  const { difference, met } = store.state;
  const number = beside?.info && demo.info && numberIn(beside.info, shownField());
  if (!difference || !met || number === undefined || !beside?.viewer || !beside.stats || !demo.stats) return store.change({ subtracted: false });
  try {
    const { name, time } = shownField().own;
    const mesh = await beside.viewer.mesh({ fields: [number] });
    if (mine !== subtracting || !demo.info || !demo.stats) return;
    const reach = REACH * diagonalOf(volume().bounds) + demo.stats.boundaryBound + beside.stats.boundaryBound;
    // The nearest time may be another one.
    await viewer().keep({ ...mesh, fields: mesh.fields.map((field) => ({ ...field, name, time })) }, { reach });
    if (mine === subtracting) store.change({ subtracted: true });
  } catch (error) {
    if (mine === subtracting) fail(error);
  }
}

/** What both files have at a point; nothing where neither has anything. @param {import("./volume.js").Point} point */
export async function readBoth(point) {
  const [here, there] = await Promise.all([viewer().reading(point), demo.beside?.info && demo.beside.viewer?.reading(point).catch(() => undefined)]);
  if (!demo.beside?.info) return here;
  return here || there ? { .../** @type {import("tetralod/viewer").Reading} */ (here ?? { ...there, values: {}, region: undefined }), there } : undefined;
}

/** What is seen at a point of one of the pictures, with what the other file has there. @param {Viewer} from @param {import("./controls.js").Point} at */
export async function pickBoth(from, [x, y]) {
  const found = await from.pick(x, y);
  return found && demo.beside?.info ? readBoth(found.position) : found;
}

/**
 * @param {Pick<import("./controls.js").Actions, "onHome" | "onBox" | "onLeave"> & { onClick: (point: import("./controls.js").Point, from?: Viewer) => void }} actions
 */
export function attachBeside({ onClick, ...actions }) {
  $("beside").addEventListener("click", chooseBeside);
  $("not-beside").addEventListener("click", () => {
    store.change({ beside: "" });
    button("beside").focus();
  });
  $("retry-beside").addEventListener("click", retry);
  store.subscribe(["beside"], follow);
  store.subscribe(["beside", "subtracted"], showLayout);
  store.subscribe([...ASKED, "met"], refineBeside);
  store.subscribe([...LOOKS, "region", "inside", "box"], drawBeside);
  page.overlay.follow(() => demo.beside && store.state.deform !== "" && drawBeside());
  store.subscribe(["camera", "met"], look);
  store.subscribe(["difference", "met", "field", "time"], subtract);
  store.subscribe(["freeze", "met"], () => demo.beside?.viewer?.freeze(store.state.freeze).catch(failBeside));
  store.subscribe(["frame-time"], () => demo.beside?.viewer && Object.assign(demo.beside.viewer, { frameTime: store.state["frame-time"] }));
  viewer().addEventListener("stats", ({ detail }) => {
    if (!detail.done || !demo.beside) return;
    if (!$("legend").hidden) showLegend(viewer().legend);
    if (!store.state.subtracted) subtract();
  });
  // What moves the camera moves that of the first viewer, which the other one follows.
  attachControls(canvas(), viewer(), {
    ...actions,
    onClick: (point) => onClick(point, demo.beside?.viewer),
    onHover: (point, place) => demo.beside?.info && page.probes.hover(point, place, demo.beside.viewer),
    onSpan: () => {},
    isFlying: () => store.state.fly,
  });
}
