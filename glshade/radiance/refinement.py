"""Refinement: meshes that are shaded per vertex, cut finer where the error of their interpolated light is too large."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.assembly.assembly import Assembly
from glshade.assembly.instance import Instance
from glshade.mesh.mesh import Mesh
from glshade.mesh.order import ordered
from glshade.mesh.subdivision import refined
from glshade.radiance.draw import Draw, draw_of
from glshade.radiance.surface import at_vertices, evaluate_surface, toward_viewer
from glshade.scene.scene import Scene

Array = NDArray[Any]

# A triangle of a refined mesh takes about this many times the time and memory of any other, because its light is computed in
# float64 at many points.
COSTLIER = 4


def refined_assembly(scene: Scene, assembly: Assembly) -> Assembly:
    """Returns the assembly with finer meshes for the instances whose quality asks for refinement. Errors: AssetError.

    Triangles are cut until the interpolated light differs from the light of `evaluate_surface` by less than the tolerance.
    """

    left = scene.limits.max_triangles // COSTLIER

    def refine(instance: Instance) -> Instance:
        nonlocal left
        tolerance = instance.quality.refine
        if instance.rate != "gouraud" or tolerance is None:
            return instance
        draw = draw_of(scene, assembly, instance)
        mesh = refined(instance.mesh, lambda mesh: _light(draw, mesh), tolerance, left)
        left -= len(mesh.triangles)
        return replace(instance, mesh=ordered(mesh))

    return replace(assembly, instances=tuple(map(refine, assembly.instances)))


def _light(draw: Draw, mesh: Mesh) -> Array:
    """Returns the light (V, 3) that the vertices show. If back faces are drawn, the side that faces the viewer counts."""
    draw = replace(draw, instance=replace(draw.instance, mesh=mesh))
    surface = at_vertices(draw, np.arange(len(mesh.positions)), np.float64)
    if draw.instance.back_faces:
        facing = np.einsum("ij,ij->i", surface.normal, toward_viewer(draw, surface.position)) >= 0
        surface = replace(surface, side=np.where(facing, 1.0, -1.0))
    return evaluate_surface(draw, surface)
