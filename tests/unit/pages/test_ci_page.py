"""docs/ci.md, script/Dockerfile and script/setup agree with each other and with the commands."""

from __future__ import annotations

import re
import shlex
from pathlib import Path
from typing import Any

import click
import pytest
import yaml
from support.command import run_command

from glshade.cli import COMMANDS
from glshade.golden.result import SceneVerdict
from glshade.golden.rules import RULES

ROOT = Path(__file__).resolve().parents[3]
PAGE = (ROOT / "docs" / "ci.md").read_text(encoding="utf-8")
DOCKERFILE = (ROOT / "script" / "Dockerfile").read_text(encoding="utf-8")
WORKFLOWS = {
    name: yaml.safe_load(text) for name, text in re.findall(r"^`([\w./-]+\.yml)`:\n\n```yaml\n(.*?)^```", PAGE, re.M | re.S)
}
# The packages without which nothing is drawn, as script/setup installs them on a bare system.
MESA = {"libegl1", "libegl-mesa0", "libgl1-mesa-dri"}


def section(title: str) -> str:
    return next(part for part in PAGE.split("\n## ") if part.startswith(f"{title}\n"))


def steps() -> dict[str, list[str]]:
    """Returns the commands of each workflow on the page."""
    github = WORKFLOWS[".github/workflows/pictures.yml"]["jobs"]["pictures"]["steps"]
    return {
        "github": [step["run"] for step in github if "run" in step],
        "gitlab": WORKFLOWS[".gitlab-ci.yml"]["pictures"]["script"],
    }


@pytest.mark.parametrize("service", ["github", "gitlab"])
def test_workflows_install_mesa_and_glshade_and_run_pytest(service: str) -> None:
    install_mesa, install_glshade, test = steps()[service]
    assert set(install_mesa.partition(" install ")[2].split()) == {"-y", "--no-install-recommends", *MESA}
    assert install_glshade == "pip install ./glshade pytest"
    assert test.startswith("pytest --glshade-summary ")


def test_every_place_names_the_same_packages() -> None:
    setup = (ROOT / "script" / "setup").read_text(encoding="utf-8")
    assert all(package in setup for package in MESA)
    lines = [line for line in PAGE.splitlines() if "apt-get install" in line]
    assert len(lines) >= 3
    for line in lines:
        assert all(package in line for package in MESA), line
    assert all(re.search(rf"\b{package}\b", DOCKERFILE) for package in MESA)


def test_the_image_gets_all_that_the_package_is_built_from() -> None:
    seen = {line[1:] for line in (ROOT / ".dockerignore").read_text(encoding="utf-8").splitlines() if line.startswith("!")}
    assert {"glshade", "shaders", "scenes", "pyproject.toml", "README.md", "LICENSE"} == seen
    assert all((ROOT / name).exists() for name in seen)
    built = (ROOT / ".ci" / "run").read_text(encoding="utf-8")
    assert 'docker build --quiet -f "$root/script/Dockerfile"' in built


def options_of(command: str) -> set[str]:
    module: Any = __import__(f"glshade.cli.{command}", fromlist=["command"])
    found: click.Command = module.command
    return {name for parameter in found.params for name in parameter.opts}


@pytest.mark.parametrize(
    ("title", "command"), [("Reports", "compare"), ("Moving from idiff", "compare"), ("Baselines", "approve")]
)
def test_the_tables_name_options_that_exist(title: str, command: str) -> None:
    assert command in COMMANDS
    rows = [line.split(" | ")[0] for line in section(title).splitlines() if line.startswith("| `--")]
    named = set(re.findall(r"--[a-z-]+", " ".join(rows)))
    assert len(named) >= 6
    assert named <= options_of(command)


def test_the_options_of_the_plugin(pytestconfig: pytest.Config) -> None:
    """pytest raises ValueError for an option and for a key that no plugin has added."""
    rows = re.findall(r"^\| `(--glshade-[a-z-]+)[^|]*\| (?:`(\w+)`)?", section("The pytest plugin"), re.M)
    assert len(rows) == 7
    for option, key in rows:
        pytestconfig.getoption(option.lstrip("-").replace("-", "_"))
        assert key == ("" if option == "--glshade-force" else option.lstrip("-").replace("-", "_"))
        if key:
            pytestconfig.getini(key)


def test_rules_and_verdicts_are_those_of_the_code() -> None:
    assert re.findall(r"^\| `(\w+)` \| (?:default|`--rule)", section("Rules"), re.M) == list(RULES)
    assert re.findall(r"^\| ([^|`]+) \| \d \|", section("Verdicts"), re.M) == [verdict.value for verdict in SceneVerdict]
    codes = {verdict.value: int(verdict.outcome) for verdict in SceneVerdict}
    assert {v: int(code) for v, code in re.findall(r"^\| ([^|`]+) \| (\d) \|", section("Verdicts"), re.M)} == codes


def test_the_commands_of_the_first_three_minutes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The README's scene, drawn small: both pictures are the same, then a light is half as strong, and that is approved."""
    monkeypatch.chdir(tmp_path)
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    (scene,) = re.findall(r"^```toml\n(.*?)^```$", readme, re.M | re.S)
    (tmp_path / "ball.toml").write_text(scene.replace("[640, 480]", "[48, 36]").replace("samples = 4", ""), encoding="utf-8")
    first, *commands = re.findall(r"^    (\w.*)$", section("Three minutes with the command"), re.M)
    assert first == "mkdir -p baselines out"
    for name in ("baselines", "out"):
        (tmp_path / name).mkdir()
    done = [run_command(capsys, *shlex.split(command)[1:]) for command in commands]
    assert [result.code for result in done] == [0, 0, 0, 0, 2, 0], done
    assert "regression: light lights[0] x 0.55" in done[4].out
    assert (tmp_path / "report" / "index.html").exists()
    assert done[5].out.startswith("replaced  ball.png: distance 0.")
    assert run_command(capsys, *shlex.split(commands[2])[1:]).code == 0


def test_links_within_the_page_lead_to_a_heading() -> None:
    headings = {re.sub(r"[^\w -]", "", title.lower()).replace(" ", "-") for title in re.findall(r"^#+ (.+)$", PAGE, re.M)}
    linked = re.findall(r"\]\(#([\w-]+)\)", PAGE)
    assert len(linked) > 15
    assert set(linked) <= headings
    for path in re.findall(r"\]\((?!http|#)([^)#]+)", PAGE):
        assert (ROOT / "docs" / path).exists(), path
