"""What the tests work on: generated volumes, and the command of the package that is tested."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import tetralod


def command(*words):
    """Runs the command that is in the package."""
    done = subprocess.run([sys.executable, "-m", "tetralod", *map(str, words)], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout


def grid_points(count):
    """The points of a regular grid in the unit cube, x fastest."""
    axis = np.linspace(0, 1, count)
    z, y, x = np.meshgrid(axis, axis, axis, indexing="ij")
    return np.column_stack([x.ravel(), y.ravel(), z.ravel()])


def hexahedra(count):
    """The cells of that grid, in VTK's order."""
    k, j, i = np.meshgrid(*3 * [np.arange(count - 1)], indexing="ij")
    first = (i + count * (j + count * k)).ravel()
    corners = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
    return np.column_stack([first + i + count * (j + count * k) for i, j, k in corners])


@pytest.fixture(scope="session")
def ball():
    """The distance `r` from the origin, and the vector `v` that turns around the z axis, on a grid of 17³ points."""
    points = grid_points(17)
    x, y, _ = points.T
    vector = np.column_stack([0.5 - y, x - 0.5, np.zeros(len(x))])
    data = {"r": np.linalg.norm(points, axis=1), "v": vector}
    return tetralod.build(points, {"hexahedron": hexahedra(17)}, data, all_fields=True, fields=["r"], units={"r": "m"})


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """An empty folder, in which the test runs."""
    monkeypatch.chdir(tmp_path)
    return Path()
