"""Meshes, and what is made of them: surfaces, values at points, streamlines, sums."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field as _dataclass_field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _options
from ._errors import bad_option
from ._info import Field, Info

if TYPE_CHECKING:
    import pyvista

    from ._native import Array, Mesh as NativeMesh

Doubles = NDArray[np.float64]
Indices = NDArray[np.uint32]


@dataclass(frozen=True)
class RefineStats:
    """What a refinement did, and how good its mesh is."""

    vertices: int
    """Of the whole mesh; where regions alone are asked for, the mesh that is returned has fewer."""
    tetrahedra: int
    applied: int
    """Updates that are applied in the mesh."""
    refined: int
    """Updates applied, and undone, by this request; those that were applied only because others depend on them; what was looked at."""
    coarsened: int
    forced: int
    judged: int
    error_bound: float
    """The guaranteed largest error where it counts, in units of the field that was asked for."""
    relative_error_bound: float
    """The same as a fraction of the field's range."""
    field_bound: float
    """The same at the vertices of the input inside the mesh: ``error_bound``, or what rounding leaves."""
    boundary_bound: float
    """How far the boundary of the mesh is from that of the input at most, in model units."""
    bounds: tuple[float, ...]
    """The error that is guaranteed for each need: in units of its field, in pixels, or of colour."""
    excess: float
    """How often an error exceeds what was asked for, at most; not above 1 if the request is satisfied."""
    satisfied: bool
    """False where a budget or the memory kept the mesh from what was asked for."""
    limited_by: str
    """What keeps the mesh from being finer: ``"error"``, ``"budget"`` or ``"memory"``."""
    hash: str
    """Of the mesh: the same request gives the same hash on every machine."""
    bytes_read: int
    """Bytes of the file that have been read since it was opened, and that it has."""
    file_bytes: int | None
    requests: int
    """Requests to a server since the file was opened, and how often something was asked for while nothing was on its way."""
    rounds: int


@dataclass(frozen=True, eq=False)
class FieldStats:
    """Sums of a field over a mesh: exact for a field that is linear in each tetrahedron."""

    volume: float
    """In cubed model units."""
    integral: float
    mean: float
    """By volume, in units of the field, as the standard deviation."""
    deviation: float
    min: float
    max: float
    below: float
    """The volume below the first bin of the histogram, and above the last."""
    above: float
    histogram: Doubles
    """The volume of each bin."""
    edges: Doubles
    """Ends of the bins: one more than there are bins."""
    percentiles: Doubles
    """The values below which the fractions of the volume lie that were asked for."""


@dataclass(frozen=True, eq=False)
class Surface:
    """Triangles, with values at their corners."""

    points: Doubles
    """(n, 3), in model units."""
    triangles: Indices
    """(m, 3): counter-clockwise when seen from the side that they face."""
    point_data: dict[str, NDArray[Any]]
    """Arrays (n,), of vectors (n, components), in units of the fields."""
    normals: NDArray[np.float32] | None = None
    """Of isosurfaces: (n, 3), of unit length, towards smaller values, which is where the triangles face."""
    edges: Indices | None = None
    """Of slices: (k, 2), the edges of the mesh's cells in the plane."""

    def to_pyvista(self) -> pyvista.PolyData:
        """The surface as ``pyvista.PolyData``, with all arrays; raises ``ImportError`` without PyVista."""
        pv = _pyvista()
        surface = pv.PolyData.from_regular_faces(self.points, self.triangles)
        for name, values in self.point_data.items():
            surface.point_data[name] = np.array(values, order="C")
        if self.normals is not None:
            surface.point_data["Normals"] = self.normals
        return surface


