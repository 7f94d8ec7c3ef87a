"""The live server: HTTP, the WebSocket, limits, and the death of a drawer. No test draws by OpenGL."""

from __future__ import annotations

import asyncio
import hashlib
import json
import socket
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from support.live import PICTURE, Running, failure, running
from support.requests import REQUESTS, TOKEN
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect

from glshade.errors import GlshadeError
from glshade.live import session as session_module
from glshade.live import viewer as viewer_module
from glshade.live.messages import (
    Draw,
    Load,
    Loaded,
    MeasureDigits,
    Pick,
    Probe,
    ReadSource,
    Restore,
    ShowVariable,
    Trace,
    Verify,
)
from glshade.live.server import Listener
from glshade.live.wire import LARGEST_MESSAGE


@pytest.fixture(scope="module")
def calm() -> Iterator[Running]:
    """A server whose drawer never fails."""
    with pytest.MonkeyPatch.context() as patch, running(patch) as server:
        yield server


@pytest.fixture
def server(monkeypatch: pytest.MonkeyPatch) -> Iterator[Running]:
    """A server for one test, which may break it."""
    with running(monkeypatch) as server:
        yield server


@pytest.mark.parametrize("name", REQUESTS)
def test_the_table_of_requests(name: str, calm: Running) -> None:
    asked = REQUESTS[name]
    headers = asked.headers(calm.port, calm.access.cookie_value)
    if asked.socket:
        assert _opened(calm, asked.target, headers) == asked.status
        return
    answer: Any = calm.get(asked.target, *headers, method=asked.method)
    assert answer.status == asked.status
    assert ("Set-Cookie" in answer.headers) == asked.exchanges
    # A refusal is one line, and gives no secret away.
    if answer.status != 200:
        assert answer.data.count(b"\n") == (asked.method != "HEAD")
    assert TOKEN.encode() not in answer.data
    assert calm.access.cookie_value.encode() not in answer.data


def _opened(server: Running, target: str, headers: list[tuple[str, str]]) -> int:
    """Returns the status with which a WebSocket is answered."""
    address = f"ws://{dict(headers)['Host']}{target}"
    given = [(name, value) for name, value in headers if name != "Host"]
    with socket.create_connection(("127.0.0.1", server.port)) as connection:
        try:
            with connect(address, sock=connection, additional_headers=given, compression=None):
                return 101
        except InvalidStatus as error:
            return error.response.status_code


def test_the_server_imports_neither_numpy_nor_opengl() -> None:
    heavy = {"numpy", "moderngl", "OpenImageIO", "trimesh", "PIL"}
    code = f"import sys, glshade.live.server; print(sorted({heavy} & set(sys.modules)))"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "[]\n"


