"""The reference allows a driver the level of detail by its own rule, and one that was not measured all that OpenGL allows."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from glshade import Image, Scene, verify
from glshade.radiance.sampler import RULES, Rule, Sampler
from glshade.reference.freedom import LLVMPIPE, UNMEASURED, Freedom
from glshade.reference.picture import radiance
from glshade.reference.shade import Sampling
from glshade.verification.candidates import find_candidates
from glshade.verification.judgement import judge

# A square of this many pixels shows a texture that is turned by 45 degrees, so that a pixel spans 4 texels along its row and
# along its column. By the rule "largest" it spans 4 cos(45 degrees) texels, by the rule "sum" twice as many.
SIZE = 32
DIFFERENCE = {"length": 0.0, "largest": -0.5, "sum": 0.5}


@pytest.fixture(scope="module")
def turned(tmp_path_factory: pytest.TempPathFactory) -> Scene:
    texture = tmp_path_factory.mktemp("texture") / "noise.exr"
    noise = np.random.default_rng(0).uniform(size=(256, 256, 1)).astype(np.float32)
    Image(np.repeat(noise, 3, axis=2)).save(texture)
    plane = {
        "shape": "plane",
        "transform": {"rotate": [90, 0, 0]},
        "material": {"brdf": "ambient", "ka": {"texture": str(texture)}},
    }
    # The plane is 2 units wide, which are 256 texels. So the picture, 1 unit high, shows 128 texels along each side.
    camera = {"type": "orthographic", "eye": [0, 0, 1], "target": [0, 0, 0], "up": [1, 1, 0], "height": 1}
    film = {"size": [SIZE, SIZE]}
    return Scene.model_validate({"objects": [plane], "lights": [{"type": "ambient"}], "camera": camera, "film": film})


def unexplained(scene: Scene, picture: NDArray[np.float64], rules: tuple[Rule, ...]) -> int:
    """Returns the number of the picture's pixels that a driver with these rules may not show."""
    driver = Freedom(rules=rules, level=0.01)
    return judge(picture[..., :3], find_candidates(scene, driver=driver).expected).unexplained


def test_the_rules_are_ordered() -> None:
    """OpenGL 4.6 core, equation 8.11."""
    dx, dy = np.random.default_rng(0).normal(size=(2, 1000, 2))
    least, middle, largest = (RULES[rule](dx, dy) for rule in ("largest", "length", "sum"))
    assert (least <= middle).all()
    assert (middle <= largest).all()
    assert (least < 0.8 * largest).any()


def test_a_texture_that_is_not_square_counts_in_texels() -> None:
    sampler = Sampler.of(np.zeros((4, 32, 4), dtype=np.float32), ("repeat", "repeat"))
    dx, dy = np.array([[0.25, 0.0]]), np.array([[0.0, 0.25]])
    assert [float(sampler.level(dx, dy, rule)[0]) for rule in ("length", "largest")] == [3.0, 3.0]
    assert sampler.level(dx, dy, "sum") == pytest.approx(np.log2(9))


@pytest.mark.parametrize("drawn", RULES)
@pytest.mark.parametrize("measured", RULES)
def test_a_level_by_another_rule_is_rejected(turned: Scene, drawn: Rule, measured: Rule) -> None:
    picture = radiance(turned, sampling=Sampling(level=DIFFERENCE[drawn]))
    wrong = unexplained(turned, picture, (measured,))
    # The reference's own level, by the rule "length", is allowed by each of them.
    assert wrong == 0 if drawn in (measured, "length") else wrong > 100


@pytest.mark.parametrize("level", [-0.5, -0.2, 0.0, 0.3, 0.5])
def test_a_driver_that_was_not_measured_may_use_any_level_that_opengl_allows(turned: Scene, level: float) -> None:
    assert unexplained(turned, radiance(turned, sampling=Sampling(level=level)), UNMEASURED.rules) == 0


@pytest.mark.parametrize("level", [-1.0, 1.0])
def test_a_level_that_opengl_does_not_allow_is_rejected(turned: Scene, level: float) -> None:
    assert unexplained(turned, radiance(turned, sampling=Sampling(level=level)), UNMEASURED.rules) > 100


@pytest.mark.parametrize("level", [-0.5, 0.5])
def test_a_picture_of_an_unknown_driver_may_have_any_level_that_opengl_allows(turned: Scene, level: float) -> None:
    picture = radiance(turned, sampling=Sampling(level=level))[..., :3]
    assert verify(turned, picture=picture).unexplained == 0
    assert verify(turned, picture=picture, driver=LLVMPIPE).verdict == "failed"