@dataclass(frozen=True, eq=False)
class Lines:
    """Streamlines: the points of all lines, one line behind the other."""

    points: Doubles
    """(n, 3), in model units; each line begins at its seed."""
    line_ends: Indices
    """(lines,): where each line ends in ``points``."""
    times: Doubles
    """(n,): when a particle that starts at the seed is there; negative against the field."""
    seeds: Indices
    """(lines,): the number of the seed of each line. Seeds outside have none."""
    ends: list[str]
    """Why each line ends: ``"boundary"``, ``"stagnation"``, ``"length"`` or ``"steps"``."""
    point_data: dict[str, NDArray[Any]]
    """As those of a ``Surface``."""

    def __len__(self) -> int:
        return len(self.line_ends)

    def to_pyvista(self) -> pyvista.PolyData:
        """The lines as ``pyvista.PolyData``, with all arrays and ``time``; raises ``ImportError`` without PyVista."""
        pv = _pyvista()
        ends = self.line_ends.astype(np.int64)
        starts = np.concatenate([[0], ends])[:-1]
        cells = [np.concatenate([[end - start], np.arange(start, end)]) for start, end in zip(starts, ends)]
        flat = np.concatenate(cells) if cells else np.zeros(0, dtype=np.int64)
        lines = pv.PolyData()
        lines.points = self.points
        lines.lines = flat
        for name, values in {**self.point_data, "time": self.times}.items():
            lines.point_data[name] = np.array(values, order="C")
        return lines


