"""Law: a change of a scene whose effect on the picture is known."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

from numpy.typing import NDArray

from glshade.scene.object import Rate
from glshade.scene.scene import Scene

Array = NDArray[Any]


class Draw(Protocol):
    """A renderer, as laws use it."""

    def __call__(self, scene: Scene, *, shading: Rate | None = None, tile: int | None = None) -> Array:
        """Returns the picture (H, W, 3 or 4) of a scene, linear and premultiplied.

        shading: the shading rate of all objects in place of their own.
        tile: the largest side that the GPU draws in one piece [pixels]; the reference draws every picture in one piece.
        """
        ...


class NotApplicableError(Exception):
    """A law says nothing about a scene. The message is the reason, as a sentence without its full stop."""


def unchanged(scene: Scene) -> Scene:
    """Returns the scene itself."""
    return scene


@dataclass(frozen=True)
class Law:
    """A statement that holds for every scene to which it applies: another way to draw a scene gives the same picture.

    name: the name on the command line.
    description: the law in one line.
    picture: a function that draws one or more changed scenes, and returns the picture (H, W, 3 or 4) of the unchanged scene
        that follows from their pictures. It raises NotApplicableError for a scene that the law says nothing about.
    premise: optional, a function that changes a scene so that the law applies. The law then speaks about the changed scene.
        It raises NotApplicableError like `picture`.
    """

    name: str
    description: str
    picture: Callable[[Scene, Draw], Array]
    premise: Callable[[Scene], Scene] = unchanged
