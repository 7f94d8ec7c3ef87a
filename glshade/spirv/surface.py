"""Surface: runs the GLSL of a scene's programs at points of its surfaces, where the reference runs its Python functions."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.assembly.assembly import Assembly
from glshade.assembly.instance import Instance
from glshade.glsl.generator import generate
from glshade.glsl.plan import PAGE, ProgramPlan
from glshade.glsl.planner import further_plan, plan_instance
from glshade.glsl.shaders import Shaders
from glshade.glsl.source import Source, Stage
from glshade.glsl.uniforms import exposed_uniforms, light_pages, light_uniforms, object_uniforms, pictures, tables
from glshade.lights import LIGHTS
from glshade.radiance.draw import Draw, wide
from glshade.radiance.sampler import Sampler
from glshade.radiance.surface import Surface, mapped, part_of
from glshade.scene.scene import Scene
from glshade.spirv.arithmetic import FLOAT64, Arithmetic, RandomRounding
from glshade.spirv.compiler import compiled
from glshade.spirv.digits import Digits, Run, measure_digits, measure_errors
from glshade.spirv.machine import Observer, run
from glshade.spirv.module import Module, StageName
from glshade.spirv.table import TableText
from glshade.textures.volume import Volume

Array = NDArray[Any]

# The number of points that are run at once: with a hundred variables of the text they take some 100 MB.
TILE = 1 << 14
# Where a float32 result is asked for, the text is run this many times with operations rounded at random, and as often with
# larger errors. The run that is farthest from the exact result counts. Of eight runs, one nearly always errs by more than half
# as much as any driver does.
RUNS = 4
# Errors that are this many times as large change a smooth result as many times as much, so that their results count with the
# inverse factor. Where the result has a peak or a pole nearby, they change it more: then a driver may err by more than a few
# runs with errors of the usual size tell.
LARGER = 4.0
# The attributes that are unit vectors.
DIRECTIONS = {"a_normal", "v_normal", "a_tangent", "v_tangent"}


@dataclass(frozen=True, eq=False)
class Program:
    """One program of a draw, with its inputs.

    module: the stage that computes the light.
    stage: its text.
    rate: where it runs: flat, gouraud or phong.
    uniforms: name -> value.
    samplers: name -> texture.
    tables: name -> table of the model.
    """

    module: Module
    stage: Stage
    rate: str
    uniforms: Mapping[str, Any]
    samplers: Mapping[str, Sampler]
    tables: Mapping[str, TableText]

    def run(self, surface: Surface, arithmetic: Arithmetic, observer: Observer | None = None) -> Array:
        """Returns the light (N, 3) of N points, linear Rec. 709.

        observer: optional; sees every value that the stage computes.
        Errors: ShaderError.
        """
        return self._light(surface, {**self.uniforms, **_attributes(surface, self.rate)}, arithmetic, observer)

    def digits(self, surface: Surface, seed: int = 1) -> Digits:
        """Returns the digits that the stage loses at N points. Errors: ShaderError."""
        run_, inputs = self._question(surface)
        return measure_digits(run_, inputs, self.stage, seed, DIRECTIONS)

    def errors(self, surface: Surface, seed: int = 1) -> Array:
        """Returns the relative error (N,) of the light of N points with all lines rounded. Errors: ShaderError."""
        tiles = (slice(start, start + TILE) for start in range(0, len(surface.position), TILE))
        return np.concatenate([measure_errors(*self._question(part_of(surface, tile)), seed) for tile in tiles])

    def _question(self, surface: Surface) -> tuple[Run, dict[str, Any]]:
        """Returns a function that runs the stage at N points, and those of its inputs that it reads."""
        inputs = {**self.uniforms, **_attributes(surface, self.rate)}
        read = {variable.name for variable in self.module.variables}
        inputs = {name: value for name, value in inputs.items() if name in read and not isinstance(value, dict)}
        blocks = {name: value for name, value in self.uniforms.items() if isinstance(value, dict)}

        def light(given: Mapping[str, Any], arithmetic: Arithmetic) -> Array:
            return self._light(surface, {**given, **blocks}, arithmetic)

        return light, inputs

    def _light(
        self, surface: Surface, inputs: Mapping[str, Any], arithmetic: Arithmetic, observer: Observer | None = None
    ) -> Array:
        """Returns the light (N, 3) that the stage computes from its inputs."""
        lanes = len(surface.position)
        pictures = {name: _Picture(sampler, surface) for name, sampler in self.samplers.items()}
        given = {**inputs, **pictures, **self.tables}
        outputs = run(self.module, given, lanes, arithmetic, observer=observer, place=self.stage.place).outputs
        if self.rate == "phong":
            return np.asarray(outputs["o_colour"][:, :3])
        if "v_front" in outputs:
            return np.asarray(np.where(surface.side[:, None] > 0, outputs["v_front"], outputs["v_back"]))
        return np.asarray(outputs["v_radiance"])


@dataclass(frozen=True, eq=False)
class SurfaceText:
    """The programs of a draw. Several pages of lights have a program each, whose light is added.

    programs: the programs.
    """

    programs: tuple[Program, ...]

    def __call__(self, surface: Surface) -> Array:
        """Returns the light (N, 3) of N points, linear Rec. 709, in the type of the surface's numbers.

        Float32 attributes ask for the rounding of a float32 driver; the text is then run with random rounding.
        Errors: ShaderError.
        """
        result = np.empty((len(surface.position), 3), surface.position.dtype)
        for start in range(0, len(result), TILE):
            tile = slice(start, start + TILE)
            result[tile] = self._tile(part_of(surface, tile))
        return result

    def with_samplers(self, change: Callable[[Sampler], Sampler]) -> SurfaceText:
        """Returns the text with a function applied to each texture that it reads."""
        return SurfaceText(
            tuple(
                replace(program, samplers={name: change(sampler) for name, sampler in program.samplers.items()})
                for program in self.programs
            )
        )

    def with_tables(self, change: Callable[[Volume], Volume]) -> SurfaceText:
        """Returns the text with a function applied to each table that it reads."""
        return SurfaceText(
            tuple(
                replace(program, tables={name: TableText(change(table.volume)) for name, table in program.tables.items()})
                for program in self.programs
            )
        )

    def _tile(self, surface: Surface) -> Array:
        exact = self._sum(_wide(surface), FLOAT64)
        if surface.position.dtype != np.float32:
            return exact
        # All runs are lanes of one run, which saves time for small surfaces.
        repeated = mapped(_wide(surface), lambda value: np.concatenate([value] * RUNS))
        shape = (RUNS, *exact.shape)
        rounding = (RandomRounding(scale=scale, on_grid=True) for scale in (1.0, LARGER))
        errors = [self._sum(repeated, arithmetic).reshape(shape) - exact for arithmetic in rounding]
        several = np.concatenate([errors[0], errors[1] / LARGER])
        farthest = np.nan_to_num(np.abs(several), nan=np.inf).argmax(axis=0)
        error = np.take_along_axis(several, farthest[None], axis=0)[0]
        # An error as large as the brightest point says that there is a pole nearby: then float32 determines nothing.
        lost = ~(np.abs(errors[1]).max(axis=0) <= np.abs(exact).max(initial=0.0)) & (error != 0)
        return np.asarray(np.where(lost, np.inf, exact + error))

    def _sum(self, surface: Surface, arithmetic: Arithmetic) -> Array:
        return np.asarray(sum(program.run(surface, arithmetic) for program in self.programs))


def surface_text(scene: Scene, assembly: Assembly, draw: Draw, shaders: Shaders) -> SurfaceText:
    """Returns the programs that draw an instance in linear light.

    Opacity is left out: the reference computes it on its own.
    Errors: ShaderError, MissingLibrary, AssetError.
    """
    programs = _programs(scene, assembly, draw, shaders)
    return SurfaceText(tuple(programs))


def text_plan(instance: Instance, assembly: Assembly) -> ProgramPlan:
    """Returns the plan of the program that is run for an instance: in linear light, and without opacity."""
    return replace(plan_instance(instance, assembly, "linear"), alpha="opaque", alpha_from=None)


def shading_stage(source: Source, rate: str) -> tuple[Stage, StageName]:
    """Returns the stage of a program that computes the light at a shading rate."""
    if rate == "phong" and source.fragment is not None:
        return source.fragment, "fragment"
    return source.vertex, "vertex"


def _programs(scene: Scene, assembly: Assembly, draw: Draw, shaders: Shaders) -> Iterator[Program]:
    """Yields the programs of an instance: one, or one for each page of lights of each of its shares."""
    for share in draw.shares or (draw,):
        yield from _pages(scene, assembly, share, shaders)


def _pages(scene: Scene, assembly: Assembly, draw: Draw, shaders: Shaders) -> Iterator[Program]:
    """Yields the programs of an instance without shares: one, or one for each page of lights."""
    instance, exposure = draw.instance, scene.film.exposure
    plan = text_plan(instance, assembly)
    pages = []
    for group in plan.paged:
        lights = [assembly.lights[i] for i in instance.lights if group.holds(assembly.lights[i])]
        pages.append((group.key, light_pages(group, lights, assembly.view.eye, exposure, PAGE)))
    for index in range(max((len(records) for _, records in pages), default=1)):
        of_page = further_plan(plan, instance, [len(records) for _, records in pages], index) if index else plan
        uniforms: dict[str, Any] = dict(object_uniforms(of_page, instance, assembly.view.eye))
        uniforms |= {} if index else _lights(of_page, instance, assembly, exposure)
        uniforms |= exposed_uniforms(of_page, instance, assembly, exposure)
        for key, records in pages:
            if index < len(records):
                uniforms |= _block(key, records[index])
        yield _program(of_page, draw, assembly, uniforms, shaders)


def _lights(plan: ProgramPlan, instance: Instance, assembly: Assembly, exposure: float) -> dict[str, Any]:
    """Returns the uniforms of the lights that have an exact count. A group of one light has no arrays."""
    single = {f"u_{g.key}_{name}" for g in plan.lights if g.count == 1 for name in LIGHTS[g.type].fields()}
    values = light_uniforms(plan, assembly, instance.lights, exposure)
    return {name: value[0] if name in single else value for name, value in values.items()}


def _program(plan: ProgramPlan, draw: Draw, assembly: Assembly, uniforms: dict[str, Any], shaders: Shaders) -> Program:
    """Returns the program of a plan, which takes attributes that are in world space already."""
    # The reference places vertices itself, so the transforms of the text leave them where they are.
    uniforms |= {
        "u_world_from_object": np.eye(4),
        "u_normal_from_object": np.eye(3),
        "u_clip_from_world": np.eye(4),
        "u_handedness": 1.0,
        "u_viewer": wide(assembly.view.toward_viewer),
    }
    stage, name = shading_stage(generate(plan, shaders), plan.rate)
    material = draw.instance.material
    samplers = {name: draw.sampler(key) for name, key in pictures(plan, material).items()}
    volumes = {name: TableText(volume) for name, volume in tables(plan, material).items()}
    return Program(compiled(stage, name), stage, plan.rate, uniforms, samplers, volumes)


def _block(key: str, records: NDArray[np.void]) -> dict[str, Any]:
    """Returns the inputs of a group's uniform block: a page of lights, filled up with lights of zeros, and their number."""
    names = records.dtype.names or ()
    filled = np.zeros(PAGE, records.dtype)
    filled[: len(records)] = records
    lights = [{name: light[name].astype(np.float64) for name in names} for light in filled]
    return {f"{key}_page": {f"u_{key}": lights}, f"u_{key}_count": len(records)}


