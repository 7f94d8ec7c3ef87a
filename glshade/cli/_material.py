"""Material: materials named on the command line, as a model, a preset or a material of a scene, with changed parameters.

Examples: phong, phong:exponent=100, gold:roughness=0.1, plastic:kd=0.6,0.1,0.05,ior=1.6, scene.toml:red:ks=0.5
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from glshade.brdfs import Brdf

HINT = "'MATERIAL'"
_IN_A_FILE = re.compile(r"(?P<file>.+?\.(?:toml|json))(?::(?P<name>[^:=]*))?(?::(?P<changes>.*))?", re.IGNORECASE)


def materials(texts: Sequence[str], everywhere: Sequence[str] = ()) -> dict[str, Brdf]:
    """Returns label -> material for the materials that texts name. Keys of the surface, such as alpha, are dropped.

    texts: materials as on the command line
    everywhere: NAME=VALUE texts that apply to all materials
    Errors: click.BadParameter, also for a parameter that is a texture; SceneError.
    """
    common = changes(everywhere, "'--parameter'")
    return {label: material for text in texts for label, material in _named(text, common)}


def changes(pieces: Iterable[str], hint: str = HINT) -> dict[str, Any]:
    """Returns changed parameters: `kd=0.6,0.1,0.05,ior=1.6` gives {"kd": [0.6, 0.1, 0.05], "ior": 1.6}.

    A part between commas without an = belongs to the value before it.
    pieces: the texts
    hint: name of the command's parameter, for error messages
    Errors: click.BadParameter.
    """
    values: dict[str, list[str]] = {}
    for text in pieces:
        name = None
        for piece in text.split(","):
            key, equals, value = piece.partition("=")
            if equals:
                name = key.strip()
                values[name] = [value.strip().lstrip("[")]
            elif name is None:
                raise click.BadParameter(f"{text!r} must be NAME=VALUE, as in exponent=100 or kd=0.6,0.1,0.05", param_hint=hint)
            else:
                values[name].append(piece.strip().rstrip("]"))
    return {name: _value(texts) for name, texts in values.items()}


def _value(texts: list[str]) -> Any:
    """Returns one value for one text, and a list of values for several; a text is a number where it can be one."""
    values = [_number(text) for text in texts]
    return values[0] if len(values) == 1 else values


def _number(text: str) -> float | str:
    try:
        return float(text)
    except ValueError:
        return text


def _named(text: str, common: Mapping[str, Any]) -> Iterable[tuple[str, Brdf]]:
    """Yields (label, material) for each material that a text names.

    text: the text of the command line
    common: changes for all materials; changes in the text override them
    """
    from glshade.brdfs import BRDFS
    from glshade.document import nearest
    from glshade.presets import PRESETS, preset

    match = _IN_A_FILE.fullmatch(text)
    if match:
        own = changes([match["changes"]]) if match["changes"] else {}
        for name, material in _of_a_scene(text, match["file"], match["name"]):
            table = {key: getattr(material, key) for key in material.model_fields_set}
            yield _label(name, own), _validated(f"{match['file']}:{name}", type(material), {**table, **common, **own})
        return
    name, _, rest = text.partition(":")
    own = changes([rest]) if rest else {}
    if name in BRDFS:
        yield _label(name, own), _validated(text, BRDFS[name], {**common, **own})
    elif name in PRESETS:
        table = preset(name)
        yield _label(name, own), _validated(text, BRDFS[table["brdf"]], {**table, **common, **own})
    else:
        known = nearest(name, [*BRDFS, *PRESETS])
        raise click.BadParameter(f"no model or preset is named {name!r}{known}", param_hint=HINT)


def _of_a_scene(text: str, file: str, name: str | None) -> list[tuple[str, Brdf]]:
    """Returns (name, material) for each material of a scene file that is selected.

    text: the text of the command line, for error messages
    file: path of the scene file
    name: name of a material or of an object; None or "" selects all materials of the scene's table
    Errors: click.BadParameter, SceneError.
    """
    from glshade.document import nearest
    from glshade.scene.file import load

    scene = load(file)
    known: dict[str, Brdf] = {
        item.name: material for item in scene.objects if item.name and not isinstance(material := item.material, str | None)
    }
    known.update(scene.materials)
    if not name:
        if not scene.materials:
            raise click.BadParameter(f"{text}: the scene names no materials{nearest('', known)}", param_hint=HINT)
        return list(scene.materials.items())
    if name not in known:
        raise click.BadParameter(f"{file}: no material is named {name!r}{nearest(name, known)}", param_hint=HINT)
    return [(name, known[name])]


def _label(name: str, own: Mapping[str, Any]) -> str:
    """Returns a material's name followed by the parameters that were changed."""

    def words(value: Any) -> str:
        values = value if isinstance(value, list) else [value]
        return ", ".join(f"{v:g}" if isinstance(v, float) else v for v in values)

    return " ".join([name, *(f"{key} {words(value)}" for key, value in own.items())])


def _validated(text: str, model: type[Brdf], table: Mapping[str, Any]) -> Brdf:
    """Returns the material of a model with these parameters.

    text: the text of the command line, for error messages
    model: class of the reflectance model
    table: parameters and options; keys of the surface are dropped
    Errors: click.BadParameter for an unknown key, a value that is not allowed, or a texture.
    """
    from pydantic import ValidationError

    from glshade.document import nearest
    from glshade.glsl.uniforms import parameter_values
    from glshade.textures.texture import Texture

    # Apart from its parameters and options, a material has keys for its surface, such as alpha, sides and a normal map.
    names = {*model.parameters(), *model.choices()}
    surface = set(model.model_fields) - names
    for name in table:
        if name not in names | surface:
            brdf = model.model_fields["brdf"].default
            raise click.BadParameter(f"{text}: {brdf} has no {name!r}{nearest(name, names)}", param_hint=HINT)
    try:
        material = model.model_validate({name: value for name, value in table.items() if name in names})
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        place = ".".join(str(part) for part in first["loc"][:1])
        raise click.BadParameter(f"{text}: {place} {first['msg']}", param_hint=HINT) from None
    for name, value in parameter_values(material).items():
        if isinstance(value, Texture):
            raise click.BadParameter(
                f"{text}: {name} is a texture; give a number in its place, as in {text}:{name}=0.5", param_hint=HINT
            )
    return material
