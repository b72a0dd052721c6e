"""Promise: meshes meet their requests, and surfaces, values and sums are those that VTK gets of the same mesh."""

import numpy as np
import pytest
import pyvista as pv

import tetralod


@pytest.fixture(scope="module")
def mesh(ball):
    return ball.refine(error="0.2%")


@pytest.fixture(scope="module")
def grid(mesh):
    return mesh.to_pyvista()


def test_a_mesh_is_as_accurate_as_was_asked_for(ball):
    info = ball.info
    assert (info.kind, info.vertices, info.tetrahedra, info.bounds) == ("half-edge", 17**3, 6 * 16**3, (0, 0, 0, 1, 1, 1))
    assert [field.name for field in info.fields] == ["r", "v_x", "v_y", "v_z"]
    assert (info.fields[0].unit, info.fields[1].vector) == ("m", tetralod.VectorPart("v", 0))
    finest = ball.refine(error=0)
    counts = []
    for percent in (20, 5, 1):
        mesh = ball.refine(error=f"{percent}%")
        stats = mesh.stats
        assert stats.satisfied and stats.limited_by == "error" and stats.relative_error_bound <= percent / 100
        assert stats.error_bound == pytest.approx(stats.relative_error_bound * info.fields[0].range)
        assert (len(mesh.points), len(mesh.tets)) == (stats.vertices, stats.tetrahedra)
        values = mesh.probe(finest.points)
        inside = ~np.isnan(values["r"])
        assert inside.mean() > 0.9
        assert np.abs(values["r"] - finest.point_data["r"])[inside].max() <= stats.error_bound + 1e-9
        counts.append(stats.tetrahedra)
    assert counts == sorted(counts) and counts[-1] < info.tetrahedra
    absolute = ball.refine(error=0.05 * info.fields[0].range, field="r")
    assert absolute.stats.hash == ball.refine(error="5%", field="r").stats.hash


def test_meshes_stay_as_they_are(ball):
    coarse = ball.refine(error="20%")
    before = coarse.points.copy()
    ball.refine(error=0)
    assert np.array_equal(coarse.points, before)
    assert not coarse.points.flags.writeable and coarse.points.base is not None
    with pytest.raises(ValueError, match="read-only"):
        coarse.tets[0] = 0
    surface = coarse.boundary()
    surface.points[:] = 0  # its own memory


def test_isosurfaces_are_those_of_vtk(mesh, grid):
    surface = mesh.isosurface([0.5, 1.0], field="r")
    expected = grid.contour([0.5, 1.0], scalars="r")
    assert surface.to_pyvista().area == pytest.approx(expected.area, rel=1e-6)
    assert np.unique(surface.point_data["r"]).tolist() == [0.5, 1.0]
    assert surface.point_data["v"].shape == surface.points.shape == surface.normals.shape
    assert np.allclose(np.linalg.norm(surface.normals, axis=1), 1, atol=1e-5)
    # Towards smaller values: to the origin.
    assert (np.einsum("ij,ij->i", surface.normals, surface.points) < 0).all()
    across = mesh.isosurface(0.0, field="v_x")
    assert across.to_pyvista().area == pytest.approx(1, rel=0.05)


def test_slices_are_those_of_vtk(mesh, grid):
    for normal, offset in (("z", 0.3), ([1, 1, 0.5], 0.8)):
        section = mesh.slice(normal, offset)
        direction = np.array([0, 0, 1.0]) if normal == "z" else np.array(normal)
        origin = direction * offset / (direction @ direction)
        expected = grid.slice(normal=direction, origin=origin)
        assert section.to_pyvista().area == pytest.approx(expected.area, rel=1e-6)
        assert np.allclose(section.points @ direction, offset)
        assert section.edges.max() < len(section.points)
        same = mesh.slice(normal, origin=origin)
        assert len(same.triangles) == len(section.triangles)
    assert np.allclose(mesh.slice("x").points[:, 0], 0.5)


def test_the_boundary_is_that_of_vtk(mesh, grid):
    surface = mesh.boundary()
    expected = grid.extract_surface(algorithm="dataset_surface")
    assert len(surface.triangles) == expected.n_cells and surface.to_pyvista().area == pytest.approx(6)
    assert surface.to_pyvista().is_all_triangles and surface.to_pyvista().n_open_edges == 0


def test_values_at_points_are_those_of_vtk(mesh, grid):
    places = np.random.default_rng(1).random((200, 3))
    found = mesh.probe(places)
    expected = pv.PolyData(places).sample(grid, tolerance=1e-9)
    assert np.allclose(found["r"], expected.point_data["r"], atol=1e-9)
    assert np.allclose(found["v"], expected.point_data["v"], atol=1e-9)
    outside = mesh.probe([[2, 2, 2]])
    assert np.isnan(outside["r"]).all() and np.isnan(outside["v"]).all() and outside["v"].shape == (1, 3)


