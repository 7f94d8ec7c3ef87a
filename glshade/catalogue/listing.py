"""Listing: what models, lights and presets declare of themselves, as plain dictionaries. Their keys are an interface."""

from __future__ import annotations

import inspect
import sys
from collections.abc import Mapping
from typing import Any, get_args

from glshade.brdfs import BRDFS, Brdf, Law
from glshade.lights import LIGHTS
from glshade.presets import PRESETS

LAWS: dict[Law, str] = {
    "reciprocity": "f(l, v) = f(v, l): light may be turned round",
    "energy": "no more light leaves than arrives",
}


def brdf(name: str) -> dict[str, Any]:
    """Everything a model declares. Errors: KeyError.

    name, class, summary, description, source, anisotropic; parameters: name, type (colour or number), default (None where left
    out), low, high, usual, unit, description, same_as, base; options: name, default, choices, description; laws: promised and
    reason each; shares; isotropic_where; limits: says, one, other, within.
    """
    model = BRDFS[name]
    return {
        "name": name,
        **_described(model),
        "source": model.source,
        "anisotropic": model.anisotropic,
        "parameters": [
            {
                "name": key,
                "type": "colour" if model.is_colour(key) else "number",
                "default": _plain(model.model_fields[key].default),
                **{field: _plain(value) for field, value in vars(declared).items()},
            }
            for key, declared in model.parameters().items()
        ],
        "options": [
            {
                "name": key,
                "default": model.model_fields[key].default,
                "choices": list(get_args(model.model_fields[key].annotation)),
                "description": model.model_fields[key].description,
            }
            for key in model.choices()
        ],
        "laws": {law: {"promised": law not in model.breaks, "reason": model.breaks.get(law)} for law in LAWS},
        "shares": list(model.shares),
        "isotropic_where": dict(model.isotropic_where),
        "limits": [
            {"says": limit.says, "one": _material(limit.one), "other": _material(limit.other), "within": limit.within}
            for limit in model.limits()
        ],
    }


def light(name: str) -> dict[str, Any]:
    """Everything a light declares. Errors: KeyError.

    name, class, summary, description, omnidirectional; falloffs; keys of the scene file: name, default, required, takes (in
    words), description; uniforms: the GLSL struct's fields in their order, name -> vec3 or float.
    """
    model = LIGHTS[name]
    falloff = model.model_fields.get("falloff")
    schema = model.model_json_schema()
    return {
        "name": name,
        **_described(model),
        "omnidirectional": model.omnidirectional,
        "falloffs": list(get_args(falloff.annotation)) if falloff else [],
        "keys": [
            {
                "name": key,
                "default": None if field.is_required() else _plain(field.default),
                "required": field.is_required(),
                "takes": _takes(schema["properties"][key]),
                "description": field.description or "",
            }
            for key, field in model.model_fields.items()
            if key != "type"
        ],
        "uniforms": model.fields(),
    }


def preset(name: str) -> dict[str, Any]:
    """name, description, source, brdf, material (as in a scene file), swatch (#rrggbb, sRGB). Errors: KeyError."""
    found = PRESETS[name]
    material = dict(found.material)
    return {
        "name": name,
        "description": found.description,
        "source": found.source,
        "brdf": material["brdf"],
        "material": _plain(material),
        "swatch": swatch(BRDFS[material["brdf"]].model_validate(material)),
    }


def swatch(material: Brdf) -> str:
    """`#rrggbb`, sRGB: what the surface shows from straight above under a uniform white sky, its albedo at normal incidence."""
    import numpy as np

    from glshade.catalogue.albedo import albedo
    from glshade.image.srgb import linear_to_srgb

    # Half a code of eight bits.
    colour = linear_to_srgb(albedo(material, (0.0, 0.0, 1.0), within=2e-3))
    return "#" + "".join(f"{code:02x}" for code in np.rint(colour * 255).astype(int).tolist())


def _described(model: type) -> dict[str, str]:
    """class; summary, from the first line of its module, which starts with the name; description, its own docstring."""
    own = inspect.cleandoc(model.__dict__.get("__doc__") or "")
    first = (sys.modules[model.__module__].__doc__ or "").strip().partition("\n")[0]
    summary = first.partition(": ")[2] or own.partition("\n")[0]
    return {"class": model.__name__, "summary": summary.rstrip("."), "description": own}


def _material(material: Brdf) -> dict[str, Any]:
    """As a scene file would have it: the model and what is said of it."""
    return {
        "brdf": material.brdf,
        **{key: _plain(getattr(material, key)) for key in sorted(material.model_fields_set - {"brdf"})},
    }


def _takes(schema: Mapping[str, Any]) -> str:
    """What a key takes, in a few words."""
    if "enum" in schema:
        return ", ".join(f'"{value}"' for value in schema["enum"])
    options = [option for option in schema.get("anyOf", ()) if option.get("type") != "null"]
    if options:
        words = [_takes(option) for option in options]
        return "3 numbers or 1" if words == ["number", "3 numbers"] else " or ".join(words)
    if schema.get("type") == "array":
        items = [*schema.get("prefixItems", ()), schema.get("items", {})][0]
        return f"{schema['maxItems']} {_takes(items)}s" if "maxItems" in schema else f"list of {_takes(items)}s"
    signs = {"minimum": ">=", "exclusiveMinimum": ">", "maximum": "<=", "exclusiveMaximum": "<"}
    bounds = [f"{sign} {schema[key]:g}" for key, sign in signs.items() if key in schema]
    return ", ".join([str(schema.get("type", "table")), *bounds])


def _plain(value: Any) -> Any:
    """As JSON has it: lists for tuples, tables for models."""
    if isinstance(value, Mapping):
        return {key: _plain(item) for key, item in value.items()}
    if hasattr(value, "model_dump"):
        return value.model_dump(mode="json")
    return [_plain(item) for item in value] if isinstance(value, tuple | list) else value
