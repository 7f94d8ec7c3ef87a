"""glTF material: converts a material of a glTF file into a material table of a scene file."""

from __future__ import annotations

import base64
import math
from typing import Any
from urllib.parse import unquote

from glshade.mesh.reading.contents import EMBEDDED, Material
from glshade.mesh.reading.file import MeshFile

# The size of the embedded pictures, in sizes of the file and its buffers.
LARGEST_EMBEDDED = 4
# OpenGL's number of a wrap mode -> its name in a scene file.
WRAP_MODES = {33071: "clamp", 33648: "mirror", 10497: "repeat"}


def _base(material: dict[str, Any]) -> tuple[list[float], dict[str, Any] | None]:
    """Returns the factor (linear RGBA) and the optional texture of the base colour."""
    old = material.get("extensions", {}).get("KHR_materials_pbrSpecularGlossiness")
    if old is not None and "pbrMetallicRoughness" not in material:
        return old.get("diffuseFactor", [1.0] * 4), old.get("diffuseTexture")
    pbr = material.get("pbrMetallicRoughness", {})
    return pbr.get("baseColorFactor", [1.0] * 4), pbr.get("baseColorTexture")


def uv_set(header: dict[str, Any], primitive: dict[str, Any]) -> int:
    """Returns the number n of the attribute TEXCOORD_n that a primitive's material reads. The mesh gets only these uvs."""
    return _coordinates(header["materials"][primitive["material"]]) if "material" in primitive else 0


def _coordinates(material: dict[str, Any]) -> int:
    """Returns the set of uvs of the material's first texture. Textures that read another set are not used."""
    packed = material.get("pbrMetallicRoughness", {}).get("metallicRoughnessTexture")
    first = next((info for info in (_base(material)[1], packed, material.get("normalTexture")) if info), {})
    return int(first.get("texCoord", 0))


# The extensions of a material that this module reads, completely or in part.
_READ = {
    "KHR_materials_anisotropy",
    "KHR_materials_ior",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_specular",
}


def material(file: MeshFile, header: dict[str, Any], buffers: list[bytes], given: dict[str, Any]) -> Material:
    """Returns a glTF material as a material table of a scene file. Its model is ggx, which has the formulas of the glTF
    specification.

    header: the JSON of the file.
    buffers: the bytes of its buffers, for embedded pictures.
    given: the JSON of the material.
    """
    factor, texture = _base(given)
    rgb = [float(x) for x in factor[:3]]
    coordinates = _coordinates(given)

    def picture(info: dict[str, Any] | None, what: str, **keys: Any) -> Material | None:
        """Returns the table of a texture with these keys; None where there is no texture, or none that can be drawn."""
        if info is not None and info.get("texCoord", 0) != coordinates:
            file.warn(f"{what} uses other texture coordinates than the base colour; drawn without it")
            return None
        found = _texture(file, header, buffers, info)
        return {"texture": found[0], "wrap": found[1], **keys} if found else None

    def number(value: float, info: dict[str, Any] | None, channel: str) -> Any:
        """Returns a parameter of the material: a table if it has a texture and a factor other than 0, otherwise a number."""
        return (picture(info, "metallic roughness", factor=value, channel=channel) if value else None) or value

    extensions = given.get("extensions", {})
    pbr = given.get("pbrMetallicRoughness", {})
    packed = pbr.get("metallicRoughnessTexture")
    old = extensions.get("KHR_materials_pbrSpecularGlossiness")
    f0: Any = None
    if old is not None and "pbrMetallicRoughness" not in given:
        f0 = [float(x) for x in old.get("specularFactor", [1.0] * 3)]
        metallic: Any = 0.0
        roughness: Any = 1.0 - float(old.get("glossinessFactor", 1.0))
        rgb = [x * (1 - max(f0)) for x in rgb]
        if "specularGlossinessTexture" in old:
            file.warn("a texture of KHR_materials_pbrSpecularGlossiness is not used")
    else:
        metallic = number(float(pbr.get("metallicFactor", 1.0)), packed, "b")
        roughness = number(float(pbr.get("roughnessFactor", 1.0)), packed, "g")
        f0 = _f0(file, extensions, picture)
    result: Material = {"brdf": "ggx", "kd": picture(texture, "the base colour", factor=rgb) or rgb}
    result |= {"metallic": metallic, "roughness": roughness} | ({} if f0 is None else {"f0": f0})
    anisotropy = extensions.get("KHR_materials_anisotropy", {})
    if anisotropy.get("anisotropyStrength", 0.0):
        result |= _brushed(file, anisotropy, roughness, picture)
    mode = given.get("alphaMode", "OPAQUE")
    if mode in ("MASK", "BLEND"):
        result |= {"alpha": float(factor[3]), "alpha_mode": mode.lower()}
        if mode == "MASK":
            result["alpha_cutoff"] = float(given.get("alphaCutoff", 0.5))
    normal = given.get("normalTexture", {})
    bumps = picture(given.get("normalTexture"), "a normal map", scale=float(normal.get("scale", 1.0)))
    if bumps:
        result["normal_map"] = bumps
    if given.get("doubleSided", False):
        result["sides"] = "both"
    elif "alpha_mode" in result:
        # glTF culls back faces, which would show through a transparent surface. Opaque surfaces keep the default "auto", which
        # culls the back faces of solid meshes.
        result["sides"] = "front"
    unused = sorted(set(extensions) - _READ)
    if any(given.get("emissiveFactor", ())):
        unused.append("emission")
    if "occlusionTexture" in given:
        unused.append("ambient occlusion")
    if unused:
        file.warn(f"material '{given.get('name', '')}': {', '.join(unused)} not used")
    return result