class TestHttp:
    """Pages and pictures."""

    def test_the_cookie(self, calm: Running) -> None:
        cookie = calm.get(f"/?token={TOKEN}").headers["Set-Cookie"]
        assert cookie.startswith(f"glshade-{calm.port}={calm.access.cookie_value};")
        assert "HttpOnly" in cookie
        assert "samesite=strict" in cookie.lower()
        assert "Path=/" in cookie

    def test_the_token_leaves_the_address(self, calm: Running) -> None:
        answer: Any = calm.get(f"/?token={TOKEN}")
        assert b'content="0; url=/"' in answer.data
        assert answer.headers["Referrer-Policy"] == "no-referrer"

    @pytest.mark.parametrize("target", ["/", "/state.json", "/frame.png", "/page/index.html", "/nothing"])
    def test_headers_keep_other_sites_out(self, target: str, calm: Running) -> None:
        headers = calm.get(target).headers
        policy = headers["Content-Security-Policy"]
        assert "default-src 'none'" in policy
        assert "script-src 'self';" in policy
        assert "frame-ancestors 'none'" in policy
        assert "unsafe" not in policy
        assert headers["X-Content-Type-Options"] == "nosniff"
        assert headers["Cache-Control"] == "no-store"
        assert headers["Cross-Origin-Resource-Policy"] == "same-origin"
        assert "Access-Control-Allow-Origin" not in headers
        assert "Server" not in headers

    def test_a_refused_host_is_not_repeated(self, calm: Running) -> None:
        answer: Any = calm.get("/", ("Host", "evil.example"))
        assert "evil" not in str(answer.headers)
        assert b"evil" not in answer.data

    def test_the_page_and_its_files(self, calm: Running) -> None:
        answer: Any = calm.get("/")
        assert answer.headers["Content-Type"] == "text/html; charset=utf-8"
        assert calm.get("/page/style.css").headers["Content-Type"] == "text/css; charset=utf-8"

    def test_the_state(self, calm: Running) -> None:
        answer: Any = calm.get("/state.json")
        state = json.loads(answer.data)
        assert (state["scene"], state["revision"], state["stale"], state["drawer"]) == ("scene.toml", 1, False, "ready")
        assert TOKEN not in answer.data.decode()

    def test_a_picture(self, calm: Running) -> None:
        answer: Any = calm.get("/frame.png?camera=top&size=64x48&layer=normal")
        assert answer.data == PICTURE
        assert answer.headers["Content-Type"] == "image/png"
        assert answer.headers["X-Glshade-Revision"] == "1"
        request = calm.drawer.asked[-1]
        assert request.still
        assert request.view["camera"] == {"name": "top"}
        assert request.view["size"] == (64, 48)
        assert request.view["layer"] == "normal"

    @pytest.mark.parametrize(
        ("query", "text"),
        [
            ("size=20000x20000", "size.0: Input should be less than or equal to 16384"),
            ("size=16384x16384", "more than 16777216 pixels"),
            ("size=0x4", "greater than or equal to 1"),
            ("size=4", "size"),
            ("size=axb", "size.0"),
            ("colour=red", "unknown key colour; allowed: camera, size, layer"),
            ("layer=" + "x" * 5000, "at most 4096 characters"),
        ],
    )
    def test_a_picture_that_cannot_be(self, query: str, text: str, calm: Running) -> None:
        answer: Any = calm.get(f"/frame.png?{query}")
        assert answer.status == 400
        assert text in answer.data.decode()
        assert answer.data.count(b"\n") == 1

    def test_a_fault_of_a_picture_is_one_line(self, server: Running) -> None:
        server.drawer.answer = lambda request: failure("no camera is\nnamed x") if isinstance(request, Draw) else None
        answer: Any = server.get("/frame.png?camera=x")
        assert (answer.status, answer.data) == (400, b"no camera is\\u000anamed x\n")

    def test_a_port_that_is_taken(self, calm: Running) -> None:
        with pytest.raises(GlshadeError, match=f"127.0.0.1:{calm.port}: cannot listen there: Address already in use"):
            Listener("127.0.0.1", calm.port)


