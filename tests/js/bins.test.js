// Histograms of the demo page: which have logarithmic heights, and that no bin gets lost.
import assert from "node:assert/strict";
import { test } from "node:test";
import { histogramPath, isLogarithmic, SIZE } from "../../www/bins.js";

/** The heights of the bins, 0 to 1. */
function heights(volumes) {
  const places = histogramPath(volumes).replace("Z", "").slice(1).split("L").map((place) => place.split(" ").map(Number));
  const high = SIZE.height - 2 * SIZE.margin;
  // The first place and the last one are at the bottom; each bin has two.
  return places.slice(1, -1).filter((_, i) => i % 2 === 0).map(([, y]) => 1 - (y - SIZE.margin) / high);
}

test("heights are square roots", () => {
  assert.ok(!isLogarithmic([1, 4, 2, 1]));
  assert.deepEqual(heights([1, 4, 0]).map((height) => Number(height.toFixed(3))), [0.5, 1, 0]);
});

test("where one bin is much larger than most, heights are logarithms, and all others are seen", () => {
  const volumes = [1e6, 10, 300, 1, 0, 40];
  assert.ok(isLogarithmic(volumes));
  const [first, ten, more, one, none] = heights(volumes);
  assert.ok(first === 1 && more > ten && ten >= one && one > 0.01 && none === 0, String(heights(volumes)));
  assert.ok(more > 4 * Math.sqrt(300 / 1e6), "higher than a square root");
});

test("nothing is drawn of nothing", () => {
  assert.equal(histogramPath([]), "");
  assert.equal(histogramPath([0, 0]), "");
  assert.ok(!isLogarithmic([0, 0, 5]), "a single bin has no others");
});