def _f0(file: MeshFile, extensions: dict[str, Any], picture: Any) -> Any:
    """Returns the reflectance at normal incidence from KHR_materials_ior and KHR_materials_specular; None without them."""
    given = extensions.get("KHR_materials_specular", {})
    if not given and "KHR_materials_ior" not in extensions:
        return None
    # An ior of 0 stands for infinity.
    ior = float(extensions.get("KHR_materials_ior", {}).get("ior", 1.5))
    normal = ((ior - 1) / (ior + 1)) ** 2
    strength = float(given.get("specularFactor", 1.0))
    if strength != 1 or "specularTexture" in given:
        file.warn("the strength of KHR_materials_specular is used at normal incidence alone, and not from a texture")
    f0 = [min(normal * float(x), 1.0) * strength for x in given.get("specularColorFactor", [1.0] * 3)]
    return picture(given.get("specularColorTexture"), "specular colour", factor=f0) or f0


def _brushed(file: MeshFile, given: dict[str, Any], roughness: Any, picture: Any) -> Material:
    """Returns the parameters of ggx for KHR_materials_anisotropy.

    In the extension a strength s widens the lobe along the tangent from alpha, the square of the roughness, to
    mix(alpha, 1, s^2). ggx computes its two widths from their mean and from their ratio, 1 - 0.9 anisotropy.
    """
    textured = isinstance(roughness, dict)
    nominal = roughness["factor"] if textured else roughness
    # The shaders use the same least width of a lobe.
    narrow = max(nominal, 0.01) ** 2
    wide = narrow + (1 - narrow) * float(given["anisotropyStrength"]) ** 2
    anisotropy = min((1 - narrow / wide) / 0.9, 1.0)
    mean = min((wide * narrow) ** 0.25, 1.0)
    angle = math.degrees(float(given.get("anisotropyRotation", 0.0)))
    result: Material = {"anisotropy": anisotropy, "roughness": {**roughness, "factor": mean} if textured else mean}
    info = given.get("anisotropyTexture")
    directions = picture(info, "anisotropy", rotate=angle)
    strengths = picture(info, "anisotropy", channel="b", factor=anisotropy)
    if directions or angle:
        result["tangent_direction"] = directions or angle
    if strengths:
        result["anisotropy"] = strengths
    if textured or strengths or narrow / wide < 0.1:
        file.warn("KHR_materials_anisotropy is approximate where it is wider than 10 : 1, or varies, or the roughness does")
    return result


def _texture(
    file: MeshFile, header: dict[str, Any], buffers: list[bytes], info: dict[str, Any] | None
) -> tuple[str, list[str]] | None:
    """Returns the path and the wrap modes of a texture; None where there is no picture that can be read.

    The bytes of an embedded picture are kept unchanged, as a file of the cache entry.
    """
    if info is None:
        return None
    if "KHR_texture_transform" in info.get("extensions", {}):
        file.warn("KHR_texture_transform is not supported; the texture is drawn without it")
    texture = header["textures"][info["index"]]
    source = texture.get("source", texture.get("extensions", {}).get("EXT_texture_webp", {}).get("source"))
    if source is None:
        file.warn(f"texture {info['index']} has no picture that can be read; drawn without it")
        return None
    sampler = header["samplers"][texture["sampler"]] if "sampler" in texture else {}
    wrap = [WRAP_MODES.get(sampler.get(key, 10497), "repeat") for key in ("wrapS", "wrapT")]
    image = header["images"][source]
    uri = image.get("uri", "")
    if uri and not uri.startswith("data:"):
        path = file.texture(unquote(uri))
        return (path, wrap) if path else None
    if uri:
        data = base64.b64decode(uri.partition(",")[2])
    else:
        view = header["bufferViews"][image["bufferView"]]
        start = view.get("byteOffset", 0)
        data = buffers[view["buffer"]][start : start + view["byteLength"]]
    if data.startswith(b"\x89PNG"):
        suffix = ".png"
    elif data.startswith(b"\xff\xd8"):
        suffix = ".jpg"
    else:
        suffix = ".webp" if data[8:12] == b"WEBP" else ".image"
    name = f"image{source}{suffix}"
    file.contents.images[name] = data
    # Pictures may share bytes of a buffer, so that together they are larger than the file.
    if sum(map(len, file.contents.images.values())) > LARGEST_EMBEDDED * (len(file.data) + sum(map(len, buffers))):
        raise file.fail(f"its pictures are together more than {LARGEST_EMBEDDED} times as large as its buffers")
    return EMBEDDED + name, wrap
