"""Mutation: one fault, as edits of a program's text or as a change of the finished picture."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

from numpy.typing import NDArray

from glshade.glsl.source import Source, Stage

Array = NDArray[Any]


@dataclass(frozen=True)
class Mutation:
    """A fault, which changes either programs, by `edits`, or pictures, by `picture`.

    name: the name on the command line.
    description: the fault in one line.
    edits: pairs of a regular expression and its replacement. They are applied to the text of every stage of every program.
    picture: a function that takes the pixels of a correct picture (H, W, 3 or 4) and returns faulty ones of the same shape.
    causes: the kinds of causes, one of which `glshade compare` names for the fault; empty where none is expected.
    """

    name: str
    description: str
    edits: tuple[tuple[str, str], ...] = ()
    picture: Callable[[Array], Array] | None = None
    causes: tuple[str, ...] = ()

    def rewrite(self, source: Source) -> Source:
        """Returns the source with the edits applied. It is unchanged if no pattern matches."""
        return replace(
            source, vertex=self._edited(source.vertex), fragment=self._edited(source.fragment) if source.fragment else None
        )

    def _edited(self, stage: Stage) -> Stage:
        text = stage.text
        # All patterns are matched against the original text, so that no edit changes text that another edit has inserted.
        # Replacing from the end keeps the positions of the remaining matches valid.
        spans = [(match, new) for old, new in self.edits for match in re.finditer(old, text)]
        for match, new in sorted(spans, key=lambda span: span[0].start(), reverse=True):
            text = text[: match.start()] + match.expand(new) + text[match.end() :]
        return replace(stage, text=text)
