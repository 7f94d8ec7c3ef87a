"""Digest: a hash of a scene, in which files count by their content and not by their names and folders."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from glshade.document import Document
from glshade.files import read_bytes
from glshade.limits import LARGEST_MESH
from glshade.mesh import file as mesh_file
from glshade.mesh.copies import Copies
from glshade.mesh.mesh import Mesh
from glshade.scene.scene import Scene
from glshade.textures.pixel_array import PixelArray


def scene_digest(scene: Scene) -> str:
    """Returns the SHA-256 of all values of a scene, with the content of every file in place of its path: 64 hex digits.

    Values that are their keys' defaults do not count, so that a scene keeps its digest when a later version has more keys.
    Errors: AssetError for a mesh file, OSError for another file that cannot be read.
    """

    load = scene.loader()

    def content(value: Any) -> Any:
        if isinstance(value, Path) and value.suffix.lower() in mesh_file.SUFFIXES:
            # The model is hashed, not the file's bytes, since the model also has the materials and buffers from other files.
            model = load(value)
            parts = [(part.mesh.digest, part.transform.tolist(), files(part.material)) for part in model.parts]
            return [*parts, *model.lights]
        if isinstance(value, Path):
            return hashlib.sha256(read_bytes(value, LARGEST_MESH)).hexdigest()
        if isinstance(value, Mesh | Copies | PixelArray):
            return value.digest
        if isinstance(value, Document):
            return {key: content(item) for key, item in _written(value)}
        if isinstance(value, dict):
            return {key: content(item) for key, item in value.items()}
        if isinstance(value, tuple | list):
            return [content(item) for item in value]
        return value

    def files(material: Any) -> Any:
        """Returns a mesh file's material with the content of its textures in place of their paths, which are strings."""
        if isinstance(material, dict):
            return {key: content(Path(item)) if key == "texture" else files(item) for key, item in material.items()}
        return material

    text = json.dumps(content(scene), sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()


def _written(document: Document) -> Iterator[tuple[str, Any]]:
    """Yields the keys of a document, and their values, that say more than its class and its defaults do."""
    for key, field in type(document).model_fields.items():
        value = getattr(document, key)
        # The cameras of the file `cameras_from` are among the scene's cameras. The other two keys name the document's class.
        if key in ("type", "brdf") or (key != "cameras_from" and value != field.get_default(call_default_factory=True)):
            yield key, value
