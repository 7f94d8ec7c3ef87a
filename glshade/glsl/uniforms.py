"""Uniforms: the float32 values of a program's uniforms, by GLSL name.

All values are computed in float64 and rounded once, in this module. The reference renderer starts from the same rounded
values, so that the two renderers share their inputs and nothing else.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.arrays import precision, rounded
from glshade.assembly.assembly import Assembly
from glshade.assembly.instance import Instance
from glshade.assembly.values import (
    ambient_intensity,
    ambient_reflectance,
    direction,
    emitted,
    emitted_beside,
    light_values,
    normal_matrices,
    normal_matrix,
)
from glshade.brdfs import Brdf, numbers
from glshade.brdfs import parameter_values as parameter_values
from glshade.glsl.plan import LightGroup, ProgramPlan, channel
from glshade.lights import LIGHTS, Light
from glshade.textures.texels import Texels, placement_of, texels_of
from glshade.textures.texture import UNPLACED
from glshade.textures.volume import Volume

Array = NDArray[np.float64]
Values = dict[str, NDArray[np.float32]]


def object_uniforms(plan: ProgramPlan, instance: Instance, eye: Array) -> Values:
    """Returns the uniforms that differ from object to object: the placement and the material.

    plan: the plan of the program.
    instance: the object.
    eye: the position (3,) of the viewer in the world; the placement is relative to it.
    """
    world = instance.world_from_object
    relative = world.copy()
    relative[:3, 3] -= eye
    values: dict[str, Any] = {"u_world_from_object": relative}
    if plan.oriented:
        values["u_normal_from_object"] = normal_matrix(world[:3, :3])
    if plan.tangents:
        values["u_handedness"] = -1.0 if instance.mirrored else 1.0
    if plan.shows == "depth":
        values["u_number"] = instance.number
    values.update(_of_surface(plan, instance))
    return _rounded(values)


def surface_uniforms(plan: ProgramPlan, instance: Instance, assembly: Assembly, exposure: float) -> Values:
    """Returns the uniforms of an object that do not depend on its transform, apart from whether this mirrors the object.

    exposure: the film's exposure [stops].
    """
    sign = {"u_handedness": -1.0 if instance.mirrored else 1.0} if plan.tangents else {}
    values = _rounded(sign | _of_surface(plan, instance))
    return values | exposed_uniforms(plan, instance, assembly, exposure)


def _of_surface(plan: ProgramPlan, instance: Instance) -> dict[str, Any]:
    """Returns the uniforms of an object's material, and the matrix that turns its bands of wavelengths into RGB."""
    bands = {"u_rgb_from_bands": instance.weights} if plan.weighted else {}
    return bands | material_uniforms(plan, instance.material)


def placement_uniforms(plan: ProgramPlan, instances: Sequence[Instance], eye: Array) -> Values:
    """Returns the uniforms that differ with the transforms of N objects, (N, ...): to the bit those of `object_uniforms`.

    plan: the plan of the program.
    instances: the objects.
    eye: the position (3,) of the viewer in the world; the placement is relative to it.
    """
    relative = np.array([instance.world_from_object for instance in instances])
    linear = relative[:, :3, :3].copy()
    relative[:, :3, 3] -= eye
    values: dict[str, Any] = {"u_world_from_object": relative}
    if plan.oriented:
        values["u_normal_from_object"] = normal_matrices(linear)
    if plan.shows == "depth":
        values["u_number"] = [instance.number for instance in instances]
    return _rounded(values)


def _rounded(values: dict[str, Any]) -> Values:
    """Returns the values rounded to float32. Those beyond its range become infinite, which the caller reports."""
    dtype = precision()
    with np.errstate(over="ignore"):
        return {name: np.asarray(value, dtype=np.float64).astype(dtype) for name, value in values.items()}


def material_uniforms(plan: ProgramPlan, material: Any) -> dict[str, Any]:
    """Returns the uniforms of the material's parameters that the program reads. A textured parameter gives the factor of its
    texels.
    """
    values: dict[str, Any] = {}
    for name, use in plan.parameters:
        value = getattr(material, name)
        if channel(use) is not None:
            values[f"u_{name}"] = value.factor if type(material).is_colour(name) else value.factor[0]
        elif use in ("uniform", "grey"):
            values[f"u_{name}"] = value if use == "uniform" else value[0]
    if plan.normal_map:
        # The normal map of a bump map is computed for heights in [0, 1], so the height scales it.
        values["u_normal_scale"] = material.bump_map.height if material.bump_map else material.normal_map.scale
    if plan.turned:
        values["u_turn"] = direction(material)
    if plan.occlusion != "unused":
        values["u_occlusion"] = material.occlusion.strength
    for name in plan.added:
        number = getattr(material, name).add
        # The light that a surface emits is exposed, so that `exposed_uniforms` has what is added to it.
        if name != "emission":
            values[f"u_{name}_add"] = number if type(material).is_colour(name) else number[0]
    for sampler, key in pictures(plan, material).items():
        if sampler in plan.placed:
            values[f"{sampler}_across"], values[f"{sampler}_up"] = placement_of(material, key)
    if plan.alpha != "opaque":
        values["u_alpha"] = material.alpha
    if plan.alpha == "mask":
        values["u_alpha_cutoff"] = material.alpha_cutoff
    return values


