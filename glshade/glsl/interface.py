"""Interface: the uniforms, attributes and uniform blocks of a program."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, TypeAlias

from glshade.glsl.source import Declaration, Source

# Name -> GLSL type; the type of an array has its length: vec3[4].
Names: TypeAlias = dict[str, str]


@dataclass(frozen=True)
class Interface:
    """The global variables that a program takes from the application.

    uniforms: name -> GLSL type.
    attributes: name -> GLSL type, of the vertex stage's inputs.
    blocks: the names of its uniform blocks.
    """

    uniforms: Names
    attributes: Names
    blocks: tuple[str, ...]

    @property
    def names(self) -> frozenset[str]:
        """The names of all uniforms, attributes and uniform blocks."""
        return frozenset((*self.uniforms, *self.attributes, *self.blocks))

    def as_dict(self) -> dict[str, Any]:
        """Returns the attributes as a dictionary of JSON types."""
        return {"uniforms": self.uniforms, "attributes": self.attributes, "blocks": list(self.blocks)}


def declared(source: Source) -> Interface:
    """Returns the global variables that the program's text declares, in alphabetical order."""
    uniforms = [declaration for stage in source.stages for declaration in stage.declarations("uniform")]
    blocks = {declaration.name for stage in source.stages for declaration in stage.declarations("block")}
    return Interface(_types(uniforms), _types(list(source.vertex.declarations("in"))), tuple(sorted(blocks)))


def _types(declarations: list[Declaration]) -> Names:
    return {d.name: f"{d.type}[{d.count}]" if d.count else d.type for d in sorted(declarations, key=lambda d: d.name)}
