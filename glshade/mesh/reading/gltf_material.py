"""glTF material: converts a material of a glTF file into a material table of a scene file."""

from __future__ import annotations

import base64
import binascii
import math
from dataclasses import dataclass
from typing import Any
from urllib.parse import unquote, unquote_to_bytes

from glshade.mesh.reading.contents import EMBEDDED, Material
from glshade.mesh.reading.file import MeshFile, short
from glshade.mesh.reading.gltf_json import LARGEST, Table

# The size of the embedded pictures, in sizes of the file and its buffers.
LARGEST_EMBEDDED = 4
# OpenGL's number of a wrap mode -> its name in a scene file.
WRAP_MODES = {33071: "clamp", 33648: "mirror", 10497: "repeat"}
# OpenGL's number of the filter of a magnified picture that shows the nearest texel.
NEAREST = 9728
# The least scale of texture coordinates in a scene file. A scale of 0 shows a single texel, and so does this one.
SMALLEST_SCALE = 1e-6
SPECULAR_GLOSSINESS = "KHR_materials_pbrSpecularGlossiness"
# The extensions of materials and textures that this module reads, completely or in part.
EXTENSIONS = frozenset(
    {
        "EXT_texture_webp",
        "KHR_materials_anisotropy",
        "KHR_materials_emissive_strength",
        "KHR_materials_ior",
        SPECULAR_GLOSSINESS,
        "KHR_materials_specular",
        "KHR_materials_unlit",
        "KHR_texture_transform",
    }
)
# Extension of a material that is not drawn -> the key of its strength, whose default is 0. Then nothing is missing.
_STRENGTHS = {
    "KHR_materials_clearcoat": "clearcoatFactor",
    "KHR_materials_diffuse_transmission": "diffuseTransmissionFactor",
    "KHR_materials_dispersion": "dispersion",
    "KHR_materials_iridescence": "iridescenceFactor",
    "KHR_materials_sheen": "sheenColorFactor",
    "KHR_materials_transmission": "transmissionFactor",
    "KHR_materials_volume": "thicknessFactor",
}
# The places of the textures in a material, the most important one first: tables, and the key of the texture.
_TEXTURES = (
    (("pbrMetallicRoughness",), "baseColorTexture"),
    (("extensions", SPECULAR_GLOSSINESS), "diffuseTexture"),
    (("pbrMetallicRoughness",), "metallicRoughnessTexture"),
    (("extensions", SPECULAR_GLOSSINESS), "specularGlossinessTexture"),
    ((), "normalTexture"),
    ((), "emissiveTexture"),
    ((), "occlusionTexture"),
    (("extensions", "KHR_materials_specular"), "specularColorTexture"),
    (("extensions", "KHR_materials_anisotropy"), "anisotropyTexture"),
)


def uv_set(header: dict[str, Any], primitive: dict[str, Any]) -> int:
    """Returns the number n of the attribute TEXCOORD_n that a primitive's material reads; 0 for a material that does not exist.

    The mesh gets only these uvs.
    """
    materials, index = header.get("materials", ()), primitive.get("material")
    if not isinstance(materials, list) or not isinstance(index, int) or not 0 <= index < len(materials):
        return 0
    return _coordinates(materials[index])


def _coordinates(material: Any) -> int:
    """Returns the set of uvs of the material's first texture. Textures that read another set are not used."""
    for tables, key in _TEXTURES:
        value = material
        for name in (*tables, key):
            value = value.get(name) if isinstance(value, dict) else None
        if isinstance(value, dict):
            return _set_of(value)
    return 0


def _set_of(info: dict[str, Any]) -> int:
    """Returns the set of uvs of a texture, which KHR_texture_transform may replace."""
    extensions = info.get("extensions")
    transform = extensions.get("KHR_texture_transform") if isinstance(extensions, dict) else None
    found = transform.get("texCoord", info.get("texCoord")) if isinstance(transform, dict) else info.get("texCoord")
    return found if isinstance(found, int) else 0


