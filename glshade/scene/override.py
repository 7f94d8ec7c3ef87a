"""Override: values that replace those of a scene file, each by a dotted key such as `materials.body.roughness`."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterable, Mapping
from typing import Any

from glshade.document import nearest, shortened
from glshade.presets import PRESETS

# A table of dotted keys and values; or pairs of key and text as on a command line, where a key may come several times.
Overrides = Mapping[str, Any] | Iterable[tuple[str, Any]]

BARE = r"""[^\s.="'[\]][^.="[\]]*"""
PART = rf"""\s*(?:"[^"]*"\s*|'[^']*'\s*|{BARE})"""
# Messages write `objects[0].material`, so that a key pasted from a message works too.
ITEM = r"\[[0-9]+\]"
KEY = re.compile(rf"{PART}(?:\.{PART}|{ITEM})*")
ASSIGNMENT = re.compile(rf"({KEY.pattern})=(.*)", re.DOTALL)
# The scene's keys that hold lists. If a scene leaves such a list out, an override cannot add an item to it.
LISTS = frozenset({"objects", "lights", "animation"})


class OverrideError(ValueError):
    """A dotted key does not lead to a value of the document."""


def split(text: str) -> tuple[str, str]:
    """Returns the key and the text of the value in `KEY=VALUE`.

    Errors: ValueError for another form of text, or for a text that is not a value.
    """
    match = ASSIGNMENT.fullmatch(text)
    if not match or not match[2].strip():
        raise ValueError(f"{text!r} is not KEY=VALUE such as materials.body.roughness=0.3")
    pair = match[1].strip(), match[2].strip()
    pairs([pair])
    return pair


def parse(text: str) -> Any:
    """Returns the value of a text in TOML. A bare word that is not TOML is returned as a string.

    Errors: ValueError for a text that starts like a TOML value but is not one, or that holds several.
    """
    text = text.strip()
    try:
        table = tomllib.loads(f"value = {text}\n")
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        if not text or text[0] in "[{\"'":
            # The position at the end of TOML's message is cut off, because it counts the prefix "value = ".
            raise ValueError(f"{shortened(text)} is not a value of TOML: {str(error).partition(' (at')[0]}") from None
        return text
    if len(table) > 1:
        raise ValueError(f"{shortened(text)} is not a single value")
    return table["value"]


def pairs(overrides: Overrides) -> list[tuple[str, Any]]:
    """Returns the keys and values of overrides. A mapping holds the values themselves; a string in a pair is parsed.

    Errors: ValueError for a text that is not a value.
    """
    if isinstance(overrides, Mapping):
        return list(overrides.items())
    parsed = []
    for key, text in overrides:
        try:
            parsed.append((key, parse(text) if isinstance(text, str) else text))
        except ValueError as error:
            raise ValueError(f"{key}: {error}") from None
    return parsed


def apply(document: Mapping[str, Any], key: str, value: Any) -> dict[str, Any]:
    """Returns a copy of the document in which the key has the value.

    Each part of the key is a table's key, or in a list an item's `name` or number. A name with one of . = [ ] in it stands in
    quotes: `materials."v1.2".kd`. A missing table is added; a missing material with a preset's name is added as that preset.
    Errors: OverrideError.
    """
    result = _put(document, parts_of(key), (), value)
    assert isinstance(result, dict)
    return result


def parts_of(key: str) -> tuple[str, ...]:
    """Returns the parts of a dotted key, without quotes and brackets. Errors: OverrideError."""
    if not KEY.fullmatch(key):
        raise OverrideError(f"{key!r} is not a dotted key such as materials.body.roughness")
    written = map(str.strip, re.findall(f"{PART}|{ITEM}", key))
    return tuple(part[1:-1] if part[0] in "\"'[" else part for part in written)


def _put(node: Any, parts: tuple[str, ...], before: tuple[str, ...], value: Any) -> Any:
    """Returns a copy of a part of the document with a value set. Errors: OverrideError.

    node: the table, list or value at `before`; None where there is none.
    parts: the parts of the key that lead on from the node.
    before: the parts of the key that lead to the node.
    value: the new value.
    """
    if not parts:
        return value
    part, rest = parts[0], parts[1:]
    path = (*before, part)
    if isinstance(node, list | tuple):
        index = index_of(node, path)
        return [_put(item, rest, path, value) if i == index else item for i, item in enumerate(node)]
    if node is None:
        if len(before) == 1 and before[0] in LISTS:
            raise OverrideError(f"{dotted(path)}: the scene lists no {before[0]}")
        node = {}
    if isinstance(node, str):
        node = _unfolded(node, path)
    if not isinstance(node, Mapping):
        raise OverrideError(f"{dotted(path)}: {dotted(before)} is {shortened(node)}, not a table")
    below = node.get(part)
    if below is None and rest and before == ("materials",):
        if part not in PRESETS:
            raise OverrideError(f'{dotted(path)}: no material or preset is named "{part}"{nearest(part, {*node, *PRESETS})}')
        below = {"preset": part}
    return {**node, part: _put(below, rest, path, value)}


def _unfolded(word: str, path: tuple[str, ...]) -> dict[str, Any]:
    """Returns the table that a word stands for, such as that of `shape = "cube"`. Errors: OverrideError.

    A material's name is refused, because other objects may use the same material.
    word: the value at the parent of the path.
    path: the parts of the key that was asked for.
    """
    *before, part = path
    if before[-1] == "shape":
        return {"type": word}
    if before[-1] == "material":
        instead = dotted(("materials", word, part))
        raise OverrideError(f'{dotted(path)}: the material is named "{word}"; set {instead} in its place')
    raise OverrideError(f"{dotted(path)}: {dotted(before)} is {shortened(word)}, not a table")


def index_of(items: list[Any] | tuple[Any, ...], path: tuple[str, ...]) -> int:
    """Returns the index of the item that the last part of the path names or numbers. Errors: OverrideError."""
    part = path[-1]
    names = [item.get("name") if isinstance(item, Mapping) else None for item in items]
    if part in names:
        return names.index(part)
    if not items:
        raise OverrideError(f"{dotted(path)}: {dotted(path[:-1])} is empty")
    if not re.fullmatch("[0-9]+", part):
        known = [name for name in names if isinstance(name, str)]
        raise OverrideError(f'{dotted(path)}: no item is named "{part}"{nearest(part, [*known, f"0 to {len(items) - 1}"])}')
    # The length is compared first, because int() refuses a text of several thousand digits.
    if len(part) > len(str(len(items))) or int(part) >= len(items):
        raise OverrideError(f"{dotted(path)}: the list has {len(items)} items, numbered from 0")
    return int(part)


def dotted(parts: Iterable[str]) -> str:
    """Returns the dotted key of its parts, with quotes where a part needs them."""
    return ".".join(part if re.fullmatch(BARE, part) else f'"{part}"' for part in parts)
