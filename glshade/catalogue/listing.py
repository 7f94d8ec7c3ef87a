"""Listing: the declarations of models, lights and presets as plain dictionaries, whose keys are an interface for users."""

from __future__ import annotations

import inspect
import sys
from collections.abc import Mapping
from typing import Any, get_args

from glshade.brdfs import BRDFS, Brdf, Law
from glshade.document import Document
from glshade.lights import LIGHTS
from glshade.presets import PRESETS

# Law, a property that a model may promise -> its meaning in words
LAWS: dict[Law, str] = {
    "reciprocity": "f(l, v) = f(v, l): light and viewer may be exchanged",
    "energy": "no more light leaves than arrives",
}


def brdf(name: str) -> dict[str, Any]:
    """Returns the declaration of a model as a dictionary ready for JSON, with these keys:

    name, class, summary, description, source, anisotropic, shares, isotropic_where: as the class declares them.
    parameters: a list of dictionaries with the keys name, type (colour or number), default (None for an optional parameter),
        low, high, usual, unit, description, same_as and base.
    options: a list of dictionaries with the keys name, default, choices and description.
    keys: a list of dictionaries for the model's other keys of the scene file, as for `light`.
    laws: law -> `promised` and, if the model breaks the law, the reason.
    limits: a list of dictionaries with the keys says, one, other and within.
    reference: false for a model that has only a GLSL file, so that nothing is known of its laws and limits.
    Errors: KeyError if no model has this name.
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
        "keys": _keys(model, {*Brdf.model_fields, *model.parameters(), *model.choices()}),
        "laws": {law: {"promised": law not in model.breaks, "reason": model.breaks.get(law)} for law in LAWS},
        "shares": list(model.shares),
        "isotropic_where": dict(model.isotropic_where),
        "limits": [
            {"says": limit.says, "one": _material(limit.one), "other": _material(limit.other), "within": limit.within}
            for limit in model.limits()
        ],
        "reference": model.has_reference,
    }


def light(name: str) -> dict[str, Any]:
    """Returns the declaration of a light as a dictionary ready for JSON, with these keys:

    name, class, summary, description, omnidirectional: as the class declares them.
    falloffs: the falloffs that the light may have; empty if it has none.
    keys: a list with a dictionary for each key of the scene file: name, default, required, takes (the allowed values in words)
        and description.
    uniforms: name -> vec3 or float, the fields of the GLSL struct in their order.
    Errors: KeyError if no light has this name.
    """
    model = LIGHTS[name]
    falloff = model.model_fields.get("falloff")
    return {
        "name": name,
        **_described(model),
        "omnidirectional": model.omnidirectional,
        "falloffs": list(get_args(falloff.annotation)) if falloff else [],
        "keys": _keys(model, {"type"}),
        "uniforms": model.fields(),
    }


def _keys(model: type[Document], without: set[str]) -> list[dict[str, Any]]:
    """Returns a dictionary for each key of a table of the scene file. without: the keys that are left out."""
    fields = {key: field for key, field in model.model_fields.items() if key not in without}
    # Most models have no keys of this kind, and making a schema takes time.
    schema = model.model_json_schema() if fields else {}
    return [
        {
            "name": key,
            "default": None if field.is_required() else _plain(field.default),
            "required": field.is_required(),
            "takes": _takes(schema["properties"][key]),
            "description": field.description or "",
        }
        for key, field in fields.items()
    ]


def preset(name: str) -> dict[str, Any]:
    """Returns the declaration of a preset as a dictionary ready for JSON, with these keys:

    name, description, source: as its file declares them.
    brdf: the model's name.
    material: the material's keys, as a scene file gives them.
    swatch: the colour as #rrggbb, sRGB-encoded.
    Errors: KeyError if no preset has this name.
    """
    declared = PRESETS[name]
    material = dict(declared.material)
    return {
        "name": name,
        "description": declared.description,
        "source": declared.source,
        "brdf": material["brdf"],
        "material": _plain(material),
        "swatch": swatch(BRDFS[material["brdf"]].model_validate(material)),
    }


def swatch(material: Brdf) -> str:
    """Returns a material's albedo at normal incidence as `#rrggbb`, sRGB-encoded: its colour under a uniform white sky."""
    import numpy as np

    from glshade.catalogue.albedo import directional_albedo
    from glshade.image.srgb import linear_to_srgb

    # An error of 2e-3, half a step between 8-bit codes, does not show.
    colour = linear_to_srgb(directional_albedo(material, (0.0, 0.0, 1.0), within=2e-3))
    return "#" + "".join(f"{code:02x}" for code in np.rint(colour * 255).astype(int).tolist())


def _described(model: type) -> dict[str, str]:
    """Returns the description that a class gives of itself, as a dictionary with these keys:

    class: its name.
    summary: the first line of its module's docstring after "Name: ", or the first line of its own docstring.
    description: its own docstring.
    """
    description = inspect.cleandoc(model.__dict__.get("__doc__") or "")
    first = (sys.modules[model.__module__].__doc__ or "").strip().partition("\n")[0]
    summary = first.partition(": ")[2] or description.partition("\n")[0]
    return {"class": model.__name__, "summary": summary.rstrip("."), "description": description}


def _material(material: Brdf) -> dict[str, Any]:
    """Returns a material as a table of a scene file: the model's name and the keys that were given."""
    return {
        "brdf": material.brdf,
        **{key: _plain(getattr(material, key)) for key in sorted(material.model_fields_set - {"brdf"})},
    }


def _takes(schema: Mapping[str, Any]) -> str:
    """Returns the values that a key takes, in words, from its JSON schema."""
    if "enum" in schema:
        return ", ".join(f'"{value}"' for value in schema["enum"])
    options = [option for option in schema.get("anyOf", ()) if option.get("type") != "null"]
    if options:
        words = [_takes(option) for option in options]
        return "3 numbers or 1" if words == ["number", "3 numbers"] else " or ".join(words)
    if schema.get("type") == "array":
        items = schema["prefixItems"][0] if schema.get("prefixItems") else schema.get("items", {})
        return f"{schema['maxItems']} {_takes(items)}s" if "maxItems" in schema else f"list of {_takes(items)}s"
    signs = {"minimum": ">=", "exclusiveMinimum": ">", "maximum": "<=", "exclusiveMaximum": "<"}
    bounds = [f"{sign} {schema[key]:g}" for key, sign in signs.items() if key in schema]
    kind = "path" if schema.get("format") == "path" else schema.get("type", "table")
    return ", ".join([str(kind), *bounds])


def _plain(value: Any) -> Any:
    """Returns a value in a form that JSON can hold: tuples become lists, pydantic models become dictionaries."""
    if isinstance(value, Mapping):
        return {key: _plain(item) for key, item in value.items()}
    if hasattr(value, "model_dump"):
        return value.model_dump(mode="json")
    return [_plain(item) for item in value] if isinstance(value, tuple | list) else value
