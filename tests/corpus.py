"""Renders every mesh file below a folder, prints a table with what became of each, and writes a contact sheet.

    .venv/bin/python tests/corpus.py FOLDER [--verify] [--f3d PYTHON] [--sheet SHEET.png] [--report REPORT.json]

Each file is drawn in a child process, whose time and memory are bounded. The outcomes are:

    drawn      there is a picture, and no warning
    warned     there is a picture, and a warning says what is missing from it
    refused    an error in one line says why there is no picture
    wrong      the picture is empty or not finite; an error has no line of its own; the process hung or died; with --verify, the
               picture is not the one that the reference draws

With --f3d, the sheet shows beside each picture the one that f3d draws (https://f3d.app, PyPI f3d, 251 MB). PYTHON is an
interpreter that can import it; `--f3d` alone means this one.

Where a folder has a Manifest.json of the glTF Asset Generator, the cameras of that file are used. They look at the origin with
a vertical angle of 45.8 degrees, as the generator's own sample pictures do.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import traceback
import warnings
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from queue import SimpleQueue
from tempfile import TemporaryDirectory
from time import perf_counter
from typing import Any

from support.child import Child, serve

# The limits of one file: time [s], and memory of the process [bytes].
SECONDS, MEMORY = 120, 8 << 30
# The size of a picture in the sheet [pixels], the pictures in a row, and the height of a label [pixels].
SIZE, COLUMNS, LABEL = (200, 150), 8, 26
# The most pictures of one sheet; more would make a picture that no program shows whole.
MOST = 240
# The vertical angle of the cameras with which the glTF Asset Generator drew its sample pictures [degrees].
FIELD_OF_VIEW = 45.8
PROCESSES = 2
# The colours of the labels, by outcome.
COLOURS = {"drawn": (40, 110, 60), "warned": (130, 100, 20), "refused": (70, 75, 85), "wrong": (170, 30, 30)}


def main() -> int:
    """Runs the command line. Returns 1 if the outcome of a file is "wrong", and else 0."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--verify", action="store_true", help="verifies each picture too")
    parser.add_argument(
        "--f3d", nargs="?", const=sys.executable, metavar="PYTHON", help="shows f3d's pictures in the sheet, too"
    )
    parser.add_argument("--sheet", type=Path, default=Path("corpus.png"), help="the contact sheet [default: corpus.png]")
    parser.add_argument("--report", type=Path, help="writes the table to this file as JSON")
    parser.add_argument("--files", nargs="*", default=[], help="renders only files whose paths contain one of these texts")
    chosen = parser.parse_args()
    paths = [path for path in meshes(chosen.folder) if not chosen.files or any(text in str(path) for text in chosen.files)]
    cameras = manifest_cameras(chosen.folder)
    with TemporaryDirectory() as folder:
        rows = []
        for row in drawn(paths, cameras, Path(folder), chosen.verify):
            row["file"] = str(Path(row["path"]).relative_to(chosen.folder))
            print(f"{row['outcome']:8} {row['seconds']:6.1f} s  {row['file']}  {row['words'][:300]}", flush=True)
            rows.append(row)
        rows.sort(key=lambda row: row["file"])
        if chosen.f3d:
            for row in rows:
                row["peer"] = f3d_picture(chosen.f3d, Path(row["path"]), Path(row["picture"]).with_suffix(".f3d.png"))
        for number, first in enumerate(range(0, len(rows), MOST)):
            name = chosen.sheet if number == 0 else chosen.sheet.with_stem(f"{chosen.sheet.stem}-{number + 1}")
            sheet(rows[first : first + MOST], name)
    if chosen.report:
        chosen.report.write_text(json.dumps(rows, indent=1))
    found = Counter(row["outcome"] for row in rows)
    print(", ".join(f"{found[outcome]} {outcome}" for outcome in COLOURS))
    return int(found["wrong"] > 0)


def meshes(folder: Path) -> list[Path]:
    """Returns the mesh files below a folder, in the order of their paths."""
    from glshade.mesh.formats import SUFFIXES

    return sorted(path for path in folder.rglob("*") if path.suffix.lower() in SUFFIXES and path.is_file())


def manifest_cameras(folder: Path) -> dict[Path, list[float]]:
    """Returns mesh file -> position of the camera, from the manifests of the glTF Asset Generator below a folder."""
    cameras: dict[Path, list[float]] = {}
    for manifest in sorted(folder.rglob("Manifest.json")):
        content = json.loads(manifest.read_text("utf-8-sig"))
        for model in content.get("models", ()) if isinstance(content, dict) else ():
            if "camera" in model:
                cameras[manifest.parent / model["fileName"]] = model["camera"]["translation"]
    return cameras


def drawn(paths: list[Path], cameras: dict[Path, list[float]], folder: Path, verified: bool) -> Iterator[dict[str, Any]]:
    """Yields the row of each file as it is ready: path, picture, outcome, words, seconds."""
    idle: SimpleQueue[Child] = SimpleQueue()
    children = [Child([sys.executable, __file__, "--child"], SECONDS, MEMORY) for _ in range(PROCESSES)]
    for child in children:
        idle.put(child)

    def row(number: int) -> dict[str, Any]:
        path, picture = paths[number], str(folder / f"{number}.png")
        child, start = idle.get(), perf_counter()
        answer = child.ask({"path": str(path), "picture": picture, "eye": cameras.get(path), "verify": verified})
        if answer["outcome"] in ("hang", "crash"):
            answer = {"outcome": "wrong", "words": f"{answer['outcome']}: {answer['words']}"}
        idle.put(child)
        return {"path": str(path), "picture": picture, "seconds": perf_counter() - start, **answer}

    try:
        with ThreadPoolExecutor(PROCESSES) as threads:
            yield from threads.map(row, range(len(paths)))
    finally:
        for child in children:
            child.close()


