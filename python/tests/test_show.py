"""Promise: a widget shows any MT that Python has; its state is that of the page, both ways; pages without scripts have a picture."""

import base64
import json
import os
import queue
import re
import struct
import subprocess
import sys
import threading
import time
import zlib
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import comm
import nbclient
import nbformat
import numpy as np
import pytest
from comm.base_comm import BaseComm
from conftest import command

import tetralod

ROOT = Path(os.environ.get("TETRALOD_ROOT", Path(__file__).parents[2]))
PATIENCE = 90
PNG = b"\x89PNG\r\n\x1a\n"


class Page(BaseComm):
    """The other end of a widget's connection."""

    def __init__(self, **how):
        self.sent = []
        self.messages = queue.Queue()
        super().__init__(**how)

    def publish_msg(self, msg_type, data=None, metadata=None, buffers=None, **keys):
        self.sent.append((msg_type, data, list(buffers or [])))
        self.messages.put(self.sent[-1])

    def says(self, data):
        self.handle_msg({"content": {"data": data}, "buffers": []})

    def sets(self, **state):
        self.says({"method": "update", "state": state, "buffer_paths": []})

    def reads(self, start, end):
        """What comes back for a range: the content, and bytes."""
        self.says({"method": "custom", "content": {"id": "1", "read": [start, end]}})
        _, data, buffers = self.sent[-1]
        assert data["method"] == "custom" and data["content"]["id"] == "1"
        return data["content"], b"".join(bytes(buffer) for buffer in buffers)

    def state(self):
        """What it knows of the widget."""
        known = {}
        for _, data, _ in self.sent:
            if data.get("method") != "echo_update":
                known.update(data.get("state", {}))
        return known


@pytest.fixture
def show(monkeypatch):
    """``tetralod.show`` with a page that hears of it, and without a picture."""
    monkeypatch.setattr(comm, "create_comm", Page)
    widgets = []

    def shown(source, **how):
        widgets.append(tetralod.show(source, **{"picture": False, **how}))
        return widgets[-1], widgets[-1].comm

    yield shown
    for widget in widgets:
        widget.close()


def refused(code, words, act, *args, **how):
    with pytest.raises(tetralod.TetralodError, match=re.escape(words)) as caught:
        act(*args, **how)
    assert caught.value.code == code


def test_what_is_set_goes_to_the_page_in_its_words(ball, show):
    widget, page = show(ball, request={"error": "1%", "isovalues": 0.5, "max_tets": 1000})
    assert page.target_name == "jupyter.widget" and "export" in page.state()["_esm"]
    assert page.state()["request"] == {"error": "1%", "isovalues": [0.5], "maxTets": 1000}
    half = {"center": np.zeros(3), "half_axes": np.eye(3)}
    widget.request = {"field": "v_y", "error": 0.1, "needs": [{"oriented_box": half, "error": "2%"}]}
    assert page.state()["request"] == {
        "field": ball.info.field("v_y").index,
        "error": 0.1,
        "needs": [{"orientedBox": {"center": [0, 0, 0], "halfAxes": np.eye(3).tolist()}, "error": "2%"}],
    }
    matrix = np.arange(16.0).reshape(4, 4)
    widget.request = {"view": {"matrix": matrix, "viewport": (640, 480), "pixels": 1}}
    assert page.state()["request"]["view"]["matrix"] == matrix.T.ravel().tolist()
    widget.scene = {"slices": [{"normal": np.array([0, 0, 1]), "offset": np.float64(0.5)}]}
    assert page.state()["scene"] == {"slices": [{"normal": [0, 0, 1], "offset": 0.5}]}
    json.dumps({name: page.state()[name] for name in ("request", "scene", "camera", "height", "name")})
    refused("bad-option", "`eror`: there is none of this name", setattr, widget, "request", {"eror": 1})
    refused("bad-option", "`max_tets`", setattr, widget, "request", {"needs": [{"max_tets": 1}]})
    refused("bad-option", "pressure", setattr, widget, "request", {"field": "pressure"})
    refused("bad-option", "`view`: must be a mapping", setattr, widget, "request", {"view": "front"})
    assert "view" in widget.request, "what is refused changes nothing"


def test_steps_in_time_are_told_by_the_number_of_their_field(show):
    points = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
    data = {"T@1": [0, 1, 2, 3], "T@2.5": [3, 2, 1, 0]}
    mt = tetralod.build(points, [[0, 1, 2, 3]], data, all_fields=True)
    widget, page = show(mt)
    for field in mt.info.fields:
        widget.request = {"field": field.name, "time": field.time}
        assert page.state()["request"] == {"field": field.index}


