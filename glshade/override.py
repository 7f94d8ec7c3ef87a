"""Override: one value of a scene file put in the place of another, by a dotted key: `materials.body.roughness`."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from typing import Any

from glshade.document import nearest
from glshade.presets import PRESETS


class OverrideError(ValueError):
    """A key that leads nowhere in this document."""


def parse(text: str) -> tuple[str, Any]:
    """`KEY=VALUE`: a dotted key, and a value of TOML; a bare word that is none is a string. Errors: ValueError."""
    key, equals, value = text.partition("=")
    key, value = key.strip(), value.strip()
    if not equals or not value or not all(part.strip() for part in key.split(".")):
        raise ValueError(f"{text!r} is not KEY=VALUE such as materials.body.roughness=0.3")
    try:
        return key, tomllib.loads(f"value = {value}\n")["value"]
    except tomllib.TOMLDecodeError as error:
        if value[0] in "[{\"'":
            raise ValueError(f"{text!r}: the value is not TOML: {error}") from None
        return key, value


def apply(document: Mapping[str, Any], key: str, value: Any) -> dict[str, Any]:
    """The document with the value at the key; what was given is left as it is.

    A part of the key is a table's key, or in a list a number or an item's `name`. A table that is not there is made; so is the
    material of a preset's name, from the preset. Errors: OverrideError.
    """
    result = _put(document, tuple(part.strip() for part in key.split(".")), (), value)
    assert isinstance(result, dict)
    return result


def _put(node: Any, parts: tuple[str, ...], before: tuple[str, ...], value: Any) -> Any:
    if not parts:
        return value
    part, rest = parts[0], parts[1:]
    place = ".".join(before)
    here = (*before, part)
    if isinstance(node, list | tuple):
        index = _index(node, part, place)
        return [_put(item, rest, here, value) if i == index else item for i, item in enumerate(node)]
    if node is None:
        node = {}
    if isinstance(node, str):
        node = _unfolded(node, before, part)
    if not isinstance(node, Mapping):
        raise OverrideError(f"{'.'.join(here)}: {place} is {node!r}, not a table")
    below = node.get(part)
    if below is None and rest and before == ("materials",):
        if part not in PRESETS:
            raise OverrideError(f'{".".join(here)}: no material or preset is named "{part}"{nearest(part, {*node, *PRESETS})}')
        below = {"preset": part}
    return {**node, part: _put(below, rest, here, value)}


def _unfolded(word: str, place: tuple[str, ...], part: str) -> dict[str, Any]:
    """The table that a word stands for: `shape = "cube"`; a material's name stands for what others may use too."""
    if place[-1] == "shape":
        return {"type": word}
    if place[-1] == "material":
        raise OverrideError(
            f'{".".join(place)}.{part}: the material is named "{word}"; set materials.{word}.{part} in its place'
        )
    raise OverrideError(f"{'.'.join(place)}.{part}: {'.'.join(place)} is {word!r}, not a table")


def _index(items: list[Any] | tuple[Any, ...], part: str, place: str) -> int:
    names = [item.get("name") if isinstance(item, Mapping) else None for item in items]
    if part in names:
        return names.index(part)
    if part.isdigit() and int(part) < len(items):
        return int(part)
    if part.isdigit():
        raise OverrideError(f"{place}.{part}: there are {len(items)}, counted from 0")
    known = [name for name in names if name]
    raise OverrideError(f'{place}.{part}: none is named "{part}"{nearest(part, known)}; or a number from 0 to {len(items) - 1}')
