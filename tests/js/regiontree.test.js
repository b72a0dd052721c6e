// Parts of the demo page: names with steps are a tree, in which each has its place once.
import assert from "node:assert/strict";
import { test } from "node:test";
import { nodesOf, treeOf } from "../../www/regiontree.js";

/** Labels, with those of children in brackets. */
const drawn = (nodes) => nodes.map(({ label, children }) => (children.length > 0 ? `${label}[${drawn(children)}]` : label)).join(" ");

test("flat names are a flat list, in their order", () => {
  const names = ["7", "hub", "casing"];
  const tree = treeOf(names);
  assert.deepEqual(
    tree.map(({ label, path, numbers }) => [label, path, numbers]),
    names.map((name, i) => [name, name, [i]]),
  );
  assert.deepEqual(treeOf([]), []);
});

test("steps are branches, those of one child alone are none, and each name is in it once", () => {
  const names = ["rotor/blade 1", "casing", "rotor/hub", "stator/vane/1", "rotor/blade 2", "stator/vane/2", "a/b/c", "rotor"];
  const tree = treeOf(names);
  assert.equal(drawn(tree), "rotor[blade 1 hub blade 2] casing stator/vane[1 2] a/b/c rotor");
  assert.deepEqual(tree[0].numbers, [0, 2, 4]);
  const nodes = nodesOf(tree);
  const leaves = nodes.filter(({ children }) => children.length === 0);
  assert.deepEqual(leaves.map(({ path }) => path).sort(), [...names].sort());
  for (const { path, numbers } of leaves) assert.deepEqual(numbers, [names.indexOf(path)]);
  assert.equal(new Set(nodes.map(({ path }) => path)).size, nodes.length, "paths tell nodes apart");
  for (const { children, numbers } of nodes.filter(({ children }) => children.length > 0)) {
    assert.deepEqual(children.flatMap((child) => child.numbers).sort(), [...numbers].sort());
  }
});

test("slashes without words between them are no steps", () => {
  assert.equal(drawn(treeOf(["/Root/a", "Root//b", "/", "c/"])), "Root[a b] / c");
});