def test_what_the_page_sets_is_heard(ball, show):
    widget, page = show(ball)
    heard = []
    widget.observe(heard.append, names=["picked", "camera", "status", "failure"])
    camera = {"target": [0.5, 0.5, 0.5], "distance": 3, "yaw": 0.1, "pitch": 0.2, "projection": "perspective"}
    page.sets(status="ready", camera=camera, scene={"isosurfaces": [{"value": 0.5}]}, stats={"tetrahedra": 12})
    page.sets(picked={"position": [0, 0, 0.5], "values": {"r": 0.5}})
    assert widget.camera == camera and widget.scene == {"isosurfaces": [{"value": 0.5}]}
    assert (widget.status, widget.stats["tetrahedra"], widget.picked["values"]["r"]) == ("ready", 12, 0.5)
    page.sets(status="failed", failure={"code": "no-webgpu", "message": "this browser has no WebGPU"})
    assert widget.failure["code"] == "no-webgpu"
    assert sorted(change["name"] for change in heard) == ["camera", "failure", "picked", "status", "status"]


@pytest.fixture(scope="module")
def served(tmp_path_factory, ball):
    """A file, and its address."""
    path = tmp_path_factory.mktemp("shown") / "ball.mt"
    ball.save(path)
    words = [sys.executable, "-m", "tetralod", "serve", str(path.parent), "--port", "0"]
    with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) as server:
        address = re.search(r"http://[^\s/]+", server.stdout.readline()).group()
        yield path, f"{address}/ball.mt"
        server.terminate()


@pytest.mark.parametrize("kind", ["bytes", "path", "address", "open"])
def test_the_page_reads_ranges_of_whatever_is_shown(served, show, kind):
    path, address = served
    whole = path.read_bytes()
    given = {"bytes": whole, "path": path, "address": address, "open": tetralod.open(whole)}[kind]
    widget, page = show(given)
    size = page.state()["_size"]
    assert size == len(whole) == widget.mt.info.file_bytes
    assert widget.name == page.state()["name"] == {"path": str(path), "address": address}.get(kind, "the MT file")
    for start, end in ((0, 65536), (size - 10, size), (7, 8), (size - 5, size + 5)):
        assert page.reads(start, end) == ({"id": "1"}, whole[start:end])
    widget.mt.close()
    assert page.reads(0, 4)[1] == whole[:4], "the widget has the file for itself"
    count = len(page.sent)
    widget.close()
    page.says({"method": "custom", "content": {"id": "2", "read": [0, 4]}})
    assert [kind for kind, *_ in page.sent[count:]] == ["comm_close"]


def test_what_cannot_be_read_is_an_error_with_its_code(ball, show, tmp_path):
    path = tmp_path / "cut.mt"
    ball.save(path)
    _, page = show(path)
    size = path.stat().st_size
    with path.open("r+b") as file:
        file.truncate(size // 2)
    content, found = page.reads(size - 100, size)
    assert content["error"]["code"] == "changed" and "cut.mt" in content["error"]["message"] and found == b""
    assert page.reads(0, 4)[1] == path.read_bytes()[:4]
    refused("not-mt", "the MT file", tetralod.show, b"no MT file at all")
    refused("bad-source", "missing.mt", tetralod.show, tmp_path / "missing.mt")
    ended = tetralod.build([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 1, 2, 3]], {"p": [0, 1, 2, 3]})
    ended.close()
    refused("not-ready", "has been closed", tetralod.show, ended)


@pytest.mark.graphics
def test_without_scripts_there_is_a_picture(ball, show):
    scene = {"slices": [{"normal": [0, 0, 1], "offset": 0.5}], "background": "light"}
    widget, page = show(ball, scene=scene, height=200, picture=True)
    data, _ = widget._repr_mimebundle_()
    assert data["application/vnd.jupyter.widget-view+json"]["model_id"] == widget.model_id
    png = data["image/png"]
    width, height = (int.from_bytes(png[at : at + 4], "big") for at in (16, 20))
    assert png.startswith(PNG) and (width, height) == (960, 200)
    # The element has it until it has drawn its own.
    sent = [buffers for _, data, buffers in page.sent if ["picture"] in data.get("buffer_paths", [])]
    assert bytes(sent[-1][0]) == png
    assert widget._repr_mimebundle_()[0]["image/png"] == png


