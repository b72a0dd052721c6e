// Promise: what of a scene fits another volume is kept, and what does not is named.
import assert from "node:assert/strict";
import { test } from "node:test";
import { changedScene, checkNames, fitScene, namesParts, withoutParts } from "../../pkg/fit.js";

const volume = {
  surfaceFirst: true,
  fields: [
    { name: "p", min: -1, max: 1 },
    { name: "u", min: 0, max: 4 },
    { name: "u", min: 2, max: 6 },
  ],
  bounds: [0, 0, 0, 1, 1, 2],
};

/** Of scenes in plain JavaScript, whose lists have no lengths. */
const fit = (/** @type {any} */ scene) => fitScene(scene, volume);
const parts = (scene) => fit(scene).dropped.map(({ part }) => part);

test("of a label nothing is kept that needs values between two", () => {
  const fields = [...volume.fields, { name: "m", min: 1, max: 4, isLabel: true }];
  /** @type {any} */
  const scene = {
    isosurfaces: [{ value: 2 }],
    volume: {},
    threshold: { range: [1, 2], cut: true },
    slices: [{ normal: [0, 0, 1], offset: 1 }],
    streamlines: { fields: ["p", "u", "u"], field: "m" },
  };
  const of = (/** @type {string} */ shown) => fitScene(scene, { ...volume, fields }, shown);
  const { scene: left, dropped } = of("m");
  assert.deepEqual(dropped.map(({ part }) => part).sort(), ["isosurfaces[0]", "streamlines.field", "threshold", "volume"]);
  assert.deepEqual(left, { isosurfaces: [], slices: scene.slices, streamlines: { fields: ["p", "u", "u"] } });
  assert.deepEqual(
    of("u").dropped.map(({ part }) => part),
    ["streamlines.field"],
  );
});

test("what fits stays as it is", () => {
  const scene = {
    isosurfaces: [{ value: 0.5, field: "u" }, { value: 5.5 }, {}],
    slices: [{ normal: [0, 0, 2], offset: 2, field: "p" }],
    volume: {
      opacities: [
        [-3, 0],
        [0, 0.5],
      ],
      unitLength: 0.1,
    },
    clips: [{ normal: [1, 0, 0], offset: 7 }],
    clipBox: [0.5, 0.5, 0.5, 9, 9, 9],
    streamlines: { fields: ["u", "u", "p"], seeds: [[0.5, 0.5, 1.5]], field: "p", radius: 0.01 },
    arrows: { fields: ["u", "u", "u"], spacing: 0.2 },
    cells: { cut: { normal: [0, 1, 0], offset: 0.5 } },
    colours: { range: [-5, 0], map: "grey" },
    background: "light",
  };
  assert.deepEqual(fit(scene), { scene, dropped: [], isFirst: false });
});

test("fields that the volume does not have go, with what needs them", () => {
  const flow = { fields: ["vx", "vy", "vz"], seeds: [[0, 0, 0]] };
  const { scene, dropped } = fit({ slices: [{ normal: [0, 0, 1], offset: 1, field: "T" }], streamlines: flow, arrows: { fields: flow.fields } });
  assert.deepEqual(scene, { slices: [{ normal: [0, 0, 1], offset: 1 }] });
  assert.deepEqual(
    dropped.map(({ part }) => part),
    ["slices[0].field", "streamlines", "arrows"],
  );
  assert.equal(dropped[1].problem, 'there is no field "vx"; this volume has: p, u');
  const coloured = fit({ isosurfaces: [{ value: 0, field: "T" }], streamlines: { ...flow, fields: ["u", "u", "u"], field: "T" } });
  assert.deepEqual(coloured.scene.isosurfaces, [{ value: 0 }]);
  assert.equal(coloured.scene.streamlines.field, undefined);
});

test("regions that the volume does not have go, and those that it has stay", () => {
  const regions = {
    arrays: ["part"],
    deviation: 0,
    all: [
      { name: "hub", labels: [2] },
      { name: "7", labels: [7] },
    ],
  };
  const scene = { boundary: {}, regions: ["hub", 7, 2] };
  assert.deepEqual(fitScene(scene, { ...volume, regions }), { scene, dropped: [], isFirst: false });
  for (const of of [{ ...volume, regions: { ...regions, all: [] } }, volume]) {
    const { scene: fitted, dropped } = fitScene(scene, of);
    assert.deepEqual(fitted, { boundary: {} });
    assert.ok(dropped.length === 1 && dropped[0].part === "regions" && /no region "hub"/.test(dropped[0].problem));
    assert.throws(() => checkNames(scene, of), { code: "bad-option", message: /regions.*no region "hub"/ });
  }
  checkNames(scene, { ...volume, regions });
});

test("opacities of regions that the volume does not have go", () => {
  const regions = { all: [{ name: "hub", labels: [2] }] };
  for (const [regionOpacities, stays] of /** @type {const} */ ([
    [{ hub: 0.2 }, true],
    [{ 2: 0.2 }, true],
    [{ hub: 0.2, casing: 0.5 }, false],
  ])) {
    const scene = { boundary: { opacity: 0.5, regionOpacities } };
    const { scene: fitted, dropped } = fitScene(scene, { ...volume, regions });
    assert.deepEqual(fitted, stays ? scene : { boundary: { opacity: 0.5 } });
    assert.deepEqual(
      dropped.map(({ part }) => part),
      stays ? [] : ["boundary.regionOpacities"],
    );
    if (stays) checkNames(scene, { ...volume, regions });
    else assert.throws(() => checkNames(scene, { ...volume, regions }), { code: "bad-option", message: /boundary\.regionOpacities.*no region "casing"/ });
  }
});

