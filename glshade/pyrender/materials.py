"""Materials of pyrender, as models of glshade: metallic-roughness is ggx."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any
from urllib.parse import quote
from weakref import WeakKeyDictionary

import numpy as np
from pydantic import ValidationError

from glshade.brdfs import BRDFS, Brdf
from glshade.errors import SceneError
from glshade.mesh.formats import gltf_material
from glshade.mesh.formats.file import File
from glshade.pyrender.textures import picture, rgba

Colour = tuple[float, float, float]
WHITE: Colour = (1.0, 1.0, 1.0)


@dataclass(frozen=True)
class Made:
    """What was made of a material, with what it leaves out. state: of what it was made; held keeps that alive."""

    brdf: Brdf
    notes: tuple[str, ...]
    state: tuple[Any, ...]
    held: tuple[Any, ...]


_made: WeakKeyDictionary[Any, dict[tuple[bool, bool], Made]] = WeakKeyDictionary()


def material(primitive: Any, flat: bool, both: bool) -> tuple[Brdf, tuple[str, ...]]:
    """The material of a primitive, and what is left out of it; the same object while nothing has changed.

    flat: base colours as they are, for ambient light of 1. both: back faces are drawn too. Errors: SceneError.
    """
    kept = _made.setdefault(primitive, {})
    held = tuple(_parts(primitive))
    state = tuple(map(_state, held))
    known = kept.get((flat, both))
    if known is None or known.state != state:
        notes: list[str] = []
        brdf = _material(primitive, flat, both, notes)
        known = kept[flat, both] = Made(brdf, tuple(notes), state, held)
    return known.brdf, known.notes


def _parts(primitive: Any) -> Iterator[Any]:
    """All that a material is made of."""
    yield primitive.color_0
    yield primitive.texcoord_0
    yield primitive.material
    for value in vars(primitive.material).values():
        yield value
        if hasattr(value, "source"):
            yield from (value.source, value.sampler.wrapS, value.sampler.wrapT)


def _state(value: Any) -> Any:
    """Small arrays by what is in them, numbers and words as they are, all else by which object it is."""
    if isinstance(value, np.ndarray) and value.size <= LARGEST_FACTOR:
        return value.tobytes()
    return value if isinstance(value, str | int | float | bool | None) else id(value)


# What notes on materials begin with, as those of a file begin with its path.
ORIGIN = "pyrender"
# Factors have up to 4 numbers, and may be changed in place.
LARGEST_FACTOR = 4


def silhouette(primitive: Any, colour: Colour, both: bool) -> Brdf:
    """One colour, as it is; a cut-out keeps its holes."""
    given = primitive.material
    glossy = hasattr(given, "diffuseFactor")
    texture = getattr(given, "diffuseTexture" if glossy else "baseColorTexture", None)
    sides = "both" if both or given.doubleSided else "front"
    if given.alphaMode != "MASK":
        return _silhouette(colour, sides)
    path = picture(texture, white=True) if texture is not None and primitive.texcoord_0 is not None else None
    wraps = (texture.sampler.wrapS, texture.sampler.wrapT) if texture is not None else ()
    alpha = float(np.clip((given.diffuseFactor if glossy else given.baseColorFactor)[3], 0, 1))
    return _silhouette(colour, sides, alpha, float(given.alphaCutoff), path, wraps)


# Segments are as many as there are nodes.
@lru_cache(maxsize=4096)
def _silhouette(
    colour: Colour,
    sides: str,
    alpha: float | None = None,
    cutoff: float = 0.0,
    holes: Path | None = None,
    wraps: tuple[int, ...] = (),
) -> Brdf:
    keys: dict[str, Any] = {"brdf": "ambient", "ka": colour, "sides": sides}
    if holes is not None:
        wrap = [gltf_material._WRAP.get(code, "repeat") for code in wraps]
        keys["ka"] = {"texture": str(holes), "factor": colour, "wrap": wrap, "encoding": "linear"}
    if alpha is not None:
        keys |= {"alpha": alpha, "alpha_mode": "mask", "alpha_cutoff": cutoff}
    return BRDFS["ambient"].model_validate(keys)


def _material(primitive: Any, flat: bool, both: bool, said: list[str]) -> Brdf:
    """pyrender's materials are glTF's, key by key."""
    given = primitive.material
    name = given.name or ""
    header: dict[str, list[Any]] = {"textures": [], "samplers": [], "images": []}

    def texture(slot: str) -> dict[str, Any] | None:
        """glTF's textureInfo of one of the material's textures."""
        found = getattr(given, slot, None)
        path = picture(found) if found is not None and primitive.texcoord_0 is not None else None
        if found is None or path is None:
            return None
        index = len(header["textures"])
        header["textures"].append({"source": index, "sampler": index})
        header["samplers"].append({"wrapS": found.sampler.wrapS, "wrapT": found.sampler.wrapT})
        header["images"].append({"uri": quote(str(path))})
        return {"index": index}

    table: dict[str, Any] = {"name": name, "alphaMode": given.alphaMode, "alphaCutoff": given.alphaCutoff}
    glossy = hasattr(given, "diffuseFactor")
    base, picture_of = ("diffuseFactor", "diffuseTexture") if glossy else ("baseColorFactor", "baseColorTexture")
    factor = np.clip(np.asarray(getattr(given, base), dtype=np.float64), 0, 1)
    if given.alphaMode == "BLEND" and not _seen_through(factor[3], getattr(given, picture_of), primitive):
        # pyrender blends whatever it makes of a trimesh; what cannot be seen through is drawn as what it is.
        table["alphaMode"] = "OPAQUE"
    if flat or not glossy:
        info = {"baseColorFactor": factor.tolist(), "baseColorTexture": texture(picture_of)}
        # The texture's first two channels, wherever they came from, as in pyrender's shader.
        packed = {} if flat else {"metallicRoughnessTexture": texture("metallicRoughnessTexture")}
        numbers = {} if flat else {"metallicFactor": given.metallicFactor, "roughnessFactor": given.roughnessFactor}
        table["pbrMetallicRoughness"] = {**info, **packed, **numbers}
    else:
        specular = np.clip(np.asarray(given.specularFactor, dtype=np.float64), 0, 1).tolist()
        old: dict[str, Any] = {"diffuseFactor": factor.tolist(), "diffuseTexture": texture(picture_of)}
        # The property calls itself without end in pyrender 0.1.45.
        old |= {"specularFactor": specular, "glossinessFactor": given._glossinessFactor}
        if given.specularGlossinessTexture is not None:
            old["specularGlossinessTexture"] = {}
        table["extensions"] = {"KHR_materials_pbrSpecularGlossiness": old}
    if not flat:
        table["emissiveFactor"] = np.asarray(given.emissiveFactor).tolist()
        normals = texture("normalTexture")
        table |= {"normalTexture": normals} if normals else {}
        if given.occlusionTexture is not None:
            table["occlusionTexture"] = {}
    return _modelled(table, header, flat, both or given.doubleSided, said)


def _seen_through(alpha: float, texture: Any, primitive: Any) -> bool:
    """Whether any of the surface lets light through."""
    colours = primitive.color_0
    textured = texture is not None and texture.source is not None and primitive.texcoord_0 is not None
    return bool(
        alpha < 1
        or (colours is not None and colours.shape[1] == 4 and (colours[:, 3] < 1).any())
        or (textured and (rgba(texture.source)[..., 3] < 255).any())
    )


def _modelled(table: dict[str, Any], header: dict[str, Any], flat: bool, both: bool, said: list[str]) -> Brdf:
    """The model of a glTF material. Errors: SceneError."""
    notes = File(Path(ORIGIN), Path("/"), b"")
    keys = gltf_material.material(notes, header, [], table)
    keys["sides"] = "both" if both else "front"
    # Who shows them says where they are from.
    said.extend(note.removeprefix(f"{ORIGIN}: ") for note in notes.contents.warnings)
    if isinstance(keys.get("roughness"), dict):
        # pyrender's shader reads roughness from red and metallic from green: it has put glTF's green and blue there.
        keys["roughness"]["channel"] = "r"
    if isinstance(keys.get("metallic"), dict):
        keys["metallic"]["channel"] = "g"
    if flat:
        base = keys["kd"]
        # Unlit base colours are shown as they are, without decoding.
        base = {**base, "encoding": "linear"} if isinstance(base, dict) else base
        kept: set[str] = {"alpha", "alpha_mode", "alpha_cutoff", "sides"} & set(keys)
        keys = {"brdf": "ambient", "ka": base, **{name: keys[name] for name in kept}}
    try:
        return BRDFS[keys["brdf"]].model_validate(keys)
    except ValidationError as error:
        faults = error.errors(include_url=False)
        raise SceneError([f"{'.'.join(map(str, fault['loc']))}: {fault['msg']}" for fault in faults]) from None
