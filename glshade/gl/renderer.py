"""Renderer: draws scenes on one OpenGL context, and caches programs, meshes and textures for the next scene."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from functools import lru_cache
from time import perf_counter
from types import TracebackType
from typing import TYPE_CHECKING, Any, Literal, get_args

import moderngl
import numpy as np
from numpy.typing import NDArray

from glshade.arrays import rounded
from glshade.assembly.assembly import Assembly, seen_anew
from glshade.gl.background import covered, surrounded
from glshade.gl.context import Backend, Context, open_context
from glshade.gl.drawing import Drawing
from glshade.gl.frame import Box, Frame
from glshade.gl.preparation import DrawCall, Encoding, Prepared, Preparer
from glshade.gl.resources import Resources, frame_size
from glshade.gl.tiles import TILE, Offset, passes, pieces
from glshade.glsl.generator import encoder
from glshade.glsl.shaders import Shaders, current
from glshade.glsl.source import Rewrite
from glshade.image.image import Image
from glshade.image.srgb import linear_to_srgb
from glshade.lru import Lru
from glshade.radiance.readying import ready
from glshade.scene.camera import Camera, window
from glshade.scene.digest import scene_digest
from glshade.scene.film import Film
from glshade.scene.models import Folders, paths, use_models
from glshade.scene.object import Rate
from glshade.scene.scene import Scene
from glshade.version import __version__

if TYPE_CHECKING:
    from glshade.assembly.part import Part
    from glshade.image.layers import Layers

DType = Literal["uint8", "float32"]
# The limits of the cache of prepared scenes: their number, and their size [bytes]. An animation alternates between few scenes.
SCENES, SCENES_SIZE = 8, 96 << 20
# `render_many` draws pictures into frames of their own, and reads them back when the frames take this much memory [bytes].
TOGETHER = 64 << 20


@dataclass(frozen=True, eq=False)
class _Job:
    """A picture that is ready to draw.

    prepared: its scene.
    sample_offsets: the offsets of the pictures to average [pixels].
    direct: whether the programs write the encoded picture.
    on_gpu: whether the picture is read from the GPU in its final 8 bits.
    dtype: the type of its pixels.
    transform: the view transform that is applied on the CPU; None for the film's encoding.
    """

    prepared: Prepared
    sample_offsets: list[Offset]
    direct: bool
    on_gpu: bool
    dtype: DType
    transform: Callable[[Image], Image] | None


@dataclass(frozen=True, eq=False)
class _Drawn:
    """A picture that was drawn into a frame and is not yet read.

    job: the picture.
    number: its number.
    place: the number of the frame.
    frame: the frame.
    part: the pixels of the frame to read.
    """

    job: _Job
    number: int
    place: int
    frame: Frame
    part: Box


class Renderer:
    """Draws scenes. It is a context manager: `with glshade.Renderer() as renderer: image = renderer.render(scene)`.

    context: the OpenGL context.
    resources: the cached programs, meshes, textures and frames.
    rewrite: optional; a function that is applied to every program's Source before it is compiled.
    shaders: optional; the shader files to draw with, as they were when they were read. Default: the files on disk, as they are
        when a picture is drawn.
    last_prepared: the scene of the last picture, made ready to draw; None before the first picture.
    """

    def __init__(
        self,
        backend: Backend = "auto",
        device: int | None = None,
        *,
        shaders: Folders | None = None,
        models: Folders | None = None,
    ) -> None:
        """Opens an OpenGL context. An edited shader or model file takes effect from the next picture on.

        backend: auto, egl, osmesa or standalone.
        device: optional; an index of `glshade devices`.
        shaders: optional; one folder or several, whose GLSL files replace the shipped ones of the same name.
        models: optional; one folder or several with the user's own reflectance models and lights. Their Python files are
            executed (glshade.scene.models).
        Errors: ContextError, ShaderError, SceneError.
        """
        use_models(models)
        self.rewrite: Rewrite | None = None
        self.shaders: Shaders | None = None
        self.last_prepared: Prepared | None = None
        self._folders = paths(shaders)
        current(self._folders)
        self.context: Context = open_context(backend, device)
        self.resources = Resources(self.context)
        self._preparer = Preparer(self.resources)
        self._prepared: Lru[tuple[Any, ...], Prepared] = Lru(SCENES_SIZE, most=SCENES)
        # A context is current in one thread at most. Whoever draws enters it.
        self.context.leave()

    def __enter__(self) -> Renderer:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.release()

    def release(self) -> None:
        """Destroys the context and all of its objects. A second call does nothing; any other use raises ContextError."""
        self.context.release()

    def render(self, scene: Scene, *, dtype: DType = "uint8", shading: Rate | None = None, tile: int | None = None) -> Image:
        """Returns the picture of a scene.

        scene: the scene to draw.
        dtype: "uint8" for the picture in the film's encoding, "float32" for linear light, signed and unclipped.
        shading: optional; replaces the shading rate of every object.
        tile: optional; the largest side that is drawn in one piece [pixels]. Default: the largest that glshade and the driver
            both allow.
        Errors: ValueError, SceneError, ShaderError.
        """
        _check_choices(dtype, shading)
        # Another renderer, or another program in this process, may have made its own context current.
        with self.context.gl:
            self.context.gl.gc()
            return self._picture(self._job(scene, dtype, shading), tile)

    def render_many(
        self, scene: Scene, cameras: Iterable[Camera | str], *, dtype: DType = "uint8", shading: Rate | None = None
    ) -> NDArray[Any]:
        """Returns the pictures (N, H, W, 3 or 4) of a scene through N cameras, each as `render` returns it.

        Everything that does not depend on the camera is prepared once. Small pictures are read back together, so that the
        driver draws one while the next is prepared.

        scene: the scene to draw.
        cameras: cameras, or names of the scene's `cameras`. All pictures must have one size.
        dtype, shading: as for `render`.
        Errors: ValueError for no cameras, and for pictures of several sizes; KeyError for a name that the scene does not have;
        SceneError, ShaderError.
        """
        chosen = [scene.cameras[camera] if isinstance(camera, str) else camera for camera in cameras]
        _check_choices(dtype, shading)
        if not chosen:
            raise ValueError("there are no cameras")
        scenes = [scene.through(camera) for camera in chosen]
        sizes = [each.film.window[2:] for each in scenes]
        for number, size in enumerate(sizes):
            if size != sizes[0]:
                raise ValueError(f"camera {number} gives a picture of another size; set the film's size for all")
        width, height = sizes[0]
        channels = len(scene.film.background)
        pictures = np.empty((len(scenes), height, width, channels), dtype=dtype)
        with self.context.gl:
            self.context.gl.gc()
            drawn: list[_Drawn] = []
            job: _Job | None = None
            boxes: tuple[Box, Box] | None = None
            for number, each in enumerate(scenes):
                following = self._following(job, each) if job else None
                job = following or self._job(each, dtype, shading)
                if following is None:
                    boxes = self._only_piece(job)
                if boxes is None:
                    pictures[number] = self._picture(job).pixels
                    continue
                drawn.append(self._drawn(job, boxes, number, len(drawn)))
                if (len(drawn) + 1) * frame_size(drawn[-1].frame) > TOGETHER:
                    self._collect(drawn, pictures)
                    drawn = []
            self._collect(drawn, pictures)
        return pictures

    def _following(self, job: _Job, scene: Scene) -> _Job | None:
        """Returns the picture of a scene that shares all but its camera and perhaps its film with the last picture's scene.

        The result is None where more than the view has to be prepared.
        """
        prepared = self._seen_from(job.prepared, scene) if job.prepared.scene.film is scene.film else None
        if prepared is None:
            return None
        self.last_prepared = prepared
        return replace(job, prepared=prepared)

    def _only_piece(self, job: _Job) -> tuple[Box, Box] | None:
        """Returns the boxes of a picture that is one drawing, as `pieces` yields them; None for other pictures."""
        single = len(job.sample_offsets) == 1 and (job.on_gpu or job.dtype == "float32")
        boxes = list(pieces(job.prepared.scene.film, self._side(job.prepared.scene.film, None))) if single else []
        return boxes[0] if len(boxes) == 1 else None

    def _drawn(self, job: _Job, boxes: tuple[Box, Box], number: int, place: int) -> _Drawn:
        """Draws a picture into a frame of its own, without waiting for the driver.

        job: the picture.
        boxes: as `_only_piece` returns them.
        number: the number of the picture.
        place: the number of pictures that are drawn already and not yet read.
        """
        frame, part = self._begun(job.prepared, *boxes, job.direct, place)
        self._draw_shifted(job.prepared, frame, *boxes, job.sample_offsets[0], job.direct)
        return _Drawn(job, number, place, frame, part)

    def _collect(self, drawn: list[_Drawn], pictures: NDArray[Any]) -> None:
        """Copies drawn pictures into the array of all pictures (N, H, W, channels)."""
        finished = []
        for each in drawn:
            each.frame.resolve()
            if each.job.on_gpu and not each.job.direct:
                prepared = each.job.prepared
                each.frame.part = each.part
                finished.append(self._encode(each.frame, prepared.scene.film.encoding, prepared.shaders, each.place))
            else:
                finished.append(each.frame)
        _, height, width, channels = pictures.shape
        pixels = np.empty((height, width, 4), dtype=pictures.dtype)
        for each, frame in zip(drawn, finished, strict=True):
            frame.read(pixels, each.part[:2])
            pictures[each.number] = pixels[..., :channels]

    def layers(self, scene: Scene, *, dtype: DType = "float32", shading: Rate | None = None, tile: int | None = None) -> Layers:
        """Returns the picture of a scene with the layers that its film asks for (`aovs`). Arguments and errors as
        for `render`.
        """
        from glshade.gl.layers import draw_layers

        return draw_layers(self, scene, dtype, shading, tile)

    def surfaces(self, scene: Scene) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
        """Returns (depth (H, W), object number (H, W)) at the centres of the pixels; see `glshade.gl.layers.surfaces`."""
        from glshade.gl.layers import surfaces

        return surfaces(self, scene)

    def draw_part(
        self,
        scene: Scene,
        part: Part,
        *,
        shading: Rate | None = None,
        tile: int | None = None,
        offsets: Iterable[Offset] | None = None,
    ) -> Iterator[NDArray[np.float32]]:
        """Yields pictures (H, W, 4) of a part of the scene, in float32, linear and premultiplied.

        scene: the scene to draw.
        part: the part of its light, or the property of its surfaces, that is drawn.
        shading: optional; replaces the shading rate of every object.
        tile: optional; the largest side that is drawn in one piece [pixels].
        offsets: optional; (right, down) [pixels]. Each gives a picture with one sample per pixel, shifted from the pixel's
            centre. Default: one picture with the film's samples.
        Errors: SceneError, ShaderError.
        """
        scene = part.scene(scene)
        _, _, width, height = scene.film.window
        own = passes(scene.film, self.context.gl.max_samples)
        for sample_offsets in [own] if offsets is None else [[offset] for offset in offsets]:
            pixels = np.empty((height, width, 4), dtype=np.float32)
            with self.context.gl:
                self.context.gl.gc()
                self._fill(self.prepare(scene, shading, "linear", part), sample_offsets, False, tile, pixels)
            yield pixels

    def drawing(self, scene: Scene) -> Callable[[], float]:
        """Returns a function that draws the scene's linear picture and returns the time that the drawing took [s].

        It measures wall-clock time from the first clear until the driver has finished, without assembling, uploading and
        reading back. Its first call draws twice and times the second drawing, because drivers compile at the first one.
        The whole picture is drawn in one piece, so it must not be larger than the driver's largest frame.
        Errors: SceneError, ShaderError.
        """
        with self.context.gl:
            prepared = self.prepare(scene, None, "linear")
        film = scene.film
        samples = min(film.samples, self.context.gl.max_samples)
        sample_offsets = passes(film, self.context.gl.max_samples)
        background = _background(film.background, "linear")
        whole = prepared.assembly.view.clip_from_world(self.context.zero_to_one)
        warm = False

        def draw() -> float:
            nonlocal warm
            with self.context.gl as gl:
                # The frame is looked up at every call, since the cache may have evicted it.
                frame = self.resources.frame(film.size, prepared.linear_storage, samples)
                for _ in range(1 if warm else 2):
                    gl.finish()
                    start = perf_counter()
                    for dx, dy in sample_offsets:
                        frame.begin(background, film.crop)
                        self.draw(prepared, rounded(window(whole, film.size, dx, dy, *film.size)))
                    gl.finish()
                    seconds = perf_counter() - start
                warm = True
            return seconds

        return draw

    def prepare(
        self,
        scene: Scene,
        shading: Rate | None,
        encoding: Encoding,
        part: Part | None = None,
        assembly: Assembly | None = None,
    ) -> Prepared:
        """Returns the scene ready to draw, from the cache if neither the scene nor a shader file has changed.

        The context must be current.
        scene: the scene to draw.
        shading: optional; replaces the shading rate of every object.
        encoding: the encoding that the programs write.
        part: optional; the part of the scene's light, or the property of its surfaces, that is drawn.
        assembly: optional; the assembly of the same scene for another encoding, if it is known already.
        Errors: SceneError, ShaderError.
        """
        self.context.check_open()
        key = (id(scene), shading, encoding, part, self.rewrite)
        prepared = self._prepared.get(key)
        if prepared is None or prepared.scene is not scene or not self._is_current(prepared):
            prepared = self._seen_anew(scene, key)
            if prepared is None:
                assembly = assembly or ready(scene, shading, part)
                prepared = self._preparer.prepare(scene, assembly, encoding, self.current_shaders(), self.rewrite)
            self._prepared.put(key, prepared, prepared.size)
        return prepared

    def _seen_anew(self, scene: Scene, key: tuple[Any, ...]) -> Prepared | None:
        """Returns the scene ready to draw if it differs from a prepared scene in its camera alone; else None.

        key: the scene's key in the cache.
        """
        # The assembly of a part of the light has other instances than the scene.
        if key[3] is not None:
            return None
        for known, before in self._prepared.newest_first():
            if known[1:] == key[1:] and scene.differs_in_camera(before.scene) and self._is_current(before):
                return self._seen_from(before, scene)
        return None

    def _seen_from(self, before: Prepared, scene: Scene) -> Prepared | None:
        """Returns a scene ready to draw that differs from a prepared one, which is current, in its camera alone.

        The result is None where its programs may differ.
        """
        # A refined mesh, which depends on the view, belongs to one instance.
        refined = any(call.plan.rate == "gouraud" and call.instance.quality.refine for call in before.calls)
        if refined:
            return None
        assembly = seen_anew(before.assembly, scene)
        return None if assembly is None else self._preparer.seen_anew(before, scene, assembly)

    def age(self) -> None:
        """Marks everything that is cached as unused. Whatever later pictures need counts as used again."""
        self.resources.age()
        self._prepared.age()

    def evict_unused(self) -> None:
        """Frees everything that is cached and that no picture has needed since the last call of `age`."""
        self._prepared.evict_unused()
        self.resources.evict_unused()
        with self.context.gl:
            self.context.gl.gc()

    def current_shaders(self) -> Shaders:
        """Returns the shader files to draw with. Errors: ShaderError."""
        return current(self._folders) if self.shaders is None else self.shaders

    def _is_current(self, prepared: Prepared) -> bool:
        """Returns whether a prepared scene has the shader files to draw with."""
        return prepared.is_current() if self.shaders is None else prepared.shaders is self.shaders

    def draw(self, prepared: Prepared, clip: NDArray[np.float32], calls: Iterable[DrawCall] | None = None) -> None:
        """Draws into the bound framebuffer. The context must be current.

        prepared: the scene.
        clip: the matrix (4, 4) from positions relative to the eye to clip space.
        calls: optional; the draw calls to execute. Default: all of the scene.
        """
        viewer = rounded(prepared.assembly.view.toward_viewer)
        Drawing(self.context, clip, viewer).draw(prepared.calls if calls is None else calls)

    def _job(self, scene: Scene, dtype: DType, shading: Rate | None) -> _Job:
        """Returns a picture that is ready to draw. The arguments are those of `render`."""
        film = scene.film
        transform = None
        if dtype == "uint8" and film.transformed:
            from glshade.image.view import ViewTransform

            transform = ViewTransform.find(film.ocio, film.display, film.view)
        sample_offsets = passes(film, self.context.gl.max_samples)
        # A picture is drawn directly into 8 bits if no samples, layers or pages have to be averaged or added in linear light.
        direct = dtype == "uint8" and film.direct and scene.quality.storage in (None, "auto")
        prepared = self.prepare(scene, shading, film.encoding if direct else "linear")
        if direct and (prepared.blends or any(call.added for call in prepared.calls)):
            direct = False
            prepared = self.prepare(scene, shading, "linear", assembly=prepared.assembly)
        self.last_prepared = prepared
        on_gpu = dtype == "uint8" and len(sample_offsets) == 1 and transform is None
        return _Job(prepared, sample_offsets, direct, on_gpu, dtype, transform)

    def _picture(self, job: _Job, tile: int | None = None) -> Image:
        """Draws a picture and returns it."""
        scene = job.prepared.scene
        film = scene.film
        left, top, width, height = film.window
        pixels = self.resources.pixels((height, width, 4), np.uint8 if job.on_gpu else np.float32)
        self._fill(job.prepared, job.sample_offsets, job.direct, tile, pixels)
        image = Image(
            pixels[..., : len(film.background)],
            film.encoding if job.on_gpu else "linear",
            {"glshade:renderer": self._drawn_by} if job.on_gpu else self._attributes(job.prepared),
            (left, top),
            film.size if film.crop else None,
            job.prepared.assembly.calibration(scene),
        )
        if job.on_gpu or job.dtype == "float32":
            return image
        return job.transform(image) if job.transform else image.encoded(film.encoding)

    def _fill(
        self, prepared: Prepared, sample_offsets: list[Offset], direct: bool, tile: int | None, out: NDArray[Any]
    ) -> None:
        """Fills an array with the pixels of the film's window, piece by piece.

        prepared: the scene.
        sample_offsets: the offsets of the pictures to average [pixels].
        direct: whether the programs write the encoded picture.
        tile: the largest side that is drawn in one piece [pixels]; None for the default.
        out: the array (H, W, 4), uint8 or float32.
        """
        film = prepared.scene.film
        left, top, *size = film.window
        side = self._side(film, tile)
        for piece, (x, y, w, h) in pieces(film, side):
            if [w, h] == size:
                self._draw_piece(prepared, piece, (x, y, w, h), sample_offsets, direct, out)
            else:
                part = np.empty((h, w, 4), dtype=out.dtype)
                self._draw_piece(prepared, piece, (x, y, w, h), sample_offsets, direct, part)
                out[y - top :, x - left :][:h, :w] = part

    def _draw_piece(
        self, prepared: Prepared, piece: Box, wanted: Box, sample_offsets: list[Offset], direct: bool, out: NDArray[Any]
    ) -> None:
        """Fills `out` (h, w, 4) with the wanted box of the picture. The box is part of a piece, which may be larger."""
        film = prepared.scene.film
        # Frames in linear light, and those of several samples, take so long to clear, resolve and encode that it matters.
        box = covered(prepared.assembly, film, wanted) if not direct or film.samples > 1 else None
        if box is not None and box != wanted:
            inner = np.empty((box[3], box[2], 4), dtype=out.dtype)
            self._draw_box(prepared, piece, box, sample_offsets, direct, inner)
            surrounded(inner, box, wanted, out)
        else:
            self._draw_box(prepared, piece, wanted, sample_offsets, direct, out)

    def _draw_box(
        self, prepared: Prepared, piece: Box, wanted: Box, sample_offsets: list[Offset], direct: bool, out: NDArray[Any]
    ) -> None:
        """Does what `_draw_piece` does, but draws every pixel of the wanted box."""
        film = prepared.scene.film
        frame, part = self._begun(prepared, piece, wanted, direct)
        # The sum is float64, so that the mean of equal numbers is exactly that number.
        total = np.zeros(out.shape) if len(sample_offsets) > 1 else None
        for offset in sample_offsets:
            self._draw_shifted(prepared, frame, piece, wanted, offset, direct)
            if out.dtype == np.uint8 and not direct:
                self._encode(frame, film.encoding, prepared.shaders).readback(out, part[:2])
            elif total is None:
                frame.readback(out, part[:2])
            else:
                picture = np.empty(out.shape, dtype=np.float32)
                frame.readback(picture, part[:2])
                total += picture
        if total is not None:
            out[...] = total / len(sample_offsets)

    def _side(self, film: Film, tile: int | None) -> int:
        """Returns the largest side that is drawn in one piece [pixels]. tile: as for `render`."""
        # With several samples per pixel, a frame takes several times the memory, so tiles are smaller.
        return min(tile or (TILE if film.samples == 1 else TILE // 2), self.context.largest_side)

    def _begun(self, prepared: Prepared, piece: Box, wanted: Box, direct: bool, number: int = 0) -> tuple[Frame, Box]:
        """Returns the frame for a piece of a picture, and the wanted box in pixels of the frame.

        number: as for `Resources.frame`.
        """
        left, top, width, height = piece
        x, y, w, h = wanted
        storage = "rgba8" if direct else prepared.linear_storage
        samples = min(prepared.scene.film.samples, self.context.gl.max_samples)
        return self.resources.frame((width, height), storage, samples, number), (x - left, y - top, w, h)

    def _draw_shifted(self, prepared: Prepared, frame: Frame, piece: Box, wanted: Box, offset: Offset, direct: bool) -> None:
        """Draws the wanted box of a piece of a picture, shifted by an offset [pixels], into the piece's frame."""
        film = prepared.scene.film
        left, top, *size = piece
        x, y, w, h = wanted
        whole = prepared.assembly.view.clip_from_world(self.context.zero_to_one)
        clip = rounded(window(whole, film.size, left + offset[0], top + offset[1], *size))
        background = _background(film.background, film.encoding if direct else "linear")
        frame.begin(background, None if wanted == piece else (x - left, y - top, w, h))
        self.draw(prepared, clip)

    def _encode(self, frame: Frame, encoding: Encoding, shaders: Shaders, number: int = 0) -> Frame:
        """Returns an 8-bit frame with the encoded colours of a frame in linear light. number: as for `Resources.frame`."""
        texture = frame.resolve()
        picture = self.resources.frame(frame.size, "rgba8", 1, number)
        source = encoder(encoding, shaders)
        if self.shaders is None and not shaders.is_current(source.files):
            source = encoder(encoding, current(self._folders))
        program = self.resources.program(source)
        picture.target.scissor = frame.part  # type: ignore[assignment]
        picture.target.use()
        self.context.gl.enable_only(moderngl.NOTHING)
        texture.use(0)
        program.set_integer("u_linear", 0)
        self.context.gl.vertex_array(program.gl, []).render(moderngl.TRIANGLES, vertices=3)
        return picture

    @property
    def _drawn_by(self) -> str:
        """The names of the OpenGL renderer and version, as a picture's attribute tells them."""
        return f"{self.context.renderer}; {self.context.version}"

    def _attributes(self, prepared: Prepared) -> dict[str, str]:
        """Returns all attributes that tell how a picture was made. Drawing 8 bits directly does not take the time for them."""
        if prepared.attributes is None:
            prepared.attributes = {
                "glshade:version": __version__,
                "glshade:renderer": self._drawn_by,
                "glshade:scene": scene_digest(prepared.scene),
            }
        return prepared.attributes


def _check_choices(dtype: str, shading: str | None) -> None:
    """Raises ValueError for a type of pixels or a shading rate that does not exist."""
    for given, allowed in ((dtype, get_args(DType)), (shading, (None, *get_args(Rate)))):
        if given not in allowed:
            raise ValueError(f"{given!r} is none of {', '.join(map(repr, allowed))}")


@lru_cache
def _background(colour: tuple[float, ...], encoding: Encoding) -> tuple[float, float, float, float]:
    """Returns the background as red, green, blue and alpha, premultiplied and encoded for the frame."""
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
    shaders: Folders | None = None,
    models: Folders | None = None,
) -> Image:
    """Returns the picture of a scene, drawn on a new context. For several pictures, one Renderer is faster.

    The arguments and errors are those of Renderer and Renderer.render.
    """
    with Renderer(backend, device, shaders=shaders, models=models) as renderer:
        return renderer.render(scene, dtype=dtype, shading=shading)
