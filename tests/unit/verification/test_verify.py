"""Verification: right pictures are verified, faulty ones fail, and the bounds are narrow enough to find small faults."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import glshade as g
from glshade import reference
from glshade.image.file import read
from glshade.image.srgb import linear_to_srgb
from glshade.verification.candidates import find_candidates
from glshade.verification.judgement import PixelClass
from glshade.verification.verdict import verdict_of

LIGHTS = [{"type": "directional", "direction": (-0.4, -0.6, -0.7), "colour": (1.0, 0.9, 0.8)}]
SIZE = (96, 64)


def ball(size: tuple[int, int] = SIZE, lights: Any = LIGHTS, film: Any = None, **material: Any) -> g.Scene:
    """Returns a scene of a sphere. material: keys that replace those of its material."""
    material = {"brdf": "phong", "kd": (0.5, 0.4, 0.3), "ks": 0.4, "exponent": 40.0, **material}
    return g.Scene.model_validate(
        {
            "film": {"size": size, **(film or {})},
            "camera": {"type": "perspective", "eye": (0.5, 0.8, 4.0), "target": (0.0, 0.0, 0.0), "fov": 35},
            "objects": [{"shape": {"type": "sphere", "segments": 32, "rings": 16}, "material": material}],
            "lights": lights,
        }
    )


@pytest.fixture(scope="module")
def drawn(renderer: g.Renderer) -> Any:
    """The GPU's picture of the ball, (H, W, 3) float32."""
    return renderer.render(ball(), dtype="float32").pixels.copy()


@pytest.fixture(scope="module")
def expected() -> Any:
    """The candidates of the ball."""
    return find_candidates(ball())


def test_a_right_picture_is_verified(renderer: g.Renderer) -> None:
    verdict = g.verify(ball(), renderer=renderer)
    assert verdict.verdict == "verified", str(verdict)
    assert (verdict.unexplained, verdict.exit_code, verdict.reasons) == (0, 0, ())
    assert verdict.comparison.counts[PixelClass.INTERIOR] > 1000
    assert verdict.comparison.counts[PixelClass.SEAM] > 10
    assert verdict.comparison.worst < 5e-5
    assert "llvmpipe" in verdict.driver or verdict.driver
    json.dumps(verdict.as_dict(), allow_nan=False)


@pytest.mark.parametrize(
    "wrong",
    [
        lambda p: np.full_like(p, np.nan),
        np.zeros_like,
        np.ones_like,
        lambda p: np.roll(p, 1, axis=0),
        lambda p: np.roll(p, -1, axis=1),
        lambda p: p[::-1].copy(),
        lambda p: p[..., ::-1].copy(),
        lambda p: p * np.float32(1.001),
        lambda p: p + np.float32(1e-3),
        lambda p: -p,
    ],
    ids=["nan", "black", "white", "down", "left", "upside down", "swapped", "0.1 % brighter", "lifted", "negative"],
)
def test_a_wrong_picture_fails(wrong: Any, drawn: Any) -> None:
    verdict = g.verify(ball(), picture=wrong(drawn))
    assert verdict.verdict == "failed"
    assert verdict.exit_code == 6
    assert verdict.worst_pixels


def test_one_wrong_pixel_fails_and_is_named(drawn: Any, expected: Any) -> None:
    for (x, y), value, origin in (((48, 32), 0.5, "shading"), ((48, 32), 0.0, "coverage"), ((1, 1), 0.5, "coverage")):
        pixels = drawn.copy()
        pixels[y, x] = value
        verdict = verdict_of(pixels, expected)
        assert verdict.unexplained == 1
        (pixel, *_) = verdict.worst_pixels
        assert (pixel.x, pixel.y, pixel.origin) == (x, y, origin)
    verdict = verdict_of(linear_to_srgb(drawn), expected)
    assert "encode" in {pixel.origin for pixel in verdict.worst_pixels}


