"""The pieces of a simulation, which ``tetralod part`` reads: those of ``workflows/tetralod_part.h``, byte for byte."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from numpy.typing import ArrayLike

from . import _options, _vtu
from ._errors import TetralodError

_MOST_RANKS = 2**31 - 1


def part_write(
    folder: str | os.PathLike[str],
    rank: int,
    points: ArrayLike,
    tets: ArrayLike,
    point_data: Mapping[str, ArrayLike] | None = None,
) -> None:
    """Writes the piece of one rank of a simulation, ``folder/piece-RANK.vtu``, which is there once it is complete.

    ``points`` is an array (n, 3), ``tets`` one (m, 4) of numbers of points of this piece, from 0, and ``point_data`` has an array (n,) or (n,
    components) for each name, the same names in all pieces. Points at which pieces meet are found by their positions, which must be exactly equal in
    all of them; values there are those of the first piece.

    One rank writes the list of all pieces, by ``part_list``. The folder must be there, and hold no pieces of an earlier step.

    >>> import tempfile
    >>> folder = tempfile.TemporaryDirectory()
    >>> corner, data = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], {"p": [0, 1, 2, 3]}
    >>> tetralod.part_list(folder.name, 2, data)
    >>> tetralod.part_write(folder.name, 0, corner, [[0, 1, 2, 3]], data)
    >>> tetralod.part_write(folder.name, 1, [*corner[1:], [1, 1, 1]], [[0, 1, 2, 3]], {"p": [1, 2, 3, 4]})
    >>> tetralod.build(f"{folder.name}/pieces.pvtu").info.tetrahedra
    2
    >>> folder.cleanup()
    """
    number = _options.whole("rank", rank, 0, _MOST_RANKS)
    _write(Path(folder) / f"piece-{number}.vtu", _vtu.piece(points, tets, point_data or {}))


def part_list(folder: str | os.PathLike[str], ranks: int, point_data: Mapping[str, ArrayLike] | None = None) -> None:
    """Writes the list of the pieces of all ranks, ``folder/pieces.pvtu``: by one rank, before or after the pieces.

    Of ``point_data``, which is that of any rank, the names, types and components count.
    """
    count = _options.whole("ranks", ranks, 1, _MOST_RANKS)
    _write(Path(folder) / "pieces.pvtu", [_vtu.pieces(count, point_data or {})])


def _write(path: Path, parts: Sequence[Any]) -> None:
    """Writes a file under another name, and then renames it."""
    partial = path.with_name(f".{path.name}.partial")
    try:
        with partial.open("wb") as file:
            for part in parts:
                file.write(part)
        os.replace(partial, path)
    except OSError as error:
        raise TetralodError("bad-source", f"{path} could not be written: {error.strerror}") from error
    finally:
        partial.unlink(missing_ok=True)
