"""Explanation: what a scene's programs hold and why, and what the driver makes of them."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from glshade.glsl.definitions import uncommented
from glshade.glsl.generator import Source, generate
from glshade.glsl.plan import Plan, ProgramPlan, explain, reasons
from glshade.glsl.variants import Variants, variants
from glshade.radiance.readying import ready
from glshade.scene.scene import Rate, Scene

# name -> GLSL type, an array's with its length.
Names = dict[str, str]

_UNIFORM = re.compile(r"^uniform (\w+) (\w+)(\[\d+\])?;", re.M)
_BLOCK = re.compile(r"^layout\(std140\) uniform (\w+) \{", re.M)
_ATTRIBUTE = re.compile(r"^in (\w+) (\w+);", re.M)


@dataclass(frozen=True)
class Interface:
    """What a program takes: uniforms and attributes with their types, and the names of its uniform blocks."""

    uniforms: Names
    attributes: Names
    blocks: tuple[str, ...]

    @property
    def names(self) -> frozenset[str]:
        """All of them."""
        return frozenset((*self.uniforms, *self.attributes, *self.blocks))

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        return {"uniforms": self.uniforms, "attributes": self.attributes, "blocks": list(self.blocks)}


def declared(source: Source) -> Interface:
    """What the text declares, in alphabetical order."""
    vertex = uncommented(source.vertex.text)
    text = vertex + uncommented(source.fragment.text if source.fragment else "")
    return Interface(
        {name: type + length for type, name, length in sorted(_UNIFORM.findall(text), key=lambda found: found[1])},
        {name: type for type, name in sorted(_ATTRIBUTE.findall(vertex), key=lambda found: found[1])},
        tuple(sorted(set(_BLOCK.findall(text)))),
    )


def active(source: Source, context: Any) -> Interface:
    """What the driver takes of it, in alphabetical order. context: a Context. Errors: ShaderError."""
    from glshade.gl.program import Program

    with context.gl:
        found = Program(context, source).interface
    uniforms, attributes = (dict(sorted(found[what].items())) for what in ("uniforms", "attributes"))
    # moderngl tells of some drivers' block members, which are no uniforms of their own.
    blocks = tuple(sorted(found["blocks"]))
    return Interface({name: type for name, type in uniforms.items() if "." not in name}, attributes, blocks)


@dataclass(frozen=True)
class Explained:
    """One program. features: (what it holds, the object, light, camera or film that requires it); draws: the objects' names;
    active: None where no driver was asked; operations: by stage, None where they were not asked for or no driver shows them."""

    plan: ProgramPlan
    source: Source
    draws: tuple[str, ...]
    features: tuple[tuple[str, str], ...]
    declared: Interface
    active: Interface | None = None
    operations: Mapping[str, dict[str, int] | None] | None = None

    @property
    def inactive(self) -> tuple[str, ...] | None:
        """What is declared and not active: a fault of the generator."""
        return None if self.active is None else tuple(sorted(self.declared.names - self.active.names))

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
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
    """A scene explained. driver: its name and version, None where none was asked."""

    plan: Plan
    programs: tuple[Explained, ...]
    variants: Variants
    driver: str | None = None

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        return {
            "programs": [program.as_dict() for program in self.programs],
            "variants": self.variants.as_dict(),
            "driver": self.driver,
        }


def explanation(scene: Scene, shading: Rate | None = None) -> Explanation:
    """Everything that can be said without a driver. Errors: SceneError."""
    assembly, plan = ready(scene, shading), explain(scene, shading)
    why: list[dict[str, str]] = [{} for _ in plan.programs]
    draws: list[dict[str, None]] = [{} for _ in plan.programs]
    for instance, (name, which) in zip(assembly.instances, plan.draws, strict=True):
        draws[which][name] = None
        for feature, reason in reasons(plan.programs[which], instance, assembly):
            why[which].setdefault(feature, reason)
    sources = [generate(program) for program in plan.programs]
    programs = tuple(
        Explained(program, source, tuple(draws[i]), tuple(why[i].items()), declared(source))
        for i, (program, source) in enumerate(zip(plan.programs, sources, strict=True))
    )
    return Explanation(plan, programs, variants(scene, assembly, plan, len(set(sources))))


def with_active(found: Explanation, context: Any) -> Explanation:
    """The same, with what the driver finds active. context: a Context. Errors: ShaderError."""
    programs = tuple(replace(one, active=active(one.source, context)) for one in found.programs)
    return replace(found, programs=programs, driver=f"{context.renderer}; {context.version}")


def with_operations(found: Explanation, backend: Any = "auto", device: int | None = None) -> Explanation:
    """The same, with the operations of each stage where the driver shows them. Errors: as of `censuses`."""
    from glshade.driver.census import censuses

    counted = censuses([one.source for one in found.programs], backend, device)
    programs = zip(found.programs, counted, strict=True)
    return replace(
        found, programs=tuple(replace(one, operations=count.as_dict() if count else None) for one, count in programs)
    )
