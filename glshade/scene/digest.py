"""Digest: a scene's content in 64 letters. It does not depend on where files lie or what they are called."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Any

from glshade.document import Document
from glshade.mesh import file as mesh_file
from glshade.mesh.mesh import Mesh
from glshade.scene.scene import Scene


def digest(scene: Scene) -> str:
    """SHA-256 of everything that the scene says, files by their content."""

    def content(value: Any) -> Any:
        if isinstance(value, Path) and value.suffix.lower() in mesh_file.SUFFIXES:
            # With the materials, textures and buffers that lie beside it.
            parts = mesh_file.load(value).parts
            return [(part.mesh.digest, part.transform.tolist(), files(part.material)) for part in parts]
        if isinstance(value, Path):
            return hashlib.sha256(value.read_bytes()).hexdigest()
        if isinstance(value, Mesh):
            return value.digest
        if isinstance(value, Document):
            return {key: content(getattr(value, key)) for key in type(value).model_fields}
        if isinstance(value, dict):
            return {key: content(item) for key, item in value.items()}
        if isinstance(value, tuple | list):
            return [content(item) for item in value]
        return value

    def files(material: Any) -> Any:
        """A material of a mesh file, whose textures are named by strings."""
        if isinstance(material, dict):
            return {key: content(Path(item)) if key == "texture" else files(item) for key, item in material.items()}
        return material

    text = json.dumps(content(scene), sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()
