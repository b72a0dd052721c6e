"""Small files of formats that VTK reads and we do not, written as their specifications say."""

from pathlib import Path

import h5py
import numpy as np

HEAD = """FoamFile
{{
    version 2.0;
    format ascii;
    class {kind};
    object {name};
}}
"""


def two_cubes():
    """The points and hexahedra of two unit cubes side by side along x."""
    points = np.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1, 2)], dtype=float)
    return points, np.array([[0, 1, 4, 3, 6, 7, 10, 9], [1, 2, 5, 4, 7, 8, 11, 10]])


def write_openfoam(case):
    """A case of two cubes at time 0.5, with `p` 1 and 3 in them and a uniform `U`."""
    points, cells = two_cubes()
    corners = [[0, 4, 7, 3], [1, 2, 6, 5], [0, 1, 5, 4], [3, 7, 6, 2], [0, 3, 2, 1], [4, 5, 6, 7]]
    # The face between the cubes comes first, and faces away from the first.
    between = cells[0][corners[1]].tolist()
    outer = [(cell, cells[cell][face].tolist()) for cell in (0, 1) for face in corners]
    outer = [(cell, face) for cell, face in outer if set(face) != set(between)]
    faces = [between, *(face for _, face in outer)]
    owner = [0, *(cell for cell, _ in outer)]

    def write(path, kind, text):
        file = Path(case, path)
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(HEAD.format(kind=kind, name=file.name) + text)

    def listed(rows):
        return f"{len(rows)}\n(\n" + "\n".join(rows) + "\n)\n"

    write("constant/polyMesh/points", "vectorField", listed(["({} {} {})".format(*point) for point in points]))
    write("constant/polyMesh/faces", "faceList", listed(["4({} {} {} {})".format(*face) for face in faces]))
    write("constant/polyMesh/owner", "labelList", listed([str(cell) for cell in owner]))
    write("constant/polyMesh/neighbour", "labelList", listed(["1"]))
    wall = f"walls\n{{\n    type wall;\n    nFaces {len(outer)};\n    startFace 1;\n}}"
    write("constant/polyMesh/boundary", "polyBoundaryMesh", f"1\n(\n{wall}\n)\n")
    write("system/controlDict", "dictionary", "startTime 0;\nendTime 1;\ndeltaT 0.5;\nwriteInterval 1;\n")
    boundary = "boundaryField\n{\n    walls\n    {\n        type zeroGradient;\n    }\n}\n"
    write("0.5/p", "volScalarField", f"dimensions [0 2 -2 0 0 0 0];\ninternalField nonuniform List<scalar> 2(1 3);\n{boundary}")
    write("0.5/U", "volVectorField", f"dimensions [0 1 -1 0 0 0 0];\ninternalField uniform (1 2 3);\n{boundary}")
    Path(case, "case.foam").touch()


def write_cgns(path):
    """Two zones of two cubes each, one behind the other along x, with the pressure x + y at their points."""
    points, cells = two_cubes()
    with h5py.File(path, "w") as file:
        _describe(file, "HDF5 MotherNode", "Root Node of HDF5 File", "MT")
        file.create_dataset(" format", data=np.frombuffer(b"IEEE_LITTLE_32\0", dtype=np.int8))
        file.create_dataset(" hdf5version", data=np.frombuffer(b"HDF5 Version 1.8.0".ljust(33, b"\0"), dtype=np.int8))
        _node(file, "CGNSLibraryVersion", "CGNSLibraryVersion_t", np.array([4.2], dtype=np.float32))
        base = _node(file, "Base", "CGNSBase_t", np.array([3, 3], dtype=np.int32))
        for number in (0, 1):
            places = points + [2.0 * number, 0, 0]
            sizes = np.array([[len(places)], [len(cells)], [0]], dtype=np.int32)
            zone = _node(base, f"Zone{number + 1}", "Zone_t", sizes)
            _node(zone, "ZoneType", "ZoneType_t", "Unstructured")
            coordinates = _node(zone, "GridCoordinates", "GridCoordinates_t")
            for axis, name in enumerate("XYZ"):
                _node(coordinates, f"Coordinate{name}", "DataArray_t", places[:, axis].copy())
            # Hexahedra of eight points are number 17.
            elements = _node(zone, "Hexahedra", "Elements_t", np.array([17, 0], dtype=np.int32))
            _node(elements, "ElementRange", "IndexRange_t", np.array([1, len(cells)], dtype=np.int32))
            _node(elements, "ElementConnectivity", "DataArray_t", (cells.ravel() + 1).astype(np.int32))
            solution = _node(zone, "Solution", "FlowSolution_t")
            _node(solution, "GridLocation", "GridLocation_t", "Vertex")
            _node(solution, "Pressure", "DataArray_t", places[:, 0] + places[:, 1])


def _describe(group, name, label, kind):
    for key, text, length in (("name", name, 33), ("label", label, 33), ("type", kind, 3)):
        group.attrs.create(key, np.bytes_(text), dtype=f"S{length}")


def _node(parent, name, label, data=None):
    """A node of the tree that CGNS is, as HDF5 holds it."""
    kinds = {"int8": "C1", "int32": "I4", "float32": "R4", "float64": "R8"}
    data = np.frombuffer(data.encode(), dtype=np.int8) if isinstance(data, str) else data
    group = parent.create_group(name)
    _describe(group, name, label, "MT" if data is None else kinds[str(data.dtype)])
    group.attrs.create("flags", np.array([1], dtype=np.int32))
    if data is not None:
        group.create_dataset(" data", data=data)
    return group
