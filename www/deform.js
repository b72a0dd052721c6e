/** The deformed shape: which vector displaces what is drawn, how many times, and whether it swings. */

import { displaced } from "tetralod/viewer";
import { $, input, select } from "./dom.js";
import { shownField } from "./fields.js";
import { rounded } from "./format.js";
import { fail } from "./messages.js";
import { demo, page, viewer, volume } from "./page.js";
import { store } from "./state.js";
import { vectors } from "./volume.js";

/** How long a period of what swings takes (in ms). */
const PERIOD = 2000;
/** Where a period begins: with all of the displacement. */
const ALL = 0.25;

/** Vectors that most likely are displacements, by their names. */
const LIKELY = /disp|deform|^u$/i;

/** How much of a period has passed. */
let phase = ALL;

/** The names of the components of the vector, if one displaces. Probes ask while the next volume has not come, too. */
const components = () => (demo.info ? vectors().get(store.state.deform) : undefined);

/** What the scene says of it. @returns {import("tetralod/viewer").DeformState | null} */
export function deformation() {
  const { times, undeformed, swinging } = store.state;
  const fields = components();
  if (!fields) return null;
  return { field: fields.join(), undeformed, ...(times === undefined ? {} : { factor: times }), ...(swinging ? { phase } : {}) };
}

/** Where a point of the model is drawn, given the values there. @param {{ position: number[], values: Record<string, number> }} at */
export function drawnAt({ position, values }) {
  const { factor = 0, part = 0 } = page.overlay.deformation ?? {};
  const fields = components();
  return fields ? position.map((x, i) => x + factor * part * values[fields[i]]) : position;
}

/** Whether what is saved is deformed. */
export const isDeformed = () => components() !== undefined && page.overlay.deformation !== undefined;

/** A mesh or a surface with all fields, where it is drawn. @template T @param {T} arrays @returns {T} */
export function saved(arrays) {
  const { factor = 0, part = 0 } = page.overlay.deformation ?? {};
  const { fields } = volume();
  const now = shownField().time;
  const numbers = components()?.map((name) => {
    const steps = fields.flatMap((field, i) => (field.name === name ? [{ i, time: field.time }] : []));
    return (steps.find(({ time }) => time === now) ?? steps[0]).i;
  });
  return numbers ? /** @type {any} */ (displaced(/** @type {any} */ (arrays), numbers, factor * part)) : arrays;
}

/** Turns it on, by the likeliest vector, or off. */
export function toggleDeformation() {
  if (!demo.info) return;
  const names = [...vectors().keys()];
  store.change({ deform: store.state.deform ? "" : (names.find((name) => LIKELY.test(name)) ?? names[0] ?? "") });
}

/** How often it has begun to swing: what swings for an earlier click ends. */
let swings = 0;

/** Shows one phase after the other, as fast as they are drawn, while it swings. */
async function swing() {
  const mine = ++swings;
  const start = performance.now();
  const goesOn = () => mine === swings && store.state.swinging && demo.info !== undefined;
  try {
    while (goesOn()) {
      phase = (ALL + (performance.now() - start) / PERIOD) % 1;
      const deform = deformation();
      if (!deform) break;
      await viewer().set({ deform });
      await new Promise((resolve) => requestAnimationFrame(resolve));
    }
  } finally {
    if (mine === swings) {
      phase = ALL;
      store.change({ swinging: false });
    }
  }
}

/** How many times the vector, where that is not typed. */
function showFactor() {
  const { factor } = page.overlay.deformation ?? {};
  const isAutomatic = factor !== undefined && store.state.times === undefined && store.state.deform !== "";
  $("times-text").textContent = isAutomatic ? `Automatic: ${rounded(factor, factor)} times, at most a tenth of the model's diagonal` : "";
}

/** Another file is shown. */
export function listVectors() {
  const names = [...vectors().keys()];
  select("deform").replaceChildren(new Option("nothing", ""), ...names.map((name) => new Option(name, name)));
  $("deformed").hidden = names.length === 0;
}

export function attachDeform() {
  input("times").addEventListener("change", () => {
    const { valueAsNumber } = input("times");
    store.change({ times: Number.isFinite(valueAsNumber) ? valueAsNumber : undefined });
  });
  $("swing").addEventListener("click", () => {
    store.change({ swinging: !store.state.swinging && store.state.deform !== "" });
    swing().catch(fail);
  });
  store.subscribe(["times"], () => {
    input("times").value = String(store.state.times ?? "");
  });
  store.subscribe(["deform"], () => {
    $("deform-how").hidden = !store.state.deform;
  });
  store.subscribe(["swinging"], () => {
    $("swing").textContent = store.state.swinging ? "Stop" : "Swing";
    $("swing").setAttribute("aria-pressed", String(store.state.swinging));
  });
  store.subscribe(["deform", "times"], showFactor);
  page.overlay.follow(showFactor);
}
