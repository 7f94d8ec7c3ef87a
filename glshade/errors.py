"""Errors: the classes of everything that glshade raises on purpose, with the exit code that the command line returns for each.

Every message is written for the person who can correct the fault. It names the file and the place in it, and says what is
wrong and what to do. The table of exit codes is in docs/exit-codes.md.
"""

from __future__ import annotations

from collections.abc import Sequence


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
        self.problems = (problems,) if isinstance(problems, str) else tuple(problems)
        super().__init__("\n".join(self.problems))


class AssetError(SceneError):
    """A mesh or a texture cannot be read, or has no content that can be drawn."""


class ShaderError(GlshadeError):
    """The driver or the include resolver refused a shader. Each line of the message reads `file:line:column: message`."""

    exit_code = 4


class ContextError(GlshadeError):
    """No OpenGL context could be made, or the context lacks a feature that the renderer needs."""

    exit_code = 5
