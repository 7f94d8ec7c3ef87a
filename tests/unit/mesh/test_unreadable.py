"""Errors of mesh files that nobody can read: one line in plain words, whatever a parser says."""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import Any

import pytest

from glshade.errors import AssetError
from glshade.mesh.file import load
from glshade.mesh.formats import SUFFIXES


@pytest.mark.parametrize("suffix", SUFFIXES)
@pytest.mark.parametrize(
    "error",
    [KeyError("POSITION"), IndexError("list index out of range"), AssertionError(), ValueError("a\nb"), RecursionError("deep")],
    ids=lambda error: type(error).__name__,
)
def test_no_parsers_words(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, suffix: str, error: Exception) -> None:
    def broken(file: Any) -> None:
        raise error

    monkeypatch.setattr(importlib.import_module(f"glshade.mesh.formats{suffix}"), "read", broken)
    path = tmp_path / f"a{suffix}"
    path.write_bytes(b"something")
    with pytest.raises(AssetError) as raised:
        load(path)
    (line,) = raised.value.problems
    assert line.startswith(f"{path}: is not a readable {suffix[1:].upper()} file: ")
    words = line.removeprefix(f"{path}: ")
    assert type(error).__name__ not in words
    assert not str(error) or str(error) not in words


def test_too_little_memory_is_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(file: Any) -> None:
        raise MemoryError

    monkeypatch.setattr(importlib.import_module("glshade.mesh.formats.obj"), "read", broken)
    path = tmp_path / "a.obj"
    path.write_bytes(b"v 0 0 0\n")
    with pytest.raises(AssetError, match="takes more memory than there is"):
        load(path)


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_a_pointer_of_git_lfs_is_named(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"a{suffix}"
    path.write_text("version https://git-lfs.github.com/spec/v1\noid sha256:4d7a\nsize 12345\n")
    with pytest.raises(AssetError, match="is a pointer of Git LFS and not the file itself; `git lfs pull` fetches the file"):
        load(path)