class TestPage:
    """Messages of a page that is connected."""

    def test_state_and_picture(self, calm: Running) -> None:
        with calm.page() as page:
            assert page.receive("state")["revision"] == 1
            page.view(7, panes=[{"camera": {"name": "top"}, "set": {"objects.0.material.kd": [1, 0, 0]}}])
            frame = page.receive("frame")
            assert (frame["number"], frame["pane"], frame["still"], frame["stale"]) == (7, 0, True, False)
            assert (frame["width"], frame["height"], frame["mime"], frame["data"]) == (4, 3, "image/png", PICTURE)

    def test_two_panes(self, calm: Running) -> None:
        with calm.page() as page:
            page.view(1, panes=[{}, {"source": "reference"}])
            assert {page.receive("frame")["pane"], page.receive("frame")["pane"]} == {0, 1}

    def test_the_judge_draws_no_view_that_moves(self, calm: Running) -> None:
        with calm.page() as page:
            page.view(1, moving=True, panes=[{}, {"source": "heat"}])
            assert page.receive("frame")["pane"] == 0
            assert page.nothing("frame")

    def test_one_picture_in_flight_and_the_newest_view_wins(self, calm: Running) -> None:
        with calm.page() as page:
            for number in range(1, 6):
                page.view(number, moving=True)
            first = page.receive("frame")["number"]
            assert page.nothing("frame")
            page.send("shown", number=first)
            if first < 5:
                assert page.receive("frame")["number"] == 5
                page.send("shown", number=5)
            # Nothing has changed since, so nothing is drawn.
            assert page.nothing("frame")

    def test_a_fault_of_a_view_is_a_picture_without_pixels(self, server: Running) -> None:
        server.drawer.answer = lambda request: failure("no camera is named x") if isinstance(request, Draw) else None
        with server.page() as page:
            page.view(3)
            frame = page.receive("frame")
            assert (frame["width"], frame["text"], frame["number"]) == (0, "no camera is named x", 3)

    def test_pick(self, calm: Running) -> None:
        with calm.page() as page:
            page.view()
            page.send("pick", pane=0, x=2, y=1)
            picked = page.receive("picked")
            assert (picked["object"], picked["key"], picked["pane"], picked["x"], picked["y"]) == ("ball", "objects.0", 0, 2, 1)
            assert (calm.drawer.asked[-1].x, calm.drawer.asked[-1].y) == (2, 1)

    def test_a_probe_is_followed_by_the_variables_of_the_pixel(self, calm: Running) -> None:
        with calm.page() as page:
            page.view()
            page.send("probe", x=2, y=1)
            assert page.receive("probed")["class"] == "interior"
            traced = page.receive("traced")
            assert (traced["x"], traced["y"], traced["pane"], traced["steps"]) == (2, 1, 0, [{"name": "NoL"}])
            assert [type(request) for request in calm.judge.asked[-2:]] == [Probe, Trace]

    def test_variables_that_cannot_be_had_have_a_reason(self, server: Running) -> None:
        server.judge.answer = lambda request: failure("no compiler") if isinstance(request, Trace | MeasureDigits) else None
        server.drawer.answer = lambda request: failure("no such object") if isinstance(request, ReadSource) else None
        with server.page() as page:
            page.view()
            page.send("probe", x=2, y=1)
            traced = page.receive("traced")
            assert (traced["text"], traced["x"], traced["y"]) == ("no compiler", 2, 1)
            page.send("source", object=4)
            assert {**page.receive("source"), "type": ""} == {"type": "", "files": [], "text": "no such object", "object": 4}
            page.send("digits", object=4)
            assert {**page.receive("digits"), "type": ""} == {"type": "", "lines": [], "text": "no compiler", "object": 4}

    def test_the_files_of_an_object_and_its_lost_digits(self, calm: Running) -> None:
        with calm.page() as page:
            page.view()
            page.send("source", object=3)
            source = page.receive("source")
            assert (source["object"], source["files"], source["revision"]) == (3, [{"file": "a.glsl"}], 1)
            page.send("digits", object=3)
            digits = page.receive("digits")
            assert (digits["object"], digits["lines"], digits["revision"]) == (3, [{"file": "a.glsl", "line": 3}], 1)

    def test_an_edit_cancels_the_measurement_of_digits(self, server: Running) -> None:
        server.judge.release.clear()
        with server.page() as page:
            page.view(1)
            page.send("digits", object=0)
            _until(lambda: server.judge.asked)
            server.change("scene.toml")
            assert page.nothing("digits", 0.15)
            page.send("digits", object=0)
            assert page.receive("digits")["revision"] == 2

    def test_a_variable_is_a_picture_of_the_judge(self, calm: Running) -> None:
        variable = {"object": 0, "place": "a.glsl:3", "name": "NoL"}
        with calm.page() as page:
            page.view(1, moving=True, panes=[{"source": "variable", "variable": variable}])
            assert page.nothing("frame", 0.15)
            page.view(2, panes=[{"source": "variable", "variable": variable}])
            assert page.receive("frame")["number"] == 2
            (asked,) = [request for request in calm.judge.asked if isinstance(request, ShowVariable)]
            assert asked.view["variable"] == {**variable, "number": 0}

    def test_judge(self, calm: Running) -> None:
        with calm.page() as page:
            page.view()
            page.send("judge")
            assert page.receive("judged")["state"] == "judging"
            assert page.receive("judged")["state"] == "verified"
            assert [type(request) for request in calm.judge.asked[-2:]][-1] is Verify

    def test_a_new_view_cancels_the_judge(self, server: Running) -> None:
        server.judge.release.clear()
        with server.page() as page:
            page.view(1)
            page.send("judge")
            assert page.receive("judged")["state"] == "judging"
            _until(lambda: server.judge.asked)
            page.view(2)
            assert page.receive("judged")["state"] == "none"

    def test_an_edit_cancels_the_judge(self, server: Running) -> None:
        server.judge.release.clear()
        with server.page() as page:
            page.view(1)
            page.send("judge")
            _until(lambda: server.judge.asked)
            server.change("scene.toml")
            assert page.receive("judged")["state"] == "judging"
            assert page.receive("judged")["state"] == "none"

    def test_a_picture_of_the_judge_that_an_edit_cancelled_comes_later(self, server: Running) -> None:
        server.judge.release.clear()
        with server.page() as page:
            page.view(1, panes=[{"source": "reference"}])
            _until(lambda: server.judge.asked)
            server.drawer.answer = lambda request: (
                Loaded(id=0, ok=False, revision=2, shown=1, problems=[{}]) if isinstance(request, Load) else None
            )
            server.change("scene.toml")
            assert page.receive("frame")["revision"] == 1
            assert server.judge.pid == 2

    def test_infinities_are_texts(self, calm: Running) -> None:
        from glshade.live.wire import as_json

        assert json.loads(as_json({"a": [float("nan"), float("-inf")], "b": {"c": float("inf")}})) == {
            "a": ["nan", "-inf"],
            "b": {"c": "inf"},
        }


