"""The pages agree with the code: their example files are found, their commands and Python run, and every room has its row."""

from __future__ import annotations

import re
import shutil
from pathlib import Path
from typing import Any

import pytest

import glshade as package
from glshade.glsl.shaders import SHIPPED
from glshade.image.file import read

ROOT = Path(__file__).resolve().parents[3]
# A file of an example: its path, then a block of its text.
FILE = re.compile(r"`([\w./-]+)`:\n\n```\w+\n(.*?)^```", flags=re.MULTILINE | re.DOTALL)
SCENE = """
film = { size = [64, 48] }

[[objects]]
shape = "sphere"
material = "darkened"

[[objects]]
mesh = "two.tri"
material = "chalk"
transform = { translate = [1, 0, 1] }

[materials.darkened]
brdf = "darkened"

[[lights]]
type = "flood"
position = [0, 2, 1]
"""


def write_files(page: str, folder: Path) -> set[str]:
    """Writes the files of a page's examples below a folder. Returns their paths below it."""
    files = dict(FILE.findall((ROOT / page).read_text(encoding="utf-8")))
    for name, text in files.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        assert not path.exists(), f"{name} would replace a file of glshade"
        path.write_text(text, encoding="utf-8")
    return set(files)


@pytest.fixture
def copied(tmp_path: Path) -> Path:
    """A folder with a copy of the package and its shaders, to which a test may add files."""
    shutil.copytree(Path(package.__file__).parent, tmp_path / "glshade", ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copytree(SHIPPED, tmp_path / "shaders")
    return tmp_path


def test_files_added_as_contributing_says_are_found(copied: Path, glshade: Any) -> None:
    def run(*arguments: object) -> str:
        done = glshade(*arguments, cwd=copied, PYTHONPATH=str(copied))
        assert done.returncode == 0, done.stderr
        return str(done.stdout)

    assert len(write_files("CONTRIBUTING.md", copied)) == 9
    (copied / "two.tri").write_text("0 0 0 1 0 0 0 1 0\n1 0 0 1 1 -1 0 1 0\n")
    (copied / "scene.toml").write_text(SCENE)
    run("render", "scene.toml", "-o", "scene.tga")
    assert read(copied / "scene.tga")[0].shape[:2] == (48, 64)
    assert run("verify", "scene.toml").startswith("scene.toml: verified")
    assert "caught" in run("verify", "scene.toml", "--mutate", "halved")
    assert run("count", "scene.toml") == "2\n"


def test_the_models_of_extending_are_found_and_verified(tmp_path: Path, glshade: Any) -> None:
    files = write_files("docs/extending.md", tmp_path)
    assert files == {"moon.toml", *(f"models/{name}" for name in ("lunar.py", "lunar.glsl", "sky.py", "sky.glsl"))}
    commands = re.findall(r"^    glshade ((?:render|verify|brdfs) .*moon.*|brdfs .*)$", extending(), flags=re.MULTILINE)
    assert len(commands) == 3
    for command in commands:
        done = glshade(*command.split(), cwd=tmp_path)
        assert done.returncode == 0, done.stderr
    # The page says that this fault is found.
    shader = tmp_path / "models" / "lunar.glsl"
    shader.write_text(shader.read_text().replace("0.25", "0.26"))
    assert glshade("verify", "moon.toml", "--models", "models", cwd=tmp_path).returncode == 6


def test_the_python_of_extending(tmp_path: Path, python: Any) -> None:
    write_files("docs/extending.md", tmp_path)
    code = re.findall(r"^```python\n(import glshade\n.*?)^```", extending(), flags=re.MULTILINE | re.DOTALL)
    assert len(code) == 1
    assert python(code[0], cwd=tmp_path).startswith("verified")


def test_the_python_of_the_page_about_python(tmp_path: Path, python: Any) -> None:
    code, *_ = re.findall(
        r"^```python\n(.*?)^```", (ROOT / "docs/python.md").read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL
    )
    python(code, cwd=tmp_path)
    assert (tmp_path / "ring.png").is_file()


def test_contributing_names_every_room() -> None:
    table = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8").split("| room | holds |")[1].split("\n\n")[0]
    rooms = [path.name for path in Path(package.__file__).parent.iterdir() if (path / "__init__.py").is_file()]
    assert sorted(re.findall(r"^\| `(\w+)`", table, flags=re.MULTILINE)) == sorted(rooms)


def extending() -> str:
    """Returns the text of docs/extending.md."""
    return (ROOT / "docs" / "extending.md").read_text(encoding="utf-8")
