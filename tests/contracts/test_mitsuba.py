"""A third opinion: the models that Mitsuba 3 has too, against its values, to the precision of its floats."""

from __future__ import annotations

import numpy as np
import pytest

from glshade import evaluate
from glshade.brdfs import BRDFS

try:
    import mitsuba

    mitsuba.set_variant("scalar_rgb")
except Exception as error:  # without /proc its import ends in a NameError
    pytest.skip(f"Mitsuba (in the dev extra where it has wheels) cannot be used here: {error!r}", allow_module_level=True)

# Half an ulp of float32 for each of its few operations.
FLOAT = 4e-7


def test_lambert_is_its_diffuse() -> None:
    """Mitsuba's eval has the cosine in it, as f cos has; below either horizon both are 0."""
    kd = (0.8, 0.3, 0.05)
    diffuse = mitsuba.load_dict({"type": "diffuse", "reflectance": {"type": "rgb", "value": list(kd)}})
    random = np.random.default_rng(3)
    l, v = (d / np.linalg.norm(d, axis=1, keepdims=True) for d in random.normal(size=(2, 300, 3)))
    l, v = l.astype(np.float32), v.astype(np.float32)
    ours = evaluate(BRDFS["lambert"](kd=kd), l, v)
    seen = mitsuba.SurfaceInteraction3f()
    for light, viewer, expected in zip(l, v, ours, strict=True):
        seen.wi = viewer.tolist()
        theirs = np.array(diffuse.eval(mitsuba.BSDFContext(), seen, mitsuba.Vector3f(light.tolist()))).ravel()
        np.testing.assert_allclose(expected, theirs, atol=FLOAT, rtol=FLOAT)
    assert (ours > 0).any()
