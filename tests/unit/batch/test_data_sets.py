"""Data sets: layers as PNG files, boxes and masks of a batch, and batches from Python, whatever the number of workers."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import glshade as g
from glshade.errors import GlshadeError, SceneError
from glshade.image.masks import object_masks
from glshade.scene import labels

# Ten samples, in which a ball and a cube stand elsewhere.
SCENE = """
[film]
size = [32, 24]
aovs = ["depth", "object_id", "semantic_id"]
aov_format = "png"
[camera]
eye = [0, 0, 8]
[[objects]]
name = "ball"
shape = "sphere"
category = "toy"
[[objects]]
name = "block"
shape = "cube"
transform.translate = [1.8, 0.0, 1.5]
[[sample.values]]
key = "objects.block.transform.translate"
uniform = [[1.0, -1.0, 1.0], [2.5, 1.0, 2.0]]
"""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "s.toml").write_text(SCENE)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def contents(folder: Path) -> dict[str, bytes]:
    return {file.name: file.read_bytes() for file in folder.iterdir() if file.name != "manifest.jsonl"}


def lines(manifest: Path) -> list[dict[str, Any]]:
    """Returns the manifest's lines without times, in the order of the pictures."""
    read = [json.loads(line) for line in manifest.read_text().splitlines()]
    timed = ("seconds", "started", "finished", "number")
    return sorted(({k: v for k, v in line.items() if k not in timed} for line in read), key=lambda line: str(line["output"]))


def test_the_function_and_the_command_make_the_same_files(folder: Path, glshade: Any) -> None:
    events: list[dict[str, Any]] = []
    outcome = g.render_all("s.toml", "a/####.png", frames=range(1, 7), jobs=2, coco="a/coco.json", on_event=events.append)
    assert (outcome.done, outcome.failed, outcome.left) == (6, 0, 0)
    assert [event["event"] for event in events] == ["begin", *["done"] * 6, "end"]
    (folder / "b").mkdir()
    done = glshade("render", "s.toml", "-o", "b/####.png", "-f", "1-6", "--jobs", "1", "--coco", "b/coco.json", cwd=folder)
    assert done.returncode == 0, done.stderr
    assert len(contents(folder / "a")) == 6 * 5 + 1
    assert contents(folder / "a") == contents(folder / "b")
    assert lines(folder / "a" / "manifest.jsonl") == lines(folder / "b" / "manifest.jsonl")


def test_the_objects_of_kept_pictures_come_from_the_manifest(folder: Path) -> None:
    g.render_all("s.toml", "####.png", frames=[1, 2, 3], jobs=1)
    first = contents(folder)
    # The manifest tells no objects yet, so the pictures are drawn to find them, and their files are kept.
    outcome = g.render_all("s.toml", "####.png", frames=[1, 2, 3], jobs=1, resume=True, coco="coco.json")
    assert (outcome.done, outcome.skipped) == (0, 3)
    found = (folder / "coco.json").read_bytes()
    assert {name: data for name, data in contents(folder).items() if name != "coco.json"} == first
    (folder / "0002.object_id.png").write_bytes(b"")
    (folder / "coco.json").unlink()
    events: list[dict[str, Any]] = []
    args = {"frames": [1, 2, 3], "jobs": 1, "resume": True, "coco": "coco.json"}
    outcome = g.render_all("s.toml", "####.png", on_event=events.append, **args)  # type: ignore[arg-type]
    assert (outcome.done, outcome.skipped) == (1, 2)
    assert [bool(event.get("instances")) for event in events if event["event"] == "skipped"] == [False, False]
    assert (folder / "coco.json").read_bytes() == found
    assert {name: data for name, data in contents(folder).items() if name != "coco.json"} == first


def test_boxes_and_masks_are_those_of_the_layer(folder: Path, renderer: g.Renderer) -> None:
    g.render_all("s.toml", "a.png", coco="coco.json")
    told = json.loads((folder / "coco.json").read_text())
    numbers = renderer.layers(g.load("s.toml")).arrays["object_id"][..., 0].astype(int)
    expected = object_masks(numbers)
    assert len(expected) == 2
    assert told["images"] == [{"id": 1, "file_name": "a.png", "width": 32, "height": 24}]
    assert told["categories"] == [{"id": 1, "name": "block"}, {"id": 2, "name": "toy"}]
    assert [each["category_id"] for each in told["annotations"]] == [2, 1]
    for number, each in enumerate(told["annotations"], start=1):
        assert (each["bbox"], each["area"]) == (expected[number]["bbox"], expected[number]["area"])
        assert each["segmentation"] == {"size": [24, 32], "counts": expected[number]["counts"]}


def test_categories_have_the_numbers_of_the_films_list(folder: Path, renderer: g.Renderer) -> None:
    scene = g.load("s.toml", {"film.categories": ["lamp", "toy", "block"]})
    layers = renderer.layers(scene)
    object_id, semantic_id, depth = (layers.arrays[name][..., 0] for name in ("object_id", "semantic_id", "depth"))
    assert set(np.unique(object_id)) == {0, 1, 2}
    assert (semantic_id == np.array([0, 2, 3])[object_id.astype(int)]).all()
    assert ((depth > 0) == (object_id > 0)).all()
    with pytest.raises(SceneError, match=r"objects\[0\]: its category 'toy' is not in film\.categories"):
        labels.categories(g.load("s.toml", {"film.categories": ["block"]}))


def test_faults_are_told_before_anything_is_drawn(folder: Path) -> None:
    with pytest.raises(GlshadeError, match=r"coco\.json: the folder missing does not exist"):
        g.render_all("s.toml", "a.png", coco="missing/coco.json")
    with pytest.raises(TypeError, match=r"render_all takes paths of files, .* not Scene objects"):
        g.render_all([g.load("s.toml")], "a.png")  # type: ignore[list-item]
    with pytest.raises(ValueError, match="nothing to draw"):
        g.render_all([], "a.png")
    with pytest.raises(SceneError, match=r"film\.aovs\[0\]: position cannot be stored as PNG"):
        g.load("s.toml", {"film.aovs": ["position"]})
    assert [file.name for file in folder.iterdir()] == ["s.toml"]
    (folder / "0001.png").touch()
    with pytest.raises(GlshadeError, match=r"0001\.png exists: remove it, or choose resume=True"):
        g.render_all("s.toml", "####.png", frames=[1, 2])
