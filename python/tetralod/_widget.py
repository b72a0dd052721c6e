"""The widget of ``tetralod.show``."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import anywidget
import numpy as np
import traitlets

from . import _native
from ._errors import TetralodError, bad_option
from ._info import Info
from ._mt import NEED, Mt, by_columns, check_names

_REQUEST = (*NEED, "needs", "max_tets", "max_vertices", "max_bytes")

_DEFAULT = {"view": {"pixels": 1, "outside": "10%"}, "max_tets": 500_000}

# Of the PNG, which is to be there soon.
_TETS = 100_000
_WIDTH = 960
_SAMPLES = 4
_SECONDS = 60.0


class Viewer(anywidget.AnyWidget):
    """A volume in a notebook, made by ``tetralod.show``.

    Its attributes are traits: they can be set, linked and observed. The page sets ``scene`` and ``camera`` as it is used, and those below them.
    ``close`` ends it: its worker ends, and the memory of the GPU is freed, as when its cell runs again.
    """

    _esm = Path(__file__).parent / "static" / "widget.js"
    _size = traitlets.Int().tag(sync=True)
    name = traitlets.Unicode(read_only=True).tag(sync=True)
    """What the volume was opened from."""
    height = traitlets.Int(480).tag(sync=True)
    """In CSS pixels."""
    picture = traitlets.Bytes(read_only=True).tag(sync=True)
    """The PNG that is shown where there are no scripts, or neither WebGPU nor WebGL 2; empty until the widget is shown, and where none can be drawn."""
    request = traitlets.Dict().tag(sync=True, to_json=lambda value, widget: _sent(value, widget.mt.info))
    """The mesh, in the words of ``Mt.refine``."""
    scene = traitlets.Dict().tag(sync=True)
    """What is drawn, in the words of ``ViewerState`` of the npm package."""
    camera = traitlets.Dict(allow_none=True, default_value=None).tag(sync=True)
    """From where; ``None`` until it is shown."""
    picked = traitlets.Dict(allow_none=True, default_value=None).tag(sync=True)
    """What is where the picture was clicked last: ``{"position", "values", "region", "tet", "size", "error", …}``; ``None`` beside the volume."""
    stats = traitlets.Dict().tag(sync=True)
    """Of the mesh that is shown, when it has become what was asked for: ``tetrahedra``, ``error_bound``, …"""
    status = traitlets.Unicode().tag(sync=True)
    """``"loading"``, ``"ready"`` or ``"failed"``; empty until it is shown."""
    failure = traitlets.Dict(allow_none=True, default_value=None).tag(sync=True)
    """What went wrong last, until something works again: ``{"code", "message"}`` with a code of ``TetralodError``, or ``"no-webgpu"``."""

    def __init__(self, mt: Mt, *, draws: bool = True, **state: Any) -> None:
        data, name, network = mt._source()
        self.mt = mt
        self._ranges: _native.Ranges | None = _native.Ranges(data, name, network)
        # With its header, which says how long a file in shards is.
        self._ranges.read(0, 32)
        size = self._ranges.size()
        if size is None:
            raise TetralodError("server", f"{name}: the server does not tell the size of the file")
        self._draws = draws
        self._no_picture = ""
        super().__init__(_size=size, **{"request": _DEFAULT, **state})
        self.set_trait("name", name)
        self.on_msg(self._answer)

    def __repr__(self) -> str:
        note = f"; no picture: {self._no_picture}" if self._no_picture else ""
        return f"<tetralod.show {self.name!r}{note}>"

    def close(self) -> None:
        """Ends the widget. The ``Mt`` stays open."""
        self._ranges = None
        super().close()

    @traitlets.validate("request")
    def _check_request(self, proposal: dict[str, Any]) -> dict[str, Any]:
        request: dict[str, Any] = _plain(proposal["value"])
        check_names(request, _REQUEST)
        for need in request.get("needs") or ():
            check_names(need, NEED)
        _sent(request, self.mt.info)
        return request

    @traitlets.validate("scene", "camera")
    def _check(self, proposal: dict[str, Any]) -> Any:
        return _plain(proposal["value"])

    def _answer(self, _: object, content: Mapping[str, Any], buffers: object) -> None:
        """The page asks for bytes of the file."""
        if "read" not in content or self._ranges is None:
            return
        start, end = content["read"]
        try:
            bytes_read = self._ranges.read(start, end)
        except TetralodError as error:
            self.send({"id": content["id"], "error": {"code": error.code, "message": str(error)}})
        else:
            self.send({"id": content["id"]}, [bytes_read])

    def _repr_mimebundle_(self, **how: Any) -> Any:
        """The widget, and for pages without scripts a picture, or why there is none."""
        if self._draws:
            self._draws = False
            try:
                self.set_trait("picture", self._drawn())
            except _NoPicture as reason:
                self._no_picture = str(reason)
        found = super()._repr_mimebundle_(**how)
        if found is not None and self.picture:
            data = found[0] if isinstance(found, tuple) else found
            data["image/png"] = self.picture
        return found

    def _drawn(self) -> bytes:
        """The picture, by the command in another process: a driver that fails must not end this one."""
        data, name, network = self.mt._source()
        if network["headers"]:
            raise _NoPicture("the file is on a server that wants headers")
        with tempfile.TemporaryDirectory() as folder:
            path, scene, picture = (Path(folder, name) for name in ("volume.mt", "scene.json", "picture.png"))
            scene.write_text(json.dumps(self.scene))
            if isinstance(data, bytes):
                path.write_bytes(data)
            given = path if isinstance(data, bytes) else os.fspath(data)
            most = min(self.request.get("max_tets") or _TETS, _TETS)
            size = f"{_WIDTH}x{max(self.height, 1)}"
            words = ["--budget", most, "--size", size, "--samples", _SAMPLES, "--scene", scene, "--output", picture]
            if isinstance(self.request.get("field"), str):
                words += ["--field", self.request["field"]]
            try:
                done = subprocess.run(
                    [sys.executable, "-m", "tetralod", "render", given, *map(str, words)],
                    capture_output=True, text=True, errors="replace", timeout=_SECONDS, stdin=subprocess.DEVNULL,
                )  # fmt: skip
            except subprocess.TimeoutExpired:
                raise _NoPicture(f"it is not there after {_SECONDS:g} s") from None
            except OSError as error:
                raise _NoPicture(str(error)) from None
            if done.returncode != 0:
                errors = re.findall("^error: (.*)$", done.stderr, re.MULTILINE)
                raise _NoPicture(errors[-1] if errors else f"`tetralod render` ends with {done.returncode}")
            return picture.read_bytes()


class _NoPicture(Exception):
    """Why there is no picture."""


def _plain(value: Any) -> Any:
    """Arrays as lists: what JSON can hold."""
    if isinstance(value, Mapping):
        return {str(name): _plain(member) for name, member in value.items()}
    if isinstance(value, (list, tuple, range)):
        return [_plain(member) for member in value]
    return value.tolist() if isinstance(value, (np.ndarray, np.generic)) else value


def _sent(request: Mapping[str, Any], info: Info) -> Any:
    """A request in the words of the page."""
    sent = {name: value for name, value in request.items() if name != "time" and value is not None}
    if request.get("field") is not None or request.get("time") is not None:
        # The page knows fields by their numbers, and steps by the numbers of their fields.
        sent["field"] = info.field(request.get("field"), request.get("time")).index
    if "needs" in sent:
        sent["needs"] = [_sent(need, info) for need in sent["needs"]]
    if isinstance(sent.get("isovalues"), (int, float)):
        sent["isovalues"] = [sent["isovalues"]]
    if not isinstance(sent.get("view", {}), Mapping):
        raise bad_option("view", "must be a mapping")
    if sent.get("view", {}).get("matrix") is not None:
        sent["view"] = {**sent["view"], "matrix": by_columns(np.asarray(sent["view"]["matrix"])).tolist()}
    return _camel(sent)


def _camel(value: Any) -> Any:
    if isinstance(value, dict):
        return {re.sub("_(.)", lambda found: found[1].upper(), name): _camel(member) for name, member in value.items()}
    return [_camel(member) for member in value] if isinstance(value, list) else value
