#!/usr/bin/env python3
"""Compares isosurfaces with VTK's vtkContour3DLinearGrid, on one thread, side by side.

    python3 -m venv ~/vtk && ~/vtk/bin/pip install vtk        # outside the repository
    rustup target add wasm32-wasip1
    cargo build --release
    ~/vtk/bin/python benches/vtk_contour.py FILE.mt...

Both sides get the finest mesh of the MT file, points and field as 32-bit floats, and make triangles with shared
vertices and normals. VTK: merged points, sequential processing, normals, no interpolated attributes. `smooth` is
ours with normals out of the triangles, as those of VTK are, and `gradient` with normals out of the field, both from a
mesh of which nothing is known; `sweep` is a session with gradient normals whose isovalue moves by 0.5 % of the range a
frame.
Ours runs natively and as wasm in Node (WASI). Numbers are millions of tetrahedra per second at the median run; the
processes take turns in several rounds, so that what else the machine does hits all of them.
"""

import argparse
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent
WASI = """
import { readFileSync } from "node:fs";
import { WASI } from "node:wasi";
import { dirname } from "node:path";
const [wasm, ...rest] = process.argv.slice(2);
const folder = dirname(rest[0]);
const wasi = new WASI({ version: "preview1", args: ["contour", ...rest], preopens: { [folder]: folder } });
const module = await WebAssembly.compile(readFileSync(wasm));
wasi.start(await WebAssembly.instantiate(module, wasi.getImportObject()));
"""


def build(target, flags):
    command = ["cargo", "build", "--release", "--quiet", "--manifest-path", str(HERE / "contour/Cargo.toml")]
    folder = ROOT / "target/contour" / ("simd" if flags else "plain")
    command += ["--target-dir", str(folder)] + (["--target", target] if target else [])
    if flags:
        command += ["--config", f'target.{target}.rustflags=["{flags}"]']
    subprocess.run(command, check=True)
    return folder / (f"{target}/release/contour.wasm" if target else "release/contour")


def run_ours(command, file, runs, fractions):
    command = [str(x) for x in [*command, file, runs, *fractions]]
    found = []
    # Node 20 may crash on the way out of a long WASI program. What was printed by then is whole, or too short.
    done = subprocess.run(command, capture_output=True, text=True)
    lines = done.stdout.splitlines()
    if len(lines) < len(fractions):
        sys.exit(f"{command} failed: {done.stderr}")
    for line in lines:
        tets, value, triangles, vertices, _, extract, _, smooth, _, sweep = line.split()
        times = {"gradient": extract, "smooth": smooth, "sweep": sweep}
        times = {kind: [float(x) for x in times[kind].split(",")] for kind in times}
        found.append((int(tets), float(value), int(triangles), int(vertices), times))
    return found


class Vtk:
    def __init__(self, file):
        import numpy
        import vtk
        from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy

        self.vtk = vtk
        reader = vtk.vtkXMLUnstructuredGridReader()
        reader.SetFileName(str(file))
        reader.Update()
        self.grid = reader.GetOutput()
        points = vtk.vtkPoints()
        positions = vtk_to_numpy(self.grid.GetPoints().GetData()).astype(numpy.float32)
        points.SetData(numpy_to_vtk(positions, deep=True))
        self.grid.SetPoints(points)
        data = self.grid.GetPointData()
        name = data.GetArray(0).GetName()
        field = numpy_to_vtk(vtk_to_numpy(data.GetArray(0)).astype(numpy.float32), deep=True)
        field.SetName(name)
        data.RemoveArray(name)
        data.SetScalars(field)

    def run(self, value, runs):
        times = []
        for _ in range(runs):
            contour = self.vtk.vtkContour3DLinearGrid()
            contour.SetInputData(self.grid)
            contour.SetValue(0, value)
            # Newer versions always merge and say so.
            if self.vtk.vtkVersion().GetVTKMajorVersion() * 100 + self.vtk.vtkVersion().GetVTKMinorVersion() < 907:
                contour.SetMergePoints(True)
            contour.SetSequentialProcessing(True)
            contour.SetComputeNormals(True)
            contour.SetInterpolateAttributes(False)
            start = time.perf_counter()
            contour.Update()
            times.append(time.perf_counter() - start)
        return contour.GetOutput().GetNumberOfPolys(), times


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("files", nargs="+", type=Path, metavar="FILE.mt")
    parser.add_argument("--tetralod", default=ROOT / "target/release/tetralod", help="the command")
    parser.add_argument("--fractions", default="0.05,0.1,0.2,0.3,0.5,0.7,0.9", help="isovalues in the field's range")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--runs", type=int, default=9, help="runs of each isovalue in a round")
    parser.add_argument("--simd", action="store_true", help="wasm with simd128")
    options = parser.parse_args()
    fractions = options.fractions.split(",")
    native = [build(None, "")]
    wasm = build("wasm32-wasip1", "-Ctarget-feature=+simd128" if options.simd else "")
    with tempfile.TemporaryDirectory() as folder:
        script = Path(folder) / "wasi.mjs"
        script.write_text(WASI)
        in_node = ["node", "--no-warnings", script, wasm]
        for file in options.files:
            compare(file.resolve(), fractions, options, native, in_node, Path(folder))


def compare(file, fractions, options, native, in_node, folder):
    mesh = folder / "mesh.vtu"
    subprocess.run([options.tetralod, "extract", file, "-o", mesh], check=True, stdout=subprocess.DEVNULL)
    vtk = Vtk(mesh)
    all_times = {}
    for _ in range(options.rounds):
        found = run_ours(native, file, options.runs, fractions)
        in_wasm = run_ours(in_node, file, options.runs, fractions)
        for (fraction, mine, other) in zip(fractions, found, in_wasm):
            triangles, times = vtk.run(mine[1], options.runs)
            sizes = (mine[2], mine[3], triangles)
            entry = all_times.setdefault(fraction, {"sizes": sizes})
            entry.setdefault("VTK", []).extend(times)
            for name, one in (("native", mine), ("wasm", other)):
                for kind, times in one[4].items():
                    entry.setdefault(f"{name} {kind}", []).extend(times)
    tets = found[0][0]
    print(f"\n{file.name}: {tets} tetrahedra; millions of them per second, and how many times VTK that is")
    columns = [f"{name} {kind}" for name in ("native", "wasm") for kind in ("smooth", "gradient", "sweep")]
    print(f"{'isovalue':>8} {'triangles':>9} {'VTK tris':>9} {'VTK':>7}" + "".join(f"{c:>17}" for c in columns))
    for fraction in fractions:
        entry = all_times[fraction]
        rate = {k: tets / statistics.median(entry[k]) / 1e6 for k in ["VTK", *columns]}
        cells = "".join(f"{rate[c]:>10.1f} {rate[c] / rate['VTK']:>5.2f}x" for c in columns)
        print(f"{fraction:>8} {entry['sizes'][0]:>9} {entry['sizes'][2]:>9} {rate['VTK']:>7.1f}{cells}")
    sys.stdout.flush()


if __name__ == "__main__":
    main()
