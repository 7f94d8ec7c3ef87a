"""Digest: computes the SHA-256 of everything that a picture depends on. Pictures with equal digests have equal bytes."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterable
from pathlib import Path

from glshade.batch.task import Task
from glshade.glsl.shaders import current
from glshade.image import file as picture_file
from glshade.scene.digest import scene_digest
from glshade.scene.models import models_digest
from glshade.scene.scene import Scene
from glshade.version import __version__

# Name of the attribute in which a picture file stores its digest.
ATTRIBUTE = "glshade:digest"


def picture_digest(scene: Scene, task: Task, driver: str, code: str) -> str:
    """Returns the SHA-256 of a picture's inputs: the scene with its files' contents, the driver, the code and the file format.

    scene: the scene as it is drawn, at its frame and with its overrides
    task: the task that draws it
    driver: OpenGL's renderer and version, or "float64 reference"
    code: digest of the code, as `code_digest` returns it
    """
    inputs = {
        "scene": scene_digest(scene),
        "shading": task.shading,
        "reference": task.reference,
        # A picture may be drawn in tiles, and the last bit of a pixel may depend on them.
        "tile": task.tile,
        "driver": driver,
        "made by": code,
        "suffix": Path(task.output).suffix.lower(),
        "view": _configuration() if scene.film.transformed and scene.film.ocio is None else None,
    }
    return hashlib.sha256(json.dumps(inputs, sort_keys=True).encode()).hexdigest()


def digest_of(path: str | Path) -> str:
    """Returns the digest that a picture file stores, or "" if it stores none."""
    return picture_file.attributes(path).get(ATTRIBUTE, "")


def _configuration() -> str:
    """Returns the SHA-256 of the configuration file that $OCIO names, or the value of $OCIO if it does not name a file.

    Lookup tables that the file refers to are not read.
    """
    named = os.environ.get("OCIO", "")
    return hashlib.sha256(Path(named).read_bytes()).hexdigest() if named and Path(named).is_file() else named


def code_digest(shaders: Iterable[str | Path] = ()) -> str:
    """Returns the SHA-256 of glshade's version, its shaders, the user's models and the version of OpenImageIO.

    shaders: the user's own shader folders. Errors: ShaderError.
    """
    import OpenImageIO as oiio

    versions = f"{__version__} {oiio.VERSION_STRING} {current(shaders).digest} {models_digest()}"
    return hashlib.sha256(versions.encode()).hexdigest()
