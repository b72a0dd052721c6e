"""Writes pieces.vtkhdf, cells.vtkhdf, polyhedra.vtkhdf, steps.vtkhdf, image.vtkhdf, dense.vtkhdf, netcdf4.exo, and two files with groups in circles: small files in
HDF5 in the layouts that programs write.

Needs h5py. The same calls give the same bytes.
"""

import h5py
import numpy as np

CUBE = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]]


def root(name, kind, libver):
    """A file with the group and the attributes that all of VTK's have."""
    file = h5py.File(name, "w", libver=libver)
    group = file.create_group("VTKHDF")
    group.attrs["Version"] = np.array([2, 1], "i8")
    group.attrs.create("Type", np.bytes_(kind))
    return file, group


def pieces():
    """Two cubes side by side as pieces, in chunks behind shuffle and deflate, in the oldest layout (superblock 0, B-trees 1)."""
    file, group = root("pieces.vtkhdf", "UnstructuredGrid", "earliest")
    packed = {"chunks": True, "compression": "gzip", "shuffle": True}
    points = np.array(CUBE + [[x + 1, y, z] for x, y, z in CUBE], "f4")
    group["NumberOfPoints"] = np.array([8, 8], "i8")
    group["NumberOfCells"] = np.array([1, 2], "i8")
    group["NumberOfConnectivityIds"] = np.array([8, 12], "i8")
    group.create_dataset("Points", data=points, **packed)
    group["Connectivity"] = np.array([*range(8), *range(8), 0, 1, 2, 3], "i4")
    group["Offsets"] = np.array([0, 8, 0, 8, 12], "i4")
    group["Types"] = np.array([12, 12, 9], "u1")
    at_points, at_cells = group.create_group("PointData"), group.create_group("CellData")
    at_points.create_dataset("sum", data=points.sum(1).astype(">f8"), **packed)
    at_points["v"] = points * 2
    at_cells["material"] = np.array([3, 5, 7], "u2")
    file.close()


def cells():
    """Four cubes in a row, one of them as tetrahedra, between them a square: one piece, in small chunks."""
    file, group = root("cells.vtkhdf", "UnstructuredGrid", ("v110", "v110"))
    points = np.array([[x, y, z] for x in range(5) for y in (0, 1) for z in (0, 1)], "f8")
    cube = np.array([0, 4, 6, 2, 1, 5, 7, 3])
    tets = [[0, 1, 3, 7], [0, 1, 7, 5], [0, 2, 7, 3], [0, 2, 6, 7], [0, 4, 5, 7], [0, 4, 7, 6]]
    listed = [cube, cube[:4], *(np.array(tets) + 4), cube + 8, cube + 12]
    for name, number in {"Points": 20, "Cells": len(listed), "ConnectivityIds": sum(map(len, listed))}.items():
        group[f"NumberOf{name}"] = np.array([number], "i8")
    group.create_dataset("Points", data=points, chunks=(3, 3), compression="gzip")
    group.create_dataset("Connectivity", data=np.concatenate(listed).astype("u4"), chunks=(5,), compression="gzip")
    group["Offsets"] = np.cumsum([0, *map(len, listed)]).astype("i8")
    group["Types"] = np.array([12, 9, *[10] * 6, 12, 12], "u1")
    at_points = group.create_group("PointData")
    at_points["sum"], at_points["v"] = points.sum(1), (points * 2).astype("f4")
    group.create_group("CellData")["material"] = np.arange(len(listed), dtype="u2")
    file.close()


def polyhedra():
    """A cube as a hexahedron and one as a polyhedron on it, at two times as two pieces each; the second time is twice as high."""
    file, group = root("polyhedra.vtkhdf", "UnstructuredGrid", "latest")
    group.attrs["Version"] = np.array([2, 5], "i8")
    quads = [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]]
    cube = np.array(CUBE)
    counts = {"Points": [8, 8], "Cells": [1, 1], "ConnectivityIds": [8, 8], "Faces": [0, 6]}
    counts |= {"FaceConnectivityIds": [0, 24], "PolyhedronToFaceIds": [0, 6]}
    for name, numbers in counts.items():
        group[f"NumberOf{name}"] = np.array(2 * numbers, "i8")
    group["Points"] = np.concatenate([cube * [1, 1, h] + [0, 0, h * z] for h in (1, 2) for z in (0, 1)]).astype("f8")
    group["Connectivity"] = np.array([*range(8)] * 4, "i8")
    group["Offsets"] = np.array([0, 8] * 4, "i8")
    group["Types"] = np.array([12, 42] * 2, "u1")
    group["FaceConnectivity"] = np.array(2 * quads, "i8").ravel()
    group["FaceOffsets"] = np.array(2 * [0, 0, 4, 8, 12, 16, 20, 24], "i8")
    group["PolyhedronToFaces"] = np.array(2 * [*range(6)], "i8")
    group["PolyhedronOffsets"] = np.array(2 * [0, 0, 0, 6], "i8")
    group.create_group("PointData")["z"] = group["Points"][:, 2]
    times = group.create_group("Steps")
    times.attrs["NSteps"] = 2
    times["Values"] = np.array([0.0, 1.0])
    times["NumberOfParts"] = np.array([2, 2], "i8")
    beginnings = {"PartOffsets": 2, "PointOffsets": 16, "CellOffsets": 2, "ConnectivityIdOffsets": 16}
    beginnings |= {"FaceConnectivityOffsets": 24, "PolyhedronToFaceIdOffsets": 6, "FaceOffsetsOffsets": 6}
    for name, second in beginnings.items():
        times[name] = np.array([0, second], "i8")
    times.create_group("PointDataOffsets")["z"] = np.array([0, 16], "i8")
    file.close()


