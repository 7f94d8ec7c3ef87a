"""Children: processes that die, hang, and are started again."""

from __future__ import annotations

import asyncio
import os
import signal
from pathlib import Path

import numpy as np
import pytest
from support.drawn import FROM_ABOVE, SCENE, pixels_of

from glshade.glsl.shaders import SHIPPED
from glshade.live.child import Child, ChildLost
from glshade.live.messages import Draw, Failed, Frame, Load, Loaded, Restore

PHONG = (SHIPPED / "brdf/phong.glsl").read_text()
# A loop without an end. llvmpipe ends it after 65,535 turns, which take minutes for all pixels.
ENDLESS = PHONG.replace(
    "return ", "float x = 1.0;\n    while (x > 0.0) {\n        x = abs(sin(x)) + 0.1;\n    }\n    return x * ", 1
)


class Files:
    """A scene with a shader folder, and the requests to load it."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.scene, self.shaders = folder, folder / "scene.toml", folder / "shaders"
        self.scene.write_text(SCENE.replace("[48, 32]", "[512, 512]"))
        (self.shaders / "brdf").mkdir(parents=True)
        self.number = 0

    def write(self, text: str) -> None:
        (self.shaders / "brdf/phong.glsl").write_text(text)

    def load(self) -> Load:
        self.number += 1
        return Load(revision=self.number, scene=str(self.scene), shaders=(str(self.shaders),))

    def child(self, limit: float | None = 10.0) -> Child:
        return Child("glshade.live.drawer", "auto", "", self.folder / "work", limit=limit)


def test_a_hung_or_killed_drawer_is_replaced_and_shows_the_last_good_picture(tmp_path: Path) -> None:
    async def play() -> None:
        files = Files(tmp_path)
        child = files.child()
        try:
            files.write(PHONG)
            loaded = await child.ask(files.load())
            assert isinstance(loaded, Loaded)
            assert loaded.ok, loaded.problems
            before = await child.ask(Draw(view=FROM_ABOVE))
            assert isinstance(before, Frame)

            child.limit = 1.0
            files.write(ENDLESS)
            with pytest.raises(ChildLost, match="longer than 1 s"):
                await child.ask(files.load())
            assert not child.alive
            child.limit = 30.0
            await shows(child, loaded, before)
            refused = await child.ask(files.load())
            assert not refused.ok
            assert isinstance(refused, Loaded)
            assert "not tried again" in refused.problems[0]["message"]
            files.write(PHONG)
            mended = await child.ask(files.load())
            assert mended.ok

            # The snapshot follows the first picture.
            await child.ask(Draw(view={}))
            assert child.pid is not None
            drawing = asyncio.create_task(child.ask(Draw(view={**FROM_ABOVE, "size": [4000, 4000]})))
            await asyncio.sleep(0.1)
            os.kill(child.pid, signal.SIGKILL)
            with pytest.raises(ChildLost, match="SIGKILL"):
                await drawing
            assert isinstance(mended, Loaded)
            await shows(child, mended, before)
        finally:
            await child.stop()
        assert child.pid is None

    asyncio.run(play())


async def shows(child: Child, loaded: Loaded, picture: Frame) -> None:
    """Checks that a new drawer restores a revision, and that its picture is the one that it was."""
    assert loaded.snapshot is not None
    restored = await child.ask(Restore(folder=loaded.snapshot))
    assert isinstance(restored, Loaded)
    assert restored.ok, restored.problems
    assert restored.shown == loaded.shown
    frame = await child.ask(Draw(view=FROM_ABOVE))
    assert isinstance(frame, Frame)
    assert np.array_equal(pixels_of(frame), pixels_of(picture))


def test_requests_wait_for_each_other_and_a_bug_does_not_end_the_child(tmp_path: Path) -> None:
    async def play() -> None:
        child = Child("glshade.live.judge", "auto", "", tmp_path, limit=None, nice=5)
        try:
            asked = [asyncio.create_task(child.ask(Draw(id=number))) for number in (7, 8, 9)]
            cancelled = asyncio.create_task(child.ask(Draw(id=10)))
            await asyncio.sleep(0)
            cancelled.cancel()
            answers = await asyncio.gather(*asked)
            # The judge draws nothing, so that each of these requests is a mistake of ours.
            assert [answer.id for answer in answers] == [7, 8, 9]
            assert all(isinstance(answer, Failed) for answer in answers)
            assert os.getpriority(os.PRIO_PROCESS, child.pid or 0) == os.getpriority(os.PRIO_PROCESS, 0) + 5
            assert (await child.ask(Draw(id=11))).id == 11
        finally:
            await child.stop()

    asyncio.run(play())


def test_a_child_that_cannot_start_is_lost() -> None:
    async def play() -> None:
        child = Child("glshade.live.messages")
        with pytest.raises(ChildLost, match="exit code 0"):
            await child.start()

    asyncio.run(play())
