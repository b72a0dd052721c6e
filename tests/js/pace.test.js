// How finely a viewer draws while something moves, on a device whose times are given here: no clock takes part.
import assert from "node:assert/strict";
import { afterEach, beforeEach, mock, test } from "node:test";
import { Pace } from "../../pkg/viewer-pace.js";

const AT_REST = { isQuick: false, scale: 1 };
const { now } = performance;
let time = 0;

beforeEach(() => {
  performance.now = () => time;
  mock.timers.enable({ apis: ["setTimeout"] });
});
afterEach(() => {
  performance.now = now;
  mock.timers.reset();
});

/** A device whose pictures with all pixels take so long (in ms), and the pace of a viewer that draws with it. */
function device({ full, quick }, frameTime = 60) {
  const set = { ...AT_REST };
  const viewer = {
    inFlight: 0,
    setQuick: (isQuick) => void (set.isQuick = isQuick),
    setScale: (scale) => void (set.scale = scale),
  };
  const mesh = { tets: 1_000_000, held: undefined, hold: (most) => void (mesh.held = most) };
  const times = { full, quick };
  const pace = new Pace(/** @type {any} */ (viewer), /** @type {any} */ (mesh), frameTime, () => {});
  /** Draws a picture to its end, and gives how it was drawn. */
  const picture = () => {
    pace.began(time);
    time += set.isQuick ? times.quick * set.scale ** 2 : times.full;
    pace.observe();
    return { ...set };
  };
  /** The pictures of a movement, and then those at rest. */
  const movement = (count) => {
    const drawn = Array.from({ length: count }, () => {
      pace.move();
      return picture();
    });
    mock.timers.tick(1000);
    return [...drawn, picture()];
  };
  // The first one waits for pipelines, and the second one counts.
  const start = () => [picture(), picture()];
  return { times, mesh, movement, start };
}

test("a fast device draws as well as it can, also while something moves", () => {
  const { start, movement } = device({ full: 20, quick: 10 });
  start();
  assert.deepEqual(movement(5), Array(6).fill(AT_REST));
});

test("a slow device draws quickly while something moves, with all pixels where there is time for them, and well at rest", () => {
  const { start, movement } = device({ full: 170, quick: 50 });
  start();
  const drawn = movement(8);
  assert.deepEqual(drawn.at(-1), AT_REST);
  assert.ok(drawn.slice(0, -1).every(({ isQuick }) => isQuick));
  assert.equal(drawn.at(-2).scale, 1);
});

test("one that is slower still draws fewer pixels, as many as there is time for", () => {
  const { start, movement, mesh } = device({ full: 900, quick: 400 });
  start();
  const drawn = movement(8);
  assert.deepEqual(drawn.at(-2), { isQuick: true, scale: 0.35 });
  assert.equal(mesh.held, undefined);
});

test("the number of pixels is not changed to and fro", () => {
  // With all pixels a picture takes a little too long, with fewer a little less.
  for (const quick of [61, 65, 75, 100, 119, 121, 240]) {
    const { start, movement } = device({ full: 300, quick });
    start();
    const scales = movement(20)
      .slice(3, -1)
      .map(({ scale }) => scale);
    assert.deepEqual(new Set(scales).size, 1, `${quick} ms: ${scales}`);
  }
});

test("where the fewest pixels take too long, the mesh has fewer tetrahedra, and all at rest", () => {
  const { start, movement, mesh, times } = device({ full: 4000, quick: 4000 });
  start();
  const held = [];
  const { hold } = mesh;
  mesh.hold = (most) => {
    hold(most);
    held.push(most);
  };
  movement(8);
  assert.ok(
    held.some((most) => most < 500_000),
    String(held),
  );
  assert.equal(held.at(-1), undefined);
  times.full = 20;
  movement(1);
  assert.deepEqual(movement(3), Array(4).fill(AT_REST));
});

test("who wants no limit gets none", () => {
  const { start, movement } = device({ full: 4000, quick: 100 }, Infinity);
  start();
  assert.deepEqual(movement(4), Array(5).fill(AT_REST));
});
