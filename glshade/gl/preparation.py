"""Preparation: turns an assembly into draw calls, each with its program, vertices, uniforms, textures and lights."""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

import moderngl
import numpy as np
from numpy.typing import NDArray

from glshade.arrays import precision
from glshade.assembly.assembly import Assembly
from glshade.assembly.culling import WORTHWHILE, facing
from glshade.assembly.instance import Instance
from glshade.errors import SceneError
from glshade.gl.frame import FORMATS, Storage
from glshade.gl.instances import PLACEMENT, InstanceBuffers, upload
from glshade.gl.program import Program
from glshade.gl.resources import Resources, texture_size
from glshade.glsl.batch import Batch, batches
from glshade.glsl.generator import generate
from glshade.glsl.plan import PAGE, ProgramPlan
from glshade.glsl.planner import further_plan, plans, viewer_of
from glshade.glsl.shaders import Shaders
from glshade.glsl.source import Rewrite
from glshade.glsl.uniforms import (
    Values,
    exposed_uniforms,
    light_pages,
    light_uniforms,
    object_uniforms,
    placement_uniforms,
    textures,
)
from glshade.mesh.mesh import Mesh
from glshade.scene.scene import Scene
from glshade.textures.texels import Texels
from glshade.textures.volume import Volume

Encoding = Literal["linear", "srgb"]
# A page of lights: the group's key, the buffer that holds the lights, and their number.
Page = tuple[str, moderngl.Buffer, int]
# (id of a plan, indices of lights) -> the uniforms of the lights, and their pages for each group without an exact count.
Shared = dict[tuple[int, tuple[int, ...]], tuple[Values, list[list[Page]]]]
# The formats that store no negative numbers.
UNSIGNED = frozenset({"rgba8", "rgb10_a2", "r11f_g11f_b10f"})
# Flat inputs are used for pictures with at least this many pixels per triangle. Measurements on llvmpipe, with one and with
# eight lights, show that they save time in such pictures.
FLAT_PIXELS = 8


class ApproximateWarning(UserWarning):
    """Part of the picture is an approximation: intersecting blended surfaces are not sorted pixel by pixel."""


@dataclass(eq=False)
class DrawCall:
    """One draw call, with the state to set before it.

    instances: the instances that are drawn; several share one call if they differ only in their transforms and in numbers.
    mirrored: whether their transforms mirror, which turns counter-clockwise triangles into clockwise ones.
    plan: the plan of its program.
    program: the compiled program.
    vertices: the vertex array of the instances, with their triangles in drawing order.
    values: the uniforms that all of the instances share.
    samplers: (uniform name, texture) of each sampler.
    lights: the uniforms of the groups of lights that have an exact count.
    pages: the pages of the other lights, which are bound as uniform blocks.
    added: whether this call draws a further page of lights and adds its light to the pixels of the first call.
    buffers: the values that differ among several instances; None for a single one.
    """

    instances: tuple[Instance, ...]
    mirrored: bool
    plan: ProgramPlan
    program: Program
    vertices: moderngl.VertexArray
    values: Values
    samplers: list[tuple[str, moderngl.Texture | moderngl.Texture3D]]
    lights: Values
    pages: list[Page]
    added: bool = False
    buffers: InstanceBuffers | None = None

    @property
    def instance(self) -> Instance:
        """The first of its instances. All of them share its mesh, its lights and the sides that are drawn."""
        return self.instances[0]


