// Calls that replace each other: what the viewer sends to its worker.
import assert from "node:assert/strict";
import { test } from "node:test";
import { Latest, mergeUpdates } from "../../pkg/latest.js";

/** A `run` whose calls are settled by hand. */
function byHand() {
  const calls = [];
  const run = (value) => new Promise((resolve, reject) => calls.push({ value, resolve, reject }));
  return { calls, run };
}

const soon = () => new Promise((resolve) => setImmediate(resolve));

test("one call is under way, one waits, and the last one wins", async () => {
  const { calls, run } = byHand();
  const latest = new Latest(run);
  const answers = [1, 2, 3, 4].map((value) => latest.call(value));
  assert.deepEqual(
    calls.map((call) => call.value),
    [1],
  );
  calls[0].resolve("one");
  assert.equal(await answers[0], "one");
  await soon();
  assert.deepEqual(
    calls.map((call) => call.value),
    [1, 4],
  );
  calls[1].resolve("four");
  assert.deepEqual(await Promise.all(answers.slice(1)), ["four", "four", "four"]);
  const later = latest.call(5);
  calls[2].resolve("five");
  assert.equal(await later, "five");
});

test("a call that fails does not stop the ones after it", async () => {
  const { calls, run } = byHand();
  const latest = new Latest(run);
  const [bad, good] = [latest.call("bad"), latest.call("good")];
  calls[0].reject(new Error("no"));
  await assert.rejects(bad, /no/);
  await soon();
  calls[1].resolve("yes");
  assert.equal(await good, "yes");
});

test("it is idle when nothing runs and nothing waits", async () => {
  const { calls, run } = byHand();
  const latest = new Latest(run);
  await latest.idle();
  const bad = latest.call("bad");
  latest.call("good");
  let idle = false;
  latest.idle().then(() => (idle = true));
  calls[0].reject(new Error("no"));
  await assert.rejects(bad, /no/);
  await soon();
  assert.deepEqual([idle, calls.map((call) => call.value)], [false, ["bad", "good"]]);
  calls[1].resolve("yes");
  await soon();
  assert.ok(idle);
});

/** Of updates in plain JavaScript, whose lists have no lengths. */
const merged = (/** @type {any} */ a, /** @type {any} */ b) => mergeUpdates(a, b);

test("movements that wait add up, changes of the scene stay apart; of everything else the later one counts", () => {
  const sets = [
    { id: 0, changes: { volume: {} } },
    { id: 1, changes: { slices: [] } },
  ];
  const a = { orbit: [1, 2], zoom: [2, 0, 0], sets: sets.slice(0, 1), size: [4, 5, 1] };
  const b = { orbit: [10, 20], pan: [5, 6], zoom: [0.25, 0.1, 0.2], sets: sets.slice(1) };
  assert.deepEqual(merged(a, b), {
    ...{ orbit: [11, 22], pan: [5, 6], zoom: [0.5, 0.1, 0.2] },
    ...{ sets, size: [4, 5, 1] },
  });
  assert.deepEqual(merged({ pan: [1, 1] }, { pan: [2, 3], size: [4, 5, 1] }), { pan: [3, 4], size: [4, 5, 1] });
});

test("going home forgets the movements before it and keeps those after it", () => {
  const sets = [{ id: 0, changes: {} }];
  const home = merged({ orbit: [1, 1], zoom: [3, 0, 0], sets }, { home: true });
  assert.deepEqual(home, { sets, home: true });
  assert.deepEqual(merged(home, { orbit: [2, 0] }), { sets, home: true, orbit: [2, 0] });
  const camera = { target: [0, 0, 0], distance: 1, yaw: 0, pitch: 0, projection: "perspective" };
  const set = { id: 1, changes: {}, camera };
  assert.deepEqual(merged({ look: [1, 0], fly: [0, 0, 1] }, { sets: [set] }), { sets: [set] });
  assert.deepEqual(merged({ sets: [set] }, { home: true }), { sets: [{ id: 1, changes: {} }], home: true });
});
