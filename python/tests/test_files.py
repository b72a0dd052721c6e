"""Promise: files are read as far as they are needed, from disks and servers; other threads run meanwhile; Ctrl-C ends the work."""

import os
import re
import signal
import socket
import subprocess
import sys
import threading

import numpy as np
import pytest
from conftest import command, grid_points, hexahedra

import tetralod


@pytest.fixture(scope="module")
def served(tmp_path_factory):
    """The path and the address of a file of many blocks."""
    folder = tmp_path_factory.mktemp("served")
    command("generate", "bucky", "--size", "33", "-o", folder / "bucky.vti")
    command("build", folder / "bucky.vti", "-o", folder / "bucky.mt", "--quiet")
    command("generate", "hydrogen", "--size", "25", "-o", folder / "orbital.vti")
    command("build", folder / "orbital.vti", "-o", folder / "orbital.mt", "--quiet", "--all-fields")
    (folder / "page.html").write_text("<!doctype html><title>no file</title>")
    (folder / "text.mt").write_text("this is no MT file")
    words = [sys.executable, "-m", "tetralod", "serve", str(folder), "--port", "0"]
    with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) as server:
        line = server.stdout.readline()
        yield folder / "bucky.mt", re.search(r"http://[^\s/]+", line).group()
        server.terminate()


def test_a_file_on_a_server_is_read_in_parts(served, tmp_path):
    path, address = served
    size = path.stat().st_size
    request = {"error": "1%", "box": [0, 0, 0, 0.2, 0.2, 0.2]}
    local = tetralod.open(path).refine(**request)
    told = []
    cache = tmp_path / "cache"
    with tetralod.open(f"{address}/bucky.mt", cache=cache) as mt:
        assert mt.info.file_bytes == size
        mesh = mt.refine(**request, progress=lambda *step: told.append(step))
        assert mesh.stats.hash == local.stats.hash and np.array_equal(mesh.points, local.points)
        assert 0 < mesh.stats.bytes_read < size and mesh.stats.requests >= mesh.stats.rounds >= 1
        assert {stage for stage, *_ in told} <= {"fetch", "refine"}
        finest = mt.refine(error=0)
        assert finest.stats.tetrahedra == mt.info.tetrahedra
    assert any(cache.rglob("*"))
    again = tetralod.open(f"{address}/bucky.mt", cache=cache).refine(error=0)
    assert again.stats.hash == finest.stats.hash and again.stats.bytes_read < size / 2
    with pytest.raises(tetralod.TetralodError, match="has been closed") as caught:
        mt.refine()
    assert caught.value.code == "not-ready"
    # A mesh that was taken out stays.
    assert finest.isosurface(0.5).triangles.size > 0


