"""Standard error without libpng's own messages."""

from __future__ import annotations

import os
import tempfile
from typing import Any

import pytest

from glshade.cli._stderr import without_libpng


def write() -> None:
    os.write(2, b"first\nlibpng error: Not enough image data\nlast, without an end")


def test_libpngs_errors_are_left_out(capfd: pytest.CaptureFixture[str]) -> None:
    with without_libpng():
        write()
    assert capfd.readouterr().err == "first\nlast, without an end"


def test_the_other_lines_appear_where_the_block_raises(capfd: pytest.CaptureFixture[str]) -> None:
    @without_libpng()
    def fail() -> None:
        write()
        raise KeyError

    with pytest.raises(KeyError):
        fail()
    os.write(2, b"; after")
    assert capfd.readouterr().err == "first\nlast, without an end; after"


def test_nothing_is_left_out_where_no_temporary_file_can_be_made(
    monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    def fail() -> Any:
        raise OSError

    monkeypatch.setattr(tempfile, "TemporaryFile", fail)
    with without_libpng():
        write()
    assert "libpng error: " in capfd.readouterr().err
