"""Building: from arrays, PyVista and meshio objects, and files."""

from __future__ import annotations

import importlib
import json
import os
from collections.abc import Mapping, Sequence
from typing import Any, Union

import numpy as np
from numpy.typing import ArrayLike

from . import _native, _options, _vtu
from ._errors import TetralodError, bad_option
from ._mt import Mt, Progress, Tolerance, open

Cells = Union[ArrayLike, Mapping[Any, ArrayLike], Sequence[Any]]

_IN_MEMORY = "the mesh"


def build(
    source: Any,
    cells: Cells | None = None,
    point_data: Mapping[str, ArrayLike] | None = None,
    cell_data: Mapping[str, Any] | None = None,
    *,
    output: str | os.PathLike[str] | None = None,
    fields: Sequence[str] = (),
    all_fields: bool = False,
    cell_to_point: bool = False,
    mean_across_regions: bool = False,
    labels: Mapping[str, bool] | None = None,
    units: Mapping[str, str] | None = None,
    metadata: Mapping[str, str] | None = None,
    step: int | None = None,
    kind: str | None = None,
    method: str | None = None,
    criterion: str | None = None,
    purpose: str | None = None,
    tet_errors: bool = False,
    repair: str | None = None,
    weld_distance: float | None = None,
    position_bits: int | None = None,
    position_tolerance: float | None = None,
    field_bits: int | Mapping[str, int] | None = None,
    field_tolerance: Tolerance | Mapping[str, Tolerance] | None = None,
    lossless: bool | Sequence[str] = False,
    displacement: Tolerance | None = None,
    displacement_edges: float | None = None,
    min_dihedral: float | None = None,
    feature_angle: float | None = None,
    preserve: Sequence[str] = (),
    preserve_within: float | None = None,
    keep_points: ArrayLike | None = None,
    block_updates: int | None = None,
    progress: Progress | None = None,
) -> Mt:
    """Builds an MT of a mesh. It is in memory, for ``Mt.save``; or in the file ``output``.

    ``source`` is one of:

    - points, an array (n, 3), with ``cells``: an array (m, 4) of tetrahedra; or a list of pairs, or a ``dict``, of types of cells and arrays
      (m, points of a cell). A type is VTK's number or meshio's name, such as ``"hexahedron"`` or ``"tetra10"``; a polyhedron is a list
      of faces. All cells with a volume are split into tetrahedra that fit their neighbours, exactly as by the readers of files; the
      others are left out, which ``report["notes"]`` says. Without cells, ``kind="vertex", method="insert"`` fills the points with tetrahedra.
    - a data set of PyVista or VTK: an unstructured, structured, rectilinear or regular grid;
    - a mesh of meshio, but for its sets of points and cells and its field data;
    - a path, or a list of paths, which are time steps: what the command ``tetralod build`` reads.

    ``point_data`` and ``cell_data`` have an array (n,) or (n, components) for each name; ``cell_data`` may have a list with an array for each
    block of cells instead.

    The arguments are the options of ``tetralod build``, which ``docs/command.md`` describes:

    ``fields``, ``all_fields``
        The fields to keep, or vectors with all components; or all. By default the first that neither numbers something nor says where it is;
        of a vector its length.
    ``cell_to_point``
        Turns fields at cells into fields at points, the mean of the cells around, of labels the most frequent one; ``report["averaged"]``
        says what that does. With ``preserve``, where regions meet, a point gets a value for each of them, from the cells of that region alone.
    ``mean_across_regions``
        Gives such points one value instead, of the cells of all regions.
    ``labels``
        Which fields are labels, by their names: whole numbers with nothing between two of them, shown by the nearest point; or, with ``False``,
        are not. By default integers of at most 256 different values whose name says that they number something.
    ``units``, ``metadata``
        Units of fields or vectors by their names; entries for the file.
    ``step``
        Builds one of several time steps alone; the first one is 0.
    ``kind``, ``method``, ``criterion``, ``purpose``, ``tet_errors``
        What is built, and how: ``"half-edge"`` (the default), ``"edge"`` or ``"vertex"``; ``"decimate"``, ``"collapse"`` or ``"insert"``;
        ``"half-edge"`` or ``"delaunay"``; ``"uniform"`` or ``"regions"``.
    ``repair``, ``weld_distance``
        ``"none"``, ``"safe"`` (the default) or ``"weld"``, which also joins points that lie within the distance of each other.
    ``position_bits``, ``position_tolerance``
        How finely positions are kept, in binary digits or in model units.
    ``field_bits``, ``field_tolerance``, ``lossless``
        How finely values are kept: binary digits (16 by default; integers are exact), or the largest loss in units or in %; for all fields, or a
        ``dict`` by name. ``lossless``: keeps the exact values of all fields, or of those that are named.
    ``displacement``, ``displacement_edges``
        The displacement of the boundary that counts as an error of 100 %: of the diagonal (``"20%"``), and in edges of the input (10).
    ``min_dihedral``, ``feature_angle``, ``preserve``, ``preserve_within``, ``keep_points``
        What must stay: the least dihedral angle and the angle of creases, in degrees; the surfaces between cells of different labels; how far
        these may move; points (k, 3) of the mesh.
    ``block_updates``
        Updates in a block, the least that is fetched: a power of two.
    ``progress``
        A function that is told the stage of the work, how much is done, and the whole.

    Other threads run meanwhile, and Ctrl-C ends the work, but for the reading of files.

    Raises ``TetralodError``: ``bad-mesh`` says which cell or point is wrong; ``bad-option`` names the argument.

    >>> points = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1]]
    >>> mt = tetralod.build(points, [[0, 1, 2, 3], [1, 2, 3, 4]], {"p": [0, 1, 2, 3, 4]}, units={"p": "bar"})
    >>> mt.report["tetrahedra"], mt.info.fields[0].unit
    (2, 'bar')
    """
    taken = _input(source, cells, point_data, cell_data)
    whole_positions = None if position_bits is None else _options.whole("position_bits", position_bits, 1, 30)
    if position_bits is not None and position_tolerance is not None:
        raise bad_option("position_tolerance", "give this or `position_bits`")
    if block_updates is not None and block_updates not in [1 << bits for bits in range(4, 17)]:
        raise bad_option("block_updates", f"must be a power of two from 16 to 65536; given: {block_updates!r}")
    options = {
        "step": None if step is None else _options.whole("step", step, 0, 2**31),
        "kind": kind,
        "method": method,
        "criterion": criterion,
        "purpose": purpose,
        "tet_errors": tet_errors,
        "fields": _options.names("fields", fields),
        "all_fields": all_fields,
        "cell_to_point": cell_to_point,
        "mean_across_regions": mean_across_regions,
        "labels": _labels(labels),
        "repair": repair,
        "weld_distance": None if weld_distance is None else _options.amount("weld_distance", weld_distance),
        "units": list((units or {}).items()),
        "metadata": list((metadata or {}).items()),
        "position_bits": whole_positions,
        "position_tolerance": None if position_tolerance is None else _options.amount("position_tolerance", position_tolerance),
        "precision": _precision(field_bits, field_tolerance),
        "lossless": [] if isinstance(lossless, bool) else _options.names("lossless", lossless),
        "all_lossless": lossless is True,
        "displacement": None if displacement is None else _options.tolerance("displacement", displacement, 1.0),
        "displacement_edges": _between("displacement_edges", displacement_edges, 0, np.inf, "a number of at least 0"),
        "min_dihedral": _between("min_dihedral", min_dihedral, 0, 70, "0 to 70 degrees"),
        "feature_angle": _between("feature_angle", feature_angle, 1, 90, "1 to 90 degrees"),
        "preserve": _options.names("preserve", preserve),
        "preserve_within": None if preserve_within is None else _options.amount("preserve_within", preserve_within),
        "keep_points": [] if keep_points is None else _options.points("keep_points", keep_points).tolist(),
        "block_updates": block_updates,
    }
    data, text = _native.build(taken, options, progress)
    mt = open(data)
    mt.report = json.loads(text)
    if output is None:
        return mt
    mt.save(output)
    written = open(output)
    written.report = mt.report
    return written