@dataclass(eq=False)
class Prepared:
    """A scene made ready to draw.

    scene: the scene that was prepared.
    assembly: the assembled scene.
    calls: its draw calls, in drawing order.
    shaders: the shader files that its programs are made from.
    files: the paths of the shader files that its programs hold.
    attributes: the attributes of a float picture of the scene; None until the renderer has computed them.
    worlds: the transforms (N, 4, 4) to world space of the calls' instances; None until another view needs them.
    """

    scene: Scene
    assembly: Assembly
    calls: list[DrawCall]
    shaders: Shaders
    files: frozenset[str]
    attributes: dict[str, str] | None = None
    worlds: NDArray[np.float64] | None = None

    def is_current(self) -> bool:
        """Returns whether none of its shader files has changed."""
        return self.shaders.is_current(self.files)

    @property
    def size(self) -> int:
        """The approximate size of the data that it keeps alive [bytes].

        These are textures, the values of instances, and meshes on the CPU and the GPU.
        """
        texture_sizes = {id(texture): texture_size(texture) for call in self.calls for _, texture in call.samplers}
        mesh_sizes = {id(call.instance.mesh): _mesh_size(call.instance.mesh) for call in self.calls}
        instances = sum(call.buffers.size for call in self.calls if call.buffers)
        return sum(texture_sizes.values()) + instances + sum(mesh_sizes.values())

    @property
    def blends(self) -> bool:
        """Whether the scene has any blended surface."""
        return any(call.plan.alpha == "blend" for call in self.calls)

    @property
    def linear_storage(self) -> Storage:
        """The format of frames in linear light.

        Errors: SceneError if a light is negative and the format has no negative numbers, or if the scene needs alpha and the
        format has none.
        """
        chosen = self.scene.quality.storage
        if chosen is None or chosen == "auto":
            return "rgba32f"
        if chosen == "r11f_g11f_b10f" and any(light.is_negative for light in self.assembly.lights):
            raise SceneError("quality.storage: r11f_g11f_b10f has nothing below zero, and a light of this scene is negative")
        if chosen in UNSIGNED and any(instance.has_bands for instance in self.assembly.instances):
            raise SceneError(f"quality.storage: {chosen} has nothing below zero, which bands of wavelengths need")
        if FORMATS[chosen][1] == 3 and (len(self.scene.film.background) == 4 or self.blends):
            raise SceneError(f"quality.storage: {chosen} has no alpha, which this scene asks for")
        return chosen


class Preparer:
    """Turns assemblies into draw calls that use the programs, buffers and textures of one context."""

    def __init__(self, resources: Resources) -> None:
        self._resources = resources

    def prepare(
        self, scene: Scene, assembly: Assembly, encoding: Encoding, shaders: Shaders, rewrite: Rewrite | None = None
    ) -> Prepared:
        """Returns the scene ready to draw, with everything that stays the same from picture to picture.

        scene: the scene to draw.
        assembly: the assembled scene.
        encoding: the encoding that the programs write.
        shaders: the shader files.
        rewrite: optional; a function that is applied to every source before it is compiled.
        Errors: SceneError, ShaderError.
        """
        calls = _Calls(self._resources, scene, assembly, shaders, rewrite)
        return Prepared(scene, assembly, list(calls.draw_calls(encoding)), shaders, calls.files)

    def seen_anew(self, before: Prepared, scene: Scene, assembly: Assembly) -> Prepared | None:
        """Returns a scene ready to draw that differs from a prepared one in its camera alone; None where its programs differ.

        before: the prepared scene, whose shader files are current.
        scene: the scene to draw.
        assembly: its assembly, made by `assembly.seen_anew`.
        Errors: SceneError.
        """
        calls = _Calls(self._resources, scene, assembly, before.shaders, None).seen_anew(before)
        if calls is None:
            return None
        return Prepared(scene, assembly, calls, before.shaders, before.files, worlds=before.worlds)


