"""exposed: one stop more exposure makes up for lights and emission of half the strength."""

from __future__ import annotations

from typing import Any

from numpy.typing import NDArray

from glshade.assembly.assembly import assemble
from glshade.brdfs import Brdf
from glshade.optics.spectra import Spectrum
from glshade.scene.scene import Scene
from glshade.textures.texture import Texture
from glshade.verification.laws._law import Draw, Law, NotApplicableError
from glshade.verification.laws._scenes import lights_of


def _picture(scene: Scene, draw: Draw) -> NDArray[Any]:
    lights = lights_of(scene)
    if not lights:
        raise NotApplicableError("there are no lights")
    for instance in assemble(scene).instances:
        if instance.material.unlit:
            raise NotApplicableError("an unlit surface has no strength that the law can halve")
        if instance.material.emits and scene.objects[instance.number].material is None:
            raise NotApplicableError("the law cannot halve the emission of a mesh file's material")
    film = scene.film.model_copy(update={"exposure": scene.film.exposure + 1})
    changes = {
        "film": film,
        "lights": tuple(light.model_copy(update={"intensity": light.intensity / 2}) for light in lights),
        "materials": {name: _halved(material) for name, material in scene.materials.items()},
        "objects": tuple(item.model_copy(update={"material": _halved(item.material)}) for item in scene.objects),
    }
    return draw(scene.model_copy(update=changes))


def _halved(material: Any) -> Any:
    """Returns a material with half its emission; a name and None as they are."""
    if not isinstance(material, Brdf) or not material.emits:
        return material
    emission = material.emission
    if isinstance(emission, Texture):
        numbers = {key: tuple(x / 2 for x in getattr(emission, key)) for key in ("factor", "add")}
        half: Any = emission.model_copy(update=numbers)
    elif isinstance(emission, Spectrum):
        half = emission.model_copy(update={"scale": emission.scale / 2})
    else:
        half = tuple(x / 2 for x in emission)
    return material.model_copy(update={"emission": half})


LAW = Law(
    name="exposed",
    description="one stop of exposure makes up for lights and emission of half the strength",
    picture=_picture,
)
