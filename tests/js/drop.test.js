// Files that a person drops on the demo page: a mesh that is built there, a build that is cancelled, files that are broken.
import assert from "node:assert/strict";
import { mkdir, mkdtemp, rm, writeFile } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { fileURLToPath } from "node:url";
import { assertDrawn, begin, differing, drop, dropAll, end, open, PATIENCE, picture, pictures, reach, setSlider, still } from "./drive.js";

before(() => begin());

after(end);

const screenshot = (page, name) => page.screenshot({ path: fileURLToPath(new URL(`${name}.png`, pictures)) });

/**
 * A VTU file of a grid of `n` cubes in each direction, each of six tetrahedra, with the distance to the middle as its field; or with a field at cells
 * alone, 1 but for cell `peak` with 1000. It begins at `start` along x.
 */
function gridFile(n, peak, start = 0) {
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
  const stress = cells.map((_, i) => (i === peak ? 1000 : 1));
  const data =
    peak === undefined ? `<PointData>${array("Float64", "distance", values)}</PointData>` : `<CellData>${array("Float64", "stress", stress)}</CellData>`;
  return `<VTKFile type="UnstructuredGrid" version="1.0"><UnstructuredGrid><Piece NumberOfPoints="${points.length}" NumberOfCells="${cells.length}">
${data}<Points>${array(
    "Float64",
    "Points",
    points.map(([x, y, z]) => [x + start, y, z]),
    'NumberOfComponents="3"',
  )}</Points>
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
  assert.match(await page.innerText("#growth"), / fetched\b/, "the volume that stays has arrived");
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

test("labels at cells stay labels: the boundary in their colours, and nothing between", async () => {
  const page = await open("data/bucky-small.mt", undefined, { viewport: { width: 900, height: 620 } });
  await reach(page, "complete");
  const labels = Array.from({ length: 1296 }, (_, i) => (Math.floor(i / 6) % 6 < 3 ? 2 : 40)).join(" ");
  const text = gridFile(6, 700).replace(/"Float64" Name="stress"([^>]*)>[^<]*/, (_, more) => `"Int32" Name="material"${more}>${labels}`);
  await drop(page, "cells.vtu", text);
  const dialog = page.locator("dialog.build");
  await dialog.getByRole("button", { name: "Build" }).click();
  await page.waitForFunction(() => window.tetralodDemo.info?.tetrahedra === 1296 && window.tetralodDemo.state === "complete", undefined, { timeout: PATIENCE });
  assert.match(
    await dialog.getByText("is averaged from cells").innerText(),
    /^material is averaged from cells: .*; another label in [\d.]+ % of a cell at most/,
  );
  await dialog.getByRole("button", { name: "Close" }).click();
  const { isLabel, name } = await page.evaluate(() => window.tetralodDemo.info.fields[0]);
  assert.deepEqual([isLabel, name], [true, "material"]);
  assert.equal(await page.locator("input[name=mode]:checked").inputValue(), "solid", "there is no isosurface of a label");
  const ticks = page.locator("#legend-ticks span:visible");
  assert.deepEqual(await ticks.allInnerTexts(), ["2", "40"]);
  assert.ok(await page.locator("#range").isHidden(), "a range means nothing");
  const before = await still(page, "drop-labels");
  await screenshot(page, "page-labels");
  await page.locator("input[name=mode][value=iso]").check({ force: true });
  await page.locator("#legend-note").getByText("labels have no values between: the boundary is shown").waitFor({ timeout: PATIENCE });
  assert.ok(differing(before, await still(page, "drop-labels-iso")) < 0.1);
  assert.deepEqual(page.complaints, []);
  await page.close();
});

test("a field at cells is averaged, and the page says what that does to it", async () => {
  const page = await open("data/bucky-small.mt", undefined, { viewport: { width: 900, height: 620 } });
  await reach(page, "complete");
  assert.ok(await page.locator("#legend-note").isHidden(), "a field at points is as it was");
  await drop(page, "cells.vtu", gridFile(6, 700));
  const dialog = page.locator("dialog.build");
  await dialog.getByText("Peaks become lower").waitFor({ timeout: PATIENCE });
  assert.ok(await dialog.getByLabel("stress, at cells").isChecked(), "there is no other");
  await dialog.getByRole("button", { name: "Build" }).click();
  await page.waitForFunction(() => window.tetralodDemo.info?.tetrahedra === 1296 && window.tetralodDemo.state === "complete", undefined, { timeout: PATIENCE });
  const said = await dialog.getByText("is averaged from cells").innerText();
  const known =
    /^stress is averaged from cells: input 1 \(cell 0\) to 1,000 \(cell 700\), at points 1 to ([\d.]+); differs by ([\d.]+) at most, root mean square ([\d.]+)$/;
  const [, most, largest, rms] = (known.exec(said) ?? assert.fail(said)).map(Number);
  assert.ok(most < 1000 && most > 1 && rms < largest && largest < 1000, said);
  await screenshot(page, "page-averaged");
  await dialog.getByRole("button", { name: "Close" }).click();
  await page.locator(".histogram-note:visible").getByText("averaged from cells; input 1 to 1,000").waitFor({ timeout: PATIENCE });
  // An isosurface alone, which a box is shown as first, has no colour bar.
  await page.locator("input[name=mode][value=solid]").check({ force: true });
  await page.locator("#legend-note").waitFor({ timeout: PATIENCE });
  assert.equal(await page.innerText("#legend-note"), "averaged from cells\ninput 1 to 1,000");
  const [{ extremes, averaged }] = await page.evaluate(() => window.tetralodDemo.info.fields);
  assert.deepEqual([averaged.input.max.value, averaged.input.max.cell, extremes.max.value > 1], [1000, 700, true]);
  await screenshot(page, "page-averaged-legend");
  assert.deepEqual(page.complaints, []);
  await page.close();
});

test("as many fields are ticked as memory has room for", async () => {
  const page = await open("data/bucky-small.mt", undefined, { viewport: { width: 900, height: 620 } });
  await reach(page, "complete");
  const arrays = Array.from({ length: 40 }, (_, i) => `<DataArray type="Float32" Name="f${i}" format="appended" offset="0"/>`);
  const extent = "0 140 0 140 0 140";
  const image = (names) => `<VTKFile type="ImageData" version="1.0"><ImageData WholeExtent="${extent}" Origin="0 0 0" Spacing="1 1 1"><Piece Extent="${extent}">
<PointData>${names.join("")}</PointData></Piece></ImageData><AppendedData encoding="raw">_</AppendedData></VTKFile>`;
  const dialog = page.locator("dialog.build");
  const ticked = async (names) => {
    await drop(page, "image.vti", image(names));
    await dialog.getByText("The build needs").waitFor({ timeout: PATIENCE });
    await page.waitForFunction(() => document.activeElement?.textContent === "Build", undefined, { timeout: PATIENCE });
    const count = await dialog.locator("fieldset.choices input:checked").count();
    await dialog.getByRole("button", { name: "Cancel" }).click();
    await dialog.waitFor({ state: "detached" });
    return count;
  };
  assert.equal(await ticked(arrays.slice(0, 3)), 3);
  const count = await ticked(arrays);
  assert.ok(count > 3 && count < 40, `${count} are ticked`);
  await page.close();
});

/** A mesh in two pieces that meet, with the list of them first. */
function inPieces(n) {
  const names = ["case/0.vtu", "case/1.vtu"];
  const sources = names.map((name) => `<Piece Source="${name}"/>`).join("");
  const list = `<VTKFile type="PUnstructuredGrid"><PUnstructuredGrid>${sources}</PUnstructuredGrid></VTKFile>`;
  return [["case.pvtu", list], ...names.map((name, i) => [name, gridFile(n, undefined, i * n)])];
}

/** Drops files or folders of this machine, as a file manager does. */
async function dropPaths(page, files) {
  const client = await page.context().newCDPSession(page);
  for (const type of ["dragEnter", "dragOver", "drop"]) {
    await client.send("Input.dispatchDragEvent", { type, x: 300, y: 300, data: { items: [], files, dragOperationsMask: 1 } });
  }
  await client.detach();
}

test("meshes of other formats and in several files are built, from a folder, too", async () => {
  const page = await open("data/bucky-small.mt", undefined, { viewport: { width: 900, height: 620 } });
  await reach(page, "complete");
  const dialog = page.locator("dialog.build");
  /** Builds what was dropped, and closes the dialog. */
  const built = async (said, tetrahedra, name) => {
    await dialog.getByText(said).waitFor({ timeout: PATIENCE });
    await dialog.getByRole("button", { name: "Build" }).click();
    const isShown = (wanted) => window.tetralodDemo.info?.tetrahedra === wanted && window.tetralodDemo.state === "complete";
    await page.waitForFunction(isShown, tetrahedra, { timeout: PATIENCE });
    assert.equal(await page.locator("#volume option:checked").innerText(), name);
    await screenshot(page, `page-built-${name}`);
    await dialog.getByRole("button", { name: "Close" }).click();
    await dialog.waitFor({ state: "detached" });
  };
  // Without their folder, as they are dropped from one.
  const flat = inPieces(4).map(([name, text]) => [name.replace("case/", ""), text]);
  await dropAll(page, [...flat].reverse());
  await built("pvtu, 250 points, 768 tetrahedra", 768, "case.mt");
  assert.match(await page.innerText("#growth"), /^768 tetrahedra: \d+ kB as PVTU, /);

  await dropAll(page, flat.slice(0, 2));
  const alert = dialog.locator("[role=alert]");
  await alert.waitFor({ timeout: PATIENCE });
  assert.equal(await alert.innerText(), 'case.pvtu: piece 1: it needs the file "case/1.vtu", which is not among those that were given; give them together');
  await screenshot(page, "page-missing-piece");
  await dialog.getByRole("button", { name: "Cancel" }).click();

  const corners = ["0 0 0", "2 0 0", "0 2 0", "0 0 2", "0.5 0.5 0.5"].map((place, i) => `${i + 1} ${place}`);
  const cells = [
    [1, 2, 3, 5],
    [1, 2, 5, 4],
    [1, 5, 3, 4],
    [5, 2, 3, 4],
  ].map((cell, i) => `${i + 1} 4 2 1 1 ${cell.join(" ")}`);
  const values = corners.map((_, i) => `${i + 1} ${i * i}`);
  const gmsh = ["$MeshFormat", "2.2 0 8", "$EndMeshFormat", "$Nodes", 5, ...corners, "$EndNodes", "$Elements", 4, ...cells, "$EndElements"];
  const view = ["$NodeData", 1, '"heat"', 1, 0, 3, 0, 1, 5, ...values, "$EndNodeData", ""];
  await drop(page, "block.msh", [...gmsh, ...view].join("\n"));
  await built("gmsh, 5 points, 4 tetrahedra", 4, "block.mt");

  const folder = await mkdtemp(join(tmpdir(), "tetralod-drop-"));
  try {
    await mkdir(join(folder, "case"));
    for (const [name, text] of [...inPieces(3), ["case/run.log", "words"], [".hidden", "words"]]) await writeFile(join(folder, name), text);
    await dropPaths(page, [folder]);
    await dialog.getByText("pvtu, 128 points, 324 tetrahedra").waitFor({ timeout: PATIENCE });
    await dialog.getByRole("button", { name: "Build" }).click();
    const said = dialog.getByText("Left out of the folder, for it is no mesh");
    await said.waitFor({ timeout: PATIENCE });
    assert.match(await said.innerText(), /: tetralod-drop-\w+\/case\/run\.log$/);
    await screenshot(page, "page-built-folder");
    await dialog.getByRole("button", { name: "Close" }).click();
  } finally {
    await rm(folder, { recursive: true });
  }
  assert.deepEqual(page.complaints, []);
  await page.close();
});

test("what is no mesh is named, with what to do", async () => {
  const page = await open("data/bucky-small.mt", undefined, { viewport: { width: 900, height: 620 } });
  await reach(page, "complete");
  const dialog = page.locator("dialog.build");
  for (const [name, text, words] of [
    ["part.stl", "solid part", /^part\.stl: a surface mesh \(STL\) cannot be read here; fill it with tetrahedra/],
    ["notes.txt", "words", /^notes\.txt: not a format that is known here; give VTK XML .* Gmsh \(\.msh\)/],
    ["a.node", "4 3 0 0", /^a\.node: it needs the file "a\.ele"/],
  ]) {
    await drop(page, name, text);
    const alert = dialog.locator("[role=alert]");
    await alert.waitFor({ timeout: PATIENCE });
    assert.match(await alert.innerText(), /** @type {RegExp} */ (words));
    await dialog.getByRole("button", { name: "Cancel" }).click();
    await dialog.waitFor({ state: "detached" });
  }
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
