"""Property: a model's specular part is nowhere larger than the model. The rest, its diffuse lobes, has no highlight."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.extremes import FACTOR, ORDINARY, exact
from support.strategies import directions, materials

from glshade import BRDFS, Renderer, evaluate

# The largest f of a diffuse part relative to its median, away from grazing directions, where diffuse lobes are steep too. The
# steepest diffuse lobe is burley's at roughness 1; a specular lobe of exponent 32 falls by 1e9.
EVEN = 8.0
# A smaller median counts as this value [1/sr], because sheen is steep only where it is faint.
FAINT = 0.1


@pytest.mark.parametrize("name", BRDFS)
@settings(max_examples=15)
@given(data=st.data(), seed=st.integers(0, 2**32 - 1))
def test_the_rest_is_neither_negative_nor_narrow(name: str, data: Any, seed: int) -> None:
    material = data.draw(materials(name))
    part = material.specular_part()
    l, v = directions(512, seed).astype(np.float64), directions(512, seed + 1).astype(np.float64)
    whole = evaluate(material, l, v)
    specular = np.zeros_like(whole) if part is None else evaluate(part, l, v)
    rest = whole - specular
    assert np.all(specular >= 0)
    assert np.all(rest >= -1e-12 * whole), "more specular light than there is"
    for view in v[v[:, 2] > 0.5][:8]:
        high = l[l[:, 2] > 0.5]
        of_view = np.broadcast_to(view, high.shape)
        lit = evaluate(material, high, of_view)
        lit = lit if part is None else lit - evaluate(part, high, of_view)
        # Differences of nearly equal numbers have no correct digits left, and count as 0.
        f = np.where(lit > 1e-9 * evaluate(material, high, of_view), lit, 0.0) / high[:, 2:]
        assert np.all(f.max(axis=0) <= EVEN * np.maximum(np.median(f, axis=0), FAINT)), (
            "a highlight is left in the diffuse part"
        )


@pytest.mark.parametrize("name", [name for name in BRDFS if BRDFS[name]().specular_part() is not None])
@settings(max_examples=8)
@given(data=st.data(), seed=st.integers(0, 2**32 - 1))
def test_gpu_has_the_part_of_the_reference(name: str, renderer: Renderer, data: Any, seed: int) -> None:
    part = data.draw(materials(name)).specular_part()
    assert part is not None
    again = part.specular_part()
    assert again is not None
    l, v = directions(256, seed), directions(256, seed + 1)
    value, conditioning = exact(part, l, v)
    enough = np.maximum(ORDINARY * np.maximum(1, np.abs(value)), FACTOR * conditioning)
    for on in ("vertex", "fragment"):
        gpu = evaluate(part, l, v, on=on, context=renderer.context)  # type: ignore[arg-type]
        assert np.all(np.abs(gpu - value) <= enough)
    # The specular part of the specular part is itself.
    assert np.array_equal(evaluate(again, l, v), evaluate(part, l, v))


def test_known_parts() -> None:
    """The diffuse parts of some models, from their formulas and not from their code."""
    l, v = np.array([0.6, 0.0, 0.8]), np.array([0.0, 0.6, 0.8])
    kd = np.array([0.75, 0.5, 0.25])

    def diffuse(name: str, **parameters: Any) -> Any:
        material = BRDFS[name](kd=tuple(kd), **parameters)
        part = material.specular_part()
        return evaluate(material, l, v) - (0 if part is None else evaluate(part, l, v))

    lambert = kd / np.pi * 0.8
    for name in ("phong", "blinn_phong", "phong_normalised", "blinn_phong_normalised", "retro_phong", "ward", "lafortune"):
        assert diffuse(name) == pytest.approx(lambert, rel=1e-7), name
    assert diffuse("lambert") == pytest.approx(lambert, rel=1e-7)
    assert diffuse("strauss", smoothness=0.5, metalness=0.5) == pytest.approx(lambert * 0.75 * 0.875, rel=1e-7)
    assert diffuse("ggx", metallic=1.0) == pytest.approx(0, abs=1e-15)
    assert diffuse("ggx", metallic=0.25, f0=0.0)[2] > 0
    # A metal's highlight has the base colour, which the specular part must keep.
    metal = BRDFS["ggx"](kd=(1.0, 0.5, 0.0), metallic=0.5, roughness=0.6)
    part = metal.specular_part()
    assert part is not None
    red, _, blue = evaluate(part, l, v)
    assert red > 2 * blue > 0
    assert BRDFS["metal"]().specular_part() == BRDFS["metal"]()
    assert BRDFS["ambient"]().specular_part() is None


def test_what_is_cut_out_stays_cut_out(tmp_path: Any) -> None:
    (tmp_path / "a.png").write_bytes(b"")
    texture = {"texture": tmp_path / "a.png", "factor": 0.5}
    cut = BRDFS["phong"](kd=texture, alpha_mode="mask").specular_part()
    assert cut is not None
    assert cut.kd.texture == tmp_path / "a.png"  # type: ignore[attr-defined]
    assert cut.kd.factor == (0.0, 0.0, 0.0)  # type: ignore[attr-defined]
    whole = BRDFS["phong"](kd=texture).specular_part()
    assert whole is not None
    assert whole.kd == (0.0, 0.0, 0.0)  # type: ignore[attr-defined]
