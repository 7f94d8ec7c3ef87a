"""The loop: a picture file follows the files that it is made from."""

from __future__ import annotations

import asyncio
from pathlib import Path

import numpy as np
import pytest
from support.drawn import SCENE

from glshade import GlshadeError, Renderer, load
from glshade.image.file import read
from glshade.live.loop import Redrawn, redraw

# The longest time for a picture, on a busy machine [s].
SOON = 60.0


def test_the_file_is_drawn_again_after_each_change(tmp_path: Path, renderer: Renderer) -> None:
    scene, output = tmp_path / "scene.toml", tmp_path / "picture.png"
    scene.write_text(SCENE)

    async def play() -> None:
        told: asyncio.Queue[Redrawn] = asyncio.Queue()
        drawing = asyncio.create_task(redraw(str(scene), str(output), told.put_nowait, overrides=("film.exposure=1",)))

        async def following() -> Redrawn:
            return await asyncio.wait_for(told.get(), SOON)

        assert (await following()).ok
        renderer.render(load(scene, [("film.exposure", "1")])).save(tmp_path / "expected.png")
        before, expected = read(output)[0], read(tmp_path / "expected.png")[0]
        assert np.array_equal(before, expected)
        scene.write_text("broken")
        broken = await following()
        assert not broken.ok
        assert broken.problems[0]["file"] == str(scene)
        assert np.array_equal(read(output)[0], before)
        scene.write_text(SCENE.replace("[0.6, 0.3, 0.1]", "[0.1, 0.3, 0.6]"))
        mended = await following()
        assert mended.ok
        assert mended.number == 3
        assert not np.array_equal(read(output)[0], before)
        drawing.cancel()

    asyncio.run(play())


def test_a_suffix_without_a_format_is_refused_at_once(tmp_path: Path) -> None:
    with pytest.raises(GlshadeError, match="cannot write"):
        asyncio.run(redraw("scene.toml", str(tmp_path / "picture.xyz"), print))
