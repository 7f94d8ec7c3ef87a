"""Diagnosis: all errors of a program, where a compiler stops at the first ones.

A compiler stops at the first error of syntax, and does not compile a stage after another one has failed. So each stage is
compiled by itself, and again without the definitions that had errors, until nothing more is found. A function with errors keeps
its head, so that calls of it stay valid. Any other definition with errors is left out, and then errors in lines that use its
name are not reported, because they may be consequences.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, replace

import moderngl

from glshade.errors import ShaderError
from glshade.gl.context import Context
from glshade.gl.driver_log import Message, messages, problem
from glshade.gl.orphans import delete_orphans
from glshade.gl.program import Program
from glshade.glsl.source import Source, Stage
from glshade.problem import Problem, Where

# A stage is compiled at most so often. Each time, at least one definition fewer is left.
MOST_ROUNDS = 40
# The start of a definition at the outermost level.
_HEAD = re.compile(r"[A-Za-z_]")
_WORD = re.compile(r"[A-Za-z_]\w*")
# A declaration of a variable in a function.
_DECLARED = re.compile(r"\s*(?:const\s+)?(?!return\b)\w+\s+(\w+)\s*[=;,[]")
# Words of the language, which are not names that a definition introduces.
_LANGUAGE = re.compile(
    r"void|bool|u?int|float|double|[biud]?vec[234]|d?mat[234](x[234])?|[iu]?sampler\w+|const|in|out|inout|uniform|struct|layout|"
    r"std140|location|flat|centroid|noperspective|smooth|invariant|highp|mediump|lowp|precision|if|else|for|while|do|return|"
    r"discard|true|false"
)
# Messages that are about a name, and so are errors of their own even beside another error in the same line.
_ABOUT_A_NAME = re.compile(r"undeclared|undefined|no function|no matching|field")
# Messages that are consequences once a part of the text is left out.
_OF_LESS_TEXT = re.compile(r"end of file$|unterminated|no return statement", re.I)
# Mesa's name for the type of an expression in which it has reported an error already.
_TYPE_OF_ERRORS = re.compile(r"\btype error\b")
# A shader of the other kind, to compile a fragment stage by itself.
_ANY_VERTEX_STAGE = "#version 330 core\nvoid main() {\n    gl_Position = vec4(0.0);\n}\n"


def diagnose(context: Context, source: Source) -> list[Problem]:
    """Returns the errors of a program, each once; empty if it compiles and links.

    context: the context to compile in.
    source: the text of the program.
    """
    with context.gl as gl:
        try:
            Program(context, source)
        except ShaderError as error:
            found = [*_of_stage(context, source.vertex, "vertex")]
            if source.fragment is not None:
                found += _of_stage(context, source.fragment, "fragment")
            return distinct(found or error.problems)
        finally:
            # This frees the programs that compiled.
            gl.gc()
    return []


def distinct(problems: list[Problem] | tuple[Problem, ...]) -> list[Problem]:
    """Returns the problems without repetitions, in their order.

    A file that stands in both stages, or in many programs, is reported once. The lines of generated text have other numbers in
    other programs, so there the text of the line counts in place of its number.
    """
    first: dict[tuple[object, ...], Problem] = {}
    for each in problems:
        line: object = each.line
        if each.file.startswith("<") and each.line is not None and each.first_line is not None:
            line = each.excerpt[each.line - each.first_line]
        first.setdefault((each.file, line, each.column, each.message), each)
    return list(first.values())


def _of_stage(context: Context, stage: Stage, where: Where) -> Iterator[Problem]:
    return (problem(message, stage, where) for message in _Search(context, stage, where).messages())


@dataclass
class _Block:
    """A definition at the outermost level of a text.

    first: the index of its first line.
    end: the index after its last line.
    state: what is left of it: all, its head (of a function), or nothing.
    """

    first: int
    end: int
    state: str = "whole"


class _Search:
    """Compiles one stage again and again, each time with fewer definitions."""

    def __init__(self, context: Context, stage: Stage, where: Where) -> None:
        self._context, self._where = context, where
        self._lines = stage.text.splitlines()
        self._blocks = _blocks(self._lines)
        # The names that were defined by what is left out.
        self._missing: set[str] = set()

    def messages(self) -> list[Message]:
        """Returns all errors of the stage, in the order in which they were found."""
        found: list[Message] = []
        lines: set[int | None] = set()
        for round_ in range(MOST_ROUNDS):
            errors = self._errors()
            if round_:
                errors = [error for error in errors if not _OF_LESS_TEXT.search(error.text)]
            found += [error for error in _causes(errors) if error.line not in lines and not self._follows(error)]
            lines |= {error.line for error in errors}
            if not errors or not self._hide(errors):
                break
        return found

    def _errors(self) -> list[Message]:
        """Returns the errors that the compiler reports about what is left."""
        text = "\n".join(self._left()) + "\n"
        try:
            if self._where == "vertex":
                self._context.gl.program(vertex_shader=text)
            else:
                self._context.gl.program(vertex_shader=_ANY_VERTEX_STAGE, fragment_shader=text)
        except moderngl.Error as error:
            delete_orphans(self._context)
            # What is left may miss functions and inputs, so that only its compilation counts.
            if "Linker failed" not in str(error):
                return [message for message in messages(str(error)) if not message.is_warning]
        return []

    def _left(self) -> list[str]:
        """Returns the lines of the text that are left; all others are empty, so that the numbers of the lines stay."""
        lines = list(self._lines)
        for block in self._blocks:
            if block.state != "whole":
                kept = _head(self._lines, block) if block.state == "head" else []
                lines[block.first : block.end] = kept + [""] * (block.end - block.first - len(kept))
        return lines

    def _follows(self, error: Message) -> bool:
        """Returns whether the error may be a consequence of a definition that is left out."""
        if not self._missing or error.line is None:
            return False
        line = self._lines[min(error.line, len(self._lines)) - 1]
        return not self._missing.isdisjoint(_WORD.findall(f"{line} {error.text}"))

    def _hide(self, errors: list[Message]) -> bool:
        """Leaves out the definitions in which the errors are. Returns whether anything has changed."""
        at_fault: dict[int, tuple[int, Message]] = {}
        changed = False
        for error in errors:
            index = min(error.line or 1, len(self._lines)) - 1
            number = next((i for i, block in enumerate(self._blocks) if block.first <= index < block.end), None)
            if number is not None:
                at_fault.setdefault(number, (index, error))
            elif not self._lines[index].startswith("#"):
                # The line belongs to no definition.
                changed |= self._lines[index] != ""
                self._lines[index] = ""
        for number, (index, error) in at_fault.items():
            changed |= self._hide_block(number, index, error)
        return changed

    def _hide_block(self, number: int, index: int, error: Message) -> bool:
        """Leaves out a definition, or the body of a function. Returns whether anything has changed.

        number: the number of the definition.
        index: the index of the line with the error.
        error: the error.
        """
        block = self._blocks[number]
        if block.state == "nothing":
            return False
        head = _head(self._lines, block)
        in_head = index < block.first + max(len(head), 1)
        is_syntax = "syntax" in error.text and not _OF_LESS_TEXT.search(error.text)
        if is_syntax and in_head and number and self._is_unfinished(self._blocks[number - 1], error):
            return True
        if is_syntax and not in_head and block.state == "whole" and self._mend(index, block.first, error):
            return True
        if head and block.state == "whole" and not (in_head and is_syntax):
            block.state = "head"
            return True
        block.state = "nothing"
        self._missing |= _introduced(self._lines[block.first : block.end], bool(head))
        return True

    def _mend(self, index: int, first: int, error: Message) -> bool:
        """Adds the semicolon that the line before an error of syntax lacks, or leaves out the line of the error.

        index: the index of the line of the error.
        first: the index of the first line of its function.
        error: the error.
        Returns whether the error goes away.
        """
        before = next((i for i in range(index - 1, first, -1) if self._lines[i].partition("//")[0].strip()), None)
        if before is not None and self._goes_away(error, before, f"{self._lines[before].partition('//')[0]};"):
            return True
        line = self._lines[index]
        if "{" not in line and "}" not in line and self._goes_away(error, index, ""):
            declared = _DECLARED.match(line)
            self._missing |= {declared[1]} if declared else set()
            return True
        return False

    def _goes_away(self, error: Message, index: int, line: str) -> bool:
        """Returns whether an error goes away with another line in place of the one at `index`, which then stays in
        its place.
        """
        old, self._lines[index] = self._lines[index], line
        if self._has(error):
            self._lines[index] = old
            return False
        return True

    def _has(self, error: Message) -> bool:
        """Returns whether what is left still has an error at the place of this one."""
        return any((other.line, other.column) == (error.line, error.column) for other in self._errors())

    def _is_unfinished(self, before: _Block, error: Message) -> bool:
        """Returns whether an error of syntax in a head goes away without the definition before it, or with a semicolon after
        that one.

        If so, the definition before is left without its body, or gets its semicolon: it lacks its last bracket or semicolon.
        """
        last = max(i for i in range(before.first, before.end) if i == before.first or self._lines[i].partition("//")[0].strip())
        if not _head(self._lines, before):
            return self._goes_away(error, last, f"{self._lines[last].partition('//')[0]};")
        state, before.state = before.state, "head"
        if self._has(error):
            before.state = state
            return False
        return True


def _causes(errors: list[Message]) -> list[Message]:
    """Returns the errors without those that a compiler reports only because of another error in the same line.

    After an undeclared name, Mesa reports also that the sum with it is not a number. So the first error of a line counts, and
    those about other names.
    """
    first: dict[int | None, Message] = {}
    for error in errors:
        first.setdefault(error.line, error)
    causes = [error for error in errors if error is first[error.line] or _ABOUT_A_NAME.search(error.text)]
    return [error for error in causes if not _TYPE_OF_ERRORS.search(error.text)] or causes


def _blocks(lines: list[str]) -> list[_Block]:
    """Returns the definitions at the outermost level.

    Each starts in the first column, as clang-format writes it, and reaches to a line that starts with a closing brace, or to
    the start of the next.
    """
    blocks: list[_Block] = []
    is_open = False
    for index, line in enumerate(lines):
        if _HEAD.match(line):
            if is_open:
                blocks[-1] = replace(blocks[-1], end=index)
            blocks.append(_Block(index, len(lines)))
            is_open = True
        elif line.startswith("}") and is_open:
            blocks[-1] = replace(blocks[-1], end=index + 1)
            is_open = False
    return blocks


def _head(lines: list[str], block: _Block) -> list[str]:
    """Returns the lines of a function's head, made a declaration; empty for a definition that is no function."""
    head: list[str] = []
    for line in lines[block.first : block.end]:
        code = line.partition("//")[0]
        if "{" in code:
            head.append(f"{code.partition('{')[0].rstrip()};")
            return head if "(" in " ".join(head) and not head[0].startswith("layout") else []
        head.append(code)
    return []


def _introduced(lines: list[str], is_function: bool) -> set[str]:
    """Returns the names that a definition introduces. Its lines may have errors, so this may return some names too many."""
    code = "\n".join(line.partition("//")[0] for line in lines)
    named = re.search(r"(\w+)\s*\(", code) if is_function else re.search(r"\bstruct\s+(\w+)", code)
    if named:
        return {named[1]}
    return {word for word in _WORD.findall(code.partition("=")[0]) if not _LANGUAGE.fullmatch(word)}
