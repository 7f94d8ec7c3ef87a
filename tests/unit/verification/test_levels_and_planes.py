"""Two freedoms of a driver: each texture has its own error of the level of detail, and a clip plane may cut a pixel."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import glshade
from glshade.radiance.sampler import Sampler
from glshade.reference.freedom import Freedom
from glshade.reference.picture import radiance
from glshade.scene.scene import Scene
from glshade.verification.candidates import find_candidates
from glshade.verification.judgement import judge
from glshade.verification.verification import verify

# The error of the level of detail of each texture, by its width [levels]; 0.05 is what llvmpipe may have.
ERRORS = {5: 0.045, 4: -0.045}

# A view in which the near plane cuts a face beside its diagonal.
NEAR, TURNED = 1.8339229936832182, (6.950411389056887, 24.5312780326774, 55.96654340215197)


def test_textures_of_several_sizes_have_errors_of_their_own(monkeypatch: pytest.MonkeyPatch) -> None:
    random = np.random.default_rng(2)
    small, large = (random.integers(0, 256, (height, width, 3), dtype=np.uint8) for height, width in ((3, 5), (8, 4)))
    scene = Scene.model_validate(
        {
            "film": {"size": (24, 24)},
            "camera": {"type": "orthographic", "height": 20.0, "eye": (0.3, 3, 2), "target": (0, 0, 0)},
            "objects": [
                {
                    "shape": "plane",
                    "material": {
                        "brdf": "lambert",
                        "kd": {"texture": small, "uv_scale": (14, 14)},
                        "occlusion": {"texture": large, "uv_scale": (14, 14)},
                    },
                    "transform": {"rotate": (0, 30, 0), "scale": (20, 1, 18)},
                }
            ],
            "lights": [{"type": "ambient"}],
        }
    )
    expected = find_candidates(scene, driver=Freedom(decoding=0.0)).expected
    level = Sampler.level

    def wrong(self: Sampler, *changes: Any) -> Any:
        return level(self, *changes) + ERRORS[int(self.widths[0])]

    monkeypatch.setattr(Sampler, "level", wrong)
    picture = radiance(scene)[..., :3]
    assert judge(picture, expected).unexplained == 0
    # Twice the error is too much.
    monkeypatch.setattr(Sampler, "level", lambda self, *changes: 3 * wrong(self, *changes) - 2 * level(self, *changes))
    assert judge(radiance(scene)[..., :3], expected).unexplained > 0


def test_the_near_plane_may_cut_a_face_within_a_pixel(renderer: glshade.Renderer) -> None:
    """The two triangles of a face cover a pixel at their common edge together, but not beyond the near plane."""
    scene = Scene.model_validate(
        {
            "film": {"size": (32, 24), "samples": 4},
            "camera": {"eye": (0.2, 0.3, 2), "target": (0, 0, 0), "near": NEAR},
            "objects": [{"shape": "cube", "material": {"brdf": "lambert", "unlit": True}, "transform": {"rotate": TURNED}}],
            "lights": [],
        }
    )
    verdict = verify(scene, renderer=renderer, max_ambiguous=1.0)
    assert verdict.comparison.unexplained == 0
