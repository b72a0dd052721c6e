/** The settings that compare meshes: a mesh that stays, one that is kept, and both beside each other. */

/** @type {(id: string) => any} Each caller knows the type of its element. */
const $ = (id) => document.getElementById(id);

export class Comparison {
  #viewer;
  #isKept = false;

  /**
   * @param {import("tetralod/viewer").Viewer} viewer
   * @param {{ onChange: () => void, onError: (error: any) => void }} page `onChange` draws again
   */
  constructor(viewer, { onChange, onError }) {
    this.#viewer = viewer;
    const changed = () => {
      this.#show();
      onChange();
    };
    $("freeze").addEventListener("input", () => viewer.freeze($("freeze").checked).catch(onError));
    $("keep").addEventListener("click", () => {
      // Both at once: pressed again it forgets the mesh.
      const kept = this.#isKept ? Promise.resolve() : viewer.keep();
      this.#isKept = !this.#isKept;
      kept.then(changed, onError);
    });
    $("split").addEventListener("input", changed);
    $("difference").addEventListener("input", changed);
  }

  /** Another volume was opened: it has no mesh that was kept. */
  forget() {
    this.#isKept = false;
    if ($("freeze").checked) this.#viewer.freeze(false).catch(() => {});
    $("freeze").checked = false;
    this.#show();
  }

  /** What the viewer is to show of it. */
  get state() {
    // The difference is shown on all of the picture: one legend cannot tell the colours of both halves.
    const difference = $("difference").checked;
    return this.#isKept ? { at: difference ? 0 : Number($("split").value) / 100, difference } : null;
  }

  #show() {
    $("keep").textContent = this.#isKept ? "Forget the kept mesh" : "Keep this mesh";
    $("comparison").hidden = !this.#isKept;
    $("split").disabled = $("difference").checked;
    $("divider").hidden = !this.#isKept || $("difference").checked;
    $("divider").style.left = `${$("split").value}%`;
  }
}
