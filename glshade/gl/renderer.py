"""Renderer: draws scenes on one OpenGL context, and keeps what it compiled and uploaded for the next one."""

from __future__ import annotations

import sys
import warnings
from collections import OrderedDict
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from time import perf_counter
from types import TracebackType
from typing import TYPE_CHECKING, Any, Literal, get_args

import moderngl
import numpy as np
from numpy.typing import NDArray

from glshade.arrays import rounded
from glshade.assembly.assembly import Assembly, Instance
from glshade.assembly.culling import facing
from glshade.errors import SceneError
from glshade.gl.context import Backend, Context, open_context
from glshade.gl.frame import FORMATS, Box, Frame, Storage
from glshade.gl.program import Program
from glshade.gl.textures import upload
from glshade.gl.vertices import Vertices
from glshade.glsl.flat_inputs import with_flat_inputs
from glshade.glsl.generator import PAGE, Source, expand, generate
from glshade.glsl.plan import ProgramPlan, plan_instance
from glshade.glsl.uniforms import Values, ambient_radiance, light_pages, light_uniforms, object_uniforms, textures
from glshade.image.image import Image
from glshade.radiance.readying import ready
from glshade.scene.camera import window
from glshade.scene.digest import digest
from glshade.scene.scene import Film, Rate, Scene
from glshade.textures.texels import Texels
from glshade.version import __version__

if TYPE_CHECKING:
    from glshade.assembly.part import Part
    from glshade.image.layers import Layers

DType = Literal["uint8", "float32"]
# Larger pictures are drawn in tiles: at 8192 x 8192 colour and depth already take 1.25 GiB in float32.
TILE = 8192
# Scenes whose programs and buffers stay at hand; an animation alternates between few.
KEPT_SCENES = 8
KEPT_TEXTURES = 256
# Pixels of the picture a triangle from which on flat inputs save time: measured, with one light and with eight, on llvmpipe.
FLAT_PIXELS = 8


class ApproximateWarning(UserWarning):
    """The picture has a part that is right in kind, but not pixel by pixel."""


@dataclass(eq=False)
class Draw:
    """One draw call, with what it needs set before it."""

    instance: Instance
    plan: ProgramPlan
    program: Program
    vertices: moderngl.VertexArray
    values: Values
    samplers: list[tuple[str, moderngl.Texture]]
    lights: Values
    pages: list[tuple[str, moderngl.Buffer, int]]
    # A further page of lights, added to what the first has drawn.
    added: bool = False


@dataclass(eq=False)
class Prepared:
    """A scene made ready to draw in one storage."""

    scene: Scene
    assembly: Assembly
    draws: list[Draw]
    attributes: dict[str, str] | None = None


