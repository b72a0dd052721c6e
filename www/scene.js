/** What is drawn: the view, the isovalue, the plane, colours, and the colour bar. */

import { $, text } from "./dom.js";
import { rangeOf } from "./fields.js";
import { precise, rounded } from "./format.js";
import { expectFrame } from "./empty.js";
import { showHistogramLine, showVolumes } from "./histogram.js";
import { showIdle } from "./idle.js";
import { fail } from "./messages.js";
import { demo, page } from "./page.js";
import { attachParts, beside, hasEdges, mode, opacityOf, showParts, shows } from "./parts.js";
import { isSection, placeOfPlane, plane, seedPlane, showPlace, span, takePlace } from "./planes.js";
import { refine } from "./request.js";
import { background } from "./theme.js";

/** The surface of the domain around other parts. */
const SHELL = { opacity: 0.12, colour: "#9fb0c4" };

/** The isovalue has so many digits: as many as links keep. */
const DIGITS = 6;

/** In units of the field. */
export function isovalue() {
  const { min, max } = page.field;
  return page.isovalue ?? (min + max) / 2;
}

/** Where a value is in the field's range, 0 to 1. */
export function fractionOf(value) {
  const { min, max } = page.field;
  return max > min ? Math.min(Math.max((value - min) / (max - min), 0), 1) : 0.5;
}

/** Takes an isovalue at a fraction of the field's range. */
export function setIsovalue(fraction) {
  const { min, max } = page.field;
  page.isovalue = precise(min + fraction * (max - min), max - min, DIGITS);
  applyIsovalue();
}

/** Shows the isovalue, which may be one of the volume before: values carry over. */
export function applyIsovalue() {
  const { min, max, unit } = page.field;
  const value = isovalue();
  $("isovalue").value = 1000 * fractionOf(value);
  const words = `${rounded(value, max - min)} ${unit}`.trim();
  text("isovalue-text", words, "isovalue");
  page.transfer.showIsovalue(words);
  showHistogramLine(fractionOf(value));
  draw();
  if ($("focus").checked) refine();
}

/** Shows the settings of the view. */
export function applyMode() {
  showParts();
  // Slices and seeds have no side.
  $("flip").parentElement.hidden = isSection();
  $("cut-label").textContent = isSection() ? "Plane" : "Clip plane";
  showPlace();
  showHistogram().catch(fail);
  // Draws, too.
  applyCut();
}

/** Shows the histogram of the field where the isovalue and the transfer function are chosen. */
export async function showHistogram() {
  if (!["iso", "volume"].includes(mode()) || !demo.info || !page.field) return;
  // That of the file is of the reference mesh; without it, that of the mesh which is shown.
  const { min, max, histogram: known } = page.field;
  const histogram = known ?? (await page.viewer.stats({ bins: 100, range: [min, max] })).histogram;
  page.transfer.volumes = histogram;
  showVolumes(histogram);
}

/** Wires beside other parts are thin; points are four times as large (in pixels). */
const THIN = 0.7;

/** Cells beside other parts: those in front of a plane that is looked at would hide it. */
const cellsBeside = () => ({ colourBy: $("colour-by").value, ...(mode() === "slice" ? { cut: plane() } : {}) });

/** What each part of the picture adds to the scene. @type {Record<string, () => import("tetralod/viewer").SceneState>} */
const PARTS = {
  iso() {
    const by = $("surface-colour").value;
    const isBy = by ? { field: by } : {};
    return { isosurfaces: [{ value: isovalue(), opacity: opacityOf("iso"), edges: hasEdges("iso"), ...isBy }] };
  },
  volume: () => ({ volume: { opacities: page.transfer.opacities(page.field, opacityOf("volume")) } }),
  slice: () => ({ slices: [{ ...plane(), opacity: opacityOf("slice"), edges: hasEdges("slice") }] }),
  solid() {
    if (mode() !== "solid") return { boundary: SHELL };
    return { boundary: { opacity: opacityOf("solid"), edges: hasEdges("solid") }, clips: [plane()] };
  },
  mesh() {
    const shrink = Number($("shrink").value) / 100;
    return { cells: { shape: $("shape").value, shrink, cut: plane(), colourBy: $("colour-by").value, edges: hasEdges("mesh") } };
  },
  wires: () => ({ cells: { shape: "wire", width: THIN, ...cellsBeside() } }),
  points: () => ({ cells: { shape: "points", width: THIN, ...cellsBeside() } }),
  flow() {
    const { flow, field } = page;
    const whole = flow.state({ bounds: demo.info.bounds, plane: seedPlane(), field });
    return mode() === "flow" ? { ...whole, boundary: $("flow-boundary").checked ? SHELL : undefined } : whole;
  },
};

