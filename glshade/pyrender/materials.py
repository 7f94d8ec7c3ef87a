"""Materials: converts pyrender's materials, which are of two kinds, into glshade's; both kinds become the model ggx."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any
from weakref import WeakKeyDictionary, WeakValueDictionary

import numpy as np
from pydantic import ValidationError

from glshade.brdfs import BRDFS, Brdf
from glshade.errors import SceneError
from glshade.mesh.reading import gltf_material
from glshade.mesh.reading.file import MeshFile
from glshade.pyrender.textures import has_alpha_below_one, picture
from glshade.textures.pixel_array import PixelArray
from glshade.textures.texture import Texture

Colour = tuple[float, float, float]
WHITE: Colour = (1.0, 1.0, 1.0)


@dataclass(frozen=True)
class ConvertedMaterial:
    """A converted material in the cache.

    brdf: the material.
    notes: the warnings about parts of pyrender's material that the conversion leaves out.
    state: the values that the material was converted from, as `_state` returns them.
    held: the objects that the material was converted from. `state` contains their ids. As long as the objects are held, Python
        does not reuse their ids.
    """

    brdf: Brdf
    notes: tuple[str, ...]
    state: tuple[Any, ...]
    held: tuple[Any, ...]


# primitive -> (flat, both), as `material` takes them -> the converted material
_cache: WeakKeyDictionary[Any, dict[tuple[bool, bool], ConvertedMaterial]] = WeakKeyDictionary()


def material(primitive: Any, flat: bool, both: bool) -> tuple[Brdf, tuple[str, ...]]:
    """Returns (material, warnings) of a primitive. The material is the same object in each call until the primitive changes.

    primitive: a pyrender.Primitive.
    flat: True for a material that shows its base colour, without decoding it, under an ambient light of 1 and no other light.
    both: True to draw back faces even where the material does not ask for it.
    Errors: SceneError.
    """
    cached = _cache.setdefault(primitive, {})
    held = tuple(_parts(primitive))
    state = tuple(map(_state, held))
    known = cached.get((flat, both))
    if known is None or known.state != state:
        notes: list[str] = []
        brdf = _material(primitive, flat, both, notes)
        known = cached[flat, both] = ConvertedMaterial(brdf, tuple(notes), state, held)
    return known.brdf, known.notes


def _parts(primitive: Any) -> Iterator[Any]:
    """Yields all objects that a primitive's material depends on."""
    yield primitive.color_0
    yield primitive.texcoord_0
    yield primitive.material
    for value in vars(primitive.material).values():
        yield value
        if hasattr(value, "source"):
            yield from (value.source, value.sampler.wrapS, value.sampler.wrapT)


def _state(value: Any) -> Any:
    """Returns a value that differs from the one before if the object has changed.

    Numbers and texts compare by value, small arrays by their contents, and everything else by identity.
    """
    if isinstance(value, np.ndarray) and value.size <= LARGEST_FACTOR:
        return value.tobytes()
    return value if isinstance(value, str | int | float | bool | None) else id(value)


# The warnings of the glTF reader begin with a file name, and this text takes its place.
ORIGIN = "pyrender"
# Arrays of up to this many numbers are factors of a material. A program may change them in place.
LARGEST_FACTOR = 4


def silhouette(primitive: Any, colour: Colour, both: bool) -> Brdf:
    """Returns a material that shows one colour, without lighting, except in the holes of a cut-out.

    primitive: a pyrender.Primitive.
    colour: the colour, without decoding or encoding, from 0 to 1.
    both: True to draw back faces even where the primitive's material does not ask for it.
    """
    given = primitive.material
    glossy = hasattr(given, "diffuseFactor")
    texture = getattr(given, "diffuseTexture" if glossy else "baseColorTexture", None)
    sides = "both" if both or given.doubleSided else "front"
    if given.alphaMode != "MASK":
        return _silhouette(colour, sides)
    alpha = float(np.clip((given.diffuseFactor if glossy else given.baseColorFactor)[3], 0, 1))
    plain = _silhouette(colour, sides, alpha, float(given.alphaCutoff))
    if texture is None or primitive.texcoord_0 is None:
        return plain
    holes = picture(texture, white=True)
    if holes is None:
        return plain
    wraps = tuple(gltf_material.WRAP_MODES.get(code, "repeat") for code in (texture.sampler.wrapS, texture.sampler.wrapT))
    key = plain, holes.digest, wraps
    found = _cut_out.get(key)
    if found is None:
        ka = Texture(texture=holes, factor=colour, wrap=wraps, encoding="linear")
        found = _cut_out[key] = plain.model_copy(update={"ka": ka})
    return found


# (the material without texture, the digest of the texture with the holes, its wrap modes) -> the silhouette. The values are
# weak, so that this cache does not keep textures alive that the program has deleted.
_cut_out: WeakValueDictionary[tuple[Brdf, str, tuple[Any, ...]], Brdf] = WeakValueDictionary()


# Cached, because validation is slow. A scene has as many segments as nodes, often thousands.
@lru_cache(maxsize=4096)
def _silhouette(colour: Colour, sides: str, alpha: float | None = None, cutoff: float = 0.0) -> Brdf:
    """Returns the material of a silhouette without texture.

    alpha: the factor of the alpha of a cut-out; None for a material that is no cut-out.
    """
    keys: dict[str, Any] = {"brdf": "ambient", "ka": colour, "sides": sides}
    if alpha is not None:
        keys |= {"alpha": alpha, "alpha_mode": "mask", "alpha_cutoff": cutoff}
    return BRDFS["ambient"].model_validate(keys)


