/**
 * What has come of the volume, and the viewer. Tests read it from `window.tetralodDemo`: `state` is "starting", "opening",
 * "streaming", "complete", "failed" or "unsupported".
 */

/** @typedef {import("tetralod/viewer").ViewerStats} Stats */

/**
 * @typedef {object} Demo
 * @property {"starting" | "opening" | "streaming" | "complete" | "failed" | "unsupported"} state
 * @property {import("tetralod/viewer").Viewer} [viewer]
 * @property {import("tetralod").MtInfo} [info]
 * @property {Stats} [stats] of the last complete mesh: all its data has arrived
 * @property {Stats} [step] of the last step of refinement
 * @property {import("tetralod/viewer").ViewerRefineOptions} [request] the last one
 * @property {import("tetralod/viewer").ViewerFrame} [frame]
 * @property {number} frames
 * @property {{ code?: string, message: string }} [error]
 * @property {number} [firstFrameBytes] decoded at the first picture that shows the volume
 * @property {number} [firstFrameMs] from when the page was opened to that picture
 * @property {number} receivedBytes
 * @property {number} [totalBytes]
 * @property {import("tetralod").BlockProgress} [blocks] of a file that is fetched in blocks
 * @property {Beside} [beside] the file that is compared with
 */

/**
 * A second file, and the viewer that shows it.
 *
 * @typedef {object} Beside
 * @property {"opening" | "streaming" | "complete" | "failed"} state
 * @property {string} name
 * @property {import("tetralod/viewer").Viewer} [viewer]
 * @property {import("tetralod").MtInfo} [info]
 * @property {Stats} [stats] of the last mesh
 * @property {import("tetralod/viewer").ViewerRefineOptions} [request] the last one
 * @property {import("tetralod/viewer").ViewerFrame} [frame]
 * @property {{ code?: string, message: string }} [error]
 * @property {string[]} missing what is shown of the other file, and this one does not have
 */

/** @type {Demo} */
export const demo = { state: "starting", frames: 0, receivedBytes: 0 };
window.tetralodDemo = demo;

/** The volume that is open. Only asked for while there is one. */
export function volume() {
  if (!demo.info) throw new Error("No volume is open");
  return demo.info;
}

/** The viewer. Only asked for when it has started. */
export function viewer() {
  if (!demo.viewer) throw new Error("The viewer has not started");
  return demo.viewer;
}

/**
 * What is made once the viewer has started; `home` is the camera with which the volume is shown first.
 *
 * @type {{ home?: import("tetralod/viewer").CameraState, overlay: import("./overlay.js").OverlayView,
 *   overlayBeside: import("./overlay.js").OverlayView, probes: import("./probes.js").Probes,
 *   transfer: import("./transfer.js").TransferEditor }}
 */
export const page = /** @type {any} */ ({});