def test_a_hidden_surface_drawn_in_front_is_a_fault_of_depth(renderer: g.Renderer) -> None:
    near = {"shape": {"type": "plane"}, "transform": {"translate": (0, 0, 1), "rotate": (90, 0, 0)}}
    far = {"shape": {"type": "plane"}, "transform": {"rotate": (90, 0, 0), "scale": (2, 2, 2)}}
    red, green = ({"brdf": "lambert", "kd": kd} for kd in ((0.8, 0.1, 0.1), (0.1, 0.8, 0.1)))
    camera = {"type": "orthographic", "eye": (0, 0, 5), "target": (0, 0, 0), "height": 6}

    def scene(*objects: Any) -> g.Scene:
        film = {"size": (32, 32)}
        return g.Scene.model_validate({"objects": objects, "camera": camera, "lights": LIGHTS, "film": film})

    behind = renderer.render(scene({**far, "material": green}), dtype="float32").pixels.copy()
    verdict = g.verify(scene({**near, "material": red}, {**far, "material": green}), picture=behind)
    assert verdict.verdict == "failed"
    assert {pixel.origin for pixel in verdict.worst_pixels} == {"depth"}


@pytest.mark.parametrize("brdf", ["phong", "blinn_phong"])
def test_an_exponent_off_by_one_percent_does_not_hide(brdf: str, renderer: g.Renderer) -> None:
    for exponent in (5.0, 40.0, 400.0):
        wrong = renderer.render(ball(brdf=brdf, exponent=1.01 * exponent), dtype="float32").pixels
        verdict = g.verify(ball(brdf=brdf, exponent=exponent), picture=wrong.copy(), renderer=renderer)
        assert verdict.verdict == "failed", exponent


def test_a_normal_off_by_a_tenth_of_a_degree_does_not_hide(renderer: g.Renderer) -> None:
    scene = ball()
    (item,) = scene.objects
    for axis in range(3):
        angles = [0.0, 0.0, 0.0]
        angles[axis] = 0.1
        # A sphere turned by 0.1 degree has nearly the same outline, but other normals.
        turned = item.model_copy(update={"transform": g.Transform(rotate=tuple(angles))})
        picture = renderer.render(scene.model_copy(update={"objects": (turned,)}), dtype="float32").pixels.copy()
        assert g.verify(scene, picture=picture, renderer=renderer).verdict == "failed"


def test_the_reference_explains_itself(expected: Any) -> None:
    verdict = verdict_of(reference.render(ball()).pixels, expected)
    assert verdict.verdict == "verified"
    assert verdict.comparison.worst < 1e-7


def test_masks_count_against_the_budget(drawn: Any, expected: Any) -> None:
    mask = np.zeros(drawn.shape[:2], dtype=bool)
    mask[20:40, 30:60] = True
    wrong = drawn.copy()
    wrong[mask] = 7.0
    verdict = verdict_of(wrong, expected, mask)
    assert (verdict.verdict, verdict.exit_code) == ("inconclusive", 7)
    assert verdict_of(wrong, expected, mask, max_ambiguous=0.5).verdict == "verified"


def test_a_tiny_object_proves_nothing(renderer: g.Renderer) -> None:
    # The strip is 1/50 of a pixel wide and runs along the middles of a column of pixels: a driver may draw any part of it.
    strip = {"rotate": (90, 0, 0), "scale": (1e-3, 1, 1), "translate": (0.05, 0, 0)}
    scene = g.Scene.model_validate(
        {
            "film": {"size": (60, 60)},
            "camera": {"type": "orthographic", "eye": (0, 0, 5), "target": (0, 0, 0), "height": 6},
            "objects": [{"shape": "plane", "transform": strip}],
        }
    )
    verdict = g.verify(scene, renderer=renderer)
    assert (verdict.verdict, verdict.unexplained) == ("inconclusive", 0)
    assert verdict.ambiguous < 0.03
    assert verdict.comparison.doubtful > 0.5


def test_empty_and_dark_scenes(renderer: g.Renderer) -> None:
    assert g.verify(ball(lights=[]), renderer=renderer).verdict == "verified"
    away = ball().model_copy(update={"camera": g.Perspective(eye=(0.0, 0.0, 4.0), target=(0.0, 0.0, 9.0))})
    assert g.verify(away, renderer=renderer).verdict == "verified"
    assert g.verify(away, picture=renderer.render(ball(), dtype="float32").pixels.copy()).verdict == "failed"


