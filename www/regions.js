/** The parts of the volume, which files keep apart as regions: which of them are shown. */

import { $, element } from "./dom.js";
import { count, grouped } from "./format.js";
import { withUnit } from "./lengths.js";
import { demo } from "./page.js";
import { store } from "./state.js";

/** The regions of the volume that is open. */
const regions = () => demo.info?.regions?.all ?? [];

/** Tells of a region whether it is hidden. */
function hiddenOnes() {
  const all = new Set(store.state.hidden);
  return (/** @type {number} */ i) => all.has(i);
}

/** The names of those that are shown; nothing where all are. */
export function shownRegions() {
  const isHidden = hiddenOnes();
  return store.state.hidden.length > 0
    ? regions()
        .filter((_, i) => !isHidden(i))
        .map(({ name }) => name)
    : null;
}

/** Whether the boundary has the colours of the regions. */
export const isByRegion = () => store.state["boundary-colour"] === "region" && regions().length > 0;

/** @param {(i: number) => boolean} isHidden */
const hide = (isHidden) =>
  store.change({
    hidden: regions()
      .map((_, i) => i)
      .filter(isHidden),
  });

/** The region with a name, as others find it. @param {string} name */
const numberOf = (name) => regions().findIndex((region) => region.name === name);

/** Hides the region with a name, too. @param {string} name */
export function hideRegion(name) {
  const [number, isHidden] = [numberOf(name), hiddenOnes()];
  hide((i) => i === number || isHidden(i));
}

/** Hides all regions but that with a name. @param {string} name */
export function showOnly(name) {
  const number = numberOf(name);
  hide((i) => i !== number);
}

/** The entry of a region. @param {import("tetralod").RegionInfo} region @param {number} number */
function entry({ name, color, tetrahedra, volume }, number) {
  const box = element("input", { type: "checkbox" });
  box.addEventListener("change", () => {
    const isHidden = hiddenOnes();
    hide((i) => (i === number ? !box.checked : isHidden(i)));
  });
  const swatch = element("span", { className: "swatch" });
  swatch.style.background = color;
  const label = element("label", { title: `${name}: ${count(tetrahedra)} tetrahedra at full resolution, volume ${withUnit(grouped(volume), 3)}` });
  label.append(box, swatch, element("span", {}, name));
  const only = element("button", { type: "button", ariaLabel: `only ${name}` }, "only");
  only.addEventListener("click", () => showOnly(name));
  const item = element("li");
  item.append(label, only);
  return item;
}

/** Another file is shown. */
export function listRegions() {
  $("regions").hidden = regions().length < 2;
  $("colour-by")
    .querySelector("[value=region]")
    ?.toggleAttribute("hidden", regions().length === 0);
  $("region-list").replaceChildren(...regions().map(entry));
  showRegions();
}

function showRegions() {
  const boxes = /** @type {NodeListOf<HTMLInputElement>} */ ($("region-list").querySelectorAll("input"));
  const isHidden = hiddenOnes();
  boxes.forEach((box, i) => {
    box.checked = !isHidden(i);
  });
  $("boundary-colour-row").hidden = store.state.view !== "solid" || regions().length === 0;
}

export function attachRegions() {
  $("all-regions").addEventListener("click", () => hide(() => false));
  $("other-regions").addEventListener("click", () => {
    const isHidden = hiddenOnes();
    hide((i) => !isHidden(i));
  });
  store.subscribe(["unit"], listRegions);
  // Behind those that show and hide the settings of a view.
  store.subscribe(["hidden", "view", "also", "opacities", "edges"], showRegions);
}
