"""Setting: one choice for every knob, and the space of all of them that make a difference to a scene."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, fields, replace
from itertools import product
from typing import Any

from glshade.assembly.assembly import assemble
from glshade.glsl.generator import generate
from glshade.glsl.plan import plan_instance
from glshade.radiance.readying import ready
from glshade.scene.quality import Quality
from glshade.scene.scene import Scene

# Triangles are cut in four this often at most, and refined to these errors of linear light.
LEVELS = (1, 2)
REFINEMENTS = (3e-2, 3e-3)


@dataclass(frozen=True)
class Setting:
    """What is chosen of each knob; None is the scene's own word, which counts as exact. samples: of the film."""

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
        words += [f"subdivide {self.subdivide}"] * bool(self.subdivide)
        words += [f"refine {self.refine:g}" if self.refine else ""] * bool(self.refine)
        words += ["not normalised"] * (self.normalise is False)
        words += [value for value in (self.fresnel, self.specular, self.arithmetic) if value]
        words += [f"{self.samples} samples"] * bool(self.samples)
        return ", ".join([*words, self.storage])

    @property
    def quality(self) -> Quality:
        """The same, as the scene file has it."""
        said = {name: getattr(self, name) for name in Quality.model_fields}
        return Quality.model_validate({name: value for name, value in said.items() if value is not None})

    def applied(self, scene: Scene) -> Scene:
        """The scene at this setting, whatever its own quality says."""
        film = scene.film if self.samples is None else scene.film.model_copy(update={"samples": self.samples})
        objects = tuple(item.model_copy(update={"quality": None}) for item in scene.objects)
        return scene.model_copy(update={"film": film, "quality": self.quality, "objects": objects})

    def only(self, *kinds: str) -> Setting:
        """The choices of these kinds; the others as the exact setting has them."""
        kept = {name: getattr(self, name) for kind in kinds for name in KINDS[kind]}
        return replace(EXACT, **kept)

    def as_dict(self) -> dict[str, Any]:
        """For JSON: what is not left out."""
        return {f.name: getattr(self, f.name) for f in fields(self) if getattr(self, f.name) is not None}


# Errors are told apart by these, and each is measured against the picture in which those before it are made as well.
KINDS: dict[str, tuple[str, ...]] = {
    "model": ("fresnel", "specular"),
    "sampling": ("shading", "subdivide", "refine", "normalise", "samples"),
    "arithmetic": ("arithmetic",),
    "storage": ("storage",),
}
EXACT = Setting()


def space(scene: Scene, only: tuple[str, ...] = ()) -> tuple[list[Setting], dict[str, str]]:
    """(settings, inert): every combination that draws another picture, or draws it by other means; the exact one first.

    only: the knobs to turn, all where it is empty. inert: "knob=value" -> why it was dropped. A choice is dropped where, for
    each of the others' combinations, programs, materials and vertices are what they are without it.
    """
    wanted = only or tuple(f.name for f in fields(Setting))
    seen: dict[Any, Setting] = {}
    kept: set[tuple[str, Any]] = set()
    tried: set[tuple[str, Any]] = set()
    parts: dict[Setting, Any] = {}
    for setting in _combinations(scene, wanted):
        # What a picture is kept in has no say in what it is made of, and refining a mesh takes its time.
        bare = replace(setting, storage=EXACT.storage, samples=None)
        if bare not in parts:
            parts[bare] = _made(scene, bare)
        made = parts[bare], setting.storage, setting.samples
        choices = {(f.name, getattr(setting, f.name)) for f in fields(Setting)}
        tried |= choices
        if made not in seen:
            seen[made] = setting
            kept |= choices
    inert = {
        f"{name}={value}": "every program, material and vertex is the same without it"
        for name, value in sorted(tried - kept, key=str)
        if value is not None
    }
    return list(seen.values()), inert


def _combinations(scene: Scene, wanted: tuple[str, ...]) -> Iterator[Setting]:
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
    blends = any(instance.material.alpha_mode == "blend" for instance in assemble(scene).instances)
    if blends or len(scene.film.background) == 4 or any(light.is_negative for light in scene.lights or ()):
        # It has no alpha, and nothing below zero.
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


def _made(scene: Scene, setting: Setting) -> Any:
    """All that a picture is drawn from, but for what it is kept in: equal for settings that cannot differ."""
    assembly = ready(setting.applied(scene))
    return tuple(
        (generate(plan_instance(i, assembly, "linear")), i.material, i.mesh.digest, i.back_faces) for i in assembly.instances
    )