def test_blended_and_cut_out_surfaces(renderer: g.Renderer, tmp_path: Path) -> None:
    checks = np.zeros((16, 16, 4), dtype=np.float32)
    checks[..., :3] = 0.7
    checks[..., 3] = np.indices((16, 16)).sum(axis=0) // 4 % 2
    g.Image(checks).save(tmp_path / "checks.exr")
    grid = {"texture": str(tmp_path / "checks.exr")}
    cut = {"brdf": "lambert", "kd": grid, "alpha_mode": "mask"}
    glass = {"brdf": "lambert", "kd": (0.3, 0.5, 0.9), "alpha_mode": "blend", "alpha": 0.4}
    objects = [
        {"shape": "sphere", "material": {"brdf": "lambert"}},
        {"shape": "cube", "transform": {"scale": (1.5, 1.5, 1.5)}, "material": cut},
        {"shape": "plane", "transform": {"translate": (0, 0, 2), "rotate": (80, 0, 0)}, "material": glass},
    ]
    camera = {"type": "perspective", "eye": (1.0, 1.5, 6.0), "target": (0, 0, 0), "fov": 40}
    scene = g.Scene.model_validate({"film": {"size": SIZE}, "camera": camera, "objects": objects, "lights": LIGHTS})
    with pytest.warns(UserWarning, match="blended"):
        verdict = g.verify(scene, renderer=renderer, max_ambiguous=0.1)
    assert verdict.unexplained == 0, str(verdict)
    wrong = verdict.picture * np.float32(1.01)
    assert g.verify(scene, picture=wrong).verdict == "failed"


def test_report(drawn: Any, expected: Any, tmp_path: Path) -> None:
    pixels = drawn.copy()
    pixels[32, 48] = 2.0
    page = verdict_of(pixels, expected).report(tmp_path / "report", "ball")
    text = page.read_text(encoding="utf-8")
    assert "failed" in text
    assert "1 pixel is outside" in text
    assert "shading" in text


def test_command(glshade: Any, tmp_path: Path) -> None:
    scene = tmp_path / "ball.toml"
    scene.write_text('objects = [{ shape = "sphere" }]\n[film]\nsize = [64, 48]\n', encoding="utf-8")
    done = glshade("verify", scene, "--report", tmp_path / "report")
    assert done.returncode == 0, done.stderr
    assert "verified: 0 pixels unexplained" in done.stdout
    assert (tmp_path / "report" / "index.html").exists()
    done = glshade("verify", scene, "--max-ambiguous", "0", "--json")
    assert (done.returncode, json.loads(done.stdout)["verdict"]) == (7, "inconclusive")
    done = glshade("verify", scene, "--mutate", "all")
    assert done.returncode == 0, done.stdout
    assert done.stdout.count("caught,") > 10
    done = glshade("verify", scene, "--mutate", "mirored")
    assert done.returncode == 2
    assert "mirrored" in done.stderr
    assert glshade("verify").returncode == 2


def test_reference_picture(glshade: Any, tmp_path: Path) -> None:
    scene, output = tmp_path / "ball.toml", tmp_path / "ball.exr"
    scene.write_text('objects = [{ shape = "sphere" }]\n[film]\nsize = [32, 24]\n', encoding="utf-8")
    done = glshade("render", scene, "--reference", "-o", output)
    assert done.returncode == 0, done.stderr
    assert np.abs(read(output)[0][..., :3] - reference.render(g.load(scene)).pixels).max() == 0


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ({"quality": {"normalise": False}}, "quality.normalise = false"),
        ({"quality": {"arithmetic": "fast"}}, "quality.arithmetic = fast"),
        ({"quality": {"storage": "rgba16f"}}, "quality.storage = rgba16f"),
    ],
)
def test_settings_that_are_not_judged_are_named(keys: Any, words: str, renderer: g.Renderer) -> None:
    scene = ball()
    document = scene.model_dump(exclude_none=True)
    for table, values in keys.items():
        document[table] = {**document[table], **values}
    verdict = g.verify(g.Scene.model_validate(document), renderer=renderer)
    assert verdict.verdict == "verified"
    assert verdict.left_out == (words,)
    assert words in str(verdict)
    assert verdict.as_dict()["left_out"] == [words]
    assert g.verify(scene, renderer=renderer).left_out == ()


def test_an_object_s_own_quality_is_not_judged_either(renderer: g.Renderer) -> None:
    document = ball().model_dump(exclude_none=True)
    document["objects"][0]["quality"] = {"normalise": False}
    verdict = g.verify(g.Scene.model_validate(document), renderer=renderer)
    assert (verdict.verdict, verdict.left_out) == ("verified", ("quality.normalise = false",))
