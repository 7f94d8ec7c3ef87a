"""Errors: the classes of everything that glshade raises on purpose, with the exit code that the command line returns for each.

Every message is written for the person who can correct the fault. It names the file and the place in it, and says what is
wrong and what to do. The table of exit codes is in docs/exit-codes.md.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

from glshade.problem import Problem

# The length of a line of a message that concerns a scene [characters].
LONGEST_LINE = 1000
# Characters that a terminal obeys or that end a line: control characters, line separators, changes of the direction of
# writing, and halves of surrogate pairs, which cannot be written as UTF-8.
_UNPRINTABLE = re.compile("[\x00-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069\ud800-\udfff]")


def printable(text: str) -> str:
    """Returns a text as one line that is safe to print: `\\u001b` stands for an escape character, and so on.

    File names and the names in files come from strangers. Printed as they are, they could forge a line or take over a terminal.
    """
    return _UNPRINTABLE.sub(lambda match: f"\\u{ord(match[0]):04x}", text)


def is_printable(text: str) -> bool:
    """Returns whether `printable` leaves a text as it is."""
    return _UNPRINTABLE.search(text) is None


def figure(number: float) -> str:
    """Returns a number as text for a message: with six digits, or with as many as it takes to write it exactly.

    A value just outside a limit, rounded to six digits, would read like the limit itself.
    """
    short = f"{number:g}"
    return short if float(short) == number else str(number)


def shortened(line: str) -> str:
    """Returns a line of a message without its middle if it is so long that nobody would read it."""
    return line if len(line) <= LONGEST_LINE else f"{line[: LONGEST_LINE - 300]} ... {line[-290:]}"


class GlshadeError(Exception):
    """The base class of every error that glshade raises on purpose. The command line prints it without a traceback.

    exit_code: the exit code of a command that ends with this error.
    """

    exit_code = 1


class MissingLibrary(GlshadeError):
    """A library is missing that an optional extra of the package installs."""

    exit_code = 2


class SceneError(GlshadeError):
    """A scene, or a file that it names, cannot be used.

    problems: every fault, one line each, with the file, the key path and the values that are allowed.
    """

    exit_code = 3

    def __init__(self, problems: str | Sequence[str]) -> None:
        self.problems = tuple(shortened(printable(x)) for x in ((problems,) if isinstance(problems, str) else problems))
        super().__init__("\n".join(self.problems))


class AssetError(SceneError):
    """A mesh or a texture cannot be read, or has no content that can be drawn."""


class AssetWarning(UserWarning):
    """A mesh is drawn without something that it names or holds: a file that is missing, or values that are not numbers."""


class ShaderError(GlshadeError):
    """The driver or the include resolver refused a shader. Each line of the message reads `file:line:column: message`.

    problems: the faults with the lines of text around them, where the driver found them; empty for other errors.
    """

    exit_code = 4

    def __init__(self, message: str, problems: Sequence[Problem] = ()) -> None:
        self.problems = tuple(problems)
        super().__init__(message)


class NoReference(GlshadeError):
    """Nothing tells whether a picture is right: a model has only a GLSL file, or a view transform made the picture."""

    exit_code = 7


class ContextError(GlshadeError):
    """No OpenGL context could be made, or the context lacks a feature that the renderer needs."""

    exit_code = 5
