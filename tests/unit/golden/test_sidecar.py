"""Sidecars: what they keep, and what happens where one cannot be used."""

from __future__ import annotations

import json
import math
import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from glshade import Image, Renderer, Scene
from glshade.errors import GlshadeError
from glshade.golden.names import check_key, sidecar_path
from glshade.golden.rules import RULES, Rule
from glshade.golden.sidecar import (
    Driver,
    First,
    Origin,
    RuleUse,
    Sidecar,
    drawn_by,
    family,
    origin_of,
    parsed,
    read_sidecar,
    sha256_of,
    write_sidecar,
)
from glshade.reference.freedom import Freedom
from glshade.scene.digest import scene_digest

words = st.text(st.characters(blacklist_categories=("Cs",)), max_size=20)
thresholds = st.dictionaries(st.sampled_from(["fail", "failpercent", "hardfail", "warn", "hardwarn"]), st.floats(0, math.inf))


@pytest.fixture
def picture(tmp_path: Path) -> Path:
    path = tmp_path / "ball.png"
    Image(np.zeros((2, 2, 3), dtype=np.uint8), "srgb").save(path)
    return path


def sidecar_of(picture: Path, **values: Any) -> Sidecar:
    sha256 = sha256_of(picture)
    return Sidecar(sha256=sha256, first=First(sha256=sha256), **values)


@settings(max_examples=15)  # Each waits until the file is on the disk.
@given(words, words, words, thresholds)
def test_a_sidecar_keeps_its_values(tmp_path: Path, renderer_name: str, version: str, scene: str, options: Any) -> None:
    picture = tmp_path / "ball.png"
    picture.write_bytes(b"a picture")
    rule = RuleUse.of(RULES["idiff"](**options))
    driver = Driver(renderer=renderer_name, version=version)
    written = sidecar_of(picture, made_by="driver", driver=driver, scene=scene, rule=rule, accepted_drift=2)
    write_sidecar(picture, written)
    assert read_sidecar(picture) == (written, "")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["ball.png", "ball.png.glshade.json"]


@given(thresholds)
def test_a_rule_is_written_by_the_settings_that_are_not_defaults(options: Any) -> None:
    rule: Any = RULES["idiff"](**options)
    use = RuleUse.of(rule)
    assert use.rule() == rule
    assert use.options.keys() <= options.keys()
    assert parsed(json.dumps(use.model_dump(mode="json"), allow_nan=False).encode(), RuleUse).rule() == rule


@pytest.mark.parametrize("name", RULES)
def test_every_rule_can_be_written(name: str) -> None:
    rule: Rule = RULES[name]()
    assert RuleUse.of(rule) == RuleUse(name=name)
    assert isinstance(RuleUse(name=name).rule(), RULES[name])


def test_a_rule_that_is_not_known_is_named() -> None:
    with pytest.raises(GlshadeError, match="no rule is named 'code'; did you mean \"codes\""):
        RuleUse(name="code").rule()
    with pytest.raises(GlshadeError, match="the rule codes has no such settings: fail"):
        RuleUse(name="codes", options={"fail": 1.0}).rule()


def damaged(picture: Path, text: bytes) -> str:
    """Writes the text as the picture's sidecar, and returns why it cannot be used."""
    sidecar_path(picture).write_bytes(text)
    sidecar, note = read_sidecar(picture)
    assert sidecar is None
    assert "\n" not in note
    assert note.startswith("ball.png.glshade.json is not used: ")
    return note.partition(": ")[2]


def test_a_sidecar_that_is_damaged_says_what_is_wrong(picture: Path) -> None:
    whole = sidecar_of(picture).model_dump(mode="json")

    def changed(**values: Any) -> bytes:
        return json.dumps({**whole, **values}).encode()

    assert damaged(picture, b"").startswith("is damaged: Expecting value")
    assert damaged(picture, changed()[:-20]).startswith("is damaged: ")
    assert damaged(picture, b"\xff\xfe\x00").startswith("is damaged: ")
    assert damaged(picture, b"[" * 100_000).startswith("is damaged: ")
    assert damaged(picture, b"[1]").startswith("is damaged: ")
    assert damaged(picture, changed(made_by="somebody")).startswith("is damaged: made_by: 'somebody' is not one of ")
    assert damaged(picture, changed(driver={})) == "is damaged: driver.renderer: is required"
    assert damaged(picture, changed(colour=1)).startswith("is damaged: colour: unknown key")
    assert damaged(picture, changed(accepted_drift=math.nan)) == "is damaged: NaN is not a number of JSON"
    assert damaged(picture, changed(rule={"name": "idiff", "options": {"fail": "much"}})).startswith("is damaged: rule.options")
    assert damaged(picture, b" " * (2 << 20)).startswith("is larger than 1,048,576 bytes")
    later = damaged(picture, changed(version=2, colour=1))
    assert later == "was written by a later version of glshade (format 2, known: 1); update glshade"
    assert damaged(picture, changed(sha256="0" * 64)) == "it belongs to another picture; approve the picture again"


