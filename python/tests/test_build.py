"""Promise: what goes in comes out, and a mesh in memory becomes the file that the command builds of its file."""

import json
import pickle

import meshio
import numpy as np
import pytest
import pyvista as pv
from conftest import command, grid_points, hexahedra

import tetralod


def volumes(points, tets):
    a, b, c, d = np.asarray(points, dtype=float)[np.asarray(tets, dtype=np.int64)].transpose(1, 0, 2)
    return np.einsum("ij,ij->i", np.cross(b - a, c - a), d - a) / 6


def mixed_grid():
    """A cell of each of many types, far from one another, with values at points and cells."""
    types, cells, points = [], [], []

    def add(kind, places, listed=None):
        first = len(points)
        points.extend(np.asarray(places, dtype=float) + [3.0 * len(types), 0, 0])
        types.append(kind)
        listed = range(len(places)) if listed is None else listed
        cells.append([len(list(listed)), *(first + place for place in listed)])

    tetrahedron = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    cube = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]])
    add(pv.CellType.TETRA, tetrahedron)
    add(pv.CellType.HEXAHEDRON, cube)
    add(pv.CellType.WEDGE, [[0, 0, 0], [0, 1, 0], [1, 0, 0], [0, 0, 1], [0, 1, 1], [1, 0, 1]])
    add(pv.CellType.PYRAMID, [*cube[:4], [0.5, 0.5, 1]])
    edges = [(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)]
    add(pv.CellType.QUADRATIC_TETRA, [*tetrahedron, *(tetrahedron[list(edge)].mean(axis=0) for edge in edges)])
    add(pv.CellType.TRIANGLE, tetrahedron[:3])
    points = np.array(points)
    grid = pv.UnstructuredGrid(np.concatenate(cells), np.array(types), points)
    grid.point_data["p"] = points @ [1.0, 2.0, 4.0]
    grid.point_data["u"] = np.column_stack([points[:, 1], points[:, 0] / 8, points[:, 2] ** 2])
    grid.cell_data["part"] = np.arange(grid.n_cells, dtype=np.int32)
    return grid


def polyhedron():
    """A cube that lists its faces, as points and faces."""
    points = grid_points(2)
    faces = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    return points, faces


def built_by_command(path, *options):
    command("build", path, "-o", "command.mt", "--quiet", *options)
    with open("command.mt", "rb") as file:
        return file.read()


def bytes_of(mt):
    mt.save("saved.mt")
    with open("saved.mt", "rb") as file:
        return file.read()


def test_arrays_come_back():
    points, cells = grid_points(5), hexahedra(5)
    x, y, z = points.T
    data = {"p": x + 2 * y + 4 * z, "u": points[:, ::-1], "label": np.arange(len(x), dtype=np.int16)}
    # Sixteenths are on the lattice, and 16 bits hold all values exactly.
    mt = tetralod.build(points, [(12, cells)], data, all_fields=True)
    mesh = mt.refine(error=0)
    assert mesh.points.shape == (125, 3) and mesh.tets.shape == (6 * 64, 4)
    order, expected = np.lexsort(mesh.points.T), np.lexsort(points.T)
    loss = {name: max(f.floor for f in mt.info.fields if name in (f.name, f.vector and f.vector.name)) for name in data}
    assert np.abs(mesh.points[order] - points[expected]).max() <= mesh.stats.boundary_bound + 1e-12
    assert np.abs(mesh.points[order] - points[expected]).max() < 1e-4
    for name, values in data.items():
        assert mesh.point_data[name].shape == values.shape
        assert np.abs(mesh.point_data[name][order] - values[expected]).max() <= loss[name] + 1e-12, name
    assert np.array_equal(mesh.point_data["label"][order], data["label"][expected])
    own = volumes(mesh.points, mesh.tets)
    assert (own > 0).all() and own.sum() == pytest.approx(1)
    # Neighbours share three points.
    for i in range(4):
        there = mesh.neighbors[:, i] != 0xFFFFFFFF
        ours, theirs = mesh.tets[there], mesh.tets[mesh.neighbors[there, i]]
        assert all(len(set(a) & set(b)) == 3 for a, b in zip(ours.tolist(), theirs.tolist()))


def test_exact_values_come_back():
    points = grid_points(4)
    values = np.sin(7 * points).sum(axis=1)
    mt = tetralod.build(points, {12: hexahedra(4)}, {"f": values}, lossless=True)
    assert mt.info.exact_values == "here"
    mesh = mt.refine(error=0, exact=True)
    order, expected = np.lexsort(mesh.points.T), np.lexsort(points.T)
    assert np.array_equal(mesh.point_data["f"][order], values[expected])
    rounded = mt.refine(error=0).point_data["f"][order]
    assert 0 < np.abs(rounded - values[expected]).max() <= mt.info.fields[0].floor