def test_streamlines_go_around(mesh):
    lines = mesh.streamlines([[0.7, 0.5, 0.5], [5, 5, 5]], vector="v", max_length=3.0)
    assert len(lines) == 1 and lines.seeds.tolist() == [0] and lines.ends == ["length"]
    radius = np.linalg.norm(lines.points[:, :2] - 0.5, axis=1)
    assert np.allclose(radius, 0.2, atol=1e-3) and np.allclose(lines.points[:, 2], 0.5)
    # The angular velocity is 1.
    assert lines.times[-1] == pytest.approx(3.0 / 0.2, rel=1e-2)
    assert np.allclose(np.linalg.norm(lines.point_data["v"], axis=1), 0.2, atol=1e-3)
    both = mesh.streamlines([[0.7, 0.5, 0.5]], vector=["v_x", "v_y", "v_z"], direction="both", max_length=1.0)
    assert len(both) == 2 and both.times[-1] < 0 < both.times[both.line_ends[0] - 1]
    drawn = both.to_pyvista()
    assert (drawn.n_lines, drawn.n_points, drawn.length > 0) == (2, len(both.points), True)


def test_sums_are_those_of_vtk(mesh, grid):
    stats = mesh.field_stats("r", bins=8, fractions=[0, 0.5, 1])
    expected = grid.integrate_data()
    assert stats.volume == pytest.approx(float(expected["Volume"][0]))
    assert stats.integral == pytest.approx(float(expected["r"][0]))
    assert stats.mean == pytest.approx(stats.integral / stats.volume)
    assert stats.histogram.sum() + stats.below + stats.above == pytest.approx(stats.volume)
    assert len(stats.edges) == 9 and stats.percentiles[0] <= stats.percentiles[1] <= stats.percentiles[2]


def test_requests_say_where(ball):
    everywhere = ball.refine(error="0.1%").stats.tetrahedra
    corner = [0, 0, 0, 0.25, 0.25, 0.25]
    half_axes = np.eye(3) / 8
    for shape in (
        {"box": corner},
        {"box": np.reshape(corner, (2, 3))},
        {"sphere": {"center": (0, 0, 0), "radius": 0.25}},
        {"oriented_box": {"center": [0.125] * 3, "half_axes": half_axes}},
        {"half_space": {"normal": (1, 1, 1), "offset": 0.2}},
        {"slab": {"normal": (0, 0, 1), "offset": 0.1, "thickness": 0.1}},
        {"planes": [[1, 0, 0, 0.2], [0, 1, 0, 0.2]]},
        {"isovalues": 1.6},
        {"ranges": [[1.5, 1.6]]},
        {"box": corner, "isovalues": [0.3]},
        {"transfer": {"points": [[0, 1, 1, 1, 0], [0.2, 1, 0, 0, 1], [0.3, 0, 0, 0, 0]]}, "error": 0.2},
    ):
        stats = ball.refine(**{"error": "0.1%", **shape}).stats
        assert stats.satisfied and 0 < stats.tetrahedra < everywhere, shape
        # The same as one of several needs.
        assert ball.refine(needs=[{"error": "0.1%", **shape}]).stats.hash == stats.hash


def test_budgets_are_kept(ball):
    mesh = ball.refine(error=0, max_tets=3000)
    assert len(mesh.tets) <= 3000 and not mesh.stats.satisfied and mesh.stats.limited_by == "budget"
    assert len(ball.refine(max_vertices=500).points) <= 500
    small = ball.refine(max_bytes=100_000)
    assert 32 * len(small.tets) + 16 * len(small.points) <= 100_000
    assert ball.refine(max_tets=float("inf")).stats.satisfied


def test_a_camera_sees_what_is_in_front_of_it(ball):
    plotter = pv.Plotter(off_screen=True)
    plotter.camera.position, plotter.camera.focal_point = (3, 0.5, 0.5), (0.5, 0.5, 0.5)
    matrix = plotter.camera.GetCompositeProjectionTransformMatrix(4 / 3, -1, 1)
    rows = np.array([[matrix.GetElement(i, j) for j in range(4)] for i in range(4)])
    view = {"matrix": rows, "viewport": (400, 300), "pixels": 1.0}
    seen = ball.refine(view=view).stats
    assert seen.satisfied and seen.bounds[0] <= 1.0
    assert ball.refine(view={**view, "matrix": rows.T.ravel()}).stats.hash == seen.hash
    both = ball.refine(view={**view, "outside": "2%"}).stats
    assert len(both.bounds) == 2 and both.tetrahedra >= seen.tetrahedra
    plotter.close()


