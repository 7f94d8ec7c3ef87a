"""glTF material: factors, textures and alpha mode in the scene file's form."""

from __future__ import annotations

import base64
from typing import Any
from urllib.parse import unquote

from glshade.formats.contents import EMBEDDED, Material
from glshade.formats.file import File

_WRAP = {33071: "clamp", 33648: "mirror", 10497: "repeat"}


def _base(material: dict[str, Any]) -> tuple[list[float], dict[str, Any] | None]:
    """Factor (RGBA) and texture of the base colour."""
    old = material.get("extensions", {}).get("KHR_materials_pbrSpecularGlossiness")
    if old is not None and "pbrMetallicRoughness" not in material:
        return old.get("diffuseFactor", [1.0] * 4), old.get("diffuseTexture")
    pbr = material.get("pbrMetallicRoughness", {})
    return pbr.get("baseColorFactor", [1.0] * 4), pbr.get("baseColorTexture")


def uv_set(header: dict[str, Any], primitive: dict[str, Any]) -> int:
    """Which TEXCOORD_n the base colour reads; the mesh carries that one set."""
    if "material" not in primitive:
        return 0
    texture = _base(header["materials"][primitive["material"]])[1]
    return int((texture or {}).get("texCoord", 0))


def material(file: File, header: dict[str, Any], buffers: list[bytes], given: dict[str, Any]) -> Material:
    """A glTF material in the scene file's form: its base colour on Lambert, alpha, normal map and sides."""
    factor, texture = _base(given)
    rgb = [float(x) for x in factor[:3]]
    picture = _texture(file, header, buffers, texture)
    result: Material = {"brdf": "lambert", "kd": rgb}
    if picture:
        result["kd"] = {"texture": picture[0], "factor": rgb, "wrap": picture[1]}
    mode = given.get("alphaMode", "OPAQUE")
    if mode in ("MASK", "BLEND"):
        result |= {"alpha": float(factor[3]), "alpha_mode": mode.lower()}
        if mode == "MASK":
            result["alpha_cutoff"] = float(given.get("alphaCutoff", 0.5))
    normal = given.get("normalTexture")
    picture = _texture(file, header, buffers, normal)
    if normal and picture:
        if normal.get("texCoord", 0) != (texture or {}).get("texCoord", 0):
            file.warn("a normal map uses other texture coordinates than the base colour; drawn without it")
        else:
            scale = float(normal.get("scale", 1.0))
            result["normal_map"] = {"texture": picture[0], "scale": scale, "wrap": picture[1]}
    if given.get("doubleSided", False):
        result["sides"] = "both"
    elif "alpha_mode" in result:
        # What can be seen through would show its back faces, which glTF culls; opaque solids are left to `auto`.
        result["sides"] = "front"
    return result


def _texture(
    file: File, header: dict[str, Any], buffers: list[bytes], info: dict[str, Any] | None
) -> tuple[str, list[str]] | None:
    """Path and wrap modes of a texture; an embedded picture is kept, unmodified, as a file of the cache entry."""
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
    wrap = [_WRAP.get(sampler.get(key, 10497), "repeat") for key in ("wrapS", "wrapT")]
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
    return EMBEDDED + name, wrap