def test_what_is_no_file_is_said(served, tmp_path):
    path, address = served
    cut = tmp_path / "cut.mt"
    cut.write_bytes(path.read_bytes()[:3000])
    damaged = bytearray(path.read_bytes())
    damaged[len(damaged) // 2] ^= 1
    for source, code, words in (
        (f"{address}/missing.mt", "network", "404"),
        (f"{address}/page.html", "server", "a web page"),
        (f"{address}/text.mt", "not-mt", "text.mt"),
        (tmp_path / "missing.mt", "bad-source", "missing.mt"),
        (b"", "not-mt|truncated", "the MT file"),
        (cut, "truncated", "cut.mt"),
        (17, "bad-source", "not int"),
    ):
        with pytest.raises(tetralod.TetralodError, match=re.escape(words)) as caught:
            tetralod.open(source).refine()
        assert re.fullmatch(code, caught.value.code), caught.value
    with pytest.raises(tetralod.TetralodError) as caught:
        tetralod.open(bytes(damaged)).refine()
    assert caught.value.code == "corrupt"


def test_a_file_in_shards_is_read_as_one(served):
    path, address = served
    cut = path.with_name("cut.mt")
    command("convert", path, "--shard-size", "64K", "-o", cut, "--quiet")
    finest = tetralod.open(path).refine(error=0)
    for source in (cut, f"{address}/cut.mt"):
        with tetralod.open(source) as mt:
            assert mt.info.file_bytes == path.stat().st_size > cut.stat().st_size
            assert mt.refine(error=0).stats.hash == finest.stats.hash
    path.with_name("cut.mt.0002").unlink()
    for source in (cut, f"{address}/cut.mt"):
        with pytest.raises(tetralod.TetralodError, match=re.escape("`.0002`")) as caught:
            tetralod.open(source).refine(error=0)
        assert caught.value.code == "truncated"


def test_memory_limits_what_is_kept(served):
    path, _ = served
    mesh = tetralod.open(path, memory=20_000).refine(error=0)
    assert not mesh.stats.satisfied and mesh.stats.limited_by == "memory"


def test_only_some_fields_are_read(served):
    _, address = served
    mt, whole = (tetralod.open(f"{address}/orbital.mt", fields=fields) for fields in (["density"], []))
    assert [field.name for field in mt.info.fields] == ["density"] and len(whole.info.fields) > 1
    assert mt.refine(error=0).stats.bytes_read < whole.refine(error=0).stats.bytes_read


def test_other_threads_run_meanwhile(ball):
    """Threads give way to one another only where the GIL is released: with this interval never by themselves."""
    points, cells = grid_points(9), {12: hexahedra(9)}
    values = np.sin(9 * points).sum(axis=1)
    mesh = ball.refine(error=0)
    works = {
        "build": lambda: tetralod.build(points, cells, {"f": values}),
        "refine": lambda: (ball.refine(error=0), ball.refine(error="50%")),
        "isosurface": lambda: mesh.isosurface(0.5),
        "probe": lambda: mesh.probe(points),
    }
    counted, ended = [0], threading.Event()

    def count():
        while not ended.wait(0.001):
            counted[0] += 1

    before = sys.getswitchinterval()
    thread = threading.Thread(target=count)
    thread.start()
    sys.setswitchinterval(1000)
    try:
        for name, work in works.items():
            for _ in range(2000):
                start = counted[0]
                work()
                if counted[0] > start:
                    break
            else:
                pytest.fail(f"{name} holds the GIL")
    finally:
        sys.setswitchinterval(before)
        ended.set()
        thread.join()


def test_a_mesh_cannot_be_asked_for_while_another_is_made(served):
    mt = tetralod.open(served[0])
    with pytest.raises(tetralod.TetralodError, match="told the progress"):
        mt.refine(error="1%", progress=lambda *_: mt.refine(error="5%"))
    assert mt.refine(error="5%").stats.satisfied


def test_one_file_serves_several_threads(served):
    mt = tetralod.open(served[0])
    errors = ["50%", "10%", "2%", "0.5%"]
    expected = [tetralod.open(served[0]).refine(error=error).stats.hash for error in errors]
    found = [None] * len(errors)

    def work(number):
        found[number] = mt.refine(error=errors[number]).stats.hash

    threads = [threading.Thread(target=work, args=(number,)) for number in range(len(errors))]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert found == expected


@pytest.mark.skipif(os.name == "nt", reason="signals are sent otherwise there")
def test_ctrl_c_ends_a_wait():
    """A server that never answers: without a look at signals, the wait would last for minutes and end with another error."""
    ended = threading.Event()
    with socket.create_server(("127.0.0.1", 0)) as server:

        def interrupt():
            connection, _ = server.accept()
            os.kill(os.getpid(), signal.SIGINT)
            ended.wait()
            connection.close()

        thread = threading.Thread(target=interrupt)
        # Where a shell has started this in the background, the signal is ignored.
        before = signal.signal(signal.SIGINT, signal.default_int_handler)
        thread.start()
        try:
            with pytest.raises(KeyboardInterrupt):
                tetralod.open(f"http://127.0.0.1:{server.getsockname()[1]}/a.mt")
        finally:
            signal.signal(signal.SIGINT, before)
            ended.set()
            thread.join()


def test_the_command_is_in_the_package(tmp_path):
    assert command("--version").startswith("tetralod ")
    done = subprocess.run([sys.executable, "-m", "tetralod", "info", str(tmp_path / "no.mt")], capture_output=True, text=True)
    assert done.returncode == 1 and "no.mt" in done.stderr
    done = subprocess.run([sys.executable, "-m", "tetralod", "slice"], capture_output=True, text=True)
    assert done.returncode == 2 and "Usage: tetralod slice" in done.stderr
    script = os.path.join(os.path.dirname(sys.executable), "tetralod")
    assert subprocess.run([script, "--version"], capture_output=True, text=True).stdout == command("--version")


def test_a_page_is_one_file(ball, folder):
    (folder / "page" / "pkg").mkdir(parents=True)
    for name, content in [("index.html", ""), ("pkg/viewer.js", ""), ("pkg/inline-viewer.js", "let viewer;")]:
        (folder / "page" / name).write_text(content)
    options = {"page": folder / "page", "no_poster": True}
    text = ball.to_html(error="10%", isovalue=[0.5, 0.75], box=(0, 0, 0, 1, 1, 1), from_="+x", title="ball", **options)
    assert "<title>ball</title>" in text and '"value":0.75' in text and '"box":[0.0' in text
    ball.save("ball.mt")
    assert tetralod.open("ball.mt").to_html(folder / "ball.html", error="10%", isovalue=[0.5], **options) is None
    assert len((folder / "ball.html").read_text()) < len(ball.to_html(**options))
    for wrong in ({"errors": 1}, {"error": "-1"}, {"max_updates": 3}):
        with pytest.raises(tetralod.TetralodError) as caught:
            ball.to_html(**wrong, **options)
        assert caught.value.code == "bad-option"
    with pytest.raises(tetralod.TetralodError, match="viewer.js"):
        ball.to_html(page=folder)
