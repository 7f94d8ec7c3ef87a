"""Writes docs/scene-file.md from the classes that describe scene files, and docs/images from scenes/.

script/make-docs calls it.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from glshade.brdfs import BRDFS, Brdf
from glshade.document import Document
from glshade.lights import LIGHTS, Light
from glshade.optics.reradiation import Reradiation
from glshade.optics.spectra import Spectrum
from glshade.scene.animation import Track
from glshade.scene.camera import CAMERAS, Camera
from glshade.scene.film import Film
from glshade.scene.object import Object, Transform
from glshade.scene.quality import Quality
from glshade.scene.scene import Scene
from glshade.scene.shape import SHAPES
from glshade.textures.texture import BumpMap, DirectionMap, NormalMap, OcclusionMap, Texture

ROOT = Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs" / "scene-file.md"
# The pictures of README.md and docs/README.md: (scene, width [pixels]).
PICTURES = (
    ("gallery", 960),
    ("shading-rates", 460),
    ("ashikhmin-shirley-grid", 460),
    ("half-angle-grazing", 460),
    ("detail", 460),
    ("materials", 960),
)

INTRODUCTION = """\
# The scene file

<!-- Made by script/make-docs from the models; change those, not this. -->

A scene file is TOML, or JSON of the same structure. `glshade schema` prints its JSON schema. Paths of files are relative to the
scene file's folder. Unknown keys are errors, and so are numbers that are not finite. All faults of a file are reported at once.

A colour is three numbers, linear Rec. 709. One number stands for three equal ones. In the column "default", "required" means
that the key must be given, and "-" that it is optional; its meaning says what happens without it.

[From a scene to its picture](from-scene-to-picture.md) gives the rules that are too long for a table: vertices and texture
coordinates of the shapes, smooth normals, tangents, filtering of textures, and the sum of all light.

