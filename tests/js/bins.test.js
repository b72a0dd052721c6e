// Histograms of the demo page: which have logarithmic heights, and that no bin gets lost.
import assert from "node:assert/strict";
import { test } from "node:test";
import { histogramPath, isLogarithmic, percentilesOf, rebinned, SIZE } from "../../www/bins.js";

/** The heights of the bins, 0 to 1. */
function heights(volumes) {
  const places = histogramPath(volumes)
    .replace("Z", "")
    .slice(1)
    .split("L")
    .map((place) => place.split(" ").map(Number));
  const high = SIZE.height - 2 * SIZE.margin;
  // The first place and the last one are at the bottom; each bin has two.
  return places
    .slice(1, -1)
    .filter((_, i) => i % 2 === 0)
    .map(([, y]) => 1 - (y - SIZE.margin) / high);
}

test("heights are square roots", () => {
  assert.ok(!isLogarithmic([1, 4, 2, 1]));
  assert.deepEqual(
    heights([1, 4, 0]).map((height) => Number(height.toFixed(3))),
    [0.5, 1, 0],
  );
});

test("where one bin is much larger than most, heights are logarithms, and all others are seen", () => {
  const volumes = [1e6, 10, 300, 1, 0, 40];
  assert.ok(isLogarithmic(volumes));
  const [first, ten, more, one, none] = heights(volumes);
  assert.ok(first === 1 && more > ten && ten >= one && one > 0.01 && none === 0, String(heights(volumes)));
  assert.ok(more > 4 * Math.sqrt(300 / 1e6), "higher than a square root");
});

test("a histogram of one time step is one over the range of all, with the same volume", () => {
  assert.deepEqual(Array.from(rebinned([1, 2, 3, 4], [0, 1], [0, 1])), [1, 2, 3, 4]);
  assert.deepEqual(Array.from(rebinned([1, 2, 3, 4], [0, 1], [-1, 1])), [0, 0, 3, 7]);
  assert.deepEqual(Array.from(rebinned([4, 4], [0.25, 0.75], [0, 1])), [4, 4]);
  assert.deepEqual(Array.from(rebinned([0, 5], [0.6, 0.6], [0, 1])), [0, 5], "a field of one value");
  assert.deepEqual(Array.from(rebinned([5, 0], [1, 1], [1, 1])), [5, 0]);
  const [sum, whole] = [rebinned([3, 1, 4, 1, 5, 9], [-2, 0.7], [-3, 4]), 23].map((all) => (typeof all === "number" ? all : all.reduce((a, b) => a + b)));
  assert.ok(Math.abs(sum - whole) < 1e-12);
});

test("percentiles of a histogram are where the volume is", () => {
  assert.deepEqual(percentilesOf([1, 1, 1, 1], [0, 4], [0.25, 0.5, 0.875]), [1, 2, 3.5]);
  assert.deepEqual(percentilesOf([0, 0, 2, 0], [10, 14], [0.5, 1]), [12.5, 13]);
  assert.deepEqual(percentilesOf([0, 0], [0, 1], [0.5]), [0]);
});

test("nothing is drawn of nothing", () => {
  assert.equal(histogramPath([]), "");
  assert.equal(histogramPath([0, 0]), "");
  assert.ok(!isLogarithmic([0, 0, 5]), "a single bin has no others");
});