test("a threshold stays where the volume has its field and a value in its range", () => {
  for (const threshold of [{ range: [0, 0.5], field: "p" }, { range: [5, 9] }]) {
    const scene = /** @type {any} */ ({ boundary: {}, threshold });
    assert.deepEqual(fit(scene), { scene, dropped: [], isFirst: false });
    checkNames(scene, volume);
  }
  const none = /** @type {any} */ ({ boundary: {}, threshold: { range: [0, 1], field: "w" } });
  assert.throws(() => checkNames(none, volume), { code: "bad-option", message: /threshold\.field.*no field "w"/ });
  for (const scene of [none, { boundary: {}, threshold: { range: [7, 8] } }])
    assert.deepEqual([fit(scene).scene, parts(scene)], [{ boundary: {} }, ["threshold"]]);
});

test("a vector that displaces is one of the file, by its name or by three fields", () => {
  const part = (name, component) => ({ name, min: -1, max: 1, vector: { name: "disp", component } });
  const volume = {
    surfaceFirst: false,
    bounds: [0, 0, 0, 1, 1, 1],
    fields: [part("a", 0), part("b", 1), part("c", 2), ...["v_x", "v_y", "v_z", "p"].map((name) => ({ name, min: 0, max: 1 }))],
  };
  for (const field of ["disp", "v", "p,a,v_x"]) {
    const scene = { boundary: {}, deform: { field } };
    assert.deepEqual(fitScene(scene, volume), { scene, dropped: [], isFirst: false });
    checkNames(scene, volume);
  }
  for (const field of ["p", "a", "w", "p,a", "p,a,w", "p,a,b,c"]) {
    const scene = { boundary: {}, deform: { field } };
    const { scene: fitted, dropped } = fitScene(scene, volume);
    assert.deepEqual([fitted, dropped.map(({ part }) => part)], [{ boundary: {} }, ["deform"]]);
    assert.throws(() => checkNames(scene, volume), { code: "bad-option", message: /deform\.field/ });
  }
});

test("values, planes, boxes, points and lengths of another volume go", () => {
  assert.deepEqual(parts({ isosurfaces: [{ value: 300 }, { value: 3 }] }), ["isosurfaces[0].value"]);
  assert.deepEqual(
    parts({
      volume: {
        opacities: [
          [300, 0],
          [400, 1],
        ],
        unitLength: 1e9,
      },
    }),
    ["volume.opacities", "volume.unitLength"],
  );
  assert.deepEqual(parts({ volume: { points: [[300, 0, 0, 0, 1]] } }), ["volume.points"]);
  assert.deepEqual(parts({ isosurfaces: [{}], colours: { range: [300, 400], map: "grey" } }), ["colours.range"]);
  assert.deepEqual(
    parts({
      slices: [
        { normal: [0, 0, 1], offset: 3 },
        { normal: [1, 1, 0], offset: 1.9 },
      ],
    }),
    ["slices[0]"],
  );
  assert.deepEqual(
    parts({
      boundary: {},
      clips: [
        { normal: [1, 0, 0], offset: -1 },
        { normal: [-1, 0, 0], offset: 0 },
      ],
    }),
    ["clips[0]"],
  );
  assert.deepEqual(parts({ cells: { cut: { normal: [0, 0, -1], offset: -5 } } }), ["cells.cut"]);
  assert.deepEqual(parts({ boundary: {}, clipBox: [5, 5, 5, 6, 6, 6], region: [0, 0, 3, 1, 1, 4] }), ["clipBox", "region"]);
  const seeds = [
    [0, 0, 0],
    [0, 0, 9],
  ];
  assert.deepEqual(fit({ streamlines: { fields: ["u", "u", "u"], seeds } }).scene.streamlines.seeds, [[0, 0, 0]]);
});

test("where nothing is named or left, there is the isosurface of a box, and the boundary of all else", () => {
  const part = { ...volume, surfaceFirst: false };
  assert.deepEqual(fit({ outline: false }), { scene: { outline: false, isosurfaces: [{}] }, dropped: [], isFirst: true });
  assert.deepEqual(fitScene({ outline: false }, part), { scene: { outline: false, boundary: {} }, dropped: [], isFirst: true });
  assert.ok(namesParts({ volume: null }) && !namesParts({ outline: true, colours: {} }));
  assert.deepEqual(withoutParts({ outline: false, boundary: {}, slices: [] }), { outline: false });
  const flow = { fields: ["vx", "vy", "vz"], seeds: [] };
  assert.deepEqual(fit({ isosurfaces: [], streamlines: flow, outline: false }).scene, { isosurfaces: [{}], outline: false });
  assert.deepEqual(fit({ isosurfaces: [] }).scene, { isosurfaces: [] }, "an empty picture that was wanted");
});

test("changes that name a field which is not there are refused", () => {
  const named = (scene) => () => checkNames(scene, volume);
  for (const scene of [
    { isosurfaces: [{}, { field: "T" }] },
    { slices: [{ normal: [0, 0, 1], offset: 0, field: "T" }] },
    { streamlines: { fields: ["u", "u", "T"], seeds: [] } },
    { arrows: { fields: ["u", "u", "u"], field: "T" } },
  ])
    assert.throws(named(scene), { code: "bad-option", message: /there is no field "T"; this volume has: p, u$/ });
  named({ isosurfaces: [{ field: "u" }, { field: null }], arrows: null })();
  assert.deepEqual(changedScene({ volume: {}, slices: [] }, { volume: null, cells: {} }), { slices: [], cells: {} });
});
