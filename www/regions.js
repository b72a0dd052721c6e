/** The parts of the volume, which files keep apart as regions: which of them are shown, how opaque they are, and which is refined. */

import { demo } from "./page.js";
import { nodesOf, treeOf } from "./regiontree.js";
import { OPAQUE, store } from "./state.js";

/** The regions of the volume that is open. */
export const regions = () => demo.info?.regions?.all ?? [];

/** Their names as a tree. */
export const regionTree = () => treeOf(regions().map(({ name }) => name));

/** Tells of a region whether it is hidden. */
export function hiddenOnes() {
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

/** Hides some regions, and shows the others. @param {(i: number) => boolean} isHidden */
export const hide = (isHidden) =>
  store.change({
    hidden: regions()
      .map((_, i) => i)
      .filter(isHidden),
  });

/** Hides some regions, or shows them; others stay. @param {readonly number[]} numbers @param {boolean} areHidden */
export function setHidden(numbers, areHidden) {
  const [isHidden, isOne] = [hiddenOnes(), new Set(numbers)];
  hide((i) => (isOne.has(i) ? areHidden : isHidden(i)));
}

/** Hides all regions but some. @param {readonly number[]} numbers */
export function showOnly(numbers) {
  const isOne = new Set(numbers);
  hide((i) => !isOne.has(i));
}

/** The region with a name, as others find it. @param {string} name */
export const numberOf = (name) => regions().findIndex((region) => region.name === name);

/** How opaque a region is, in percent of the boundary. @param {number} number */
export const regionOpacity = (number) => store.state["part-opacities"][number] ?? OPAQUE;

/** @param {readonly number[]} numbers @param {number} percent */
export function setRegionOpacity(numbers, percent) {
  const all = { ...store.state["part-opacities"] };
  for (const number of numbers) {
    if (percent === OPAQUE) delete all[number];
    else all[number] = percent;
  }
  store.change({ "part-opacities": all });
}

/** What the boundary of the scene says of it, given its own opacity. @param {number} opacity */
export function regionOpacities(opacity) {
  const own = regions().flatMap(({ name }, number) => (regionOpacity(number) < OPAQUE ? [[name, (opacity * regionOpacity(number)) / OPAQUE]] : []));
  return own.length > 0 ? { regionOpacities: Object.fromEntries(own) } : {};
}

/** The names of the regions of a part: a region, or a branch of the tree. @param {string} path */
export function namesIn(path) {
  const node = nodesOf(regionTree()).find((node) => node.path === path);
  return (node?.numbers ?? []).map((number) => regions()[number].name);
}
