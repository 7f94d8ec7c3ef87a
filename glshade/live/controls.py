"""Controls: the values of a scene that a page can change, each with its type, range, bounds and `--set` key, as JSON types."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from types import UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pydantic.fields import FieldInfo

from glshade.brdfs import BRDFS, EMISSION, Brdf
from glshade.document import Document
from glshade.optics.spectra import Spectrum
from glshade.presets import PRESETS
from glshade.scene.object import Object
from glshade.scene.override import dotted
from glshade.scene.scene import Scene
from glshade.textures.texture import Texture

Table = dict[str, Any]
Bounds = tuple[float | None, float | None]
# Keys that name things or that only a program can fill in. A page does not offer them.
HIDDEN = frozenset({"type", "name", "only", "matrix", "fit", "brdf", "crop", "view", "display", "ocio", "size", "source"})
# Values that a key has while it is left out.
LEFT_OUT: Mapping[str, Any] = {"normalise": True, "subdivide": 0}
# The keys of an object that a page offers beside its material.
OF_OBJECT = ("shading", "normals", "threshold", "sides", "vertex_colours")
# Ranges for a slider of keys whose bounds are too wide for one, or that have none.
USUAL: Mapping[str, tuple[float, float]] = {
    "rotate": (-180.0, 180.0),
    "turn": (-180.0, 180.0),
    "exposure": (-8.0, 8.0),
    "supersample": (1, 4),
}
# A slider has about this many steps.
STEPS = 200


def controls_of(scene: Scene) -> Table:
    """Returns the values of a scene that a page can change: {"groups": [...]}.

    A group is a table with "section", "title", "key" (the part that all keys of its fields start with) and "fields".
    A field is a table with "key" (as for `--set`), "label", "kind", "value", "description" and, where they make sense, "usual"
    (the range of a slider), "bounds" (null stands for no bound), "step", "whole" (whether it takes whole numbers only), "unit"
    and "choices".
    """
    groups = [*_objects(scene), *_materials(scene), *_lights(scene)]
    groups.append(_group("camera", "camera", "camera", _fields("camera", scene.camera)))
    groups.append(_group("quality", "quality", "quality", _fields("quality", scene.quality)))
    groups.append(_group("film", "film", "film", _fields("film", scene.film)))
    return {"groups": [group for group in groups if group["fields"]]}


def object_key(index: int) -> str:
    """Returns the part that all keys of an object's values start with."""
    return f"objects.{index}"


def material_key(item: Object, index: int) -> str | None:
    """Returns the part that all keys of an object's material start with; None where the object names no material."""
    if isinstance(item.material, str):
        return dotted(("materials", item.material))
    return None if item.material is None else f"{object_key(index)}.material"


def _group(section: str, title: str, key: str, fields: Iterator[Table]) -> Table:
    return {"section": section, "title": title, "key": key, "fields": list(fields)}


def _objects(scene: Scene) -> Iterator[Table]:
    """Yields a group for each object: its rate, its material and its transform."""
    names = [*scene.materials, *(name for name in PRESETS if name not in scene.materials)]
    for index, item in enumerate(scene.objects):
        key = object_key(index)
        named = item.material if isinstance(item.material, str) else None
        material = {
            **_named(f"{key}.material", "material", "choice", named, "name of a material or of a preset"),
            "choices": names,
        }
        fields = [field for name in OF_OBJECT for field in _field(key, name, Object.model_fields[name], getattr(item, name))]
        transform = [] if item.transform.matrix else list(_fields(f"{key}.transform", item.transform))
        title = item.name or f"objects[{index}]"
        yield _group("object", title, key, iter([*fields[:1], material, *fields[1:], *transform]))


def _materials(scene: Scene) -> Iterator[Table]:
    """Yields a group for each material: its model and the parameters of the model."""
    named = [(dotted(("materials", name)), name, material) for name, material in scene.materials.items()]
    own = [
        (f"{object_key(index)}.material", item.name or f"objects[{index}]", item.material)
        for index, item in enumerate(scene.objects)
        if isinstance(item.material, Brdf)
    ]
    for key, name, material in (*named, *own):
        model = {
            **_named(
                key, "model", "choice", {"brdf": material.brdf}, "reflectance model; the others start with their defaults"
            ),
            "choices": [{"label": brdf, "value": {"brdf": brdf}} for brdf in BRDFS],
        }
        yield _group("material", name, key, iter([model, *_parameters(key, material), *_fields(key, material)]))


def _parameters(key: str, material: Brdf) -> Iterator[Table]:
    """Yields a field for each parameter of a material's model, and for emission. A texture can be multiplied by a factor."""
    for name, declared in {**material.parameters(), "emission": EMISSION}.items():
        value = getattr(material, name)
        if value is None and declared.same_as:
            value = getattr(material, declared.same_as)
            if isinstance(value, Texture):
                # The texture is offered under its own parameter.
                continue
        if isinstance(value, Texture):
            factor = _named(f"{key}.{name}.factor", f"{name} (factor)", "colour", list(value.factor), declared.description)
            yield {**factor, "usual": [0.0, 1.0], "bounds": [None, None], "step": 0.01}
            continue
        if isinstance(value, Spectrum):
            continue
        kind = "colour" if material.is_colour(name) else "number"
        field = _named(f"{key}.{name}", name, kind, _plain(value), declared.description)
        yield {**field, **_range(declared.usual, (declared.low, declared.high)), "unit": declared.unit}


