/**
 * The state of the page: everything that is set, in one store. Controls show it and change it; the address, undo and redo are
 * made of it. A control that is part of it has an entry here, under its name in the address. Values that are the default are left
 * out of there.
 */

import { curveOf, curveWords } from "./curve.js";
import { $, named } from "./dom.js";
import { precise } from "./format.js";
import { demo, page, volume } from "./page.js";
import { nodesOf, treeOf } from "./regiontree.js";
import { Store } from "./store.js";
import { AXES, fieldNames, inner, rangeOf, stepsOf, vectors } from "./volume.js";

/** @typedef {"iso" | "volume" | "slice" | "solid" | "mesh" | "flow"} Mode */
/** @typedef {import("tetralod/viewer").CameraState} Camera */
/** @typedef {import("./volume.js").Point} Point */
/** The values of the first and the last colour. @typedef {"data" | "percentiles" | "symmetric" | [low: number, high: number]} Range */
/** @typedef {Record<string, string>} Words */

/**
 * A plane: its normal, of any length; whether it hides the lower side, and not that which the normal points to; its places as one that cuts
 * and as one that is looked at, in thousandths of the model along the normal.
 *
 * @typedef {{ normal: Point, flip: boolean, cut: number, section: number }} Plane
 */

/** Controls that have a value of their own: they are bound to it by their ids. Those that compare meshes have no entry. */
const [FLAGS, SLIDERS, CHOICES] = /** @type {const} */ ([
  [
    "outline",
    "threshold-cut",
    "undeformed",
    "inside",
    "arrows",
    "flow-boundary",
    "reversed",
    "log",
    "extremes",
    "handle",
    "focus",
    "axes",
    "fly",
    "freeze",
    "difference",
  ],
  ["shrink", "shade", "rake", "pixels", "budget", "frame-time", "split"],
  ["shape", "colour-by", "boundary-colour", "flow-colour", "map", "bands", "region", "background", "surface-colour", "vector", "deform", "over-time", "unit"],
]);

/**
 * @typedef {object} Others
 * @property {Mode} view
 * @property {readonly string[]} also what was chosen to be shown beside the view
 * @property {Record<string, number>} opacities of each part, in percent
 * @property {Record<string, boolean>} edges
 * @property {string} field
 * @property {number} time its step
 * @property {number | undefined} isovalue in units of the field; that which is shown first without it
 * @property {number | undefined} times how many times the vector that deforms; what is automatic without it
 * @property {readonly Plane[]} planes that cut away, or are looked at
 * @property {number} plane the number of the one that is chosen
 * @property {"field" | "view"} refine
 * @property {number} error where its slider is
 * @property {number} outside where that is by screen error: then it applies outside of the view, and may be coarser
 * @property {import("./volume.js").Box} box
 * @property {Range} range
 * @property {[low: number, high: number] | undefined} threshold the values of the cells that are shown; all without it
 * @property {import("./curve.js").Curve} transfer
 * @property {readonly number[]} hidden the places of regions, in the list of the volume, that are not shown
 * @property {Readonly<Record<number, number>>} part-opacities of regions, by their places in the list: in percent of that of the boundary
 * @property {string} part the path of the region, or of the branch of regions, that is refined where that is asked for
 * @property {readonly Point[]} seeds that were placed by clicks
 * @property {readonly Point[]} probes
 * @property {string} beside the words of the file that is compared with; empty without one
 * @property {Camera | undefined} camera that with which the volume is shown first without it
 */

/**
 * @typedef {Record<(typeof FLAGS)[number], boolean> & Record<(typeof SLIDERS)[number], number> & Record<(typeof CHOICES)[number], string>
 *   & Others & { playing: boolean, swinging: boolean, dark: boolean, kept: boolean, met: boolean, subtracted: boolean }} State
 */

/** Words of the address: `get` gives none for what there is first, `set` never gets none and tells whether they mean something. */
/** @typedef {{ get: (state: Readonly<State>) => string, set: (words: string, draft: State) => boolean }} Entry */

/** What a volume is shown in first: an isosurface where it shows more than the boundary. @returns {Mode} */
const firstView = () => (demo.info?.surfaceFirst === false ? "solid" : "iso");
/** Nothing is cut off a boundary that is shown first. */
const firstCut = () => (firstView() === "solid" ? 0 : MIDDLE);

