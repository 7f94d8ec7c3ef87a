"""Here: this process makes the pictures itself. For one, that is the quickest."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from glshade.batch.maker import Maker
from glshade.batch.record import Record
from glshade.batch.task import Task
from glshade.scene.scene import Scene


class Here:
    """An engine without workers. scenes: by the tasks' numbers, where they are loaded already."""

    jobs = 1

    def __init__(self, maker: Maker, scenes: dict[int, Scene], reference: bool) -> None:
        self._maker, self._scenes, self._reference = maker, scenes, reference
        self._stopping = False

    def ready(self) -> str:
        """What draws. Errors: ContextError."""
        return "float64 reference" if self._reference else self._maker.driver

    def records(self, tasks: Iterable[Task]) -> Iterator[Record]:
        """In the order of the tasks."""
        for task in tasks:
            if self._stopping:
                return
            drawn = self._maker.draw(task, self._scenes.get(task.number))
            yield drawn if isinstance(drawn, Record) else drawn.write()

    def stop(self) -> None:
        """Nothing more is begun."""
        self._stopping = True
