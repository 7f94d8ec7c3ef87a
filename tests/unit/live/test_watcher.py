"""The watcher: every way in which programs save files counts as one change, and nothing else does."""

from __future__ import annotations

import asyncio
import os
import shutil
import time
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from pathlib import Path

import pytest
from support.saving import STYLES

from glshade.live import watcher as watching_files
from glshade.live.watcher import Watcher

# The longest time in which a change is told, on a busy machine [s].
SOON = 10.0
# The time in which nothing may be told [s].
QUIET = 0.3


Next = Callable[[], Awaitable[frozenset[Path]]]


@asynccontextmanager
async def watching(*paths: Path) -> AsyncIterator[tuple[Watcher, Next]]:
    """Returns a watcher of paths, and a function that waits for the next change."""
    watcher = Watcher()
    watcher.watch(paths)
    told: asyncio.Queue[frozenset[Path]] = asyncio.Queue()

    async def listen() -> None:
        async for changed in watcher.changes():
            await told.put(changed)

    listening = asyncio.create_task(listen())
    # The system needs a moment before it reports changes.
    await asyncio.sleep(0.1)
    try:
        yield watcher, lambda: asyncio.wait_for(told.get(), SOON)
        await asyncio.sleep(QUIET)
        assert told.empty(), f"a change was told twice: {told.get_nowait()}"
    finally:
        listening.cancel()


@pytest.mark.parametrize("save", STYLES)
def test_each_way_to_save_is_one_change(save: Callable[[Path, str], None], tmp_path: Path) -> None:
    scene, shader = tmp_path / "scene.toml", tmp_path / "shaders/brdf/a.glsl"
    shader.parent.mkdir(parents=True)

    async def play() -> None:
        for path in (scene, shader):
            path.write_text("first")
        async with watching(scene, tmp_path / "shaders", shader.parent) as (_, following):
            for number in range(2):
                for path in (scene, shader):
                    await asyncio.to_thread(save, path, f"text {number}")
                    assert path in await following()
                    assert path.read_text() == f"text {number}"

    asyncio.run(play())


def test_a_link_to_a_file_elsewhere_and_a_folder_that_is_a_link(tmp_path: Path) -> None:
    async def play() -> None:
        for version in ("one", "two"):
            (tmp_path / version).mkdir()
            (tmp_path / version / "a.glsl").write_text(version)
        folder, link = tmp_path / "shaders", tmp_path / "link.toml"
        folder.symlink_to("one")
        link.symlink_to("two/scene.toml")
        (tmp_path / "two/scene.toml").write_text("first")
        async with watching(link, folder) as (_, following):
            (tmp_path / "two/scene.toml").write_text("second")
            assert await following() == {link}
            (tmp_path / "new").symlink_to("two")
            os.replace(tmp_path / "new", folder)
            assert await following() == {folder / "a.glsl"}
            (tmp_path / "two/a.glsl").write_text("three")
            assert await following() == {folder / "a.glsl"}

    asyncio.run(play())


def test_a_folder_that_is_made_again_is_watched_again(tmp_path: Path) -> None:
    folder = tmp_path / "shaders"

    async def play() -> None:
        (folder / "brdf").mkdir(parents=True)
        path = folder / "brdf/a.glsl"
        path.write_text("first")
        async with watching(folder, folder / "brdf") as (_, following):
            shutil.rmtree(folder)
            assert path in await following()
            (folder / "brdf").mkdir(parents=True)
            path.write_text("second")
            changed = await following()
            while path not in changed:
                changed = await following()
            await asyncio.sleep(0.2)
            path.write_text("third")
            assert await following() == {path}

    asyncio.run(play())


def test_a_touch_and_files_of_no_interest_are_no_changes(tmp_path: Path) -> None:
    path = tmp_path / "shaders/a.glsl"

    async def play() -> None:
        path.parent.mkdir()
        path.write_text("same")
        async with watching(path.parent, tmp_path / "scene.toml"):
            os.utime(path)
            path.write_text("same")
            for name in ("picture.png", "shaders/.a.glsl.swp", "shaders/a.glsl~", "shaders/note.txt"):
                (tmp_path / name).write_text("new")

    asyncio.run(play())


def test_a_new_shader_and_a_file_that_appears_are_changes(tmp_path: Path) -> None:
    async def play() -> None:
        folder, scene = tmp_path / "shaders", tmp_path / "deep/scene.toml"
        folder.mkdir()
        async with watching(folder, scene) as (watcher, following):
            (folder / "new.glsl").write_text("new")
            assert await following() == {folder / "new.glsl"}
            scene.parent.mkdir()
            scene.write_text("new")
            assert await following() == {scene}
            other = tmp_path / "other.obj"
            watcher.watch([scene, other])
            other.write_text("new")
            assert await following() == {other}

    asyncio.run(play())


@pytest.mark.parametrize("save", STYLES)
def test_a_file_that_changes_before_it_is_first_watched_is_a_change(save: Callable[[Path, str], None], tmp_path: Path) -> None:
    """The caller has read a file, learns from it which others to watch, and one of them has changed meanwhile."""
    scene, shader, quiet = (tmp_path / name / "file" for name in ("scene", "shader", "quiet"))
    for path in (scene, shader, quiet):
        path.parent.mkdir()
        path.write_text("first")

    async def play() -> None:
        async with watching(scene) as (watcher, following):
            await asyncio.sleep(2 * watching_files.RECENT)
            began = time.time()
            save(shader, "second")
            watcher.watch([scene, shader, quiet], since=began)
            assert await following() == {shader}
            save(shader, "third")
            assert await following() == {shader}

    asyncio.run(play())


def test_half_a_file_is_not_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A file that is written in many pieces counts when it has come to rest."""
    # On a busy machine the pieces come late.
    monkeypatch.setattr(watching_files, "AGREE", 0.4)
    path = tmp_path / "scene.toml"

    async def play() -> None:
        path.write_text("first")
        async with watching(path) as (_, following):

            def write() -> None:
                with path.open("w") as file:
                    for number in range(40):
                        file.write(f"{number}\n")
                        file.flush()
                        time.sleep(0.002)

            writing = asyncio.create_task(asyncio.to_thread(write))
            await following()
            assert path.read_text().endswith("39\n")
            await writing

    asyncio.run(play())
