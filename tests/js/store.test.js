// Promise: the parts of the demo page see one state. Whoever is told of a change sees all of it, and is told once.
import assert from "node:assert/strict";
import { test } from "node:test";
import { Store } from "../../www/store.js";

const numbers = () => new Store({ a: 1, b: 2, c: 3 });

test("who uses a value is told of another one, once all have changed", () => {
  const store = numbers();
  const told = [];
  store.subscribe(["a", "b"], () => told.push(["ab", { ...store.state }]));
  store.subscribe(["c"], () => told.push(["c"]));
  store.subscribe(undefined, () => told.push(["any"]));
  store.change({ a: 1 });
  assert.deepEqual(told, [], "it is the same value");
  store.change({ a: 5, b: 6 });
  assert.deepEqual(told, [["ab", { a: 5, b: 6, c: 3 }], ["any"]]);
  told.length = 0;
  store.replace({ c: 3 });
  assert.deepEqual(
    told.map(([name]) => name),
    ["ab", "c", "any"],
    "what the values are of is another",
  );
});

test("changes by who is told come after what waits already, and each is told of the last state", () => {
  const store = numbers();
  const seen = [];
  store.subscribe(["a"], () => store.change({ b: store.state.a + 1 }));
  store.subscribe(["a", "b"], () => seen.push([store.state.a, store.state.b]));
  store.subscribe(["b"], () => store.change({ c: store.state.b + 1 }));
  store.change({ a: 10 });
  assert.deepEqual(seen, [[10, 11]]);
  assert.deepEqual(store.state, { a: 10, b: 11, c: 12 });
});

test("values that do not fit each other are never seen", () => {
  const store = new Store({ most: 3, at: 0 }, (state) => ({ ...state, at: Math.min(state.at, state.most) }));
  store.subscribe(undefined, () => assert.ok(store.state.at <= store.state.most));
  store.change({ at: 9 });
  assert.equal(store.state.at, 3);
  store.change({ most: 1 });
  assert.equal(store.state.at, 1);
});

test("an error of who is told keeps no other from being told later", () => {
  const store = numbers();
  let told = 0;
  store.subscribe(["a"], () => assert.fail("broken"));
  store.subscribe(["a"], () => told++);
  assert.throws(() => store.change({ a: 2 }), /broken/);
  assert.equal(store.state.a, 2);
  assert.throws(() => store.change({ a: 3 }), /broken/);
  store.change({ b: 7 });
  assert.equal(told, 1);
});
