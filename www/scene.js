/** What is drawn: the view and what is beside it, the plane, colours, and the colour bar. */

import { averagedNote } from "./averaged.js";
import { colours, gradient } from "./colours.js";
import { comparison, differenceNote } from "./compare.js";
import { pointsOf } from "./curve.js";
import { deformation } from "./deform.js";
import { $, element, text } from "./dom.js";
import { refreshExtremes } from "./extremes.js";
import { isovalue, isovaluePart, shownField } from "./fields.js";
import { flowIsByField, flowScene, flowUnit } from "./flow.js";
import { nameWithUnit } from "./lengths.js";
import { fail, hideRefusal } from "./messages.js";
import { demo, page, viewer } from "./page.js";
import { beside, hasEdges, mode, opacityOf, shows } from "./parts.js";
import { planes } from "./planes.js";
import { isByRegion, regionOpacities, shownRegions } from "./regions.js";
import { store } from "./state.js";
import { background } from "./theme.js";
import { threshold } from "./threshold.js";
import { commonRange } from "./volume.js";

/** @typedef {import("tetralod/viewer").SceneState} SceneState */
/** @typedef {import("tetralod/viewer").CellState} CellState */

/** What of the state the scene is made of. */
export const LOOKS = /** @type {const} */ ([
  ...[
    "view",
    "also",
    "opacities",
    "edges",
    "field",
    "time",
    "surface-colour",
    "vector",
    "deform",
    "times",
    "undeformed",
    "swinging",
    "isovalue",
    "planes",
    "plane",
  ],
  ...[
    "shape",
    "shrink",
    "colour-by",
    "boundary-colour",
    "hidden",
    "part-opacities",
    "flow-colour",
    "rake",
    "arrows",
    "flow-boundary",
    "seeds",
    "transfer",
    "map",
    "reversed",
    "bands",
  ],
  ...["range", "threshold", "threshold-cut", "log", "outline", "shade", "background", "dark", "kept", "split", "difference", "met", "subtracted"],
]);

/** The surface of the domain around other parts. */
const SHELL = { opacity: 0.12, colour: "#9fb0c4" };

/** Wires beside other parts are thin; points are four times as large (in pixels). */
const THIN = 0.7;

const colourBy = () => /** @type {CellState["colourBy"]} */ (store.state["colour-by"]);

/** Cells beside other parts: those in front of a plane that is looked at would hide it. */
const cellsBeside = () => ({ width: THIN, colourBy: colourBy(), ...(mode() === "slice" ? { cut: planes()[0] } : {}) });

/** The opacities of the values of the field that is shown. @returns {[value: number, opacity: number][]} */
function opacities() {
  const { min, max } = shownField();
  return pointsOf(store.state.transfer, isovaluePart()).map(([at, opacity]) => [min + at * (max - min), opacity * opacityOf("volume")]);
}

/** Whether labels are shown where there is nothing between two of them: as the boundary. @param {string} name */
const isBoundaryOfLabels = (name) => ["iso", "volume"].includes(name) && shownField().isLabel;

/** What each part of the picture adds to the scene. @type {Record<string, () => SceneState>} */
const PARTS = {
  iso() {
    const by = store.state["surface-colour"];
    return { isosurfaces: [{ value: isovalue(), opacity: opacityOf("iso"), edges: hasEdges("iso"), ...(by ? { field: by } : {}) }] };
  },
  volume: () => ({ volume: { opacities: opacities() } }),
  slice: () => ({ slices: planes().map((plane) => ({ ...plane, opacity: opacityOf("slice"), edges: hasEdges("slice") })) }),
  solid() {
    if (mode() !== "solid") return { boundary: SHELL };
    const colourBy = isByRegion() ? { colourBy: /** @type {const} */ ("region") } : {};
    const opacity = opacityOf("solid");
    return { boundary: { opacity, edges: hasEdges("solid"), ...colourBy, ...regionOpacities(opacity) }, clips: planes() };
  },
  mesh() {
    const shape = /** @type {CellState["shape"]} */ (store.state.shape);
    const [cut, ...clips] = planes();
    return { cells: { shape, shrink: store.state.shrink / 100, cut, colourBy: colourBy(), edges: hasEdges("mesh") }, clips };
  },
  wires: () => ({ cells: { shape: "wire", ...cellsBeside() } }),
  points: () => ({ cells: { shape: "points", ...cellsBeside() } }),
  flow: () => ({ ...flowScene(), ...(mode() === "flow" && store.state["flow-boundary"] ? { boundary: SHELL } : {}) }),
};

/** Whether anything has the colours of the field that is shown, whose range can be chosen. */
function isByField() {
  const cells = colourBy() === "field";
  /** @type {Record<string, boolean>} */
  const is = { iso: store.state["surface-colour"] === store.state.field, mesh: cells, wires: cells, points: cells, flow: flowIsByField() };
  // Around other parts, the boundary has a colour of its own.
  if (mode() === "solid" && isByRegion()) return false;
  return is[mode()] ?? (["volume", "slice", "solid"].includes(mode()) || beside().some((name) => is[name] ?? name !== "solid"));
}

