/** The list of parts: a tree where their names have steps. A box shows or hides one or all of a branch, a slider makes it translucent. */

import { $, all, element, input, select } from "./dom.js";
import { count, grouped } from "./format.js";
import { withUnit } from "./lengths.js";
import { hiddenOnes, hide, regionOpacity, regions, regionTree, setHidden, setRegionOpacity, showOnly } from "./regions.js";
import { nodesOf } from "./regiontree.js";
import { store } from "./state.js";

/** @typedef {import("./regiontree.js").Node} Node */
/** A row of the list. `list` has the rows of its children, which `open` shows. @typedef {{ node: Node, item: HTMLElement, label: HTMLElement, box: HTMLInputElement, slider: HTMLInputElement, list?: HTMLElement, open?: HTMLButtonElement }} Row */

/** A list of more parts has a filter, and its branches are closed first. */
const LONG = 20;

/** The regions that are listed. @type {import("tetralod").RegionInfo[]} */
let listed = [];
/** @type {Row[]} */
let rows = [];

/** Tells of a region whether the filter finds it. */
function foundOnes() {
  const words = input("region-filter").value.trim().toLowerCase();
  return (/** @type {number} */ i) => words === "" || listed[i].name.toLowerCase().includes(words);
}

/** What of a branch the list has. @param {Node} node */
const found = ({ numbers }) => numbers.filter(foundOnes());

/** @param {Node} node */
function titleOf({ numbers, path }) {
  const of = (/** @type {"tetrahedra" | "volume"} */ what) => numbers.reduce((sum, number) => sum + listed[number][what], 0);
  return `${path}: ${count(of("tetrahedra"))} tetrahedra at full resolution, volume ${withUnit(grouped(of("volume")), 3)}`;
}

/** What screen readers say of it: of a branch, its name. @param {Node} node */
const nameOf = ({ path }) => path.replace(/\/$/, "");

/** Opens or closes a branch. @param {Row} row @param {boolean} isOpen */
function setOpen({ list, open }, isOpen) {
  open?.setAttribute("aria-expanded", String(isOpen));
  if (list) list.hidden = !isOpen;
}

/** Makes the row of a part, and those of its children. @param {Node} node @returns {HTMLElement} */
function entry(node) {
  const name = nameOf(node);
  const box = element("input", { type: "checkbox" });
  if (node.label !== name) box.ariaLabel = name;
  box.addEventListener("change", () => setHidden(found(node), !box.checked));
  const label = element("label");
  label.append(box);
  if (node.children.length === 0) {
    const swatch = element("span", { className: "swatch" });
    swatch.style.background = listed[node.numbers[0]].color;
    label.append(swatch);
  }
  label.append(element("span", {}, node.label));
  const only = element("button", { type: "button", ariaLabel: `only ${name}` }, "only");
  only.addEventListener("click", () => showOnly(found(node)));
  const slider = element("input", { type: "range", min: "5", max: "100", step: "5", hidden: true, ariaLabel: `opacity of ${name}` });
  slider.addEventListener("input", () => setRegionOpacity(found(node), slider.valueAsNumber));
  const line = element("div", {}, label, only);
  const item = element("li", {}, line, slider);
  /** @type {Row} */
  const row = { node, item, label, box, slider };
  rows.push(row);
  if (node.children.length > 0) {
    const open = element("button", { type: "button", className: "open", ariaLabel: `parts of ${name}` });
    const list = element("ul", {}, ...node.children.map(entry));
    Object.assign(row, { open, list });
    open.addEventListener("click", () => setOpen(row, list.hidden === true));
    line.prepend(open);
    item.append(list);
    setOpen(row, listed.length <= LONG);
  }
  return item;
}

/** Says how large each part is. */
function showTitles() {
  for (const { node, label } of rows) label.title = titleOf(node);
}