def material(
    file: MeshFile, header: dict[str, Any], buffers: list[bytes], given: dict[str, Any], place: str = "material"
) -> Material:
    """Returns a glTF material as a material table of a scene file. Its model is ggx, which has the formulas of the glTF
    specification (glTF 2.0, section 3.9 and appendix B).

    header: the JSON of the file.
    buffers: the bytes of its buffers, for embedded pictures.
    given: the JSON of the material. An empty table is the material of a primitive that names none.
    place: the place of the material in the file, for messages.
    Errors: AssetError, one line with the place of the fault.
    """
    table = Table(file, given, place)
    return _Converter(file, Table(file, header, ""), buffers, table, _coordinates(given)).converted()


@dataclass(frozen=True)
class _Converter:
    """The conversion of one material.

    file: the file, for messages and textures.
    header: the JSON of the file.
    buffers: the bytes of its buffers.
    given: the JSON of the material.
    coordinates: the set of uvs that the mesh has.
    """

    file: MeshFile
    header: Table
    buffers: list[bytes]
    given: Table
    coordinates: int

    @property
    def extensions(self) -> Table:
        """The extensions of the material."""
        return self.given.table("extensions")

    def warn(self, message: str) -> None:
        """Adds a warning that names the material, or its place in the file where it has no name."""
        name = self.given.text("name", "")
        subject = f"material '{short(name)}'" if name else self.given.place
        self.file.warn(f"{subject}: {message}")

    def converted(self) -> Material:
        """Returns the material table."""
        if self.extensions.has("KHR_materials_unlit"):
            # Lights and all other extensions have no effect on an unlit material.
            colour, opacity = self._base(self.given.table("pbrMetallicRoughness"), "baseColorFactor", "baseColorTexture")
            return {"brdf": "lambert", "kd": colour, "unlit": True} | self._coverage(opacity)
        if self.extensions.has(SPECULAR_GLOSSINESS):
            # A reader that knows this model uses it even where the other model is given too.
            result, opacity = self._specular_glossiness(self.extensions.table(SPECULAR_GLOSSINESS))
        else:
            result, opacity = self._metallic_roughness(self.given.table("pbrMetallicRoughness"))
        anisotropy = self.extensions.table("KHR_materials_anisotropy")
        if "roughness" in result and anisotropy.number("anisotropyStrength", 0.0, 0.0, 1.0):
            result |= self._brushed(anisotropy, result["roughness"])
        result |= self._coverage(opacity) | self._maps()
        missing = sorted(name for name in self.extensions.value if name not in EXTENSIONS and self._shows(name))
        if missing:
            self.warn(f"drawn without {short(', '.join(missing))}, which glshade does not have")
        return result

    def _shows(self, extension: str) -> bool:
        """Returns whether an extension that is not drawn would change the picture."""
        strength = self.extensions.table(extension).value.get(_STRENGTHS.get(extension, ""), 0)
        return extension not in _STRENGTHS or strength not in (0, [0, 0, 0])

    def _base(self, table: Table, factor: str, texture: str) -> tuple[Any, float]:
        """Returns the base colour, three numbers or a texture, and the factor of its opacity."""
        *rgb, opacity = table.numbers(factor, [1.0] * 4, 0.0, 1.0)
        return self._picture(table, texture, "the base colour", factor=rgb) or rgb, opacity

    def _metallic_roughness(self, pbr: Table) -> tuple[Material, float]:
        """Returns the parameters of pbrMetallicRoughness and the factor of the opacity."""
        kd, opacity = self._base(pbr, "baseColorFactor", "baseColorTexture")

        def number(key: str, channel: str) -> Any:
            """Returns a parameter: a table if it has a texture and a factor other than 0, otherwise a number."""
            value, texture = pbr.number(key, 1.0, 0.0, 1.0), "metallicRoughnessTexture"
            return (
                self._picture(pbr, texture, "metallic roughness", factor=value, channel=channel) if value else None
            ) or value

        result: Material = {"brdf": "ggx", "kd": kd}
        result |= {"metallic": number("metallicFactor", "b"), "roughness": number("roughnessFactor", "g")}
        if result["metallic"] == 0 and self.extensions.table("KHR_materials_specular").number("specularFactor", 1.0) == 0:
            # Without its specular reflection, a dielectric reflects diffuse light alone.
            return {"brdf": "lambert", "kd": kd}, opacity
        return result | self._reflectance(), opacity

    def _specular_glossiness(self, table: Table) -> tuple[Material, float]:
        """Returns the parameters of KHR_materials_pbrSpecularGlossiness and the factor of the opacity."""
        specular = table.numbers("specularFactor", [1.0] * 3, 0.0, 1.0)
        glossiness = table.number("glossinessFactor", 1.0, 0.0, 1.0)
        packed = "specularGlossinessTexture"
        f0 = self._picture(table, packed, "the specular colour", factor=specular)
        rough = self._picture(table, packed, "the glossiness", factor=-glossiness, add=1.0, channel="a") if glossiness else None
        kd, opacity = self._base(table, "diffuseFactor", "diffuseTexture")
        # The diffuse light is what the largest channel of the specular colour leaves. A texture of that colour leaves most of
        # the light of a dielectric, and metals have no diffuse colour.
        left = 1.0 if f0 else 1.0 - max(specular)
        if f0 and (not isinstance(kd, list) or any(kd)):
            self.warn(
                f"{SPECULAR_GLOSSINESS} is approximate: the texture of the specular colour does not dim the diffuse colour"
            )
        kd = {**kd, "factor": [x * left for x in kd["factor"]]} if isinstance(kd, dict) else [x * left for x in kd]
        result: Material = {"brdf": "ggx", "kd": kd, "metallic": 0.0, "roughness": rough or 1.0 - glossiness}
        return result | {"f0": f0 or specular}, opacity

    def _reflectance(self) -> Material:
        """Returns the reflectance at normal incidence, from KHR_materials_ior and KHR_materials_specular."""
        given, refraction = self.extensions.table("KHR_materials_specular"), self.extensions.table("KHR_materials_ior")
        if not given.value and not self.extensions.has("KHR_materials_ior"):
            return {}
        # An ior of 0 stands for infinity, that is, for a reflectance of 1.
        ior = refraction.number("ior", 1.5, 0.0)
        ior = refraction.number("ior", 1.5, 1.0) if ior else 0.0
        normal = ((ior - 1) / (ior + 1)) ** 2
        strength = given.number("specularFactor", 1.0, 0.0, 1.0)
        if strength != 1 or given.has("specularTexture"):
            self.warn("the strength of KHR_materials_specular is used at normal incidence alone, and not from a texture")
        tint = given.numbers("specularColorFactor", [1.0] * 3, 0.0)
        f0 = [min(normal * x, 1.0) * strength for x in tint]
        return {"f0": self._picture(given, "specularColorTexture", "the specular colour", factor=f0) or f0}

    def _coverage(self, opacity: float) -> Material:
        """Returns the keys of opacity and of the sides that are drawn."""
        # glTF culls the back faces of a single-sided material, whatever the mesh (glTF 2.0, section 3.9.5).
        result: Material = {"sides": "both" if self.given.value.get("doubleSided") is True else "front"}
        mode = self.given.text("alphaMode", "OPAQUE")
        if mode not in ("OPAQUE", "MASK", "BLEND"):
            self.file.warn(f"{self.given.at('alphaMode')} is '{short(mode)}', which does not exist; drawn opaque")
        if mode in ("MASK", "BLEND"):
            result |= {"alpha": opacity, "alpha_mode": mode.lower()}
        if mode == "MASK":
            result["alpha_cutoff"] = self.given.number("alphaCutoff", 0.5, 0.0, 1.0)
        return result

    def _maps(self) -> Material:
        """Returns the normal map, the emission and the occlusion."""
        result: Material = {}
        scale = self.given.table("normalTexture").number("scale", 1.0)
        bumps = self._picture(self.given, "normalTexture", "the normal map", scale=scale)
        if bumps:
            result["normal_map"] = bumps
        strength = self.extensions.table("KHR_materials_emissive_strength").number("emissiveStrength", 1.0, 0.0)
        emission = [x * strength for x in self.given.numbers("emissiveFactor", [0.0] * 3, 0.0, 1.0)]
        if any(emission):
            textured = self.given.has("emissiveTexture")
            shown = self._picture(self.given, "emissiveTexture", "the emission", factor=emission) if textured else emission
            result |= {"emission": shown} if shown else {}
        strength = self.given.table("occlusionTexture").number("strength", 1.0, 0.0, 1.0)
        occlusion = self._picture(self.given, "occlusionTexture", "the occlusion", strength=strength) if strength else None
        return result | ({"occlusion": occlusion} if occlusion else {})

    def _brushed(self, given: Table, roughness: Any) -> Material:
        """Returns the parameters of ggx for KHR_materials_anisotropy.

        In the extension a strength s widens the lobe along the tangent from alpha, the square of the roughness, to
        mix(alpha, 1, s^2). ggx computes its two widths from their mean and from their ratio, 1 - 0.9 anisotropy.
        """
        textured = isinstance(roughness, dict)
        nominal = roughness.get("add", 0.0) + roughness["factor"] if textured else roughness
        # The shaders use the same least width of a lobe.
        narrow = max(nominal, 0.01) ** 2
        wide = narrow + (1 - narrow) * given.number("anisotropyStrength", 0.0, 0.0, 1.0) ** 2
        anisotropy = min((1 - narrow / wide) / 0.9, 1.0)
        mean = min((wide * narrow) ** 0.25, 1.0)
        angle = math.degrees(given.number("anisotropyRotation", 0.0))
        widened = {**roughness, "factor": roughness["factor"] * mean / nominal} if textured and nominal else roughness
        result: Material = {"anisotropy": anisotropy, "roughness": widened if textured else mean}
        directions = self._picture(given, "anisotropyTexture", "the anisotropy", rotate=angle)
        strengths = self._picture(given, "anisotropyTexture", "the anisotropy", channel="b", factor=anisotropy)
        if directions or angle:
            result["tangent_direction"] = directions or angle
        if strengths:
            result["anisotropy"] = strengths
        if textured or strengths or narrow / wide < 0.1:
            self.file.warn(
                "KHR_materials_anisotropy is approximate where it is wider than 10 : 1, or varies, or the roughness does"
            )
        return result

    def _picture(self, owner: Table, key: str, what: str, **keys: Any) -> Material | None:
        """Returns the table of a texture with these keys; None where there is no texture, or none that can be drawn.

        owner, key: the table that holds the texture, and its key.
        what: the texture's purpose, for messages.
        """
        if not owner.has(key):
            return None
        info = owner.table(key)
        if _set_of(info.value) != self.coordinates:
            self.file.warn(f"{what} uses other texture coordinates than the material's first texture; drawn without it")
            return None
        index = info.index("index")
        if index is None:
            raise info.fault("index", "the index of a texture")
        texture = self.header.item("textures", index)
        path = self._path(texture)
        return {"texture": path, **self._sampling(texture), **_transform(info), **keys} if path else None

    def _sampling(self, texture: Table) -> Material:
        """Returns the wrap modes and the filter of a texture."""
        index = texture.index("sampler")
        sampler = self.header.item("samplers", index) if index is not None else Table(self.file, {}, "")
        result: Material = {"wrap": []}
        for key in ("wrapS", "wrapT"):
            code = sampler.value.get(key, 10497)
            if code not in WRAP_MODES:
                self.file.warn(f"{sampler.at(key)} is {code!r}, which is no wrap mode; the texture repeats")
            result["wrap"].append(WRAP_MODES.get(code, "repeat"))
        return result | ({"filter": "nearest"} if sampler.value.get("magFilter") == NEAREST else {})

    def _path(self, texture: Table) -> str | None:
        """Returns the path of a texture's picture; None, with a warning, where there is no picture that can be read.

        The bytes of an embedded picture are kept unchanged, as a file of the cache entry.
        """
        extensions = texture.table("extensions")
        source = texture.index("source")
        if source is None:
            source = extensions.table("EXT_texture_webp").index("source")
        if source is None:
            kinds = short(", ".join(sorted(set(extensions.value) - EXTENSIONS)))
            reason = f"is stored with {kinds} alone, which cannot be read" if kinds else "names no picture"
            self.file.warn(f"{texture.place} {reason}; drawn without it")
            return None
        image = self.header.item("images", source)
        uri = image.text("uri", "")
        if uri and not uri.startswith("data:"):
            return self.file.texture(unquote(uri))
        return self._embedded(source, _decoded(uri) if uri else self._stored(image))

    def _stored(self, image: Table) -> bytes:
        """Returns the bytes of a picture in a buffer. Errors: AssetError."""
        number = image.index("bufferView")
        if number is None:
            raise self.file.fail(f"{image.place} has neither a uri nor a bufferView")
        view = self.header.item("bufferViews", number)
        index, start, length = (view.index(key) for key in ("buffer", "byteOffset", "byteLength"))
        if index is None or not 0 <= index < len(self.buffers):
            raise self.file.fail(f"{view.at('buffer')} is {index}, but the file has {len(self.buffers)} buffers")
        return self.buffers[index][start or 0 : (start or 0) + (length or 0)]

    def _embedded(self, number: int, data: bytes) -> str:
        """Keeps the bytes of an embedded picture, and returns its path. Errors: AssetError."""
        if data.startswith(b"\x89PNG"):
            suffix = ".png"
        elif data.startswith(b"\xff\xd8"):
            suffix = ".jpg"
        else:
            suffix = ".webp" if data[8:12] == b"WEBP" else ".image"
        images = self.file.contents.images
        images[f"image{number}{suffix}"] = data
        # Pictures may share bytes of a buffer, so that together they are larger than the file.
        if sum(map(len, images.values())) > LARGEST_EMBEDDED * (len(self.file.data) + sum(map(len, self.buffers))):
            raise self.file.fail(f"its pictures are together more than {LARGEST_EMBEDDED} times as large as its buffers")
        return f"{EMBEDDED}image{number}{suffix}"


