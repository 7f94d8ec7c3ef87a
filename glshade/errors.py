"""What can go wrong, one class an exit code.

Every message is written for the person who can mend it: the file, the place in it, what was wrong and what to do.
The table of exit codes is in docs/exit-codes.md.
"""

from __future__ import annotations

from collections.abc import Sequence


class GlshadeError(Exception):
    """The root of every error that glshade raises on purpose; the command line prints it without a traceback."""

    exit_code = 1


class MissingLibrary(GlshadeError):
    """What is asked for needs a library that an extra brings."""

    exit_code = 2


class SceneError(GlshadeError):
    """A scene, or a file it names, is not usable.

    `problems` holds one line a fault, each with file, key path and what is allowed: all of them, not the first.
    """

    exit_code = 3

    def __init__(self, problems: str | Sequence[str]) -> None:
        self.problems = (problems,) if isinstance(problems, str) else tuple(problems)
        super().__init__("\n".join(self.problems))


class AssetError(SceneError):
    """A mesh or a texture cannot be read, or holds nothing that can be drawn."""


class ShaderError(GlshadeError):
    """The driver or the include resolver refused a shader; each line reads `file:line:column: message`."""

    exit_code = 4


class ContextError(GlshadeError):
    """No OpenGL context could be made, or it lacks what the renderer needs."""

    exit_code = 5
