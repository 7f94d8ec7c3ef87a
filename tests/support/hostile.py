"""Hostile documents: scene documents made from the JSON schema, with values that are meant to break the program.

A document is a nested table in Python. Its text is JSON, written by hand: `json.dumps` refuses whole numbers of thousands of
digits.
"""

from __future__ import annotations

import json
import math
import random
from collections.abc import Mapping
from pathlib import Path
from typing import Any

NUMBERS: tuple[Any, ...] = (
    *(0, -1, 1, 2, 3, 1e-6, 1e-3, 0.5, 89.999, 90, 179.9999, 180, 360, 1e6, -1e6),
    *(5e-324, 1e-320, 2.3e-308, 1e-200, 1e-100, 1.1e-100, 1e-45, 1e-38, 1e-30, 1e-20, 1e-10),
    *(1e10, 1e19, 1e20, 1e30, 3.4e38, 1e39, 9e99, 1e100, 1e150, 1e200, 1e300, 1.7e308, -1e308, -1e30, -0.0),
    *(math.inf, -math.inf, math.nan, 2**31, 2**32, 2**53 + 1, 2**63 - 1, 2**63, 2**64, -(2**63), 10**400, -(10**5000)),
)
TEXTS = (
    *(
        "",
        ".",
        "..",
        "/",
        "\0",
        "\x1b[2J\x1b]0;x\x07",
        "a\nglshade: forged",
        "\r",
        "\x9b31m",
        "\u202egnp.exe",
        "\ud800",
        "\udc80x",
    ),
    *(
        "~nosuchuser/x",
        "~",
        "/dev/zero",
        "/dev/null",
        "/proc/self/mem",
        "fifo.png",
        "fifo.obj",
        "folder",
        "a" * 5000,
        "a/" * 2000,
    ),
    *(
        "{0}",
        "%s%n",
        "'\"",
        "ball",
        "auto",
        "null",
        "1e400",
        "cube.obj",
        "picture.png",
        "broken.png",
        "broken.obj",
        "x" * 100_000,
    ),
    *("ocio://", "ocio://default", "ocio://\n", "config.ocio", "phong", "ggx", "gold", "Ⅷ", "\U0001f600", "a.b", "[0]"),
)
# Numbers that a document may hold, but that leave the ranges of float32 or lose all digits.
EXTREMES = (1e-100, 1e-50, 1e-38, 1e-20, 1e-6, 0.0, 1.0, 179.999, 1e6, 1e19, 1e38, 1e50, 9e99, 1e100)
PATHS = ("cube.obj", "quad.gltf", "picture.png", "picture.png", "cube.obj", "~nosuchuser/x", "fifo.obj", "/dev/zero", "no.obj")
OBJ = "v -1 0 -1\nv 1 0 -1\nv 1 0 1\nv -1 1 1\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3 4/4\n"


class Maker:
    """Makes documents from a JSON schema.

    schema: the schema of scene files, as `glshade schema` prints it.
    chance: the source of random choices.
    hostility: the share of values that are replaced by hostile ones.
    nearly_valid: whether only numbers are replaced, by extreme ones, and everything that the schema does not say is put right.
    """

    def __init__(self, schema: Mapping[str, Any], chance: random.Random, hostility: float, nearly_valid: bool) -> None:
        self._schema, self._chance, self._hostility, self._nearly_valid = schema, chance, hostility, nearly_valid

    def document(self) -> Any:
        """Returns a document."""
        document = self._value(self._schema, 0)
        return mended(document, ()) if self._nearly_valid else document

    def hostile(self, depth: int = 0) -> Any:
        """Returns a value that is meant to break the program."""
        chance = self._chance
        kind = chance.randrange(10)
        if kind < 4:
            return chance.choice(NUMBERS)
        if kind < 7:
            return chance.choice(TEXTS)
        if kind == 7 and depth < 4:
            return [self.hostile(depth + 1) for _ in range(chance.choice((0, 1, 2, 3, 4, 16)))]
        if kind == 8 and depth < 4:
            return {chance.choice(TEXTS): self.hostile(depth + 1) for _ in range(chance.choice((0, 1, 2)))}
        return chance.choice((None, True, False, [], {}, [[]], [{}], "", nested(chance.choice((70, 5000)))))

    def _value(self, schema: Mapping[str, Any], depth: int) -> Any:
        chance = self._chance
        while "$ref" in schema:
            schema = self._schema["$defs"][schema["$ref"].rpartition("/")[2]]
        if depth and not self._nearly_valid and chance.random() < self._hostility:
            return self.hostile()
        if "anyOf" in schema and "properties" not in schema:
            return self._value(chance.choice(schema["anyOf"]), depth)
        if "const" in schema:
            return schema["const"]
        if "enum" in schema:
            return chance.choice(schema["enum"])
        kind = schema.get("type")
        if kind == "object":
            return self._table(schema, depth)
        if kind == "array":
            return self._list(schema, depth)
        if kind in ("number", "integer"):
            return self._number(schema, kind == "integer")
        if kind == "string":
            return chance.choice(PATHS) if schema.get("format") == "path" else chance.choice(("ball", "floor", "lid"))
        return chance.random() < 0.5 if kind == "boolean" else None

    def _table(self, schema: Mapping[str, Any], depth: int) -> dict[str, Any]:
        chance = self._chance
        result = {}
        for key, below in schema.get("properties", {}).items():
            if key in schema.get("required", ()) or chance.random() < (0.5 if self._nearly_valid else 0.25):
                result[key] = self._value(below, depth + 1)
        if isinstance(schema.get("additionalProperties"), Mapping):
            for _ in range(chance.randrange(3)):
                result[chance.choice(("ball", "floor", "lid"))] = self._value(schema["additionalProperties"], depth + 1)
        if {"mesh", "shape"} <= schema.get("properties", {}).keys() and chance.random() > self._hostility:
            # An object needs exactly one of the two, which the schema does not say.
            key, other = chance.choice((("mesh", "shape"), ("shape", "shape"), ("shape", "mesh")))
            result.pop(other if other != key else "mesh", None)
            result[key] = self._value(schema["properties"][key]["anyOf"][0], depth + 1)
        return result

    def _list(self, schema: Mapping[str, Any], depth: int) -> list[Any]:
        if "prefixItems" in schema:
            return [self._value(item, depth + 1) for item in schema["prefixItems"]]
        least = schema.get("minItems", 1)
        count = self._chance.randint(least, min(schema.get("maxItems", least + 2), least + 2))
        return [self._value(schema.get("items", {}), depth + 1) for _ in range(count)]

    def _number(self, schema: Mapping[str, Any], whole: bool) -> Any:
        low = schema.get("minimum", schema.get("exclusiveMinimum", -3))
        high = min(schema.get("maximum", schema.get("exclusiveMaximum", low + 6)), 512)
        if self._chance.random() < self._hostility:
            if self._nearly_valid:
                inside = [x for x in EXTREMES if low <= x <= schema.get("maximum", schema.get("exclusiveMaximum", x))]
                return self._chance.choice([low, high, *inside, *([-x for x in inside] if low < 0 else [])])
            return self._chance.choice((low, high, *NUMBERS))
        return (
            self._chance.randint(math.ceil(low), max(math.floor(high), math.ceil(low)))
            if whole
            else self._chance.uniform(low, high)
        )


