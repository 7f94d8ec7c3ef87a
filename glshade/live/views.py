"""Views: the scene that a page shows, made from a revision and the page's choices of camera, size, layer and values."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from pydantic import ValidationError

from glshade.document import Document
from glshade.errors import SceneError
from glshade.live.layer_pictures import aov_of
from glshade.live.messages import View
from glshade.live.revision import Revision, with_film, with_pictures
from glshade.lru import Lru
from glshade.scene.camera import CAMERAS
from glshade.scene.file import merged, parse
from glshade.scene.override import OverrideError, apply
from glshade.scene.scene import Scene

# The number of scenes that are kept: two panes of a few pages.
KEPT = 8


@dataclass(frozen=True, eq=False)
class Shown:
    """The scene that a view shows.

    scene: the scene, with the view's values, camera, size and layer.
    ignored: the keys of the view's values that do not fit the scene.
    """

    scene: Scene
    ignored: tuple[str, ...] = ()


class Views:
    """Returns the scenes of the views of one revision. Equal views get the same object, which the renderer draws faster."""

    def __init__(self, revision: Revision) -> None:
        self.revision = revision
        self._shown: Lru[str, Shown] = Lru(KEPT, most=KEPT)
        self._changed: Lru[str, Shown] = Lru(KEPT, most=KEPT)

    def shown(self, view: View) -> Shown:
        """Returns the scene of a view. Values that do not fit the scene are ignored, and so is the name of an unknown camera.

        Errors: SceneError for a camera, size or layer that cannot be.
        """
        key = json.dumps([view.get(part) for part in ("set", "camera", "size", "layer")])
        return self._shown.find(key, lambda: self._made(view), lambda _: 1)

    def changed(self, values: Mapping[str, Any]) -> Shown:
        """Returns the revision's scene with some of its values changed. values: dotted key -> value."""
        return self._changed.find(json.dumps(values), lambda: _changed(self.revision, values), lambda _: 1)

    def _made(self, view: View) -> Shown:
        changed = self.changed(view.get("set") or {})
        camera = view.get("camera") or {}
        ignored = changed.ignored
        if camera.get("name") is not None and camera["name"] not in changed.scene.cameras:
            camera, ignored = {}, (*ignored, "camera")
        scene = _through(changed.scene, camera)
        film: dict[str, Any] = {}
        if view.get("size"):
            film["size"] = tuple(view["size"])
        if view.get("layer"):
            film["aovs"] = (aov_of(view["layer"]),)
        return Shown(with_film(scene, **film) if film else scene, ignored)


def _changed(revision: Revision, values: Mapping[str, Any]) -> Shown:
    """Returns a revision's scene with some of its values changed. A value that does not fit is left out."""
    if not values:
        return Shown(revision.scene)
    try:
        return Shown(_with_values(revision, list(values.items())))
    except (SceneError, OverrideError):
        kept: list[tuple[str, Any]] = []
        scene = revision.scene
        for key, value in values.items():
            try:
                scene = _with_values(revision, [*kept, (key, value)])
                kept.append((key, value))
            except (SceneError, OverrideError):
                continue
        fitting = {key for key, _ in kept}
        return Shown(scene, tuple(key for key in values if key not in fitting))


def _with_values(revision: Revision, values: Sequence[tuple[str, Any]]) -> Scene:
    """Returns a revision's scene with some of its values changed. Errors: SceneError, OverrideError."""
    document: Mapping[str, Any] = revision.document
    for key, value in values:
        document = apply(document, key, value)
    scene = revision.scene
    # Values that are not changed keep their textures and meshes, and their files are not looked for again.
    changed = parse(merged(scene, revision.document, document), revision.path, scene.limits)
    changed = with_pictures(changed, lambda path: revision.copies.get(path, path))
    return changed.with_models(scene.models or {})


def _through(scene: Scene, camera: Mapping[str, Any]) -> Scene:
    """Returns the scene with another camera.

    camera: empty for the scene's own; {"name": text} for one of its further cameras; or the keys of a camera.
    Errors: SceneError.
    """
    if camera.get("name") is not None:
        return scene.model_copy(update={"camera": scene.cameras[camera["name"]]})
    values = {key: value for key, value in camera.items() if value is not None and key != "type"}
    if not values:
        return scene
    kind = camera.get("type") or ("orthographic" if "height" in values else "perspective")
    own = scene.camera
    if kind == own.type:
        # The planes of the scene's own camera still cut where its author wants them to.
        values |= {key: getattr(own, key) for key in ("near", "far") if getattr(own, key) is not None}
    try:
        made: Document = CAMERAS[kind].model_validate(values)
    except (KeyError, ValidationError) as error:
        raise SceneError(f"camera: {_first(error)}") from None
    return scene.model_copy(update={"camera": made})


def _first(error: KeyError | ValidationError) -> str:
    """Returns the first fault of an error as text."""
    if isinstance(error, KeyError):
        return f"unknown type {error}"
    fault = error.errors(include_url=False)[0]
    return f"{'.'.join(map(str, fault['loc']))}: {fault['msg']}"
