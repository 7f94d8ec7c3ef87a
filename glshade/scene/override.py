"""Override: one value of a scene file put in the place of another, by a dotted key: `materials.body.roughness`."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterable, Mapping
from typing import Any

from glshade.document import nearest
from glshade.presets import PRESETS

# Dotted keys and their values; or, as a command line has them, pairs of key and text, which may say a key more than once.
Overrides = Mapping[str, Any] | Iterable[tuple[str, Any]]

BARE = r"""[^\s.="'[\]][^.="[\]]*"""
PART = rf"""\s*(?:"[^"]*"\s*|'[^']*'\s*|{BARE})"""
# Messages have `objects[0].material`; what is pasted from them is a key, too.
ITEM = r"\[[0-9]+\]"
KEY = re.compile(rf"{PART}(?:\.{PART}|{ITEM})*")
ASSIGNMENT = re.compile(rf"({KEY.pattern})=(.*)", re.DOTALL)
# What a scene has a list of, even where it is left out: an item of it cannot be made from a name.
LISTS = frozenset({"objects", "lights", "animation"})


class OverrideError(ValueError):
    """A key that leads nowhere in this document."""


def split(text: str) -> tuple[str, str]:
    """Key and text of `KEY=VALUE`. Errors: ValueError where it is none, or where the text is no value."""
    match = ASSIGNMENT.fullmatch(text)
    if not match or not match[2].strip():
        raise ValueError(f"{text!r} is not KEY=VALUE such as materials.body.roughness=0.3")
    pair = match[1].strip(), match[2].strip()
    pairs([pair])
    return pair


def parse(text: str) -> Any:
    """The value of a text: TOML's, or, for a bare word that is none, the word. Errors: ValueError."""
    text = text.strip()
    try:
        table = tomllib.loads(f"value = {text}\n")
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        if not text or text[0] in "[{\"'":
            # The column that follows counts from another beginning.
            raise ValueError(f"{_short(text)} is not a value of TOML: {str(error).partition(' (at')[0]}") from None
        return text
    if len(table) > 1:
        raise ValueError(f"{_short(text)} is not one value, but more")
    return table["value"]


def pairs(overrides: Overrides) -> list[tuple[str, Any]]:
    """Keys and values. What stands beside a key in a mapping is the value; in a pair, a string is a text that says it.

    Errors: ValueError for a text that is no value.
    """
    if isinstance(overrides, Mapping):
        return list(overrides.items())
    found = []
    for key, text in overrides:
        try:
            found.append((key, parse(text) if isinstance(text, str) else text))
        except ValueError as error:
            raise ValueError(f"{key}: {error}") from None
    return found


def apply(document: Mapping[str, Any], key: str, value: Any) -> dict[str, Any]:
    """The document with the value at the key; what was given is left as it is.

    A part of the key is a table's key, or in a list an item's `name` or its number; a name with one of . = [ ] in it stands in
    quotes: `materials."v1.2".kd`. A table that is not there is made; so is the material of a preset's name, from the preset.
    Errors: OverrideError.
    """
    if not KEY.fullmatch(key):
        raise OverrideError(f"{key!r} is not a dotted key such as materials.body.roughness")
    found = map(str.strip, re.findall(f"{PART}|{ITEM}", key))
    parts = tuple(part[1:-1] if part[0] in "\"'[" else part for part in found)
    result = _put(document, parts, (), value)
    assert isinstance(result, dict)
    return result


def _put(node: Any, parts: tuple[str, ...], before: tuple[str, ...], value: Any) -> Any:
    if not parts:
        return value
    part, rest = parts[0], parts[1:]
    here = (*before, part)
    if isinstance(node, list | tuple):
        index = _index(node, here)
        return [_put(item, rest, here, value) if i == index else item for i, item in enumerate(node)]
    if node is None:
        if len(before) == 1 and before[0] in LISTS:
            raise OverrideError(f"{_key(here)}: the scene lists no {before[0]}")
        node = {}
    if isinstance(node, str):
        node = _unfolded(node, here)
    if not isinstance(node, Mapping):
        raise OverrideError(f"{_key(here)}: {_key(before)} is {_short(node)}, not a table")
    below = node.get(part)
    if below is None and rest and before == ("materials",):
        if part not in PRESETS:
            raise OverrideError(f'{_key(here)}: no material or preset is named "{part}"{nearest(part, {*node, *PRESETS})}')
        below = {"preset": part}
    return {**node, part: _put(below, rest, here, value)}


def _unfolded(word: str, here: tuple[str, ...]) -> dict[str, Any]:
    """The table that a word stands for: `shape = "cube"`; a material's name stands for what others may use too."""
    *before, part = here
    if before[-1] == "shape":
        return {"type": word}
    if before[-1] == "material":
        instead = _key(("materials", word, part))
        raise OverrideError(f'{_key(here)}: the material is named "{word}"; set {instead} in its place')
    raise OverrideError(f"{_key(here)}: {_key(before)} is {_short(word)}, not a table")


def _index(items: list[Any] | tuple[Any, ...], here: tuple[str, ...]) -> int:
    part = here[-1]
    names = [item.get("name") if isinstance(item, Mapping) else None for item in items]
    if part in names:
        return names.index(part)
    if not items:
        raise OverrideError(f"{_key(here)}: there are none, {_key(here[:-1])} is empty")
    if not re.fullmatch("[0-9]+", part):
        known = [name for name in names if isinstance(name, str)]
        raise OverrideError(f'{_key(here)}: none is named "{part}"{nearest(part, [*known, f"0 to {len(items) - 1}"])}')
    # Only a count has few digits enough for int().
    if len(part) > len(str(len(items))) or int(part) >= len(items):
        raise OverrideError(f"{_key(here)}: there are {len(items)}, counted from 0")
    return int(part)


def _key(parts: Iterable[str]) -> str:
    """The dotted key of its parts."""
    return ".".join(part if re.fullmatch(BARE, part) else f'"{part}"' for part in parts)


def _short(value: object) -> str:
    """As Python writes it, cut where it would drown the message."""
    text = repr(value)
    return text if len(text) <= 40 else f"{text[:36]} ..."