class TestHostilePages:
    """Messages that no page of ours sends: each gets one line, and the server goes on."""

    @pytest.mark.parametrize(
        ("message", "text"),
        [
            ("", "Invalid JSON"),
            ("{", "Invalid JSON"),
            ("[" * 100_000, "Invalid JSON"),
            ("[]", "should be an object"),
            ("{}", "Unable to extract tag"),
            ('{"type": "quit"}', "does not match any of the expected tags"),
            ('{"type": "view", "number": 1, "panes": []}', "view.panes"),
            ('{"type": "view", "number": 1, "panes": [{}, {}, {}]}', "view.panes"),
            ('{"type": "view", "number": -1, "panes": [{}]}', "view.number"),
            ('{"type": "view", "number": 1e400, "panes": [{}]}', "view.number"),
            ('{"type": "view", "number": 1, "panes": [{"size": [100000, 100000]}]}', "view.panes.0.size.0"),
            ('{"type": "view", "number": 1, "panes": [{"size": [16384, 16384]}]}', "more than 16777216 pixels"),
            ('{"type": "view", "number": 1, "panes": [{"source": "https://evil.example"}]}', "view.panes.0.source"),
            ('{"type": "view", "number": 1, "panes": [{"camera": {"eye": [0, NaN, 0]}}]}', "view.panes.0.camera.eye.1"),
            ('{"type": "view", "number": 1, "panes": [{"unknown": 1}]}', "view.panes.0.unknown"),
            ('{"type": "view", "number": 1, "panes": [{"variable": {"object": 0}}]}', "view.panes.0.variable.place"),
            ('{"type": "pick", "x": -1, "y": 0}', "pick.x"),
            ('{"type": "source", "object": -1}', "source.object"),
            ('{"type": "digits", "object": 1e9}', "digits.object"),
            ('{"type": "write", "values": {}}', "write.values"),
            (b"\x00\xff", "a page sends text messages only"),
        ],
    )
    def test_a_message(self, message: str | bytes, text: str, calm: Running) -> None:
        with calm.page() as page:
            page.socket.send(message)
            error = page.receive("error")["text"]
            assert text in error
            assert "\n" not in error
            page.view(1)
            assert page.receive("frame")["number"] == 1

    def test_a_message_that_is_too_long(self, calm: Running) -> None:
        known = len(calm.events)
        with calm.page() as page:
            page.socket.send("x" * (LARGEST_MESSAGE + 1))
            with pytest.raises(ConnectionClosed) as closed:
                page.receive("error")
            assert closed.value.rcvd is not None
            assert closed.value.rcvd.code == 1009
        assert "a page may send 262144 bytes" in calm.wait_for("refused", known)["text"]
        assert calm.get("/state.json").status == 200

    def test_too_many_pages(self, server: Running, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr(session_module, "MOST_PAGES", 1)
        with server.page() as first, server.page() as second:
            assert second.receive("error")["text"] == "1 pages are open, which is the most"
            with pytest.raises(ConnectionClosed) as closed:
                second.receive("state")
            assert closed.value.rcvd is not None
            assert (closed.value.rcvd.code, closed.value.rcvd.reason) == (1013, "1 pages are open, which is the most")
            assert first.receive("state")["revision"] == 1
        with server.page() as third:
            assert third.receive("state")["revision"] == 1

    def test_a_page_that_does_not_read(self, server: Running, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr(viewer_module, "PATIENCE", 0.3)
        huge = b"x" * (32 << 20)

        def answer(request: Any) -> Any:
            return replace(server.drawer._answer(request), data=huge) if isinstance(request, Draw) else None

        server.drawer.answer = answer
        with server.page(max_queue=1, max_size=None, close_timeout=0.1) as lazy, server.page() as eager:
            # It acknowledges pictures that it has not read.
            for number in range(1, 4):
                lazy.view(number)
                _until(lambda wanted=number: sum(isinstance(request, Draw) for request in server.drawer.asked) >= wanted)
                lazy.send("shown", number=number)
            text = server.wait_for("refused")["text"]
            assert text == "a page did not take a message within 0.3 s"
            server.drawer.answer = lambda request: None
            eager.view(1)
            assert eager.receive("frame")["number"] == 1


class TestRevisions:
    """Changes of files, and a drawer that dies."""

    def test_a_change_is_drawn(self, server: Running) -> None:
        with server.page() as page:
            page.view(1)
            assert page.receive("frame")["revision"] == 1
            page.send("shown", number=1)
            server.change("scene.toml")
            assert page.receive("state")["revision"] == 2
            assert page.receive("frame")["revision"] == 2
        assert [str(path) for path in server.watcher.paths] == ["/file", "/folder"]

    def test_a_fault_keeps_the_picture(self, server: Running) -> None:
        problem = {"file": "scene.toml", "line": 3, "column": 1, "message": "unknown key", "stage": "scene"}
        server.drawer.answer = lambda request: (
            Loaded(id=0, ok=False, revision=2, shown=1, problems=[problem]) if isinstance(request, Load) else None
        )
        with server.page() as page:
            page.view(1)
            page.receive("frame")
            page.send("shown", number=1)
            server.change("scene.toml")
            state = _state(page, revision=2)
            assert (state["stale"], state["stale_of"], state["problems"]) == (True, 1, [problem])
            # The picture has not changed, so it is not sent again.
            assert page.nothing("frame")
            server.drawer.answer = lambda request: None
            server.change("scene.toml")
            state = _state(page, revision=3)
            assert (state["stale"], state["stale_of"], state["problems"]) == (False, None, [])
            assert page.receive("frame")["revision"] == 3

    def test_a_revision_that_kills_the_drawer_while_it_is_loaded(self, server: Running) -> None:
        def answer(request: Any) -> None:
            if isinstance(request, Load) and request.revision == 2:
                raise server.drawer.dies()

        server.drawer.answer = answer
        with server.page() as page:
            page.view(1)
            page.receive("frame")
            page.send("shown", number=1)
            server.change("brdf/phong.glsl")
            state = _state(page, revision=2, drawer="ready")
            assert (state["stale"], state["stale_of"]) == (True, 1)
            assert "was ended by SIGSEGV" in state["problems"][0]["message"]
            assert server.drawer.pid == 2
        answer_to_curl: Any = server.get("/frame.png")
        assert (answer_to_curl.status, answer_to_curl.headers["X-Glshade-Revision"]) == (200, "1")
        server.change("brdf/phong.glsl")
        assert not server.session.stale
        assert server.session.state()["problems"] == []

    def test_a_drawer_that_dies_once_draws_the_same_revision(self, server: Running) -> None:
        deaths = iter([True])

        def answer(request: Any) -> None:
            if isinstance(request, Draw) and next(deaths, False):
                raise server.drawer.dies()

        server.drawer.answer = answer
        with server.page() as page:
            page.view(1)
            assert page.receive("frame")["revision"] == 1
        assert server.drawer.pid == 2
        assert not server.session.stale
        assert "was ended by SIGSEGV while it drew" in server.wait_for("drawer")["text"]

    def test_a_revision_that_kills_each_drawer_is_dropped(self, server: Running) -> None:
        def answer(request: Any) -> None:
            if isinstance(request, Draw | Pick) and server.drawer.shown == 2:
                raise server.drawer.dies()

        server.change("scene.toml")
        server.drawer.answer = answer
        with server.page() as page:
            page.view(1)
            state = _state(page, stale=True, drawer="ready")
            assert (state["revision"], state["stale_of"]) == (2, 1)
            assert "was ended by SIGSEGV" in state["problems"][0]["message"]
            page.send("reset")
            frame = page.receive("frame")
            if not frame["width"]:
                page.send("shown", number=1)
                frame = page.receive("frame")
            assert frame["revision"] == 1
        server.change("scene.toml")
        assert not server.session.stale

    def test_a_drawer_that_died_while_it_was_idle(self, server: Running) -> None:
        server.drawer.kill()
        with server.page() as page:
            page.view(1)
            assert page.receive("frame")["revision"] == 1
        assert server.wait_for("drawer")["text"] == "The drawer has ended while it had nothing to do."
        assert (server.drawer.pid, server.session.stale) == (2, False)

    def test_the_end_of_the_server_starts_no_other_drawer(self, server: Running) -> None:
        with server.page() as page:
            page.receive("state")
            server.drawer.release.clear()
            page.view(1)
            _until(lambda: isinstance(server.drawer.asked[-1], Draw))
            server.stop()
        assert (server.drawer.pid, server.drawer.alive) == (1, False)

    def test_python_files_that_have_changed_need_a_new_drawer(self, server: Running) -> None:
        def answer(request: Any) -> Any:
            if isinstance(request, Load) and server.drawer.pid == 1:
                return Loaded(id=0, ok=False, revision=request.revision, shown=1, restart=True)
            return None

        server.drawer.answer = answer
        server.change("models/chalk.py")
        assert server.drawer.pid == 2
        assert [type(request) for request in server.drawer.asked[-2:]] == [Load, Load]
        assert not server.session.stale

    def test_python_files_with_a_fault_leave_the_picture(self, server: Running) -> None:
        def answer(request: Any) -> Any:
            if isinstance(request, Load) and request.revision == 2:
                return Loaded(
                    id=0, ok=False, revision=2, shown=min(2 - server.drawer.pid, 1) or 0, restart=server.drawer.pid == 1
                )
            return None

        server.drawer.answer = answer
        server.change("models/chalk.py")
        assert [type(request) for request in server.drawer.asked[-3:]] == [Load, Load, Restore]
        assert (server.session.shown, server.session.stale) == (1, True)
        assert server.drawer.pid == 3


class TestWriting:
    """The scene file is the only file that a page can change."""

    def test_a_value_is_written(self, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
        scene = tmp_path / "scene.toml"
        scene.write_text('# A ball.\n[[objects]]\nshape = "sphere"  # round\nmaterial = { brdf = "phong", kd = 0.5 }\n')
        digest = hashlib.sha256(scene.read_bytes()).hexdigest()
        with running(monkeypatch, scene=str(scene)) as server, server.page() as page:
            server.session._supervisor.loaded = Loaded(id=0, revision=1, shown=1, info={"digest": digest})
            page.send("write", values={"objects.0.material.kd": 0.25})
            written = page.receive("written")
            assert (written["ok"], written["text"]) == (True, "1 values were written into scene.toml.")
            assert (
                scene.read_text()
                == '# A ball.\n[[objects]]\nshape = "sphere"  # round\nmaterial = { brdf = "phong", kd = 0.25 }\n'
            )
            page.send("write", values={"objects.0.material.kd": 0.75})
            written = page.receive("written")
            assert not written["ok"]
            assert "has changed since it was loaded" in written["text"]


def _state(page: Any, **wanted: Any) -> dict[str, Any]:
    """Returns the first state that has some values."""
    while True:
        state = page.receive("state")
        if all(state[key] == value for key, value in wanted.items()):
            return dict(state)


def _until(condition: Any) -> None:
    """Waits for a condition."""

    async def waiting() -> None:
        while not condition():
            await asyncio.sleep(0.01)

    asyncio.run(asyncio.wait_for(waiting(), 10))
