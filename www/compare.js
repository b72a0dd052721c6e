/**
 * The settings that compare: a mesh that stays, one that is kept and both beside each other; the difference to one that was kept, or to the file
 * beside.
 */

import { $, button, input } from "./dom.js";
import { shownField } from "./fields.js";
import { count, nameOf, rounded } from "./format.js";
import { fail } from "./messages.js";
import { demo, viewer } from "./page.js";
import { source } from "./source.js";
import { store } from "./state.js";

/** What the viewer is to show of it. */
export function comparison() {
  const { kept, split, difference, subtracted } = store.state;
  if (subtracted) return { at: 0, difference };
  // The difference is shown on all of the picture: one legend cannot tell the colours of both halves.
  return kept ? { at: difference ? 0 : split / 100, difference } : null;
}

/** What a colour bar says of the difference of two files. @param {import("tetralod/viewer").Legend} legend */
export function differenceNote({ range, apart }) {
  const { beside, stats } = demo;
  if (!store.state.subtracted || !beside?.stats || !stats || !source.open) return [];
  const bound = rounded(stats.fieldBound + beside.stats.fieldBound, range[1]);
  const outside = apart > 0 ? [`${count(apart)} points outside of ${beside.name}: cells there are not shown`] : [];
  return [`${nameOf(source.open)} − ${beside.name}`, `right within ${bound} ${shownField().unit}`.trim(), ...outside];
}

function showComparison() {
  const { kept, split, difference, met } = store.state;
  button("keep").textContent = kept ? "Forget the kept mesh" : "Keep this mesh";
  $("comparison").hidden = !kept && !met;
  $("split-row").hidden = !kept;
  input("split").disabled = difference;
  $("divider").hidden = !kept || difference;
  $("divider").style.left = `${split}%`;
}

export function attachComparison() {
  let isKeeping = false;
  button("keep").addEventListener("click", () => {
    // Pressed again it forgets the mesh, also while that is on its way.
    isKeeping = !isKeeping && !store.state.kept;
    if (!isKeeping) return store.change({ kept: false });
    const { info } = demo;
    const done = () => {
      if (isKeeping && info === demo.info) store.change({ kept: true });
      isKeeping = false;
    };
    viewer().keep().then(done, fail);
  });
  let isFrozen = false;
  store.subscribe(["freeze"], () => {
    const { freeze } = store.state;
    if (freeze === isFrozen) return;
    isFrozen = freeze;
    // While another volume is opened, it does not matter.
    viewer()
      .freeze(freeze)
      .catch((error) => demo.info && fail(error));
  });
  store.subscribe(["kept", "split", "difference", "met"], showComparison);
}