def _between(name: str, value: float | None, least: float, most: float, what: str) -> float | None:
    if value is None:
        return None
    number = _options.number(name, value)
    if not least <= number <= most:
        raise bad_option(name, f"must be {what}; given: {value!r}")
    return number


def _precision(bits: Any, tolerance: Any) -> list[tuple[str | None, str, float]]:
    """How finely fields are kept: of all without a name, or of one; in bits, units, or fractions of the range."""
    if bits is not None and tolerance is not None and not isinstance(bits, Mapping) and not isinstance(tolerance, Mapping):
        raise bad_option("field_tolerance", "without names it is for all fields: give this or `field_bits`")
    found: list[tuple[str | None, str, float]] = []
    for name, value in _by_name(bits):
        place = "field_bits" if name is None else f"field_bits.{name}"
        found.append((name, "bits", float(_options.whole(place, value, 1, 24))))
    for name, value in _by_name(tolerance):
        place = "field_tolerance" if name is None else f"field_tolerance.{name}"
        unit = "fraction" if isinstance(value, str) else "units"
        found.append((name, unit, _options.tolerance(place, value, 1.0)))
    return found


def _labels(labels: Any) -> list[tuple[str, bool]]:
    """Which fields are labels, and which are not."""
    if labels is None:
        return []
    if not isinstance(labels, Mapping) or not all(isinstance(is_label, bool) for is_label in labels.values()):
        raise bad_option("labels", f"must be a mapping of names to True or False; given: {labels!r}")
    return [(str(name), is_label) for name, is_label in labels.items()]