/** Parts that have an opacity, in the order that links have. */
const SHEER = ["iso", "volume", "slice", "solid"];
/** Parts whose edges can be drawn, and whether they are drawn first. @type {Record<string, boolean>} */
const EDGES = { iso: false, slice: true, solid: true, mesh: true };
/** Edges are not drawn on a boundary that is shown first. @returns {Record<string, boolean>} */
const firstEdges = () => ({ ...EDGES, solid: firstView() !== "solid" });
export const OPAQUE = 100;
/** Of planes, in thousandths of the model's length. */
export const MIDDLE = 500;
export const MOST_PLANES = 6;
/** Digits of numbers of the camera; those of the mesh's request have fewer, and are rounded before they are used. */
const CAMERA_DIGITS = 9;

/** Whether it is an opacity, in percent. @param {number} number */
const isSheer = (number) => number >= 5 && number <= OPAQUE;

/** @param {string} words */
export const numbers = (words) => words.split(",").map(Number);
/** @param {string} words @param {number} count */
export const isNumbers = (words, count) => numbers(words).length === count && numbers(words).every(Number.isFinite);

/** Points of the model; none where a word is no number. @param {string} words */
export function points(words) {
  const all = words ? numbers(words) : [];
  const found = all.flatMap((_, i) => (i % 3 === 0 && i + 2 < all.length ? [/** @type {Point} */ (all.slice(i, i + 3))] : []));
  return all.every(Number.isFinite) ? found : [];
}

/** The controls with values of their own. */
const bound = [...FLAGS, ...SLIDERS, ...CHOICES].map((id) => ({ id, element: /** @type {HTMLInputElement | HTMLSelectElement} */ ($(id)) }));

/** @param {HTMLInputElement | HTMLSelectElement} element */
function taken(element) {
  if (element instanceof HTMLSelectElement || element.type === "text") return element.value;
  return element.type === "checkbox" ? element.checked : element.valueAsNumber;
}

/** @param {HTMLInputElement | HTMLSelectElement} element @param {unknown} value */
function put(element, value) {
  if (element instanceof HTMLInputElement && element.type === "checkbox") element.checked = value === true;
  else element.value = String(value);
}

/** What these controls have in the page as it was loaded. */
const loaded = Object.fromEntries(bound.map(({ id, element }) => [id, taken(element)]));

/** The entry of such a control. @param {(typeof bound)[number]["id"]} id @returns {Entry} */
function control(id) {
  const probe = /** @type {HTMLInputElement | HTMLSelectElement} */ ($(id).cloneNode(true));
  /** @param {unknown} value */
  const words = (value) => String(typeof value === "boolean" ? Number(value) : value);
  return {
    get: (state) => (state[id] === loaded[id] ? "" : words(state[id])),
    set(given, draft) {
      put(probe, typeof loaded[id] === "boolean" ? given === "1" : given);
      // What the control does not take would leave it empty, or at another value.
      if (words(taken(probe)) !== given || !probe.checkValidity()) return false;
      Object.assign(draft, { [id]: taken(probe) });
      return true;
    },
  };
}

/** A number, if there is one. @param {"times" | "isovalue"} id @returns {Entry} */
const number = (id) => ({
  get: (state) => String(state[id] ?? ""),
  set(words, draft) {
    const isOne = isNumbers(words, 1);
    if (isOne) draft[id] = Number(words);
    return isOne;
  },
});

/** A name from a list that the volume has, the default is its first. @param {"field" | "surface-colour" | "vector" | "deform" | "part"} id @param {() => string[]} names @returns {Entry} */
const list = (id, names) => ({
  get: (state) => (state[id] === names()[0] ? "" : state[id]),
  set(words, draft) {
    if (names().includes(words)) draft[id] = words;
    return true;
  },
});

/** The names of the fields, that which is shown first in front. */
function firstFields() {
  const { name } = volume().fields[volume().firstField];
  return [name, ...fieldNames().filter((other) => other !== name)];
}

/** The paths of regions and of branches of them. */
const partNames = () => nodesOf(treeOf((demo.info?.regions?.all ?? []).map(({ name }) => name))).map(({ path }) => path);
const colourNames = () => ["", ...fieldNames()];
const vectorNames = () => [...vectors().keys(), ""];
const deformNames = () => ["", ...vectors().keys()];

