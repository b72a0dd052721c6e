/** The histogram of the field above the slider of the isovalue: a press or a drag on it chooses the isovalue. */

import { averagedNote } from "./averaged.js";
import { histogramPath, isLogarithmic, SIZE } from "./bins.js";
import { $, all, svg } from "./dom.js";
import { isovaluePart, setIsovalue, shownField } from "./fields.js";
import { fail } from "./messages.js";
import { demo, page, viewer } from "./page.js";
import { store } from "./state.js";

const { width: WIDTH, margin: MARGIN } = SIZE;

/** Shows the histogram of the field where the isovalue and the transfer function are chosen. */
export async function showHistogram() {
  if (!["iso", "volume"].includes(store.state.view) || !demo.info) return;
  // That of the file is of the reference mesh; without it, that of the mesh which is shown.
  const field = shownField();
  const { min, max, histogram: known } = field;
  const volumes = known ?? (await viewer().stats({ bins: 100, range: [min, max] })).histogram;
  page.transfer.volumes = volumes;
  $("histogram-volumes", SVGPathElement).setAttribute("d", histogramPath(volumes));
  const words = `Volume of each value, as ${isLogarithmic(volumes) ? "logarithms" : "square roots"}`;
  for (const note of all(".histogram-note")) note.textContent = [words, ...averagedNote([field])].join("; ");
}

/** Shows where the isovalue is. */
function showLine() {
  const x = String(MARGIN + isovaluePart() * (WIDTH - 2 * MARGIN));
  for (const name of ["x1", "x2"]) $("histogram-line", SVGLineElement).setAttribute(name, x);
}

export function attachHistogram() {
  const shown = svg("histogram");
  const take = (/** @type {PointerEvent} */ { clientX }) => {
    const { left, width } = shown.getBoundingClientRect();
    const x = ((clientX - left) / width) * WIDTH;
    setIsovalue((x - MARGIN) / (WIDTH - 2 * MARGIN));
  };
  shown.addEventListener("pointerdown", (event) => {
    shown.setPointerCapture(event.pointerId);
    take(event);
  });
  shown.addEventListener("pointermove", (event) => event.buttons & 1 && take(event));
  store.subscribe(["isovalue", "field", "time"], showLine);
  store.subscribe(["view", "field", "time"], () => showHistogram().catch(fail));
}
