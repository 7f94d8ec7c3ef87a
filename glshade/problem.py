"""Problem: one fault of a shader, a scene or a file that a scene names, with its place and the lines around it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

# What was being done when the fault was found. "driver" stands for OpenGL itself, such as a missing context.
Where = Literal["scene", "mesh", "texture", "include", "vertex", "fragment", "link", "driver"]
# The number of lines that an excerpt shows before and after the line at fault.
AROUND = 2
# The longest line that an excerpt shows whole [characters].
WIDEST = 200


@dataclass(frozen=True)
class Problem:
    """One fault.

    file: the path of the file; `<place>` for generated GLSL; empty if no file is known.
    line: the number of the line, from 1; None if it is unknown.
    column: the number of the character in the line, from 1; None if it is unknown.
    message: what is wrong, in one line.
    stage: the step that found the fault.
    excerpt: the line at fault with its neighbours; empty if the line is unknown.
    first_line: the number of the excerpt's first line; None without an excerpt.
    """

    file: str
    line: int | None
    column: int | None
    message: str
    stage: Where
    excerpt: tuple[str, ...] = ()
    first_line: int | None = None

    def __str__(self) -> str:
        """One line: `file:line:column: message`. Parts of the place that are unknown are left out."""
        place = ":".join(str(part) for part in (self.file, self.line, self.column) if part not in (None, ""))
        return f"{place}: {self.message}" if place else self.message

    def beside(self, lines: Sequence[str]) -> Problem:
        """Returns the same problem with an excerpt. lines: all lines of the text that the fault lies in."""
        if self.line is None or not 1 <= self.line <= len(lines):
            return self
        first = max(self.line - AROUND, 1)
        excerpt = tuple(line[:WIDEST] for line in lines[first - 1 : self.line + AROUND])
        return replace(self, excerpt=excerpt, first_line=first)

    def text(self) -> str:
        """Several lines for a terminal: the problem, then its excerpt, with a caret below the column."""
        shown = [str(self)]
        for number, line in enumerate(self.excerpt, self.first_line or 1):
            # A tab takes one column here, so that the caret stands below its character.
            flat = line.replace("\t", " ")
            shown.append(f"{number:6} | {flat}".rstrip())
            if number == self.line and self.column is not None and self.column <= len(flat) + 1:
                shown.append(f"       | {' ' * (self.column - 1)}^")
        return "\n".join(shown)

    def as_dict(self) -> dict[str, Any]:
        """Returns the problem as JSON types. "caret" is the column again, or null where the excerpt does not reach it."""
        return {
            "file": self.file,
            "line": self.line,
            "column": self.column,
            "message": self.message,
            "stage": self.stage,
            "excerpt": list(self.excerpt),
            "first_line": self.first_line,
            "caret": self.column if self.excerpt else None,
        }
