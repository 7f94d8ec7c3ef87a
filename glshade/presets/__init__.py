"""Presets: materials that scenes use by name. Each is a TOML file of this folder, and the file's name is the preset's.

A file is read when its preset is first used, which keeps start-up fast.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from copy import deepcopy
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler, ValidationError
from pydantic_core import InitErrorDetails, core_schema

from glshade.document import fault, nearest


@dataclass(frozen=True)
class Preset:
    """A named material.

    description: its look in one line.
    source: the origin of its figures.
    material: the material's table, as in a scene file.
    """

    description: str
    source: str
    material: Mapping[str, Any]


class _Presets(Mapping[str, Preset]):
    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._names = sorted(path.stem for path in folder.glob("*.toml"))
        self._read: dict[str, Preset] = {}

    def __getitem__(self, name: str) -> Preset:
        if name not in self._read:
            if name not in self._names:
                raise KeyError(name)
            import tomllib

            self._read[name] = Preset(**tomllib.loads((self._folder / f"{name}.toml").read_text(encoding="utf-8")))
        return self._read[name]

    def __contains__(self, name: object) -> bool:
        return name in self._names

    def __iter__(self) -> Iterator[str]:
        return iter(self._names)

    def __len__(self) -> int:
        return len(self._names)


PRESETS: Mapping[str, Preset] = _Presets(Path(__file__).parent)


def preset(name: str) -> dict[str, Any]:
    """Returns a copy of the preset's material table, which the caller may change. Errors: KeyError."""
    return deepcopy(dict(PRESETS[name].material))


class FromPreset:
    """Annotates the type of a material chosen by `brdf`, so that `preset = "gold"` in its table adds that preset's keys. Keys
    that the table has itself take precedence."""

    def _expand(self, data: Any) -> Any:
        if not isinstance(data, Mapping) or "preset" not in data:
            return data
        own = {key: value for key, value in data.items() if key != "preset"}
        name = data["preset"]
        if not isinstance(name, str) or name not in PRESETS:
            raise _at("preset", f"unknown preset {name!r}" + nearest(name, PRESETS), name)
        table = preset(name)
        if own.get("brdf", table["brdf"]) != table["brdf"]:
            message = f'must be left out beside preset = "{name}", which is a {table["brdf"]}, not {own["brdf"]!r}'
            raise _at("brdf", message, own["brdf"])
        return table | own

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> core_schema.CoreSchema:
        return core_schema.no_info_before_validator_function(self._expand, handler(source))

    def __get_pydantic_json_schema__(self, schema: core_schema.CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        described = handler(schema)
        for choice in described["anyOf"]:
            # The definition is shared, so that a change here takes effect wherever it is used.
            table = handler.resolve_ref_schema(choice)
            brdf = table["properties"]["brdf"]["const"]
            names = [name for name in PRESETS if PRESETS[name].material["brdf"] == brdf]
            if names:
                words = "the preset to start from, in place of a brdf; keys of the table override the preset's"
                table["properties"]["preset"] = {"enum": names, "description": words}
                table["required"] = [key for key in table.get("required", ()) if key != "brdf"]
                table["anyOf"] = [{"required": ["brdf"]}, {"required": ["preset"]}]
        return described


def _at(key: str, message: str, given: Any) -> ValidationError:
    return ValidationError.from_exception_data("preset", [InitErrorDetails(type=fault(message), loc=(key,), input=given)])
