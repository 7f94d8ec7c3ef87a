"""Readying: the steps from a scene to the assembly that is drawn: assemble it, refine its meshes, and select a part of it."""

from __future__ import annotations

from glshade.assembly.assembly import Assembly, assemble
from glshade.assembly.part import Part
from glshade.scene.object import Rate
from glshade.scene.scene import Scene


def ready(scene: Scene, shading: Rate | None = None, part: Part | None = None) -> Assembly:
    """Returns the assembly that both renderers draw.

    shading: optional, the shading rate of all objects in place of their own.
    part: optional, the part of the scene that is shown in place of all its light.
    Errors: SceneError (AssetError).
    """
    assembly = assemble(scene, shading)
    if any(instance.rate == "gouraud" and instance.quality.refine for instance in assembly.instances):
        from glshade.radiance.refinement import refined_assembly

        assembly = refined_assembly(scene, assembly)
    return part.of(assembly) if part else assembly
