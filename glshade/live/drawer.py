"""Drawer: the process that alone owns a Renderer, and draws what the server asks for.

A revision with a fault is never drawn: the last good one stays until all faults are mended.
"""

from __future__ import annotations

import hashlib
import io
import os
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from pickle import PickleError
from time import perf_counter
from typing import Any
from weakref import WeakSet

import numpy as np
from numpy.typing import NDArray
from PIL import Image as Pillow

from glshade.errors import SceneError, ShaderError
from glshade.gl.check import problems_of_scene
from glshade.gl.context import DriverFault
from glshade.gl.layers import positions
from glshade.gl.program import Program
from glshade.glsl.generator import generate
from glshade.glsl.planner import explain
from glshade.image.file import format_of
from glshade.image.file import read as read_picture
from glshade.image.image import Image
from glshade.live.child import serve
from glshade.live.controls import controls_of, material_key, object_key
from glshade.live.dependencies import folders_of, leniently_named
from glshade.live.faults import FAULTS, tables, unique
from glshade.live.information import information_of
from glshade.live.layer_pictures import layer_picture
from glshade.live.messages import (
    JPEG,
    PNG,
    Answer,
    Draw,
    Frame,
    Load,
    Loaded,
    Pick,
    Picked,
    ReadSource,
    Restore,
    Save,
    Saved,
    Source,
    View,
)
from glshade.live.revision import Copies, Revision, read
from glshade.live.snapshot import Snapshot, restored
from glshade.live.source import source_files
from glshade.live.views import Views
from glshade.live.worker import RenderWorker
from glshade.problem import Problem
from glshade.radiance.readying import ready
from glshade.scene.models import are_stale

Table = dict[str, Any]
# A moving picture is drawn at half its size where a whole one takes longer than this [s].
SLOW = 0.033
# It is drawn whole again only where that would take less than this share of SLOW, so that the size does not change to and fro.
FAST_AGAIN = 0.7
# The quality of moving pictures, from 1 to 95.
JPEG_QUALITY = 85
# The colour of pixels that are NaN or infinite: magenta, which no other view uses.
NOT_FINITE = (255, 0, 255)
# The names of files and folders in the drawer's folder.
SNAPSHOT, COPIES, TRIED, REFUSED = "snapshot", "textures", "tried", "refused"


