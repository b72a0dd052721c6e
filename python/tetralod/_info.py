"""What is known of an MT file as soon as it is open."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._errors import bad_option


@dataclass(frozen=True)
class VectorPart:
    """Which part of a vector or tensor a field is."""

    name: str
    """The name of the vector."""
    component: int | None
    """Which component, from 0; ``None`` for what follows from the components, such as the length."""


@dataclass(frozen=True, eq=False)
class Field:
    """A scalar field of an MT; a vector has one for each component, a time series one for each step."""

    index: int
    """Its place in ``Info.fields``."""
    name: str
    unit: str
    """Of its values; empty if it is not known."""
    time: float | None
    """The time that its values are of, if it is known. Time steps of one field are fields of one name."""
    vector: VectorPart | None
    is_label: bool
    """Whether it is a label: whole numbers with nothing between two of them; a place has that of the nearest corner."""
    min: float
    """The smallest value over all time steps, and with ``max`` the range that errors in % are of."""
    max: float
    bits: int
    """Binary digits of a value in the file."""
    floor: float
    """The error, in units of the field, that rounding leaves at full resolution."""
    histogram: NDArray[np.float64] | None
    """The share of the volume in each of 64 bins of the range, if the file says."""
    extremes: dict[str, Any] | None
    """Where the input has its smallest and largest value: ``{"min": {"value", "place", …}, "max": …}``."""
    averaged: dict[str, Any] | None
    """What averaging has done to it, if the input has it at cells: ``{"input": extremes, "difference": {"rms", "largest"}}``."""
    isovalue: float | None
    """A value that an isosurface is likely to show something at."""
    curve: dict[str, NDArray[np.float64]]
    """What a mesh of the whole domain takes: ``errors``, in units of the field, and the ``bytes`` of the file for each."""

    @property
    def range(self) -> float:
        """``max - min``, or 1 for a constant field: what errors in % are of."""
        return self.max - self.min if self.max > self.min else 1.0


@dataclass(frozen=True)
class Region:
    """A part of the volume that all meshes keep apart."""

    name: str
    labels: tuple[int, ...]
    """The whole number that each of ``Regions.arrays`` has in it."""
    tetrahedra: int
    """Of the reference mesh, as are the next two."""
    volume: float
    bounds: tuple[float, ...]
    color: str
    """``"#rrggbb"``: another than those of the regions that it touches."""


@dataclass(frozen=True)
class Regions:
    """The parts of the volume that all meshes keep apart."""

    arrays: tuple[str, ...]
    """The arrays of the input that tell them apart."""
    deviation: float
    """How far interfaces between them are from those of the input in any mesh, in model units."""
    all: tuple[Region, ...]


@dataclass(frozen=True)
class Info:
    """What is in an MT file."""

    kind: str
    """``"half-edge"``, ``"edge"`` or ``"vertex"``."""
    vertices: int
    """Of the reference mesh, the finest one."""
    tetrahedra: int
    base_vertices: int
    """Of the base mesh, the coarsest one."""
    base_tetrahedra: int
    updates: int
    """Between the base mesh and the reference mesh."""
    bounds: tuple[float, ...]
    """The box around the reference mesh, which all meshes are in: x0, y0, z0, x1, y1, z1 in model units."""
    fields: tuple[Field, ...]
    first_field: int
    """The field that is meant where none is named: the first that varies, is no label, no component of a vector, and, by its name, neither
    numbers something nor says where it is."""
    regions: Regions | None
    """``None`` if the file was built without ``preserve``."""
    surface_first: bool | None
    """Whether an isosurface of that field shows more than the boundary: where the domain fills the box around it, but for a fiftieth of its
    volume, as that of a grid, and the field is not linear. It is drawn first then."""
    exact_values: str
    """Whether the file keeps exact values (``lossless``): ``"none"``, ``"here"``, or ``"missing"`` where it is cut off."""
    metadata: dict[str, str]
    file_bytes: int | None

    def field(self, name: str | int | None = None, time: float | None = None) -> Field:
        """The field of a name, or its number, at a time; without a time its first step; without a name the one that is meant then.

        Raises ``TetralodError`` (``bad-option``) if there is none.
        """
        if name is None:
            name = self.fields[self.first_field].name if time is not None else self.first_field
        if isinstance(name, str):
            found = [field for field in self.fields if field.name == name]
            if not found:
                known = ", ".join(dict.fromkeys(field.name for field in self.fields))
                raise bad_option("field", f"there is no field {name!r}, only {known}")
        else:
            if not 0 <= name < len(self.fields):
                raise bad_option("field", f"there are fields 0 to {len(self.fields) - 1}; given: {name}")
            found = [self.fields[name]]
        if time is None:
            return found[0]
        # Exactly this time, or the one that six digits do not tell from it.
        for is_it in (lambda own: own == time, lambda own: math.isclose(own, time, rel_tol=5e-6)):
            at = [field for field in found if field.time is not None and is_it(field.time)]
            if len(at) == 1:
                return at[0]
        times = ", ".join(repr(field.time) for field in found if field.time is not None)
        raise bad_option("time", f"{found[0].name!r} has no time step at {time}; its times are {times or 'not known'}")


def info_of(text: str) -> Info:
    """The object of what the native module says."""
    raw = json.loads(text)
    raw["bounds"] = tuple(raw["bounds"])
    raw["fields"] = tuple(_field(field) for field in raw["fields"])
    if raw["regions"] is not None:
        regions = raw["regions"]
        listed = tuple(
            Region(**{**region, "labels": tuple(region["labels"]), "bounds": tuple(region["bounds"])})
            for region in regions["all"]
        )
        raw["regions"] = Regions(tuple(regions["arrays"]), regions["deviation"], listed)
    return Info(**raw)


def _field(raw: dict[str, Any]) -> Field:
    vector = raw["vector"]
    raw["vector"] = vector and VectorPart(vector["name"], vector.get("component"))
    raw["histogram"] = None if raw["histogram"] is None else np.array(raw["histogram"])
    errors = [math.inf if error is None else error for error in raw["curve"]["errors"]]
    raw["curve"] = {"errors": np.array(errors, dtype=float), "bytes": np.array(raw["curve"]["bytes"], dtype=float)}
    return Field(**raw)


def arrays_of(fields: list[Field]) -> dict[str, list[int]]:
    """The arrays that fields make, by their names, with the numbers of their components: vectors are joined. Where there are several time
    steps of one array, each has its time behind its name."""
    vectors: dict[tuple[str, float | None], list[Field]] = {}
    for field in fields:
        if field.vector is not None and field.vector.component is not None:
            vectors.setdefault((field.vector.name, field.time), []).append(field)
    groups: list[tuple[str, float | None, list[int]]] = []
    for field in fields:
        parts = vectors.get((field.vector.name, field.time), []) if field.vector else []
        is_whole = len(parts) > 1 and [part.vector and part.vector.component for part in parts] == list(range(len(parts)))
        if not is_whole or field not in parts:
            groups.append((field.name, field.time, [field.index]))
        elif field is parts[0] and field.vector:
            groups.append((field.vector.name, field.time, [part.index for part in parts]))
    named = [name for name, _, _ in groups]
    arrays: dict[str, list[int]] = {}
    for name, time, indices in groups:
        name = f"{name}@{time!r}" if time is not None and named.count(name) > 1 else name
        while name in arrays:
            name += "_"
        arrays[name] = indices
    return arrays