def test_a_sidecar_that_is_no_file_is_not_used(picture: Path) -> None:
    assert read_sidecar(picture)[1].startswith("ball.png has no sidecar (ball.png.glshade.json)")
    os.mkfifo(sidecar_path(picture))
    assert read_sidecar(picture) == (None, "ball.png.glshade.json is not used: is not a regular file")
    sidecar_path(picture).unlink()
    sidecar_path(picture).mkdir()
    assert read_sidecar(picture) == (None, "ball.png.glshade.json is not used: Is a directory")


@pytest.mark.parametrize(
    ("renderer_name", "version", "name"),
    [
        ("llvmpipe (LLVM 15.0.7, 256 bits)", "4.5 (Core Profile) Mesa 22.3.6", "llvmpipe"),
        ("softpipe", "3.3 (Core Profile) Mesa 22.3.6", "softpipe"),
        ("NVIDIA GeForce RTX 3080/PCIe/SSE2", "3.3.0 NVIDIA 535.104.05", "nvidia"),
        ("GeForce GTX 660/PCIe/SSE2", "3.3.0", "nvidia"),
        ("AMD Radeon RX 6800 (radeonsi, navi21, LLVM 15.0.7, DRM 3.49)", "4.6 Mesa 23.1", "amd"),
        ("Mesa Intel(R) UHD Graphics 620 (KBL GT2)", "4.6 Mesa 22.3.6", "intel"),
        ("zink Vulkan 1.3(NVIDIA GeForce RTX 3080)", "4.6 Mesa 23.1", "zink"),
        ("D3D12 (NVIDIA GeForce RTX 3080)", "4.2 Mesa 23.1", "d3d12"),
        ("Apple M1", "4.1 Metal - 83", "apple"),
        ("Mali-G52 (Panfrost)", "3.1 Mesa", "mali-g52"),
        ("", "", "unknown"),
    ],
)
def test_drivers_have_short_names(renderer_name: str, version: str, name: str) -> None:
    assert family(renderer_name, version) == name


@given(words, words)
def test_the_short_name_of_any_driver_is_a_key(renderer_name: str, version: str) -> None:
    check_key(family(renderer_name, version))


def test_the_attributes_of_a_picture_tell_its_driver(tmp_path: Path) -> None:
    path = tmp_path / "ball.exr"
    attributes = {"glshade:renderer": "SVGA3D; build: RELEASE; 3.3 Mesa 22", "glshade:version": "0.1", "glshade:scene": "ab"}
    Image(np.zeros((2, 2, 3), dtype=np.float32)).save(path, attributes)
    driver = Driver(renderer="SVGA3D; build: RELEASE", version="3.3 Mesa 22")
    assert origin_of(path) == Origin(made_by="driver", driver=driver, glshade="0.1", scene_digest="ab")
    Image(np.zeros((2, 2, 3), dtype=np.float32)).save(path)
    assert origin_of(path) == Origin()
    assert origin_of(tmp_path / "absent.exr") == Origin()


def test_the_sidecar_of_a_picture_tells_its_origin(picture: Path) -> None:
    write_sidecar(picture, sidecar_of(picture, made_by="reference", scene="../scenes/ball.toml"))
    assert origin_of(picture) == Origin(made_by="reference", scene=str(picture.parent.parent / "scenes/ball.toml"))
    picture.write_bytes(b"another picture")
    assert origin_of(picture) == Origin()


def test_the_origin_of_what_a_renderer_draws(renderer: Renderer, tmp_path: Path) -> None:
    scene = Scene.model_validate({"objects": [{"shape": "sphere"}]})
    origin = drawn_by(renderer, scene, tmp_path / "ball.toml")
    assert origin.driver is not None
    assert (origin.driver.renderer, origin.driver.version) == (renderer.context.renderer, renderer.context.version)
    assert origin.scene_digest == scene_digest(scene)
    assert origin.scene == str(tmp_path / "ball.toml")
    assert origin.freedom is not None
    assert isinstance(Freedom.from_dict(origin.freedom), Freedom)
    assert parsed(json.dumps(origin.model_dump(mode="json"), allow_nan=False).encode(), Origin) == origin
