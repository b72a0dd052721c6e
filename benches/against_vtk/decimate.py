"""Decimates the tetrahedra of a file with VTK, and prints what that took: started by run.py, one process for each mesh.

    decimate.py INPUT.vtu FIELD PART OUTPUT.vtu        PART: of the tetrahedra, those to keep

The quadrics of VTK add squares of distances and of differences of the field, and its limits are absolute: the model is scaled to sides of
at most 1, the field to a range of 1, and both back.
"""

import json
import resource
import sys
import time

import numpy

from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkFiltersCore import vtkUnstructuredGridQuadricDecimation
from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader, vtkXMLUnstructuredGridWriter


def peak():
    """The most memory that the process has had so far, in bytes."""
    return 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


def set_points(mesh, points):
    mesh.GetPoints().SetData(numpy_to_vtk(points, deep=True))


def set_field(mesh, name, values):
    array = numpy_to_vtk(values, deep=True)
    array.SetName(name)
    mesh.GetPointData().SetScalars(array)


def main(source, field, part, target):
    before = peak()
    reader = vtkXMLUnstructuredGridReader()
    reader.SetFileName(source)
    reader.Update()
    mesh = reader.GetOutput()
    points = vtk_to_numpy(mesh.GetPoints().GetData()).astype(numpy.float64)
    values = vtk_to_numpy(mesh.GetPointData().GetArray(field)).astype(numpy.float64)
    low, side = points.min(axis=0), (points.max(axis=0) - points.min(axis=0)).max()
    least, extent = values.min(), values.max() - values.min()
    set_points(mesh, (points - low) / side)
    set_field(mesh, field, (values - least) / extent)
    decimation = vtkUnstructuredGridQuadricDecimation()
    decimation.SetInputData(mesh)
    decimation.SetScalarsName(field)
    decimation.SetTargetReduction(1.0 - float(part))
    start = time.perf_counter()
    decimation.Update()
    seconds = time.perf_counter() - start
    mesh = decimation.GetOutput()
    tets = mesh.GetNumberOfCells()
    print(json.dumps({"seconds": seconds, "bytes": peak() - before, "tets": tets}))
    set_points(mesh, low + side * vtk_to_numpy(mesh.GetPoints().GetData()).astype(numpy.float64))
    set_field(mesh, field, least + extent * vtk_to_numpy(mesh.GetPointData().GetScalars()))
    writer = vtkXMLUnstructuredGridWriter()
    writer.SetFileName(target)
    writer.SetInputData(mesh)
    if not writer.Write():
        sys.exit(f"{target} could not be written")


main(*sys.argv[1:])
