"""COLLADA materials: converts an effect's profile_COMMON into a material table of a scene file.

COLLADA does not say how its colours are encoded. They are read as those of MTL files are: numbers are linear, as Blender writes
them, and pictures are sRGB-encoded.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from typing import Any
from urllib.parse import unquote
from xml.etree.ElementTree import Element

from glshade.errors import printable
from glshade.mesh.reading.contents import Material
from glshade.mesh.reading.file import MeshFile, short
from glshade.mesh.reading.markup import words

_WRAP = {"WRAP": "repeat", "MIRROR": "mirror", "CLAMP": "clamp", "BORDER": "clamp", "NONE": "clamp"}
_SHADERS = ("constant", "lambert", "phong", "blinn")


class Materials:
    """The materials of a file, each read when it is first asked for."""

    def __init__(self, file: MeshFile, ids: Mapping[str, Element]) -> None:
        """ids: id -> element, for all elements with an id."""
        self._file, self._ids = file, ids
        self._read: dict[str, tuple[Material | None, str | None]] = {}

    def material(self, url: str) -> tuple[Material | None, str | None]:
        """Returns a material, and the name of the texture coordinates that its first texture reads.

        Both are None, with a warning, for a material that does not exist.
        """
        if url not in self._read:
            self._read[url] = self._effect(url)
        return self._read[url]

    def _effect(self, url: str) -> tuple[Material | None, str | None]:
        material = self._ids.get(url.removeprefix("#"))
        name = printable(short(url.removeprefix("#") if material is None else material.get("name") or url.removeprefix("#")))
        instance = None if material is None else material.find("instance_effect")
        effect = None if instance is None else self._ids.get(instance.get("url", "").removeprefix("#"))
        profile = None if effect is None else effect.find("profile_COMMON")
        if effect is None or profile is None:
            self._file.warn(f"material '{name}' does not exist or has no profile_COMMON; drawn without it")
            return None, None
        shader = next((e for e in profile.findall("technique/*") if e.tag in _SHADERS), None)
        if shader is None:
            self._file.warn(f"material '{name}' has no shader that is read ({', '.join(_SHADERS)}); drawn without it")
            return None, None
        return _Effect(self._file, self._ids, name, effect, profile, shader).material()


class _Effect:
    """Reads one effect."""

    def __init__(
        self, file: MeshFile, ids: Mapping[str, Element], name: str, effect: Element, profile: Element, shader: Element
    ) -> None:
        self._file, self._ids, self._name = file, ids, name
        self._effect, self._shader = effect, shader
        self._params = {e.get("sid", ""): e for parent in (effect, profile, profile.find("technique")) if parent is not None
                        for e in parent.findall("newparam")}  # fmt: skip
        self._texcoord: str | None = None

    def material(self) -> tuple[Material, str | None]:
        """Returns the material and the name of the texture coordinates of its first texture."""
        diffuse, emission = self._colour("diffuse"), self._colour("emission")
        has_emission = emission is not None and (isinstance(emission, dict) or any(emission))
        if self._shader.tag == "constant":
            result: Material = {"brdf": "lambert", "kd": [0.0, 0.0, 0.0]}
        else:
            # Without a diffuse colour a surface is black, if it emits light; else the file says nothing of its colour.
            result = {"brdf": "lambert", "kd": diffuse or ([0.0] * 3 if has_emission else [0.8] * 3)}
            result |= self._highlight()
        if has_emission:
            result["emission"] = emission
        result |= self._alpha()
        sided = next((e.text for e in self._effect.iter("double_sided") if e.text), "").strip().lower()
        if sided in ("1", "true", "0", "false"):
            result["sides"] = "both" if sided in ("1", "true") else "front"
        ignored = [key for key in ("bump", "reflective") if self._counts(key)]
        if ignored:
            self._file.warn(f"material '{self._name}': {', '.join(ignored)} not used")
        return result, self._texcoord

    def _counts(self, key: str) -> bool:
        """Returns whether the effect has an element that is not read and would change the picture."""
        element = next(self._effect.iter(key), None)
        if element is None or key != "reflective":
            return element is not None
        return bool(self._number("reflectivity")) and any(self._numbers(element.find("color"))[:3] or [1.0])

    def _highlight(self) -> Material:
        """Returns the model and parameters of the highlight: Phong's, or Blinn's with the half vector."""
        ks, exponent = self._colour("specular"), self._number("shininess")
        if self._shader.tag not in ("phong", "blinn") or not ks or exponent is None or exponent <= 0:
            return {}
        if not isinstance(ks, dict) and not any(ks):
            return {}
        # Blinn's shininess is an exponent in most files; a few programs write a share of 1 there, which gives no highlight.
        return {"brdf": "blinn_phong" if self._shader.tag == "blinn" else "phong", "ks": ks, "exponent": max(exponent, 1.0)}

    def _alpha(self) -> Material:
        """Returns the opacity (COLLADA 1.4.1, chapter 7, "Determining Transparency")."""
        transparent, transparency = self._shader.find("transparent"), self._number("transparency")
        if transparent is None and transparency is None:
            return {}
        mode = "A_ONE" if transparent is None else transparent.get("opaque", "A_ONE")
        amount = 1.0 if transparency is None else transparency
        texture = None if transparent is None else transparent.find("texture")
        if texture is not None:
            diffuse = self._shader.find("diffuse/texture")
            if diffuse is not None and diffuse.get("texture") == texture.get("texture") and mode == "A_ONE":
                return {"alpha": min(max(amount, 0.0), 1.0) or 1.0, "alpha_mode": "blend"}
            self._file.warn(f"material '{self._name}': the texture of its transparency is not used")
            return {}
        colour = self._numbers(transparent.find("color")) if transparent is not None else []
        red, green, blue, alpha = (*colour, 1.0, 1.0, 1.0, 1.0)[:4] if len(colour) >= 4 else (1.0, 1.0, 1.0, 1.0)
        share = 0.212671 * red + 0.715160 * green + 0.072169 * blue if mode.startswith("RGB") else alpha
        opacity = 1 - share * amount if mode.endswith("ZERO") else share * amount
        # Nobody writes an invisible material: programs that write 0 here count transparency from the other end.
        return {"alpha": opacity, "alpha_mode": "blend"} if 0 < opacity < 1 else {}

    def _numbers(self, element: Element | None) -> list[float]:
        """Returns the finite numbers in an element; none, with a warning, where its text has anything else."""
        text = "" if element is None else element.text or ""
        try:
            values = words(text)
        except ValueError:
            values = [math.nan]
        if all(map(math.isfinite, values)):
            return values
        self._file.warn(f"material '{self._name}': '{printable(short(text.strip()))}' is not a colour or number; left out")
        return []

    def _number(self, key: str) -> float | None:
        """Returns the number of an element of the shader, which may name a parameter; None where there is none."""
        element = self._shader.find(key)
        if element is None:
            return None
        param = element.find("param")
        if param is not None:
            element = self._params.get(param.get("ref", ""), element)
        values = self._numbers(element.find("float"))
        return values[0] if values else None

    def _colour(self, key: str) -> Any:
        """Returns a colour of the shader: three numbers, or the table of a texture; None where there is none."""
        element = self._shader.find(key)
        if element is None:
            return None
        texture = element.find("texture")
        if texture is not None:
            return self._texture(texture)
        param = element.find("param")
        if param is not None:
            element = self._params.get(param.get("ref", ""), element)
        found = next((e for e in element if e.tag in ("color", "float3", "float4")), None)
        values = self._numbers(found)[:3]
        return [max(x, 0.0) for x in values] if len(values) == 3 else None

    def _texture(self, texture: Element) -> Material | None:
        """Returns the table of a texture; None, with a warning, where its picture is missing."""
        sampler, image = self._image(texture.get("texture", ""))
        reference = None if image is None else image.find("init_from")
        if reference is not None and reference.find("ref") is not None:
            reference = reference.find("ref")  # COLLADA 1.5
        uri = "" if reference is None else (reference.text or "").strip()
        if not uri:
            self._file.warn(f"material '{self._name}': a texture has no picture that can be read; drawn without it")
            return None
        path = self._file.texture(unquote(re.sub(r"^file:(//)?", "", uri, flags=re.IGNORECASE)))
        if path is None:
            return None
        self._texcoord = self._texcoord or texture.get("texcoord")
        table: Material = {"texture": path, "factor": [1.0, 1.0, 1.0]}
        if sampler is not None:
            modes = [(sampler.findtext(key) or "WRAP").strip() for key in ("wrap_s", "wrap_t")]
            table["wrap"] = [_WRAP.get(mode, "repeat") for mode in modes]
            if (sampler.findtext("magfilter") or "").strip() == "NEAREST":
                table["filter"] = "nearest"
        return table

    def _image(self, name: str) -> tuple[Element | None, Element | None]:
        """Returns the sampler and the image of a texture. Some programs name the image in place of the sampler."""
        param = self._params.get(name)
        sampler = None if param is None else param.find("sampler2D")
        if sampler is None:
            return None, self._ids.get(name)
        instance = sampler.find("instance_image")
        if instance is not None:  # COLLADA 1.5
            return sampler, self._ids.get(instance.get("url", "").removeprefix("#"))
        source = (sampler.findtext("source") or "").strip()
        surface = self._params.get(source)
        image = source if surface is None else (surface.findtext("surface/init_from") or "").strip()
        return sampler, self._ids.get(image)