def steps():
    """A tetrahedron at three times, in the layout of HDF5 1.10 (superblock 3, fixed arrays of chunks)."""
    file, group = root("steps.vtkhdf", "UnstructuredGrid", ("v110", "v110"))
    for name, number in {"Points": 4, "Cells": 1, "ConnectivityIds": 4}.items():
        group[f"NumberOf{name}"] = np.array([number], "i8")
    group["Points"] = np.array([CUBE[0], CUBE[1], CUBE[3], CUBE[4]], "f8")
    group["Connectivity"], group["Offsets"] = np.arange(4), np.array([0, 4])
    group["Types"] = np.array([10], "u1")
    values = np.arange(12, dtype="f4")
    group.create_group("PointData").create_dataset("p", data=values, chunks=(4,), compression="gzip")
    times = group.create_group("Steps")
    times.attrs["NSteps"] = 3
    times["Values"] = np.array([0.0, 0.5, 2.0])
    for name in ["PartOffsets", "PointOffsets", "CellOffsets", "ConnectivityIdOffsets"]:
        times[name] = np.zeros(3, "i8")
    times["NumberOfParts"] = np.ones(3, "i8")
    times.create_group("PointDataOffsets")["p"] = np.array([0, 4, 8])
    file.close()


def image():
    """A grid of 3 x 2 x 2 points whose first index is not 0."""
    file, group = root("image.vtkhdf", "ImageData", "earliest")
    group.attrs["WholeExtent"] = np.array([1, 3, 0, 1, 0, 1], "i4")
    group.attrs["Origin"], group.attrs["Spacing"] = np.zeros(3), np.array([0.5, 1.0, 2.0])
    group.attrs["Direction"] = np.eye(3).ravel()
    group.create_group("PointData")["density"] = np.arange(12, dtype="u1").reshape(2, 2, 3)
    group.create_group("CellData")["cube"] = np.array([[[4.0, 6.0]]])
    file.close()


def exodus():
    """A tetrahedron of Exodus in netCDF-4, with one variable at two times."""
    file = h5py.File("netcdf4.exo", "w", libver=("v110", "v110"))
    sizes = {"num_dim": 3, "num_nodes": 4, "num_el_in_blk1": 1, "num_nod_per_el1": 4, "time_step": 2}
    sizes |= {"num_nod_var": 1, "len_name": 8}
    for number, (name, size) in enumerate(sizes.items()):
        most = (None,) if name == "time_step" else (size,)
        scale = file.create_dataset(name, (size,), ">f4", maxshape=most, chunks=(2,) if most == (None,) else None)
        scale.make_scale(f"This is a netCDF dimension but not a netCDF variable. {size:9}")
        scale.attrs["_Netcdf4Dimid"] = np.int32(number)

    def variable(name, dimensions, values):
        data = file.create_dataset(name, data=values)
        for axis, dimension in enumerate(dimensions):
            data.dims[axis].attach_scale(file[dimension])
        return data

    corners = np.array([CUBE[0], CUBE[1], CUBE[3], CUBE[4]], "f8")
    for axis, values in zip("xyz", corners.T):
        variable(f"coord{axis}", ["num_nodes"], values)
    cells = variable("connect1", ["num_el_in_blk1", "num_nod_per_el1"], np.array([[1, 2, 3, 4]]))
    cells.attrs["elem_type"] = np.bytes_("TETRA")
    variable("time_whole", ["time_step"], np.array([0.0, 1.5]))
    variable("name_nod_var", ["num_nod_var", "len_name"], np.array([list("heat\0\0\0\0")], "S1"))
    variable("vals_nod_var1", ["time_step", "num_nodes"], np.arange(8.0).reshape(2, 4))
    file.close()


def dense():
    """Groups with many members and attributes (heaps, B-trees 2), and arrays in each way of finding chunks, behind all filters."""
    file, group = root("dense.vtkhdf", "UnstructuredGrid", "latest")
    for name, number in {"Points": 4, "Cells": 1, "ConnectivityIds": 4}.items():
        group[f"NumberOf{name}"] = np.array([number], "i8")
    group["Points"] = np.array([CUBE[0], CUBE[1], CUBE[3], CUBE[4]], "f8")
    group["Connectivity"], group["Offsets"] = np.arange(4), np.array([0, 4])
    group["Types"] = np.array([10], "u1")
    at_points = group.create_group("PointData")
    values = np.arange(4, dtype="f4")
    at_points.create_dataset("growing", data=values, chunks=(1,), maxshape=(None,), fletcher32=True)
    both = {"chunks": (1, 1), "maxshape": (None, None)}
    at_points.create_dataset("wide", data=np.arange(8, dtype="i4").reshape(4, 2), **both)
    at_points.create_dataset("fixed", data=values, chunks=(2,), maxshape=(9,), scaleoffset=2)
    at_points.create_dataset("one", data=values, chunks=(4,), shuffle=True, compression="gzip")
    for number in range(8):
        at_points[f"more{number}"] = values
        at_points["one"].attrs[f"note{number}"] = np.array([number, number])
        at_points["one"].attrs[f"text{number}"] = "x" * number
    file.close()


def cycles():
    """A group that is its own member, and forty from each of which two ways lead to the next."""
    with h5py.File("own_root.exo", "w", libver="latest") as file:
        file["again"] = file["/"]
    with h5py.File("many_ways.exo", "w", libver="latest") as file:
        group = file
        for _ in range(40):
            child = group.create_group("a")
            group["b"] = child
            group = child


for write in [pieces, cells, polyhedra, steps, image, dense, exodus, cycles]:
    write()
