"""Part: a picture that shows one part of a scene's light, or a property of its surfaces, in place of all the light.

A part is drawn like the picture itself, with the same geometry. It changes the values that instances write, and their lights.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Literal

from glshade.assembly.assembly import WHITE, Assembly, own_colour
from glshade.assembly.instance import Instance, Share
from glshade.brdfs import BLACK, Brdf
from glshade.scene.scene import Scene


@dataclass(frozen=True)
class Part:
    """One part of a scene's picture.

    kind: the part that is shown:
        "lit": all light, without the background;
        "light": the light that one of the lights adds;
        "emission": the light that the surfaces emit, and the base colours of unlit materials;
        "specular": all light without diffuse lobes, ambient light and emission;
        "dark": no light, so that only the background is left;
        "albedo": the surfaces' base colours;
        "spectrum": all light, in three of the bands of the layer `spectrum`;
        "depth": depth of the nearest surface at the pixel's middle, and the number of its instance in the assembly;
        "uv": texture coordinates of the nearest surface at the pixel's middle;
        "normal": shading normal of the nearest surface at the pixel's middle.
        For the last three, blended surfaces count as opaque.
    light: for the kind "light", index of the light in the assembly's lights; for "spectrum", index of the first band.
    """

    kind: Literal["lit", "light", "emission", "specular", "dark", "albedo", "spectrum", "depth", "uv", "normal"]
    light: int = 0

    def scene(self, scene: Scene) -> Scene:
        """Returns the scene with the film and the storage that the part needs. Only the kind "dark" keeps the background."""
        changes: dict[str, Any] = {}
        if self.kind != "dark":
            changes["background"] = (0.0, 0.0, 0.0, 0.0)
        if self.kind == "albedo":
            changes["exposure"] = 0.0
        if self.kind in ("depth", "uv", "normal"):
            changes |= {"samples": 1, "supersample": 1}
        film = scene.film.model_copy(update=changes)
        return scene.model_copy(update={"film": film, "quality": scene.quality.model_copy(update={"storage": None})})

    def of(self, assembly: Assembly) -> Assembly:
        """Returns the assembly whose picture is the part."""
        if self.kind == "spectrum":
            return assembly.of_bands(self.light)
        instances = tuple(self._instance(number, item, assembly) for number, item in enumerate(assembly.instances))
        return replace(assembly, instances=instances, lights=(WHITE,) if self.kind == "albedo" else assembly.lights)

    def _instance(self, number: int, instance: Instance, assembly: Assembly) -> Instance:
        """Returns an instance as the part shows it.

        number: index of the instance in the assembly.
        assembly: the assembly.
        """
        if self.kind == "lit":
            return instance
        assert self.kind != "spectrum", "a spectrum replaces the whole assembly"
        if self.kind == "emission":
            # Of the shares of an instance, the first one emits.
            first = instance.parts[0]
            return replace(first, lights=tuple(i for i in first.lights if i == assembly.own_light))
        # Each further part shows the surface without its emission.
        if instance.shares and self.kind in ("light", "specular"):
            parts = (self._instance(number, part, assembly) for part in instance.parts)
            return replace(instance, shares=tuple(Share(part.material, part.lights, part.weights) for part in parts))
        instance = replace(instance, material=instance.material.model_copy(update={"emission": BLACK}), shares=())
        if self.kind == "dark":
            return replace(instance, lights=())
        if self.kind == "light":
            return replace(instance, lights=tuple(i for i in instance.lights if i == self.light))
        if self.kind == "albedo":
            own = instance.material
            if assembly.illumination and instance.written and not instance.written.unlit:
                own = assembly.illumination.albedo(instance.written)
            return replace(instance, material=own_colour(own), lights=(0,))
        if self.kind == "specular":
            material = instance.material.specular_part()
            directed = tuple(i for i in instance.lights if not assembly.lights[i].omnidirectional)
            return replace(instance, material=material, lights=directed) if material else replace(instance, lights=())
        solid: Brdf = instance.material
        if solid.alpha_mode == "blend":
            solid = solid.model_copy(update={"alpha_mode": "opaque"})
        # A mesh without texture coordinates shows its light, which is black because no light reaches it.
        shows = "light" if self.kind == "uv" and instance.mesh.uvs is None else self.kind
        # Depth and texture coordinates are per pixel whatever the shading rate; the normal depends on the rate.
        rate = instance.rate if self.kind == "normal" else "phong"
        return replace(instance, material=solid, lights=(), number=number, rate=rate, shows=shows)
