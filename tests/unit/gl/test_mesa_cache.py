"""Mesa's own shader cache: a full disk does not end the process."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import pytest
from support.disk import NoDisk, small_disk

from glshade.gl.mesa_cache import DISABLE, INDEX_SIZE, reserve_index

SCENE = 'objects = [{ shape = "sphere", material = { brdf = "phong" } }]\nfilm = { size = [32, 24] }\n'

pytestmark = pytest.mark.skipif(not hasattr(os, "posix_fallocate"), reason="this system cannot reserve room for a file")


def test_room_for_the_whole_index_is_reserved(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MESA_SHADER_CACHE_DIR", str(tmp_path))
    monkeypatch.delenv(DISABLE, raising=False)
    reserve_index()
    index = (tmp_path / "mesa_shader_cache" / "index").stat()
    assert index.st_size == INDEX_SIZE
    assert index.st_blocks * 512 >= INDEX_SIZE, "the file is sparse"
    assert DISABLE not in os.environ


def test_without_a_folder_the_cache_is_off(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "occupied").write_text("a file, not a folder")
    monkeypatch.setenv("MESA_SHADER_CACHE_DIR", str(tmp_path / "occupied"))
    # The variable is set first so that monkeypatch removes it after the test.
    monkeypatch.setenv(DISABLE, "")
    monkeypatch.delenv(DISABLE)
    reserve_index()
    assert os.environ[DISABLE] == "true"


@pytest.mark.parametrize("size", [1 << 14, 1 << 16, 1 << 20, INDEX_SIZE + (1 << 16)])
def test_a_picture_with_the_caches_on_a_full_disk(size: int, tmp_path: Path, glshade: Any) -> None:
    (tmp_path / "s.toml").write_text(SCENE)
    try:
        with small_disk(tmp_path / "disk", size) as disk:
            done = glshade("render", "s.toml", "-o", "x.png", cwd=tmp_path, XDG_CACHE_HOME=str(disk))
    except NoDisk as error:
        pytest.skip(str(error))
    assert (done.returncode, done.stderr) == (0, "")
    assert (tmp_path / "x.png").exists()
