"""Writing: puts values that were changed on a page back into a scene file, whose comments and order stay."""

from __future__ import annotations

import hashlib
import shutil
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import tomlkit
from tomlkit.exceptions import TOMLKitError
from tomlkit.items import Table

from glshade.errors import SceneError
from glshade.files import read_bytes, replacing
from glshade.limits import LARGEST_SCENE
from glshade.presets import PRESETS
from glshade.scene.file import parse
from glshade.scene.override import OverrideError, apply, index_of, parts_of

BOM = b"\xef\xbb\xbf"


class Changed(SceneError):
    """The scene file has changed since it was loaded."""


def write(path: str | Path, values: Mapping[str, Any], expected: str) -> None:
    """Writes values into a scene file in TOML.

    path: the scene file. Where it is a symbolic link, the file that it leads to is written.
    values: dotted key -> value, as JSON types.
    expected: the SHA-256 of the file's bytes when it was loaded, in hexadecimal digits.
    Errors: Changed; SceneError for a file that is not TOML or cannot be written, and for values that no scene can have.
    """
    path = Path(path).resolve()
    if path.suffix.lower() != ".toml":
        raise SceneError(f"{path}: values can be written only into a scene in TOML")
    try:
        data = _unchanged(path, expected)
        text = data.removeprefix(BOM).decode("utf-8")
        written = _edited(text, values)
        # The scene is checked before the file is replaced, so that a page cannot break it.
        parse(tomllib.loads(written), path)
        with replacing(path) as temporary:
            encoded = written.encode("utf-8")
            temporary.write_bytes(BOM + encoded if data.startswith(BOM) else encoded)
            shutil.copymode(path, temporary)
            _unchanged(path, expected)
    except (OverrideError, TOMLKitError, UnicodeDecodeError) as error:
        raise SceneError(f"{path}: {error}") from None
    except OSError as error:
        raise SceneError(f"{path}: cannot be written: {error.strerror or error}") from None


def _unchanged(path: Path, expected: str) -> bytes:
    """Returns the bytes of a file. Errors: Changed where they are not the expected ones; OSError."""
    data = read_bytes(path, LARGEST_SCENE)
    if hashlib.sha256(data).hexdigest() != expected:
        raise Changed(f"{path}: has changed since it was loaded, so nothing was written")
    return data


def _edited(text: str, values: Mapping[str, Any]) -> str:
    """Returns a document with other values. Errors: OverrideError, TOMLKitError, SceneError."""
    document = tomlkit.parse(text)
    wanted: Mapping[str, Any] = tomllib.loads(text)
    for key, value in values.items():
        wanted = apply(wanted, key, value)
        _put(document, parts_of(key), (), value)
        # The document has been reordered by hand, so its index of keys is made anew.
        document = tomlkit.parse(document.as_string())
    written = document.as_string()
    if tomllib.loads(written) != wanted:
        raise SceneError(f"the values cannot be written into this file: {', '.join(values)}")
    return written


def _put(node: Any, parts: tuple[str, ...], before: tuple[str, ...], value: Any) -> None:
    """Sets a value in a document, in the way of `override.apply`.

    node: the table or list at `before`.
    parts: the parts of the key that lead on from the node.
    before: the parts of the key that lead to the node.
    value: the new value.
    """
    name, rest = parts[0], parts[1:]
    place: Any = index_of(node, (*before, name)) if isinstance(node, list) else name
    if not rest:
        _set(node, place, value)
        return
    if not isinstance(node, list) and place not in node:
        table: Any = tomlkit.inline_table() if before and before != ("materials",) else tomlkit.table()
        if before == ("materials",) and name in PRESETS:
            # A material that is not listed is the preset of its name.
            table["preset"] = name
        _set(node, place, table)
    elif isinstance(node[place], str):
        # A word such as `shape = "cube"` stands for a table.
        table = tomlkit.inline_table()
        table["type"] = str(node[place])
        node[place] = table
    _put(node[place], rest, (*before, name), value)


def _set(node: Any, place: str | int, value: Any) -> None:
    """Sets a value of a table or list. A new key comes after the last key, before the comments that lead to the next table."""
    is_new = not isinstance(node, list) and place not in node
    old = None if is_new else node[place]
    if isinstance(old, Table) and isinstance(value, Mapping):
        # The table itself stays, because the comments that lead to the next table belong to it.
        for key in [key for key in old if key not in value]:
            del old[key]
        for key, item in value.items():
            _set(old, key, item)
        return
    node[place] = value
    if not is_new or not isinstance(node, Table):
        return
    body = node.value.body
    last = next((index for index in range(len(body) - 2, -1, -1) if body[index][0] is not None), -1)
    if body[-1][0] is not None and body[-1][0].key == place:
        body.insert(last + 1, body.pop())