/** A choice of radio buttons. @param {"view" | "refine"} id @param {string} name @param {() => string} first @returns {Entry} */
const radios = (id, name, first) => ({
  get: (state) => (state[id] === first() ? "" : state[id]),
  set(words, draft) {
    const isOne = named(name).some(({ value }) => value === words);
    if (isOne) Object.assign(draft, { [id]: words });
    return isOne;
  },
});

/** A place of the slider of errors. @param {"error" | "outside"} id @returns {Entry} */
const errorPlace = (id) => ({
  get: (state) => (state[id] === FIRST[id] ? "" : String(state[id])),
  set(words, draft) {
    const isPlace = Number(words) >= 0 && Number(words) <= 100;
    if (isPlace) draft[id] = Number(words);
    return isPlace;
  },
});

/** Whether the plane of a view is one to look at, and cuts nothing away. @param {Readonly<Pick<State, "view">>} state */
export const isSection = ({ view }) => view === "slice" || view === "flow";

/** Whether a direction is that of an axis. @param {Point} normal @param {number} axis */
export const isAxis = (normal, axis) => normal.every((x, i) => x === Number(i === axis));

/** Changes the first plane, which has words of its own: links of before have no other. @param {State} draft @param {Partial<Plane>} values */
function changeFirst(draft, values) {
  draft.planes = [{ ...draft.planes[0], ...values }, ...draft.planes.slice(1)];
  return true;
}

const isPlace = (/** @type {number} */ place) => place >= 0 && place <= 1000;
const isNormal = (/** @type {number[]} */ normal) => normal.length === 3 && normal.every(Number.isFinite) && normal.some((x) => x !== 0);

/** The place of the first plane in the view, or the other one. @param {boolean} isOther @returns {Entry} */
function place(isOther) {
  /** @param {Readonly<State>} state */
  const which = (state) => (isSection(state) !== isOther ? "section" : "cut");
  const first = (/** @type {"cut" | "section"} */ which) => (which === "cut" ? firstCut() : MIDDLE);
  return {
    get: (state) => (state.planes[0][which(state)] === first(which(state)) ? "" : String(state.planes[0][which(state)])),
    set: (words, draft) => !isPlace(Number(words)) || changeFirst(draft, { [which(draft)]: Number(words) }),
  };
}

/** A plane other than the first: its normal, its side and its places. */
const PLANE_NUMBERS = 6;
const planeWords = (/** @type {Plane} */ { normal, flip, cut, section }) => String([...normal, Number(flip), cut, section]);
/** @param {number[]} numbers @returns {Plane[]} */
function planeOf([x, y, z, side, cut, section]) {
  const isPlane = isNormal([x, y, z]) && (side === 0 || side === 1) && isPlace(cut) && isPlace(section);
  return isPlane ? [{ normal: [x, y, z], flip: side === 1, cut, section }] : [];
}

/** Points of the model. @param {"seeds" | "probes"} id @returns {Entry} */
const places = (id) => ({
  get: (state) => String(state[id].flat()),
  set(words, draft) {
    draft[id] = points(words);
    return true;
  },
});

/** @param {Camera} camera */
export function cameraWords({ target, distance, yaw, pitch, projection }) {
  const place = target.map((x) => precise(x, distance, CAMERA_DIGITS));
  const all = [...place, ...[distance, yaw, pitch].map((x) => Number(x.toPrecision(CAMERA_DIGITS)))];
  return `${all}${projection === "orthographic" ? ",orthographic" : ""}`;
}

