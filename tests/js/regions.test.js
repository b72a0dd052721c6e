// Regions of a file: what is known of them, and requests for some of them alone.
import assert from "node:assert/strict";
import { readFile } from "node:fs/promises";
import { after, before, test } from "node:test";
import { MultiTessellation } from "../../pkg/index.js";

const folder = process.env.TETRALOD_FIXTURE;
assert.ok(folder, "TETRALOD_FIXTURE is not set: run `cargo xtask test js`");
const file = await readFile(`${folder}/parts.mt`);

/** @type {MultiTessellation} */
let mt;

before(async () => {
  mt = await MultiTessellation.open(file);
});

after(() => mt.free());

test("the regions of a file are listed, and make up all of it", () => {
  const { regions, tetrahedra, bounds } = mt.info;
  assert.ok(regions);
  assert.deepEqual([regions.arrays, regions.deviation, regions.all.length], [["part"], 0, 12]);
  assert.deepEqual(
    regions.all.map(({ name, labels }) => [name, labels]),
    Array.from({ length: 12 }, (_, i) => [String(i + 1), [i + 1]]),
  );
  assert.equal(
    regions.all.reduce((sum, region) => sum + region.tetrahedra, 0),
    tetrahedra,
  );
  for (const { volume, color, bounds: own } of regions.all) {
    assert.ok(volume > 0 && /^#[0-9a-f]{6}$/.test(color));
    assert.ok([0, 1, 2].every((k) => own[k] >= bounds[k] && own[k] < own[k + 3] && own[k + 3] <= bounds[k + 3]));
  }
  assert.equal(new Set(regions.all.map(({ color }) => color)).size, 12);
});

test("a request for a region is coarse elsewhere, and one for all is one without regions", async () => {
  const whole = await mt.refine({ error: 0 });
  const [byName, byLabel] = [await mt.refine({ error: 0, regions: ["2"] }), await mt.refine({ error: 0, regions: [2] })];
  assert.ok(byName.stats.satisfied && byName.stats.tetrahedra < whole.stats.tetrahedra);
  assert.deepEqual(byName.tets, byLabel.tets);
  const needs = [
    { error: 0, regions: ["2"] },
    { error: "1%", regions: ["3", "4"] },
  ];
  const both = await mt.refine({ needs });
  assert.ok(both.stats.tetrahedra > byName.stats.tetrahedra && both.stats.tetrahedra < whole.stats.tetrahedra);
  const names = mt.info.regions?.all.map(({ name }) => name);
  const all = await mt.refine({ error: 0, regions: names });
  assert.equal(all.stats.tetrahedra, whole.stats.tetrahedra);
});

test("statistics are told of each region, and add up", async () => {
  await mt.refine({
    needs: [
      { error: "1%", regions: ["2"] },
      { error: "20%", field: "temperature" },
    ],
  });
  const { regions, volume, integral, min, max } = await mt.stats({ bins: 1 });
  assert.ok(regions);
  assert.deepEqual(
    regions.map(({ name }) => name),
    mt.info.regions?.all.map(({ name }) => name),
  );
  const sum = (key) => regions.reduce((all, region) => all + region[key], 0);
  assert.ok(Math.abs(sum("volume") / volume - 1) < 1e-12 && Math.abs(sum("integral") / integral - 1) < 1e-12);
  assert.deepEqual([Math.min(...regions.map((region) => region.min)), Math.max(...regions.map((region) => region.max))], [min, max]);
  const [{ min: low, max: high }] = mt.info.fields;
  const errors = regions.map(({ errorBound }) => errorBound / (high - low));
  assert.ok(errors[1] <= 0.01 && errors.every((error) => error <= 0.2) && Math.max(...errors) > 0.01, String(errors));
  for (const { tetrahedra, mean, deviation } of regions) assert.ok(tetrahedra > 0 && mean >= min && mean <= max && deviation >= 0);
});

test("what is no region is refused by its name", async () => {
  const refused = (regions) => ({ code: "bad-option", message: new RegExp(regions) });
  await assert.rejects(mt.refine({ error: 0, regions: ["stator"] }), refused("regions.*no region stator, only 1, 2, 3"));
  await assert.rejects(mt.refine({ needs: [{ regions: [2] }, { regions: [13] }] }), refused("needs\\[1\\].*no region 13"));
  for (const number of [2.7, Number.NaN, Number.POSITIVE_INFINITY]) {
    await assert.rejects(mt.refine({ regions: [number] }), refused("list of names or labels"));
  }
  // @ts-expect-error: it is no list
  await assert.rejects(mt.refine({ regions: "2" }), refused("list of names or labels"));
  const plain = await MultiTessellation.open(await readFile(`${folder}/fields.mt`));
  assert.equal(plain.info.regions, undefined);
  await assert.rejects(plain.refine({ regions: [2] }), refused("no region 2"));
  plain.free();
});
