/** The settings that compare meshes: a mesh that stays, one that is kept, and both beside each other. */

import { $, button, input } from "./dom.js";
import { fail } from "./messages.js";
import { demo, viewer } from "./page.js";
import { store } from "./state.js";

/** What the viewer is to show of it. */
export function comparison() {
  const { kept, split, difference } = store.state;
  // The difference is shown on all of the picture: one legend cannot tell the colours of both halves.
  return kept ? { at: difference ? 0 : split / 100, difference } : null;
}

function showComparison() {
  const { kept, split, difference } = store.state;
  button("keep").textContent = kept ? "Forget the kept mesh" : "Keep this mesh";
  $("comparison").hidden = !kept;
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
  store.subscribe(["kept", "split", "difference"], showComparison);
}
