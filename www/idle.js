/** Controls that do nothing now: they are disabled, and say why. */

import { comparison } from "./compare.js";
import { $, all } from "./dom.js";
import { demo } from "./page.js";
import { beside, mode, opacityOf } from "./parts.js";
import { store } from "./state.js";
import { rangeOf, vectors } from "./volume.js";

/** Whether a part of the picture has an opaque surface, on which shade can fall. @param {string} name */
function isOpaque(name) {
  // Around other parts, the boundary is transparent.
  if (name === "solid" && mode() !== "solid") return false;
  return name !== "volume" && (["iso", "slice", "solid"].includes(name) ? opacityOf(name) === 1 : true);
}

/** Why each control does nothing now; nothing where it does something. @returns {Record<string, string | false | undefined>} */
function reasons() {
  const isWhole = demo.info !== undefined && !demo.blocks && "This file comes as a whole, not in blocks";
  const isDifference = comparison()?.difference && "Differences have colours and a range of their own";
  const isSolid = mode() !== "mesh" || store.state.shape === "solid";
  const noVectors = vectors().size === 0 && "This dataset has no vectors";
  const none = "There is no probe: click on the picture first";
  return {
    shrink: !isSolid && "Only solids are shrunk",
    edges: !isSolid && "Wires and points have no edges besides",
    shade: ![mode(), ...beside()].some(isOpaque) && "Nothing in the picture is opaque: shade falls on surfaces",
    map: isDifference,
    log: isDifference || (rangeOf(store.state.field)[1] <= 0 && "Logarithms need positive values, and the field has none"),
    "range-preset": isDifference,
    "range-low": isDifference,
    "range-high": isDifference,
    flow: noVectors,
    "also-flow": noVectors,
    "map-blocks": isWhole,
    "map-missing": isWhole,
    keep: store.state.beside !== "" && "The file beside is compared with",
    csv: store.state.probes.length === 0 && none,
  };
}

/** Disables a control for a reason, or enables it. @param {Element} control @param {string | false | undefined} reason */
function setIdle(control, reason) {
  control.toggleAttribute("disabled", Boolean(reason));
  (control.closest("label") ?? control).setAttribute("title", reason || "");
  if (reason) control.setAttribute("aria-description", reason);
  else control.removeAttribute("aria-description");
}

/** Disables what does nothing now, and enables all else. */
export function showIdle() {
  if (!demo.info) return;
  const { csv, ...others } = reasons();
  for (const [id, reason] of Object.entries(others)) setIdle($(id), reason);
  for (const button of all("[data-export=csv]")) setIdle(button, csv);
  for (const option of all("#colour-by [value=block], #colour-by [value=missing]")) setIdle(option, others["map-blocks"]);
}

export const attachIdle = () =>
  store.subscribe(["view", "also", "opacities", "shape", "field", "kept", "difference", "subtracted", "beside", "probes"], showIdle);
