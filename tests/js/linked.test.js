// Promise: a second file is shown with what the first one is, as far as it has it, and what it does not have is named.
import assert from "node:assert/strict";
import { test } from "node:test";
import { linkedRequest, linkedScene, numberIn } from "../../www/linked.js";

const field = (name, min, max, time) => ({ name, min, max, time });
const region = (name) => ({ name, labels: [1] });
/** Two files as far as this is concerned. @type {any} */
const HERE = {
  fields: [field("p", 0, 10, 0), field("p", 0, 20, 1), field("T", -1, 1, 0), field("u", 0, 1, 0), field("v", 0, 1, 0), field("w", 0, 1, 0)],
  regions: { all: ["rotor", "stator", "casing"].map(region) },
};
/** @type {any} */
const THERE = { fields: [field("T", 0, 4, 0), field("p", 0, 2, 0.2), field("p", 0, 8, 0.9)], regions: { all: ["rotor", "casing", "fan"].map(region) } };

test("a field is found by its name, at the time that is nearest", () => {
  assert.equal(numberIn(THERE, HERE.fields[0]), 1);
  assert.equal(numberIn(THERE, HERE.fields[1]), 2);
  assert.equal(numberIn(THERE, HERE.fields[3]), undefined);
});

test("a scene keeps all but what names fields and regions that are not there", () => {
  const planes = [{ normal: [1, 0, 0], offset: 0.5 }];
  /** @type {any} */
  const scene = {
    isosurfaces: [
      { value: 3, field: "T" },
      { value: 3, field: "u" },
    ],
    clips: planes,
    streamlines: { fields: ["u", "v", "w"], seeds: [[0, 0, 0]] },
    arrows: null,
    boundary: { opacity: 0.5, regionOpacities: { rotor: 0.2, stator: 0.3 } },
    colours: { map: "magma", range: [1, 2] },
    regions: ["rotor", "stator"],
    deform: { field: "u,v,w" },
    compare: { at: 0.5 },
  };
  const { scene: linked, missing } = linkedScene(scene, "p", HERE, THERE);
  assert.deepEqual(linked, {
    ...scene,
    isosurfaces: [{ value: 3, field: "T" }, { value: 3 }],
    streamlines: null,
    boundary: { opacity: 0.5, regionOpacities: { rotor: 0.2 } },
    regions: ["rotor", "fan"],
    deform: null,
    compare: null,
  });
  assert.deepEqual(missing.sort(), ["u", "v", "w"]);
  // Without the field, where the model is.
  const without = linkedScene(scene, "u", HERE, THERE);
  assert.deepEqual(without.missing, ["u"]);
  assert.deepEqual([without.scene.isosurfaces, without.scene.streamlines, without.scene.clips], [[], null, planes]);
  assert.ok(without.scene.boundary);
});

test("a request asks for the same errors, in units of the field, in the same places", () => {
  const box = [0, 0, 0, 1, 1, 1];
  const view = { pixels: 2 };
  const request = { error: "5%", field: 1, maxTets: 100, box, needs: [{ view }, { error: "1%", field: 3 }, { error: "10%", field: 0, isovalues: [2] }] };
  assert.deepEqual(linkedRequest(/** @type {any} */ (request), HERE, THERE), {
    error: 1,
    field: 2,
    maxTets: 100,
    box,
    needs: [{ view }, { error: 1, field: 1, isovalues: [2] }],
  });
  // In regions, those that are there; without the field or any of them, something coarse.
  /** @type {any} */
  const parts = { error: "50%", field: 2, maxTets: undefined, regions: ["rotor", "stator"] };
  assert.deepEqual(linkedRequest(parts, HERE, THERE), { error: 1, field: 0, maxTets: undefined, regions: ["rotor"] });
  for (const none of [
    { ...parts, regions: ["stator"] },
    { ...parts, field: 4 },
  ])
    assert.deepEqual(linkedRequest(none, HERE, THERE), { error: "5%", maxTets: undefined });
});
