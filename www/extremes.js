/** Where the field is least and greatest in the input, marked in the picture and on the colour bar. */

import { drawnAt, isDeformed } from "./deform.js";
import { $, element, shape, svg } from "./dom.js";
import { shownField } from "./fields.js";
import { grouped } from "./format.js";
import { demo, page, viewer, volume } from "./page.js";
import { store } from "./state.js";

/** @typedef {import("tetralod").Extreme} Extreme */

/** The size of a mark, and how far its words are away (in px). */
const MARK = 6;
const GAP = 10;

/** The marks, over the picture. */
const marks = shape("g", { class: "extremes" });

/** What is read at the places of the extremes, if they are displaced. @type {Map<Extreme, import("tetralod/viewer").Reading | undefined>} */
let readings = new Map();

/** The extremes of the field that is shown, with what they are called. Those of values at cells are of the cells, not of their averages. @returns {[what: string, extreme: Extreme][]} */
function extremes() {
  if (!store.state.extremes || !demo.info) return [];
  const field = volume().fields[shownField().number];
  const all = field.averaged?.input ?? field.extremes;
  if (!all) return [];
  const of = store.state.hidden.length > 0 || store.state.threshold ? " of all" : "";
  return [
    [`min${of}`, all.min],
    [`max${of}`, all.max],
  ];
}

/** Where an extreme is drawn; nothing where that is not known. @param {Extreme} extreme */
function seenAt(extreme) {
  if (!isDeformed()) return page.overlay.project(extreme.place);
  const reading = readings.get(extreme);
  return reading && page.overlay.project(drawnAt(reading));
}

/** @param {number} x @param {number} y @param {boolean} isMax */
const triangle = (x, y, isMax) => {
  const up = isMax ? -MARK : MARK;
  return shape("path", { d: `M${x} ${y}l${-MARK} ${1.6 * up}h${2 * MARK}z` });
};

/** Draws them where they are seen now: the tip of a mark is the place. */
function place() {
  const parts = extremes().flatMap(([what, extreme]) => {
    const at = seenAt(extreme);
    if (!at) return [];
    const [x, y] = at;
    const isMax = what.startsWith("max");
    const { unit } = shownField();
    const words = `${what} ${grouped(extreme.value)} ${unit}`.trim();
    return [triangle(x, y, isMax), shape("text", { x, y: isMax ? y - GAP - MARK : y + GAP + 2.5 * MARK }, words)];
  });
  marks.replaceChildren(...parts);
}

/** Reads how far the places are displaced. */
async function read() {
  const all = isDeformed() ? extremes() : [];
  const found = await Promise.all(
    all.map(([, extreme]) =>
      viewer()
        .reading(extreme.place)
        .catch(() => undefined),
    ),
  );
  readings = new Map(all.map(([, extreme], i) => [extreme, found[i]]));
  place();
}

/** Marks on the colour bar, if that is of the field. */
function mark() {
  const { legend } = viewer();
  const [low, high] = legend?.range ?? [0, 0];
  const even = (/** @type {number} */ value) => (legend?.log ? Math.log(value) : value);
  const isOfField = legend?.label === store.state.field && legend.labels.length === 0 && high > low;
  const shown = (isOfField ? extremes() : []).map(([what, { value }]) => {
    const part = (even(value) - even(low)) / (even(high) - even(low));
    const sign = element("span", { title: `${what} ${grouped(value)}` }, "▾");
    // What is beyond the colours is marked at their end.
    sign.style.left = `${100 * Math.min(Math.max(part, 0), 1)}%`;
    return sign;
  });
  $("legend-marks").replaceChildren(...shown);
}

/** Another mesh, field, displacement or colour bar is shown. */
export function refreshExtremes() {
  if (!demo.viewer) return;
  mark();
  read();
}

export function toggleExtremes() {
  store.change({ extremes: !store.state.extremes });
}

export function attachExtremes() {
  svg("overlay").append(marks);
  page.overlay.follow(place);
  store.subscribe(["extremes", "field", "time", "hidden", "threshold", "deform", "times"], refreshExtremes);
}