/** Whether anything has the colours of the field that is shown, whose range can be chosen. */
function isByField() {
  const by = $("surface-colour").value;
  const cells = $("colour-by").value === "field";
  const is = { iso: by === page.field.name, mesh: cells, wires: cells, points: cells, flow: page.flow.isByField };
  // Around other parts, the boundary has a colour of its own.
  return is[mode()] ?? (["volume", "slice", "solid"].includes(mode()) || beside().some((name) => is[name] ?? name !== "solid"));
}

/** Draws what the settings say. */
export function draw() {
  if (!demo.info) return;
  const { viewer, flow, colours, comparison } = page;
  text("opacity-text", `${$("opacity").value} %`, "opacity");
  text("shrink-text", `${$("shrink").value} %`, "shrink");
  text("shade-text", `${$("shade").value} %`, "shade");
  const by = $("surface-colour").value;
  $("colours").hidden = mode() === "iso" && !by && !beside().some((name) => name !== "solid");
  $("range").hidden = !isByField();
  page.overlay.quad = mode() === "flow" ? flow.quad({ bounds: demo.info.bounds, plane: seedPlane() }) : undefined;
  const nothing = { isosurfaces: [], volume: null, slices: [], boundary: null, cells: null, clips: [], streamlines: null, arrows: null };
  const parts = [...beside(), mode()].map((name) => PARTS[name]());
  const compare = comparison.state;
  // A difference has values on both sides of 0.
  const diverging = compare?.difference ? { map: "coolwarm" } : {};
  const range = shows("iso") && by && !isByField() ? { range: ownRange(by) } : {};
  const box = { outline: $("outline").checked, shade: $("shade").value / 100 };
  const looks = { colours: { ...colours.state, ...range, ...diverging }, background: background(), compare, ...box };
  viewer.set(/** @type {any} */ (Object.assign(nothing, ...parts, looks))).catch(fail);
  showIdle();
  expectFrame();
}

/** The range of a field that is not the one that is shown; symmetric about 0 where it has values on both sides. */
function ownRange(name) {
  const [min, max] = rangeOf(name);
  const most = Math.max(-min, max);
  return min < 0 && max > 0 ? [-most, most] : [min, max];
}

/** The colour bar of what is drawn. */
export function showLegend(legend) {
  const { overlay, field, transfer, colours } = page;
  $("legend").hidden = !legend;
  if (!legend) return overlay.refresh();
  const { label, ticks } = legend;
  const unit = unitOf(label);
  $("legend-name").textContent = unit ? `${label} in ${unit}` : label;
  if (label === field?.name) transfer.colours = colours.gradient(legend);
  $("legend-bar").dataset.colours = legend.colours.join(" ");
  $("legend-bar").style.background = `linear-gradient(90deg, ${legend.colours.join(", ")})`;
  // The ends of the range are shown in any case, what is between them where there is room.
  const isEnd = ({ fraction }) => fraction === 0 || fraction === 1;
  $("legend-ticks").replaceChildren(...[...ticks.filter(isEnd), ...ticks.filter((tick) => !isEnd(tick))].map(tickElement));
  leaveOutOverlaps($("legend-ticks"));
  overlay.refresh();
}

/** The unit of what a legend is of: a field, or the length of the vector that is shown. */
export function unitOf(label) {
  const field = [page.field, ...(demo.info?.fields ?? [])].find((one) => one?.name === label);
  if (field) return field.unit;
  return shows("flow") ? page.flow.unit : "";
}

function tickElement({ label, fraction }) {
  const tick = document.createElement("span");
  tick.textContent = label.replaceAll("-", "−");
  tick.style.left = `${100 * fraction}%`;
  if (fraction === 0 || fraction === 1) tick.className = fraction === 0 ? "first" : "last";
  return tick;
}

/** Hides the ticks whose words would touch those of one before. */
function leaveOutOverlaps(ticks) {
  const taken = [];
  for (const tick of ticks.children) {
    const { left, right } = tick.getBoundingClientRect();
    tick.hidden = taken.some((other) => left < other.right + 4 && right > other.left - 4);
    if (!tick.hidden) taken.push({ left, right });
  }
}

/** Shows where the plane is. */
export function applyCut() {
  if (!demo.info) return;
  const { axis, low, high } = span();
  const at = placeOfPlane();
  const where = Math.abs(at) < (high - low) * 1e-4 ? 0 : precise(at, high - low, 3);
  const side = $("flip").checked ? "<" : ">";
  const shown = isSection() ? `${"xyz"[axis]} = ${where}` : `Hide ${"xyz"[axis]} ${side} ${where}`;
  text("cut-text", shown, "cut");
  draw();
  if ($("region").value === "cut") refine();
}

export function attachScene() {
  attachParts({ onView: applyMode, onChange: draw });
  $("isovalue").addEventListener("input", () => page.field && setIsovalue($("isovalue").value / 1000));
  $("cut").addEventListener("input", () => {
    takePlace();
    applyCut();
  });
  for (const id of ["axis", "flip"]) $(id).addEventListener("input", applyCut);
  for (const id of ["colour-by", "surface-colour", "outline", "shade"]) $(id).addEventListener("input", draw);
}
