"""Threads and forks: a renderer is used by any thread, by several at once, and refuses to work in a forked process."""

from __future__ import annotations

import multiprocessing
import subprocess
import sys
import textwrap
import threading
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import glshade
from glshade.errors import ContextError
from glshade.gl.context import open_context
from glshade.gl.renderer import Renderer

ROOT = Path(__file__).resolve().parents[3]


def _backend(renderer: Renderer) -> Any:
    """Returns the backend of a renderer, for another one: a process can use only one backend."""
    return renderer.context.backend


def _scenes() -> list[glshade.Scene]:
    """Returns scenes whose pictures differ."""
    return [
        glshade.Scene(
            objects=[{"shape": "sphere", "material": {"brdf": "phong", "kd": [0.1 * number, 0.5, 0.3]}}],
            film={"size": (48, 36), "samples": 1 + 3 * (number % 2)},
        )
        for number in range(8)
    ]


def test_made_in_one_thread_and_used_in_another(renderer: Renderer) -> None:
    scene = _scenes()[0]
    expected = np.asarray(renderer.render(scene))
    with Renderer(_backend(renderer)) as made, ThreadPoolExecutor(1) as other:
        assert np.array_equal(np.asarray(other.submit(made.render, scene).result(timeout=60)), expected)
        assert np.array_equal(np.asarray(made.render(scene)), expected)


def test_several_threads_share_a_renderer(renderer: Renderer) -> None:
    scenes = _scenes()
    expected = [np.asarray(renderer.render(scene)).copy() for scene in scenes]
    wrong: list[int] = []
    start = threading.Barrier(4)

    def work(offset: int) -> None:
        start.wait()
        for turn in range(20):
            number = (turn * 3 + offset) % len(scenes)
            if not np.array_equal(np.asarray(renderer.render(scenes[number])), expected[number]):
                wrong.append(number)

    with ThreadPoolExecutor(4) as threads:
        for done in [threads.submit(work, offset) for offset in range(4)]:
            done.result(timeout=120)
    assert wrong == []


def test_a_renderer_a_thread(renderer: Renderer) -> None:
    scenes = _scenes()[:3]
    expected = [np.asarray(renderer.render(scene)).copy() for scene in scenes]

    def work() -> bool:
        with Renderer(_backend(renderer)) as own:
            return all(np.array_equal(np.asarray(own.render(s)), e) for s, e in zip(scenes, expected, strict=True))

    with ThreadPoolExecutor(3) as threads:
        assert all(done.result(timeout=120) for done in [threads.submit(work) for _ in range(3)])


def test_contexts_nest(renderer: Renderer) -> None:
    """Whatever context was current before is current again, also if the same context is entered twice."""
    other = open_context(_backend(renderer))
    scene = _scenes()[1]
    expected = np.asarray(renderer.render(scene))
    with other.gl:
        before = other.gl.buffer(b"abcd")
        with renderer.context.gl, other.gl:
            assert np.array_equal(np.asarray(renderer.render(scene)), expected)
            assert before.read() == b"abcd"
        assert np.array_equal(np.asarray(renderer.render(scene)), expected)
        assert before.read() == b"abcd"
    other.release()


def test_a_forgotten_renderer_is_destroyed(renderer: Renderer) -> None:
    """A context takes several MB; hundreds of them would fill the memory."""

    def resident() -> int:
        return int(Path("/proc/self/statm").read_text().split()[1]) * 4096

    if not Path("/proc/self/statm").exists():
        pytest.skip("memory is looked up in /proc")
    scene = _scenes()[0]

    def draw(count: int) -> None:
        for _ in range(count):
            Renderer(_backend(renderer)).render(scene)

    draw(5)
    before = resident()
    draw(12)
    # Twelve contexts that were kept took 65 MB.
    assert resident() - before < 20 << 20


def _child(queue: multiprocessing.Queue[str], renderer: Renderer | None) -> None:
    for use in ("given", "new"):
        try:
            (renderer if renderer is not None and use == "given" else Renderer()).render(_scenes()[0])
            queue.put("drew")
        except ContextError as error:
            queue.put(str(error))


@pytest.mark.skipif("fork" not in multiprocessing.get_all_start_methods(), reason="this system cannot fork")
def test_a_fork_after_a_picture_is_told(renderer: Renderer) -> None:
    renderer.render(_scenes()[0])
    forking = multiprocessing.get_context("fork")
    queue = forking.Queue()
    process = forking.Process(target=_child, args=(queue, renderer))
    process.start()
    messages = [queue.get(timeout=5) for _ in range(2)]
    process.join(5)
    assert process.exitcode == 0
    assert all("spawn" in message for message in messages), messages


LOADER = """
    import multiprocessing
    import sys

    import numpy as np

    import glshade


    class Pictures:
        '''A data set as PyTorch's DataLoader reads it: each worker opens its renderer when it is first asked.'''

        renderer = None

        def __getitem__(self, number):
            if self.renderer is None:
                self.renderer = glshade.Renderer()
            scene = glshade.Scene(
                objects=[{"shape": "sphere", "material": {"brdf": "lambert", "kd": [0.1 * number, 0.5, 0.5]}}],
                film={"size": (24, 16)},
            )
            return np.asarray(self.renderer.render(scene)).sum()


    def work(data, numbers, queue):
        for number in numbers:
            queue.put((number, int(data[number])))


    if __name__ == "__main__":
        context = multiprocessing.get_context(sys.argv[1])
        queue, data = context.Queue(), Pictures()
        workers = [context.Process(target=work, args=(data, range(first, 8, 2), queue)) for first in range(2)]
        for worker in workers:
            worker.start()
        found = dict(queue.get(timeout=60) for _ in range(8))
        for worker in workers:
            worker.join(20)
        assert found == {number: int(data[number]) for number in range(8)}
        print("right")
"""


@pytest.mark.parametrize("method", ["fork", "spawn"])
def test_workers_of_a_data_loader(method: str, tmp_path: Path) -> None:
    """The main process has not used OpenGL when it forks."""
    script = tmp_path / "loader.py"
    script.write_text(textwrap.dedent(LOADER))
    done = subprocess.run([sys.executable, script, method], capture_output=True, text=True, timeout=120, cwd=ROOT)
    assert (done.returncode, done.stdout) == (0, "right\n"), done.stderr