@dataclass(frozen=True, eq=False)
class Mesh:
    """A conforming tetrahedral mesh with values at its points. It stays as it is, whatever is asked of its file later.

    Its arrays may be read, not written: they are what its methods work on. Copies may be written.
    """

    points: Doubles
    """(n, 3), in model units."""
    tets: Indices
    """(m, 4): positively oriented, as in VTK."""
    point_data: dict[str, NDArray[Any]]
    """Arrays (n,), of vectors (n, components), in units of the fields. Of several time steps each has its time behind its name,
    as ``p@0.5``."""
    cell_data: dict[str, NDArray[np.int64]]
    """Where the file has regions: the labels (m,) of each of the arrays that tell them apart."""
    neighbors: Indices
    """(m, 4): the i-th tetrahedron lies across from the i-th point; 0xffffffff at the boundary."""
    stats: RefineStats
    info: Info = _dataclass_field(repr=False)
    _field: Field = _dataclass_field(repr=False)
    _arrays: dict[str, list[int]] = _dataclass_field(repr=False)
    _native: NativeMesh = _dataclass_field(repr=False)

    def __repr__(self) -> str:
        return f"<tetralod.Mesh: {len(self.points)} points, {len(self.tets)} tetrahedra, {', '.join(self.point_data)}>"

    def isosurface(
        self, values: float | Sequence[float] | NDArray[Any], *, field: str | None = None, normals: str = "gradient"
    ) -> Surface:
        """The isosurfaces at one or several values, in units of the field; by default of the field that the mesh was refined for.

        ``normals``: ``"gradient"`` of the field, or ``"smooth"``, the mean over the triangles at a point.

        Raises ``TetralodError`` (``bad-option``) if a value is not finite, the field is a label, or the mesh does not have it.

        >>> surface = ball.refine(error="1%").isosurface(0.5)
        >>> surface.triangles.shape[1], bool(np.allclose(surface.point_data["r"], 0.5))
        (3, True)
        """
        numbers = np.atleast_1d(_options.numbers("values", np.ravel(values), (None,), "a number, or several"))
        if not np.isfinite(numbers).all():
            raise bad_option("values", f"must be finite; given: {values!r}")
        if normals not in ("gradient", "smooth"):
            raise bad_option("normals", f'must be "gradient" or "smooth"; given: {normals!r}')
        index = self._index(field)
        (points, triangles, arrays), directions = self._native.isosurface(index, numbers.tolist(), normals == "smooth")
        return Surface(
            np.asarray(points), np.asarray(triangles), self._named(arrays), normals=np.asarray(directions)
        )

    def slice(
        self,
        normal: ArrayLike | str,
        offset: float | None = None,
        *,
        origin: ArrayLike | None = None,
    ) -> Surface:
        """The section with the plane of all points ``p`` with ``normal · p = offset``, or with the plane through ``origin``.

        ``normal``: three numbers, or ``"x"``, ``"y"`` or ``"z"``. Without an offset and an origin the plane goes through the centre of
        the file's bounds.

        >>> section = ball.refine(error="1%").slice("z", 0.25)
        >>> bool(np.allclose(section.points[:, 2], 0.25))
        True
        """
        if isinstance(normal, str):
            if normal not in ("x", "y", "z"):
                raise bad_option("normal", f'must be three numbers, "x", "y" or "z"; given: {normal!r}')
            normal = [float(axis == normal) for axis in "xyz"]
        direction = _options.numbers("normal", normal, (3,), 'three numbers, "x", "y" or "z"')
        if not np.isfinite(direction).all() or not direction.any():
            raise bad_option("normal", f"must be finite, and not 0, 0, 0; given: {normal!r}")
        if offset is not None and origin is not None:
            raise bad_option("origin", "give this or `offset`")
        if offset is None:
            low, high = np.reshape(self.info.bounds, (2, 3))
            through = (low + high) / 2 if origin is None else _options.numbers("origin", origin, (3,), "three numbers")
            offset = float(direction @ through)
        offset = _options.number("offset", offset)
        if not math.isfinite(offset):
            raise bad_option("offset", f"must be finite; given: {offset!r}")
        (points, triangles, arrays), edges = self._native.slice(direction.tolist(), offset)
        return Surface(np.asarray(points), np.asarray(triangles), self._named(arrays), edges=np.asarray(edges))

    def boundary(self) -> Surface:
        """The boundary: the faces behind which there is nothing, facing outwards.

        >>> outside = ball.refine(error="5%").boundary()
        >>> len(outside.points) < len(outside.triangles)
        True
        """
        points, triangles, arrays = self._native.boundary()
        return Surface(np.asarray(points), np.asarray(triangles), self._named(arrays))

    def probe(self, points: ArrayLike) -> dict[str, NDArray[Any]]:
        """The values of all arrays at points (k, 3), in model units: arrays (k,), of vectors (k, components); NaN outside.

        >>> values = ball.refine(error=0).probe([[0.25, 0.25, 0.25], [9, 9, 9]])["r"]
        >>> abs(float(values[0]) - 3**0.5 / 4) < 0.01, bool(np.isnan(values[1]))
        (True, True)
        """
        return self._named(self._native.probe(_options.points("points", points).tobytes()))

    def streamlines(
        self,
        seeds: ArrayLike,
        *,
        vector: str | Sequence[str],
        direction: str = "forward",
        max_length: float | None = None,
        max_steps: int = 10_000,
        step: float = 0.5,
    ) -> Lines:
        """The streamlines from seeds (k, 3), in model units, through a vector field: its name, or the names of three scalar fields.

        ``direction``: ``"forward"``, ``"backward"`` or ``"both"``, which gives two lines for each seed. ``max_length`` is in model units,
        by default ten times the diagonal of the file's bounds; ``step`` is the length of a step as a fraction of the shortest edge of the
        tetrahedron that it starts in.
        """
        if direction not in ("forward", "backward", "both"):
            raise bad_option("direction", f'must be "forward", "backward" or "both"; given: {direction!r}')
        low, high = np.reshape(self.info.bounds, (2, 3))
        length = 10 * float(np.linalg.norm(high - low)) if max_length is None else _options.amount("max_length", max_length)
        way = {
            "forward": direction != "backward",
            "backward": direction != "forward",
            "max_length": length,
            "max_steps": _options.whole("max_steps", max_steps, 0, 2**32 - 1),
            "step": _options.amount("step", step),
        }
        places = _options.points("seeds", seeds).tobytes()
        points, times, line_ends, of_seeds, ends, arrays = self._native.streamlines(self._vector(vector), places, way)
        return Lines(
            np.asarray(points), np.asarray(line_ends), np.asarray(times), np.asarray(of_seeds), ends, self._named(arrays)
        )

    def field_stats(
        self,
        field: str | None = None,
        *,
        bins: int = 64,
        range: tuple[float, float] | None = None,
        fractions: Sequence[float] = (),
    ) -> FieldStats:
        """Sums of a field over the mesh: volume, integral, mean, a histogram by volume (by default of the field's range) and percentiles.

        >>> stats = ball.refine(error=0).field_stats(fractions=[0.5])
        >>> round(stats.volume, 3), bool(stats.min <= stats.percentiles[0] <= stats.max)
        (1.0, True)
        """
        index = self._index(field)
        own = self.info.fields[index]
        ends = (own.min, own.min + own.range) if range is None else range
        low, high = _options.numbers("range", ends, (2,), "two numbers").tolist()
        if not (math.isfinite(low) and math.isfinite(high) and low < high):
            raise bad_option("range", f"must be two finite numbers, the smaller first; given: {range!r}")
        parts = _options.numbers("fractions", fractions, (None,), "a list of numbers").tolist()
        sums, lists = self._native.stats(index, (low, high), _options.whole("bins", bins, 1, 2**20), parts)
        volume, integral, mean, deviation, least, largest, below, above = sums
        histogram, edges, percentiles = (np.asarray(numbers) for numbers in lists)
        return FieldStats(
            volume, integral, mean, deviation, least, largest, below, above, histogram, edges, percentiles
        )

    def to_pyvista(self) -> pyvista.UnstructuredGrid:
        """The mesh as ``pyvista.UnstructuredGrid``, with all arrays; raises ``ImportError`` without PyVista."""
        pv = _pyvista()
        grid = pv.UnstructuredGrid({pv.CellType.TETRA: self.tets}, np.array(self.points))
        for name, values in self.point_data.items():
            grid.point_data[name] = np.array(values, order="C")
        for name, values in self.cell_data.items():
            grid.cell_data[name] = values
        return grid

    def _named(self, arrays: Sequence[Array]) -> dict[str, NDArray[Any]]:
        """The arrays of values by their names; vectors in rows."""
        return named_arrays(self._arrays, arrays)

    def _index(self, name: str | None) -> int:
        """The number of a field that the mesh has, at the time of the one that it was refined for if there is such a step."""
        if name is None:
            return self._field.index
        here = {index for indices in self._arrays.values() for index in indices}
        found = [field for field in self.info.fields if field.name == name and field.index in here]
        found.sort(key=lambda field: field.time != self._field.time)
        if not found:
            known = dict.fromkeys(self.info.fields[index].name for index in sorted(here))
            raise bad_option("field", f"the mesh has no field {name!r}, only {', '.join(known)}")
        return found[0].index

    def _vector(self, vector: str | Sequence[str]) -> list[int]:
        """The numbers of the three components of a vector."""
        if not isinstance(vector, str):
            listed = _options.names("vector", vector)
            if len(listed) != 3:
                raise bad_option("vector", f"must be a name, or those of three fields; given: {vector!r}")
            return [self._index(name) for name in listed]
        for name in (f"{vector}@{self._field.time!r}", vector):
            if len(self._arrays.get(name, [])) == 3:
                return self._arrays[name]
        known = [name for name, indices in self._arrays.items() if len(indices) == 3]
        raise bad_option("vector", f"the mesh has no vector {vector!r}, only {', '.join(known) or 'scalar fields: name three'}")


def named_arrays(names: dict[str, list[int]], arrays: Sequence[Array]) -> dict[str, NDArray[Any]]:
    """Arrays of components by their names: of one component (n,), else (n, components). Nothing is copied."""
    rows = {name: np.asarray(array) for name, array in zip(names, arrays)}
    return {name: array[0] if len(array) == 1 else array.T for name, array in rows.items()}


def _pyvista() -> Any:
    try:
        import pyvista
    except ImportError as error:
        raise ImportError("this needs PyVista: pip install pyvista") from error
    return pyvista