def textures(plan: ProgramPlan, material: Brdf) -> dict[str, Texels | Volume]:
    """Sampler name -> texels or table, for every texture that the program reads. Errors: AssetError for a table."""
    texels = {sampler: texels_of(material, key) for sampler, key in pictures(plan, material).items()}
    return {**texels, **tables(plan, material)}


def model_inputs(brdf: Brdf) -> dict[str, NDArray[np.float32] | Volume]:
    """Returns the uniforms of a program that evaluates one model, by name: the parameters, rounded to float32, and the tables.

    Errors: ValueError for a parameter that is a texture; AssetError for a table whose file cannot be read.
    """
    found: dict[str, NDArray[np.float32] | Volume] = {**numbers(brdf), **brdf.volumes()}
    return {f"u_{name}": value for name, value in found.items()}


def tables(plan: ProgramPlan, material: Brdf) -> dict[str, Volume]:
    """Sampler name -> table, for every table that the program reads. Errors: AssetError."""
    return {f"u_{name}": volume for name, volume in material.volumes().items()} if plan.directed else {}


def pictures(plan: ProgramPlan, material: Brdf) -> dict[str, str]:
    """Sampler name -> the material's key that holds the picture, for every texture that the program reads."""
    keys = {f"u_{plan.picture_of(name)}_texture": name for name in plan.textured}
    if plan.alpha_from:
        keys[f"u_{plan.alpha_from}_texture"] = plan.alpha_from
    if plan.normal_map:
        keys["u_normal_map"] = "bump_map" if material.bump_map else "normal_map"
    if plan.direction_map:
        keys["u_direction_map"] = "tangent_direction"
    return keys


def added(plan: ProgramPlan, material: Brdf) -> tuple[str, ...]:
    """Returns the textured parameters, and emission, to whose texels the material adds a number."""
    return tuple(name for name in plan.textured if any(getattr(getattr(material, name), "add", ())))


def placed(plan: ProgramPlan, material: Brdf) -> tuple[str, ...]:
    """Returns the samplers of the textures that the material's keys place by a matrix."""
    return tuple(sampler for sampler, key in pictures(plan, material).items() if placement_of(material, key) != UNPLACED)


def exposed_uniforms(plan: ProgramPlan, instance: Instance, assembly: Assembly, exposure: float) -> Values:
    """Returns the uniforms with the light that a surface shows whatever its normal: u_ambient_radiance, the ambient light (3,)
    that it reflects, if its ambient reflectance is constant, and u_emission, the light that it emits or the factor of the
    emission's texture.

    exposure: the film's exposure [stops].
    """
    values: Values = {}
    if plan.ambient == "constant":
        intensity = ambient_intensity(assembly, instance.lights, exposure)
        values["u_ambient_radiance"] = rounded(ambient_reflectance(instance.material) * intensity)
    if plan.emission != "unused":
        emission = emitted(instance, exposure)
        values["u_emission"] = emission[0] if plan.emission == "grey" else emission
    if "emission" in plan.added:
        values["u_emission_add"] = emitted_beside(instance, exposure)
    return values


def light_uniforms(plan: ProgramPlan, assembly: Assembly, chosen: tuple[int, ...], exposure: float) -> Values:
    """Returns the uniforms of ambient light and of the groups of lights that have an exact count.

    plan: the plan of the program.
    assembly: the assembled scene.
    chosen: the indices of the lights that reach the object.
    exposure: the film's exposure [stops].
    """
    values: Values = {}
    if plan.ambient == "varying":
        values["u_ambient_intensity"] = rounded(ambient_intensity(assembly, chosen, exposure))
    for group in plan.lights:
        if not group.count:
            continue
        lights = [
            light_values(assembly.lights[i], assembly.view.eye, exposure) for i in chosen if group.holds(assembly.lights[i])
        ]
        for name in lights[0]:
            value = np.stack([light[name] for light in lights])
            values[f"u_{group.key}_{name}"] = value[:, 0] if name == "intensity" and group.white else value
    return values


def std140(type_name: str) -> np.dtype[np.void]:
    """Returns the std140 layout of a light's struct: a vec3 is aligned to 16 bytes, a float to 4; the size is a
    multiple of 16.
    """
    names, formats, offsets, offset = [], [], [], 0
    for name, kind in LIGHTS[type_name].fields().items():
        vector = kind == "vec3"
        offset = -(-offset // 16) * 16 if vector else offset
        names.append(name)
        formats.append("3f4" if vector else "f4")
        offsets.append(offset)
        offset += 12 if vector else 4
    return np.dtype({"names": names, "formats": formats, "offsets": offsets, "itemsize": -(-offset // 16) * 16})


def light_pages(group: LightGroup, lights: list[Light], eye: Array, exposure: float, page: int) -> list[NDArray[np.void]]:
    """Returns the lights of a large group as arrays of std140 records, one array per page.

    group: a group of lights without an exact count.
    lights: the lights of the group.
    eye: the position (3,) of the viewer in the world.
    exposure: the film's exposure [stops].
    page: the largest number of lights per page.
    """
    layout = std140(group.type)
    records = np.zeros(len(lights), dtype=layout)
    for index, light in enumerate(lights):
        for name, value in light_values(light, eye, exposure).items():
            records[name][index] = value
    return [records[start : start + page] for start in range(0, len(records), page)]