def _by_name(value: Any) -> list[tuple[str | None, Any]]:
    if value is None:
        return []
    return list(value.items()) if isinstance(value, Mapping) else [(None, value)]


def _input(source: Any, cells: Any, point_data: Any, cell_data: Any) -> list[str] | tuple[str, bytes]:
    """Files, or the bytes of one, which the native module reads as any other."""
    is_path = isinstance(source, (str, os.PathLike))
    paths = [source] if is_path else source if isinstance(source, (list, tuple)) else []
    if is_path or paths and all(isinstance(path, (str, os.PathLike)) for path in paths):
        _alone(cells, point_data, cell_data, "a file")
        return [os.fspath(path) for path in paths]
    if hasattr(source, "IsA") and hasattr(source, "GetClassName"):
        _alone(cells, point_data, cell_data, "a data set of VTK")
        return _IN_MEMORY, _of_vtk(source)
    if hasattr(source, "points") and hasattr(source, "cells"):
        _alone(cells, point_data, cell_data, "a mesh of meshio")
        return _IN_MEMORY, _vtu.encoded(source.points, source.cells, source.point_data, source.cell_data)
    return _IN_MEMORY, _vtu.encoded(source, [] if cells is None else cells, point_data or {}, cell_data or {})


def _alone(cells: Any, point_data: Any, cell_data: Any, what: str) -> None:
    for name, value in (("cells", cells), ("point_data", point_data), ("cell_data", cell_data)):
        if value is not None:
            raise bad_option(name, f"goes with points; {what} has its own")


def _of_vtk(data: Any) -> bytes:
    """The bytes of the file that VTK writes of a grid: nothing of it is lost, whatever cells it has."""
    kind = next((kind for kind in _GRIDS if data.IsA(f"vtk{kind}")), None)
    if kind is None:
        is_parted = data.IsA("vtkCompositeDataSet")
        remedy = "build one of its blocks, or all as one: PyVista has `combine()`" if is_parted else "give a grid with cells that have a volume"
        raise TetralodError("unsupported", f"a {data.GetClassName()}; {remedy}")
    writer = getattr(importlib.import_module("vtkmodules.vtkIOXML"), f"vtkXML{kind}Writer")()
    writer.SetInputDataObject(data)
    writer.SetDataModeToAppended()
    writer.EncodeAppendedDataOff()
    writer.SetCompressorTypeToNone()
    writer.SetHeaderTypeToUInt64()
    writer.WriteToOutputStringOn()
    if not writer.Write():
        raise TetralodError("internal", f"VTK could not write the {data.GetClassName()}")
    # Bytes that happen to be UTF-8 come as a text.
    written: str | bytes = writer.GetOutputString()
    return written if isinstance(written, bytes) else written.encode()


_GRIDS = ("UnstructuredGrid", "StructuredGrid", "RectilinearGrid", "ImageData")