def _decoded(uri: str) -> bytes:
    """Returns the bytes of a data URI. A text that cannot be decoded gives no bytes, which are no picture either."""
    head, _, body = uri.partition(",")
    try:
        return base64.b64decode(body) if head.endswith(";base64") else unquote_to_bytes(body)
    except binascii.Error:
        return b""


def _transform(info: Table) -> Material:
    """Returns the keys of a texture's transform, KHR_texture_transform, without those that have no effect.

    The extension computes offset + turned(scale * uv), with v downward. Its turn is from v toward u, which is a turn from u
    toward v where v points up.
    """
    given = info.table("extensions").table("KHR_texture_transform")
    u, v = given.numbers("offset", [0.0, 0.0], -LARGEST, LARGEST)
    angle = given.number("rotation", 0.0)
    scales = given.numbers("scale", [1.0, 1.0], -1 / SMALLEST_SCALE, 1 / SMALLEST_SCALE)
    su, sv = (math.copysign(max(abs(scale), SMALLEST_SCALE), scale) for scale in scales)
    cos, sin = round(math.cos(angle), 15), round(math.sin(angle), 15)
    result: Material = {}
    if (su, sv) != (1.0, 1.0):
        result["uv_scale"] = [su, sv]
    if angle:
        result["uv_rotate"] = math.degrees(angle)
    # With v' = 1 - v, the matrix is the same and the offset is another one.
    offset = [u + sin * sv, 1 - v - cos * sv]
    return result | ({"uv_offset": offset} if any(offset) else {})
