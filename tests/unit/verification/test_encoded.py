"""8-bit pictures are judged by intervals that are carried through the encoding and the rounding to codes."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import glshade as g
from glshade.driver.freedom import measure_freedom
from glshade.errors import NoReference
from glshade.image.srgb import linear_to_srgb, srgb_to_linear
from glshade.reference.freedom import UNMEASURED
from glshade.verification.candidates import find_candidates, straight
from glshade.verification.codes import ENCODINGS, carried, encoded
from glshade.verification.encoded import judge_pixels
from glshade.verification.judgement import PixelClass

SIZE = (64, 48)
FILMS: dict[str, dict[str, Any]] = {
    "direct": {},
    "linear codes": {"encoding": "linear"},
    "exposed": {"exposure": 1.5},
    "clear background": {"background": (0.0, 0.0, 0.0, 0.0)},
    "half-clear background": {"background": (0.2, 0.5, 0.1, 0.5)},
    "four samples": {"samples": 4, "background": (0.2, 0.5, 0.1)},
    "four samples on clear": {"samples": 4, "background": (0.9, 0.2, 0.2, 0.0)},
    "supersampled": {"supersample": 2, "background": (0.3, 0.2, 0.1, 0.7)},
}


def ball(**film: Any) -> g.Scene:
    return g.Scene.model_validate(
        {
            "film": {"size": SIZE, **film},
            "camera": {"type": "perspective", "eye": (0.5, 0.8, 4.0), "target": (0.0, 0.0, 0.0), "fov": 35},
            "objects": [
                {
                    "shape": {"type": "sphere", "segments": 32, "rings": 16},
                    "material": {"brdf": "phong", "kd": (0.5, 0.4, 0.3), "ks": 0.4, "exponent": 40.0},
                }
            ],
            "lights": [{"type": "directional", "direction": (-0.4, -0.6, -0.7), "colour": (1.0, 0.9, 0.8)}],
        }
    )


def drawn(renderer: g.Renderer, scene: g.Scene) -> tuple[Any, Any]:
    """Returns (8-bit pixels, candidates for the renderer's driver)."""
    return renderer.render(scene).pixels.copy(), find_candidates(scene, driver=measure_freedom(renderer.context))


@pytest.mark.parametrize("name", FILMS)
def test_a_right_picture_is_verified(name: str, renderer: g.Renderer) -> None:
    scene = ball(**FILMS[name])
    pixels, expected = drawn(renderer, scene)
    verdict = judge_pixels(pixels, expected, encoding=scene.film.encoding)
    assert verdict.verdict == "verified", str(verdict)
    assert (verdict.picture.dtype, verdict.reference.dtype) == (np.uint8, np.uint8)
    assert judge_pixels(pixels, replace(expected, driver=UNMEASURED), encoding=scene.film.encoding).unexplained == 0


@pytest.mark.parametrize("name", ["direct", "linear codes", "half-clear background"])
def test_two_codes_too_much_fail(name: str, renderer: g.Renderer) -> None:
    scene = ball(**FILMS[name])
    pixels, expected = drawn(renderer, scene)
    inside = np.flatnonzero(expected.expected.classes == PixelClass.INTERIOR)[::97]
    background = np.flatnonzero(expected.expected.classes == PixelClass.BACKGROUND)[::397]
    assert len(inside) > 5
    assert len(background) > 3
    for pixel in (*inside, *background):
        for channel in range(pixels.shape[2]):
            wrong = pixels.copy()
            code = int(wrong[pixel // SIZE[0], pixel % SIZE[0], channel])
            wrong[pixel // SIZE[0], pixel % SIZE[0], channel] = code + 2 if code < 250 else code - 2
            assert judge_pixels(wrong, expected, encoding=scene.film.encoding, explain=False).unexplained == 1


def test_floats_are_judged_as_they_are(renderer: g.Renderer) -> None:
    scene = ball()
    _, expected = drawn(renderer, scene)
    pixels = renderer.render(scene, dtype="float32").pixels.copy()
    assert judge_pixels(pixels, expected, encoding="no matter").verdict == "verified"
    assert judge_pixels(pixels * np.float32(1.001), expected).verdict == "failed"


@pytest.mark.parametrize(
    ("fault", "origin"),
    [
        (lambda codes: np.rint(255 * linear_to_srgb(codes / 255)), "encode"),
        (lambda codes: np.rint(255 * srgb_to_linear(codes / 255)), "encode"),
        (lambda codes: codes * 0.7, "shading"),
    ],
    ids=["encoded twice", "not encoded", "too dark"],
)
def test_a_fault_of_the_encoding_is_told_from_one_of_the_shading(fault: Any, origin: str, renderer: g.Renderer) -> None:
    pixels, expected = drawn(renderer, ball())
    verdict = judge_pixels(fault(pixels).astype(np.uint8), expected)
    assert verdict.verdict == "failed"
    # Some values are near a fixed point of the curve, where the faults look alike.
    origins = [pixel.origin for pixel in verdict.worst_pixels]
    assert origins.count(origin) > len(origins) / 2


def test_pictures_that_cannot_be_judged(renderer: g.Renderer) -> None:
    pixels, expected = drawn(renderer, ball())
    viewed = replace(expected, film=expected.film.model_copy(update={"display": "sRGB - Display"}))
    with pytest.raises(NoReference, match="a view transform"):
        judge_pixels(pixels, viewed)
    assert judge_pixels(renderer.render(ball(), dtype="float32").pixels, viewed).unexplained == 0, "it is linear"
    with pytest.raises(NoReference, match="'g22_rec709_display' is not judged; srgb and linear are"):
        judge_pixels(pixels, expected, encoding="g22_rec709_display")
    with pytest.raises(g.GlshadeError, match="uint16: floats and uint8"):
        judge_pixels(pixels.astype(np.uint16), expected)
    with pytest.raises(g.GlshadeError, match="shape"):
        judge_pixels(pixels[:-1], expected)


def test_a_report_of_codes(renderer: g.Renderer, tmp_path: Any) -> None:
    pixels, expected = drawn(renderer, ball(background=(0.2, 0.5, 0.1, 0.5)))
    pixels[24, 32] = 7
    page = judge_pixels(pixels, expected).report(tmp_path / "report", "codes")
    assert "1 pixel is outside" in page.read_text(encoding="utf-8")


unit = st.floats(0, 1)


@given(
    colours=st.lists(st.tuples(unit, unit, unit), min_size=1, max_size=5),
    alphas=st.lists(unit, min_size=5, max_size=5),
    shares=st.lists(st.floats(0.01, 1), min_size=5, max_size=5),
    encoding=st.sampled_from(sorted(ENCODINGS)),
)
def test_the_code_of_a_mean_lies_between_the_carried_ends(colours: Any, alphas: Any, shares: Any, encoding: str) -> None:
    """A film's mean is taken of premultiplied linear samples, and then divided by its alpha, encoded and rounded."""
    alpha = np.array(alphas[: len(colours)])[:, None]
    samples = np.concatenate([np.array(colours) * alpha, alpha], axis=1)
    weight = np.array(shares[: len(colours)])
    mean = (samples * (weight / weight.sum())[:, None]).sum(axis=0)
    least, largest = straight(samples, samples)
    ends = least.min(axis=0, keepdims=True), largest.max(axis=0, keepdims=True)
    low, high = carried(samples.min(axis=0, keepdims=True), samples.max(axis=0, keepdims=True), ends, encoding)
    codes = g.Image(mean[None, None].astype(np.float32)).encoded("srgb" if encoding == "srgb" else "linear").pixels[0, 0]
    shown = codes / 255 if codes[3] else np.append(low[0, :3], 0)
    assert (shown >= low[0] - 0.51 / 255).all()
    assert (shown <= high[0] + 0.51 / 255).all()


def test_encoded_candidates_keep_their_surfaces(renderer: g.Renderer) -> None:
    _, expected = drawn(renderer, ball())
    codes = encoded(expected, "srgb")
    assert codes.owner(0) == expected.owner(0) == ("objects[0]", expected.triangle[0])
    assert (codes.expected.low <= codes.expected.centre).all()
    assert (codes.expected.centre <= codes.expected.high).all()
