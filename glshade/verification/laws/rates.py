"""rates: flat faces look the same at all three shading rates if the viewer and the lights are at infinity."""

from __future__ import annotations

from typing import Any

from numpy.typing import NDArray

from glshade.brdfs import Brdf
from glshade.scene.camera import Orthographic
from glshade.scene.scene import Scene
from glshade.textures.texture import Picture
from glshade.verification.laws._law import Draw, Law, NotApplicableError
from glshade.verification.laws._scenes import flattened, material_of, pieces, with_quality, written_out


def _premise(scene: Scene) -> Scene:
    """Returns a scene with those objects whose materials are the same everywhere, as flat faces under the default lights.

    The camera is orthographic, and the scene asks for shading per pixel.
    """
    scene = flattened(written_out(scene))
    faces = {"normals": "face", "vertex_colours": False}
    objects = [
        piece.model_copy(update=faces)
        for item in scene.objects
        for piece in pieces(scene, item)
        if _is_uniform(material_of(scene, piece))
    ]
    if not objects:
        raise NotApplicableError("all materials have textures, depend on tangents or are blended")
    camera = Orthographic.model_validate({"matrix": scene.camera.matrix, "fit": True})
    changes = {"objects": tuple(objects), "camera": camera, "lights": None}
    return with_quality(scene.model_copy(update=changes), shading="phong")


def _is_uniform(material: Brdf) -> bool:
    """Returns whether the light that a flat face shows is the same everywhere on the face."""
    textured = any(isinstance(getattr(material, key), Picture) for key in type(material).model_fields)
    return not (textured or material.needs_tangents or material.alpha_mode == "blend")


def _picture(scene: Scene, draw: Draw) -> NDArray[Any]:
    picture = draw(scene, shading="flat")
    # Every second column shows the light of vertices, so that one picture shows both rates.
    picture[:, ::2] = draw(scene, shading="gouraud")[:, ::2]
    return picture


LAW = Law(
    name="rates",
    description="flat faces look the same at all shading rates if viewer and lights are far",
    picture=_picture,
    premise=_premise,
)