class Drawer(RenderWorker):
    """Draws the revisions of one scene."""

    def __init__(self, backend: str, device: str, folder: str) -> None:
        """Does not open a context yet.

        backend, device: as for RenderWorker.
        folder: the folder for the snapshot and the copies of textures.
        """
        super().__init__(backend, device)
        self.handlers = {
            Load: self._load,
            Restore: self._restore,
            Draw: self._draw,
            Save: self._save,
            Pick: self._pick,
            ReadSource: self._source,
        }
        self._folder = Path(folder)
        # The copies of an earlier drawer stay, because the snapshot may name them.
        self._copies = Copies(self._folder / COPIES / str(os.getpid()))
        # The last two good revisions lie in two folders, which take turns.
        self._snapshots = [Snapshot(self._folder / f"{SNAPSHOT}-{turn}") for turn in (0, 1)]
        self._refusals = Refusals(self._folder)
        self._views: Views | None = None
        self._previous: Views | None = None
        # The last revision that the snapshot on disk does not hold yet.
        self._unsaved: Revision | None = None
        # The last view that was asked for. A new revision is tried with it, so that the answer to the next request is at hand.
        self._last: tuple[View, bool] = ({}, True)
        self._at_hand: tuple[View, bool, Frame] | None = None
        self._known: WeakSet[Program] = WeakSet()
        self._information: Table = {}
        # Whether something is cached that the shown revision has not needed so far.
        self._aged = False
        # The time that a whole moving picture took, or would take [s].
        self._seconds = 0.0

    def answered(self) -> None:
        """Writes the snapshot of a new revision, but not before its first picture was sent."""
        if self._at_hand is None:
            self._save_snapshot()

    def _save_snapshot(self) -> None:
        if self._unsaved is not None:
            # Without a snapshot, as on a full disk, a new drawer has nothing to start from, and this one draws on.
            with suppress(OSError, PickleError):
                self._snapshots[0].write(self._unsaved)
            self._unsaved = None

    def idle(self) -> None:
        """Writes the snapshot of a new revision, and frees what only old revisions needed."""
        self._save_snapshot()
        if self._aged and self._opened is not None:
            self._opened.evict_unused()
            self._copies.keep(*(views.revision for views in (self._views, self._previous) if views))
            self._aged = False

    def _load(self, request: Load) -> Loaded:
        # The new revision may end this process, so the last good one has to be on disk before it is tried.
        self._save_snapshot()
        start = perf_counter()
        if are_stale(request.models):
            return Loaded(id=request.id, ok=False, revision=request.revision, shown=self._number, restart=True)
        problems: list[Table] = []
        revision: Revision | None = None
        times: dict[str, float] = {}
        try:
            revision = read(request, self._copies)
        except ExceptionGroup as group:
            problems = unique(table for error in group.exceptions for table in tables(error))
        times["read"] = 1000 * (perf_counter() - start)
        if revision is not None:
            problems = self._try(revision, times)
        if revision is not None and not problems:
            self._show(revision)
            self._unsaved = revision
            self._snapshots.reverse()
        return self._loaded(request, revision, problems, times)

    def _restore(self, request: Restore) -> Loaded:
        self._snapshots.sort(key=lambda snapshot: snapshot.folder != Path(request.folder))
        if not self._snapshots[0].exists:
            # The last drawer ended before it wrote its first revision there, so the one before is restored.
            self._snapshots.reverse()
        revision = restored(self._snapshots[0].folder)
        problems = self._try(revision, {})
        if not problems:
            self._show(revision)
        return self._loaded(request, revision, problems, {})

    def _loaded(self, request: Load | Restore, revision: Revision | None, problems: list[Table], times: Table) -> Loaded:
        """Returns the answer to a request that loads a revision, which is None where it could not be read."""
        shown = self._views.revision if self._views else None
        files = {file for known in (revision, shown) if known for file in known.files}
        roots = [root for known in (revision, shown) if known for root in (*known.shaders.own, *known.models)]
        if isinstance(request, Load):
            files |= {Path(request.scene), *leniently_named(Path(request.scene))}
            roots += map(Path, (*request.shaders, *request.models))
        return Loaded(
            id=request.id,
            ok=not problems,
            revision=request.revision if isinstance(request, Load) else self._number,
            shown=self._number,
            problems=problems,
            dependencies=sorted(map(str, files)),
            folders=sorted(map(str, folders_of(*roots))),
            controls=controls_of(shown.scene) if shown else {},
            info=self._information,
            snapshot=str(self._snapshots[0].folder) if shown else None,
            milliseconds=times,
        )

    @property
    def _number(self) -> int:
        """The number of the revision that is drawn; 0 where there is none."""
        return self._views.revision.number if self._views else 0

    def _try(self, revision: Revision, times: dict[str, float]) -> list[Table]:
        """Compiles the programs of a revision and draws its first picture. Returns its problems.

        times: gets the times of the steps [ms].
        """
        self._at_hand = None
        views = Views(revision)
        try:
            start = perf_counter()
            texts = _texts(revision)
            if self._refusals.holds(texts):
                message = "this text has ended the drawer, and is not tried again until it changes"
                return [Problem(str(revision.path), None, None, message, "driver").as_dict()]
            times["plan"] = 1000 * (perf_counter() - start)
            self.renderer.age()
            with self._refusals.trying(texts):
                self._draw_first(views, times)
        except ShaderError as error:
            self._aged = False
            found = problems_of_scene(self.renderer.context, revision.scene, revision.shaders)
            return [problem.as_dict() for problem in found] or tables(error)
        except (*FAULTS, DriverFault) as error:
            self._aged = False
            return tables(error)
        self._aged = True
        return []

    def _draw_first(self, views: Views, times: dict[str, float]) -> None:
        """Draws the first picture of a revision: that of the last view, or the scene's own where that one cannot be drawn."""
        view, still = self._last
        seconds = self._seconds
        for each in (view, {}) if view else ({},):
            try:
                frame = self._frame(views, each, still)
                self._at_hand = each, still, frame
                break
            except SceneError:
                if not each:
                    raise
        # A first picture is slow because the driver compiles.
        self._seconds = seconds
        drawn = self.renderer.last_prepared
        if drawn is not None:
            context = self.renderer.context
            compiled = 1000 * sum(program.seconds for program in {call.program for call in drawn.calls} - set(self._known))
            times |= {"compile": compiled, "first_draw": frame.milliseconds["draw"] - compiled}
            times["encode"] = frame.milliseconds["encode"]
            driver = f"{context.renderer}; {context.version}"
            facts = information_of(views.revision.scene, drawn, driver, self._known)
            self._information = {**facts, "digest": views.revision.digest}
            self._known = WeakSet(call.program for call in drawn.calls)

    def _show(self, revision: Revision) -> None:
        """Draws a revision from now on."""
        self._previous, self._views = self._views, Views(revision)

    def _draw(self, request: Draw) -> Answer:
        view, still = request.view, request.still
        source = view.get("source") or "picture"
        if source == "picture":
            self._last = view, still
            at_hand, self._at_hand = self._at_hand, None
            if at_hand is not None and at_hand[:2] == (view, still):
                return replace(at_hand[2], id=request.id)
        if source.startswith("file:"):
            return replace(self._file(source.removeprefix("file:")), id=request.id)
        views = self._previous if source == "previous" else self._views
        if views is None:
            raise SceneError("there is no previous revision" if source == "previous" else "there is no picture yet")
        return replace(self._frame(views, view, still), id=request.id)

    def _frame(self, views: Views, view: View, still: bool) -> Frame:
        """Returns the picture of a view. Errors: SceneError, ShaderError."""
        shown = views.shown(view)
        scene = shown.scene
        half = not still and self._seconds > SLOW
        if half:
            width, height = (max(side // 2, 1) for side in scene.film.size)
            scene = views.shown({**view, "size": [width, height]}).scene
        start = perf_counter()
        views.revision.draw_with(self.renderer)
        image, non_finite = self._render(scene, view)
        drawn = perf_counter()
        # A picture with alpha has no place in a JPEG.
        as_png = still or image.channels == "RGBA"
        data = image.png() if as_png else _jpeg(image.pixels)
        encoded = perf_counter()
        if not still:
            self._pace(4 * (encoded - start) if half else encoded - start)
        height, width, _ = image.shape
        set_values = view.get("set") or {}
        return Frame(
            id=0,
            data=data,
            mime=PNG if as_png else JPEG,
            width=width,
            height=height,
            revision=views.revision.number,
            milliseconds={"draw": 1000 * (drawn - start), "encode": 1000 * (encoded - drawn)},
            non_finite=non_finite,
            ignored=list(shown.ignored),
            controls=controls_of(views.changed(set_values).scene) if _changes_model(set_values) else None,
        )

    def _pace(self, seconds: float) -> None:
        """Notes the time that a whole moving picture took, or would take [s]."""
        was_slow = self._seconds > SLOW
        is_slow = seconds > (SLOW * FAST_AGAIN if was_slow else SLOW)
        self._seconds = max(seconds, SLOW * 1.001) if is_slow else min(seconds, SLOW)

    def _render(self, scene: Any, view: View) -> tuple[Image, int | None]:
        """Returns the 8-bit picture of a scene, and the number of pixels that are not finite where the view paints them."""
        shading, layer = view.get("shading"), view.get("layer")
        if layer:
            layers = self.renderer.layers(scene, shading=shading)
            try:
                return Image(layer_picture(layer, layers.arrays), "srgb"), None
            except (KeyError, StopIteration):
                raise SceneError(f"the scene has no layer {layer}") from None
        if view.get("paint") != "nan":
            return self.renderer.render(scene, shading=shading), None
        linear = self.renderer.render(scene, dtype="float32", shading=shading)
        broken = ~np.isfinite(linear.pixels).all(axis=2)
        finite = replace(linear, pixels=np.where(broken[..., None], np.float32(0), linear.pixels))
        image = finite.encoded(scene.film.encoding)
        image.pixels[broken, :3] = NOT_FINITE
        return image, int(broken.sum())

    def _file(self, name: str) -> Frame:
        """Returns a picture file in the folder of the scene, or below it. Errors: SceneError (AssetError)."""
        if self._views is None:
            raise SceneError("there is no picture yet")
        folder = self._views.revision.path.parent.resolve()
        path = (folder / name).resolve()
        if not path.is_relative_to(folder):
            raise SceneError(f"{name}: lies outside the folder of the scene")
        pixels, has_alpha = read_picture(path)
        # Image holds premultiplied colours, and files straight ones.
        pixels[..., :3] *= pixels[..., 3:]
        image = Image(pixels if has_alpha else pixels[..., :3]).encoded()
        height, width, _ = image.shape
        return Frame(id=0, data=image.png(), width=width, height=height, revision=self._number)

    def _save(self, request: Save) -> Answer:
        if self._views is None:
            raise SceneError("there is no picture yet")
        revision = self._views.revision
        revision.draw_with(self.renderer)
        draw = self.renderer.layers if revision.scene.film.aovs else self.renderer.render
        draw(revision.scene, dtype="float32" if format_of(request.path).floats else "uint8").save(request.path)
        return Saved(id=request.id, revision=revision.number)

    def _source(self, request: ReadSource) -> Answer:
        if self._views is None:
            raise SceneError("there is no picture yet")
        revision, view = self._views.revision, request.view
        revision.draw_with(self.renderer)
        scene = self._views.shown({**view, "layer": None}).scene
        name, files = source_files(scene, request.object, revision.shaders, view.get("shading"))
        return Source(id=request.id, object=request.object, name=name, files=files, revision=revision.number)

    def _pick(self, request: Pick) -> Answer:
        if self._views is None:
            raise SceneError("there is no picture yet")
        views = self._views
        scene = views.shown({**request.view, "layer": None}).scene
        width, height = scene.film.size
        if not (0 <= request.x < width and 0 <= request.y < height):
            raise SceneError(f"the pixel {request.x}, {request.y} lies outside the picture, which is {width} x {height}")
        film = scene.film.model_copy(update={"crop": (request.x, request.y, 1, 1)})
        views.revision.draw_with(self.renderer)
        scene = scene.model_copy(update={"film": film})
        depth, number = self.renderer.surfaces(scene)
        index = int(number[0, 0])
        if index < 0:
            return Picked(id=request.id)
        item = scene.objects[index]
        x, y, z = positions(depth.astype(np.float64), ready(scene), film)[0, 0]
        return Picked(
            id=request.id,
            object=item.name or f"objects[{index}]",
            key=object_key(index),
            material=item.material if isinstance(item.material, str) else None,
            material_key=material_key(item, index),
            point=(float(x), float(y), float(z)),
        )


class Refusals:
    """The texts of programs that have ended a drawer. They are kept on disk, for the next drawer."""

    def __init__(self, folder: Path) -> None:
        """folder: the folder of the drawers. A text that the last drawer did not finish is refused from now on."""
        self._tried, self._refused = folder / TRIED, folder / REFUSED
        if self._tried.exists():
            with self._refused.open("a", encoding="ascii") as file:
                file.write(self._tried.read_text(encoding="ascii"))
            self._tried.unlink()
        self._digests = set(self._refused.read_text(encoding="ascii").split()) if self._refused.exists() else set()
        # The texts that were drawn without harm.
        self._harmless: set[str] = set()

    def holds(self, texts: set[str]) -> bool:
        """Returns whether one of these texts has ended a drawer. texts: digests."""
        return bool(texts & self._digests)

    def trying(self, texts: set[str]) -> _Trying:
        """Returns a context manager for the time in which new texts are tried. texts: digests."""
        return _Trying(self._tried, texts - self._harmless, self._harmless)


class _Trying:
    """Notes the texts that are being tried in a file, and deletes the file when the drawer has survived them."""

    def __init__(self, path: Path, texts: set[str], harmless: set[str]) -> None:
        self._path, self._texts, self._harmless = path, texts, harmless

    def __enter__(self) -> None:
        if self._texts:
            self._path.write_text("".join(f"{text}\n" for text in sorted(self._texts)), encoding="ascii")

    def __exit__(self, *unused: object) -> None:
        self._path.unlink(missing_ok=True)
        self._harmless |= self._texts


def _texts(revision: Revision) -> set[str]:
    """Returns a digest of the text of each program of a revision. Errors: SceneError, ShaderError."""
    sources = [generate(plan, revision.shaders) for plan in explain(revision.scene).programs]
    return {hashlib.sha256("\0".join(source.code).encode()).hexdigest() for source in sources}


def _changes_model(values: Mapping[str, Any]) -> bool:
    """Returns whether values that were set by hand give a material another model, or an object another material."""
    return any(isinstance(value, Mapping) or key.endswith(".material") for key, value in values.items())


def _jpeg(pixels: NDArray[Any]) -> bytes:
    """Returns a picture (H, W, 3) uint8 as the bytes of a JPEG file."""
    memory = io.BytesIO()
    Pillow.fromarray(np.ascontiguousarray(pixels)).save(memory, "JPEG", quality=JPEG_QUALITY)
    return memory.getvalue()


if __name__ == "__main__":
    serve(Drawer)
