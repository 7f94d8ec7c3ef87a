"""Part: what of a scene a picture shows in place of all its light: one light's share, the highlights, a surface's place.

Every part is drawn like the picture itself, with the same geometry; a part says what each instance shows and what reaches it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Literal

from glshade.assembly.assembly import Assembly, Instance
from glshade.brdfs import BRDFS, Brdf
from glshade.lights import LIGHTS, Light
from glshade.scene.scene import Scene


@dataclass(frozen=True)
class Part:
    """kind: lit: all light, without the background; light: what one light adds, `light` its place among the assembly's;
    specular: without diffuse lobes and ambient light; unlit: no light at all, which leaves the background; albedo: the
    surfaces' own colours; depth, uv, normal: of the nearest surface at a pixel's middle, what is let through counting as
    solid; depth has beside it which of the assembly's instances that is.
    """

    kind: Literal["lit", "light", "specular", "unlit", "albedo", "depth", "uv", "normal"]
    light: int = 0

    def scene(self, scene: Scene) -> Scene:
        """The scene, filmed as the part wants it: kept in float32, without what only the whole picture has."""
        changes: dict[str, Any] = {}
        if self.kind != "unlit":
            changes["background"] = (0.0, 0.0, 0.0, 0.0)
        if self.kind == "albedo":
            changes["exposure"] = 0.0
        if self.kind in ("depth", "uv", "normal"):
            changes |= {"samples": 1, "supersample": 1}
        film = scene.film.model_copy(update=changes)
        return scene.model_copy(update={"film": film, "quality": scene.quality.model_copy(update={"storage": None})})

    def of(self, assembly: Assembly) -> Assembly:
        """The assembly that shows it."""
        instances = tuple(self._instance(number, one, assembly.lights) for number, one in enumerate(assembly.instances))
        return replace(assembly, instances=instances, lights=(_WHITE,) if self.kind == "albedo" else assembly.lights)

    def _instance(self, number: int, one: Instance, lights: tuple[Light, ...]) -> Instance:
        if self.kind == "lit":
            return one
        if self.kind == "unlit":
            return replace(one, lights=())
        if self.kind == "light":
            return replace(one, lights=tuple(i for i in one.lights if i == self.light))
        if self.kind == "albedo":
            return replace(one, material=_own_colour(one.material), lights=(0,))
        if self.kind == "specular":
            part = one.material.specular_part()
            directed = tuple(i for i in one.lights if not lights[i].omnidirectional)
            return replace(one, material=part, lights=directed) if part else replace(one, lights=())
        solid: Brdf = one.material
        if solid.alpha_mode == "blend":
            solid = solid.model_copy(update={"alpha_mode": "opaque"})
        # A mesh without texture coordinates is black. All but the normal is a matter of the pixel, whatever the shading rate.
        shows = "light" if self.kind == "uv" and one.mesh.uvs is None else self.kind
        rate = one.rate if self.kind == "normal" else "phong"
        return replace(one, material=solid, lights=(), number=number, rate=rate, shows=shows)


_WHITE: Any = LIGHTS["ambient"].model_validate({"intensity": 1.0})


def _own_colour(material: Brdf) -> Brdf:
    """The material in whose place ambient light shows its base colour; itself where it has none."""
    base = material.base()
    if base is None:
        return material
    surface: dict[str, Any] = {name: getattr(material, name) for name in Brdf.model_fields if name != "brdf"}
    return BRDFS["lambert"].model_construct(**{**surface, "brdf": "lambert", "kd": getattr(material, base)})