def test_why_there_is_no_picture_is_said(ball, show, monkeypatch):
    for name in ("VK_DRIVER_FILES", "VK_ICD_FILENAMES"):
        monkeypatch.setenv(name, os.devnull)
    widget, _ = show(ball, picture=True)
    data, _ = widget._repr_mimebundle_()
    assert "image/png" not in data and "no picture: there is no Vulkan adapter" in repr(widget)
    silent, _ = show(ball)
    assert "image/png" not in silent._repr_mimebundle_()[0] and "no picture" not in repr(silent)


def test_without_anywidget_it_says_what_to_install(ball, monkeypatch):
    monkeypatch.setitem(sys.modules, "anywidget", None)
    monkeypatch.delitem(sys.modules, "tetralod._widget")
    with pytest.raises(ImportError, match=r"pip install tetralod\[notebook\]"):
        tetralod.show(ball)


@pytest.mark.graphics
def test_the_notebook_of_the_documentation_runs_from_top_to_bottom(folder):
    text = (ROOT / "docs/howto/notebooks.md").read_text(encoding="utf-8").split("## Without the package")[0]
    cells = [nbformat.v4.new_code_cell(block) for block in re.findall(r"^```python\n(.*?)^```", text, re.M | re.S)]
    assert "tetralod.build" in cells[0].source and len(cells) > 3
    notebook = nbformat.v4.new_notebook(cells=cells)
    nbclient.NotebookClient(notebook, timeout=PATIENCE, kernel_name="python3", resources={"metadata": {"path": "."}}).execute()
    bundles = [output["data"] for cell in cells for output in cell.outputs if "data" in output]
    shown = [data for data in bundles if "application/vnd.jupyter.widget-view+json" in data]
    assert len(shown) == 1 and "tetralod.show" in shown[0]["text/plain"]
    assert any("image/png" in data for data in bundles if data is not shown[0]), "that of PyVista"


def three_pixels():
    """A PNG of three pixels."""
    head, rows = struct.pack(">IIBBBBB", 3, 1, 8, 0, 0, 0, 0), zlib.compress(b"\0\x10\x80\xf0")
    chunks = [(b"IHDR", head), (b"IDAT", rows), (b"IEND", b"")]
    return PNG + b"".join(struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data)) for kind, data in chunks)


class Chromium:
    """A page of the browser, driven by `tests/js/notebook.js`."""

    def __init__(self):
        self.process = subprocess.Popen(
            ["node", ROOT / "tests/js/notebook.js"], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )

    def __call__(self, name, argument):
        print(json.dumps({name: argument}), file=self.process.stdin, flush=True)
        answer = json.loads(self.process.stdout.readline())
        assert "error" not in answer, answer["error"]
        return answer["result"]

    def close(self):
        self.process.stdin.close()
        self.process.wait(PATIENCE)
        self.process.stdout.close()


@pytest.fixture
def notebook(show):
    """Shows a widget in Chromium."""
    held = {}

    class Handler(BaseHTTPRequestHandler):
        def log_message(self, *_):
            pass

        def answers(self, kind, body):
            self.send_response(200)
            self.send_header("content-type", kind)
            self.send_header("content-length", str(len(body)))
            self.end_headers()
            self.wfile.write(body)

        def do_GET(self):
            if self.path == "/widget.js":
                return self.answers("text/javascript", held["page"].state()["_esm"].encode())
            if self.path != "/page":
                return self.answers("text/html", Path(__file__).with_name("page.html").read_bytes())
            self.send_response(200)
            self.send_header("content-type", "text/event-stream")
            self.end_headers()
            while True:
                _, data, buffers = held["page"].messages.get()
                if data.get("method") == "end":
                    return None
                texts = [base64.b64encode(bytes(buffer)).decode() for buffer in buffers]
                state = {name: value for name, value in data.get("state", {}).items() if name != "_esm"}
                line = json.dumps({**data, **({"state": state} if state else {}), "buffers": texts})
                self.wfile.write(f"data: {line}\n\n".encode())
                self.wfile.flush()

        def do_POST(self):
            data = json.loads(self.rfile.read(int(self.headers["content-length"])))
            held["page"].says(data)
            self.answers("text/plain", b"")

    server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    server.daemon_threads = True
    threading.Thread(target=server.serve_forever, daemon=True).start()
    chromium = Chromium()

    def opened(source, then=lambda widget: None, query="", **how):
        widget, held["page"] = show(source, **how)
        then(widget)
        chromium("open", f"http://127.0.0.1:{server.server_port}/{query}")
        return widget, chromium

    yield opened
    chromium.close()
    if "page" in held:
        held["page"].messages.put(("", {"method": "end"}, []))
    server.shutdown()
    server.server_close()


