"""Encoded: judges a picture file's pixels, whether they are linear float numbers or 8-bit codes."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.errors import GlshadeError
from glshade.verification.candidates import Candidates
from glshade.verification.codes import encoded
from glshade.verification.verdict import MAX_AMBIGUOUS, MAX_DOUBTFUL, Verdict, verdict_of


def judge_pixels(
    pixels: NDArray[Any],
    candidates: Candidates,
    *,
    encoding: str = "srgb",
    mask: NDArray[np.bool_] | None = None,
    max_ambiguous: float = MAX_AMBIGUOUS,
    made_by: str = "",
    explain: bool = True,
    max_doubtful: float = MAX_DOUBTFUL,
) -> Verdict:
    """Returns the verdict on a picture.

    pixels: (H, W, 3 or 4); floats are linear and premultiplied, uint8 codes have straight alpha.
    candidates: the values that the pixels may have.
    encoding: the encoding of uint8 codes, "srgb" or "linear"; it has no effect on floats.
    mask: optional (H, W); True for pixels that are not judged and count as ambiguous.
    max_ambiguous: the largest share of ambiguous pixels in a picture that can be verified.
    made_by: the names of the OpenGL renderer and version that drew the picture.
    explain: True to list the worst pixels, which takes time.
    max_doubtful: the largest share of ambiguous pixels and edges among the pixels that are not background.
    Errors: GlshadeError where the picture has another size than the scene's, or numbers of another type; NoReference for 8-bit
    pictures that a view transform made, or that have another encoding.
    """
    if pixels.dtype == np.uint8:
        candidates = encoded(candidates, encoding)
    elif not np.issubdtype(pixels.dtype, np.floating):
        raise GlshadeError(f"the picture's numbers are {pixels.dtype}: floats and uint8 can be judged")
    return verdict_of(pixels, candidates, mask, max_ambiguous, made_by, explain=explain, max_doubtful=max_doubtful)
