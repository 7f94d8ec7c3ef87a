"""Batch: the opaque instances of a scene in drawing order, those that one draw call can draw together in one batch.

Both renderers take the order from here, because it decides which of two surfaces at equal depths is seen.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from glshade.assembly.assembly import Assembly
from glshade.assembly.culling import WORTHWHILE
from glshade.assembly.instance import Instance
from glshade.glsl.plan import ProgramPlan
from glshade.glsl.uniforms import Values, surface_uniforms, textures

# Fewer instances are drawn one by one. A batch has a program of its own, and compiling it takes as long as some hundred draw
# calls; it pays off when a few pictures are drawn.
LEAST = 32
# The number of vectors that every driver offers as vertex attributes (OpenGL 3.3, table 6.44).
ATTRIBUTES = 16


@dataclass(frozen=True, eq=False)
class Batch:
    """Instances that are drawn by one draw call, or a single instance.

    plan: the plan of their program.
    instances: the N instances, which share mesh, lights, textures and the sides that are drawn.
    mirrored: whether their transforms mirror them.
    common: the uniforms of the surface that all instances share. Empty for a single instance.
    varying: the uniforms of the surface that differ, (N, ...). Empty for a single instance.
    """

    plan: ProgramPlan
    instances: tuple[Instance, ...]
    mirrored: bool
    common: Values = field(default_factory=dict)
    varying: Values = field(default_factory=dict)


def batches(assembly: Assembly, plans: Sequence[ProgramPlan], exposure: float) -> Iterator[Batch]:
    """Yields the opaque instances of a scene in drawing order: program by program, and within a program in the scene's order.

    A batch of several instances stands at the place of its first one.

    assembly: the assembled scene.
    plans: the plan of each instance, as `planner.plans` returns them.
    exposure: the film's exposure [stops].
    Errors: SceneError, AssetError.
    """
    planned = zip(plans, assembly.instances, strict=True)
    opaque = [(plan, instance) for plan, instance in planned if plan.alpha != "blend"]
    if not opaque:
        return
    worlds = np.array([instance.world_from_object for _, instance in opaque])
    mirrored: NDArray[np.bool_] = np.linalg.det(worlds[:, :3, :3]) < 0
    read: dict[tuple[int, int], Hashable] = {}
    # The plans are told apart by identity: equal ones are one object, and hashing one takes longer than the rest of the loop.
    by_plan: dict[int, dict[Hashable, list[int]]] = {}
    for number, (plan, instance) in enumerate(opaque):
        material = id(plan), id(instance.material)
        if material not in read:
            read[material] = tuple(textures(plan, instance.material).items())
        key = id(instance.mesh), instance.lights, instance.back_faces, bool(mirrored[number]), read[material]
        by_plan.setdefault(id(plan), {}).setdefault(key, []).append(number)
    maker = _Maker(assembly, exposure, opaque, mirrored.tolist())
    for group in by_plan.values():
        found = [numbered for members in group.values() for numbered in maker.split(members)]
        for _, batch in sorted(found, key=lambda pair: pair[0]):
            yield batch


@dataclass(frozen=True, eq=False)
class _Maker:
    """Makes batches of instances that one draw call may draw.

    assembly, exposure: as in `batches`.
    opaque: the plan and the instance of each opaque instance.
    mirrored: whether its transform mirrors it.
    """

    assembly: Assembly
    exposure: float
    opaque: Sequence[tuple[ProgramPlan, Instance]]
    mirrored: Sequence[bool]

    def split(self, members: list[int]) -> Iterator[tuple[int, Batch]]:
        """Yields (number of its first instance, batch) for all batches of some instances.

        members: the numbers of the instances, which share all but their transforms and the values of their materials.
        """
        plan, first = self.opaque[members[0]]
        # Triangles of large meshes are selected for each instance. Pages of lights are added instance by instance. Points and
        # lines have a mesh for each instance.
        selected = first.mesh.counts[1] >= WORTHWHILE and not first.back_faces
        if len(members) < LEAST or plan.paged or selected or first.mesh.strokes is not None:
            yield from self._singles(members)
            return
        whole = self._batch(members)
        if sum(map(_vectors, whole.varying.values())) <= room(plan):
            yield members[0], whole
            return
        by_material: dict[Hashable, list[int]] = {}
        rows = [np.ascontiguousarray(value).reshape(len(members), -1) for value in whole.varying.values()]
        for number, row in zip(members, np.hstack(rows), strict=True):
            by_material.setdefault(row.tobytes(), []).append(number)
        for alike in by_material.values():
            if len(alike) < LEAST:
                yield from self._singles(alike)
            else:
                yield alike[0], self._batch(alike)

    def _singles(self, members: list[int]) -> Iterator[tuple[int, Batch]]:
        for number in members:
            plan, instance = self.opaque[number]
            yield number, Batch(plan, (instance,), self.mirrored[number])

    def _batch(self, members: list[int]) -> Batch:
        plan = self.opaque[members[0]][0]
        instances = tuple(self.opaque[number][1] for number in members)
        rows: dict[int, int] = {}
        made: list[Values] = []
        for instance in instances:
            if id(instance.material) not in rows:
                rows[id(instance.material)] = len(made)
                made.append(surface_uniforms(plan, instance, self.assembly, self.exposure))
        of_instance = np.array([rows[id(instance.material)] for instance in instances])
        common, varying = {}, {}
        for name in made[0]:
            values = np.stack([value[name] for value in made])
            if (values == values[0]).all():
                common[name] = made[0][name]
            else:
                varying[name] = values[of_instance]
        return Batch(plan, instances, self.mirrored[members[0]], common, varying)


def _vectors(values: NDArray[np.float32]) -> int:
    """Returns the number of vectors that a uniform takes as a vertex attribute. values: one for each instance, (N, ...)."""
    return 1 if values.ndim < 3 else values.shape[2]


def room(plan: ProgramPlan) -> int:
    """Returns the number of vectors that are left for the material's values as vertex attributes.

    The mesh's own attributes take at most as many vectors as are counted here, and the transforms take the rest.
    """
    vectors = {
        "position": 1,
        "normal": int(plan.oriented),
        "tangent": int(plan.tangents),
        "uv": int(plan.mapped or plan.alpha_from is not None),
        "colour": int(plan.vertex_colours),
        "centroid": 3 if plan.rate == "flat" else 0,
        "world_from_object": 4,
        "normal_from_object": 3 if plan.oriented else 0,
        "number": int(plan.shows == "depth"),
    }
    return ATTRIBUTES - sum(vectors.values())
