"""Every shipped scene, every mesh at hand and scenes drawn at random, verified against the float64 reference."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, Phase, given, settings
from support import strategies

import glshade
from glshade.scene.object import Rate
from glshade.verification.judgement import PixelClass

ROOT = Path(__file__).resolve().parents[2]
SCENES = sorted((ROOT / "scenes").glob("*.toml"))
# Real meshes, where somebody has put them beside the checkout.
FOLDER = ROOT.parent / "shared" / "data" / "meshes"
MESHES = sorted(path for path in FOLDER.glob("*") if path.suffix in {".obj", ".glb"}) if FOLDER.is_dir() else []
WIDTH = 192


# The scenes whose own samples are judged in the ordinary suite. The slow test takes the others, too.
SMOOTH = ("gallery", "half-angle-grazing", "sharp-edges")


def sized(scene: glshade.Scene, width: int, **film: Any) -> glshade.Scene:
    """Returns the scene with a picture of another width [pixels] and the same aspect ratio, and other keys of its film."""
    w, h = scene.film.size
    size = (width, max(1, round(h * width / w)))
    return scene.model_copy(update={"film": scene.film.model_copy(update={"size": size, **film})})


def check(scene: glshade.Scene, name: str, renderer: glshade.Renderer, **options: Any) -> glshade.Verdict:
    """Fails unless every pixel is explained, and leaves the evidence under out/."""
    verdict = glshade.verify(scene, renderer=renderer, **options)
    if verdict.verdict == "failed":
        page = verdict.report(ROOT / "out" / "verify" / re.sub(r"\W+", "-", name), name)
        pytest.fail(f"{verdict}\nreport: {page}")
    return verdict


@pytest.mark.parametrize("path", SCENES, ids=lambda path: path.stem)
def test_shipped_scene(path: Path, renderer: glshade.Renderer) -> None:
    verdict = check(sized(glshade.load(path), WIDTH, samples=1), path.stem, renderer)
    assert verdict.verdict == "verified", str(verdict)


@pytest.mark.parametrize(
    "path",
    [path if path.stem in SMOOTH else pytest.param(path, marks=pytest.mark.slow) for path in SCENES],
    ids=lambda p: p.stem,
)
def test_shipped_scene_with_its_samples(path: Path, renderer: glshade.Renderer) -> None:
    scene = sized(glshade.load(path), WIDTH)
    verdict = check(scene, f"{path.stem} samples", renderer)
    assert verdict.verdict == "verified", str(verdict)
    assert verdict.comparison.counts[PixelClass.EDGE] > 0 or scene.film.pictures == 1


@pytest.mark.slow
@pytest.mark.parametrize("shading", ["flat", "gouraud", "phong"])
@pytest.mark.parametrize("path", SCENES, ids=lambda path: path.stem)
def test_shipped_scene_whole(path: Path, shading: Rate, renderer: glshade.Renderer) -> None:
    scene = glshade.load(path)
    scene = sized(scene, scene.film.size[0], samples=1)
    verdict = check(scene, f"{path.stem} {shading}", renderer, shading=shading)
    assert verdict.verdict == "verified", str(verdict)


@pytest.mark.filterwarnings("ignore:.*its animations are not played")
@pytest.mark.parametrize("shading", ["flat", "gouraud", "phong"])
@pytest.mark.parametrize("path", MESHES, ids=lambda path: path.name)
def test_mesh(path: Path, shading: Rate, renderer: glshade.Renderer) -> None:
    verdict = check(sized(glshade.load(path), WIDTH), f"{path.name} {shading}", renderer, shading=shading)
    assert verdict.verdict == "verified", str(verdict)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:.*its animations are not played")
@pytest.mark.parametrize("shading", ["flat", "gouraud", "phong"])
@pytest.mark.parametrize("path", MESHES, ids=lambda path: path.name)
def test_mesh_large(path: Path, shading: Rate, renderer: glshade.Renderer) -> None:
    verdict = check(sized(glshade.load(path), 1024), f"{path.name} {shading} large", renderer, shading=shading)
    assert verdict.verdict == "verified", str(verdict)


# A failing scene is not shrunk: that takes minutes and gigabytes, and the report of any failing scene says where to look.
RANDOM = settings(
    deadline=None,
    suppress_health_check=list(HealthCheck),
    report_multiple_bugs=False,
    phases=(Phase.explicit, Phase.reuse, Phase.generate),
)


@settings(RANDOM, max_examples=15)
@given(scene=strategies.scenes())
def test_random_scene(scene: glshade.Scene, renderer: glshade.Renderer) -> None:
    check(scene, "random", renderer)


@pytest.mark.slow
@settings(RANDOM, max_examples=200)
@given(scene=strategies.scenes(size=(240, 160)))
def test_random_scenes(scene: glshade.Scene, renderer: glshade.Renderer) -> None:
    check(scene, "random", renderer)