/** What is drawn, as the settings say. */
let drawn = {};
export const scene = () => drawn;

/** Draws what the settings say. */
export function draw() {
  if (!demo.info) return;
  const { shrink, shade, outline, "surface-colour": by } = store.state;
  text("shrink", `${shrink} %`);
  text("shade", `${shade} %`);
  if (!shows("volume")) hideRefusal();
  const isPlain = (mode() === "iso" && !by) || (mode() === "solid" && isByRegion());
  // Labels have colours of their own.
  const isOfLabels = shownField().isLabel && (isByField() || isBoundaryOfLabels(mode()));
  $("colours").hidden = isOfLabels || (isPlain && !beside().some((name) => name !== "solid"));
  $("range").hidden = !isByField();
  const nothing = { isosurfaces: [], volume: null, slices: [], boundary: null, cells: null, clips: [], streamlines: null, arrows: null };
  const parts = [...beside(), mode()].map((name) => (isBoundaryOfLabels(name) ? { boundary: { opacity: opacityOf(name) } } : PARTS[name]()));
  const compare = comparison();
  // A difference has values on both sides of 0.
  const diverging = compare?.difference ? { map: "coolwarm" } : {};
  const range = shows("iso") && by && !isByField() ? { range: ownRange(by) } : {};
  const looks = {
    regions: shownRegions(),
    threshold: threshold(),
    colours: { ...colours(), ...range, ...diverging },
    background: background(),
    compare,
    deform: deformation(),
    outline,
    shade: shade / 100,
  };
  drawn = Object.assign(nothing, ...parts, looks);
  viewer().set(drawn).catch(fail);
}

/** The range of a field that is not the one that is shown; symmetric about 0 where it has values on both sides. @param {string} name @returns {[number, number]} */
function ownRange(name) {
  const [min, max] = commonRange(name);
  const most = Math.max(-min, max);
  return min < 0 && max > 0 ? [-most, most] : [min, max];
}

/** The colour bar of what is drawn. @param {import("tetralod/viewer").Legend | undefined} legend */
export function showLegend(legend) {
  $("legend").hidden = !legend;
  if (!legend) return page.overlay.refresh();
  const { label, ticks } = legend;
  $("legend-name").textContent = nameWithUnit(label, unitOf(label));
  if (demo.info && label === store.state.field) $("transfer-bar").style.background = gradient(legend);
  $("legend-bar").dataset.colours = legend.colours.join(" ");
  $("legend-bar").style.background = `linear-gradient(90deg, ${legend.colours.join(", ")})`;
  $("legend-bar").title = legend.labels.map(({ value }) => value).join(", ");
  // The ends of the range are shown in any case, what is between them where there is room.
  const isEnd = (/** @type {{ fraction: number }} */ { fraction }) => fraction === 0 || fraction === 1;
  const shown = [...ticks.filter(isEnd), ...ticks.filter((tick) => !isEnd(tick))].map(tickElement);
  $("legend-ticks").replaceChildren(...shown);
  leaveOutOverlaps(shown);
  const instead = demo.info && [...beside(), mode()].some(isBoundaryOfLabels) ? ["labels have no values between: the boundary is shown"] : [];
  const note = [...instead, ...differenceNote(legend), ...averagedNote(demo.info?.fields.filter(({ name }) => name === label) ?? [])];
  $("legend-note").replaceChildren(...note.map((textContent) => element("span", { textContent })));
  $("legend-note").hidden = note.length === 0;
  refreshExtremes();
  page.overlay.refresh();
}

/** The unit of what a legend is of: a field, or the length of the vector that is shown. @param {string} label */
function unitOf(label) {
  if (!demo.info) return "";
  const field = demo.info.fields.find(({ name }) => name === label);
  return field?.unit ?? (shows("flow") ? flowUnit() : "");
}

/** @param {{ label: string, fraction: number }} tick */
function tickElement({ label, fraction }) {
  const tick = element("span", {}, label.replaceAll("-", "−"));
  tick.style.left = `${100 * fraction}%`;
  if (fraction === 0 || fraction === 1) tick.className = fraction === 0 ? "first" : "last";
  return tick;
}

/** Hides the ticks whose words would touch those of one before. @param {HTMLElement[]} ticks */
function leaveOutOverlaps(ticks) {
  /** @type {{ left: number, right: number }[]} */
  const taken = [];
  for (const tick of ticks) {
    const { left, right } = tick.getBoundingClientRect();
    tick.hidden = taken.some((other) => left < other.right + 4 && right > other.left - 4);
    if (!tick.hidden) taken.push({ left, right });
  }
}

export function attachScene() {
  store.subscribe(LOOKS, draw);
  // The colour bar may come before the volume, which has the units; what is said of labels depends on the view.
  store.subscribe(["field", "view", "also"], () => !$("legend").hidden && showLegend(viewer().legend));
}
