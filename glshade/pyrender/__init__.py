"""pyrender: a replacement for pyrender's OffscreenRenderer and a converter of its scenes, for programs that use pyrender.

from glshade.pyrender import OffscreenRenderer  # in place of pyrender's

pyrender itself is not imported: its objects are recognised by their attributes.
"""

from glshade.pyrender.offscreen import OffscreenRenderer as OffscreenRenderer
from glshade.pyrender.offscreen import RenderFlags as RenderFlags
from glshade.pyrender.scene import from_pyrender as from_pyrender

__all__ = ["OffscreenRenderer", "RenderFlags", "from_pyrender"]
