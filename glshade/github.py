"""GitHub: messages that a workflow of GitHub shows beside a line of a file, printed as commands of the workflow."""

from __future__ import annotations

import os
from typing import Literal


def annotation(level: Literal["error", "warning"], message: str, **properties: object) -> str:
    """Returns the command as one line: `::error file=a.glsl,line=3::message`.

    properties: name -> value, such as file, line, col and title; those that are None are left out.
    """
    given = ",".join(f"{name}={_escaped(str(value), ':,')}" for name, value in properties.items() if value is not None)
    return f"::{level} {given}::{_escaped(message)}" if given else f"::{level}::{_escaped(message)}"


def _escaped(text: str, more: str = "") -> str:
    """Returns a text in which the characters that end a part of the command are escaped. more: further such characters."""
    for character in f"%\r\n{more}":
        text = text.replace(character, f"%{ord(character):02X}")
    return text


def path_in_repository(path: str) -> str:
    """Returns a path relative to the current folder if it lies below that, else the path itself."""
    relative = os.path.relpath(path)
    return path if relative.startswith("..") else relative
