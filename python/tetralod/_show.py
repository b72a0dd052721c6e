"""Volumes in notebooks."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from ._mt import Mt, open

if TYPE_CHECKING:
    from ._widget import Viewer


def show(
    source: Mt | str | os.PathLike[str] | bytes,
    *,
    request: Mapping[str, Any] | None = None,
    scene: Mapping[str, Any] | None = None,
    camera: Mapping[str, Any] | None = None,
    height: int = 480,
    picture: bool = True,
    **how: Any,
) -> Viewer:
    """Draws a volume in a notebook: in JupyterLab, VS Code, Colab or marimo, in a browser with WebGPU, or with WebGL 2 for all but volumes. Needs ``pip install tetralod[notebook]``.

    The browser asks Python for the bytes that the picture needs, so that any ``Mt`` will do, and all that ``tetralod.open`` takes: a path, an
    address, or bytes. ``how`` are arguments of ``tetralod.open``, such as ``headers``. While a cell runs, Python answers no questions.

    ``request``
        The mesh, in the words of ``Mt.refine``, but for ``fields``, ``exact`` and ``progress``. A ``view`` without ``matrix`` and ``viewport``
        is that of the widget's own camera, which the mesh follows. By default ``{"view": {"pixels": 1, "outside": "10%"}, "max_tets": 500_000}``.
    ``scene``
        What is drawn, in the words of ``ViewerState`` of the npm package, as ``tetralod render --print-scene`` prints it: ``isosurfaces``,
        ``volume``, ``slices``, ``boundary``, ``cells``, ``streamlines``, ``arrows``, ``deform``, ``clips``, ``colours``, ``background``, … By default
        what the volume is recognised by.
    ``camera``
        ``{"target", "distance", "yaw", "pitch", "projection"}``; by default all of the volume is in sight.
    ``height``
        In CSS pixels; it is as wide as the cell.
    ``picture``
        Whether there is a PNG beside it, for where notebooks are shown without scripts. ``tetralod render`` draws it, where there is a driver for
        Vulkan, from the front and with at most 100 000 tetrahedra.

    The widget's attributes ``request``, ``scene``, ``camera`` and ``height`` can be set at any time; ``scene`` and ``camera`` are what is shown now,
    ``picked`` is what was clicked at. ``widget.observe(function, names="picked")`` calls a function when one of them changes.

    Raises ``TetralodError`` as ``tetralod.open`` does, and ``ImportError`` where anywidget is not installed.

    >>> widget = tetralod.show(ball, scene={"slices": [{"normal": [0, 0, 1], "offset": 0.5}]}, picture=False)
    >>> widget.request = {"error": "1%", "max_tets": 100_000}
    >>> widget.scene = {**widget.scene, "background": "light"}
    """
    try:
        from ._widget import Viewer
    except ModuleNotFoundError as error:
        if error.name is None or error.name.split(".")[0] not in ("anywidget", "ipywidgets", "traitlets"):
            raise
        raise ImportError(f"tetralod.show needs {error.name}: pip install tetralod[notebook]") from error
    mt = source if isinstance(source, Mt) else open(source, **how)
    given = {"request": request, "scene": scene, "camera": camera}
    return Viewer(mt, height=height, draws=picture, **{name: value for name, value in given.items() if value is not None})
