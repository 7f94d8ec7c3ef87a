"""Every shipped scene, drawn small by the driver at hand, against a baseline that the float64 reference has drawn.

A baseline changes only if its scene does. Then look at the page out/pictures/index.html, and approve:

    script/test tests/scenes/test_baselines.py
    .venv/bin/glshade approve out/pictures --from reference
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from glshade import Renderer, load
from glshade.golden.baselines import Baselines
from glshade.golden.judge import compare_files
from glshade.golden.result import SceneVerdict
from glshade.golden.rules import RULES
from glshade.golden.scene_judge import SceneJudge

ROOT = Path(__file__).resolve().parents[2]
SCENES = sorted((ROOT / "scenes").glob("*.toml"))
BASELINES = ROOT / "tests" / "baselines"
# So small that the repository hardly grows, and that all scenes are judged within seconds [pixels].
WIDTH = 96
# Judging these scenes takes more than half a second each: many lights, textures, or models whose rounding is costly to bound.
COSTLY = frozenset(
    {
        *("anisotropy", "ashikhmin-shirley-grid", "detail", "direction-and-point", "emission", "falloff"),
        *("gallery", "materials", "measured", "metal-and-plastic", "orthographic-viewer", "perspective-viewer"),
        *("phong-exponents", "spatial-variation", "spot"),
    }
)
# The most that the folder of baselines may hold [bytes].
MOST_BYTES = 500_000


def small(path: Path) -> list[str]:
    """Returns the overrides that make a scene's picture WIDTH pixels wide.

    With one sample a pixel, the reference judges a picture several times faster than with four.
    """
    width, height = load(path).film.size
    return [f"film.size=[{WIDTH}, {round(height * WIDTH / width)}]", "film.samples=1"]


def marked(path: Path) -> Any:
    """Returns a scene as a parameter, marked slow if it is costly."""
    return pytest.param(path, id=path.stem, marks=pytest.mark.slow if path.stem in COSTLY else ())


@pytest.mark.parametrize("path", [marked(path) for path in SCENES])
def test_the_picture_is_what_the_scene_allows(path: Path, render_regression: Any) -> None:
    render_regression.check(path, name=path.stem, overrides=small(path))


@pytest.mark.slow
@pytest.mark.parametrize("path", SCENES, ids=lambda path: path.stem)
def test_the_picture_with_all_samples_of_the_film(path: Path, render_regression: Any) -> None:
    size, _ = small(path)
    render_regression.check(path, name=f"samples/{path.stem}", overrides=[size])


def test_every_scene_has_its_baselines_by_the_reference() -> None:
    baselines = Baselines(BASELINES)
    names = {f"{folder}{path.stem}.png" for path in SCENES for folder in ("", "samples/")}
    assert set(baselines.names()) == names
    for name in names:
        (variant,) = baselines.variants(name)
        assert variant.sidecar is not None, variant.note
        assert variant.sidecar.made_by == "reference"
    assert sum(path.stat().st_size for path in BASELINES.rglob("*") if path.is_file()) < MOST_BYTES


def test_a_lost_light_is_a_regression(renderer: Renderer, tmp_path: Path) -> None:
    path = ROOT / "scenes" / "half-angle-grazing.toml"
    overrides = [*small(path), "lights.0.intensity=0"]
    scene = load(path, [text.split("=", 1) for text in overrides])
    renderer.render(scene).save(tmp_path / "dark.png")
    result = compare_files(BASELINES / f"{path.stem}.png", tmp_path / "dark.png", RULES["codes"](), scenes=SceneJudge())
    assert result.verdict is SceneVerdict.REGRESSION
    assert result.causes
