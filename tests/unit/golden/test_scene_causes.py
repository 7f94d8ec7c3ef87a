"""Causes in a scene: a fault that the float64 reference draws on purpose is named, with its object and its size."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from support import faulty

from glshade.golden.cause import scene_causes
from glshade.golden.result import Cause
from glshade.reference.freedom import LLVMPIPE
from glshade.reference.picture import radiance
from glshade.verification.candidates import Candidates, find_candidates

SCENE = faulty.scene()
TRUE = faulty.drawn(SCENE)
Description = dict[str, Any]

# Height of a pixel [scene units].
PIXEL = 4.5 / 72


@pytest.fixture(scope="module")
def candidates() -> Candidates:
    return find_candidates(SCENE, driver=LLVMPIPE)


def causes(
    candidates: Candidates, wrong: Any, stored: Callable[[Any], Any] = np.float32, right: bool = True
) -> tuple[Cause, ...]:
    """Returns the causes of a wrong linear picture. right: whether the baseline is right."""
    return scene_causes(SCENE, candidates, stored(TRUE), stored(wrong), stored(TRUE) if right else None)


# Id: (edit of the scene's description, kind and text of the cause, the stage).
FAULTS: dict[str, tuple[Callable[[Description], Any], tuple[str, str], str]] = {
    "a light is off": (lambda d: d["lights"][1].update(intensity=0), ("light", "light fill x 0.00"), "shading"),
    "a light is too strong": (lambda d: d["lights"][0].update(intensity=26.25), ("light", "light key x 1.05"), "shading"),
    "a light has another colour": (
        lambda d: d["lights"][0].update(colour=(1.0, 0.5, 1.0)),
        ("light", "light key x (1.00, 0.50, 1.00)"),
        "shading",
    ),
    "highlights are too weak": (lambda d: _ball(d).update(ks=0.15), ("lobe", "specular x 0.50"), "shading"),
    "a colour is another": (
        lambda d: _ball(d).update(kd=(0.1, 0.3, 0.4)),
        ("lobe", "diffuse of ball x (0.20, 1.00, 2.00)"),
        "shading",
    ),
    "highlights are too narrow": (lambda d: _ball(d).update(exponent=60.0), ("parameter", "exponent of ball x 3"), "shading"),
    "an object is missing": (lambda d: d["objects"].pop(1), ("object", "object ball missing"), "coverage"),
    "an object is moved": (
        lambda d: d["objects"][1].update(transform={"translate": (3 * PIXEL, -2 * PIXEL, 0)}),
        ("object", "object ball moved by (3, 2) pixels"),
        "coverage",
    ),
    "a light is turned": (
        lambda d: d["lights"][1].update(direction=(2, 0.5, -1)),
        ("light", "direction of light fill changed"),
        "shading",
    ),
    "a light is moved": (
        lambda d: d["lights"][0].update(position=(4, 3, 6)),
        ("light", "position of light key changed by (0, -1, 0)"),
        "shading",
    ),
    "a light falls off otherwise": (
        lambda d: d["lights"][0].update(falloff="1/r"),
        ("falloff", "falloff of light key: 1/r in place of 1/r^2"),
        "shading",
    ),
    "an object is shaded at its vertices": (
        lambda d: d["objects"][1].update(shading="gouraud"),
        ("rate", "shading at the vertices, not at the pixels, on ball"),
        "shading",
    ),
    "the exposure is lower": (lambda d: d["film"].update(exposure=-1.0), ("exposure", "exposure x 0.50"), "encode"),
}  # fmt: skip


def _ball(description: Description) -> Description:
    material: Description = description["objects"][1]["material"]
    return material


@pytest.mark.parametrize("stored", [faulty.codes, np.float32], ids=["codes", "floats"])
@pytest.mark.parametrize("name", FAULTS)
def test_faults_are_named(candidates: Candidates, name: str, stored: Any) -> None:
    edit, (kind, text), stage = FAULTS[name]
    found = causes(candidates, faulty.drawn(faulty.scene(edit)), stored)
    assert [(cause.kind, cause.stage) for cause in found] == [(kind, stage)], found
    assert found[0].text.startswith(text)
    assert found[0].explained > 0.95


def test_two_faults_are_named_together(candidates: Candidates) -> None:
    def edit(description: Description) -> None:
        description["lights"][1]["intensity"] = 0
        _ball(description)["ks"] = 0.15

    (cause,) = causes(candidates, faulty.drawn(faulty.scene(edit)))
    assert set(cause.text.split(" and ")) == {"light fill x 0.00", "specular x 0.50"}


def test_objects_with_their_own_faults_have_their_own_causes(candidates: Candidates) -> None:
    def edit(description: Description) -> None:
        _ball(description)["exponent"] = 60.0
        description["objects"][0]["material"]["kd"] = (0.25, 0.3, 0.2)

    found = causes(candidates, faulty.drawn(faulty.scene(edit)))
    assert {cause.object: cause.text for cause in found} == {
        "wall": "all light of wall x 0.50",
        "ball": "exponent of ball x 3",
    }


@pytest.mark.parametrize(
    ("change", "kind", "text"),
    [
        (lambda p: p[::-1], "flip", "whole picture flipped upside down"),
        (lambda p: p[:, ::-1], "flip", "whole picture mirrored left to right"),
        (lambda p: p[..., ::-1], "exchange", "channels r, b exchanged"),
        (lambda p: np.roll(p, (2, -3), (0, 1)), "shift", "whole picture shifted by (-3, 2)"),
        (lambda p: 0 * p, "empty", "whole picture black"),
    ],
)
@pytest.mark.parametrize("stored", [faulty.codes, np.float32], ids=["codes", "floats"])
def test_faults_of_the_whole_picture_come_first(candidates: Candidates, change: Any, kind: str, text: str, stored: Any) -> None:
    for right in (True, False):
        (cause,) = causes(candidates, change(TRUE), stored, right)
        assert (cause.kind, cause.text) == (kind, text)


def test_nothing_is_named_where_nothing_explains_the_change(candidates: Candidates) -> None:
    random = np.random.default_rng(5)
    noisy = TRUE * random.uniform(0.5, 1.5, TRUE.shape).astype(np.float32)
    assert causes(candidates, noisy) == ()
    square = TRUE.copy()
    square[30:40, 40:50] = random.uniform(0, 1, (10, 10, 3))
    assert causes(candidates, square) == ()
    one = TRUE.copy()
    one[36, 48] = 0
    assert causes(candidates, one) == (), "nearly every fault would explain a single pixel"


def test_the_same_picture_has_the_same_causes(candidates: Candidates) -> None:
    wrong = faulty.drawn(faulty.scene(lambda d: _ball(d).update(exponent=25.0)))
    assert causes(candidates, wrong) == causes(candidates, wrong)


def test_blended_objects_transparent_backgrounds_and_odd_names() -> None:
    def glassy(description: Description) -> None:
        description["film"]["background"] = (0.1, 0.1, 0.1, 0.0)
        description["objects"][0]["transform"]["scale"] = (1.2, 1, 1)
        description["objects"][1]["name"] = "b{of}ll {x}"
        glass = {"brdf": "lambert", "kd": 0.2, "alpha": 0.5, "alpha_mode": "blend"}
        pane = {"name": "pane", "shape": {"type": "cube"}, "material": glass}
        description["objects"].append({**pane, "transform": {"translate": (0.6, 0, 2), "scale": (0.3, 3, 0.1)}})

    def faulty_one(description: Description) -> None:
        glassy(description)
        _ball(description)["exponent"] = 60.0

    right, wrong = faulty.scene(glassy), faulty.scene(faulty_one)
    for stored in (faulty.codes, np.float32):
        pictures = [stored(radiance(of).astype(np.float32)) for of in (right, wrong)]
        (cause,) = scene_causes(right, find_candidates(right, driver=LLVMPIPE), *pictures, pictures[0])
        assert cause.text.startswith("exponent of b{of}ll {x} x 3")
    nothing = faulty.scene(lambda d: d["objects"][0].update(transform={"translate": (0, 0, 90)}) or d["objects"].pop(1))
    pictures = [radiance(of).astype(np.float32) for of in (nothing, faulty.scene())]
    assert scene_causes(nothing, find_candidates(nothing, driver=LLVMPIPE), *pictures, None) == ()
