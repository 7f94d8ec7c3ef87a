"""pyrender: its scenes drawn by glshade. pyrender itself is not imported: its objects say what they are by their attributes.

from glshade.pyrender import OffscreenRenderer  # in place of pyrender's
"""

from glshade.pyrender.offscreen import OffscreenRenderer as OffscreenRenderer
from glshade.pyrender.offscreen import RenderFlags as RenderFlags
from glshade.pyrender.scene import from_pyrender as from_pyrender

__all__ = ["OffscreenRenderer", "RenderFlags", "from_pyrender"]