/** In the order of the address: what others depend on comes before them. @type {Record<string, Entry>} */
const ENTRIES = {
  view: radios("view", "mode", firstView),
  also: {
    get: ({ also }) => String(also),
    set(words, draft) {
      draft.also = named("also")
        .map(({ value }) => value)
        .filter((name) => words.split(",").includes(name));
      return true;
    },
  },
  opacity: {
    // One number is that of the view.
    get({ opacities, view }) {
      const isFirst = (/** @type {string} */ name) => opacities[name] === OPAQUE;
      if (SHEER.every(isFirst)) return "";
      return SHEER.every((name) => name === view || isFirst(name)) ? String(opacities[view]) : String(SHEER.map((name) => opacities[name]));
    },
    set(words, draft) {
      const all = numbers(words);
      const held = (/** @type {number} */ number) => (isSheer(number) ? number : OPAQUE);
      const one = (/** @type {string} */ name) => (name === draft.view ? all[0] : OPAQUE);
      draft.opacities = Object.fromEntries(SHEER.map((name, i) => [name, held(all.length === SHEER.length ? all[i] : one(name))]));
      return true;
    },
  },
  edges: {
    // The parts that are not as first.
    get: ({ edges }) => String(Object.keys(EDGES).filter((name) => edges[name] !== firstEdges()[name])),
    set(words, draft) {
      const others = words.split(",");
      draft.edges = Object.fromEntries(Object.entries(firstEdges()).map(([name, first]) => [name, first !== others.includes(name)]));
      return true;
    },
  },
  field: list("field", firstFields),
  "surface-colour": list("surface-colour", colourNames),
  vector: list("vector", vectorNames),
  deform: list("deform", deformNames),
  times: number("times"),
  undeformed: control("undeformed"),
  isovalue: number("isovalue"),
  cut: place(false),
  "other-cut": place(true),
  shape: control("shape"),
  shrink: control("shrink"),
  outline: control("outline"),
  shade: control("shade"),
  inside: control("inside"),
  "colour-by": control("colour-by"),
  "boundary-colour": control("boundary-colour"),
  "flow-colour": control("flow-colour"),
  rake: control("rake"),
  arrows: control("arrows"),
  "flow-boundary": control("flow-boundary"),
  map: control("map"),
  reversed: control("reversed"),
  log: control("log"),
  bands: control("bands"),
  extremes: control("extremes"),
  axis: {
    get: ({ planes: [{ normal }] }) => String([0, 2].find((axis) => isAxis(normal, axis)) ?? ""),
    set: (words, draft) => /^[012]$/.test(words) && changeFirst(draft, { normal: [Number(words === "0"), Number(words === "1"), Number(words === "2")] }),
  },
  normal: {
    get: ({ planes: [{ normal }] }) => (AXES.some((axis) => isAxis(normal, axis)) ? "" : String(normal)),
    set(words, draft) {
      const [x, y, z, ...rest] = numbers(words);
      return isNormal([x, y, z]) && rest.length === 0 && changeFirst(draft, { normal: [x, y, z] });
    },
  },
  flip: {
    get: ({ planes: [{ flip }] }) => (flip ? "" : "0"),
    set: (words, draft) => /^[01]$/.test(words) && changeFirst(draft, { flip: words === "1" }),
  },
  planes: {
    get: ({ planes: [, ...others] }) => others.map(planeWords).join(),
    set(words, draft) {
      const all = numbers(words);
      const count = Math.min(Math.ceil(all.length / PLANE_NUMBERS), MOST_PLANES - 1);
      const others = Array.from({ length: count }, (_, i) => planeOf(all.slice(i * PLANE_NUMBERS, (i + 1) * PLANE_NUMBERS))).flat();
      draft.planes = [draft.planes[0], ...others];
      return others.length * PLANE_NUMBERS === all.length;
    },
  },
  plane: {
    get: ({ plane }) => (plane === 0 ? "" : String(plane + 1)),
    set(words, draft) {
      const isOne = draft.planes[Number(words) - 1] !== undefined;
      if (isOne) draft.plane = Number(words) - 1;
      return isOne;
    },
  },
  handle: control("handle"),
  pixels: control("pixels"),
  budget: control("budget"),
  region: control("region"),
  focus: control("focus"),
  background: control("background"),
  axes: control("axes"),
  unit: control("unit"),
  fly: control("fly"),
  "frame-time": control("frame-time"),
  beside: {
    get: ({ beside }) => beside,
    set(words, draft) {
      Object.assign(draft, { beside: words, difference: false });
      return true;
    },
  },
  // A mesh that is kept is in no link.
  difference: {
    get: ({ beside, difference }) => (beside && difference ? "1" : ""),
    set(words, draft) {
      draft.difference = words === "1" && draft.beside !== "";
      return draft.difference;
    },
  },
  time: {
    get: ({ time }) => (time === 0 ? "" : String(time)),
    set(words, draft) {
      if (/^\d+$/.test(words)) draft.time = Number(words);
      return true;
    },
  },
  refine: radios("refine", "refine-by", () => FIRST.refine),
  error: errorPlace("error"),
  outside: errorPlace("outside"),
  box: {
    get: ({ box }) => (String(box) === String(inner()) ? "" : String(box)),
    set(words, draft) {
      const box = numbers(words);
      const isBox = isNumbers(words, 6) && [0, 1, 2].every((i) => box[i] <= box[i + 3]);
      if (isBox) draft.box = /** @type {import("./volume.js").Box} */ (box);
      return isBox;
    },
  },
  range: {
    get: ({ range }) => (range === "data" ? "" : String(range)),
    set(words, draft) {
      const [low, high] = numbers(words);
      if (words === "percentiles" || words === "symmetric") draft.range = words;
      else if (low < high) draft.range = [low, high];
      return draft.range !== "data";
    },
  },
  threshold: {
    get: ({ threshold }) => String(threshold ?? ""),
    set(words, draft) {
      const [low, high] = numbers(words);
      if (isNumbers(words, 2) && low <= high) draft.threshold = [low, high];
      return draft.threshold !== undefined;
    },
  },
  "threshold-cut": control("threshold-cut"),
  transfer: {
    get: ({ transfer }) => curveWords(transfer),
    set(words, draft) {
      draft.transfer = curveOf(words);
      return true;
    },
  },
  hidden: {
    // Runs of numbers: "0-3,7".
    get({ hidden }) {
      const starts = hidden.filter((number, i) => hidden[i - 1] !== number - 1);
      const ends = hidden.filter((number, i) => hidden[i + 1] !== number + 1);
      return starts.map((start, i) => (start === ends[i] ? start : `${start}-${ends[i]}`)).join();
    },
    set(words, draft) {
      const count = demo.info?.regions?.all.length ?? 0;
      const runs = words.split(",").map((run) => /^(\d+)(?:-(\d+))?$/.exec(run));
      const isIn = (/** @type {number} */ number) => runs.some((run) => run && number >= Number(run[1]) && number <= Number(run[2] ?? run[1]));
      draft.hidden = Array.from({ length: count }, (_, number) => number).filter(isIn);
      return draft.hidden.length > 0 && runs.every((run) => run && Number(run[2] ?? run[1]) < count);
    },
  },
  "part-opacities": {
    // Runs of numbers with their opacities: "0-3:50,7:20".
    get({ "part-opacities": all }) {
      const numbers = Object.keys(all).map(Number);
      const goesOn = (/** @type {number} */ a, /** @type {number} */ b) => all[a] === all[b] && b === a + 1;
      const starts = numbers.filter((number, i) => i === 0 || !goesOn(numbers[i - 1], number));
      const ends = numbers.filter((number, i) => i === numbers.length - 1 || !goesOn(number, numbers[i + 1]));
      return starts.map((start, i) => `${start === ends[i] ? start : `${start}-${ends[i]}`}:${all[start]}`).join();
    },
    set(words, draft) {
      const count = demo.info?.regions?.all.length ?? 0;
      const runs = words.split(",").map((run) => /^(\d+)(?:-(\d+))?:(\d+)$/.exec(run));
      const isRun = (/** @type {RegExpExecArray | null} */ run) => run !== null && Number(run[2] ?? run[1]) < count && isSheer(Number(run[3]));
      /** @type {Record<number, number>} */
      const all = {};
      for (const run of runs.filter(isRun)) {
        for (let number = Number(run?.[1]); number <= Number(run?.[2] ?? run?.[1]); number++) all[number] = Number(run?.[3]);
      }
      draft["part-opacities"] = all;
      return runs.every(isRun);
    },
  },
  part: list("part", partNames),
  seeds: places("seeds"),
  probes: places("probes"),
  "over-time": control("over-time"),
  camera: {
    get: ({ camera }) => (camera && !(page.home && cameraWords(camera) === cameraWords(page.home)) ? cameraWords(camera) : ""),
    set(words, draft) {
      const [x, y, z, distance, yaw, pitch] = numbers(words);
      const isWhole = [x, y, z, distance, yaw, pitch].every(Number.isFinite) && distance > 0;
      /** @type {Camera["projection"]} */
      const projection = words.endsWith(",orthographic") ? "orthographic" : "perspective";
      if (isWhole) draft.camera = { target: [x, y, z], distance, yaw, pitch, projection };
      return isWhole;
    },
  },
};