class _Calls:
    """Makes the draw calls of one scene.

    files: the paths of the shader files of all programs that were made so far.
    """

    def __init__(
        self, resources: Resources, scene: Scene, assembly: Assembly, shaders: Shaders, rewrite: Rewrite | None
    ) -> None:
        self._resources, self._context = resources, resources.context
        self._assembly, self._exposure = assembly, scene.film.exposure
        self._shaders, self._rewrite = shaders, rewrite
        self._programs: dict[tuple[ProgramPlan, tuple[str, ...]], Program] = {}
        # Equal values are one array, by which the renderer sees that a program has the value already.
        self._arrays: dict[tuple[str, bytes], NDArray[np.float32]] = {}
        self.files: frozenset[str] = frozenset()
        self._pixels = scene.film.size[0] * scene.film.size[1]
        # Where all samples of a pixel are at its centre, so is the centroid.
        self._scaled = scene.film.samples > 1 and assembly.view.perspective

    @cached_property
    def _flat(self) -> bool:
        """Whether the programs get flat inputs."""
        triangles = sum(instance.mesh.counts[1] for instance in self._assembly.instances)
        return self._context.is_software and triangles * FLAT_PIXELS <= self._pixels

    def draw_calls(self, encoding: Encoding) -> Iterator[DrawCall]:
        """Yields the draw calls: opaque instances grouped by program, then blended ones from back to front."""
        yield from self._opaque(self._assembly.first_parts(), encoding)
        # Further parts add to the fragments that the first parts drew.
        for call in self._opaque(self._assembly.further_parts(), encoding):
            call.added = True
            yield call
        yield from self._blended(encoding)

    def _opaque(self, assembly: Assembly, encoding: Encoding) -> Iterator[DrawCall]:
        """Yields the draw calls of the opaque instances of an assembly of instances without shares."""
        shared: Shared = {}
        for batch in batches(assembly, plans(assembly, encoding, self._scaled), self._exposure):
            lights, pages = self._lights(batch.plan, batch.instances[0], shared)
            if len(batch.instances) > 1:
                yield self._of_batch(batch, lights)
            else:
                yield from self._of_instance(batch, lights, pages)

    def _blended(self, encoding: Encoding) -> Iterator[DrawCall]:
        """Yields the draw calls of the blended instances from back to front, all parts of an instance one after the other."""
        parts = [(part, number > 0) for instance in self._back_to_front() for number, part in enumerate(instance.parts)]
        assembly = replace(self._assembly, instances=tuple(part for part, _ in parts))
        shared: Shared = {}
        for plan, (part, is_added) in zip(plans(assembly, encoding, self._scaled), parts, strict=True):
            for call in self._of_instance(Batch(plan, (part,), part.mirrored), *self._lights(plan, part, shared)):
                call.added |= is_added
                yield call

    def _lights(self, plan: ProgramPlan, instance: Instance, shared: Shared) -> tuple[Values, list[list[Page]]]:
        """Returns the uniforms of the groups of lights that have an exact count, and the pages of the other groups.

        shared: those of earlier calls, which share the tables if they have the same plan and the same lights. Equal plans must
            be one object.
        """
        key = id(plan), instance.lights
        if key not in shared:
            lights = light_uniforms(plan, self._assembly, instance.lights, self._exposure)
            _check_finite(instance, lights)
            shared[key] = lights, self._pages(plan, instance)
        return shared[key]

    def seen_anew(self, before: Prepared) -> list[DrawCall] | None:
        """Returns the draw calls of a prepared scene for another view; None where more than their uniforms may differ."""
        view, calls = self._assembly.view, before.calls
        plan = calls[0].plan
        if plan.viewer != viewer_of(view) or plan.scaled != self._scaled or before.blends or any(call.pages for call in calls):
            return None
        if before.worlds is None:
            before.worlds = np.array([instance.world_from_object for call in calls for instance in call.instances])
        relative = before.worlds.copy()
        relative[:, :3, 3] -= view.eye
        with np.errstate(over="ignore"):
            placed = relative.astype(precision())
        if not np.isfinite(placed).all():
            return None  # the full preparation reports the object
        # Calls share the table of their lights if they have the same plan and the same lights.
        shared: dict[int, Values] = {}
        result, start = [], 0
        for call in calls:
            instance, plan, lights = call.instance, call.plan, shared.get(id(call.lights))
            if lights is None:
                lights = shared[id(call.lights)] = light_uniforms(plan, self._assembly, instance.lights, self._exposure)
                _check_finite(instance, lights)
            samplers, vertices, values, buffers = call.samplers, call.vertices, call.values, call.buffers
            if samplers:
                # A picture's file may have changed.
                samplers = self._samplers(textures(plan, instance.material))
            if buffers is not None:
                buffers = buffers.placed(self._context, placed[start : start + buffers.count])
                vertices = self._resources.vertices.instanced(instance.mesh, call.program, buffers)
            else:
                values = {**values, PLACEMENT: placed[start]}
                if instance.mesh.counts[1] >= WORTHWHILE:
                    vertices = self._resources.vertices.array(instance.mesh, call.program, facing(instance, view))
            start += len(call.instances)
            result.append(replace(call, vertices=vertices, values=values, samplers=samplers, lights=lights, buffers=buffers))
        return result

    def _back_to_front(self) -> list[Instance]:
        """Returns the blended instances, ordered by the mean of their vertices, the farthest first."""
        # A property of a blended surface, such as its depth, is drawn as that of an opaque one.
        lit = (instance for instance in self._assembly.instances if instance.shows == "light")
        blended = [instance for instance in lit if instance.material.alpha_mode == "blend"]
        if not blended:
            return []
        warnings.warn(
            "blended surfaces are drawn back to front, triangle by triangle: the picture is approximate where they intersect",
            ApproximateWarning,
            stacklevel=7,
        )
        middles = []
        for instance in blended:
            world = instance.world_from_object
            middles.append(world[:3, 3] + world[:3, :3] @ instance.mesh.positions.mean(axis=0, dtype=np.float64))
        depths = self._assembly.view.depth(np.array(middles))
        return [blended[i] for i in np.argsort(-depths, kind="stable")]

    def _of_instance(self, batch: Batch, lights: Values, pages: list[list[Page]]) -> Iterator[DrawCall]:
        """Yields the first draw call of a single instance, and one more for every further page of lights."""
        assembly, plan, instance = self._assembly, batch.plan, batch.instances[0]
        triangles = _sorted_triangles(instance, assembly) if plan.alpha == "blend" else facing(instance, assembly.view)
        for index in range(max((len(group) for group in pages), default=1)):
            page_plan = plan if index == 0 else further_plan(plan, instance, [len(group) for group in pages], index)
            program = self._program(page_plan)
            values = object_uniforms(page_plan, instance, assembly.view.eye)
            values |= exposed_uniforms(page_plan, instance, assembly, self._exposure)
            _check_finite(instance, values)
            values = self._interned(values)
            samplers = self._samplers(textures(page_plan, instance.material))
            vertices = self._resources.vertices.array(instance.mesh, program, triangles)
            page = [group[index] for group in pages if index < len(group)]
            page_lights = {} if index else lights
            yield DrawCall(
                batch.instances, batch.mirrored, page_plan, program, vertices, values, samplers, page_lights, page, bool(index)
            )

    def _of_batch(self, batch: Batch, lights: Values) -> DrawCall:
        """Returns the draw call of several instances."""
        plan, first = batch.plan, batch.instances[0]
        varying = placement_uniforms(plan, batch.instances, self._assembly.view.eye) | batch.varying
        for name, value in varying.items():
            finite = np.isfinite(value.reshape(len(value), -1)).all(axis=1)
            _check_finite(batch.instances[int(finite.argmin())], {name: value})
        _check_finite(first, batch.common)
        program = self._program(plan, tuple(varying))
        buffers = upload(self._context, program, varying)
        vertices = self._resources.vertices.instanced(first.mesh, program, buffers)
        samplers = self._samplers(textures(plan, first.material))
        values = self._interned(batch.common)
        return DrawCall(batch.instances, batch.mirrored, plan, program, vertices, values, samplers, lights, [], buffers=buffers)

    def _interned(self, values: Values) -> Values:
        """Returns the values, equal ones as one array."""
        return {name: self._arrays.setdefault((name, value.tobytes()), value) for name, value in values.items()}

    def _samplers(self, texels: Mapping[str, Texels | Volume]) -> list[tuple[str, moderngl.Texture | moderngl.Texture3D]]:
        """Returns the texture of each sampler, from the cache."""
        return [(name, self._resources.texture(each)) for name, each in texels.items()]

    def _program(self, plan: ProgramPlan, varying: tuple[str, ...] = ()) -> Program:
        """Returns the program of a plan. varying: the uniforms that are attributes of the instances."""
        if (plan, varying) not in self._programs:
            source = generate(plan, self._shaders)
            self.files |= source.files
            source = self._rewrite(source) if self._rewrite else source
            self._programs[plan, varying] = self._resources.program(source, self._flat, varying)
        return self._programs[plan, varying]

    def _pages(self, plan: ProgramPlan, instance: Instance) -> list[list[Page]]:
        """Returns the pages of lights of each group that has no exact count."""
        result = []
        for group in plan.paged:
            lights = [self._assembly.lights[i] for i in instance.lights if group.holds(self._assembly.lights[i])]
            records = light_pages(group, lights, self._assembly.view.eye, self._exposure, PAGE)
            whole = PAGE * records[0].dtype.itemsize
            result.append([(group.key, self._context.gl.buffer(r.tobytes().ljust(whole, b"\0")), len(r)) for r in records])
        return result


def _mesh_size(mesh: Mesh) -> int:
    """Returns the approximate size of a mesh on the CPU and the GPU together [bytes].

    All attributes of a vertex together count as three times its position of 12 bytes, which is the size of a triangle, too.
    """
    vertices, triangles = mesh.counts
    return 2 * 12 * (triangles + 3 * vertices)


def _check_finite(instance: Instance, values: Values) -> None:
    """Raises SceneError, with the value's name, if a value is too large for float32."""
    for name, value in values.items():
        if not np.isfinite(value).all():
            raise SceneError(f"{instance.name}: {name.removeprefix('u_')} is too large for float32")


def _sorted_triangles(instance: Instance, assembly: Assembly) -> NDArray[np.uint32]:
    """Returns the triangles (T, 3) of an instance, ordered by their centroids from back to front."""
    centroids = instance.mesh.positions[instance.mesh.triangles].mean(axis=1, dtype=np.float64)
    world = centroids @ instance.world_from_object[:3, :3].T + instance.world_from_object[:3, 3]
    return instance.mesh.triangles[np.argsort(-assembly.view.depth(world), kind="stable")]
