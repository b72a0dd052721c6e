"""What the compiled module has; for the package alone."""

from collections.abc import Callable, Sequence
from os import PathLike
from typing import Any

_Triangles = tuple[Array, Array, list[Array]]
_Progress = Callable[[str, int, int], object] | None

class Array:
    @property
    def __array_interface__(self) -> dict[str, Any]: ...

class Mt:
    def __new__(
        cls, given: str | PathLike[str] | bytes, name: str, fields: list[str], memory: int | None, network: dict[str, Any]
    ) -> Mt: ...
    def info(self) -> str: ...
    def refine(
        self,
        needs: list[dict[str, Any]],
        limits: tuple[int | None, int | None, int | None],
        field: int,
        groups: list[list[int]],
        shown: list[str] | None,
        exact: bool,
        progress: _Progress,
    ) -> tuple[Mesh, str]: ...

class Mesh:
    def share(self) -> tuple[Array, Array, Array, Array, list[Array]]: ...
    def isosurface(self, field: int, values: list[float], is_smooth: bool) -> tuple[_Triangles, Array]: ...
    def slice(self, normal: list[float], offset: float) -> tuple[_Triangles, Array]: ...
    def boundary(self) -> _Triangles: ...
    def probe(self, points: bytes) -> list[Array]: ...
    def streamlines(
        self, vector: list[int], seeds: bytes, way: dict[str, Any]
    ) -> tuple[Array, Array, Array, Array, list[str], list[Array]]: ...
    def stats(
        self, field: int, range: tuple[float, float], bins: int, fractions: list[float]
    ) -> tuple[list[float], list[Array]]: ...

def build(
    input: list[str] | tuple[str, bytes], options: dict[str, Any], progress: _Progress
) -> tuple[bytes, str]: ...
def run(arguments: Sequence[str], again: Sequence[str]) -> int: ...
