// Requests in full, steps and deltas of the built package in Node, on the small MT that `cargo xtask test` makes.
import assert from "node:assert/strict";
import { readFile, writeFile } from "node:fs/promises";
import { describe, test } from "node:test";
import { pathToFileURL } from "node:url";
import { MultiTessellation, TetralodError, applyChanges, emptyMesh } from "../../pkg/index.js";

const folder = process.env.TETRALOD_FIXTURE;
assert.ok(folder, "TETRALOD_FIXTURE is not set: run `cargo xtask test js`");
const bytes = new Uint8Array(await readFile(`${folder}/small.mt`));
const KINDS = ["small", "small-edge", "small-vertex"];

const refuses = (promise, name, message = /./) =>
  assert.rejects(promise, (error) => {
    assert.ok(error instanceof TetralodError, String(error));
    assert.equal(error.code, "bad-option", error.message);
    assert.ok(error.message.includes(`\`${name}\``), `${error.message} names \`${name}\``);
    assert.match(error.message, message);
    return true;
  });

/** A camera in front of the unit cube as a matrix: 90 degrees, looking along +z from (0.5, 0.5, -distance). */
const camera = (distance) => [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 1, -0.5, -0.5, distance, distance];

const VIEW = { matrix: camera(1), viewport: [800, 800], pixels: 2 };

/**
 * What can be asked for, each with what it may be called.
 *
 * @type {Record<string, import("../../pkg/index.js").RefineOptions>}
 */
const REQUESTS = {
  "two needs": { error: "5%", needs: [{ error: "1%", sphere: { center: [0.2, 0.2, 0.2], radius: 0.2 } }] },
  "an oriented box": {
    orientedBox: {
      center: [0.5, 0.5, 0.5],
      halfAxes: [
        [0.1, 0.1, 0],
        [-0.1, 0.1, 0],
        [0, 0, 0.2],
      ],
    },
  },
  "a half-space": { error: "1%", halfSpace: { normal: [1, 1, 0], offset: 0.5 } },
  "a slab": { error: "1%", slab: { normal: [0, 0, 1], offset: 0.5, thickness: 0.01 } },
  "planes": {
    error: "1%",
    planes: [
      [1, 0, 0, 0.3],
      [0, 1, 0, 0.3],
    ],
  },
  "ranges": {
    error: "1%",
    ranges: [
      [0.2, 0.3],
      [0.6, 0.7],
    ],
  },
  "a view": { view: VIEW },
  "a view with an outside": { view: { ...VIEW, pixels: 1, outside: "5%" } },
  "a transfer function": {
    error: 0.05,
    transfer: {
      points: [
        [0.2, 0, 0, 0, 0],
        [0.6, 1, 0, 0, 0.5],
      ],
      unitLength: 0.2,
    },
  },
  "budgets": { error: 0, maxVertices: 900 },
  "bytes": { error: 0, maxBytes: 100_000 },
  "a little": { error: "50%" },
};

const raw = ({ buffer, byteOffset, byteLength }) => Buffer.from(buffer, byteOffset, byteLength);
const same = (a, b) => a.length === b.length && raw(a).equals(raw(b));