@pytest.mark.parametrize("options", [{}, {"all_fields": True, "cell_to_point": True, "preserve": ["part"]}])
def test_a_mesh_of_pyvista_or_meshio_is_built_as_its_file(folder, options):
    grid = mixed_grid()
    grid.save("mixed.vtu")
    words = ["--all-fields", "--cell-to-point", "--preserve", "part"] if options else []
    expected = built_by_command("mixed.vtu", *words)
    mt = tetralod.build(grid, **options)
    assert mt.report["notes"] == ["left out: 1 triangle"]
    assert bytes_of(mt) == expected
    assert bytes_of(tetralod.build("mixed.vtu", **options)) == expected
    mesh = meshio.read("mixed.vtu")
    assert {block.type for block in mesh.cells} >= {"tetra10", "wedge", "pyramid"}
    assert bytes_of(tetralod.build(mesh, **options)) == expected
    arrays = tetralod.build(mesh.points, mesh.cells, mesh.point_data, mesh.cell_data, **options)
    assert bytes_of(arrays) == expected


def test_fields_at_cells_keep_their_jump_between_regions():
    points, cells = grid_points(7), hexahedra(7)
    left = points[cells].mean(axis=1)[:, 0] < 0.5
    data = {"part": np.where(left, 3, 8), "m": np.where(left, 10.0, -4.0)}
    options = {"preserve": ["part"], "cell_to_point": True, "fields": ["m"]}
    mt = tetralod.build(points, {12: cells}, {}, data, **options)
    assert mt.report["averaged"][0]["difference"]["largest"] < 1e-12
    for error in (0, "10%"):
        mesh = mt.refine(error=error)
        part, values = np.asarray(mesh.cell_data["part"]), mesh.point_data["m"]
        assert np.allclose(values[mesh.tets], np.where(part == 3, 10, -4)[:, None], atol=1e-3)
        # At the interface there are two points at each place, and tetrahedra know those behind it.
        at = mesh.points[np.isclose(mesh.points[:, 0], 0.5)]
        assert len(at) == 2 * len(np.unique(at, axis=0)) > 0
        behind = mesh.neighbors[part == 3]
        assert (part[behind[behind != 0xFFFFFFFF]] == 8).any()
        assert mesh.boundary().to_pyvista().area == pytest.approx(6, abs=1e-3)
    one = tetralod.build(points, {12: cells}, {}, data, mean_across_regions=True, **options).refine(error=0)
    assert len(one.points) == len(points)
    assert np.allclose(one.point_data["m"][np.isclose(one.points[:, 0], 0.5)], 3, atol=1e-3)


def test_polyhedra_are_built_as_their_file(folder):
    points, faces = polyhedron()
    lists = np.concatenate([[len(faces)], *([len(face), *face] for face in faces)])
    grid = pv.UnstructuredGrid(np.concatenate([[len(lists)], lists]), [pv.CellType.POLYHEDRON], points)
    grid.point_data["p"] = points @ [1.0, 2.0, 4.0]
    grid.save("cube.vtu")
    expected = built_by_command("cube.vtu")
    assert bytes_of(tetralod.build(grid)) == expected
    data = {"p": points @ [1.0, 2.0, 4.0]}
    for kind in ("polyhedron", "polyhedron8", 42):
        mt = tetralod.build(points, [(kind, [faces])], data)
        assert bytes_of(mt) == expected
    both = np.vstack([points, points + 2])
    beside = tetralod.build(both, [("polyhedron", [faces]), ("hexahedron", hexahedra(2) + 8)], fields=["x"])
    assert beside.refine().field_stats().volume == pytest.approx(2, rel=1e-3)


@pytest.mark.parametrize("kind", ["ImageData", "RectilinearGrid", "StructuredGrid"])
def test_grids_are_built_as_their_files(folder, kind):
    image = pv.ImageData(dimensions=(5, 4, 3), spacing=(1, 2, 0.5))
    image.point_data["f"] = np.arange(60.0)
    grid = {
        "ImageData": lambda: image,
        "RectilinearGrid": lambda: image.cast_to_rectilinear_grid(),
        "StructuredGrid": lambda: image.cast_to_structured_grid(),
    }[kind]()
    name = {"ImageData": "a.vti", "RectilinearGrid": "a.vtr", "StructuredGrid": "a.vts"}[kind]
    grid.save(name)
    assert bytes_of(tetralod.build(grid)) == built_by_command(name)


