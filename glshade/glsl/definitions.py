"""Definitions: the functions, structs, constants and tables of a stage's text, and which of them main() reaches.

A definition is recognised where it starts in the first column of a line, and where its last line holds nothing else. Any other
text, such as one with a syntax error, counts as used, so that the driver sees all of it and reports its errors.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Literal, get_args

_HEAD = re.compile(
    r"(?:const \w+ (?P<const>\w+) =)|(?:struct (?P<struct>\w+) \{)|(?:uniform sampler3D (?P<table>\w+))|"
    r"(?:(?!layout\b)\w+ (?P<function>\w+)\((?P<rest>.*))"
)
_COMMENT = re.compile(r"//[^\n]*|/\*.*?\*/", re.DOTALL)
_CALL = re.compile(r"\b(\w+)\(")
_WORD = re.compile(r"[A-Za-z_]\w*")

Kind = Literal["const", "struct", "table", "function"]
KINDS: tuple[Kind, ...] = get_args(Kind)


@dataclass(frozen=True)
class Definition:
    """One definition of a stage's text.

    kind: function, struct, const, or table for the sampler of a model's table.
    name: the name that it defines.
    arguments: the number of arguments of a function, 0 otherwise.
    first: the index of its first line, counting the comment directly above it.
    end: the index after its last line.
    code: its text without comments.
    """

    kind: Kind
    name: str
    arguments: int
    first: int
    end: int
    code: str


def uncommented(text: str) -> str:
    """Returns the text without its comments. It keeps its lines."""
    return _COMMENT.sub(lambda comment: "\n" * comment[0].count("\n"), text)


def find_definitions(lines: Sequence[str]) -> list[Definition]:
    """Returns the definitions in a text, in their order."""
    definitions: list[Definition] = []
    code = uncommented("\n".join(lines)).split("\n")
    at = 0
    while at < len(lines):
        head = _HEAD.match(code[at])
        end = _end(code, at) if head else None
        if head is None or end is None:
            at += 1
            continue
        kind: Kind = next(kind for kind in KINDS if head[kind])
        first = at
        while first > 0 and lines[first - 1].startswith("//"):
            first -= 1
        text = "\n".join(code[at:end])
        arguments = _arguments(text, text.index("(")) if kind == "function" else 0
        definitions.append(Definition(kind, head[kind], arguments, first, end, text))
        at = end
    return definitions


def _end(code: Sequence[str], at: int) -> int | None:
    """Returns the index after the last line of the definition that starts at a line; None if it does not end cleanly.

    code: the lines of a text without comments.
    """
    depth = 0
    for index in range(at, len(code)):
        for place, character in enumerate(code[index]):
            depth += (character in "({") - (character in ")}")
            if depth == 0 and character in ";}":
                rest = code[index][place + 1 :].strip(" ;\t")
                return None if rest else index + 1
    return None


def unreached(lines: Sequence[str]) -> list[Definition]:
    """Returns the definitions that neither main() nor any uniform, input or output uses, directly or through other
    definitions.
    """
    definitions = find_definitions(lines)
    inside = {i for definition in definitions for i in range(definition.first, definition.end)}
    declarations = uncommented("\n".join(line for i, line in enumerate(lines) if i not in inside))
    reached: set[Definition] = set()
    pending = [definition for definition in definitions if definition.name == "main"]
    pending += _named(declarations, definitions)
    while pending:
        definition = pending.pop()
        if definition not in reached:
            reached.add(definition)
            pending += _named(definition.code, definitions)
    return [definition for definition in definitions if definition not in reached]


def _named(code: str, known: Iterable[Definition]) -> Iterable[Definition]:
    """Yields the known definitions that some code uses. Functions are matched by their name and number of arguments."""
    words = set(_WORD.findall(code))
    calls = {(call[1], _arguments(code, call.end() - 1)) for call in _CALL.finditer(code)}
    for definition in known:
        # A call without a closing bracket (-1) counts as a use, so that the driver sees the function and reports the error.
        is_called = (definition.name, definition.arguments) in calls or (definition.name, -1) in calls
        if is_called if definition.kind == "function" else definition.name in words:
            yield definition


def _arguments(code: str, opening: int) -> int:
    """Returns the number of arguments between the bracket at index `opening` and the one that closes it; -1 if none
    closes it.
    """
    depth, count = 0, 1
    for i in range(opening, len(code)):
        depth += (code[i] == "(") - (code[i] == ")")
        count += depth == 1 and code[i] == ","
        if depth == 0:
            return count if code[opening + 1 : i].strip() else 0
    return -1
