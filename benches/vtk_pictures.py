#!/usr/bin/env python3
"""Draws the same scenes with `tetralod render` and with VTK in software, side by side, and compares the pixels.

    python3 -m venv ~/vtk && ~/vtk/bin/pip install vtk pillow        # outside the repository
    cargo build --release --package tetralod-cli
    ~/vtk/bin/python benches/vtk_pictures.py FILE.mt --error 1% -o docs/gallery

Both get the same mesh, camera, colours and opacities: VTK the mesh that `tetralod extract` writes, and the camera that
`tetralod render --json` prints. Writes vtk-volume.png, vtk-surface.png and vtk-slice.png, each with the picture of
tetralod at the left, that of VTK in the middle, and eight times their difference at the right. Prints for each the mean
difference of a channel over the model in levels of 255, how much 99 of 100 of its pixels have at most, and how many pixels
only one of the two covers. Times are those of a picture of the volume: of VTK's mapper, the median of several, and of
tetralod what a further picture adds to its command.
"""

import argparse
import json
import math
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy
import vtk
from PIL import Image
from vtkmodules.util.numpy_support import vtk_to_numpy

ROOT = Path(__file__).resolve().parent.parent
# The vertical angle of view of tetralod's cameras, in radians.
ANGLE = 0.6
BACKGROUND = (0.12, 0.14, 0.18)
# Value as a part of the range; red, green, blue; opacity of a tenth of the diagonal.
TRANSFER = [
    (0.1, (0.1, 0.2, 0.7), 0.0),
    (0.35, (0.2, 0.6, 0.9), 0.08),
    (0.6, (0.95, 0.8, 0.3), 0.3),
    (1.0, (0.9, 0.2, 0.1), 0.85),
]
# Parts of an interval between two opacities.
STEPS = 16
GREYS = 256


class Tetralod:
    """The command, on one file with one request."""

    def __init__(self, options, folder):
        self.command, self.file, self.folder = options.tetralod, options.file, folder
        self.request = ["--error", options.error]
        self.place = ["--size", "x".join(map(str, options.size)), "--zoom", options.zoom]

    def run(self, *arguments):
        command = [str(x) for x in [self.command, *arguments]]
        done = subprocess.run(command, capture_output=True, text=True)
        if done.returncode:
            sys.exit(f"{' '.join(command)} failed: {done.stderr}")
        return done.stdout

    def mesh(self):
        path = self.folder / "mesh.vtu"
        self.run("extract", self.file, *self.request, "-o", path)
        return path

    def render(self, *arguments, samples=16):
        """The picture over the background, the opacity of its pixels, the camera, and the seconds that it took."""
        path = self.folder / "picture.png"
        scene = ["--background", "transparent", "--no-outline", "--samples", samples]
        start = time.perf_counter()
        printed = self.run(
            "render", self.file, *self.request, *self.place, *scene, *arguments, "--json", "-o", path
        )
        seconds = time.perf_counter() - start
        pixels = numpy.asarray(Image.open(path).convert("RGBA")).astype(float)
        alpha = pixels[..., 3:] / 255
        over = alpha * pixels[..., :3] + (1 - alpha) * 255 * numpy.array(BACKGROUND)
        return over, alpha[..., 0], json.loads(printed)["camera"], seconds


