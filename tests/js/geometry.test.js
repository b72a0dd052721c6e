// Planes of the demo page: where they meet the model's box, and how they turn.
import assert from "node:assert/strict";
import { test } from "node:test";
import { across, centreOf, cross, dot, leavesNothing, outline, turned, unit } from "../../www/geometry.js";

const BOX = [0, -1, 2, 4, 1, 3];
const near = (found, wanted) => {
  assert.equal(found.length, wanted.length);
  found.forEach((x, i) => assert.ok(Math.abs(x - wanted[i]) < 1e-12, `${found} is not ${wanted}`));
};

test("a plane across an axis meets the box in a rectangle, at its ends, too", () => {
  for (const at of [-1, 0.25, 1]) {
    const corners = outline([0, 1, 0], at, BOX);
    assert.equal(new Set(corners.map(String)).size, 4);
    for (const [x, y, z] of corners) assert.ok([0, 4].includes(x) && y === at && [2, 3].includes(z));
    near(centreOf(corners), [2, at, 2.5]);
  }
  assert.deepEqual(outline([0, 1, 0], 1.5, BOX), []);
});

test("an oblique plane meets a cube in a hexagon, whose corners go around", () => {
  const normal = unit([1, 1, 1]);
  const corners = outline(normal, Math.sqrt(3) / 2, [0, 0, 0, 1, 1, 1]);
  assert.equal(corners.length, 6);
  corners.forEach((corner, i) => {
    const next = corners[(i + 1) % 6];
    near([Math.hypot(...next.map((x, k) => x - corner[k]))], [Math.SQRT1_2]);
  });
  near(centreOf(corners), [0.5, 0.5, 0.5]);
  // Where it touches a corner, that is all there is of it.
  near(centreOf(outline(normal, 0, [0, 0, 0, 1, 1, 1])), [0, 0, 0]);
});

test("directions across a normal are those of the next axes, or across each other", () => {
  assert.deepEqual(across([0, 1, 0]), [
    [0, 0, 1],
    [1, 0, 0],
  ]);
  const normal = unit([1, -3, 2]);
  const [first, second] = across(normal);
  near([dot(first, normal), dot(second, normal), dot(first, second)], [0, 0, 0]);
  near(cross(first, second), normal);
});

test("a vector turns around an axis", () => {
  near(turned([1, 0, 5], [0, 0, 1], Math.PI / 2), [0, 1, 5]);
  near(turned([1, 2, 3], unit([1, 1, 1]), (2 * Math.PI) / 3), [3, 1, 2]);
});

test("planes leave nothing of a box where no corner is behind all of them", () => {
  const behind = (normal, offset) => ({ normal, offset });
  assert.ok(!leavesNothing([], BOX));
  assert.ok(!leavesNothing([behind([0, -1, 0], -0.5), behind(unit([1, 1, 0]), 0.5)], BOX));
  assert.ok(leavesNothing([behind([0, -1, 0], -0.5), behind([0, 1, 0], 0.4)], BOX));
  assert.ok(!leavesNothing([behind([0, -1, 0], -0.5), behind([0, 1, 0], 0.6)], BOX));
  // Three, of which any two leave something.
  const three = [behind([-1, 0, 0], -2), behind([0, -1, 0], -0.5), behind(unit([1, 4, 0]), 0.9)];
  assert.ok(leavesNothing(three, BOX));
  for (const one of three)
    assert.ok(
      !leavesNothing(
        three.filter((other) => other !== one),
        BOX,
      ),
    );
});
