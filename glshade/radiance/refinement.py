"""Refinement: meshes shaded per vertex, cut where their light would be off by more than an object's quality allows."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.assembly.assembly import Assembly, Instance
from glshade.mesh.mesh import Mesh, ordered
from glshade.mesh.subdivision import refined
from glshade.radiance.draw import Draw, draw_of
from glshade.radiance.surface import at_vertices, shown, toward_viewer
from glshade.scene.scene import Scene

Array = NDArray[Any]


def refined_assembly(scene: Scene, assembly: Assembly) -> Assembly:
    """The assembly with every instance refined that asks for it. What its light should be is asked of the reference."""

    def ready(instance: Instance) -> Instance:
        tolerance = instance.quality.refine
        if instance.rate != "gouraud" or tolerance is None:
            return instance
        draw = draw_of(scene, assembly, instance)
        return replace(instance, mesh=ordered(refined(instance.mesh, lambda mesh: _light(draw, mesh), tolerance)))

    return replace(assembly, instances=tuple(map(ready, assembly.instances)))


def _light(draw: Draw, mesh: Mesh) -> Array:
    """(V, 3): what each vertex shows, of the side that faces the viewer where both may be seen."""
    draw = replace(draw, instance=replace(draw.instance, mesh=mesh))
    surface = at_vertices(draw, np.arange(len(mesh.positions)), np.float64)
    if draw.instance.back_faces:
        facing = np.einsum("ij,ij->i", surface.normal, toward_viewer(draw, surface.position)) >= 0
        surface = replace(surface, side=np.where(facing, 1.0, -1.0))
    return shown(draw, surface)
