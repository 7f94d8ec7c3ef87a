"""The command `glshade dev`: its options and its output. tests/unit/live/test_dev.py runs it as a whole."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from typing import Any

import pytest
from support.command import run_command

from glshade.cli.dev import _report_text, tunnel
from glshade.problem import Problem


class TestTunnel:
    """The command that reaches the server over SSH."""

    def test_over_ssh(self) -> None:
        environment = {"SSH_CONNECTION": "10.0.0.2 51000 10.0.0.9 22", "USER": "ada"}
        assert tunnel(environment, "127.0.0.1", 8123) == "ssh -N -L 8123:127.0.0.1:8123 ada@10.0.0.9"

    def test_at_another_port(self) -> None:
        environment = {"SSH_CONNECTION": "10.0.0.2 51000 10.0.0.9 2222", "USER": "ada"}
        assert tunnel(environment, "127.0.0.1", 8123) == "ssh -N -L 8123:127.0.0.1:8123 -p 2222 ada@10.0.0.9"

    def test_an_address_of_ipv6(self) -> None:
        environment = {"SSH_CONNECTION": "fe80::2 51000 fe80::9 22", "USER": "ada"}
        assert tunnel(environment, "::1", 8123) == "ssh -N -L 8123:[::1]:8123 ada@fe80::9"

    @pytest.mark.parametrize("connection", ["", "nonsense"])
    def test_without_ssh(self, connection: str) -> None:
        assert tunnel({"SSH_CONNECTION": connection, "USER": "ada"}, "127.0.0.1", 8123) is None
        assert tunnel({}, "127.0.0.1", 8123) is None


class TestUsage:
    """Options that exclude each other or lack something."""

    @pytest.mark.parametrize(
        ("options", "text"),
        [
            (["--no-server"], "--no-server and -o belong together"),
            (["-o", "x.png"], "--no-server and -o belong together"),
            (["--host", "0.0.0.0"], "needs --allow-host NAME"),
            (["--port", "65536"], "65536 is not in the range"),
            (["--shaders", "nowhere"], "Directory 'nowhere' does not exist"),
        ],
    )
    def test_usage(self, options: list[str], text: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
        scene = tmp_path / "s.toml"
        scene.write_text('[[objects]]\nshape = "sphere"\n')
        result = run_command(capsys, "dev", scene, *options)
        assert result.code == 2
        assert text in result.err

    def test_no_such_scene(self, capsys: pytest.CaptureFixture[str]) -> None:
        result = run_command(capsys, "dev", "nowhere.toml")
        assert (result.code, "nowhere.toml: there is no such file" in result.err) == (2, True)

    def test_a_missing_library(self, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
        monkeypatch.setattr(importlib.util, "find_spec", lambda name: None if name in ("uvicorn", "PIL") else object())
        result = run_command(capsys, "dev", "s.toml")
        assert result.code == 2
        assert result.err == "glshade: `glshade dev` needs uvicorn, PIL: pip install 'glshade[live]'\n"


class TestText:
    """The events as text."""

    @pytest.mark.parametrize(
        ("event", "text"),
        [
            ({"event": "listening", "address": "http://x/", "tunnel": None}, "Open http://x/\n"),
            (
                {"event": "listening", "address": "http://x/", "tunnel": "ssh -L"},
                "Open http://x/\nFrom another machine, first run there: ssh -L\n",
            ),
            ({"event": "pages", "count": 1}, ""),
            ({"event": "drawer", "state": "starting", "text": "The drawer was\nended."}, "The drawer was\\u000aended.\n"),
        ],
    )
    def test_an_event(self, event: dict[str, Any], text: str, capsys: pytest.CaptureFixture[str]) -> None:
        _report_text(event)
        assert capsys.readouterr().out == text

    def test_a_revision(self, capsys: pytest.CaptureFixture[str]) -> None:
        _report_text(
            {"event": "revision", "revision": 2, "shown": 2, "ok": True, "problems": [], "milliseconds": {"read": 12.3}}
        )
        assert capsys.readouterr().out == "revision 2: drawn in 12 ms\n"

    def test_a_fault_with_the_lines_around_it(self, capsys: pytest.CaptureFixture[str]) -> None:
        problem = Problem("brdf/a.glsl", 2, 4, "unknown \x1b[31mname", "fragment").beside(["one", "two three", "four"])
        event = {
            "event": "revision",
            "revision": 3,
            "shown": 2,
            "ok": False,
            "problems": [problem.as_dict()],
            "milliseconds": {},
        }
        _report_text(event)
        assert capsys.readouterr().out.splitlines() == [
            "revision 3: not drawn; the page shows revision 2",
            "brdf/a.glsl:2:4: unknown \\u001b[31mname",
            "     1 | one",
            "     2 | two three",
            "       |    ^",
            "     3 | four",
        ]