/** Another file is shown. */
export function listRegions() {
  listed = regions();
  const hasSome = listed.length > 0;
  $("regions").hidden = listed.length < 2;
  for (const option of all("#colour-by [value=region], #region [value=part]")) option.toggleAttribute("hidden", !hasSome);
  rows = [];
  const tree = regionTree();
  $("region-list").replaceChildren(...tree.map(entry));
  $("region-list").classList.toggle(
    "tree",
    rows.some(({ list }) => list),
  );
  input("region-filter").value = "";
  input("region-filter").hidden = listed.length <= LONG;
  const options = nodesOf(tree).map(({ path, children }) => element("option", { value: path }, children.length > 0 ? `all of ${path}` : path));
  select("part").replaceChildren(...options);
  showTitles();
  filter();
}

/** Lists those alone that the filter finds, their branches open. */
function filter() {
  const isFound = foundOnes();
  const isFiltered = input("region-filter").value.trim() !== "";
  for (const row of rows) {
    row.item.hidden = !row.node.numbers.some(isFound);
    if (isFiltered && !row.item.hidden) setOpen(row, true);
  }
  const number = listed.filter((_, i) => isFound(i)).length;
  $("only-found").hidden = !isFiltered || number === 0;
  $("region-count").textContent = isFiltered ? `${number} of ${listed.length} parts` : "";
  show();
}

/** Whether there is a slider for each part. */
const hasSliders = () => $("region-sliders").getAttribute("aria-pressed") === "true" && store.state.view === "solid";

/** Shows which are hidden, and how opaque they are. */
function show() {
  const isHidden = hiddenOnes();
  for (const { node, box, slider } of rows) {
    const numbers = found(node);
    const hidden = numbers.filter(isHidden).length;
    // A press on a branch that shows some shows all.
    box.checked = hidden === 0;
    box.indeterminate = hidden > 0 && hidden < numbers.length;
    slider.hidden = !hasSliders();
    slider.value = String(Math.max(...numbers.map(regionOpacity)));
    slider.setAttribute("aria-valuetext", `${slider.value} %`);
  }
  $("boundary-colour-row").hidden = store.state.view !== "solid" || listed.length === 0;
  $("region-sliders").hidden = store.state.view !== "solid";
}

/** Goes from box to box, opens and closes branches. @param {KeyboardEvent} event */
function go(event) {
  const seen = rows.filter(({ box }) => box.offsetParent !== null);
  const at = seen.findIndex(({ box }) => box === event.target);
  if (at < 0) return;
  if (event.key === "ArrowDown" || event.key === "ArrowUp") seen[event.key === "ArrowDown" ? at + 1 : at - 1]?.box.focus();
  else if (event.key === "ArrowRight" || event.key === "ArrowLeft") setOpen(seen[at], event.key === "ArrowRight");
  else return;
  event.preventDefault();
}

export function attachRegions() {
  $("all-regions").addEventListener("click", () => hide(() => false));
  $("other-regions").addEventListener("click", () => {
    const isHidden = hiddenOnes();
    hide((i) => !isHidden(i));
  });
  $("only-found").addEventListener("click", () => showOnly(listed.flatMap((_, i) => (foundOnes()(i) ? [i] : []))));
  input("region-filter").addEventListener("input", filter);
  $("region-list").addEventListener("keydown", go);
  $("region-sliders").addEventListener("click", () => {
    $("region-sliders").setAttribute("aria-pressed", String($("region-sliders").getAttribute("aria-pressed") !== "true"));
    show();
  });
  select("part").addEventListener("change", () => store.change({ part: select("part").value }));
  store.subscribe(["unit"], showTitles);
  // Behind those that show and hide the settings of a view.
  store.subscribe(["hidden", "part-opacities", "view", "also", "opacities", "edges"], show);
  store.subscribe(["region", "part"], () => {
    $("part-row").hidden = store.state.region !== "part";
    select("part").value = store.state.part;
  });
}
