/** Lengths, an angle, areas and a volume of what is shown, the mean of the field, and what it is in each part: in the panel of data. */

import { $, describe, element } from "./dom.js";
import { shownField } from "./fields.js";
import { degrees, grouped } from "./format.js";
import { lengthUnit, nameWithUnit } from "./lengths.js";
import { copied, say } from "./messages.js";
import { demo, page, viewer } from "./page.js";
import { angleOf, legsOf, NAMES } from "./path.js";
import { regions } from "./regions.js";
import { LOOKS } from "./scene.js";
import { store } from "./state.js";
import { onTab, shownTab } from "./tabs.js";
import { csv } from "./writers.js";

/** What is measured, and its number; undefined where there is none. @typedef {{ what: string, value: number | undefined, unit: string }} Measure */

/** @type {Measure[]} */
let measures = [];
/** What is known of each part. @type {import("tetralod").RegionStats[]} */
let parts = [];
/** Counts what has been asked: late answers are ignored. */
let asked = 0;

/** Those that were made last, and those of the parts. */
export const measured = () => ({ measures, parts });

/** The area of triangles. @param {import("tetralod").Surface} surface */
function areaOf({ positions, indices }) {
  let sum = 0;
  for (let i = 0; i < indices.length; i += 3) {
    const [a, b, c] = [3 * indices[i], 3 * indices[i + 1], 3 * indices[i + 2]];
    const [ux, uy, uz] = [positions[b] - positions[a], positions[b + 1] - positions[a + 1], positions[b + 2] - positions[a + 2]];
    const [vx, vy, vz] = [positions[c] - positions[a], positions[c + 1] - positions[a + 1], positions[c + 2] - positions[a + 2]];
    sum += Math.hypot(uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx) / 2;
  }
  return sum;
}

/** Between the probes. @returns {Measure[]} */
function ofProbes() {
  const legs = legsOf(page.probes.pins.map(({ position }) => position));
  const angle = { what: "Angle at B", value: angleOf(legs), unit: "°" };
  return [...legs.map(({ length }, i) => ({ what: `${NAMES[i]} to ${NAMES[i + 1]}`, value: length, unit: lengthUnit() })), ...(legs.length > 1 ? [angle] : [])];
}

/** Of what the mesh has and the picture shows, and of each part of it. @returns {Promise<{ all: Measure[], of: import("tetralod").RegionStats[] }>} */
async function ofMesh() {
  const { isosurfaces = [], slices = [] } = viewer().state;
  const { name, unit } = shownField();
  const [isosurface, section, boundary, stats] = await Promise.all([
    isosurfaces.length > 0 && viewer().isosurface(isosurfaces.map(({ value = shownField().isovalue }) => value)),
    Promise.all(slices.map(({ normal, offset }) => viewer().slice(normal, offset))),
    viewer().surface(),
    viewer().stats({ bins: 1 }),
  ]);
  const area = (/** @type {string} */ what, /** @type {import("tetralod").Surface[]} */ surfaces) => ({
    what: `Area of the ${what}`,
    value: surfaces.reduce((sum, surface) => sum + areaOf(surface), 0),
    unit: lengthUnit(2),
  });
  const all = [
    ...(isosurface ? [area("isosurface", [isosurface])] : []),
    ...(section.length > 0 ? [area("section", section)] : []),
    area("boundary", [boundary]),
    { what: "Volume", value: stats.volume, unit: lengthUnit(3) },
    { what: `Mean of ${name}`, value: stats.volume > 0 ? stats.mean : undefined, unit },
  ];
  return { all, of: regions().length > 1 ? (stats.regions ?? []) : [] };
}

/** The columns of the table of parts. @returns {[what: string, of: (part: import("tetralod").RegionStats) => string | number][]} */
function columns() {
  const { unit } = shownField();
  const inUnit = (/** @type {string} */ what) => nameWithUnit(what, unit);
  return [
    ["part", ({ name }) => name],
    ["tetrahedra", ({ tetrahedra }) => tetrahedra],
    [nameWithUnit("volume", lengthUnit(3)), ({ volume }) => volume],
    [inUnit("minimum"), ({ min }) => min],
    [inUnit("maximum"), ({ max }) => max],
    [inUnit("mean"), ({ mean }) => mean],
    [inUnit("deviation"), ({ deviation }) => deviation],
    [inUnit("error bound"), ({ errorBound }) => errorBound],
  ];
}

/** The table of parts, for those that are shown. */
function showParts() {
  $("part-stats").hidden = parts.length === 0;
  $("part-stats-title").textContent = `${shownField().name} by part`;
  const [head, body] = ["thead", "tbody"].map((name) => $("part-stats").querySelector(name));
  const all = columns();
  head?.replaceChildren(element("tr", {}, ...all.map(([what]) => element("th", { scope: "col" }, what))));
  const cell = (/** @type {string | number} */ value) =>
    typeof value === "string" ? element("th", { scope: "row" }, value) : element("td", {}, grouped(value));
  body?.replaceChildren(...parts.map((part) => element("tr", {}, ...all.map(([, of]) => cell(of(part))))));
}

/** @param {Measure} measure */
function wordsOf({ what, value, unit }) {
  if (value === undefined) return [what, "–"];
  return [what, unit === "°" ? degrees(value) : `${grouped(value)} ${unit}`.trim()];
}

/** Measures what is shown when it is at rest, if anybody looks. */
export async function refreshMeasures() {
  if (!demo.info || shownTab() !== "data") return;
  const mine = ++asked;
  $("measures").setAttribute("aria-busy", "true");
  try {
    await page.probes.read;
    // What prevents it is said elsewhere.
    await viewer()
      .settled()
      .catch(() => {});
    const found = mine === asked && demo.info ? await ofMesh() : undefined;
    if (mine !== asked || !demo.info || !found) return;
    measures = [...ofProbes(), ...found.all];
    parts = found.of;
    showParts();
    $("measures").replaceChildren();
    describe($("measures"), measures.map(wordsOf));
  } catch (error) {
    if (mine === asked && demo.info) say("The mesh could not be measured", error);
  } finally {
    if (mine === asked) $("measures").setAttribute("aria-busy", "false");
  }
}

export function attachMeasures() {
  onTab(refreshMeasures);
  store.subscribe(LOOKS, refreshMeasures);
  $("copy-measures").addEventListener("click", () => {
    const [text] = csv([["what", "value", "unit"], ...measures.map(({ what, value, unit }) => [what, value, unit])]);
    // A table of its own below the other.
    const [of] = parts.length > 0 ? csv([[], columns().map(([what]) => what), ...parts.map((part) => columns().map(([, of]) => of(part)))]) : [""];
    copied(text + of, "Measures copied as CSV");
  });
}
