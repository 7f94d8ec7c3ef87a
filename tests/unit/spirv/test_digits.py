"""Digits: the lines that lose digits are named, and good lines, ill-posed questions and functions that err are not."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from support.folders import forget_models

from glshade import BRDFS
from glshade.catalogue.digits import digits_of_model
from glshade.scene.models import use_models
from glshade.spirv.digits import MAGNIFIED, MENTIONED, Digits, LineLoss, joined

SUPPORT = Path(__file__).resolve().parents[2] / "support"
FORMULAS = sorted(path.stem for path in (SUPPORT / "unstable").glob("*.glsl"))
# A comment marks the lines of an unstable file that must be named.
MARK = "// loses digits"
# The number of inputs: each formula fails at several of them.
COUNT = 1024


@pytest.fixture(autouse=True)
def no_models(monkeypatch: pytest.MonkeyPatch) -> None:
    """Forgets the models of other tests, whose names the models of these tests share."""
    forget_models(monkeypatch)


def measured(folder: str, name: str, seed: int = 1) -> Digits:
    """Returns the digits that a model of tests/support loses."""
    use_models(SUPPORT / folder)
    return digits_of_model(BRDFS[name], COUNT, seed)


def marked(name: str) -> set[str]:
    """Returns the places of the lines that an unstable file marks."""
    path = SUPPORT / "unstable" / f"{name}.glsl"
    return {f"{path}:{number}" for number, line in enumerate(path.read_text().splitlines(), 1) if MARK in line}


def test_there_are_five_formulas_in_two_forms() -> None:
    assert len(FORMULAS) == 5
    assert all(marked(name) for name in FORMULAS)
    assert sorted(path.stem for path in (SUPPORT / "stable").glob("*.glsl")) == FORMULAS


@pytest.mark.parametrize("name", FORMULAS)
def test_exactly_the_lines_of_an_unstable_formula_are_named(name: str) -> None:
    digits = measured("unstable", name)
    assert {line.place for line in digits.bad} == marked(name)
    worst = digits.bad[0]
    assert worst.loss > 50 * MENTIONED
    assert worst.loss > 10 * worst.inputs
    assert MARK in worst.text


@pytest.mark.parametrize("name", FORMULAS)
def test_the_stable_form_is_clean(name: str) -> None:
    digits = measured("stable", name)
    assert digits.lines
    assert digits.bad == ()


@pytest.mark.slow
@pytest.mark.parametrize("name", FORMULAS)
@pytest.mark.parametrize("folder", ["unstable", "stable"])
def test_the_judgement_does_not_depend_on_the_seed(folder: str, name: str) -> None:
    expected = marked(name) if folder == "unstable" else set()
    for seed in range(2, 7):
        assert {line.place for line in measured(folder, name, seed).bad} == expected, seed


def test_the_same_seed_gives_the_same_digits() -> None:
    one, same, other = (measured("unstable", "spherical_gaussian", seed) for seed in (1, 1, 2))
    assert one.lines == same.lines
    assert np.array_equal(one.errors, same.errors)
    assert one.lines != other.lines


def test_an_ill_posed_question_is_told_from_a_bad_line() -> None:
    # Near the edge of so narrow a lobe, the last digit of a direction changes the value visibly, whatever the formula.
    worst = measured("stable", "spherical_gaussian").lines[0]
    assert worst.loss > 20 * MENTIONED
    assert worst.ill_posed
    assert not worst.to_blame


def test_a_line_is_not_blamed_for_what_a_built_in_function_may_err() -> None:
    worst = measured("stable", "schlick_by_pow").lines[0]
    assert "length(l + v)" in worst.text
    assert worst.loss > MENTIONED > worst.formula
    assert worst.built_in
    assert not worst.ill_posed


def test_a_formula_that_magnifies_what_a_built_in_function_may_err_is_blamed() -> None:
    power = next(line for line in measured("unstable", "power_of_cosine").bad if "pow(" in line.text)
    assert power.formula < MENTIONED < MAGNIFIED < power.loss


def test_a_result_that_is_not_finite_has_lost_all_digits() -> None:
    worst = measured("unstable", "schlick_by_pow").bad[0]
    assert worst.loss == 1.0
    assert worst.digits == pytest.approx(24 * np.log10(2))
    assert np.isfinite(worst.value).all()
    # It happens where the light stands behind the viewer.
    assert np.dot(worst.at["a_l"], worst.at["a_v"]) > 0.999


def test_of_a_line_in_several_texts_the_loss_that_is_to_blame_counts() -> None:
    def loss(loss: float, inputs: float) -> Digits:
        line = LineLoss(3, "a.glsl:3", "x = y;", loss, loss, {}, (1.0,), inputs)
        return Digits((line,), np.array([loss]), np.array([inputs]))

    both = joined([loss(1e-2, 1e-2), loss(1e-4, 0.0), loss(1e-5, 0.0)])
    assert [line.loss for line in both.lines] == [1e-4]
    assert both.errors.tolist() == [1e-2, 1e-4, 1e-5]
    assert joined([]).lines == ()
