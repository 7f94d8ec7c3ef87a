"""Drivers: verifies the shipped scenes with several OpenGL drivers. script/drivers and script/proofs/drivers.py call it.

Each driver gets a process of its own, because Mesa chooses the driver once in a process.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import re
import shutil
import subprocess
import sys
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from pages import table, write

ROOT = Path(__file__).resolve().parents[1]
SCENES = sorted((ROOT / "scenes").glob("*.toml"))
RATES = ("flat", "gouraud", "phong")
WIDTH = 160
# The exit code of a process whose driver opens no context.
NO_CONTEXT = 5
PAGE = ROOT / "docs" / "tolerance.md"
HEADING = (
    "driver",
    "OpenGL renderer",
    "verified",
    "failed",
    "inconclusive",
    "unexplained pixels",
    "largest share of the tolerance",
)

FOLDER = ROOT / "out" / "drivers"
# Mesa 25.0 is in the backports of Debian 12 "bookworm". What these packages need and the system lacks is unpacked, too.
PACKAGES = ("libegl-mesa0", "libgl1-mesa-dri", "mesa-vulkan-drivers")
SOURCES = """\
deb [signed-by=/usr/share/keyrings/debian-archive-keyring.gpg] http://deb.debian.org/debian bookworm main
deb [signed-by=/usr/share/keyrings/debian-archive-keyring.gpg] http://deb.debian.org/debian bookworm-backports main
"""


class UnavailableError(Exception):
    """A driver cannot be had on this machine."""


@dataclass(frozen=True)
class Driver:
    """An OpenGL driver.

    backend: the backend of glshade that reaches it.
    environment: the environment variables that choose it.
    unpacked: whether it is one of Mesa 25.0, which is unpacked beside the system.
    """

    backend: str = "egl"
    environment: Mapping[str, str] | None = None
    unpacked: bool = False


# Name -> driver. The first two need no download.
DRIVERS = {
    "system": Driver(),
    "softpipe": Driver(environment={"GALLIUM_DRIVER": "softpipe"}),
    "OSMesa": Driver(backend="osmesa"),
    "llvmpipe 25.0": Driver(unpacked=True),
    # zink translates OpenGL to Vulkan, and lavapipe is Mesa's Vulkan driver for the CPU. zink uses a CPU only if software
    # rendering is asked for.
    "zink on lavapipe": Driver(environment={"GALLIUM_DRIVER": "zink", "LIBGL_ALWAYS_SOFTWARE": "1"}, unpacked=True),
}


@dataclass(frozen=True)
class Task:
    """A scene and the shading rate with which it is verified. scene: the name of its file without the suffix."""

    scene: str
    rate: str


TASKS = [Task(path.stem, rate) for path in SCENES for rate in RATES]


@dataclass(frozen=True)
class Row:
    """The result of one task.

    task: the task.
    renderer: GL_RENDERER and GL_VERSION of the driver; empty without a verdict.
    verdict: verified, failed, inconclusive, or "crashed" if the process ended before it.
    unexplained: the number of unexplained pixels.
    used: the largest ratio of a pixel's error to its own tolerance.
    """

    task: Task
    renderer: str = ""
    verdict: str = "crashed"
    unexplained: int = 0
    used: float = 0.0


def verify_with(driver: Driver, tasks: Sequence[Task], width: int) -> list[Row]:
    """Returns the result of each task. width: the width of the pictures [pixels]. Errors: UnavailableError."""
    orders = {"backend": driver.backend, "width": width, "tasks": [asdict(task) for task in tasks]}
    done = subprocess.run(
        [sys.executable, __file__, "--orders", json.dumps(orders)],
        env={**os.environ, **(driver.environment or {}), **(mesa() if driver.unpacked else {})},
        stdout=subprocess.PIPE,
        text=True,
        check=False,
    )
    if done.returncode == NO_CONTEXT:
        raise UnavailableError("no OpenGL context can be opened")
    lines = [json.loads(line) for line in done.stdout.splitlines()]
    rows = [Row(**{**line, "task": Task(**line["task"])}) for line in lines]
    return rows + [Row(task) for task in tasks[len(rows) :]]


def _carry_out(orders: dict[str, Any]) -> None:
    """Verifies scenes in this process, and prints a line of JSON for each. orders: as `verify_with` makes them."""
    import glshade
    from glshade.verification.verification import verify

    try:
        renderer = glshade.Renderer(orders["backend"])
    except glshade.ContextError as error:
        print(error, file=sys.stderr)
        sys.exit(NO_CONTEXT)
    with renderer:
        for task in orders["tasks"]:
            scene = glshade.load(ROOT / "scenes" / f"{task['scene']}.toml")
            width, height = scene.film.size
            size = (orders["width"], max(1, round(height * orders["width"] / width)))
            scene = scene.model_copy(update={"film": scene.film.model_copy(update={"size": size})})
            verdict = verify(scene, renderer=renderer, shading=task["rate"])
            row = Row(task, verdict.driver, verdict.verdict, verdict.unexplained, verdict.used)
            print(json.dumps(asdict(row)), flush=True)


def mesa() -> dict[str, str]:
    """Returns the environment variables of the unpacked Mesa. Errors: UnavailableError."""
    folder = FOLDER / "mesa-25.0"
    if not folder.exists():
        _unpack(folder)
    (library,) = folder.glob("usr/lib/*/libEGL_mesa.so.0")
    (vulkan,) = folder.glob("usr/share/vulkan/icd.d/lvp_icd*.json")
    return {
        "LD_LIBRARY_PATH": str(library.parent),
        "LIBGL_DRIVERS_PATH": str(library.parent / "dri"),
        "__EGL_VENDOR_LIBRARY_FILENAMES": str(folder / "usr/share/glvnd/egl_vendor.d/50_mesa.json"),
        "VK_ICD_FILENAMES": str(vulkan),
    }


def _unpack(folder: Path) -> None:
    """Downloads packages of Debian and unpacks them into a folder. Errors: UnavailableError."""
    if shutil.which("apt-get") is None or "bookworm" not in platform.freedesktop_os_release().get("VERSION_CODENAME", ""):
        raise UnavailableError("its packages are made for Debian 12")
    apt, beside = FOLDER / "apt", folder.with_suffix(".new")
    shutil.rmtree(beside, ignore_errors=True)
    for needed in (beside, apt / "lists" / "partial", apt / "archives" / "partial"):
        needed.mkdir(parents=True, exist_ok=True)
    (apt / "sources.list").write_text(SOURCES)
    # apt keeps its lists and packages in its own folder, and only reads which packages the system has.
    paths = {
        "Dir::Etc::sourcelist": apt / "sources.list",
        "Dir::Etc::sourceparts": "/dev/null",
        "Dir::State::lists": apt / "lists",
        "Dir::Cache": apt,
        "APT::Sandbox::User": "root",
    }
    options = [word for name, path in paths.items() for word in ("-o", f"{name}={path}")]

    def run(*command: str | Path, cwd: Path | None = None) -> str:
        done = subprocess.run(command, capture_output=True, text=True, cwd=cwd, check=False)
        if done.returncode:
            raise UnavailableError(f"{command[0]} failed: {' '.join(done.stderr.split())[:200]}")
        return done.stdout

    run("apt-get", *options, "update")
    plan = run("apt-get", *options, "--simulate", "--no-install-recommends", "-t", "bookworm-backports", "install", *PACKAGES)
    wanted = re.findall(r"^Inst (\S+) (?:\[\S+\] )?\((\S+)", plan, flags=re.MULTILINE)
    run("apt-get", *options, "download", *(f"{name}={version}" for name, version in wanted), cwd=beside)
    for package in beside.glob("*.deb"):
        run("dpkg-deb", "--extract", package, beside)
        package.unlink()
    beside.rename(folder)


def summary(name: str, rows: Iterable[Row]) -> tuple[str, ...]:
    """Returns the cells of a driver's row in the table of HEADING."""
    rows = list(rows)
    verdicts = Counter(row.verdict for row in rows)
    failed = str(verdicts["failed"] + verdicts["crashed"])
    unexplained, used = sum(row.unexplained for row in rows), max(row.used for row in rows)
    counts = (str(verdicts["verified"]), failed, str(verdicts["inconclusive"]), str(unexplained))
    renderer = next((row.renderer for row in rows if row.renderer), "")
    return (name, renderer, *counts, f"{used:.0%}")


