"""glshade: a GLSL shader suite on headless OpenGL. A scene goes in; a picture, and the proof that it is right, come out."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

if TYPE_CHECKING:
    from glshade import reference as reference
    from glshade.brdfs import BRDFS as BRDFS
    from glshade.camera import Orthographic as Orthographic
    from glshade.camera import Perspective as Perspective
    from glshade.comparison import Difference as Difference
    from glshade.comparison import compare as compare
    from glshade.errors import AssetError as AssetError
    from glshade.errors import ContextError as ContextError
    from glshade.errors import GlshadeError as GlshadeError
    from glshade.errors import SceneError as SceneError
    from glshade.errors import ShaderError as ShaderError
    from glshade.gl.evaluate import evaluate as evaluate
    from glshade.gl.renderer import Renderer as Renderer
    from glshade.gl.renderer import render as render
    from glshade.image import Image as Image
    from glshade.layers import Layers as Layers
    from glshade.lights import LIGHTS as LIGHTS
    from glshade.mesh import Mesh as Mesh
    from glshade.plan import Plan as Plan
    from glshade.plan import explain as explain
    from glshade.pyrender import from_pyrender as from_pyrender
    from glshade.scene import Film as Film
    from glshade.scene import Object as Object
    from glshade.scene import Scene as Scene
    from glshade.scene import Transform as Transform
    from glshade.scene_file import load as load
    from glshade.texture import NormalMap as NormalMap
    from glshade.texture import Texture as Texture
    from glshade.verifier import Verdict as Verdict
    from glshade.verifier import verify as verify

# The public surface, and where each name lives (a module: ""). Loaded when asked for: `import glshade` costs nothing.
_HOME = {
    "AssetError": "errors",
    "BRDFS": "brdfs",
    "ContextError": "errors",
    "Difference": "comparison",
    "Film": "scene",
    "GlshadeError": "errors",
    "Image": "image",
    "LIGHTS": "lights",
    "Layers": "layers",
    "Mesh": "mesh",
    "NormalMap": "texture",
    "Object": "scene",
    "Orthographic": "camera",
    "Perspective": "camera",
    "Plan": "plan",
    "Renderer": "gl.renderer",
    "Scene": "scene",
    "SceneError": "errors",
    "ShaderError": "errors",
    "Texture": "texture",
    "Transform": "scene",
    "Verdict": "verifier",
    "compare": "comparison",
    "evaluate": "gl.evaluate",
    "explain": "plan",
    "from_pyrender": "pyrender",
    "load": "scene_file",
    "reference": "",
    "render": "gl.renderer",
    "verify": "verifier",
}
__all__ = [*_HOME, "__version__"]


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'glshade' has no attribute {name!r}")
    if not _HOME[name]:
        return importlib.import_module(f"glshade.{name}")
    return getattr(importlib.import_module(f"glshade.{_HOME[name]}"), name)


def __dir__() -> list[str]:
    return sorted(__all__)
