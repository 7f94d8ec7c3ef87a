"""Commands `glshade fit`, `glshade bake`, and `glshade plot` of a file of measurements."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

from glshade.brdfs import BRDFS
from glshade.catalogue.baking import baked_grid
from glshade.cli import cli
from glshade.errors import AssetError, GlshadeError
from glshade.measured.formats import binary
from glshade.measured.reading import read
from glshade.measured.samples import Grid, Samples


def run(*words: str) -> Any:
    result = CliRunner().invoke(cli, words, catch_exceptions=False, standalone_mode=False)
    return result


@pytest.fixture
def baked(tmp_path: Path) -> Path:
    """A small file of a material's values."""
    material = BRDFS["ward"].model_validate({"brdf": "ward", "alpha_x": 0.25, "kd": (0.3, 0.2, 0.1)})
    path = tmp_path / "paint 1.binary"
    path.write_bytes(binary.written(baked_grid(material, (12, 20, 20)).f))
    return path


def test_fit_prints_a_material_to_paste_and_the_errors_by_angle(baked: Path) -> None:
    printed = run("fit", str(baked), "--model", "ward").output
    material, _, errors = printed.partition("\n\n")
    table = tomllib.loads(material)["materials"]["paint_1"]
    assert table["brdf"] == "ward"
    assert table["alpha_x"] == pytest.approx(0.25, rel=0.01)
    assert table["kd"] == pytest.approx([0.3, 0.2, 0.1], rel=0.01)
    # A scene takes what is printed.
    assert BRDFS["ward"].model_validate(table).alpha_x == pytest.approx(0.25, rel=0.01)  # type: ignore[attr-defined]
    assert "# Not fitted: alpha_y" in material
    heads, *rows = errors.splitlines()
    assert heads.split() == ["light", "from", "samples", "ward", "constant", "table"]
    assert len(rows) >= 4


def test_fit_keeps_parameters_and_options_that_are_given(baked: Path) -> None:
    table = tomllib.loads(
        run("fit", str(baked), "--model", "plastic", "-p", "ior=1.6", "-p", "fresnel=schlick").output.split("\n\n")[0]
    )
    found = table["materials"]["paint_1"]
    assert found["ior"] == 1.6
    assert found["fresnel"] == "schlick"


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--model", "wrad"), 'did you mean "ward"'),
        (("--model", "ward", "-p", "alfa=1"), "ward has no 'alfa'"),
        (("--model", "ward", "--start", "alfa=1"), "ward has no 'alfa'"),
        (("--model", "ward", "-p", "alpha_x=7"), "must be at most 1"),
        (("--model", "lambert", "-p", "kd=0.5"), "no parameter that is free"),
        (("--model", "measured"), "measured is no formula"),
    ],
)
def test_fit_refuses_what_it_cannot_do(baked: Path, words: tuple[str, ...], message: str) -> None:
    result = CliRunner().invoke(cli, ("fit", str(baked), *words))
    assert result.exit_code == 2
    assert message in result.output


def test_fit_and_plot_refuse_a_damaged_file_by_its_name(tmp_path: Path) -> None:
    path = tmp_path / "a.brdf"
    path.write_text("# num wls\n3\n450 550 650\n0.1 0.2 0.3\n", encoding="utf-8")
    for command in (("fit", str(path), "--model", "ward"), ("plot", str(path), "-o", str(tmp_path / "a.svg"))):
        with pytest.raises(AssetError, match="cut short"):
            run(*command)
    assert not (tmp_path / "a.svg").exists()


def test_bake_writes_files_that_are_read_back(tmp_path: Path) -> None:
    for name, kind in (("a.binary", Grid), ("a.brdf", Samples)):
        path = tmp_path / name
        assert run("bake", "ward:alpha_x=0.3", "-o", str(path)).output == f"{path}\n"
        measured = read(path)
        assert isinstance(measured, kind)
        assert np.nanmin(measured.f) == pytest.approx(0.4 / np.pi, rel=1e-3)


def test_bake_tells_what_a_format_cannot_hold(tmp_path: Path) -> None:
    with pytest.raises(GlshadeError, match=r"write a \.brdf"):
        run("bake", "ward:alpha_x=0.3,alpha_y=0.1", "-o", str(tmp_path / "a.binary"))
    with pytest.raises(GlshadeError, match=r"\.binary or \.brdf"):
        run("bake", "ward", "-o", str(tmp_path / "a.bsdf"))
    assert not list(tmp_path.iterdir())
    result = run("bake", "blinn_phong", "-o", str(tmp_path / "a.binary"))
    assert "not reciprocal" in result.stderr


def test_plot_draws_a_file_beside_its_fit(baked: Path, tmp_path: Path) -> None:
    pytest.importorskip("matplotlib", reason="plots need matplotlib")
    output = tmp_path / "a.svg"
    assert run("plot", str(baked), "--fit", "ward", "-o", str(output)).output == f"{output}\n"
    assert "<svg" in output.read_text(encoding="utf-8")


def test_plot_refuses_what_it_cannot_draw_beside_a_file(baked: Path, tmp_path: Path) -> None:
    output = tmp_path / "a.svg"
    for words, message in (
        (("ward",), "is plotted alone"),
        (("--bare",), "--bare has no effect"),
        (("-k", "albedo", "--angles", "20"), "--kind has no effect"),
        (("--fit", "measured"), "no model that can be fitted is named 'measured'"),
        (("--fit", "wrad"), 'did you mean "ward"'),
    ):
        result = CliRunner().invoke(cli, ("plot", str(baked), *words, "-o", str(output)))
        assert result.exit_code == 2
        assert message in result.output
    with pytest.raises(AssetError, match="there is no such file"):
        run("plot", str(tmp_path / "missing.brdf"), "-o", str(output))
    assert not output.exists()