def test_regions_are_kept_apart():
    from conftest import grid_points, hexahedra

    points, cells = grid_points(7), hexahedra(7)
    left = points[cells].mean(axis=1)[:, 0] < 0.5
    mt = tetralod.build(
        points, {12: cells}, {"f": points[:, 0] ** 2}, {"part": np.where(left, 3, 8)}, preserve=["part"], fields=["f"]
    )
    assert [region.labels for region in mt.info.regions.all] == [(3,), (8,)]
    assert sum(region.volume for region in mt.info.regions.all) == pytest.approx(1)
    whole = mt.refine(error="1%")
    assert set(whole.cell_data["part"]) == {3, 8}
    half = mt.refine(error="1%", regions=[3])
    assert set(half.cell_data["part"]) == {3} and half.points[:, 0].max() <= 0.5 + 1e-6
    assert half.field_stats().volume == pytest.approx(0.5)
    assert half.boundary().to_pyvista().area == pytest.approx(4)
    assert (half.neighbors[half.neighbors != 0xFFFFFFFF] < len(half.tets)).all()
    assert half.to_pyvista().cell_data["part"].tolist() == half.cell_data["part"].tolist()


def test_fields_are_chosen(ball):
    assert list(ball.refine(error="20%", fields=["v"]).point_data) == ["r", "v"]
    alone = ball.refine(error="20%", fields=[])
    assert list(alone.point_data) == ["r"]
    assert list(ball.refine(error="20%", field="v_y", fields=[]).point_data) == ["v"]
    with pytest.raises(tetralod.TetralodError, match="the mesh has no field 'v_x', only r"):
        alone.isosurface(0, field="v_x")
    with pytest.raises(tetralod.TetralodError, match="there is no field 'q', only r, v"):
        ball.refine(fields=["q"])


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"error": -1}, "option `error`: must not be negative"),
        ({"error": "1"}, "option `error`: must be a number, or a percentage"),
        ({"error": float("nan")}, "option `error`"),
        ({"field": "q"}, "option `field`: there is no field 'q', only r, v_x, v_y, v_z"),
        ({"field": 4}, "there are fields 0 to 3"),
        ({"time": 1}, "has no time step at 1"),
        ({"box": [0, 1]}, "option `box`: must be six numbers"),
        ({"box": [1, 0, 0, 0, 1, 1]}, "every side of the box"),
        ({"sphere": {"center": [0, 0, 0]}}, r"option `sphere\.radius`: is missing"),
        ({"sphere": {"center": [0, 0, 0], "radius": 1, "r": 2}}, r"option `sphere\.r`: there is none of this name"),
        ({"sphere": 1}, "option `sphere`: must be a dict with center, radius"),
        ({"box": [0, 0, 0, 1, 1, 1], "slab": {"normal": [0, 0, 1], "offset": 0}}, "option `slab`: cannot stand beside `box`"),
        ({"view": {"matrix": np.eye(4), "viewport": [1, 1], "pixels": 1}, "error": 1}, "has no place beside `view`"),
        ({"transfer": {"points": [[0, 1]]}}, r"option `transfer\.points`: must be rows of five numbers"),
        ({"ranges": [[1, 0]]}, "ranges have the smaller one first"),
        ({"isovalues": "a"}, "option `isovalues`: must be a number, or several"),
        ({"regions": ["a"]}, "option `regions`: there is no region a"),
        ({"regions": "a"}, "option `regions`: must be a list"),
        ({"needs": [{"errors": 1}]}, "option `errors`: there is none of this name"),
        ({"max_tets": 0}, "option `max_tets`: must be at least 1"),
    ],
)
def test_requests_that_are_wrong_are_named(ball, options, words):
    before = ball.refine(error="20%").stats.hash
    with pytest.raises(tetralod.TetralodError, match=words) as caught:
        ball.refine(**options)
    assert caught.value.code == "bad-option"
    assert ball.refine(error="20%").stats.hash == before


def test_tools_that_are_asked_wrongly_say_so(mesh):
    for call, words in (
        (lambda: mesh.isosurface(float("inf")), "option `values`: must be finite"),
        (lambda: mesh.isosurface(0.5, normals="flat"), "option `normals`"),
        (lambda: mesh.slice("w"), "option `normal`"),
        (lambda: mesh.slice([0, 0, 0]), "option `normal`"),
        (lambda: mesh.slice("x", 0, origin=[0, 0, 0]), "option `origin`: give this or `offset`"),
        (lambda: mesh.probe([0, 0, 0]), "option `points`"),
        (lambda: mesh.streamlines([[0, 0, 0]], vector="r"), "the mesh has no vector 'r', only v"),
        (lambda: mesh.streamlines([[0, 0, 0]], vector="v", direction="up"), "option `direction`"),
        (lambda: mesh.field_stats(range=(1, 0)), "option `range`"),
        (lambda: mesh.field_stats(bins=0), "option `bins`"),
    ):
        with pytest.raises(tetralod.TetralodError, match=words):
            call()
