// Files that a person drops on the demo page: a mesh that is built there, a build that is cancelled, files that are broken.
import assert from "node:assert/strict";
import { after, before, test } from "node:test";
import { fileURLToPath } from "node:url";
import { assertDrawn, begin, differing, drop, end, open, PATIENCE, picture, pictures, reach, setSlider, still } from "./drive.js";

before(() => begin());

after(end);

const screenshot = (page, name) => page.screenshot({ path: fileURLToPath(new URL(`${name}.png`, pictures)) });

/** A VTU file of a grid of `n` cubes in each direction, each of six tetrahedra, with the distance to the middle as its field. */
function gridFile(n) {
  const range = (count) => Array.from({ length: count }, (_, i) => i);
  const points = range((n + 1) ** 3).map((i) => [i % (n + 1), Math.floor(i / (n + 1)) % (n + 1), Math.floor(i / (n + 1) ** 2)]);
  const at = ([x, y, z]) => x + (n + 1) * (y + (n + 1) * z);
  // From the lowest corner of a cube to the highest, along its axes in each order.
  const orders = [
    [0, 1, 2],
    [1, 2, 0],
    [2, 0, 1],
    [0, 2, 1],
    [2, 1, 0],
    [1, 0, 2],
  ];
  const cells = points
    .filter((p) => p.every((x) => x < n))
    .flatMap((corner) =>
      orders.map((order) => {
        const path = [corner];
        for (const axis of order) path.push(path[path.length - 1].map((x, i) => (i === axis ? x + 1 : x)));
        return path.map(at);
      }),
    );
  const values = points.map((p) => Math.hypot(...p.map((x) => x / n - 0.5)));
  const array = (type, name, numbers, more = "") => `<DataArray type="${type}" Name="${name}" ${more} format="ascii">${numbers.flat().join(" ")}</DataArray>`;
  return `<VTKFile type="UnstructuredGrid" version="1.0"><UnstructuredGrid><Piece NumberOfPoints="${points.length}" NumberOfCells="${cells.length}">
<PointData>${array("Float64", "distance", values)}</PointData><Points>${array("Float64", "Points", points, 'NumberOfComponents="3"')}</Points>
<Cells>${array("Int64", "connectivity", cells)}${array(
    "Int64",
    "offsets",
    cells.map((_, i) => 4 * (i + 1)),
  )}${array(
    "UInt8",
    "types",
    cells.map(() => 10),
  )}</Cells>
</Piece></UnstructuredGrid></VTKFile>`;
}

test("a dropped VTU is built and shown, a broken file leaves all as it is", async () => {
  const page = await open("data/bucky-small.mt", undefined, { viewport: { width: 900, height: 620 } });
  await reach(page, "complete");
  await setSlider(page, "error", 70);
  const before = await still(page, "drop-before");
  const name = await page.locator("#volume option:checked").innerText();
  const dialog = page.locator("dialog.build");

  // A build that is cancelled, and files that are broken: the picture and its settings stay.
  await drop(page, "grid.vtu", gridFile(24));
  await dialog.getByText("82,944 tetrahedra").waitFor({ timeout: PATIENCE });
  await dialog.getByRole("button", { name: "Build" }).click();
  await dialog.locator("progress").waitFor();
  await dialog.getByRole("button", { name: "Cancel" }).click();
  await dialog.waitFor({ state: "detached" });
  await drop(page, "broken.vtu", "<VTKFile type='Nothing'>");
  await dialog.locator("[role=alert]").waitFor({ timeout: PATIENCE });
  assert.match(await dialog.locator("[role=alert]").innerText(), /broken\.vtu/);
  assert.ok(await dialog.getByText("Reading…").isHidden(), "it is not being read any more");
  await dialog.getByRole("button", { name: "Cancel" }).click();
  await drop(page, "broken.mt", "hello");
  await page.locator("#message").waitFor({ timeout: PATIENCE });
  assert.match(await page.innerText("#message"), /broken\.mt: this is not an MT file/);
  assert.ok(await page.locator("#retry").isHidden(), "the same file would fail again");
  await screenshot(page, "page-broken");
  assert.match(await page.innerText("#growth"), / fetched$/m, "the volume that stays has arrived");
  await page.click("#dismiss");
  assert.equal(differing(before, await still(page, "drop-broken")), 0, "the picture stays");
  assert.equal(await page.locator("#volume option:checked").innerText(), name);
  await page.fill("#isovalue", "700");
  assert.ok(differing(before, await still(page, "drop-isovalue")) > 0.01, "the settings work on");
  const { tetrahedra } = await setSlider(page, "error", 60);
  assert.ok(tetrahedra > 0);

  await drop(page, "grid.vtu", gridFile(10));
  await dialog.getByText("1,331 points, 6,000 tetrahedra").waitFor({ timeout: PATIENCE });
  await dialog.getByRole("button", { name: "Build" }).click();
  await page.waitForFunction(() => window.tetralodDemo.info?.tetrahedra === 6000 && window.tetralodDemo.state === "complete", undefined, { timeout: PATIENCE });
  await screenshot(page, "page-built");
  await dialog.getByRole("button", { name: "Close" }).click();
  assertDrawn(await picture(page, "drop-built"));
  const { length } = gridFile(10);
  const size = length < 999_500 ? `${Math.round(length / 1e3)} kB` : `${(length / 1e6).toPrecision(3)} MB`;
  assert.match(await page.innerText("#growth"), new RegExp(`^6,000 tetrahedra: ${size} as VTU, `), "the size is that of the file");
  assert.equal(await page.locator("#volume option:checked").innerText(), "grid.mt");
  assert.deepEqual(page.complaints, []);
  await page.close();
});

test("files for the command are told so, and others what is read", async () => {
  const page = await open("data/bucky-small.mt", undefined, { viewport: { width: 900, height: 620 } });
  await reach(page, "complete");
  const told = async (name, text) => {
    await drop(page, name, text);
    await page.locator("#message").waitFor({ timeout: PATIENCE });
    const words = await page.innerText("#message");
    await page.click("#dismiss");
    return words;
  };
  for (const ending of ["msh", "mesh", "exo", "nrrd", "mha", "mhd", "vtkhdf", "pvtu", "pvd", "vol", "node"]) {
    const words = await told(`my mesh.${ending}`, "$MeshFormat");
    assert.match(words, /does not read the file/);
    assert.ok(words.includes(`tetralod build 'my mesh.${ending}' -o 'my mesh.mt'`), words);
  }
  assert.match(await told("part.stl", "solid part"), /part\.stl: This page opens \.mt files, and builds them of \.vtu.*also reads .*Gmsh/s);
  assert.equal(await page.evaluate(() => window.tetralodDemo.state), "complete", "the volume stays");
  // The content says what is an MT file.
  await page.evaluate(async () => {
    const bytes = await (await fetch("data/bucky-small.mt")).arrayBuffer();
    const dataTransfer = new DataTransfer();
    dataTransfer.items.add(new File([bytes], "volume.bin"));
    window.dispatchEvent(new DragEvent("drop", { dataTransfer, cancelable: true }));
  });
  await page.waitForFunction(() => location.hash.includes("volume.bin"), undefined, { timeout: PATIENCE });
  assert.deepEqual(page.complaints, []);
  await page.close();
});