def answer(question: dict[str, Any], renderer: Any) -> dict[str, Any]:
    """Draws one file, in a child process, and returns its outcome and words."""
    import glshade

    said: list[str] = []
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            outcome, words = outcome_of(question, renderer)
        except glshade.GlshadeError as error:
            lines = str(error).splitlines()
            clear = len(lines) == 1 and lines[0].startswith(question["path"])
            outcome, words = ("refused" if clear else "wrong"), " | ".join(lines)
        except Exception:
            outcome, words = "wrong", traceback.format_exc(limit=-3)
        said = [f"{w.category.__name__ if w.category.__module__ == 'builtins' else ''}{w.message}" for w in caught]
    if said and outcome == "drawn":
        outcome = "warned"
    texts = [text.replace(f"{question['path']}: ", "") for text in (words, *said) if text]
    return {"outcome": outcome, "words": " | ".join(texts)}


def outcome_of(question: dict[str, Any], renderer: Any) -> tuple[str, str]:
    """Draws one file and returns its outcome and words, without its warnings. Errors: GlshadeError."""
    import numpy as np

    import glshade

    scene = glshade.load(question["path"])
    changes: dict[str, Any] = {"film": scene.film.model_copy(update={"size": SIZE})}
    if question["eye"]:
        changes["camera"] = glshade.Perspective(eye=question["eye"], target=(0, 0, 0), fov=FIELD_OF_VIEW)
    scene = scene.model_copy(update=changes)
    linear = renderer.render(scene, dtype="float32").pixels
    renderer.render(scene).save(question["picture"])
    if not np.isfinite(linear).all():
        return "wrong", "the picture is not finite"
    if np.ptp(linear.reshape(-1, linear.shape[-1]), axis=0).max() == 0.0:
        return "wrong", "the picture is empty"
    if question["verify"]:
        # One sample a pixel: with several, most pixels of so small a picture are edges, which leaves the verdict open.
        small = scene.film.model_copy(update={"size": (64, 48), "samples": 1})
        verdict = glshade.verify(scene.model_copy(update={"film": small}), renderer=renderer)
        if verdict.exit_code:
            return "wrong" if verdict.exit_code == 6 else "drawn", f"verify: {str(verdict).splitlines()[0]}"
    return "drawn", ""


# What f3d does in a process of its own: argv is the mesh file, the picture, the width, the height and the axis that is up.
F3D = """
import sys, f3d
engine = f3d.Engine.create(True)
engine.window.size = int(sys.argv[3]), int(sys.argv[4])
engine.options.update({"scene.up_direction": sys.argv[5], "ui.axis": False, "render.grid.enable": False})
engine.scene.add(sys.argv[1])
engine.window.camera.reset_to_bounds()
engine.window.render_to_image().save(sys.argv[2])
"""


def f3d_picture(python: str, path: Path, picture: Path) -> str | None:
    """Draws a file by f3d, and returns the path of the picture; None where there is none in time."""
    up = "+Z" if path.suffix.lower() == ".stl" else "+Y"
    command = [python, "-c", F3D, str(path), str(picture), *map(str, SIZE), up]
    try:
        subprocess.run(command, timeout=SECONDS, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    except subprocess.TimeoutExpired:
        return None
    return str(picture) if picture.is_file() else None


def sheet(rows: list[dict[str, Any]], path: Path) -> None:
    """Writes a contact sheet: the picture of each row, and f3d's, over the end of its path and the start of its words."""
    from PIL import Image, ImageDraw

    pictures = 2 if any("peer" in row for row in rows) else 1
    width, height = pictures * SIZE[0] + 4, SIZE[1] + LABEL + 4
    columns = COLUMNS // pictures
    whole = Image.new("RGB", (columns * width, -(-len(rows) // columns) * height), (20, 20, 24))
    draw = ImageDraw.Draw(whole)
    for number, row in enumerate(rows):
        x, y = number % columns * width + 2, number // columns * height + 2
        for place, name in enumerate((row["picture"], row.get("peer"))):
            if name and Path(name).is_file():
                with Image.open(name) as picture:
                    whole.paste(picture.convert("RGB"), (x + place * SIZE[0], y))
        draw.rectangle((x, y + SIZE[1], x + width - 5, y + SIZE[1] + LABEL - 1), fill=COLOURS[row["outcome"]])
        # The default font has 6 pixels a letter.
        draw.text((x + 3, y + SIZE[1] + 1), row["file"][-32:].encode("latin-1", "replace").decode("latin-1"))
        draw.text((x + 3, y + SIZE[1] + 13), row["words"][:32].encode("latin-1", "replace").decode("latin-1"))
    whole.save(path)


def child() -> None:
    """Answers the questions of a child process."""
    import glshade

    with glshade.Renderer() as renderer:
        serve(lambda question: answer(question, renderer))


if __name__ == "__main__":
    sys.exit(child() if sys.argv[1:] == ["--child"] else main())
