/** The settings of the picture: where it is looked at from, background, projection, axes, flying, full screen. */

/** @type {(id: string) => any} Each caller knows the type of its element. */
const $ = (id) => document.getElementById(id);

/**
 * @param {import("tetralod/viewer").Viewer} viewer
 * @param {{ overlay: import("./overlay.js").OverlayView,
 *   onError: (error: any) => void }} page
 */
export function attachPicture(viewer, { overlay, onError }) {
  $("side").addEventListener("input", () => {
    lookFrom(viewer, $("side").value).catch(onError);
    $("side").value = "";
  });
  $("orthographic").addEventListener("input", () => {
    const { camera } = viewer.state;
    if (!camera) return;
    const projection = $("orthographic").checked ? "orthographic" : "perspective";
    viewer.set({ camera: { ...camera, projection } }).catch(onError);
  });
  $("axes").addEventListener("input", () => (overlay.showsAxes = $("axes").checked));
  $("home").addEventListener("click", () => viewer.home().catch(onError));
  $("full").addEventListener("click", fullScreen);
}

/** Shows the picture on the whole screen, or no longer. */
export function fullScreen() {
  const change = document.fullscreenElement ? document.exitFullscreen() : $("stage").requestFullscreen?.();
  // Where the browser does not allow it, the page stays as it is.
  change?.catch(() => {});
}

/** The model as it fills the picture leaves no room for the labels of axes: from so many times as far it does. */
const ROOM = 1.18;

/** Looks at the whole model from a side, with room around it. */
export function lookFrom(viewer, side) {
  const looked = viewer.lookFrom(side);
  return side === "home" ? looked : Promise.all([looked, viewer.zoom(ROOM)]);
}
