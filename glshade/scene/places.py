"""Places: where the keys of a TOML or JSON text stand, for messages that name line and column.

The parsers of the standard library do not tell the places of what they read. This reader is for texts that those parsers
accept; of any other text it finds the keys before the first fault.
"""

from __future__ import annotations

import re
from functools import lru_cache

Key = tuple[str | int, ...]

# A string, a comment, a bracket, a separator, an end of line, or a word such as a number or a dotted key.
_TOKEN = re.compile(
    r'"""(?:\\.|[^\\])*?"""|'
    r"'''.*?'''|"
    r'"(?:\\.|[^"\\\n])*"|'
    r"'[^'\n]*'|#[^\n]*|[\[\]{},=:\n]|[^\s\[\]{},=:\"'#]+",
    re.S,
)


def place_of(text: str, key: Key) -> tuple[int, int] | None:
    """Returns the (line, column) of a key in a TOML or JSON text, both from 1; of the nearest table or list around it if the
    text does not have the key, and None if it has none of them.

    text: the text of the file.
    key: the names of tables and the indices of lists, from the outside to the key itself.
    """
    found = _places(text)
    for length in range(len(key), 0, -1):
        if key[:length] in found:
            before = text[: found[key[:length]]]
            return before.count("\n") + 1, len(before) - (before.rfind("\n") + 1) + 1
    return None


@lru_cache(maxsize=4)
def _places(text: str) -> dict[Key, int]:
    """Key -> its position in a text. Several faults are often looked up in the same text."""
    return _Reader(text).read()


class _Reader:
    """Reads a text once, and notes the position of every key and of every element of a list."""

    def __init__(self, text: str) -> None:
        self._tokens = [(match[0], match.start()) for match in _TOKEN.finditer(text) if not match[0].startswith("#")]
        self._at = 0
        self._places: dict[Key, int] = {}
        # The path of a list of tables -> the index of its last table.
        self._last: dict[Key, int] = {}

    def read(self) -> dict[Key, int]:
        """Key -> its position in the text, from 0."""
        try:
            self._skip_lines()
            if self._token == "{":
                self._value(())
            else:
                self._statements()
        except (IndexError, RecursionError):
            # The text has a fault here, which its parser has reported.
            pass
        return self._places

    @property
    def _token(self) -> str:
        return self._tokens[self._at][0]

    def _skip_lines(self) -> None:
        while self._at < len(self._tokens) and self._token in ("\n", ","):
            self._at += 1

    def _statements(self) -> None:
        """Reads the tables and keys of a TOML text."""
        table: Key = ()
        while self._at < len(self._tokens):
            if self._token == "[":
                table = self._header()
            else:
                self._assignment(table)
            self._skip_lines()

    def _header(self) -> Key:
        """Reads `[table]` or `[[list of tables]]`, and returns the path of the table that it starts."""
        position = self._tokens[self._at][1]
        brackets = 0
        while self._token == "[":
            brackets, self._at = brackets + 1, self._at + 1
        names = self._key("]")
        self._at += brackets
        path: Key = ()
        for number, name in enumerate(names, 1):
            path = (*path, name)
            if number == len(names) and brackets == 2:
                self._places.setdefault(path, position)
                self._last[path] = self._last.get(path, -1) + 1
            if path in self._last:
                path = (*path, self._last[path])
        self._places.setdefault(path, position)
        return path

    def _assignment(self, table: Key) -> None:
        """Reads a key with its value."""
        position = self._tokens[self._at][1]
        path = (*table, *self._key("=:"))
        self._at += 1
        self._places.setdefault(path, position)
        self._skip_lines()
        self._value(path)

    def _key(self, ends: str) -> list[str]:
        """Reads the parts of a dotted key, up to one of the tokens `ends`."""
        parts: list[str] = []
        while self._token not in ends:
            token = self._token
            parts += [token[1:-1]] if token[0] in "\"'" else [part for part in token.split(".") if part]
            self._at += 1
        return parts

    def _value(self, path: Key) -> None:
        """Reads a value: a list, a table, or something with no keys inside."""
        opening = self._token
        self._at += 1
        if opening not in ("[", "{"):
            return
        self._skip_lines()
        index = 0
        while self._token not in ("]", "}"):
            if opening == "{":
                self._assignment(path)
            else:
                self._places[*path, index] = self._tokens[self._at][1]
                self._value((*path, index))
                index += 1
            self._skip_lines()
        self._at += 1
