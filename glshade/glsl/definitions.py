"""Definitions: the functions, structs and constants of a stage's text, and which of them main() leads to.

It reads GLSL as this repository writes it (clang-format sees to that): whatever is defined starts in a line's first column,
and so does the brace that ends it.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Literal

_HEAD = re.compile(
    r"(?:const \w+ (?P<const>\w+) =)|(?:struct (?P<struct>\w+) \{)|(?:(?!layout\b)\w+ (?P<function>\w+)\((?P<rest>.*))"
)
_CALL = re.compile(r"\b(\w+)\(")
_WORD = re.compile(r"[A-Za-z_]\w*")


@dataclass(frozen=True)
class Definition:
    """One definition. arguments: how many a function takes. lines [first, end): where it stands, with the comment right above
    it; code: its text without comments."""

    kind: Literal["function", "struct", "const"]
    name: str
    arguments: int
    first: int
    end: int
    code: str


def uncommented(text: str) -> str:
    """The text without its `//` comments."""
    return re.sub(r"//.*", "", text)


def definitions(lines: Sequence[str]) -> list[Definition]:
    """What a text defines, in its order."""
    found: list[Definition] = []
    at = 0
    while at < len(lines):
        head = _HEAD.match(lines[at])
        if head is None:
            at += 1
            continue
        kind: Literal["function", "struct", "const"]
        kind = "const" if head["const"] else "struct" if head["struct"] else "function"
        over = (lambda line: ";" in line) if kind == "const" else (lambda line: line.startswith("}"))
        end = next((i for i in range(at, len(lines)) if over(uncommented(lines[i]))), len(lines) - 1)
        first = at
        while first > 0 and lines[first - 1].startswith("//"):
            first -= 1
        code = uncommented("\n".join(lines[at : end + 1]))
        arguments = _arguments(code, code.index("(")) if kind == "function" else 0
        found.append(Definition(kind, head[kind], arguments, first, end + 1, code))
        at = end + 1
    return found


def unreached(lines: Sequence[str]) -> list[Definition]:
    """The definitions that neither main() nor what is declared beside them (uniforms, inputs, outputs) leads to."""
    found = definitions(lines)
    inside = {i for one in found for i in range(one.first, one.end)}
    beside = uncommented("\n".join(line for i, line in enumerate(lines) if i not in inside))
    reached: set[Definition] = set()
    ahead = [one for one in found if one.name == "main"] + list(_named(beside, found))
    while ahead:
        one = ahead.pop()
        if one not in reached:
            reached.add(one)
            ahead += _named(one.code, found)
    return [one for one in found if one not in reached]


def _named(code: str, known: Iterable[Definition]) -> Iterable[Definition]:
    """What some code names: structs and constants by their word, functions by name and number of arguments."""
    words = set(_WORD.findall(code))
    calls = {(call[1], _arguments(code, call.end() - 1)) for call in _CALL.finditer(code)}
    for one in known:
        # A call that does not end is a fault, which the driver shall see.
        called = (one.name, one.arguments) in calls or (one.name, -1) in calls
        if called if one.kind == "function" else one.name in words:
            yield one


def _arguments(code: str, opening: int) -> int:
    """How many arguments stand between the bracket at `opening` and its partner; -1 where there is none."""
    depth, count = 0, 1
    for i in range(opening, len(code)):
        depth += (code[i] == "(") - (code[i] == ")")
        count += depth == 1 and code[i] == ","
        if depth == 0:
            return count if code[opening + 1 : i].strip() else 0
    return -1
