"""Promise: the examples of the documentation run as they stand there."""

import doctest
import importlib
import os
import pkgutil
import re
from pathlib import Path

import numpy as np
import pytest
from cases import write_cgns, write_openfoam
from conftest import command

import tetralod

ROOT = Path(os.environ.get("TETRALOD_ROOT", Path(__file__).parents[2]))
MODULES = ["tetralod", *(f"tetralod.{module.name}" for module in pkgutil.iter_modules(tetralod.__path__))]


@pytest.mark.parametrize("name", [name for name in MODULES if not name.endswith(("._native", ".__main__"))])
def test_docstrings_are_right(ball, name):
    globs = {"tetralod": tetralod, "ball": ball, "np": np}
    result = doctest.testmod(importlib.import_module(name), extraglobs=globs, raise_on_error=False)
    assert result.failed == 0


def test_the_docstrings_have_examples():
    finder = doctest.DocTestFinder(exclude_empty=True)
    tests = [test for name in MODULES if name != "tetralod.__main__" for test in finder.find(importlib.import_module(name))]
    shown = {test.name.split(".")[-1] for test in tests if test.examples}
    assert {"build", "refine", "isosurface", "slice", "boundary", "probe", "field_stats", "show", "TetralodError"} <= shown


@pytest.mark.parametrize("page", ["README.md", "python/README.md", "docs/howto/python.md"])
def test_the_examples_of_a_page_run_in_order(folder, page):
    """Blocks of kind `python` run one after the other in a folder with the files that they read, or blocks of kind `console` make."""
    write_openfoam("cavity")
    write_cgns("wing.cgns")
    blocks = re.findall(r"^```(python|console)\n(.*?)^```", (ROOT / page).read_text(encoding="utf-8"), re.M | re.S)
    names = {}
    assert any(kind == "python" for kind, _ in blocks)
    for kind, text in blocks:
        if kind == "console" and page == "README.md":
            continue  # tests of the command run these
        if kind == "console":
            for line in re.findall(r"^\$ tetralod (.*)$", text, re.M):
                command(*line.split())
        else:
            exec(compile(text, page, "exec"), names)
    if page.endswith("howto/python.md"):
        # Of two cubes with 1 and 3, the mean between them is 2; it is as far from either as the values at the points.
        cavity, wing = tetralod.open("cavity.mt"), tetralod.open("wing.mt")
        assert (cavity.info.field("p").min, cavity.info.field("p").max) == (1, 3)
        assert cavity.refine().point_data["U"].shape == (12, 3)
        assert [wing.info.field("Pressure").min, wing.info.field("Pressure").max] == [0, 5]
        assert wing.refine().field_stats("Pressure").volume == pytest.approx(4)
        assert wing.info.vertices == 20
