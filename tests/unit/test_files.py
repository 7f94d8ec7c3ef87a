"""The cache folder: what was used least recently goes when the folder is full, whoever wrote it."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

from glshade.files import YOUNG, Cache, user_cache
from glshade.gl.binaries import Binaries
from glshade.mesh import file as mesh_file
from glshade.mesh.file import load


def file_entry(cache: Cache, name: str, size: int = 1000) -> Path:
    entry = cache.part("budgets") / name
    entry.parent.mkdir(parents=True, exist_ok=True)
    entry.write_bytes(bytes(size))
    return entry


def folder_entry(cache: Cache, name: str, size: int = 1000) -> Path:
    entry = cache.part("meshes") / name
    entry.mkdir(parents=True, exist_ok=True)
    for number in range(2):
        (entry / f"{number}.npy").write_bytes(bytes(size // 2))
    return entry


def age(entry: Path, seconds: float) -> None:
    """Sets the time of the entry's last use to so many seconds ago [s]."""
    then = time.time() - seconds
    os.utime(entry, (then, then))


def test_all_parts_are_pruned_together(tmp_path: Path) -> None:
    cache = Cache(tmp_path, 10_000)
    oldest = folder_entry(cache, "oldest", 2000)
    old = file_entry(cache, "old", 2000)
    used = folder_entry(cache, "used", 2000)
    new = file_entry(cache, "new", 2000)
    for seconds, entry in ((4000, oldest), (3000, used), (2000, old), (1000, new)):
        age(entry, seconds)
    cache.used(used)
    cache.added(folder_entry(cache, "last", 2000))
    assert oldest.exists(), "the folder is not full yet"
    Cache(tmp_path, 10_000).added(file_entry(cache, "too much", 1))
    assert {entry.name for part in tmp_path.iterdir() for entry in part.iterdir()} == {"used", "last", "too much"}


def test_young_entries_stay(tmp_path: Path) -> None:
    """Also where they exceed the limit: another process may be about to read them."""
    cache = Cache(tmp_path, 1000)
    entries = [folder_entry(cache, f"{number}") for number in range(4)]
    age(entries[0], YOUNG + 1)
    cache.added(entries[-1])
    assert [entry.exists() for entry in entries] == [False, True, True, True]


def test_a_link_is_removed_and_not_followed(tmp_path: Path) -> None:
    cache = Cache(tmp_path / "cache", 100)
    elsewhere = folder_entry(Cache(tmp_path / "elsewhere"), "mine")
    link = cache.part("meshes") / "link"
    link.parent.mkdir(parents=True)
    link.symlink_to(elsewhere)
    os.utime(link, (0, 0), follow_symlinks=False)
    cache.added(file_entry(cache, "new"))
    assert not link.is_symlink()
    assert len(list(elsewhere.iterdir())) == 2


def test_the_folder_of_another_user_or_none(tmp_path: Path) -> None:
    for folder in (tmp_path / "none", tmp_path / "file" / "below"):
        (tmp_path / "file").touch()
        cache = Cache(folder)
        cache.used(cache.part("meshes") / "a")
        cache.added(cache.part("meshes") / "a")


PROCESS = """
import os, sys
from pathlib import Path
from glshade.files import Cache
cache = Cache(Path(sys.argv[1]), 200_000)
for turn in range(300):
    entry = cache.part("meshes" if turn % 2 else "programs") / f"{sys.argv[2]}.{turn}"
    if turn % 2:
        entry.mkdir(parents=True, exist_ok=True)
        (entry / "a.npy").write_bytes(bytes(5000))
    else:
        entry.parent.mkdir(parents=True, exist_ok=True)
        entry.write_bytes(bytes(5000))
    os.utime(entry, (turn, turn))
    cache.added(entry)
"""


def test_several_processes_prune_at_once(tmp_path: Path) -> None:
    command = [sys.executable, "-W", "error", "-c", PROCESS, str(tmp_path)]
    running = [subprocess.Popen([*command, str(number)], stderr=subprocess.PIPE, text=True) for number in range(4)]
    for process in running:
        _, errors = process.communicate(timeout=120)
        assert process.returncode == 0, errors
    held = sum(file.stat().st_size for file in tmp_path.rglob("*") if file.is_file())
    assert 0 < held <= 200_000 + len(running) * 200_000 // 8


def test_pruned_entries_are_misses(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A mesh whose entry was pruned is read again, and so is a program."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    mesh_file._memory.clear()
    cache = user_cache()
    assert cache.folder == tmp_path / "cache" / "glshade"
    binaries = Binaries(cache)
    binaries.keep("0" * 64, (1, bytes(100)))
    path = tmp_path / "a.obj"
    path.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    digest = load(path).parts[0].mesh.digest
    for part in ("programs", "meshes"):
        for entry in cache.part(part).iterdir():
            age(entry, 2 * YOUNG)
    Cache(cache.folder, 0).added(cache.part("programs"))
    assert not [*cache.part("programs").iterdir(), *cache.part("meshes").iterdir()]
    assert binaries.recall("0" * 64) is None
    mesh_file._memory.clear()
    assert load(path).parts[0].mesh.digest == digest
    assert len(list(cache.part("meshes").iterdir())) == 1