def mended(value: Any, place: tuple[Any, ...]) -> Any:
    """Returns a document without the faults that its schema cannot exclude. place: the key path of the value."""
    if isinstance(value, list):
        return [mended(item, (*place, index)) for index, item in enumerate(value)]
    if not isinstance(value, dict):
        return value
    result = {key: mended(item, (*place, key)) for key, item in value.items() if item is not None}
    for key in ("animation", "parent", "only", "matrix", "near", "far", "ocio", "view", "display", "storage", "inner", "crop"):
        result.pop(key, None)
    if place[:1] == ("objects",) and len(place) == 2:
        result["name"] = f"object {place[1]}"
        result.setdefault("shape", "sphere")
        result.pop("mesh", None)
    if "texture" in result:
        result["texture"] = "picture.png"
    if isinstance(result.get("background"), list):
        result["background"] = result["background"][:1] * 3
    if (place[:1] == ("materials",) and len(place) == 2) or place[-1:] == ("material",):
        result.setdefault("brdf", "ggx" if "preset" not in result else None)
        result = {key: item for key, item in result.items() if item is not None}
    return result


def nested(depth: int) -> Any:
    """Returns a list that holds a list, and so on."""
    result: list[Any] = []
    for _ in range(depth):
        result = [result]
    return result


def text_of(value: Any) -> str:
    """Returns the JSON text of a document, which may be nested deeper than Python's stack, with numbers of any length."""
    parts: list[str] = []
    waiting: list[Any] = [value]
    while waiting:
        item = waiting.pop()
        if isinstance(item, _Text):
            parts.append(item)
        elif isinstance(item, dict):
            inner: list[Any] = []
            for index, (key, below) in enumerate(item.items()):
                inner += [_Text(("," if index else "") + json.dumps(key) + ":"), below]
            waiting += reversed([_Text("{"), *inner, _Text("}")])
        elif isinstance(item, list):
            inner = [part for index, below in enumerate(item) for part in ([_Text(","), below] if index else [below])]
            waiting += reversed([_Text("["), *inner, _Text("]")])
        elif isinstance(item, int) and not isinstance(item, bool):
            parts.append(_digits(item))
        else:
            parts.append(json.dumps(item))
    return "".join(parts)


class _Text(str):
    """A piece of JSON, in contrast to a string of the document."""


def _digits(number: int) -> str:
    """Returns the decimal digits of a whole number of any size."""
    return str(number) if abs(number) < 10**4000 else "-" * (number < 0) + "1" + "0" * 5000


def write_files(folder: Path) -> None:
    """Writes the files that hostile documents name to a folder: meshes, pictures, broken ones of both, a FIFO and a folder."""
    import os

    import numpy as np

    from glshade import Image

    (folder / "cube.obj").write_text(OBJ)
    (folder / "broken.obj").write_text("v 1 2\nf 1 2 999999999999999999999\n")
    positions = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], dtype="<f4")
    (folder / "quad.bin").write_bytes(positions.tobytes())
    accessor = {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}
    gltf = {
        "asset": {"version": "2.0"},
        "buffers": [{"uri": "quad.bin", "byteLength": 36}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}],
        "accessors": [accessor],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "nodes": [{"mesh": 0}],
    }
    (folder / "quad.gltf").write_text(json.dumps(gltf))
    Image(np.full((4, 4, 3), 0.5, dtype=np.float32)).save(folder / "picture.png")
    (folder / "broken.png").write_bytes((folder / "picture.png").read_bytes()[:40])
    (folder / "config.ocio").write_text("ocio_profile_version: 2\n")
    (folder / "folder").mkdir()
    for name in ("fifo.obj", "fifo.png"):
        os.mkfifo(folder / name)
