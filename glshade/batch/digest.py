"""Digest: all that a picture depends on, in 64 letters. Equal digests, equal bytes."""

from __future__ import annotations

import hashlib
import json
import os
from functools import cache
from pathlib import Path

from glshade.batch.task import Task
from glshade.glsl.generator import SHADERS
from glshade.image import file as picture_file
from glshade.scene.digest import digest as scene_digest
from glshade.scene.scene import Scene
from glshade.version import __version__

# The name under which a picture's file says it.
ATTRIBUTE = "glshade:digest"


def digest(scene: Scene, task: Task, driver: str) -> str:
    """SHA-256 of the scene as it is drawn, its files by their content; of what draws it; and of how it is written."""
    said = {
        "scene": scene_digest(scene),
        "shading": task.shading,
        "reference": task.reference,
        # Of a picture in pieces, the last bit may differ.
        "tile": task.tile,
        "driver": driver,
        "made by": code(),
        "suffix": Path(task.output).suffix.lower(),
        "view": _configuration() if scene.film.transformed and scene.film.ocio is None else None,
    }
    return hashlib.sha256(json.dumps(said, sort_keys=True).encode()).hexdigest()


def digest_of(path: str | Path) -> str:
    """What a picture's file says of itself; nothing where it says nothing."""
    return picture_file.attributes(path).get(ATTRIBUTE, "")


def _configuration() -> str:
    """What $OCIO names, by its content where it is a file; the tables that such a file names are not looked at."""
    named = os.environ.get("OCIO", "")
    return hashlib.sha256(Path(named).read_bytes()).hexdigest() if named and Path(named).is_file() else named


@cache
def code() -> str:
    """glshade's version, its shaders, and what writes the files."""
    import OpenImageIO as oiio

    h = hashlib.sha256(f"{__version__} {oiio.VERSION_STRING}".encode())
    for path in sorted(SHADERS.rglob("*")):
        if path.is_file():
            h.update(f"\0{path.relative_to(SHADERS).as_posix()}\0".encode() + path.read_bytes())
    return h.hexdigest()
