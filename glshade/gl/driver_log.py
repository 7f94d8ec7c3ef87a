"""Driver log: what a driver's compiler and linker say about a program, as problems that name file, line and column."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, replace

from glshade.glsl.source import Source, Stage
from glshade.problem import AROUND, WIDEST, Problem, Where

# Message formats: Mesa `0:12(5): error: text`, NVIDIA `0(12) : error C1008: text`, and `ERROR: 0:12: text` of Apple, ANGLE and
# Intel.
_MESA = re.compile(r"^\s*\d+:(?P<line>\d+)\((?P<column>\d+)\):\s*(?P<text>.*)$")
_NVIDIA = re.compile(r"^\s*\d+\((?P<line>\d+)\)\s*:\s*(?P<text>.*)$")
_OTHERS = re.compile(r"^\s*(?:ERROR|(?P<warning>WARNING)):\s*\d+:(?P<line>\d+):\s*(?P<text>.*)$")
_HEADING = re.compile(r"^(vertex|fragment|geometry|compute)[ _]shader|^=+$|^GLSL (Compiler|Linker) failed|^Program$", re.I)
_FAILED_TO_LINK = "GLSL Linker failed"
# Runs of white space and comments, each of which Mesa's preprocessor replaces by one space.
_SPACE = re.compile(r"(?:\s|/\*.*?\*/)+")
# A name that a linker puts in quotes: `v_x', 'v_x' or "v_x".
_QUOTED = re.compile(r"[`'\"]([A-Za-z_]\w*)['\"]")
_WORD = re.compile(r"[A-Za-z_]\w*")


@dataclass(frozen=True)
class Message:
    """One message of a driver about a text.

    line: the number of the line in the text, from 1; None if the driver gives none.
    column: the number of the character in the line as the driver counts, from 1; None if it gives none.
    text: the message.
    """

    line: int | None
    column: int | None
    text: str

    @property
    def is_warning(self) -> bool:
        """Whether the text compiles in spite of it."""
        return self.text.lower().startswith("warning")


def messages(log: str) -> Iterator[Message]:
    """Yields the messages in the log of a compiler or linker."""
    for raw in log.splitlines():
        match = _MESA.match(raw) or _NVIDIA.match(raw) or _OTHERS.match(raw)
        if match:
            parts = match.groupdict()
            column = parts.get("column")
            text = f"warning: {parts['text']}" if parts.get("warning") else parts["text"]
            yield Message(int(parts["line"]), int(column) if column else None, text)
        elif raw.strip() and not _HEADING.match(raw.strip()):
            yield Message(None, None, raw.strip())


def problem(message: Message, stage: Stage, where: Where) -> Problem:
    """Returns a message about a stage as a problem with an excerpt.

    message: the message; lines beyond the end of the stage count as the last one.
    stage: the stage that the message's line refers to.
    where: the kind of the stage.
    """
    if message.line is None:
        return Problem("", None, None, message.text, where)
    text = stage.text.splitlines()
    index = min(max(message.line, 1), len(text)) - 1
    file, number = stage.lines[index]
    column = None if message.column is None else _column(text[index], message.column)
    return _with_excerpt(Problem(file, number, column, message.text, where), stage, index)


def problems_of_log(log: str, source: Source) -> list[Problem]:
    """Returns the problems in a moderngl error, without warnings. Its heading, `vertex_shader` or `fragment_shader`, tells the
    stage.

    log: the message of the error.
    source: the text of the program.
    """
    found = list(messages(log))
    found = [message for message in found if not message.is_warning] or found or [Message(None, None, " ".join(log.split()))]
    if log.startswith(_FAILED_TO_LINK):
        return [_link_problem(message, source) for message in found]
    if source.fragment and re.search(r"fragment[_ ]shader", log):
        return [problem(message, source.fragment, "fragment") for message in found]
    return [problem(message, source.vertex, "vertex") for message in found]


def _column(line: str, column: int) -> int:
    """Returns the column in a line of the text, from 1.

    column: the column that the driver counts, from 1. Mesa counts in the preprocessor's output, in which runs of white space
        and comments are one space.
    """
    skipped = 0
    for run in _SPACE.finditer(line):
        # The run is one space in the output, at this column.
        if run.start() - skipped + 1 >= column:
            break
        skipped += len(run[0]) - 1
    return min(column + skipped, max(len(line), column))


def _with_excerpt(problem: Problem, stage: Stage, index: int) -> Problem:
    """Returns the problem with the lines around it. index: the index of its line in the stage."""
    text, (file, number) = stage.text.splitlines(), stage.lines[index]
    around = range(max(index - AROUND, 0), min(index + AROUND + 1, len(text)))
    # Functions that the program does not need are left out of the stage, so the numbers of the lines may jump.
    near = [i for i in around if stage.lines[i] == (file, number + i - index)]
    excerpt = tuple(text[i][:WIDEST] for i in near)
    return replace(problem, excerpt=excerpt, first_line=stage.lines[near[0]][1])


def _link_problem(message: Message, source: Source) -> Problem:
    """Returns a message of the linker, with the place in each stage of the variable or function that it is about."""
    stages = [(stage, _subject(message.text, stage)) for stage in source.stages]
    kinds = ("vertex", "fragment")
    places = [
        f"{kind} stage: {stage.lines[0][0] if found is None else stage.place(found[0] + 1)}"
        for kind, (stage, found) in zip(kinds, stages, strict=False)
    ]
    text = f"{message.text} ({', '.join(places)})"
    for stage, found in stages:
        if found is not None:
            index, column = found
            file, number = stage.lines[index]
            return _with_excerpt(Problem(file, number, column, text, "link"), stage, index)
    return Problem(source.vertex.lines[0][0], None, None, text, "link")


def _subject(text: str, stage: Stage) -> tuple[int, int] | None:
    """Where a stage has the variable or function that a linker's message is about; None if it has none.

    text: the message.
    stage: the stage.
    Returns (index of the line, column from 1): of the declaration of a variable, of the first use of a function.
    """
    lines = [line.partition("//")[0] for line in stage.text.splitlines()]
    words = _WORD.findall(text)
    places = {declaration.name: index for index, declaration in stage.declared}
    name = next((word for word in words if word in places), None)
    if name is None:
        name = next(iter(_QUOTED.findall(text)), None)
    if name is None:
        return None
    pattern = re.compile(rf"\b{name}\b")
    first = places.get(name, 0)
    uses = ((index, pattern.search(line)) for index, line in enumerate(lines) if index >= first)
    return next(((index, use.start() + 1) for index, use in uses if use), None)