for (const worker of [true, false]) {
  describe(worker ? "in a worker" : "in the caller's thread", () => {
    const open = async (file = bytes) => {
      const mt = await MultiTessellation.open(file, { worker });
      await mt.complete;
      return mt;
    };

    test("every kind of need is met, and the answer has no memory of others", async () => {
      const mt = await open();
      const hashes = {};
      const sizes = {};
      for (const order of [Object.entries(REQUESTS), Object.entries(REQUESTS).reverse()]) {
        for (const [name, options] of order) {
          const { stats } = await mt.refine(options);
          const hash = await mt.hash();
          assert.equal(hashes[name] ?? hash, hash, name);
          hashes[name] = hash;
          sizes[name] = stats.tetrahedra;
          assert.ok(stats.done && stats.judged >= 0 && stats.forced <= stats.refined, name);
          const budgeted = name === "budgets" || name === "bytes";
          assert.equal(stats.satisfied, !budgeted, name);
          assert.equal(stats.excess <= 1, stats.satisfied, name);
          assert.ok(stats.tetrahedra < mt.info.tetrahedra, name);
        }
      }
      assert.ok(Object.values(sizes).filter((size) => size > sizes["a little"]).length >= 10, JSON.stringify(sizes));
      mt.free();
    });

    test("each need has its bound, in its own unit", async () => {
      const mt = await open();
      const { min, max } = mt.info.fields[0];
      const needs = [{ error: "1%", box: [0, 0, 0, 0.2, 0.2, 0.2] }, { view: { ...VIEW, outside: "10%" } }];
      const { stats } = await mt.refine({ error: 0.5, needs });
      assert.equal(stats.bounds.length, 4);
      const wanted = [0.5, 0.01 * (max - min), VIEW.pixels, 0.1 * (max - min)];
      stats.bounds.forEach((bound, i) => assert.ok(bound <= wanted[i] * (1 + 1e-9), `${bound} <= ${wanted[i]}`));
      const tight = await mt.refine({ error: 0, needs, maxTets: 2000 });
      assert.ok(tight.tets.length <= 8000 && !tight.stats.satisfied && tight.stats.excess > 1);
      assert.ok(tight.stats.bounds[0] > 0);
      mt.free();
    });

    test("budgets of all kinds are kept", async () => {
      const mt = await open();
      const { stats: vertices } = await mt.refine({ maxVertices: 700 });
      assert.ok(vertices.vertices <= 700 && vertices.vertices > 350);
      const { stats: size } = await mt.refine({ maxBytes: 150_000 });
      const held = 32 * size.tetrahedra + 16 * size.vertices;
      assert.ok(held <= 150_000 && held > 75_000);
      mt.free();
    });

    test("what three.js has can be handed over as it is", async () => {
      const mt = await open();
      const hashes = [];
      for (const options of [
        { view: { ...VIEW, matrix: { elements: camera(1) } }, needs: [{ box: { min: { x: 0, y: 0, z: 0 }, max: { x: 0.3, y: 1, z: 1 } } }] },
        { view: { ...VIEW, matrix: new Float32Array(camera(1)) }, needs: [{ box: [0, 0, 0, 0.3, 1, 1] }] },
      ]) {
        await mt.refine(options);
        hashes.push(await mt.hash());
      }
      assert.equal(hashes[0], hashes[1]);
      await mt.refine({ error: "1%", sphere: { center: { x: 0.5, y: 0.5, z: 0.5 }, radius: 0.3 } });
      const ball = await mt.hash();
      await mt.refine({ error: "1%", sphere: { center: new Float64Array([0.5, 0.5, 0.5]), radius: 0.3 } });
      assert.equal(await mt.hash(), ball);
      mt.free();
    });

    test("what makes no sense is refused by name", async () => {
      const mt = await open();
      for (const [options, name] of [
        [{ needs: 7 }, "needs"],
        [{ needs: [{ eror: 1 }] }, "needs[0].eror"],
        [{ needs: [{}, 7] }, "needs[1]"],
        [{ needs: [{ needs: [] }] }, "needs[0].needs"],
        [{ needs: [{ field: "none" }] }, "needs[0].field"],
        [{ sphere: { center: [0, 0], radius: 1 } }, "sphere.center"],
        [{ sphere: { center: [0, 0, 0] } }, "sphere.radius"],
        [{ sphere: { center: [0, 0, 0], radius: -1 } }, "sphere"],
        [{ sphere: { centre: [0, 0, 0], radius: 1 } }, "sphere.centre"],
        [{ sphere: [0, 0, 0, 1] }, "sphere"],
        [{ box: [0, 0, 0, 1, 1, 1], sphere: { center: [0, 0, 0], radius: 1 } }, "sphere"],
        [{ orientedBox: { center: [0, 0, 0], halfAxes: [1, 0, 0] } }, "orientedBox.halfAxes"],
        [{ halfSpace: { normal: [0, 0, 0], offset: 1 } }, "halfSpace"],
        [{ slab: { normal: [0, 0, 1], offset: 1, thickness: -1 } }, "slab"],
        [{ planes: [[1, 0, 0]] }, "planes"],
        [{ ranges: [[1], [2, 3, 4]] }, "ranges"],
        [{ ranges: [[1, 0]] }, "ranges"],
        [{ ranges: [1] }, "ranges"],
        [{ isovalues: [Infinity] }, "isovalues"],
        [{ view: { pixels: 1 } }, "view.matrix"],
        [{ view: { ...VIEW, pixels: undefined } }, "view.pixels"],
        [{ view: { ...VIEW, pixels: -1 } }, "view.pixels"],
        [{ view: { ...VIEW, matrix: [1, 2, 3] } }, "view.matrix"],
        [{ view: { ...VIEW, matrix: new Array(16).fill(0) } }, "view.matrix"],
        [{ view: { ...VIEW, outside: "far" } }, "view.outside"],
        [{ view: VIEW, error: "1%" }, "error"],
        [{ view: VIEW, isovalues: [1] }, "isovalues"],
        [{ transfer: { points: [] } }, "transfer"],
        [{ transfer: { points: [[0, 0, 0, 0, 2]] } }, "transfer"],
        [{ transfer: { points: [[0, 1, 1]] } }, "transfer.points"],
        [{ maxVertices: 0 }, "maxVertices"],
        [{ maxBytes: "many" }, "maxBytes"],
        [{ where: 7 }, "where"],
        [{ whereBox: [0, 0, 0, 1, 1, 1] }, "whereBox"],
        [{ error: "%" }, "error"],
        [{ error: "1" }, "error"],
      ]) {
        await refuses(mt.refine(/** @type {any} */ (options)), name);
      }
      await refuses(mt.refine({}, /** @type {any} */ ({ delta: true })), "delta");
      await refuses(mt.refineSteps({}, /** @type {any} */ ({ budgetMs: "long" })).next(), "budgetMs");
      await refuses(mt.refineSteps({}, { updates: 0 }).next(), "updates");
      await refuses(mt.refineSteps(/** @type {any} */ ({ eror: 1 })).next(), "eror");
      assert.ok((await mt.refine({ error: undefined, needs: undefined, where: undefined })).stats.satisfied);
      mt.free();
    });

    test("steps lead to the same mesh, and each of them is one", async () => {
      const mt = await open();
      await mt.refine({ error: "2%" });
      const whole = await mt.hash();
      await mt.refine({ error: "100%" });
      let steps = 0;
      for await (const { stats, tets, neighbors } of mt.refineSteps({ error: "2%" }, { updates: 100 })) {
        steps++;
        assert.equal(tets.length, 4 * stats.tetrahedra);
        assert.ok(stats.done || stats.refined + stats.coarsened >= 100);
        for (let t = 0; t < stats.tetrahedra; t += 7) {
          const other = neighbors[4 * t];
          if (other !== 0xffffffff) assert.ok(neighbors.subarray(4 * other, 4 * other + 4).includes(t));
        }
        assert.equal(stats.bounds.length, stats.done ? 1 : 0);
      }
      assert.ok(steps > 3, `${steps} steps`);
      assert.equal(await mt.hash(), whole);
      const last = [];
      for await (const step of mt.refineSteps({ error: "1%" }, { budgetMs: 1000 })) last.push(step.stats.done);
      assert.equal(last.at(-1), true);
      mt.free();
    });

    test("a later request ends the steps of an earlier one, and so do a signal and leaving the loop", async () => {
      const mt = await open();
      const steps = mt.refineSteps({ error: 0 }, { updates: 50 });
      const first = /** @type {import("../../pkg/index.js").RefineResult} */ ((await steps.next()).value);
      assert.equal(first.stats.done, false);
      const { stats } = await mt.refine({ error: "5%" });
      const wanted = await mt.hash();
      assert.equal((await steps.next()).done, true);
      assert.equal(await mt.hash(), wanted);
      assert.ok(stats.done);

      const abort = new AbortController();
      const stopped = mt.refineSteps({ error: 0 }, { updates: 50, signal: abort.signal });
      await stopped.next();
      abort.abort(new Error("enough"));
      await assert.rejects(stopped.next(), /enough/);
      for await (const step of mt.refineSteps({ error: "50%" }, { updates: 20 })) {
        assert.ok(step.tets.length > 0);
        break;
      }
      await mt.refine({ error: "5%" });
      assert.equal(await mt.hash(), wanted);
      mt.free();
    });

    test("deltas add up to the whole arrays over a walk of requests", async () => {
      for (const kind of KINDS) {
        const mt = await open(new Uint8Array(await readFile(`${folder}/${kind}.mt`)));
        const mesh = emptyMesh();
        const walk = Object.values(REQUESTS);
        let sent = 0;
        let whole = 0;
        for (let i = 0; i < 12; i++) {
          const options = walk[(i * i + 3 * i) % walk.length];
          /** @type {import("../../pkg/index.js").RefineOptions} */
          const near = { error: "1%", sphere: { center: [0.3 + i / 200, 0.5, 0.5], radius: 0.15 } };
          for (const asked of [options, near]) {
            const delta = await mt.refine(asked, { deltas: true });
            assert.equal(applyChanges(mesh, delta), mesh);
            sent += delta.tets.length;
            // The whole of it, of which nothing has changed since.
            if (i % 5 > 2) continue;
            const full = await mt.refine(asked);
            whole += 2 * full.tets.length;
            assert.deepEqual([...full.changes.tets, ...full.changes.vertices], []);
            mesh.changes = full.changes;
            for (const name of ["positions", "field", "tets", "neighbors"]) {
              assert.ok(same(mesh[name], full[name]), `${kind} ${i}: ${name}`);
            }
          }
        }
        assert.ok(sent < 2 * whole);
        // Steps in deltas, and whole meshes as the ground that deltas stand on.
        const base = await mt.refine({ error: "100%" });
        for await (const step of mt.refineSteps({ error: "2%" }, { updates: 64, deltas: true })) applyChanges(base, step);
        assert.ok(same(base.tets, (await mt.refine({ error: "2%" })).tets));
        mt.free();
      }
    });

    test("what does not fit is refused", async () => {
      const mt = await open();
      const delta = await mt.refine({ error: "5%" }, { deltas: true });
      const later = await mt.refine({ error: "1%" }, { deltas: true });
      assert.throws(() => applyChanges(emptyMesh(), later), /applies to mesh number 1/);
      assert.throws(() => applyChanges(applyChanges(emptyMesh(), delta), delta), TetralodError);
      assert.throws(() => applyChanges(emptyMesh(), { ...delta, tets: delta.tets.subarray(4) }), TetralodError);
      assert.throws(() => applyChanges(emptyMesh(), { ...delta, tetCount: 3 }), TetralodError);
      mt.free();
    });

    test("a module tells where the mesh is wanted", async () => {
      const url = pathToFileURL(`${folder}/where.mjs`);
      await writeFile(
        url,
        `export default ({ positions, errors, count }) => Float32Array.from({ length: count }, (_, i) =>
          Math.min(positions[12 * i], positions[12 * i + 3], positions[12 * i + 6], positions[12 * i + 9]) < 0.2
            ? errors[i] / 0.01 : 0);`,
      );
      const mt = await open();
      const { stats } = await mt.refine({ where: url });
      const hash = await mt.hash();
      assert.ok(stats.satisfied && stats.tetrahedra > 0);
      await mt.refine({ error: "5%" });
      const both = await mt.refine({ where: url.href, error: "5%" });
      assert.ok(both.stats.tetrahedra >= stats.tetrahedra);
      await mt.refine({ where: url.href });
      assert.equal(await mt.hash(), hash);
      await refuses(mt.refine({ where: pathToFileURL(`${folder}/none.mjs`) }), "where", /none\.mjs/);
      await refuses(mt.refine({ where: "not a URL" }), "where");
      mt.free();
    });
  });
}