/** What there is first of what no volume changes. @type {Omit<Others, "field" | "box" | "part">} */
export const FIRST = {
  view: /** @type {Mode} */ ("iso"),
  also: [],
  opacities: Object.fromEntries(SHEER.map((name) => [name, OPAQUE])),
  edges: EDGES,
  time: 0,
  isovalue: undefined,
  times: undefined,
  planes: /** @type {readonly Plane[]} */ ([{ normal: [0, 1, 0], flip: true, cut: MIDDLE, section: MIDDLE }]),
  plane: 0,
  refine: "field",
  error: 50,
  outside: 78,
  range: "data",
  threshold: undefined,
  transfer: curveOf(""),
  hidden: [],
  "part-opacities": {},
  seeds: [],
  probes: [],
  beside: "",
  camera: undefined,
};

/** The one that the page has. @type {Store<State>} */
export const store = new Store(
  /** @type {State} */ ({
    ...loaded,
    ...FIRST,
    field: "",
    part: "",
    box: [0, 0, 0, 1, 1, 1],
    playing: false,
    swinging: false,
    dark: true,
    ...{ kept: false, met: false, subtracted: false },
  }),
  settled,
);

/** What there is first of the volume that is open. What is not in the address stays. @returns {State} */
function first() {
  const { freeze, difference, split } = store.state;
  const own = {
    view: firstView(),
    planes: [{ ...FIRST.planes[0], cut: firstCut() }],
    edges: firstEdges(),
    field: firstFields()[0],
    vector: vectorNames()[0],
    part: partNames()[0] ?? "",
    box: inner(),
  };
  return { ...store.state, ...loaded, ...FIRST, ...own, freeze, difference, split };
}