TOML has two ways to write a list of tables: `[[objects]]` with the keys below it, or `objects = [ { ... }, { ... } ]`, which
must stand above the first `[table]`.
"""

# (class, key) -> the text of the column "takes", for keys whose schema would give a long one.
NAMED = {
    ("Scene", "film"): "[film](#film)",
    ("Scene", "camera"): "[camera](#camera)",
    ("Scene", "materials"): "table of [materials](#materials)",
    ("Scene", "objects"): "list of [objects](#objects)",
    ("Scene", "lights"): "list of [lights](#lights)",
    ("Object", "shape"): "[shape](#shapes), or its type alone",
    ("Object", "transform"): "[transform](#transform)",
    ("Object", "material"): "name, or [material](#materials)",
    ("Scene", "cameras"): "table of [cameras](#camera)",
    ("Scene", "animation"): "list of [tracks](#animation)",
    ("Scene", "quality"): "[quality](#quality)",
    ("Object", "quality"): "[quality](#quality)",
    ("Track", "values"): "list of numbers, or of lists of numbers",
    ("Film", "background"): "3 or 4 numbers",
    ("Film", "crop"): "4 integers",
    ("Film", "ocio"): "file, or `ocio://NAME`",
    ("Film", "white"): "[spectrum](#spectra), or its name alone",
    ("Brdf", "reradiation"): "[reradiation](#reradiation), or its file alone",
    ("Spectrum", "spectrum"): "file, name, or list of pairs of numbers",
}
TABLES = {
    "Texture": "[texture](#textures)",
    "NormalMap": "[normal map](#normal-maps)",
    "BumpMap": "[bump map](#bump-maps)",
    "DirectionMap": "[direction map](#direction-maps)",
    "OcclusionMap": "[occlusion map](#occlusion-maps)",
    "Spectrum": "[spectrum](#spectra)",
    "Reradiation": "[reradiation](#reradiation), or its file alone",
}
SAID = {
    ("Scene", "film"): "size, samples, background and encoding of the picture",
    ("Scene", "camera"): "the camera; left out: a perspective view of the whole scene",
    ("Object", "transform"): "position, rotation and scale",
}


def kind(schema: Mapping[str, Any]) -> str:
    """Returns the text of the column "takes": the values that a key allows, in words."""
    if "const" in schema:
        return f'`"{schema["const"]}"`'
    if "enum" in schema:
        return ", ".join(f"`{json.dumps(value)}`" for value in schema["enum"])
    if "$ref" in schema:
        name = schema["$ref"].rsplit("/", 1)[-1]
        return TABLES.get(name, name)
    options = [option for option in schema.get("anyOf", schema.get("oneOf", ())) if option.get("type") != "null"]
    if options:
        words = [kind(option) for option in options]
        if words[0] == "number" and words[1:2] in (["2 numbers"], ["3 numbers"]):
            words[:2] = [f"{words[1]} or 1"]
        return ", or ".join(words)
    form = schema.get("type")
    if form == "array":
        items = schema.get("prefixItems", [schema.get("items", {})])
        count = schema.get("maxItems")
        if items[0].get("type") == "array":
            return f"{count} rows of {kind(items[0])}"
        if "enum" in items[0]:
            return f"{count} of these" if count else "list of names"
        words = kind(items[0])
        one, _, bounds = words.partition(" ")
        return f"{count} {one}s {bounds}".strip() if count else f"list of {words}s"
    if form == "string":
        return "file" if schema.get("format") == "path" else "string"
    word = {"integer": "integer", "number": "number", "boolean": "`true`, `false`"}[str(form)]
    return word + _bounds(schema)


def _bounds(schema: Mapping[str, Any]) -> str:
    low, high = schema.get("minimum"), schema.get("maximum")
    above, below = schema.get("exclusiveMinimum", schema.get("gt")), schema.get("exclusiveMaximum", schema.get("lt"))
    parts = []
    parts += [f"from {low:g}"] if low is not None else [f"above {above:g}"] if above is not None else []
    parts += [f"to {high:g}"] if high is not None else [f"below {below:g}"] if below is not None else []
    return (" " + " ".join(parts)) if parts else ""


def default(schema: Mapping[str, Any], key: str) -> str:
    """Returns the text of the column "default": the default as a scene file would write it."""
    if "default" not in schema:
        # The schema has no defaults that are computed. These keys have one.
        return "-" if key in {"film", "camera", "transform", "quality"} else "required"
    value = schema["default"]
    if value is None or value in ("", {}) or (isinstance(value, dict) and value):
        return "-"
    if key in {"type", "brdf"}:
        return f"`{json.dumps(value)}`" if value == "perspective" else "required"
    if isinstance(value, list) and len(value) == 3 and len(set(value)) == 1 and "prefixItems" not in schema:
        value = value[0]

    def plain(item: Any) -> Any:
        return int(item) if isinstance(item, float) and item == int(item) else item

    return f"`{json.dumps([plain(item) for item in value] if isinstance(value, list) else plain(value))}`"


def table(model: type[Document], without: type[Document] | None = None) -> str:
    """Returns the table of a class's keys. without: a base class whose keys are left out, since they have a table
    of their own.
    """
    known = set(without.model_fields) if without else set()
    rows = []
    for key, schema in model.model_json_schema()["properties"].items():
        if key in known and key not in {"type", "brdf"}:
            continue
        place = (model.__name__, key)
        meaning = SAID.get(place, schema.get("description", ""))
        takes = NAMED.get(place) or kind(schema)
        declared = schema.get("glshade")
        if declared:
            takes += _limits(declared)
            meaning = meaning.removesuffix(" [1]")
        if key in {"type", "brdf"}:
            if "const" not in schema:
                continue
            meaning = meaning or "selects this type"
        rows.append(f"| `{key}` | {takes} | {default(schema, key)} | {meaning} |")
    return "| key | takes | default | meaning |\n|---|---|---|---|\n" + "\n".join(rows) + "\n" if rows else ""


def _limits(declared: Mapping[str, Any]) -> str:
    if declared["high"] is not None:
        return f"; from {declared['low']:g} to {declared['high']:g}"
    return f"; at least {declared['low']:g}"


def about(model: type[Document]) -> str:
    """Returns the docstring of a class as one paragraph."""
    return " ".join((model.__doc__ or "").split()) + "\n"


def section(level: int, title: str, model: type[Document], without: type[Document] | None = None) -> str:
    return f"\n{'#' * level} {title}\n\n{about(model)}\n{table(model, without)}"


def scene_file() -> str:
    """Returns the text of docs/scene-file.md."""
    text = INTRODUCTION
    text += section(2, "Scene", Scene) + section(2, "Film", Film)
    text += section(2, "Camera", Camera)
    for name, model in CAMERAS.items():
        text += section(3, f"`{name}`", model, Camera)
    text += section(2, "Objects", Object) + section(3, "Transform", Transform)
    text += "\n## Shapes\n\n"
    text += 'Primitives of unit size, centred at the origin. `shape = "cube"` is short for `shape = { type = "cube" }`.\n'
    for name, model in SHAPES.items():
        text += section(3, f"`{name}`", model)
    text += section(2, "Materials", Brdf)
    for name in BRDFS:
        text += section(3, f"`{name}`", BRDFS[name], Brdf)
        text += f"\nSource: {BRDFS[name].source}.\n"
    text += section(3, "Textures", Texture) + section(3, "Normal maps", NormalMap)
    text += section(3, "Bump maps", BumpMap) + section(3, "Direction maps", DirectionMap)
    text += section(3, "Occlusion maps", OcclusionMap)
    text += section(3, "Spectra", Spectrum) + section(3, "Reradiation", Reradiation)
    text += section(2, "Lights", Light)
    for name in LIGHTS:
        text += section(3, f"`{name}`", LIGHTS[name], Light)
    text += section(2, "Quality", Quality) + section(2, "Animation", Track)
    return text.replace("\n\n\n", "\n\n")


def pictures() -> None:
    from glshade import Image, Renderer, load

    folder = ROOT / "docs" / "images"
    folder.mkdir(parents=True, exist_ok=True)
    for name, width in PICTURES:
        scene = load(ROOT / "scenes" / f"{name}.toml")
        full_width, full_height = scene.film.size
        size = (width, round(full_height * width / full_width))
        with Renderer() as renderer:
            scene = scene.model_copy(update={"film": scene.film.model_copy(update={"size": size})})
            image = renderer.render(scene)
        # Attributes would hold the driver's name, and the file would change although the picture is the same.
        Image(image.pixels, image.encoding).save(folder / f"{name}.png")


if __name__ == "__main__":
    if sys.argv[1:] == ["--check"]:
        current = PAGE.exists() and PAGE.read_text(encoding="utf-8") == scene_file()
        sys.exit(0 if current else "docs/scene-file.md is out of date: run script/make-docs")
    PAGE.write_text(scene_file(), encoding="utf-8")
    pictures()
