"""Verification: draws a scene on the GPU and compares the picture with the float64 reference, as docs/tolerance.md explains."""

from __future__ import annotations

from contextlib import ExitStack
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.glsl.shaders import current
from glshade.image.image import Image
from glshade.reference.freedom import UNMEASURED, Freedom
from glshade.scene.models import Folders, paths, use_models
from glshade.scene.object import Rate
from glshade.scene.scene import Scene
from glshade.verification.candidates import at_centres, find_candidates, judgeable, left_out
from glshade.verification.own_text import differences
from glshade.verification.verdict import MAX_AMBIGUOUS, Verdict, verdict_of

Array = NDArray[Any]
Flags = NDArray[np.bool_]


def verify(
    scene: Scene,
    *,
    backend: Any = "auto",
    device: int | None = None,
    shading: Rate | None = None,
    max_ambiguous: float = MAX_AMBIGUOUS,
    picture: Any = None,
    renderer: Any = None,
    mask: Flags | None = None,
    driver: Freedom | None = None,
    shaders: Folders | None = None,
    models: Folders | None = None,
    derived: bool = False,
) -> Verdict:
    """Draws a scene, compares the linear picture with the float64 reference, and returns the verdict.

    backend, device: the OpenGL context to draw with, as for Renderer.
    shading: the shading rate for the whole scene; by default, each object has its own.
    max_ambiguous: the largest share of ambiguous pixels in a picture that can be verified.
    picture: optional, an Image or an array (H, W, 3 or 4) [linear, premultiplied] that is judged in place of the GPU's picture.
    renderer: optional, the Renderer that draws, or that drew `picture`; by default a new one on `backend` and `device` draws.
    mask: optional (H, W); True for pixels that are not judged and count as ambiguous.
    driver: optional; the errors of the driver's fixed functions. By default they are measured. If only `picture` is given, its
        driver is not known, and may use the whole freedom that the specification leaves it.
    shaders, models: folders of the user's own shaders and models, as for Renderer.
    derived: True to compare with the GLSL of all objects, run in float64, in place of the models' Python functions. Without it,
        only models that have no Python function are verified against their own GLSL.
    Errors: SceneError, ShaderError, ContextError; MissingLibrary or NoReference where glslangValidator is needed and not
    installed; GlshadeError where `picture` has another size than the scene's.
    """
    from time import perf_counter

    use_models(models)
    not_judged = left_out(scene)
    scene = judgeable(scene)
    if picture is None:
        scene, more = at_centres(scene)
        not_judged = (*not_judged, *more)
    start = perf_counter()
    made_by = ""
    with ExitStack() as opened:
        if picture is None and renderer is None:
            from glshade.gl.renderer import Renderer

            renderer = opened.enter_context(Renderer(backend, device, shaders=shaders))
        if picture is None:
            picture, made_by = _drawn(scene, shading, renderer)
        if driver is None and renderer is not None:
            from glshade.driver.freedom import measure_freedom

            driver = measure_freedom(renderer.context)
    drawn = perf_counter()
    files = renderer.current_shaders() if renderer is not None else current(paths(shaders))
    expected = find_candidates(scene, shading=shading, driver=driver or UNMEASURED, derived=derived, shaders=files)
    judged = perf_counter()
    result = verdict_of(np.asarray(getattr(picture, "pixels", picture)), expected, mask, max_ambiguous, made_by)
    notes = tuple(differences(scene, expected.inputs, shading, files)) if derived else ()
    result.seconds.update({"draw": drawn - start, "reference": judged - drawn, "judge": perf_counter() - judged})
    return replace(result, left_out=not_judged, notes=notes)


def _drawn(scene: Scene, shading: Rate | None, renderer: Any) -> tuple[Array, str]:
    """Returns (picture (H, W, 3 or 4) [linear], GL_RENDERER and GL_VERSION of the driver that drew it)."""
    image: Image = renderer.render(scene, dtype="float32", shading=shading)
    # The renderer reuses its array for the next picture, so this one is copied.
    return image.pixels.copy(), f"{renderer.context.renderer}; {renderer.context.version}"
