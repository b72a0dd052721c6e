/** The histogram of the field above the slider of the isovalue: a press or a drag on it chooses the isovalue. */

import { histogramPath, isLogarithmic, SIZE } from "./bins.js";
import { $, all } from "./dom.js";
import { page } from "./page.js";
import { setIsovalue } from "./scene.js";

const { width: WIDTH, margin: MARGIN } = SIZE;

/** @param {ArrayLike<number>} volumes the volume of the mesh in each of equal bins of the field's range */
export function showVolumes(volumes) {
  $("histogram-volumes").setAttribute("d", histogramPath(volumes));
  const words = `Volume of each value, as ${isLogarithmic(volumes) ? "logarithms" : "square roots"}`;
  for (const note of all(".histogram-note")) note.textContent = words;
}

/** Shows where the isovalue is. @param {number} fraction of the field's range */
export function showHistogramLine(fraction) {
  const x = MARGIN + fraction * (WIDTH - 2 * MARGIN);
  for (const name of ["x1", "x2"]) $("histogram-line").setAttribute(name, x);
}

export function attachHistogram() {
  const svg = $("histogram");
  const take = ({ clientX }) => {
    const { left, width } = svg.getBoundingClientRect();
    const x = ((clientX - left) / width) * WIDTH;
    if (page.field) setIsovalue(Math.min(Math.max((x - MARGIN) / (WIDTH - 2 * MARGIN), 0), 1));
  };
  svg.addEventListener("pointerdown", (event) => {
    svg.setPointerCapture(event.pointerId);
    take(event);
  });
  svg.addEventListener("pointermove", (event) => event.buttons & 1 && take(event));
}
