"""The public names of glshade, each with the module that holds it. `__init__.py` reads this list at the first use of a name."""

from glshade import reference as reference
from glshade.batch.engine import Outcome as Outcome
from glshade.batch.from_python import render_all as render_all
from glshade.brdfs import BRDFS as BRDFS
from glshade.debug.pixels import PixelTrace as PixelTrace
from glshade.debug.pixels import trace_pixel as trace_pixel
from glshade.debug.tracing import Trace as Trace
from glshade.debug.tracing import trace as trace
from glshade.errors import AssetError as AssetError
from glshade.errors import ContextError as ContextError
from glshade.errors import GlshadeError as GlshadeError
from glshade.errors import SceneError as SceneError
from glshade.errors import ShaderError as ShaderError
from glshade.gl.evaluation import evaluate as evaluate
from glshade.gl.renderer import Renderer as Renderer
from glshade.gl.renderer import render as render
from glshade.glsl.plan import Plan as Plan
from glshade.glsl.planner import explain as explain
from glshade.image.difference import Difference as Difference
from glshade.image.difference import compare as compare
from glshade.image.image import Image as Image
from glshade.image.layers import Layers as Layers
from glshade.lights import LIGHTS as LIGHTS
from glshade.mesh.copies import Copies as Copies
from glshade.mesh.mesh import Mesh as Mesh
from glshade.pyrender import from_pyrender as from_pyrender
from glshade.scene.camera import Orthographic as Orthographic
from glshade.scene.camera import Perspective as Perspective
from glshade.scene.file import load as load
from glshade.scene.film import Film as Film
from glshade.scene.object import Object as Object
from glshade.scene.object import Transform as Transform
from glshade.scene.scene import Scene as Scene
from glshade.textures.texture import NormalMap as NormalMap
from glshade.textures.texture import Texture as Texture
from glshade.verification.verdict import Verdict as Verdict
from glshade.verification.verification import verify as verify
from glshade.version import __version__ as __version__

__all__: list[str]