def _lights(scene: Scene) -> Iterator[Table]:
    """Yields a group for each light that the scene lists."""
    for index, light in enumerate(scene.lights or ()):
        key = f"lights.{index}"
        yield _group("light", light.name or f"{light.type} {index}", key, _fields(key, light))


def _fields(key: str, document: Document) -> Iterator[Table]:
    """Yields a field for each value of a table that a page can change. A material's parameters and emission are left out."""
    parameters = {*document.parameters(), "emission"} if isinstance(document, Brdf) else set()
    for name, info in type(document).model_fields.items():
        if name not in HIDDEN and name not in parameters:
            yield from _field(key, name, info, getattr(document, name))


def _field(key: str, name: str, info: FieldInfo, value: Any) -> Iterator[Table]:
    """Yields the field of one value; nothing where a page cannot change it."""
    annotation, bounds, open_ends = _type(info.annotation, list(info.metadata))
    value = LEFT_OUT.get(name) if value is None else value
    described = info.description or ""
    if get_origin(annotation) is Literal:
        field = _named(f"{key}.{name}", name, "choice", _plain(value), described)
        yield {**field, "choices": list(get_args(annotation))}
    elif annotation is bool and value is not None:
        yield _named(f"{key}.{name}", name, "boolean", value, described)
    elif annotation in (int, float) and isinstance(value, int | float):
        field = _named(f"{key}.{name}", name, "number", value, described)
        usual = USUAL.get(name) or _usual([value], bounds)
        yield {**field, **_range(_inside(usual, bounds, open_ends), bounds, whole=annotation is int)}
    elif get_origin(annotation) is tuple and _is_vector(value):
        kind = "colour" if name in ("colour", "background") and len(value) == 3 else "vector"
        usual = (0.0, 1.0) if kind == "colour" else USUAL.get(name) or _usual(value, bounds)
        yield {**_named(f"{key}.{name}", name, kind, _plain(value), described), **_range(usual, bounds)}


def _named(key: str, label: str, kind: str, value: Any, description: str) -> Table:
    return {"key": key, "label": label.replace("_", " "), "kind": kind, "value": value, "description": description}


def _range(usual: tuple[float, float], bounds: Bounds, whole: bool = False) -> Table:
    """Returns the keys "usual", "bounds", "step" and "whole" of a field. whole: whether its value is a whole number."""
    width = usual[1] - usual[0]
    step = 1 if whole else 10.0 ** math.floor(math.log10(width / STEPS)) if width > 0 else 0.01
    return {"usual": list(usual), "bounds": list(bounds), "step": step, "whole": whole}


def _usual(values: Any, bounds: Bounds) -> tuple[float, float]:
    """Returns a range for a slider where none is declared: the bounds, or else a range round the values."""
    low, high = bounds
    reach = max(1.0, *(2 * abs(float(value)) for value in values))
    least = -reach if min(values) < 0 or len(values) > 1 else 0.0
    return (least if low is None else low, reach if high is None else high)


def _inside(usual: tuple[float, float], bounds: Bounds, open_ends: tuple[bool, bool]) -> tuple[float, float]:
    """Returns a range for a slider without those of its ends that are bounds which the value must not reach."""
    step = (usual[1] - usual[0]) / STEPS
    low = usual[0] + step if open_ends[0] and usual[0] == bounds[0] else usual[0]
    return low, usual[1] - step if open_ends[1] and usual[1] == bounds[1] else usual[1]


def _type(annotation: Any, metadata: list[Any]) -> tuple[Any, Bounds, tuple[bool, bool]]:
    """Returns a type without its annotations and without None, the bounds of its numbers, and which of them it excludes."""
    while True:
        origin = get_origin(annotation)
        if origin is Annotated:
            annotation, *more = get_args(annotation)
            metadata += [part for each in more for part in (each.metadata if isinstance(each, FieldInfo) else [each])]
        elif origin in (Union, UnionType):
            # A spectrum is a table, and its colour has no field of its own.
            kinds = [kind for kind in get_args(annotation) if kind is not type(None) and not _is_spectrum(kind)]
            if len(kinds) != 1:
                return None, (None, None), (False, False)
            annotation = kinds[0]
        else:
            break

    found = {name: float(getattr(part, name)) for part in metadata for name in ("ge", "gt", "le", "lt") if hasattr(part, name)}
    bounds = found.get("ge", found.get("gt")), found.get("le", found.get("lt"))
    return annotation, bounds, ("gt" in found, "lt" in found)


def _is_spectrum(annotation: Any) -> bool:
    """Returns whether a type is that of a spectrum, with or without annotations."""
    return (get_args(annotation)[0] if get_origin(annotation) is Annotated else annotation) is Spectrum


def _is_vector(value: Any) -> bool:
    return isinstance(value, tuple) and len(value) in (3, 4) and all(isinstance(part, int | float) for part in value)


def _plain(value: Any) -> Any:
    """Returns a value as JSON types."""
    return list(value) if isinstance(value, tuple) else value
