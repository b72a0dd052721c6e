"""Arrays as the bytes of a VTK XML unstructured grid, which the readers of the library take as any other file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any
from xml.sax.saxutils import escape

import numpy as np
from numpy.typing import NDArray

from ._errors import bad_option
from . import _options

POLYHEDRON = 42

# Names of meshio, and VTK's numbers.
NUMBERS = {
    "vertex": 1, "line": 3, "triangle": 5, "polygon": 7, "pixel": 8, "quad": 9, "tetra": 10, "voxel": 11, "hexahedron": 12,
    "wedge": 13, "pyramid": 14, "penta_prism": 15, "hexa_prism": 16, "line3": 21, "triangle6": 22, "quad8": 23,
    "tetra10": 24, "hexahedron20": 25, "wedge15": 26, "pyramid13": 27, "quad9": 28, "hexahedron27": 29, "quad6": 30,
    "wedge12": 31, "wedge18": 32, "hexahedron24": 33, "triangle7": 34, "line4": 35, "polyhedron": POLYHEDRON,
    "VTK_LAGRANGE_CURVE": 68, "VTK_LAGRANGE_TRIANGLE": 69, "VTK_LAGRANGE_QUADRILATERAL": 70,
    "VTK_LAGRANGE_TETRAHEDRON": 71, "VTK_LAGRANGE_HEXAHEDRON": 72, "VTK_LAGRANGE_WEDGE": 73, "VTK_LAGRANGE_PYRAMID": 74,
    "VTK_BEZIER_CURVE": 75, "VTK_BEZIER_TRIANGLE": 76, "VTK_BEZIER_QUADRILATERAL": 77, "VTK_BEZIER_TETRAHEDRON": 78,
    "VTK_BEZIER_HEXAHEDRON": 79, "VTK_BEZIER_WEDGE": 80, "VTK_BEZIER_PYRAMID": 81,
}  # fmt: skip

# What XML would take for the end of an attribute, or for a space.
_QUOTED = {'"': "&quot;", "\n": "&#10;", "\r": "&#13;", "\t": "&#9;"}

# meshio turns the triangles of linear wedges around.
_ORDERS = {"wedge": [0, 2, 1, 3, 5, 4]}

Block = tuple[int, NDArray[np.int64], NDArray[np.int64], "NDArray[np.int64] | None", "NDArray[np.int64] | None"]
"""The type of some cells, the points of all one behind the other, and how many each has; of polyhedra also the lists of faces, and the length
of each."""


def encoded(points: Any, cells: Any, point_data: Mapping[str, Any], cell_data: Mapping[str, Any]) -> bytes:
    """The bytes of the file."""
    places = _options.numbers("points", points, (None, 3), "an array of shape (n, 3)") if np.size(points) else np.zeros((0, 3))
    blocks = [_block(kind, listed) for kind, listed in _blocks(cells)]
    counts = [len(lengths) for _, _, lengths, _, _ in blocks]
    file = _File()
    at_points = [file.array(name, _field(name, values, len(places))) for name, values in point_data.items()]
    at_cells = [
        file.array(name, _values(f"cell_data[{name!r}]", _joined(values, counts), sum(counts)))
        for name, values in cell_data.items()
    ]
    types = np.repeat([kind for kind, *_ in blocks], counts).astype(np.uint8) if blocks else np.zeros(0, np.uint8)
    of_cells = [
        file.array("connectivity", _concatenated([listed for _, listed, *_ in blocks])),
        file.array("offsets", np.cumsum(_concatenated([lengths for _, _, lengths, _, _ in blocks]))),
        file.array("types", types),
    ]
    if any(faces is not None for *_, faces, _ in blocks):
        of_cells += _faces(file, blocks)
    counted, at = (len(places), sum(counts)), file.array("Points", places)
    return b"".join(file.whole("2.2", counted, at_points, at_cells, at, of_cells))


def piece(points: Any, tets: Any, point_data: Mapping[str, Any]) -> list[Any]:
    """The file of tetrahedra alone, in parts: byte for byte that of `workflows/tetralod_part.h`."""
    places = _options.numbers("points", points, (None, 3), "an array of shape (n, 3)")
    cells = np.asarray(tets)
    if cells.ndim != 2 or cells.shape[1] != 4 or cells.dtype.kind not in "iu":
        raise bad_option("tets", f"must be an array of integers of shape (m, 4), not {cells.dtype} of shape {cells.shape}")
    outside = np.flatnonzero((cells < 0) | (cells >= len(places)))
    if outside.size:
        first = int(outside[0])
        raise bad_option("tets", f"tetrahedron {first // 4} has point {cells.flat[first]}, and there are {len(places)}")
    cells = cells if cells.dtype == np.int32 else cells.astype(np.int64, copy=False)
    file = _File()
    at_points = [file.array(name, _field(name, values, len(places))) for name, values in point_data.items()]
    at = file.array("Points", places)
    of_cells = [
        file.array("connectivity", cells.ravel()),
        file.array("offsets", np.arange(4, 4 * len(cells) + 1, 4, dtype=np.int64)),
        file.array("types", np.full(len(cells), NUMBERS["tetra"], dtype=np.uint8)),
    ]
    # The version that all programs read.
    return file.whole("1.0", (len(places), len(cells)), at_points, [], at, of_cells)


def pieces(count: int, point_data: Mapping[str, Any]) -> bytes:
    """The list of so many pieces, `piece-0.vtu` and so on."""
    named = [(name, np.atleast_1d(values)) for name, values in point_data.items()]
    arrays = [f"{_element('PDataArray', name, _field(name, values, len(values)))}/>\n" for name, values in named]
    sources = [f'<Piece Source="piece-{rank}.vtu"/>\n' for rank in range(count)]
    return (
        '<?xml version="1.0"?>\n<VTKFile type="PUnstructuredGrid" version="1.0" byte_order="LittleEndian" header_type="UInt64">\n'
        f'<PUnstructuredGrid GhostLevel="0">\n<PPointData>\n{"".join(arrays)}</PPointData>\n'
        f"<PPoints>\n{_element('PDataArray', 'Points', np.zeros((0, 3)))}/>\n</PPoints>\n"
        f"{''.join(sources)}</PUnstructuredGrid>\n</VTKFile>\n"
    ).encode()


class _File:
    """The data behind the XML."""

    def __init__(self) -> None:
        self.parts: list[Any] = []
        self.bytes = 0

    def array(self, name: str, values: NDArray[Any]) -> str:
        """Appends an array; returns its element."""
        values = np.ascontiguousarray(values, dtype=values.dtype.newbyteorder("<"))
        offset = self.bytes
        self.parts += [values.nbytes.to_bytes(8, "little"), values.data]
        self.bytes += 8 + values.nbytes
        return f'{_element("DataArray", name, values)} format="appended" offset="{offset}"/>\n'

    def whole(
        self,
        version: str,
        counts: tuple[int, int],
        at_points: Sequence[str],
        at_cells: Sequence[str],
        points: str,
        cells: Sequence[str],
    ) -> list[Any]:
        """The file, in parts, with the elements of its arrays. Before version 2.1 some cells have another order of points."""
        head = (
            f'<?xml version="1.0"?>\n<VTKFile type="UnstructuredGrid" version="{version}" byte_order="LittleEndian" header_type="UInt64">\n'
            f'<UnstructuredGrid>\n<Piece NumberOfPoints="{counts[0]}" NumberOfCells="{counts[1]}">\n'
            f"<PointData>\n{''.join(at_points)}</PointData>\n<CellData>\n{''.join(at_cells)}</CellData>\n"
            f"<Points>\n{points}</Points>\n<Cells>\n{''.join(cells)}</Cells>\n"
            '</Piece>\n</UnstructuredGrid>\n<AppendedData encoding="raw">\n_'
        )
        return [head.encode(), *self.parts, b"\n</AppendedData>\n</VTKFile>\n"]


def _element(element: str, name: str, values: NDArray[Any]) -> str:
    """The beginning of the element of an array."""
    kind = {"i": "Int", "u": "UInt", "f": "Float"}[values.dtype.kind] + str(8 * values.dtype.itemsize)
    components = values.shape[1] if values.ndim == 2 else 1
    return f'<{element} type="{kind}" Name="{escape(name, _QUOTED)}" NumberOfComponents="{components}"'


def _blocks(cells: Any) -> list[tuple[Any, Any]]:
    """Types of cells, and the points of each."""
    if isinstance(cells, Mapping):
        return list(cells.items())
    listed = list(cells) if not isinstance(cells, np.ndarray) else []
    if all(hasattr(block, "type") and hasattr(block, "data") for block in listed) and listed:
        return [(block.type, block.data) for block in listed]
    is_pair = [isinstance(block, (tuple, list)) and len(block) == 2 for block in listed]
    if listed and all(is_pair) and all(isinstance(kind, (str, int, np.integer)) for kind, _ in listed):
        return listed
    return [("tetra", cells)] if np.size(cells) else []


def _block(kind: Any, listed: Any) -> Block:
    name = kind if isinstance(kind, str) else ""
    # meshio calls polyhedra by their number of points.
    known = "polyhedron" if name.startswith("polyhedron") else name
    number = NUMBERS.get(known) if name else int(kind)
    if number is None or not 0 <= number < 256:
        raise bad_option("cells", f"there is no type of cells {kind!r}: give VTK's number, or one of {', '.join(NUMBERS)}")
    if number == POLYHEDRON:
        return _polyhedra(listed)
    try:
        array = np.asarray(listed)
        if array.size == 0:
            array = np.zeros((0, 1), dtype=np.int64)
        if array.ndim != 2 or array.dtype.kind not in "iu":
            raise ValueError
    except ValueError:
        raise bad_option("cells", f"the cells of type {kind!r} must be an array of integers (cells, points of a cell)") from None
    if name == "tetra" and array.shape[0] and array.shape[1] != 4:
        raise bad_option("cells", f"tetrahedra must be an array of shape (m, 4), not {array.shape}")
    if known in _ORDERS and array.shape[1] == len(_ORDERS[known]):
        array = array[:, _ORDERS[known]]
    lengths = np.full(len(array), array.shape[1], dtype=np.int64)
    return number, array.astype(np.int64).ravel(), lengths, None, None


def _polyhedra(listed: Any) -> Block:
    points: list[int] = []
    lengths: list[int] = []
    faces: list[int] = []
    face_lengths: list[int] = []
    try:
        for cell in listed:
            own = [[int(point) for point in face] for face in cell]
            used = sorted({point for face in own for point in face})
            points += used
            lengths.append(len(used))
            before = len(faces)
            faces.append(len(own))
            for face in own:
                faces += [len(face), *face]
            face_lengths.append(len(faces) - before)
    except (TypeError, ValueError):
        raise bad_option("cells", "a polyhedron must be a list of faces, each a list of points") from None
    arrays = [np.array(numbers, dtype=np.int64) for numbers in (points, lengths, faces, face_lengths)]
    return POLYHEDRON, arrays[0], arrays[1], arrays[2], arrays[3]


def _faces(file: _File, blocks: Sequence[Block]) -> list[str]:
    """The faces of polyhedra, and where those of each cell end; -1 for other cells."""
    numbers: list[NDArray[np.int64]] = []
    ends: list[NDArray[np.int64]] = []
    end = 0
    for _, _, lengths, faces, face_lengths in blocks:
        if faces is None or face_lengths is None:
            ends.append(np.full(len(lengths), -1, dtype=np.int64))
            continue
        numbers.append(faces)
        ends.append(end + np.cumsum(face_lengths))
        end += len(faces)
    return [file.array("faces", _concatenated(numbers)), file.array("faceoffsets", _concatenated(ends))]


def _concatenated(arrays: Sequence[NDArray[np.int64]]) -> NDArray[np.int64]:
    return np.concatenate(arrays) if arrays else np.zeros(0, dtype=np.int64)


def _joined(values: Any, counts: list[int]) -> Any:
    """Values at the cells of all blocks, which may come as a list with an array for each."""
    is_list = isinstance(values, (list, tuple)) and bool(values)
    if is_list and [len(one) if np.ndim(one) > 0 else -1 for one in values] == counts:
        return np.concatenate([np.asarray(one) for one in values])
    return values


def _field(name: str, values: Any, count: int) -> NDArray[Any]:
    return _values(f"point_data[{name!r}]", values, count)


def _values(name: str, values: Any, count: int) -> NDArray[Any]:
    array = np.asarray(values)
    if array.dtype.kind == "b":
        array = array.astype(np.uint8)
    if array.dtype == np.float16:
        array = array.astype(np.float32)
    if array.dtype.kind not in "iuf" or array.dtype.itemsize > 8:
        raise bad_option(name, f"must be real numbers, not {array.dtype}")
    if array.ndim not in (1, 2) or len(array) != count:
        raise bad_option(name, f"must have {count} rows: ({count},) or ({count}, components); its shape is {array.shape}")
    return array
