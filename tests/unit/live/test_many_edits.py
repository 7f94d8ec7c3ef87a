"""Many edits: in whatever way files are saved, the final state is shown, and nothing is left of the states before."""

from __future__ import annotations

import asyncio
import gc
import random
from pathlib import Path

import numpy as np
import pytest
from support.drawn import FROM_ABOVE, Drawn, drawn
from support.saving import STYLES

from glshade.live.messages import Loaded
from glshade.live.watcher import Watcher

# The longest time until a final state is shown, on a busy machine [s].
SOON = 20.0
# No more changes follow when none was told for this time [s].
QUIET = 0.1
# The share by which the process may grow after the first quarter of the edits.
GROWTH = 0.05
# The good states of the shader, which have different brightnesses.
STATES = range(1, 7)


def resident() -> int:
    """Returns the memory of this process [bytes]."""
    gc.collect()
    return int(Path("/proc/self/statm").read_text().split()[1]) * 4096


class Editor:
    """Saves a shader again and again, while a watcher and a drawer follow.

    answers: the drawer's answers after each change that the watcher told.
    """

    def __init__(self, live: Drawn) -> None:
        self.live, self.watcher = live, Watcher()
        self.answers: asyncio.Queue[Loaded] = asyncio.Queue()
        self.last = live.load()
        self.chance = random.Random(7)
        self.pictures = {}
        for state in STATES:
            live.write("phong", self.text(state))
            assert live.load().ok
            self.pictures[state] = live.pixels(**FROM_ABOVE)

    def text(self, state: int | None) -> str:
        """Returns the text of the shader in a state; None for a broken one."""
        factor = "wrong" if state is None else f"{state}.0 / 6.0"
        return self.live.shipped("phong").replace("return ", f"return {factor} * ", 1)

    async def follow(self) -> None:
        """Loads the scene again after each change."""
        self.watcher.watch([*self.last.dependencies, *self.last.folders])
        async for _ in self.watcher.changes():
            answer = self.live.load()
            self.watcher.watch([*answer.dependencies, *answer.folders])
            await self.answers.put(answer)

    async def save(self, state: int | None) -> None:
        """Saves the shader in a way that is chosen at random."""
        path = self.live.shaders / "brdf/phong.glsl"
        await asyncio.to_thread(self.chance.choice(STYLES), path, self.text(state))

    async def edit(self) -> int:
        """Saves some states quickly, a third of them broken, and checks what is shown in the end. Returns their number."""
        states = [
            None if self.chance.random() < 1 / 3 else self.chance.choice(STATES)
            for _ in range(self.chance.choice((1, 1, 2, 4)))
        ]
        for state in states:
            await self.save(state)
        await self.shown(states[-1])
        return len(states)

    async def shown(self, state: int | None) -> None:
        """Waits until a state is shown and no more changes follow."""
        while not self.answers.empty() or not self.is_shown(state):
            self.last = await asyncio.wait_for(self.answers.get(), SOON)
        while True:
            try:
                self.last = await asyncio.wait_for(self.answers.get(), QUIET)
            except TimeoutError:
                break
        assert self.is_shown(state)

    def is_shown(self, state: int | None) -> bool:
        """Returns whether the last answer and the picture are those of a state. A broken one has the picture of
        some good one.
        """
        assert self.last.ok == (not self.last.problems)
        if self.last.ok == (state is None):
            return False
        pixels = self.live.pixels(**FROM_ABOVE)
        good = [each for each in STATES if np.array_equal(self.pictures[each], pixels)]
        assert good, "the picture is that of no state"
        return state is None or good == [state]


@pytest.mark.parametrize("count", [20, pytest.param(1000, marks=pytest.mark.slow)])
def test_the_final_state_is_always_shown_and_nothing_is_left_behind(count: int, tmp_path: Path) -> None:
    async def play(live: Drawn) -> None:
        editor = Editor(live)
        following = asyncio.create_task(editor.follow())
        await asyncio.sleep(0.2)
        made, memory, objects = 0, 0, dict[str, int]()
        while made < count:
            made += await editor.edit()
            if not memory and made >= count // 4:
                # Two good states in a row, because the revision before the last one is kept.
                await editor.save(1)
                await editor.shown(1)
                await editor.save(2)
                await editor.shown(2)
                memory, objects = resident(), live.objects()
        for state in (1, 2):
            await editor.save(state)
            await editor.shown(state)
        following.cancel()
        assert live.objects() == objects
        assert resident() <= memory * (1 + GROWTH)

    with drawn(tmp_path) as live:
        asyncio.run(play(live))