def _material(primitive: Any, flat: bool, both: bool, notes: list[str]) -> Brdf:
    """Converts a primitive's material into a glTF material, which has the same keys, and that into glshade's.

    notes: a list to which the warnings are added.
    """
    given = primitive.material
    name = given.name or ""
    header: dict[str, list[Any]] = {"textures": [], "samplers": [], "images": []}
    pictures: list[PixelArray] = []

    def texture(slot: str) -> dict[str, Any] | None:
        """Returns glTF's textureInfo for a texture of the material; None if the texture or the coordinates are missing."""
        source = getattr(given, slot, None)
        found = picture(source) if source is not None and primitive.texcoord_0 is not None else None
        if source is None or found is None:
            return None
        index = len(pictures)
        pictures.append(found)
        header["textures"].append({"source": index, "sampler": index})
        header["samplers"].append({"wrapS": source.sampler.wrapS, "wrapT": source.sampler.wrapT})
        header["images"].append({"uri": str(index)})
        return {"index": index}

    table: dict[str, Any] = {"name": name, "alphaMode": given.alphaMode, "alphaCutoff": given.alphaCutoff}
    glossy = hasattr(given, "diffuseFactor")
    base, picture_of = ("diffuseFactor", "diffuseTexture") if glossy else ("baseColorFactor", "baseColorTexture")
    factor = np.clip(np.asarray(getattr(given, base), dtype=np.float64), 0, 1)
    if given.alphaMode == "BLEND" and not _is_transparent(factor[3], getattr(given, picture_of), primitive):
        # pyrender marks every material that comes from trimesh as blended. Those without transparent parts are drawn as opaque.
        table["alphaMode"] = "OPAQUE"
    if flat or not glossy:
        info = {"baseColorFactor": factor.tolist(), "baseColorTexture": texture(picture_of)}
        packed = {} if flat else {"metallicRoughnessTexture": texture("metallicRoughnessTexture")}
        numbers = {} if flat else {"metallicFactor": given.metallicFactor, "roughnessFactor": given.roughnessFactor}
        table["pbrMetallicRoughness"] = {**info, **packed, **numbers}
    else:
        specular = np.clip(np.asarray(given.specularFactor, dtype=np.float64), 0, 1).tolist()
        specular_glossiness: dict[str, Any] = {
            "diffuseFactor": factor.tolist(),
            "diffuseTexture": texture(picture_of),
            "specularFactor": specular,
            # In pyrender 0.1.45 the property `glossinessFactor` calls itself without end, so its private field is read instead.
            "glossinessFactor": given._glossinessFactor,
            "specularGlossinessTexture": texture("specularGlossinessTexture"),
        }
        table["extensions"] = {"KHR_materials_pbrSpecularGlossiness": specular_glossiness}
    if not flat:
        # pyrender's shader multiplies the emission by this factor twice.
        table["emissiveFactor"] = (np.clip(np.asarray(given.emissiveFactor, dtype=np.float64), 0, 1) ** 2).tolist()
        maps = {slot: texture(slot) for slot in ("normalTexture", "emissiveTexture", "occlusionTexture")}
        table |= {slot: info for slot, info in maps.items() if info is not None}
    file = _PictureList(Path(ORIGIN), Path(), b"")
    keys = gltf_material.material(file, header, [], table)
    # The callers add the prefix again when they give the warnings.
    notes.extend(note.removeprefix(f"{ORIGIN}: ") for note in file.contents.warnings)
    for value in keys.values():
        if isinstance(value, dict):
            value["texture"] = pictures[int(value["texture"])]
    return _modelled(keys, flat, both or given.doubleSided)


class _PictureList(MeshFile):
    """A stand-in for a glTF file whose pictures are in a list. The names of its pictures are their numbers in the list."""

    def texture(self, name: str) -> str:
        """Returns the name of a picture, which is no file."""
        return name


def _is_transparent(alpha: float, texture: Any, primitive: Any) -> bool:
    """Returns whether any part of the surface has an alpha below 1 by the material's factor, vertex colours or texture."""
    colours = primitive.color_0
    textured = texture is not None and texture.source is not None and primitive.texcoord_0 is not None
    return bool(
        alpha < 1
        or (colours is not None and colours.shape[1] == 4 and (colours[:, 3] < 1).any())
        or (textured and has_alpha_below_one(texture.source))
    )


def _modelled(keys: dict[str, Any], flat: bool, both: bool) -> Brdf:
    """Returns the material of a table that the glTF reader has made. Errors: SceneError."""
    keys["sides"] = "both" if both else "front"
    if isinstance(keys.get("roughness"), dict):
        # glTF stores roughness in green and metallicity in blue. pyrender uploads these two channels as red and green. Its
        # shader reads red and green even from a texture whose channels were not moved.
        keys["roughness"]["channel"] = "r"
    if isinstance(keys.get("metallic"), dict):
        keys["metallic"]["channel"] = "g"
    if flat:
        base = keys["kd"]
        # pyrender shows unlit base colours without decoding them.
        base = {**base, "encoding": "linear"} if isinstance(base, dict) else base
        kept: set[str] = {"alpha", "alpha_mode", "alpha_cutoff", "sides"} & set(keys)
        keys = {"brdf": "ambient", "ka": base, **{name: keys[name] for name in kept}}
    try:
        return BRDFS[keys["brdf"]].model_validate(keys)
    except ValidationError as error:
        faults = error.errors(include_url=False)
        raise SceneError([f"{'.'.join(map(str, fault['loc']))}: {fault['msg']}" for fault in faults]) from None