class Vtk:
    """A window without a screen that shows one prop at a time."""

    def __init__(self, mesh, camera, size):
        reader = vtk.vtkXMLUnstructuredGridReader()
        reader.SetFileName(str(mesh))
        reader.Update()
        self.grid = reader.GetOutput()
        self.grid.GetPointData().SetActiveScalars(self.grid.GetPointData().GetArray(0).GetName())
        self.range = self.grid.GetPointData().GetScalars().GetRange()
        self.window = vtk.vtkRenderWindow()
        self.window.SetOffScreenRendering(True)
        self.window.SetMultiSamples(8)
        self.window.SetSize(*size)
        self.renderer = vtk.vtkRenderer()
        self.renderer.SetBackground(*BACKGROUND)
        self.window.AddRenderer(self.renderer)
        yaw, pitch, away = camera["yaw"], camera["pitch"], camera["distance"]
        back = (math.cos(pitch) * math.cos(yaw), math.cos(pitch) * math.sin(yaw), math.sin(pitch))
        own = self.renderer.GetActiveCamera()
        own.SetFocalPoint(*camera["target"])
        own.SetPosition(*(t + away * b for t, b in zip(camera["target"], back)))
        own.SetViewUp(0, 0, 1)
        own.SetViewAngle(math.degrees(ANGLE))

    def value(self, part):
        low, high = self.range
        return low + part * (high - low)

    def picture(self, prop):
        """The picture, and the seconds of a second one: with the first, VTK prepares."""
        self.renderer.RemoveAllViewProps()
        self.renderer.AddViewProp(prop)
        self.renderer.ResetCameraClippingRange()
        self.window.Render()
        times = []
        for _ in range(3):
            self.renderer.GetActiveCamera().Modified()
            start = time.perf_counter()
            self.window.Render()
            times.append(time.perf_counter() - start)
        grab = vtk.vtkWindowToImageFilter()
        grab.SetInput(self.window)
        grab.ReadFrontBufferOff()
        grab.Update()
        image = grab.GetOutput()
        width, height, _ = image.GetDimensions()
        rows = vtk_to_numpy(image.GetPointData().GetScalars()).reshape(height, width, -1)
        return rows[::-1, :, :3].astype(float), statistics.median(times)

    def volume(self, mapper):
        # VTK's rays go through the lower left corners of pixels: the picture moves there by half a pixel.
        self.renderer.GetActiveCamera().SetWindowCenter(*(1 / side for side in self.window.GetSize()))
        colours, opacities = vtk.vtkColorTransferFunction(), vtk.vtkPiecewiseFunction()
        for part, rgb, _ in TRANSFER:
            colours.AddRGBPoint(self.value(part), *rgb)
        # What VTK calls opacity is the extinction here; opacities that are linear have extinctions that are not.
        for (low, _, first), (high, _, last) in zip(TRANSFER, TRANSFER[1:]):
            for i in range(STEPS + 1):
                t = i / STEPS
                value = self.value(low + t * (high - low))
                opacities.AddPoint(value, -math.log(1 - (first + t * (last - first))))
        mapper.SetInputData(self.grid)
        # Its linear integrators are up to a dozen levels off the integral where the volume is dense; this one takes
        # the mean value of each piece of a ray in a cell.
        mapper.SetRayIntegrator(vtk.vtkUnstructuredGridHomogeneousRayIntegrator())
        mapper.SetAutoAdjustSampleDistances(False)
        mapper.SetImageSampleDistance(1)
        volume = vtk.vtkVolume()
        volume.SetMapper(mapper)
        volume.GetProperty().SetColor(colours)
        volume.GetProperty().SetScalarOpacity(opacities)
        volume.GetProperty().SetScalarOpacityUnitDistance(0.1 * self.grid.GetLength())
        volume.GetProperty().SetInterpolationTypeToLinear()
        volume.GetProperty().ShadeOff()
        return volume

    def surface(self, value):
        contour = vtk.vtkContourGrid()
        contour.SetInputData(self.grid)
        contour.SetValue(0, value)
        normals = vtk.vtkPolyDataNormals()
        normals.SetInputConnection(contour.GetOutputPort())
        normals.SplittingOff()
        mapper = vtk.vtkPolyDataMapper()
        mapper.SetInputConnection(normals.GetOutputPort())
        mapper.ScalarVisibilityOff()
        actor = vtk.vtkActor()
        actor.SetMapper(mapper)
        actor.GetProperty().SetColor(0.91, 0.68, 0.34)
        actor.GetProperty().SetSpecular(0.2)
        actor.GetProperty().SetSpecularPower(50)
        return actor

    def slice(self, middle):
        plane = vtk.vtkPlane()
        plane.SetOrigin(*middle)
        plane.SetNormal(0, 1, 0)
        cutter = vtk.vtkCutter()
        cutter.SetInputData(self.grid)
        cutter.SetCutFunction(plane)
        mapper = vtk.vtkPolyDataMapper()
        mapper.SetInputConnection(cutter.GetOutputPort())
        grey = vtk.vtkLookupTable()
        grey.SetNumberOfTableValues(GREYS)
        for i in range(GREYS):
            level = i / (GREYS - 1)
            grey.SetTableValue(i, level, level, level, 1)
        mapper.SetLookupTable(grey)
        mapper.SetInterpolateScalarsBeforeMapping(True)
        mapper.SetScalarRange(*self.range)
        actor = vtk.vtkActor()
        actor.SetMapper(mapper)
        actor.GetProperty().LightingOff()
        return actor