def test_the_report_is_that_of_the_command(folder):
    mixed_grid().save("mixed.vtu")
    told = json.loads(command("build", "mixed.vtu", "-o", "a.mt", "--json", "--cell-to-point", "--field", "part"))
    mt = tetralod.build("mixed.vtu", cell_to_point=True, fields=["part"], output="b.mt")
    same = [name for name in told if name != "seconds"]
    assert {name: mt.report[name] for name in same} == {name: told[name] for name in same}
    assert mt.info.file_bytes == told["file_bytes"] and "b.mt" in repr(mt)
    with pytest.raises(tetralod.TetralodError) as caught:
        mt.save("c.mt")
    assert caught.value.code == "bad-source"


def test_labels_at_points_are_those_of_most_volume_around(folder):
    rng = np.random.default_rng(5)
    grid = pv.UnstructuredGrid({pv.CellType.HEXAHEDRON: hexahedra(5)}, grid_points(5) ** 2)
    grid.cell_data["cluster_id"] = rng.integers(-3, 4, grid.n_cells, dtype=np.int32)
    grid.cell_data["load"] = grid.cell_data["cluster_id"]
    grid.save("cells.vtu")
    corners = grid.cell_connectivity.reshape(-1, 8)
    volumes = np.abs(grid.compute_cell_sizes()["Volume"])
    labels = np.unique(grid.cell_data["cluster_id"])
    around = np.zeros((grid.n_points, len(labels)))
    which = np.searchsorted(labels, grid.cell_data["cluster_id"])
    np.add.at(around, (corners, which[:, None]), volumes[:, None])
    most = around.max(axis=1, keepdims=True)
    expected = labels[(around >= most * (1 - 1e-12)).argmax(axis=1)]
    clear = (around > most * (1 - 1e-9)).sum(axis=1) == 1
    mt = tetralod.build("cells.vtu", cell_to_point=True, all_fields=True, labels={"load": False})
    assert [field.is_label for field in mt.info.fields] == [True, False]
    assert mt.info.fields[mt.info.first_field].name == "load"
    mesh = mt.refine(error=0)
    found, wanted = np.lexsort(mesh.points.T), np.lexsort(grid.points.T)
    assert np.array_equal(mesh.point_data["cluster_id"][found][clear[wanted]], expected[wanted][clear[wanted]])
    assert clear.sum() > 40
    # Between points there is no other label, and that of a point beside it.
    places = rng.random((500, 3))
    values = mesh.probe(places)
    assert set(values["cluster_id"]) <= set(labels.tolist())
    assert len(set(values["load"])) > 100
    near = mesh.points + 1e-4 * (0.5 - mesh.points)
    assert np.array_equal(mesh.probe(near)["cluster_id"], mesh.point_data["cluster_id"])
    assert bytes_of(mt) == built_by_command("cells.vtu", "--cell-to-point", "--all-fields", "--no-label", "load")
    for wrong in ({"nothing": True}, ["load"], {"load": 1}):
        with pytest.raises(tetralod.TetralodError) as caught:
            tetralod.build("cells.vtu", cell_to_point=True, labels=wrong)
        assert caught.value.code == "bad-option"


def test_time_steps_are_one_field(folder):
    points, cells = grid_points(4), {12: hexahedra(4)}
    for number in range(2):
        grid = pv.UnstructuredGrid({pv.CellType.HEXAHEDRON: cells[12]}, points)
        grid.point_data["T"] = points[:, 0] + number
        grid.point_data["u"] = points * (1 + number)
        grid.field_data["TimeValue"] = [0.5 + number]
        grid.save(f"step{number}.vtu")
    mt = tetralod.build(["step0.vtu", "step1.vtu"], all_fields=True)
    assert [field.time for field in mt.info.fields if field.name == "T"] == [0.5, 1.5]
    mesh = mt.refine(error=0)
    assert set(mesh.point_data) == {"T@0.5", "T@1.5", "u@0.5", "u@1.5"} and mesh.point_data["u@1.5"].shape == (64, 3)
    later = mt.refine(error=0, field="T", time=1.5)
    assert set(later.point_data) == {"T", "u"}
    assert np.allclose(later.point_data["T"], later.points[:, 0] + 1, atol=1e-4)
    assert np.allclose(later.probe([[0.5, 0.5, 0.5]])["u"], [[1, 1, 1]], atol=1e-3)
    one = tetralod.build(["step0.vtu", "step1.vtu"], step=1)
    assert [field.time for field in one.info.fields] == [1.5]
    with pytest.raises(tetralod.TetralodError, match="option `time`: 'T' has no time step at 2; its times are 0.5, 1.5"):
        mt.refine(time=2)


