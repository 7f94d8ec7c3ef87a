"""Setting: a value for each knob of quality, and the space of all settings that draw a scene in different ways."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, fields, replace
from itertools import product
from typing import Any

from glshade.assembly.assembly import assemble
from glshade.glsl.generator import generate
from glshade.glsl.planner import plan_instance
from glshade.radiance.readying import ready
from glshade.scene.quality import Quality
from glshade.scene.scene import Scene

# The values that are tried for the knobs `subdivide` (the number of times that every triangle is cut in four) and `refine` (the
# largest error of light per vertex) [linear].
LEVELS = (1, 2)
REFINEMENTS = (3e-2, 3e-3)


@dataclass(frozen=True)
class Setting:
    """A value for each knob. None leaves a knob at the scene's own value, which counts as exact.

    fresnel: "schlick" for Schlick's approximation of the reflection at an interface.
    specular: "half_angle" for highlights by the half vector.
    shading: the rate, "phong", "gouraud" or "flat".
    subdivide: how often every triangle is cut in four.
    refine: the largest error of light per vertex to which meshes are refined [linear].
    normalise: False to use interpolated normals without normalising them.
    arithmetic: "fast" for forms of powers and distributions that lose more digits.
    storage: the format of the picture on the GPU.
    samples: the film's samples in a pixel.
    """

    fresnel: str | None = None
    specular: str | None = None
    shading: str = "phong"
    subdivide: int | None = None
    refine: float | None = None
    normalise: bool | None = None
    arithmetic: str | None = None
    storage: str = "rgba32f"
    samples: int | None = None

    def __str__(self) -> str:
        words = [self.shading]
        if self.subdivide:
            words.append(f"subdivide {self.subdivide}")
        if self.refine:
            words.append(f"refine {self.refine:g}")
        if self.normalise is False:
            words.append("not normalised")
        words += [value for value in (self.fresnel, self.specular, self.arithmetic) if value]
        if self.samples:
            words.append(f"{self.samples} samples")
        return ", ".join([*words, self.storage])

    @property
    def quality(self) -> Quality:
        """The setting in the form of a scene file's table `quality`."""
        values = {name: getattr(self, name) for name in Quality.model_fields}
        return Quality.model_validate({name: value for name, value in values.items() if value is not None})

    def applied(self, scene: Scene) -> Scene:
        """Returns the scene with this setting, which replaces the quality of the scene and of its objects."""
        film = scene.film if self.samples is None else scene.film.model_copy(update={"samples": self.samples})
        objects = tuple(item.model_copy(update={"quality": None}) for item in scene.objects)
        return scene.model_copy(update={"film": film, "quality": self.quality, "objects": objects})

    def only(self, *kinds: str) -> Setting:
        """Returns the setting with the knobs of these kinds; all other knobs are exact."""
        kept = {name: getattr(self, name) for kind in kinds for name in KINDS[kind]}
        return replace(EXACT, **kept)

    def as_dict(self) -> dict[str, Any]:
        """Returns name of a knob -> value, for the values that are not None, in a form that JSON can hold."""
        return {f.name: getattr(self, f.name) for f in fields(self) if getattr(self, f.name) is not None}


# kind of error -> its knobs. The kinds are applied one after another. The error of a kind is the difference that its knobs make
# to the picture to which all kinds before it are already applied.
KINDS: dict[str, tuple[str, ...]] = {
    "model": ("fresnel", "specular"),
    "sampling": ("shading", "subdivide", "refine", "normalise", "samples"),
    "arithmetic": ("arithmetic",),
    "storage": ("storage",),
}
EXACT = Setting()


def space(scene: Scene, only: tuple[str, ...] = ()) -> tuple[list[Setting], dict[str, str]]:
    """Returns (settings, inert): the settings that draw a scene in different ways, and the values that change nothing.

    settings: the exact setting comes first.
    inert: "knob=value" -> the reason why the value is not tried. A value is dropped if it changes no program, no material and
        no vertex, whatever the values of the other knobs are.
    only: the knobs to vary; empty for all.
    """
    wanted = only or tuple(f.name for f in fields(Setting))
    seen: dict[Any, Setting] = {}
    kept: set[tuple[str, Any]] = set()
    tried: set[tuple[str, Any]] = set()
    parts: dict[Setting, Any] = {}
    for setting in _combinations(scene, wanted):
        # Storage and samples change no program, material or vertex. Without them fewer settings differ, and meshes are refined
        # less often.
        bare = replace(setting, storage=EXACT.storage, samples=None)
        if bare not in parts:
            parts[bare] = drawn_from(bare.applied(scene))
        sources = parts[bare], setting.storage, setting.samples
        choices = {(f.name, getattr(setting, f.name)) for f in fields(Setting)}
        tried |= choices
        if sources not in seen:
            seen[sources] = setting
            kept |= choices
    inert = {
        f"{name}={value}": "every program, material and vertex is the same without it"
        for name, value in sorted(tried - kept, key=str)
        if value is not None
    }
    return list(seen.values()), inert


def _combinations(scene: Scene, wanted: tuple[str, ...]) -> Iterator[Setting]:
    """Yields all combinations of the wanted knobs' values that make sense together, the exact setting first."""

    def options(name: str, *values: Any) -> tuple[Any, ...]:
        return (getattr(EXACT, name), *values) if name in wanted else (getattr(EXACT, name),)

    ways: list[dict[str, Any]] = []
    for shading in options("shading", "gouraud", "flat"):
        ways.append({"shading": shading})
        if shading == "phong":
            ways += [{"shading": shading, "normalise": value} for value in options("normalise", False)[1:]]
        else:
            ways += [{"shading": shading, "subdivide": value} for value in options("subdivide", *LEVELS)[1:]]
        if shading == "gouraud":
            ways += [{"shading": shading, "refine": value} for value in options("refine", *REFINEMENTS)[1:]]
    stores: tuple[str, ...] = ("rgba16f", "rgb10_a2", "r11f_g11f_b10f", "rgba8")
    instances = assemble(scene).instances
    if any(instance.has_bands for instance in instances):
        # The other formats have no negative numbers.
        stores = ("rgba16f",)
    blends = any(instance.material.alpha_mode == "blend" for instance in instances)
    if blends or len(scene.film.background) == 4 or any(light.is_negative for light in scene.lights or ()):
        # This format has no alpha and no negative numbers.
        stores = tuple(name for name in stores if name != "r11f_g11f_b10f")
    fewer = [count for count in (4, 2, 1) if count < scene.film.samples]
    for fresnel, specular, way, arithmetic, samples, storage in product(
        options("fresnel", "schlick"),
        options("specular", "half_angle"),
        ways,
        options("arithmetic", "fast"),
        options("samples", *fewer),
        options("storage", *stores),
    ):
        yield Setting(fresnel=fresnel, specular=specular, arithmetic=arithmetic, samples=samples, storage=storage, **way)


def drawn_from(scene: Scene) -> tuple[Any, ...]:
    """Returns everything that a picture of the scene is drawn from, except its storage, for each instance.

    The results for two scenes are equal if both draw the same picture. The first item of each entry is the object's number.
    """
    assembly = ready(scene)
    return tuple(
        (i.number, generate(plan_instance(part, assembly, "linear")), part.material, i.mesh.digest, i.back_faces)
        for i in assembly.instances
        for part in i.parts
    )