def _attributes(surface: Surface, rate: str) -> dict[str, Any]:
    """Returns the inputs of the stage that computes the light."""
    values = {
        "position": surface.position,
        "normal": surface.normal,
        "tangent": surface.tangent,
        "uv": surface.uv,
        "colour": surface.colour,
    }
    given = {name: value for name, value in values.items() if value is not None}
    if rate == "phong":
        return {**{f"v_{name}": value for name, value in given.items()}, "gl_FrontFacing": surface.side > 0}
    # With flat shading, the attributes of the face's centroid have names of their own.
    flat = {"a_centroid": surface.position} | {f"a_centroid_{name}": given[name] for name in ("uv", "colour") if name in given}
    return {**{f"a_{name}": value for name, value in given.items()}, **flat, "gl_VertexID": 0, "gl_InstanceID": 0}


@dataclass(frozen=True, eq=False)
class _Picture:
    """A texture, as the machine reads it.

    sampler: the texture.
    surface: the points at which it is read; their footprints give the level of detail.
    """

    sampler: Sampler
    surface: Surface

    def sample(self, at: Array, level: Array | None, bias: Array, steps: Any) -> Array:
        """Returns the filtered texels (4, n). The level of detail is that of the surface's own texture coordinates."""
        lanes = len(self.surface.position)
        uv = np.broadcast_to(at, (2, lanes)).T * np.array(self.sampler.span)
        if level is None and self.surface.footprint is not None:
            level = self.surface.level_of(self.sampler) + bias
        return np.asarray(self.sampler.sample(uv, None if level is None else np.broadcast_to(level, lanes)).T)

    def fetch(self, at: Array, level: Array) -> Array:
        """Returns the texels (4, n) at integer coordinates (2, n) of a level (n,)."""
        level = np.clip(level, 0, len(self.sampler.starts) - 1).astype(np.intp)
        x, y = at.astype(np.intp)
        return np.asarray(self.sampler.texels[self.sampler.starts[level] + y * self.sampler.widths[level] + x].T)

    def size(self, level: Array) -> tuple[int, int]:
        """Returns width and height of a level [texels]."""
        index = int(level[0])
        return int(self.sampler.widths[index]), int(self.sampler.heights[index])


def _wide(surface: Surface) -> Surface:
    """Returns the surface with float64 numbers."""
    return mapped(surface, lambda value: value.astype(np.float64))