@pytest.mark.parametrize(
    ("options", "code", "words"),
    [
        ({"kind": "face"}, "bad-option", "option `kind`: must be one of"),
        ({"kind": "edge", "method": "decimate"}, "bad-option", "edge"),
        ({"fields": ["q"]}, "bad-option", "'q'"),
        ({"fields": "f"}, "bad-option", "option `fields`: must be a list of names"),
        ({"position_bits": 31}, "bad-option", "option `position_bits`: must be an integer from 1 to 30"),
        ({"position_bits": 16, "position_tolerance": 1}, "bad-option", "option `position_tolerance`"),
        ({"field_bits": {"f": 0}}, "bad-option", r"option `field_bits\.f`"),
        ({"field_bits": 8, "field_tolerance": "1%"}, "bad-option", "option `field_tolerance`"),
        ({"field_tolerance": "1"}, "bad-option", "option `field_tolerance`: must be a number, or a percentage"),
        ({"units": {"q": "m"}}, "bad-option", "option `units`: there is no field 'q'"),
        ({"metadata": {"": "m"}}, "bad-option", "option `metadata`"),
        ({"block_updates": 100}, "bad-option", "option `block_updates`: must be a power of two"),
        ({"weld_distance": 1.0}, "bad-option", "option `weld_distance`: goes with repair"),
        ({"min_dihedral": 71}, "bad-option", "option `min_dihedral`: must be 0 to 70 degrees"),
        ({"step": -1}, "bad-option", "option `step`"),
        ({"keep_points": [[0, 0]]}, "bad-option", r"option `keep_points`: must be points: an array of shape \(n, 3\)"),
        ({"preserve": ["q"]}, "bad-option", "'q'"),
    ],
)
def test_options_that_are_wrong_are_named(options, code, words):
    points = grid_points(3)
    with pytest.raises(tetralod.TetralodError, match=words) as caught:
        tetralod.build(points, {12: hexahedra(3)}, {"f": points[:, 0]}, **options)
    assert caught.value.code == code
    again = pickle.loads(pickle.dumps(caught.value))
    assert (again.code, str(again)) == (code, str(caught.value))


@pytest.mark.parametrize(
    ("given", "code", "words"),
    [
        (([[0, 0]],), "bad-option", r"option `points`: must be an array of shape \(n, 3\)"),
        ((grid_points(2), [[0, 1, 2]]), "bad-option", r"tetrahedra must be an array of shape \(m, 4\)"),
        ((grid_points(2), [("cube", [[0]])]), "bad-option", "there is no type of cells 'cube'"),
        ((grid_points(2), [[0, 1, 2, 8]]), "corrupt", "8"),
        ((grid_points(2), [(12, [[0, 1, 2, 3]])]), "corrupt", "a hexahedron, has 4 points, not 8"),
        ((grid_points(2), [[0, 1, 2, 4]], {"f": [1, 2]}), "bad-option", r"option `point_data\['f'\]`: must have 8 rows"),
        ((grid_points(2), [[0, 1, 2, 4]], {"f": ["a"] * 8}), "bad-option", "must be real numbers"),
        ((grid_points(2), [[0, 1, 2, 4]], {"f": [np.nan] * 8}), "bad-mesh", "the mesh"),
        ((grid_points(2),), "bad-mesh", "there are points but no tetrahedra"),
        ((grid_points(2), [("triangle", [[0, 1, 2]])]), "unsupported", "triangle"),
        ((pv.Sphere(),), "unsupported", "a PolyData; give a grid|a vtkPolyData; give a grid"),
        ((pv.MultiBlock(),), "unsupported", "combine"),
        (("there is no such file.vtu",), "bad-source", "there is no such file.vtu"),
        (("a.vtu", [[0, 1, 2, 3]]), "bad-option", "option `cells`: goes with points; a file has its own"),
    ],
)
def test_meshes_that_are_wrong_say_where(given, code, words):
    with pytest.raises(tetralod.TetralodError, match=words) as caught:
        tetralod.build(*given)
    assert caught.value.code == code


def test_progress_is_told_and_its_errors_end_the_work():
    points, cells = grid_points(9), {12: hexahedra(9)}
    stages = []
    tetralod.build(points, cells, {"f": points[:, 0] ** 2}, progress=lambda *told: stages.append(told))
    assert [stage for stage, *_ in stages][:2] == ["parse", "repair"] and stages[-1][0] == "encode"
    assert all(done <= max(total, 1) for _, done, total in stages)

    def stop(*_):
        raise LookupError("enough")

    with pytest.raises(LookupError, match="enough"):
        tetralod.build(points, cells, {"f": points[:, 0]}, progress=stop)