/** What fits the volume, and values that fit each other. @param {State} state @returns {State} */
function settled(state) {
  if (!demo.info) return state;
  const hasVectors = vectors().size > 0;
  const canBe = (/** @type {string} */ name) => (name !== "flow" || hasVectors) && (name !== "wires" || !state.also.includes("points"));
  const log = state.log && rangeOf(state.field)[1] > 0;
  return {
    ...state,
    view: state.view === "flow" && !hasVectors ? firstView() : state.view,
    // A mesh is drawn in one way.
    also: state.also.every(canBe) ? state.also : state.also.filter(canBe),
    time: state.time < stepsOf(state.field).length ? state.time : 0,
    log,
    region: state.region === "part" && !state.part ? "" : state.region,
    // No range of positive numbers has 0 in its middle.
    range: log && state.range === "symmetric" ? "data" : state.range,
  };
}

/** All words of the state but that of the volume. */
export function words() {
  const all = Object.entries(ENTRIES).map(([name, { get }]) => [name, get(store.state)]);
  return /** @type {Words} */ (Object.fromEntries(all.filter(([, word]) => word !== "")));
}

/** What stays when another volume takes the place of one: all that has no place in its model. */
export function carriedOver() {
  const { camera, box, hidden, "part-opacities": opacities, part, seeds, probes, time, unit, ...rest } = words();
  return rest;
}

/** As it is written in the address. Commas and slashes need no escapes there. @param {Words} words */
export const written = (words) => new URLSearchParams(words).toString().replaceAll("%2C", ",").replaceAll("%2F", "/");

/** @param {string} text @returns {Words} */
export const read = (text) => Object.fromEntries(new URLSearchParams(text.replace(/^#/, "")));

/**
 * Takes the words for a state of the volume that is open. What means nothing is ignored, and given.
 *
 * @param {Words} given
 */
export function show({ url, ...given }) {
  const draft = first();
  const isTaken = (/** @type {string} */ name, /** @type {string} */ words) => words === "" || ENTRIES[name]?.set(words, draft);
  // In the order of the entries, whatever that of the words.
  const order = [...Object.keys(ENTRIES).filter((name) => name in given), ...Object.keys(given).filter((name) => !ENTRIES[name])];
  const ignored = order.filter((name) => !isTaken(name, given[name]));
  store.replace(draft);
  return ignored.map((name) => `${name}=${given[name]}`);
}

/** Binds the controls that have values of their own. */
export function attachState() {
  for (const { id, element } of bound) {
    element.addEventListener("input", () => store.change({ [id]: taken(element) }));
    store.subscribe([id], () => put(element, store.state[id]));
  }
}
