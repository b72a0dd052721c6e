/**
 * What the parts of the page share. Tests read the state of the page from `window.tetralodDemo`: `state` is "starting",
 * "opening", "streaming", "complete", "failed" or "unsupported".
 */

export const demo = (window.tetralodDemo = {
  state: "starting",
  /** @type {import("tetralod/viewer").Viewer | undefined} */
  viewer: undefined,
  /** @type {import("tetralod").MtInfo | undefined} */
  info: undefined,
  /** Statistics of the last complete mesh (all its data has arrived), and of the last step of refinement. */
  stats: undefined,
  step: undefined,
  /** The last request. */
  request: undefined,
  frame: undefined,
  frames: 0,
  error: undefined,
  /** At the first picture that shows the dataset: bytes decoded and milliseconds since the page was opened. */
  firstFrameBytes: undefined,
  firstFrameMs: undefined,
  receivedBytes: 0,
  totalBytes: undefined,
  /** Of a file that is fetched in blocks: numbers of its blocks. */
  blocks: undefined,
});

/**
 * A field at one of its times. `min` and `max` are over all times, and the histogram is of that range, so that values and colours mean
 * the same at all of them; `number` is its place in `info.fields`, `own` what that says of it.
 *
 * @typedef {import("tetralod").FieldInfo & { number: number, own: import("tetralod").FieldInfo }} ShownField
 */

/**
 * @type {{ viewer?: import("tetralod/viewer").Viewer, overlay?: import("./overlay.js").OverlayView,
 *   probes?: import("./probes.js").Probes, colours?: import("./colours.js").ColourSettings,
 *   transfer?: import("./transfer.js").TransferEditor, flow?: import("./flow.js").FlowSettings,
 *   comparison?: import("./compare.js").Comparison, field?: ShownField,
 *   isovalue?: number, box?: number[] }}
 */
export const page = {
  /** The field that is shown, at its time step. */
  field: undefined,
  /** In units of the field; the middle of its range without it. */
  isovalue: undefined,
  /** Corners of the region, [x0, y0, z0, x1, y1, z1]. */
  box: undefined,
};
