"""ambient: light from everywhere alike."""

from typing import ClassVar, Literal

from glshade.lights import Light


class AmbientLight(Light):
    """Adds the material's ambient reflectance times its intensity. A hack, and needed (lecture slide 23)."""

    type: Literal["ambient"] = "ambient"
    omnidirectional: ClassVar[bool] = True