def until(what, is_so):
    """Waits for what the page does."""
    end = time.monotonic() + PATIENCE
    while not is_so():
        assert time.monotonic() < end, f"not in time: {what()}"
        time.sleep(0.02)


@pytest.mark.graphics
def test_in_chromium_it_is_moved_by_code_and_by_mouse(ball, notebook):
    widget, chromium = notebook(ball, scene={"isosurfaces": [{"value": 0.8}]}, request={"error": "2%"})
    said = lambda: (widget.status, widget.failure, widget.camera, widget.scene, widget.stats)  # noqa: E731
    reference = ball.refine(error="2%").stats
    until(said, lambda: widget.stats and widget.camera and widget.status == "ready")
    assert widget.failure is None and widget.scene["isosurfaces"] == [{"value": 0.8}]
    assert widget.stats["tetrahedra"] == reference.tetrahedra and widget.stats["satisfied"] is True
    # By mouse: a drag to the right over half of its height turns it by half of π.
    before = widget.camera
    chromium("drag", [500, 250, 240, 0])
    until(said, lambda: widget.camera["yaw"] != pytest.approx(before["yaw"]))
    until(said, lambda: abs(np.cos(widget.camera["yaw"] - before["yaw"])) < 0.02)
    # By code.
    widget.camera = {**widget.camera, "yaw": 1.0, "pitch": 0.5}
    chromium("until", "Math.abs(shown.element.viewer.state.camera.yaw - 1) < 1e-6")
    widget.scene = {"boundary": {}, "background": "light"}
    chromium("until", "shown.element.viewer.state.boundary && !shown.element.viewer.state.isosurfaces?.length")
    widget.request = {"error": 0, "max_tets": 500}
    until(said, lambda: 0 < widget.stats["tetrahedra"] <= 500)
    # What is clicked at is on the boundary of the cube, with the distance from the origin.
    chromium("until", "shown.element.viewer.settled().then(() => true)")
    chromium("click", [600, 250])
    until(said, lambda: widget.picked is not None)
    place = np.array(widget.picked["position"])
    assert np.isclose(np.abs(place - 0.5).max(), 0.5, atol=1e-3), place
    assert f"r {float(format(widget.picked['values']['r'], '.4g'))} m" in chromium("until", "document.querySelector('output').textContent")
    if "TETRALOD_PICTURES" in os.environ:
        chromium("picture", str(Path(os.environ["TETRALOD_PICTURES"], "widget.png")))
    # What is wrong is said there and here, and goes when it is right again.
    widget.scene = {"boundary": {"colour": "red-ish"}}
    until(said, lambda: widget.failure is not None)
    assert widget.status == "failed" and widget.failure["code"] == "bad-option" and "colour" in widget.failure["message"]
    widget.scene = {"boundary": {}}
    until(said, lambda: widget.failure is None and widget.status == "ready")
    chromium("until", "window.held = shown.element.viewer, shown.close(), !shown.element")
    chromium("until", "held.refine({ error: 0 }).catch(({ code }) => code === 'freed')")
    assert chromium("complaints", True) == []


@pytest.mark.graphics
def test_in_chromium_without_a_gpu_there_is_the_picture_and_the_reason(ball, notebook):
    dot = three_pixels()
    widget, chromium = notebook(ball, query="?no-gpu", then=lambda widget: widget.set_trait("picture", dot))
    until(lambda: widget.status, lambda: widget.failure is not None)
    assert (widget.status, widget.failure["code"]) == ("failed", "no-webgpu")
    assert chromium("until", "document.querySelector('img[slot=poster]').naturalWidth") == 3
    assert "no WebGPU and no WebGL 2" in chromium("until", "shown.element.shadowRoot.querySelector('[part=message]').textContent")


@pytest.mark.graphics
def test_in_chromium_errors_of_python_keep_their_code(ball, notebook, tmp_path):
    path = tmp_path / "cut.mt"
    command("generate", "bucky", "--size", "17", "-o", tmp_path / "bucky.vti")
    command("build", tmp_path / "bucky.vti", "-o", path, "--quiet")
    mt = tetralod.open(path)
    widget, _ = notebook(mt, then=lambda _: os.truncate(path, 20))
    until(lambda: widget.status, lambda: widget.failure is not None)
    assert widget.status == "failed" and widget.failure["code"] == "changed" and "cut.mt" in widget.failure["message"]
