"""Problems: what an error of glshade says, as Problems that name file, line and column."""

from __future__ import annotations

import re
from pathlib import Path

from glshade.errors import AssetError, GlshadeError, SceneError, ShaderError
from glshade.files import read_bytes
from glshade.limits import LARGEST_SCENE
from glshade.problem import Problem, Where
from glshade.scene.places import Key, place_of

# `file:line:column: message` of a shader, where the column or line and column may be missing.
_IN_SHADER = re.compile(r"(?P<file>.+?):(?P<line>\d+):(?:(?P<column>\d+):)? (?P<text>.*)")
# The place in a message of Python's parsers of TOML and JSON.
_PARSED = re.compile(r"line (\d+),? column (\d+)")
# The key at the start of a message, such as `objects[2].material.kd: `.
_KEY = re.compile(r"(?P<key>[\w-]+(?:\.[^.\[\]:\s]+|\[\d+\])*): (?P<text>.*)")
_PART = re.compile(r"\[(\d+)\]|([^.\[\]]+)")


def problems_of(error: GlshadeError) -> tuple[Problem, ...]:
    """Returns the problems that an error reports, each with the lines around it where they can be read."""
    if isinstance(error, SceneError):
        return tuple(_of_scene(line, isinstance(error, AssetError)) for line in error.problems)
    if isinstance(error, ShaderError):
        return error.problems or tuple(map(_of_shader, str(error).split("\n")))
    return tuple(Problem("", None, None, line, "driver") for line in str(error).split("\n"))


def _of_shader(line: str) -> Problem:
    """Returns a line of a ShaderError that comes from the include resolver."""
    match = _IN_SHADER.fullmatch(line)
    if match is None:
        file, colon, text = line.partition(": ")
        return Problem(file, None, None, text, "include") if colon else Problem("", None, None, line, "include")
    column = int(match["column"]) if match["column"] else None
    return Problem(match["file"], int(match["line"]), column, match["text"], "include").beside(_lines(match["file"]))


def _of_scene(line: str, is_asset: bool) -> Problem:
    """Returns a line of a SceneError. is_asset: whether it is about a mesh or a texture alone."""
    file, colon, text = line.partition(": ")
    if not colon or not Path(file).suffix:
        return Problem("", None, None, line, "scene")
    where: Where = "mesh" if is_asset else "scene"
    lines = _lines(file)
    parsed = _PARSED.search(text)
    if parsed:
        return Problem(file, int(parsed[1]), int(parsed[2]), text, where).beside(lines)
    match = _KEY.fullmatch(text)
    if match is None:
        return Problem(file, None, None, text, where)
    key: Key = tuple(int(index) if index else name for index, name in _PART.findall(match["key"]))
    where = {"mesh": "mesh", "texture": "texture"}.get(str(key[-1]), where)  # type: ignore[assignment]
    line_number, column = place_of("\n".join(lines), key) or (None, None)
    return Problem(file, line_number, column, text, where).beside(lines)


def _lines(file: str) -> list[str]:
    """Returns the lines of a text file; none if it cannot be read."""
    try:
        return read_bytes(Path(file), LARGEST_SCENE).decode("utf-8-sig").splitlines()
    except (OSError, UnicodeDecodeError, ValueError):
        return []
