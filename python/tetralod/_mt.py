"""MT files that are open."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, Union

import numpy as np
from numpy.typing import ArrayLike

from . import _native, _options
from ._errors import TetralodError, bad_option
from ._info import Field, Info, arrays_of, info_of
from ._mesh import Mesh, RefineStats, named_arrays

Progress = Callable[[str, int, int], object]
"""Is told the stage of the work, how much of it is done, and the whole (0 if that is not known). An exception that it raises ends the work."""

Tolerance = Union[float, str]
"""A number in units of the field, or a percentage of its range such as ``"1%"``."""

_SHAPES = ("box", "sphere", "oriented_box", "half_space", "slab", "planes")
NEED = ("error", "field", "time", *_SHAPES, "isovalues", "ranges", "regions", "view", "transfer")


def open(
    source: str | os.PathLike[str] | bytes,
    *,
    fields: Sequence[str] = (),
    memory: int | None = None,
    headers: Mapping[str, str] | None = None,
    cache: str | os.PathLike[str] | None = None,
    cache_bytes: int = 1 << 30,
) -> Mt:
    """Opens an MT file: a path, an address that begins with ``http://`` or ``https://``, or its bytes.

    Of a file only what is needed is read, of one on a server by byte ranges: now what stands in front of its updates, and by ``Mt.refine``
    what the mesh needs.

    ``fields``: names of the fields to read; all if there are none. ``memory``: most bytes for blocks of the file; those that are not needed
    are evicted, and what does not fit is left out (``stats.limited_by``). For servers, ``headers`` go along with each request to the origin of
    the address, and ``cache`` is a folder that keeps what was fetched, up to ``cache_bytes``.

    Raises ``TetralodError``: see its codes.
    """
    data: Any = bytes(source) if isinstance(source, (bytearray, memoryview)) else source
    if not isinstance(data, (str, bytes, os.PathLike)):
        raise TetralodError("bad-source", f"an MT file is a path, an address or bytes, not {type(source).__name__}")
    name = "the MT file" if isinstance(data, bytes) else os.fspath(data)
    network = {
        "headers": list((headers or {}).items()),
        "cache": None if cache is None else os.fspath(cache),
        "cache_bytes": _options.whole("cache_bytes", cache_bytes, 0, 2**63 - 1),
    }
    room = None if memory is None else _options.whole("memory", memory, 0, 2**63 - 1)
    native = _native.Mt(data, name, _options.names("fields", fields), room, network)
    return Mt(native, name, (data, name, network))


class Mt:
    """An MT file that is open: made by ``tetralod.open`` and ``tetralod.build``.

    It can be used from several threads; one works at a time. ``with`` closes it.
    """

    info: Info
    """What is in the file."""
    report: dict[str, Any] | None
    """Of an MT that was built here: what was done, in the words of ``tetralod build --json``."""

    def __init__(self, native: _native.Mt, name: str, given: tuple[Any, str, dict[str, Any]]) -> None:
        self._native: _native.Mt | None = native
        self._name = name
        self._given: tuple[Any, str, dict[str, Any]] | None = given
        self.report = None
        self.info = info_of(native.info())

    def __repr__(self) -> str:
        arrays = ", ".join(dict.fromkeys(field.name for field in self.info.fields))
        counts = f"{self.info.vertices} vertices, {self.info.tetrahedra} tetrahedra"
        return f"<tetralod.Mt {self._name!r}: {counts}, {arrays}>"

    def __enter__(self) -> Mt:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Closes the file and frees its memory. Meshes that were taken out of it stay."""
        self._native = self._given = None

    def refine(
        self,
        *,
        error: Tolerance | None = None,
        field: str | int | None = None,
        time: float | None = None,
        box: ArrayLike | None = None,
        sphere: Mapping[str, Any] | None = None,
        oriented_box: Mapping[str, Any] | None = None,
        half_space: Mapping[str, Any] | None = None,
        slab: Mapping[str, Any] | None = None,
        planes: ArrayLike | None = None,
        isovalues: float | Sequence[float] | None = None,
        ranges: ArrayLike | None = None,
        regions: Sequence[str | int] | None = None,
        view: Mapping[str, Any] | None = None,
        transfer: Mapping[str, Any] | None = None,
        needs: Sequence[Mapping[str, Any]] = (),
        max_tets: float | None = None,
        max_vertices: float | None = None,
        max_bytes: float | None = None,
        fields: Sequence[str] | None = None,
        exact: bool = False,
        progress: Progress | None = None,
    ) -> Mesh:
        """The coarsest mesh that meets a request, as far as the budget allows. All data for it is read first.

        The arguments describe one need; ``needs`` is a list of further ones, each a ``dict`` of the arguments up to ``transfer``. The mesh
        meets all of them.

        ``error``
            The largest error, in units of the field, or in % of its range as ``"1%"``; 0, which is the default, is the reference mesh. The
            mesh is within it at every vertex of the reference mesh in the part that the next arguments select.
        ``field``, ``time``
            The field whose error counts, by its name or number, and the time of its step. Without a field the error counts for all fields,
            each relative to its own range, and isovalues are of the one that ``info.first_field`` is.
        ``box``
            Only in a box: ``[x0, y0, z0, x1, y1, z1]`` or its two corners. In model units, as all shapes, of which one need has one.
        ``sphere``, ``oriented_box``, ``half_space``, ``slab``, ``planes``
            ``{"center": (x, y, z), "radius": r}``; ``{"center", "half_axes": three orthogonal vectors}``; ``{"normal", "offset"}``: where
            ``normal · p <= offset``; ``{"normal", "offset", "thickness"}``; rows of a normal and an offset, at most 16.
        ``isovalues``, ``ranges``
            Only where the field has one of these values, or a value of one of these ranges ``[low, high]``.
        ``regions``
            Only in these regions of the file (``info.regions``), by name or label. If all needs name some, the mesh is that of these regions.
        ``view``
            What a camera sees: ``{"matrix", "viewport": (width, height), "pixels": p, "outside": tolerance}``, within so many pixels, and the
            rest within ``outside``. The matrix takes model space to clip space: an array (4, 4), or 16 numbers column by column.
        ``transfer``
            What a transfer function makes visible: ``{"points": rows of value, red, green, blue, opacity, "unit_length": 1.0}``; ``error`` is
            one of colour and opacity then, from 0 to 1.
        ``max_tets``, ``max_vertices``, ``max_bytes``
            The budget: the error is as small as it allows. A tetrahedron has 32 bytes, a vertex 16.
        ``fields``
            The arrays of the mesh, by their names or those of vectors; by default all, or if a time is given those of that time and of none.
            That of ``field`` is always there.
        ``exact``
            The exact values, where the file keeps some (``lossless``), at points that are in the reference mesh.
        ``progress``
            A function that is told the stage (``"fetch"``, ``"refine"``), how much is done, and the whole.

        Other threads run meanwhile, and Ctrl-C ends the work.

        Raises ``TetralodError``: ``bad-option`` names the argument; see its codes for what may be wrong with the file or the server.

        >>> mesh = ball.refine(error="2%", box=[0, 0, 0, 0.5, 0.5, 0.5], needs=[{"error": "20%"}], max_tets=2000)
        >>> len(mesh.tets) <= 2000, len(mesh.stats.bounds)
        (True, 2)
        """
        native = self._open()
        shown = self.info.field(field, time)
        own: dict[str, Any] = {
            "error": error, "field": field, "time": time, "box": box, "sphere": sphere, "oriented_box": oriented_box,
            "half_space": half_space, "slab": slab, "planes": planes, "isovalues": isovalues, "ranges": ranges,
            "regions": regions, "view": view, "transfer": transfer,
        }  # fmt: skip
        all_needs = list(needs)
        # A field alone is no need: it says which one is shown.
        if not all_needs or any(value is not None for name, value in own.items() if name not in ("field", "time")):
            all_needs.insert(0, {name: value for name, value in own.items() if value is not None})
        parsed = [one for need in all_needs for one in _need(self.info, need, shown)]
        named = [need["regions"] for need, _ in parsed]
        only = None if None in named else [name for names in named for name in names]
        limits = (
            _options.count("max_tets", max_tets, 2**32 - 1),
            _options.count("max_vertices", max_vertices, 2**32 - 1),
            _options.count("max_bytes", max_bytes, 2**64 - 1),
        )
        arrays = self._chosen(fields, shown, time)
        found, text = native.refine(
            [need for need, _ in parsed], limits, shown.index, list(arrays.values()), only, exact, progress
        )
        return self._mesh(found, text, [unit for _, unit in parsed], shown, arrays)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes the file of an MT that was built here, or opened from bytes. What was there before stays if that fails."""
        data = self._source()[0]
        if not isinstance(data, bytes):
            raise TetralodError("bad-source", f"{self._name} is a file already: copy it")
        target = Path(path)
        partial = target.with_name(f".{target.name}.{os.getpid()}.partial")
        try:
            partial.write_bytes(data)
            os.replace(partial, target)
        finally:
            partial.unlink(missing_ok=True)

    def _source(self) -> tuple[Any, str, dict[str, Any]]:
        """What it was opened from, as the native module takes it: the file, its name, and how a server is asked."""
        self._open()
        assert self._given is not None
        return self._given

    def to_html(self, path: str | os.PathLike[str] | None = None, **options: Any) -> str | None:
        """Writes one HTML file that shows the volume, with the viewer and just the blocks that a request needs; without a path, gives its text.

        ``options`` are those of ``tetralod html``, which ``docs/command.md`` describes, with ``_`` for ``-`` and ``from_`` for ``from``: ``error="1%"``,
        ``isovalue=[0.3, 0.6]``, ``box=(0, 0, 0, 1, 1, 1)``, ``map="turbo"``, ``bytes="3M"``, ``no_poster=True``. A list gives an option several times, a
        tuple is the numbers of one. The page opens from a disk and out of a mail, and asks for nothing elsewhere.

        Raises ``TetralodError``: ``bad-option`` if the options are wrong; ``bad-source`` if the page cannot be made.
        """
        data, name, _network = self._source()
        words = [word for name, value in options.items() for word in _words(name, value)]
        with tempfile.TemporaryDirectory() as folder:
            source = name
            if isinstance(data, bytes):
                source = os.path.join(folder, "volume.mt")
                Path(source).write_bytes(data)
            target = os.path.join(folder, "page.html") if path is None else os.fspath(path)
            # In a process of its own, which Ctrl-C ends, and which ends itself where options are wrong.
            command = [sys.executable, "-m", "tetralod", "html", source, f"--output={target}", *words]
            done = subprocess.run(command, capture_output=True, text=True, encoding="utf-8", check=False)
            said = done.stderr.strip()
            if done.returncode != 0:
                raise TetralodError("bad-option" if done.returncode == 2 else "bad-source", said.removeprefix("error: "))
            for line in said.splitlines():
                if line.startswith("warning: "):
                    warnings.warn(line.removeprefix("warning: "), stacklevel=2)
            return Path(target).read_text(encoding="utf-8") if path is None else None

    def _open(self) -> _native.Mt:
        if self._native is None:
            raise TetralodError("not-ready", f"{self._name} has been closed")
        return self._native

    def _chosen(self, names: Sequence[str] | None, shown: Field, time: float | None) -> dict[str, list[int]]:
        """The arrays of a mesh with the numbers of their components."""
        listed = list(self.info.fields)
        if time is not None:
            listed = [field for field in listed if field.time is None or field.time == shown.time]
        arrays = arrays_of(listed)
        if names is None:
            return arrays
        wanted = _options.names("fields", names)
        answers = {
            name: {name, *(self.info.fields[index].name for index in indices), name.split("@")[0]}
            for name, indices in arrays.items()
        }
        for name in wanted:
            if not any(name in words for words in answers.values()):
                raise bad_option("fields", f"there is no field {name!r}, only {', '.join(arrays)}")
        return {
            name: indices
            for name, indices in arrays.items()
            if shown.index in indices or not answers[name].isdisjoint(wanted)
        }

    def _mesh(
        self, native: _native.Mesh, text: str, units: list[float], shown: Field, arrays: dict[str, list[int]]
    ) -> Mesh:
        points, tets, neighbors, regions, values = native.share()
        raw = json.loads(text)
        infinite = float("inf")
        raw["bounds"] = tuple(unit * (infinite if bound is None else bound) for bound, unit in zip(raw["bounds"], units))
        raw = {name: infinite if value is None and name != "file_bytes" else value for name, value in raw.items()}
        cell_data = {}
        if self.info.regions is not None:
            numbers = np.asarray(regions)
            labels = np.array([region.labels for region in self.info.regions.all], dtype=np.int64)
            for column, name in enumerate(self.info.regions.arrays):
                cell_data[name] = labels[numbers, column]
        return Mesh(
            points=np.asarray(points),
            tets=np.asarray(tets),
            point_data=named_arrays(arrays, values),
            cell_data=cell_data,
            neighbors=np.asarray(neighbors),
            stats=RefineStats(**raw),
            info=self.info,
            _field=shown,
            _arrays=arrays,
            _native=native,
        )


def _words(name: str, value: object) -> list[str]:
    """An option of the command and its value, as words."""
    if value is None or value is False:
        return []
    option = f"--{name.rstrip('_').replace('_', '-')}"
    if value is True:
        return [option]
    if isinstance(value, tuple):
        return [f"{option}={','.join(map(str, value))}"]
    if isinstance(value, (list, np.ndarray)):
        return [word for one in value for word in _words(name, one)]
    return [f"{option}={os.fspath(value) if isinstance(value, os.PathLike) else value}"]


def check_names(given: Iterable[str], known: Sequence[str]) -> None:
    for name in given:
        if name not in known:
            raise bad_option(name, f"there is none of this name, only {', '.join(known)}")


def by_columns(matrix: np.ndarray) -> np.ndarray:
    """Mathematics writes matrices row by row, graphics column by column."""
    return (matrix.T if matrix.shape == (4, 4) else matrix).ravel()


def _need(info: Info, given: Mapping[str, Any], shown: Field) -> list[tuple[dict[str, Any], float]]:
    """The needs of these options, each with what its bound is multiplied by to be in the unit in which it was asked."""
    check_names(given, NEED)
    options = {name: value for name, value in given.items() if value is not None}
    own = shown
    if "field" in options or "time" in options:
        own = info.field(options.get("field", shown.name), options.get("time"))
    if isinstance(options.get("field"), str) and "time" not in options:
        # At the time of the field that is shown, if there is such a step.
        own = next((other for other in info.fields if other.name == own.name and other.time == shown.time), own)
    need: dict[str, Any] = {
        "error": 0.0,
        "field": own.index if "field" in options or "time" in options else None,
        "region": None,
        "of": own.index,
        "ranges": [],
        "view": None,
        "transfer": None,
        "regions": None,
    }
    if "regions" in options:
        if isinstance(options["regions"], (str, bytes)):
            raise bad_option("regions", "must be a list of names or labels")
        need["regions"] = [str(name) for name in options["regions"]]
    if "view" in options:
        _alone(options, "view", ())
        return _view(need, options["view"], own)
    if "transfer" in options:
        _alone(options, "transfer", ("error",))
        transfer = _members("transfer", options["transfer"], ("points",), ("unit_length",))
        rows = _options.numbers("transfer.points", transfer["points"], (None, 5), "rows of five numbers")
        need["error"] = _options.tolerance("error", options.get("error", 0.0), 1.0)
        need["transfer"] = (rows.tolist(), _options.number("transfer.unit_length", transfer.get("unit_length", 1.0)))
        return [(need, 1.0)]
    need["error"] = _options.tolerance("error", options.get("error", 0.0), own.range)
    shapes = [name for name in _SHAPES if name in options]
    if len(shapes) > 1:
        raise bad_option(shapes[1], f"cannot stand beside `{shapes[0]}`; one need has one shape, `needs` takes several")
    if shapes:
        need["region"] = (shapes[0], _shape(shapes[0], options[shapes[0]]))
    if "ranges" in options:
        need["ranges"] += _options.numbers("ranges", options["ranges"], (None, 2), "rows of two numbers").tolist()
    if "isovalues" in options:
        values = _options.numbers("isovalues", np.ravel(options["isovalues"]), (None,), "a number, or several")
        need["ranges"] += [[value, value] for value in values.tolist()]
    return [(need, own.range)]


def _view(need: dict[str, Any], given: Any, own: Field) -> list[tuple[dict[str, Any], float]]:
    view = _members("view", given, ("matrix", "viewport", "pixels"), ("outside",))
    columns = by_columns(np.asarray(view["matrix"], dtype=float))
    flat = _options.numbers("view.matrix", columns, (16,), "an array (4, 4), or 16 numbers column by column")
    viewport = _options.numbers("view.viewport", view["viewport"], (2,), "two numbers")
    seen = {**need, "error": _options.amount("view.pixels", view["pixels"]), "view": (flat.tolist(), viewport.tolist())}
    if view.get("outside") is None:
        return [(seen, 1.0)]
    return [(seen, 1.0), ({**need, "error": _options.tolerance("view.outside", view["outside"], own.range)}, own.range)]


def _alone(options: Mapping[str, Any], kind: str, besides: Sequence[str]) -> None:
    """One argument makes the need one of its own kind: of the others it has but these."""
    for name in (*_SHAPES, "isovalues", "ranges", "error", "transfer", "view"):
        if name != kind and name not in besides and name in options:
            raise bad_option(name, f"has no place beside `{kind}`; put it in another one of `needs`, all of which are met")


def _members(name: str, given: Any, needed: Sequence[str], others: Sequence[str] = ()) -> Mapping[str, Any]:
    """The members of a ``dict`` in an argument."""
    if not isinstance(given, Mapping):
        raise bad_option(name, f"must be a dict with {', '.join(needed)}; given: {given!r}")
    for member in needed:
        if member not in given:
            raise bad_option(f"{name}.{member}", "is missing")
    for member in given:
        if member not in (*needed, *others):
            raise bad_option(f"{name}.{member}", f"there is none of this name, only {', '.join((*needed, *others))}")
    return given


def _shape(name: str, value: Any) -> list[float]:
    """The numbers of a shape, one behind the other."""
    if name == "box":
        if np.shape(value) == (2, 3):
            value = np.ravel(value)
        return _options.listed(name, value, (6,), "six numbers: x0, y0, z0, x1, y1, z1")
    if name == "planes":
        return _options.listed(name, value, (None, 4), "rows of four numbers: a normal and an offset")
    shapes: dict[str, tuple[tuple[str, tuple[int, ...]], ...]] = {
        "sphere": (("center", (3,)), ("radius", ())),
        "oriented_box": (("center", (3,)), ("half_axes", (3, 3))),
        "half_space": (("normal", (3,)), ("offset", ())),
        "slab": (("normal", (3,)), ("offset", ()), ("thickness", ())),
    }
    if name == "slab" and isinstance(value, Mapping):
        value = {"thickness": 0.0, **value}
    members = _members(name, value, [member for member, _ in shapes[name]])
    words = {(): "a number", (3,): "three numbers", (3, 3): "three vectors: an array (3, 3)"}
    parts = (_options.listed(f"{name}.{member}", members[member], shape, words[shape]) for member, shape in shapes[name])
    return [number for part in parts for number in part]