def report(folder, name, ours, alpha, theirs):
    """Writes the two pictures and their difference, and prints numbers."""
    off = numpy.abs(ours - theirs)
    seen = (alpha > 0) | (numpy.abs(theirs - 255 * numpy.array(BACKGROUND)).max(2) > 2)
    one = (alpha > 0.5) != (numpy.abs(theirs - 255 * numpy.array(BACKGROUND)).max(2) > 12)
    sheet = numpy.concatenate([ours, theirs, numpy.clip(8 * off, 0, 255)], axis=1)
    Image.fromarray(numpy.rint(sheet).astype("uint8")).save(folder / f"vtk-{name}.png", optimize=True)
    over = off.max(2)[seen]
    text = f"{name}: {off[seen].mean():.2f} of 255 in the mean, 99 of 100 pixels at most {numpy.percentile(over, 99):.0f}"
    # The opacity of a volume has no edge.
    alone = "" if name == "volume" else f"; {100 * one.sum() / max(1, seen.sum()):.1f} % covered by one alone"
    print(f"{text}, the largest {over.max():.0f}{alone}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("file", type=Path, metavar="FILE.mt")
    parser.add_argument("-o", "--output", type=Path, default=Path(), help="the folder for the pictures")
    parser.add_argument("--tetralod", default=ROOT / "target/release/tetralod", help="the command")
    parser.add_argument("--error", default="1%")
    parser.add_argument("--zoom", default="1.5")
    parser.add_argument("--isovalue", type=float, default=0.5, help="as a part of the field's range")
    parser.add_argument("--size", type=lambda text: [int(x) for x in text.split("x")], default=[320, 240])
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        compare(options, Path(folder))


def compare(options, folder):
    own = Tetralod(options, folder)
    mesh = own.mesh()
    # The camera does not depend on what is shown.
    _, _, camera, _ = own.render("--mode", "slice", samples=1)
    other = Vtk(mesh, camera, options.size)
    print(f"{options.file.name}: {other.grid.GetNumberOfCells()} tetrahedra, VTK {vtk.vtkVersion().GetVTKVersion()}")

    transfer = folder / "scene.json"
    points = [[other.value(part), *rgb, opacity] for part, rgb, opacity in TRANSFER]
    length = 0.1 * other.grid.GetLength()
    transfer.write_text(json.dumps({"volume": {"points": points, "unitLength": length}}))
    ours, alpha, _, first = own.render("--scene", transfer, samples=1)
    _, _, _, ninth = own.render("--scene", transfer, samples=9)
    mappers = {
        "z-sweep": vtk.vtkUnstructuredGridVolumeZSweepMapper(),
        "ray cast": vtk.vtkUnstructuredGridVolumeRayCastMapper(),
    }
    times = []
    for name, mapper in mappers.items():
        theirs, seconds = other.picture(other.volume(mapper))
        times.append(f"VTK {name} {1e3 * seconds:.0f} ms")
        report(options.output if name == "ray cast" else folder, "volume", ours, alpha, theirs)
    print(f"a picture of the volume: tetralod {1e3 * (ninth - first) / 8:.0f} ms, {', '.join(times)}")

    other.renderer.GetActiveCamera().SetWindowCenter(0, 0)
    value = other.value(options.isovalue)
    ours, alpha, _, _ = own.render("--isovalue", value)
    theirs, _ = other.picture(other.surface(value))
    report(options.output, "surface", ours, alpha, theirs)

    middle = [(other.grid.GetBounds()[2 * k] + other.grid.GetBounds()[2 * k + 1]) / 2 for k in range(3)]
    ours, alpha, _, _ = own.render("--slice", f"y={middle[1]}", "--map", "grey")
    theirs, _ = other.picture(other.slice(middle))
    report(options.output, "slice", ours, alpha, theirs)


if __name__ == "__main__":
    main()
