"""What ships beside the code: the scenes, the README's examples, and the pages made from the models."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import glshade
from glshade.cli import COMMANDS
from glshade.image.file import read

ROOT = Path(__file__).resolve().parents[2]
SCENES = sorted((ROOT / "scenes").glob("*.toml"))
README = (ROOT / "README.md").read_text(encoding="utf-8")
EXAMPLES = re.findall(r"^```(\w+)\n(.*?)^```$", README, flags=re.MULTILINE | re.DOTALL)
WIDTH = 96


def small(scene: glshade.Scene) -> glshade.Scene:
    width, height = scene.film.size
    film = scene.film.model_copy(update={"size": (WIDTH, round(height * WIDTH / width))})
    return scene.model_copy(update={"film": film})


def test_there_are_scenes() -> None:
    assert "gallery" in {path.stem for path in SCENES}


@pytest.mark.parametrize("path", SCENES, ids=lambda path: path.stem)
def test_says_what_to_see(path: Path) -> None:
    description = glshade.load(path).description
    assert len(description) > 30
    assert "\n" not in description
    assert not description.endswith(".")


@pytest.mark.parametrize("path", SCENES, ids=lambda path: path.stem)
def test_scene_renders(path: Path, renderer: glshade.Renderer) -> None:
    """Each scene shows something at every rate. Its meshes are coarse enough that flat and phong shading differ."""
    scene = small(glshade.load(path))
    width, height = scene.film.size
    pictures = {}
    # test_verified.py draws each scene at its own rates.
    for shading in ("flat", "gouraud", "phong"):
        pixels = renderer.render(scene, dtype="float32", shading=shading).pixels.copy()
        assert pixels.shape == (height, width, 3)
        check(pixels, scene, f"at the rate {shading}")
        pictures[shading] = pixels
    assert np.abs(pictures["flat"] - pictures["phong"]).max() > 1e-3


def check(pixels: Any, scene: glshade.Scene, place: str) -> None:
    assert np.isfinite(pixels).all(), place
    background = np.array(scene.film.background[:3], dtype=np.float32)
    drawn = np.any(np.abs(pixels - background) > 1e-3, axis=2)
    assert drawn.mean() > 0.1, f"most of the picture is background {place}"
    assert np.ptp(pixels[drawn], axis=0).max() > 0.1, f"everything drawn has one value {place}"
    # Highlights may exceed 1; a whole picture must not.
    assert np.any(pixels > 1, axis=2).mean() < 0.05, place
    assert pixels.min() >= -1e-6, place


def test_readme_scene(tmp_path: Path) -> None:
    ((_, text),) = [example for example in EXAMPLES if example[0] == "toml"]
    scene = tmp_path / "ball.toml"
    scene.write_text(text, encoding="utf-8")
    command = [sys.executable, "-m", "glshade", "render", "ball.toml", "-o", "ball.png"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    pixels, _ = read(tmp_path / "ball.png")
    assert pixels.shape[:2] == (480, 640)
    assert np.ptp(pixels[..., 0]) > 0.3


@pytest.mark.parametrize("code", [text for language, text in EXAMPLES if language == "python"])
def test_readme_python(code: str, tmp_path: Path) -> None:
    ((_, text),) = [example for example in EXAMPLES if example[0] == "toml"]
    (tmp_path / "ball.toml").write_text(text, encoding="utf-8")
    environment = {**os.environ, "PYTHONWARNINGS": "error::UserWarning"}
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=300
    )
    assert done.returncode == 0, done.stderr
    for name in re.findall(r'save\("([^"]+)"\)', code):
        pixels, _ = read(tmp_path / name)
        assert np.ptp(pixels[..., :3]) > 0.2


def test_readme_names_every_command() -> None:
    assert set(re.findall(r"^\| `glshade (\w+)", README, flags=re.MULTILINE)) == set(COMMANDS)


def test_links_lead_somewhere() -> None:
    pages = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *(ROOT / "docs").rglob("*.md")]
    broken = []
    for page in pages:
        text = re.sub(r"^```.*?^```$", "", page.read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL)
        for target in re.findall(r"\]\(([^)#]+)(?:#[^)]*)?\)", text):
            if not target.startswith("http") and not (page.parent / target).exists():
                broken.append(f"{page.relative_to(ROOT)}: {target}")
    assert not broken


def test_gallery_picture_is_small() -> None:
    assert (ROOT / "docs" / "images" / "gallery.png").stat().st_size <= 200_000


def test_scene_file_page_is_current() -> None:
    done = subprocess.run([sys.executable, ROOT / "script" / "docs.py", "--check"], capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