test("a function cannot go to a worker", async () => {
  const mt = await MultiTessellation.open(bytes);
  await refuses(mt.refine({ where: () => [] }), "where", /worker: false/);
  mt.free();
});

describe("a function in the caller's thread", () => {
  const open = async () => {
    const mt = await MultiTessellation.open(bytes, { worker: false });
    await mt.complete;
    return mt;
  };
  const everywhere =
    (error) =>
    ({ errors }) =>
      errors.map((e) => (e > error ? e / error : 0));

  test("sees tetrahedra in batches, and its answers make the mesh", async () => {
    const mt = await open();
    const { min, max } = mt.info.fields[0];
    const error = 0.02 * (max - min);
    const { tets } = await mt.refine({ error: 1.0001 * error });
    let calls = 0;
    let seen = 0;
    const where = (batch) => {
      calls++;
      seen += batch.count;
      assert.equal(batch.positions.length, 12 * batch.count);
      assert.equal(batch.values.length, 4 * batch.count);
      assert.ok(batch.values.every((value) => value >= min - 1e-3 && value <= max + 1e-3));
      assert.ok(batch.positions.every((x) => x >= mt.info.bounds[0] && x <= mt.info.bounds[3]));
      return everywhere(1.0001 * error)(batch);
    };
    const result = await mt.refine({ where });
    // Errors are handed over as 32-bit floats: the meshes agree but for updates that are within rounding of the bound.
    assert.ok(Math.abs(result.tets.length - tets.length) <= 0.02 * tets.length);
    assert.ok(calls > 1 && seen > 4 * calls);
    assert.equal(result.stats.judged >= seen, true);
    mt.free();
  });

  test("is one need among others, may be budgeted and stepped", async () => {
    const mt = await open();
    const where = everywhere(0.1);
    const { stats: alone } = await mt.refine({ where });
    const { stats: more } = await mt.refine({ where, needs: [{ error: "1%", box: [0, 0, 0, 0.2, 0.2, 0.2] }] });
    assert.ok(more.tetrahedra > alone.tetrahedra);
    const { stats: less } = await mt.refine({ where, maxTets: alone.tetrahedra >> 1 });
    assert.ok(less.tetrahedra <= alone.tetrahedra >> 1 && !less.satisfied);
    let last;
    for await (last of mt.refineSteps({ where }, { updates: 50 }));
    assert.equal(last.stats.tetrahedra, alone.tetrahedra);
    mt.free();
  });

  test("that fails is told, and the MT stays usable", async () => {
    const mt = await open();
    await refuses(
      mt.refine({
        where: () => {
          throw new Error("my mistake");
        },
      }),
      "where",
      /my mistake/,
    );
    await refuses(mt.refine({ where: () => [1] }), "where", /one number for each/);
    await refuses(mt.refine({ where: /** @type {any} */ (() => 7) }), "where", /one number for each/);
    assert.ok((await mt.refine({ where: ({ count }) => new Array(count).fill(NaN) })).stats.satisfied);
    await mt.refine({ error: 0 });
    assert.equal((await mt.refine({ error: 0 })).stats.tetrahedra, mt.info.tetrahedra);
    mt.free();
  });
});
