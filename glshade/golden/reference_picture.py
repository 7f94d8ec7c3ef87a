"""Reference pictures: pictures of scenes by the float64 reference, for use as baselines."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.errors import SceneError
from glshade.golden.sidecar import Origin
from glshade.image import file as picture_file
from glshade.image.image import Image
from glshade.image.view import displayed
from glshade.reference.picture import radiance
from glshade.scene.digest import scene_digest
from glshade.scene.file import load
from glshade.scene.override import split
from glshade.scene.scene import Scene
from glshade.verification.candidates import find_candidates, judgeable, left_out
from glshade.verification.judgement import PixelClass
from glshade.version import __version__

# The places of samples in a pixel, (right, down) from its centre [pixels]. Direct3D prescribes those of 4 samples, and most
# drivers use them.
AT_CENTRE = ((0.0, 0.0),)
SAMPLES = ((-0.125, -0.375), (0.375, -0.125), (-0.375, 0.125), (0.125, 0.375))


@dataclass(frozen=True)
class ReferencePicture:
    """A picture by the reference, in a file.

    path: the file.
    origin: the origin of the picture.
    left_out: the settings of the scene that the reference does not follow, each as "name = value".
    """

    path: Path
    origin: Origin
    left_out: tuple[str, ...]


def draw_reference(scene: Path, path: Path, overrides: Sequence[str] = ()) -> ReferencePicture:
    """Draws the scene of a file with the float64 reference, as its film asks, and writes the picture.

    scene: the scene's file.
    overrides: values that replace those of the scene's file, as `--set` takes them.
    path: the picture's file. A format with 8-bit numbers gets the film's encoding or view transform.
    Errors: SceneError; NoReference for a model that has only a GLSL file; GlshadeError where the file cannot be written.
    """
    try:
        read = load(scene, [split(text) for text in overrides])
    except ValueError as error:
        raise SceneError(f"{scene}: {error}") from None
    film = read.film
    if film.aovs:
        raise SceneError(
            f"{scene}: film.aovs: the reference draws the picture alone, without layers; approve a driver's picture"
        )
    image = render_film(read)
    if not picture_file.format_of(path).floats:
        image = displayed(image, film.encoding, ocio=film.ocio, display=film.display, view=film.view)
    digest = scene_digest(read)
    image.save(path, {"glshade:version": __version__, "glshade:scene": digest})
    origin = Origin(
        made_by="reference",
        glshade=__version__,
        scene=str(scene.absolute()),
        overrides=tuple(overrides),
        scene_digest=digest,
    )
    return ReferencePicture(path, origin, left_out(read))


def render_film(scene: Scene) -> Image:
    """Returns the reference's picture of a scene with the samples that its film asks for, float32 and linear.

    With several samples a pixel, drivers shade a surface once a pixel, and only its outline is smoothed. So pixels in which
    samples may show different surfaces are the mean of pictures at the places of the samples. Errors: SceneError; NoReference.
    """
    film, scene = scene.film, judgeable(scene)
    if film.samples == 1:
        pixels = _mean(scene, AT_CENTRE)
    else:
        expected = find_candidates(scene).expected
        mixed = np.isin(expected.classes, (PixelClass.EDGE, PixelClass.SEAM)).reshape(film.window[:1:-1])
        pixels = np.where(mixed[..., None], _mean(scene, SAMPLES), _mean(scene, AT_CENTRE))
        # These means are estimates. What the candidates allow is certain.
        values = pixels.reshape(-1, 4)
        values[expected.pixel] = np.clip(values[expected.pixel], expected.low, expected.high)
    channels = pixels[..., : len(film.background)].astype(np.float32)
    return Image(channels, "linear", corner=film.window[:2], whole=film.size if film.crop else None)


def _mean(scene: Scene, samples: Sequence[tuple[float, float]]) -> NDArray[Any]:
    """Returns the mean (H, W, 4) of the pictures at all places of the samples, in all pictures of the film."""
    from glshade.gl.tiles import passes

    places = [(x + dx, y + dy) for x, y in passes(scene.film, len(SAMPLES)) for dx, dy in samples]
    total = radiance(scene, offset=places[0])
    for place in places[1:]:
        total += radiance(scene, offset=place)
    return total / len(places)
