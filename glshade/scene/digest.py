"""Digest: a hash of a scene, in which files count by their content and not by their names and folders."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Any

from glshade.document import Document
from glshade.files import read_bytes
from glshade.limits import LARGEST_MESH
from glshade.mesh import file as mesh_file
from glshade.mesh.mesh import Mesh
from glshade.scene.scene import Scene


def scene_digest(scene: Scene) -> str:
    """Returns the SHA-256 of all values of a scene, with the content of every file in place of its path: 64 hex digits.

    Errors: AssetError for a mesh file, OSError for another file that cannot be read.
    """

    load = scene.loader()

    def content(value: Any) -> Any:
        if isinstance(value, Path) and value.suffix.lower() in mesh_file.SUFFIXES:
            # The model is hashed, not the file's bytes, since the model also has the materials and buffers from other files.
            parts = load(value).parts
            return [(part.mesh.digest, part.transform.tolist(), files(part.material)) for part in parts]
        if isinstance(value, Path):
            return hashlib.sha256(read_bytes(value, LARGEST_MESH)).hexdigest()
        if isinstance(value, Mesh):
            return value.digest
        if isinstance(value, Document):
            # The cameras of the file `cameras_from` are among the scene's cameras.
            return {key: content(getattr(value, key)) for key in type(value).model_fields if key != "cameras_from"}
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
