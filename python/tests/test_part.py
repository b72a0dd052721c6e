"""Promise: a rank of a simulation writes in Python what it writes in C, and the command builds it."""

import os
import runpy
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from conftest import command

import tetralod

ROOT = Path(os.environ.get("TETRALOD_ROOT", Path(__file__).parents[2]))
EXAMPLE = ROOT / "examples/in-situ"
CORNER = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]


def contents(folder):
    return {path.name: path.read_bytes() for path in Path(folder).iterdir()}


@pytest.mark.skipif(sys.platform == "win32", reason="compilers are called otherwise there")
def test_the_example_writes_the_same_in_c_and_in_python(folder, monkeypatch):
    # The ranks are threads.
    monkeypatch.setitem(sys.modules, "mpi4py", None)
    monkeypatch.setattr(sys, "argv", ["simulation.py", "python", "3"])
    runpy.run_path(str(EXAMPLE / "simulation.py"), run_name="__main__")
    compiled = ["cc", "-std=c99", "-I", ROOT / "workflows", EXAMPLE / "simulation.c", "-o", "simulation"]
    subprocess.run(compiled, check=True)
    Path("c").mkdir()
    subprocess.run(["./simulation", "c", "3"], check=True)
    assert contents("python") == contents("c")
    command("part", "python/pieces.pvtu", "--parts", 2, "--all-fields", "-o", "parts", "--later")
    command("work", "parts", "--wait", "--quiet")
    command("build", "c/pieces.pvtu", "--parts", 2, "--all-fields", "-o", "once.mt", "--quiet")
    assert Path("parts/built.mt").read_bytes() == Path("once.mt").read_bytes()
    mesh = tetralod.open("parts/built.mt").refine(error=0)
    x, y, z = mesh.points.T
    assert mesh.tets.shape == (6 * 8**3, 4)
    assert np.allclose(mesh.point_data["height"], x * x + y * z, atol=1e-4)
    assert np.allclose(mesh.point_data["slope"], np.column_stack([2 * x, z, y]), atol=1e-4)


def test_any_field_and_an_empty_piece_are_written(folder):
    names = ["a", '<"&">', "Druck"]
    tetralod.part_list(folder, 2, {name: [0] for name in names})
    for rank, (points, tets) in enumerate([(np.zeros((0, 3)), np.zeros((0, 4), int)), (CORNER, [[0, 1, 2, 3]])]):
        data = {name: np.arange(len(points)) for name in names}
        tetralod.part_write(folder, rank, points, tets, data)
    assert sorted(contents(folder)) == ["piece-0.vtu", "piece-1.vtu", "pieces.pvtu"]
    mt = tetralod.build("pieces.pvtu", all_fields=True)
    assert [field.name for field in mt.info.fields] == names


@pytest.mark.parametrize(
    ("rank", "tets", "code", "words"),
    [
        (-1, [[0, 1, 2, 3]], "bad-option", "option `rank`"),
        (0, [[0, 1, 2, 3], [0, 1, 2, 4]], "bad-option", "option `tets`: tetrahedron 1 has point 4, and there are 4"),
        (0, [[0, 1, 2]], "bad-option", r"option `tets`: must be an array of integers of shape \(m, 4\)"),
        (0, [[0, 1, 2, 3]], "bad-source", "piece-0.vtu could not be written"),
    ],
)
def test_what_is_wrong_is_said(folder, rank, tets, code, words):
    with pytest.raises(tetralod.TetralodError, match=words) as caught:
        tetralod.part_write("nowhere", rank, CORNER, tets, {"p": [0, 1, 2, 3]})
    assert caught.value.code == code