class Renderer:
    """Draws scenes. A context manager: `with glshade.Renderer() as renderer: image = renderer.render(scene)`.

    backend: auto, egl, osmesa or standalone; device: an index of `glshade devices`. Errors: ContextError.
    """

    def __init__(self, backend: Backend = "auto", device: int | None = None) -> None:
        self.context: Context = open_context(backend, device)
        self._vertices = Vertices(self.context)
        self._programs: dict[tuple[Source, bool], Program] = {}
        self._frames: dict[tuple[Any, ...], Frame] = {}
        self._textures: OrderedDict[Any, moderngl.Texture] = OrderedDict()
        self._prepared: OrderedDict[tuple[Any, ...], Prepared] = OrderedDict()
        self._buffers: list[NDArray[Any]] = []

    def __enter__(self) -> Renderer:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.release()

    def release(self) -> None:
        """Gives the context and all it holds back to the driver."""
        self.context.release()

    def render(self, scene: Scene, *, dtype: DType = "uint8", shading: Rate | None = None, tile: int | None = None) -> Image:
        """The picture of a scene.

        dtype: "uint8" for the picture as the film encodes it, "float32" for linear light, signed and unclipped. shading:
        overrules every object's. tile: the largest side drawn in one piece [pixels]; left out: what the driver can.
        Errors: SceneError, ShaderError.
        """
        for given, allowed in ((dtype, get_args(DType)), (shading, (None, *get_args(Rate)))):
            if given not in allowed:
                raise ValueError(f"{given!r} is none of {', '.join(map(repr, allowed))}")
        # Another renderer, or another program in this process, may have made its own context current.
        with self.context.gl:
            self.context.gl.gc()
            return self._render(scene, dtype, shading, tile)

    def layers(self, scene: Scene, *, dtype: DType = "float32", shading: Rate | None = None, tile: int | None = None) -> Layers:
        """The picture of a scene with the layers that its film asks for (`aovs`). Arguments and errors as for `render`."""
        from glshade.gl.layers import layers

        return layers(self, scene, dtype, shading, tile)

    def surfaces(self, scene: Scene) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
        """What is seen at the middle of every pixel: (depth (H, W), number (H, W)), as in `glshade.gl.layers`."""
        from glshade.gl.layers import surfaces

        return surfaces(self, scene)

    def shown(
        self,
        scene: Scene,
        part: Part,
        *,
        shading: Rate | None = None,
        tile: int | None = None,
        offsets: Iterable[tuple[float, float]] | None = None,
    ) -> Iterator[NDArray[np.float32]]:
        """(H, W, 4) float32: a part of the scene, linear and premultiplied.

        offsets [pixels]: of a picture each, in place of the one whose samples are the film's. Errors: SceneError, ShaderError.
        """
        scene = part.scene(scene)
        _, _, width, height = scene.film.window
        own = _passes(scene.film, self.context.gl.max_samples)
        for passes in [own] if offsets is None else [[offset] for offset in offsets]:
            pixels = np.empty((height, width, 4), dtype=np.float32)
            with self.context.gl:
                self.context.gl.gc()
                self._fill(self._prepare(scene, shading, "linear", part), passes, False, tile, pixels)
            yield pixels

    def drawing(self, scene: Scene) -> Callable[[], float]:
        """A function that draws the scene's linear picture once more and says how long that took [s].

        By the clock on the wall, until the driver has finished: from the first clear to the last pixel, without assembling,
        uploading and reading back. The first call draws once beforehand, because a first draw compiles. Pictures larger than
        a tile are not for this. Errors: SceneError, ShaderError.
        """
        with self.context.gl:
            prepared = self._prepare(scene, None, "linear")
        film = scene.film
        samples = min(film.samples, self.context.gl.max_samples)
        passes = _passes(film, self.context.gl.max_samples)
        background = _background(film.background, "linear")
        whole = prepared.assembly.view.clip_from_world(self.context.zero_to_one)
        warm = False

        def draw() -> float:
            nonlocal warm
            with self.context.gl as gl:
                # Frames are kept by the renderer, which may have let go of this one since.
                frame = self._frame(film.size, _linear(prepared), samples)
                for _ in range(1 if warm else 2):
                    gl.finish()
                    start = perf_counter()
                    for dx, dy in passes:
                        frame.begin(background, film.crop)
                        self._draw_all(prepared, rounded(window(whole, film.size, dx, dy, *film.size)))
                    gl.finish()
                    seconds = perf_counter() - start
                warm = True
            return seconds

        return draw

    def _render(self, scene: Scene, dtype: DType, shading: Rate | None, tile: int | None) -> Image:
        film = scene.film
        transform = None
        if dtype == "uint8" and film.transformed:
            from glshade.image.view import ViewTransform

            transform = ViewTransform.of(film)
        passes = _passes(film, self.context.gl.max_samples)
        # Drawn straight into 8 bits where nothing has to be averaged or added in linear light afterwards.
        direct = dtype == "uint8" and film.direct and scene.quality.storage in (None, "auto")
        prepared = self._prepare(scene, shading, film.encoding if direct else "linear")
        if direct and any(draw.added or draw.plan.alpha == "blend" for draw in prepared.draws):
            direct = False
            prepared = self._prepare(scene, shading, "linear")
        left, top, width, height = film.window
        on_gpu = dtype == "uint8" and len(passes) == 1 and transform is None
        pixels = self._buffer((height, width, 4), np.uint8 if on_gpu else np.float32)
        self._fill(prepared, passes, direct, tile, pixels)
        image = Image(
            pixels[..., : len(film.background)],
            film.encoding if on_gpu else "linear",
            {} if on_gpu else self._attributes(prepared),
            (left, top),
            film.size if film.crop else None,
        )
        if on_gpu or dtype == "float32":
            return image
        return transform(image) if transform else image.encoded(film.encoding)

    def _fill(
        self, prepared: Prepared, passes: list[tuple[float, float]], direct: bool, tile: int | None, out: NDArray[Any]
    ) -> None:
        """Fills out (H, W, 4) with what the film shows, piece by piece."""
        film = prepared.scene.film
        left, top, *size = film.window
        # Several samples take several times the memory.
        side = min(tile or (TILE if film.samples == 1 else TILE // 2), self.context.largest_side)
        for piece, (x, y, w, h) in _pieces(film, side):
            if [w, h] == size:
                self._draw_piece(prepared, piece, (x, y, w, h), passes, direct, out)
            else:
                part = np.empty((h, w, 4), dtype=out.dtype)
                self._draw_piece(prepared, piece, (x, y, w, h), passes, direct, part)
                out[y - top :, x - left :][:h, :w] = part

    def _draw_piece(
        self,
        prepared: Prepared,
        piece: Box,
        wanted: Box,
        passes: list[tuple[float, float]],
        direct: bool,
        out: NDArray[Any],
    ) -> None:
        """Fills out (h, w, 4) with what is `wanted` of the picture, drawn as part of a piece that may be larger."""
        film = prepared.scene.film
        left, top, *size = piece
        x, y, w, h = wanted
        part = (x - left, y - top, w, h)
        storage = "rgba8" if direct else _linear(prepared)
        frame = self._frame((size[0], size[1]), storage, min(film.samples, self.context.gl.max_samples))
        background = _background(film.background, film.encoding if direct else "linear")
        whole = prepared.assembly.view.clip_from_world(self.context.zero_to_one)
        # float64: the mean of equal numbers is that number.
        total = np.zeros(out.shape) if len(passes) > 1 else None
        for dx, dy in passes:
            clip = rounded(window(whole, film.size, left + dx, top + dy, *size))
            frame.begin(background, None if wanted == piece else part)
            self._draw_all(prepared, clip)
            if out.dtype == np.uint8 and not direct:
                self._encode(frame, film.encoding).readback(out, part[:2])
            elif total is None:
                frame.readback(out, part[:2])
            else:
                one = np.empty(out.shape, dtype=np.float32)
                frame.readback(one, part[:2])
                total += one
        if total is not None:
            out[...] = total / len(passes)

    def _draw_all(self, prepared: Prepared, clip: NDArray[np.float32]) -> None:
        gl = self.context.gl
        gl.enable_only(moderngl.DEPTH_TEST)
        gl.depth_func = ">"
        viewer = rounded(prepared.assembly.view.toward_viewer)
        placed: set[int] = set()
        lit: dict[int, int] = {}
        state: tuple[bool, ...] = ()
        for draw in prepared.draws:
            program = draw.program
            if id(program) not in placed:
                placed.add(id(program))
                program.write("u_clip_from_world", clip)
                program.write("u_viewer", viewer)
            if lit.get(id(program)) != id(draw.lights):
                lit[id(program)] = id(draw.lights)
                for name, value in draw.lights.items():
                    program.write(name, value)
            for name, value in draw.values.items():
                program.write(name, value)
            for unit, (name, texture) in enumerate(draw.samplers):
                texture.use(unit)
                program.set_integer(name, unit)
            for binding, (key, buffer, count) in enumerate(draw.pages):
                buffer.bind_to_uniform_block(binding)
                program.members[f"{key}_page"].binding = binding
                program.set_integer(f"u_{key}_count", count)
            wanted = (draw.plan.alpha == "blend", draw.added, not draw.instance.back_faces, draw.instance.mirrored)
            if wanted != state:
                state = wanted
                self._set_state(*wanted)
            draw.vertices.render()
        gl.fbo.depth_mask = True

    def _set_state(self, blended: bool, added: bool, culled: bool, mirrored: bool) -> None:
        gl = self.context.gl
        (gl.enable if culled else gl.disable)(moderngl.CULL_FACE)
        # The picture is drawn upside down so that row 0 is the top, which turns counter-clockwise into clockwise.
        gl.front_face = "ccw" if mirrored else "cw"
        (gl.enable if blended or added else gl.disable)(moderngl.BLEND)
        if blended or added:
            one, rest = moderngl.ONE, moderngl.ONE_MINUS_SRC_ALPHA
            # Light is added, opacity is not.
            gl.blend_func = (one, one, moderngl.ZERO, one) if added else (one, rest, one, rest)  # type: ignore[assignment]
        # What is added falls on the very surface that its first page has drawn.
        gl.depth_func = "==" if added and not blended else ">"
        gl.fbo.depth_mask = not (blended or added)

    def _encode(self, frame: Frame, encoding: Literal["linear", "srgb"]) -> Frame:
        """An 8-bit frame of what `frame` holds in linear light."""
        texture = frame.resolve()
        picture = self._frame(frame.size, "rgba8", 1)
        output = {"output": f'#include "output/{encoding}.glsl"\n'}
        program = self._program(Source(expand("pass/picture.vert", {}), expand("pass/picture.frag", output)))
        picture.target.scissor = frame.part  # type: ignore[assignment]
        picture.target.use()
        self.context.gl.enable_only(moderngl.NOTHING)
        texture.use(0)
        program.set_integer("u_linear", 0)
        self.context.gl.vertex_array(program.gl, []).render(moderngl.TRIANGLES, vertices=3)
        return picture

    def _prepare(
        self, scene: Scene, shading: Rate | None, encoding: Literal["linear", "srgb"], part: Part | None = None
    ) -> Prepared:
        """Everything that does not change while the scene does not."""
        key = (id(scene), shading, encoding, part)
        kept = self._prepared.get(key)
        if kept is None:
            assembly = ready(scene, shading, part)
            kept = Prepared(scene, assembly, list(self._draws(scene, assembly, encoding)))
            self._prepared[key] = kept
            if len(self._prepared) > KEPT_SCENES:
                self._prepared.popitem(last=False)
        self._prepared.move_to_end(key)
        return kept

    def _draws(self, scene: Scene, assembly: Assembly, encoding: Literal["linear", "srgb"]) -> Iterator[Draw]:
        """Opaque objects by program, then blended ones from back to front."""
        opaque: list[tuple[ProgramPlan, Instance]] = []
        blended: list[tuple[ProgramPlan, Instance]] = []
        shared: dict[tuple[ProgramPlan, tuple[int, ...]], tuple[Values, list[list[tuple[str, moderngl.Buffer, int]]]]] = {}
        for instance in assembly.instances:
            plan = plan_instance(instance, assembly, encoding)
            (blended if plan.alpha == "blend" else opaque).append((plan, instance))
        order = {plan: index for index, (plan, _) in reversed(list(enumerate(opaque)))}
        opaque.sort(key=lambda pair: order[pair[0]])
        if blended:
            warnings.warn(
                "blended surfaces are drawn back to front, triangle by triangle: approximate where they cross",
                ApproximateWarning,
                stacklevel=4,
            )
            middles = [i.world_from_object[:3, 3] + i.world_from_object[:3, :3] @ _middle(i) for _, i in blended]
            depths = assembly.view.depth(np.array(middles))
            blended = [blended[i] for i in np.argsort(-depths, kind="stable")]
        exposure = scene.film.exposure
        triangles = sum(len(instance.mesh.triangles) for instance in assembly.instances)
        flat = self.context.is_software and triangles * FLAT_PIXELS <= scene.film.size[0] * scene.film.size[1]
        for plan, instance in (*opaque, *blended):
            key = (plan, instance.lights)
            if key not in shared:
                lights = light_uniforms(plan, assembly, instance.lights, exposure)
                _check_finite(instance, lights)
                shared[key] = lights, self._pages(plan, assembly, instance.lights, exposure)
            yield from self._draw(plan, instance, assembly, exposure, flat, *shared[key])

    def _draw(
        self,
        plan: ProgramPlan,
        instance: Instance,
        assembly: Assembly,
        exposure: float,
        flat: bool,
        lights: Values,
        pages: list[list[tuple[str, moderngl.Buffer, int]]],
    ) -> Iterator[Draw]:
        """The first draw of an instance, and one more for every further page of lights."""
        blended = plan.alpha == "blend"
        triangles = _back_to_front(instance, assembly) if blended else facing(instance, assembly.view)
        for index in range(max((len(group) for group in pages), default=1)):
            here = plan
            if index:
                # What is counted exactly, and ambient light, has been drawn with the first page.
                many = tuple(group for group, of in zip(_paged(plan), pages, strict=True) if index < len(of))
                here = replace(plan, lights=many, ambient="none", parameters=_without_ambient(plan, instance))
            program = self._program(generate(here), flat)
            values = object_uniforms(here, instance, assembly.view.eye)
            if here.ambient == "constant":
                values |= ambient_radiance(instance, assembly, exposure)
            _check_finite(instance, values)
            samplers = [(name, self._texture(wanted)) for name, wanted in textures(here, instance.material).items()]
            vertices = self._vertices.array(instance.mesh, program, triangles)
            page = [group[index] for group in pages if index < len(group)]
            yield Draw(instance, here, program, vertices, values, samplers, {} if index else lights, page, bool(index))

    def _pages(
        self, plan: ProgramPlan, assembly: Assembly, chosen: tuple[int, ...], exposure: float
    ) -> list[list[tuple[str, moderngl.Buffer, int]]]:
        result = []
        for group in _paged(plan):
            lights = [assembly.lights[i] for i in chosen if group.holds(assembly.lights[i])]
            records = light_pages(group, lights, assembly.view.eye, exposure, PAGE)
            whole = PAGE * records[0].dtype.itemsize
            result.append([(group.key, self.context.gl.buffer(r.tobytes().ljust(whole, b"\0")), len(r)) for r in records])
        return result

    def _attributes(self, prepared: Prepared) -> dict[str, str]:
        """What a float picture says of its making."""
        if prepared.attributes is None:
            prepared.attributes = {
                "glshade:version": __version__,
                "glshade:renderer": f"{self.context.renderer}; {self.context.version}",
                "glshade:scene": digest(prepared.scene),
                "glshade:camera": prepared.scene.camera.model_dump_json(exclude_none=True),
            }
        return prepared.attributes

    def _program(self, source: Source, flat: bool = False) -> Program:
        """flat: with what is uniform in the fragment stage as flat inputs; the pictures are the same."""
        if (source, flat) not in self._programs:
            written = with_flat_inputs(source, self.context.passed_vectors) if flat else source
            self._programs[source, flat] = Program(self.context, written)
        return self._programs[source, flat]

    def _texture(self, texels: Texels) -> moderngl.Texture:
        key = (texels, texels.path.stat().st_mtime_ns)
        if key not in self._textures:
            self._textures[key] = upload(self.context, texels)
            if len(self._textures) > KEPT_TEXTURES:
                self._textures.popitem(last=False)
        return self._textures[key]

    def _frame(self, size: tuple[int, int], storage: Storage, samples: int) -> Frame:
        key = (size, storage, samples)
        # The one used last stands last; the one that is being drawn into is never the first.
        frame = self._frames.pop(key, None)
        if frame is None:
            if len(self._frames) > 2:
                # Not released: what is forgotten is collected, and moderngl stumbles over what is both.
                self._frames.pop(next(iter(self._frames)))
            frame = Frame(self.context, size, storage, samples)
        self._frames[key] = frame
        return frame

    def _buffer(self, shape: tuple[int, ...], dtype: Any) -> NDArray[Any]:
        """An array for a picture: one that no image holds any more, else a new one, which costs a page fault every 4 KiB."""
        for buffer, held in zip(self._buffers, _references(self._buffers), strict=True):
            if held == FREE and buffer.shape == shape and buffer.dtype == dtype:
                return buffer
        self._buffers = [*self._buffers[-1:], np.empty(shape, dtype=dtype)]
        return self._buffers[-1]


def _references(arrays: list[NDArray[Any]]) -> list[int]:
    """How often each array is referred to; the list's own, and this function's, count too."""
    return [sys.getrefcount(array) for array in arrays]


# What _references counts for an array that nobody else holds: it differs between versions of Python.
FREE = _references([np.empty(0)])[0]


def _linear(prepared: Prepared) -> Storage:
    """What linear light is kept in. Errors: SceneError for one that has nothing below zero under a negative light."""
    chosen = prepared.scene.quality.storage
    if chosen is None or chosen == "auto":
        return "rgba32f"
    if chosen == "r11f_g11f_b10f" and any(light.is_negative for light in prepared.assembly.lights):
        raise SceneError("quality.storage: r11f_g11f_b10f has nothing below zero, and a light of this scene is negative")
    if FORMATS[chosen][1] == 3 and (len(prepared.scene.film.background) == 4 or _blends(prepared)):
        raise SceneError(f"quality.storage: {chosen} has no alpha, which this scene asks for")
    return chosen


def _blends(prepared: Prepared) -> bool:
    return any(draw.plan.alpha == "blend" for draw in prepared.draws)


def _check_finite(instance: Instance, values: Values) -> None:
    """Errors: SceneError that names what is not finite."""
    for name, value in values.items():
        if not np.isfinite(value).all():
            raise SceneError(f"{instance.name}: {name.removeprefix('u_')} is too large for float32")


def _paged(plan: ProgramPlan) -> list[Any]:
    return [group for group in plan.lights if group.count == 0]


def _without_ambient(plan: ProgramPlan, instance: Instance) -> tuple[tuple[str, str], ...]:
    lit = instance.material.asked("light")
    return tuple((name, use if name in lit else "unused") for name, use in plan.parameters)


def _middle(instance: Instance) -> NDArray[np.float64]:
    middle: NDArray[np.float64] = instance.mesh.positions.mean(axis=0, dtype=np.float64)
    return middle


def _back_to_front(instance: Instance, assembly: Assembly) -> NDArray[np.uint32]:
    centroids = instance.mesh.positions[instance.mesh.triangles].mean(axis=1, dtype=np.float64)
    world = centroids @ instance.world_from_object[:3, :3].T + instance.world_from_object[:3, 3]
    return instance.mesh.triangles[np.argsort(-assembly.view.depth(world), kind="stable")]


def _sample_passes(samples: int, available: int) -> list[tuple[float, float]]:
    """Offsets [pixels] of the pictures that make up the samples: one, or several where the driver has too few of its own."""
    count = max(1, -(-samples // max(available, 1)))
    # Together with a driver's rotated grid of `available`, no two samples share a row or a column.
    share = 1 / (count * max(available, 1))
    return [((i - (count - 1) / 2) * share, (3 * i % count - (count - 1) / 2) * share) for i in range(count)]


def _passes(film: Film, available: int) -> list[tuple[float, float]]:
    """Offsets [pixels] of all the pictures whose mean is the picture: spread evenly over a pixel, and over a sample's share."""
    n = film.supersample
    shifts = [(i + 0.5) / n - 0.5 for i in range(n)]
    samples = _sample_passes(film.samples, available)
    return [(x + dx, y + dy) for y in shifts for x in shifts for dx, dy in samples]


def _pieces(film: Film, side: int) -> Iterator[tuple[Box, Box]]:
    """(what is drawn in one piece, what of it is wanted), boxes of the whole picture.

    Pieces, `side` large at most, are those of the whole picture, so that a crop of it has the same bits.
    """
    width, height = film.size
    left, top, w, h = film.window
    # At the border of what it draws, a driver moves a centroid to the samples that are there; an apron keeps that out.
    apron = 2 if film.samples > 1 and max(width, height) > side else 0
    # An even number: derivatives are taken in blocks of two by two pixels, which must not shift.
    side = max((side - 2 * apron) & ~1, 2)
    for x in range(left // side * side, left + w, side):
        for y in range(top // side * side, top + h, side):
            x0, y0 = max(x - apron, 0), max(y - apron, 0)
            x1, y1 = max(x, left), max(y, top)
            yield (
                (x0, y0, min(x + side + apron, width) - x0, min(y + side + apron, height) - y0),
                (x1, y1, min(x + side, left + w) - x1, min(y + side, top + h) - y1),
            )


def _background(colour: tuple[float, ...], encoding: Literal["linear", "srgb"]) -> tuple[float, float, float, float]:
    """Four numbers, premultiplied, encoded as the frame is."""
    from glshade.image.srgb import linear_to_srgb

    alpha = colour[3] if len(colour) == 4 else 1.0
    rgb = [c * alpha for c in colour[:3]]
    r, g, b = (float(c) for c in (linear_to_srgb(np.array(rgb)) if encoding == "srgb" else rgb))
    return r, g, b, alpha


def render(
    scene: Scene,
    *,
    dtype: DType = "uint8",
    shading: Rate | None = None,
    backend: Backend = "auto",
    device: int | None = None,
) -> Image:
    """One picture, on a context of its own; for several, keep a Renderer. Arguments and errors as there."""
    with Renderer(backend, device) as renderer:
        return renderer.render(scene, dtype=dtype, shading=shading)
