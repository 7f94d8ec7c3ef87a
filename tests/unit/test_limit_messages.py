"""A message about a value just outside a limit shows the value with so many digits that it differs from the limit."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

from glshade import SceneError, load
from glshade.cli import cli
from glshade.errors import figure
from glshade.tradeoff.budget import rounded_up

BALL = 'objects = [{ shape = "sphere", material = { brdf = "metal", %s } }]\n'


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (BALL % "eta = 0.0099999999", "must be at least 0.01, not 0.0099999999"),
        (BALL % "roughness = 1.000000001", "must be at most 1, not 1.000000001"),
        ("[film]\nbackground = [0, 0, 0, 1.000000001]", "alpha must be from 0 to 1, not 1.000000001"),
        ("[camera]\nnear = 1.000000001\nfar = 1", "1.000000001 must be less than far, 1"),
        ('[[lights]]\ntype = "spot"\ninner = 30.000000001', "30.000000001 must not be larger than outer, 30"),
        ('[[lights]]\ntype = "gltf_spot"\ninner = 30.000000001\nouter = 30', "30.000000001 must not be larger than outer, 30"),
        ("[film]\nexposure = 64.000000001", "must be less than or equal to 64, not 64.000000001"),
    ],
)
def test_values_of_a_scene_file(text: str, message: str, tmp_path: Path) -> None:
    path = tmp_path / "scene.toml"
    path.write_text(text)
    with pytest.raises(SceneError) as caught:
        load(path)
    assert any(problem.endswith(message) for problem in caught.value.problems), caught.value.problems


def test_angles_of_a_plot(tmp_path: Path) -> None:
    result = CliRunner().invoke(cli, ["plot", "lambert", "--angles", "90.000000001"])
    assert "must be from 0 to less than 90 degrees, not 90.000000001" in result.output


@pytest.mark.parametrize(
    ("number", "text"),
    [(0.01, "0.01"), (1.0, "1"), (1 / 3, "0.3333333333333333"), (1234567, "1234567"), (np.float64(0.5), "0.5")],
)
def test_figures(number: Any, text: str) -> None:
    assert figure(number) == text


@pytest.mark.parametrize(("number", "text"), [(0.001, "0.001"), (0.0012001, "0.0013"), (0.99001, "1"), (5e-7, "5e-07")])
def test_errors_that_a_budget_must_allow_are_rounded_up(number: float, text: str) -> None:
    assert rounded_up(number, 2) == text