def main() -> None:
    """Prints the table."""
    parser = argparse.ArgumentParser(prog="script/drivers", description="Verifies the shipped scenes with several drivers.")
    parser.add_argument("--width", type=int, default=WIDTH, help="the width of the pictures [pixels]")
    parser.add_argument("--driver", action="append", choices=DRIVERS, help="a driver; several may be given")
    parser.add_argument("--page", action="store_true", help="also write the table into docs/tolerance.md")
    parser.add_argument("--orders", type=json.loads, help=argparse.SUPPRESS)
    chosen = parser.parse_args()
    if chosen.orders:
        _carry_out(chosen.orders)
        return
    cells = []
    for name in chosen.driver or DRIVERS:
        try:
            rows = verify_with(DRIVERS[name], TASKS, chosen.width)
        except UnavailableError as error:
            print(f"{name}: not available: {error}", file=sys.stderr)
            continue
        cells.append(summary(name, rows))
        for row in rows:
            if row.verdict != "verified":
                used = f"{row.unexplained} pixels unexplained, at most {row.used:.0%} of the tolerance"
                print(f"{name}: {row.task.scene}, {row.task.rate}: {row.verdict}, {used}", file=sys.stderr, flush=True)
    text = table(HEADING, cells)
    print(text, end="")
    if chosen.page:
        before, _, after = PAGE.read_text(encoding="utf-8").partition("<!-- drivers -->\n")
        write(PAGE, f"{before}<!-- drivers -->\n{text}{after[after.index('<!-- end -->') :]}")


if __name__ == "__main__":
    main()
