"""In process: the engine that makes pictures in this process, which is fastest for a single picture."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from glshade.batch.maker import Maker
from glshade.batch.record import Record
from glshade.batch.task import Task
from glshade.scene.scene import Scene


class InProcess:
    """An engine without workers.

    maker: makes the pictures
    scenes: task number -> scene, for scenes that are loaded already
    reference: True if the float64 reference draws, so that no context is needed
    """

    jobs = 1

    def __init__(self, maker: Maker, scenes: dict[int, Scene], reference: bool) -> None:
        self._maker, self._scenes, self._reference = maker, scenes, reference
        self._stopping = False

    def ready(self) -> str:
        """Returns the name of the driver. Errors: ContextError."""
        return "float64 reference" if self._reference else self._maker.driver

    def records(self, tasks: Iterable[Task]) -> Iterator[Record]:
        """Yields the records in the order of the tasks."""
        for task in tasks:
            if self._stopping:
                return
            drawn = self._maker.draw(task, self._scenes.get(task.number))
            yield drawn if isinstance(drawn, Record) else drawn.write()

    def stop(self) -> None:
        """Lets no further picture begin."""
        self._stopping = True
