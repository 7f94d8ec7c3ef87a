"""Explanation: the features of a scene's programs, the reason for each, and which of their variables the driver uses."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from glshade.glsl.generator import generate
from glshade.glsl.interface import Interface, declared
from glshade.glsl.plan import Plan, ProgramPlan
from glshade.glsl.planner import explain
from glshade.glsl.reasoning import reasons
from glshade.glsl.shaders import Shaders
from glshade.glsl.source import Source
from glshade.glsl.variants import Variants, count_variants
from glshade.radiance.readying import ready
from glshade.scene.object import Rate
from glshade.scene.scene import Scene


@dataclass(frozen=True)
class Explained:
    """One program, explained.

    plan: the plan of the program.
    source: its text.
    draws: the names of the objects that it draws.
    features: (feature, name of the object, light, camera or film that requires it).
    declared: the variables that its text declares.
    active: the variables that the driver uses; None if no driver was asked.
    operations: stage -> operation -> count; None if they were not asked for, and None for a stage that no driver shows.
    """

    plan: ProgramPlan
    source: Source
    draws: tuple[str, ...]
    features: tuple[tuple[str, str], ...]
    declared: Interface
    active: Interface | None = None
    operations: Mapping[str, dict[str, int] | None] | None = None

    @property
    def inactive(self) -> tuple[str, ...] | None:
        """The names of the variables that are declared but not active; any such name is a bug of the generator."""
        return None if self.active is None else tuple(sorted(self.declared.names - self.active.names))

    def as_dict(self) -> dict[str, Any]:
        """Returns the attributes as a dictionary of JSON types."""
        return {
            "program": str(self.plan),
            "draws": list(self.draws),
            "features": [{"feature": feature, "because_of": reason} for feature, reason in self.features],
            "declared": self.declared.as_dict(),
            "active": self.active and self.active.as_dict(),
            "inactive": None if self.inactive is None else list(self.inactive),
            "operations": self.operations,
            "source": {
                "vertex": self.source.vertex.text,
                "fragment": self.source.fragment.text if self.source.fragment else None,
            },
        }


@dataclass(frozen=True)
class Explanation:
    """The programs of a scene, explained.

    plan: the plan of the scene.
    programs: one entry for each program of the plan, in its order.
    variants: the numbers of possible and of actual programs.
    driver: the name and version of the driver that was asked; None if none was.
    """

    plan: Plan
    programs: tuple[Explained, ...]
    variants: Variants
    driver: str | None = None

    def as_dict(self) -> dict[str, Any]:
        """Returns the attributes as a dictionary of JSON types."""
        return {
            "programs": [program.as_dict() for program in self.programs],
            "variants": self.variants.as_dict(),
            "driver": self.driver,
        }


def explanation_of(scene: Scene, shading: Rate | None = None, shaders: Shaders | None = None) -> Explanation:
    """Returns the explanation of a scene without a driver: active, operations and driver are None.

    scene: the scene whose programs are explained.
    shading: optional; replaces the shading rate of every object.
    shaders: optional; the shader files. Default: those that ship with glshade.
    Errors: SceneError, ShaderError.
    """
    assembly, plan = ready(scene, shading), explain(scene, shading)
    why: list[dict[str, str]] = [{} for _ in plan.programs]
    draws: list[dict[str, None]] = [{} for _ in plan.programs]
    parts = (part for instance in assembly.instances for part in instance.parts)
    for instance, (name, index) in zip(parts, plan.draws, strict=True):
        draws[index][name] = None
        for feature, reason in reasons(plan.programs[index], instance, assembly):
            why[index].setdefault(feature, reason)
    sources = [generate(program, shaders) for program in plan.programs]
    programs = tuple(
        Explained(program, source, tuple(draws[i]), tuple(why[i].items()), declared(source))
        for i, (program, source) in enumerate(zip(plan.programs, sources, strict=True))
    )
    return Explanation(plan, programs, count_variants(scene, assembly, plan, len(set(sources))))
