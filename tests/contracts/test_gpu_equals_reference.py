"""Property: a model's GLSL function has the value of its float64 function, in the vertex and in the fragment stage."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.extremes import FACTOR, ORDINARY, exact
from support.strategies import directions, materials

from glshade import BRDFS, Renderer, evaluate


@pytest.mark.parametrize("on", ["vertex", "fragment"])
@pytest.mark.parametrize("name", BRDFS)
@settings(max_examples=15)
@given(data=st.data(), seed=st.integers(0, 2**32 - 1))
def test_gpu_equals_reference(name: str, on: Any, renderer: Renderer, data: Any, seed: int) -> None:
    material = data.draw(materials(name))
    l = directions(512, seed)
    # Half of the viewers look into the lobe, where the values of the models change most.
    near_mirror = l[:256] * np.float32([-1, -1, 1]) + np.random.default_rng(seed).normal(scale=0.05, size=(256, 3))
    near_mirror[:, 2] = np.abs(near_mirror[:, 2])
    near_mirror /= np.linalg.norm(near_mirror, axis=1, keepdims=True)
    v = np.concatenate([near_mirror, directions(256, seed + 1)]).astype(np.float32)
    value, conditioning = exact(material, l, v)
    # On the flank of a narrow lobe, rounding the inputs changes the value by more than 2e-6, and a larger error is allowed.
    enough = np.maximum(ORDINARY * np.maximum(1, np.abs(value)), FACTOR * conditioning)
    error = np.abs(evaluate(material, l, v, on=on, context=renderer.context) - value) / enough
    worst = np.unravel_index(np.argmax(error), error.shape)
    assert error[worst] <= 1, f"l {l[worst[0]]}, v {v[worst[0]]}: {value[worst]}"


def test_shapes_broadcast(renderer: Renderer) -> None:
    l, v = directions(3, 1)[:, None], directions(5, 2)
    for on in ("reference", "vertex", "fragment"):
        value = evaluate(BRDFS["phong"](), l, v, on=on, context=renderer.context)  # type: ignore[arg-type]
        assert value.shape == (3, 5, 3)
        one = evaluate(BRDFS["phong"](), l[1, 0], v[4], on=on, context=renderer.context)  # type: ignore[arg-type]
        assert np.array_equal(value[1, 4], one)
    assert evaluate(BRDFS["phong"](), np.zeros((0, 3)), np.zeros((0, 3)), on="fragment", context=renderer.context).shape == (
        0,
        3,
    )


def test_more_directions_than_a_row_of_pixels(renderer: Renderer) -> None:
    l, v = directions(5000, 1), directions(5000, 2)
    for on in ("vertex", "fragment"):
        value = evaluate(BRDFS["lambert"](), l, v, on=on, context=renderer.context)  # type: ignore[arg-type]
        assert value == pytest.approx(evaluate(BRDFS["lambert"](), l, v), abs=1e-7)


def test_what_it_refuses(tmp_path: Any) -> None:
    (tmp_path / "a.png").write_bytes(b"")
    textured = BRDFS["lambert"](kd={"texture": tmp_path / "a.png"})
    with pytest.raises(ValueError, match="kd is a texture"):
        evaluate(textured, [0, 0, 1], [0, 0, 1])
    with pytest.raises(ValueError, match="shape"):
        evaluate(BRDFS["lambert"](), [0, 1], [0, 1])
    with pytest.raises(ValueError, match='"vertex" or "fragment"'):
        evaluate(BRDFS["lambert"](), [0, 0, 1], [0, 0, 1], on="pixel")  # type: ignore[arg-type]
