"""Readying: a scene assembled, its meshes refined where their light asks for it, and reduced to the part that is shown."""

from __future__ import annotations

from glshade.assembly.assembly import Assembly, assemble
from glshade.assembly.part import Part
from glshade.scene.scene import Rate, Scene


def ready(scene: Scene, shading: Rate | None = None, part: Part | None = None) -> Assembly:
    """The assembly that both renderers draw. shading: overrules every object's. part: what of the scene is shown.

    Errors: SceneError (AssetError).
    """
    assembly = assemble(scene, shading)
    if any(instance.rate == "gouraud" and instance.quality.refine for instance in assembly.instances):
        from glshade.radiance.refinement import refined_assembly

        assembly = refined_assembly(scene, assembly)
    return part.of(assembly) if part else assembly
