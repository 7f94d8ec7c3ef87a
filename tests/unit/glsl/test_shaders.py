"""Shader folders: the user's own files stand before the shipped ones, and the next picture notices every edit."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.folders import lambert, write

from glshade import BRDFS, Renderer, Scene, evaluate, render, verify
from glshade.errors import ShaderError
from glshade.glsl import shaders as shader_files
from glshade.glsl.shaders import Shaders, current

HELPED = '#include "math/helper.glsl"\n' + lambert("helper()")
HELPER = "float helper() {{\n    return {value};\n}}\n"
COSPOW = "float cospow(vec3 a, vec3 b, float p) {{\n    return {value};\n}}\n"


def scene(material: dict[str, Any] | None = None, **more: Any) -> Scene:
    """Returns a plane that fills the picture, under one light of intensity 1 from above."""
    camera = {"type": "orthographic", "eye": [0, 2, 0], "target": [0, 0, 0], "up": [0, 0, 1], "height": 1}
    plane = {"shape": "plane", "material": material or {"brdf": "lambert", "kd": 0.5}}
    lights = [{"type": "directional", "direction": [0, -1, 0]}]
    return Scene.model_validate({"objects": [plane], "lights": lights, "camera": camera, "film": {"size": [4, 4]}, **more})


def shown(renderer: Renderer, scene: Scene) -> float:
    """Returns the one value that the whole picture has [linear]."""
    pixels = renderer.render(scene, dtype="float32").pixels
    assert np.all(pixels == pixels[0, 0])
    return float(pixels[0, 0, 0])


def test_an_override_its_edits_and_its_end_show_in_the_next_picture(tmp_path: Path) -> None:
    subject = scene()
    with Renderer(shaders=tmp_path) as renderer:
        shipped = shown(renderer, subject)
        assert shipped == pytest.approx(0.5, rel=1e-6)
        path = write(tmp_path, "brdf/lambert.glsl", lambert("0.25"))
        assert shown(renderer, subject) == pytest.approx(np.pi / 8, rel=1e-6)
        write(tmp_path, "brdf/lambert.glsl", lambert("0.125"))
        assert shown(renderer, subject) == pytest.approx(np.pi / 16, rel=1e-6)
        path.unlink()
        assert shown(renderer, subject) == shipped


def test_an_edit_of_a_shipped_file_shows_in_the_next_picture(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shipped = tmp_path / "shaders"
    shutil.copytree(shader_files.SHIPPED, shipped)
    monkeypatch.setattr(shader_files, "SHIPPED", shipped)
    monkeypatch.setattr(shader_files, "_current", {})
    subject = scene()
    with Renderer() as renderer:
        before = shown(renderer, subject)
        write(shipped, "brdf/lambert.glsl", lambert("0.25"))
        assert shown(renderer, subject) == pytest.approx(np.pi / 8, rel=1e-6)
        write(shipped, "brdf/lambert.glsl", (shader_files._PACKAGE.parent / "shaders/brdf/lambert.glsl").read_text())
        assert shown(renderer, subject) == before


def test_a_mistake_is_an_error_that_its_correction_ends(tmp_path: Path) -> None:
    subject = scene()
    write(tmp_path, "brdf/lambert.glsl", lambert("0.25"))
    with Renderer(shaders=tmp_path) as renderer:
        before = shown(renderer, subject)
        write(tmp_path, "brdf/lambert.glsl", lambert("unknown"))
        with pytest.raises(ShaderError, match=rf"{tmp_path}/brdf/lambert\.glsl:7"):
            renderer.render(subject)
        write(tmp_path, "brdf/lambert.glsl", lambert("0.25"))
        assert shown(renderer, subject) == before


def test_a_file_stands_in_place_of_both_forms(tmp_path: Path) -> None:
    """The shipped fast form does not come before the user's exact one, but the user's fast form does."""
    phong = {"brdf": "phong", "kd": 0, "ks": 1, "exponent": 1}
    exact, fast = scene(phong), scene(phong, quality={"arithmetic": "fast"})
    with Renderer(shaders=tmp_path) as renderer:
        assert shown(renderer, exact) == pytest.approx(1, rel=1e-6)
        assert shown(renderer, fast) == pytest.approx(1, rel=1e-6)
        write(tmp_path, "math/cospow.glsl", COSPOW.format(value="0.25"))
        assert shown(renderer, exact) == shown(renderer, fast) == pytest.approx(0.25, rel=1e-6)
        write(tmp_path, "fast/math/cospow.glsl", COSPOW.format(value="0.125"))
        assert shown(renderer, exact) == pytest.approx(0.25, rel=1e-6)
        assert shown(renderer, fast) == pytest.approx(0.125, rel=1e-6)


def test_a_fast_form_without_its_twin_is_refused(tmp_path: Path) -> None:
    path = write(tmp_path, "fast/math/lonely.glsl", HELPER.format(value="1.0"))
    with pytest.raises(ShaderError, match=r"lonely\.glsl: .*math/lonely\.glsl") as error:
        Renderer(shaders=tmp_path)
    assert str(error.value).startswith(f"{path}:")
    assert "\n" not in str(error.value)


def test_a_folder_that_is_none_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ShaderError, match="no folder") as error:
        Shaders([tmp_path / "nowhere"])
    assert "\n" not in str(error.value)


def test_the_first_of_several_folders_wins(tmp_path: Path) -> None:
    first, second = tmp_path / "first", tmp_path / "second"
    write(first, "brdf/lambert.glsl", lambert("0.25"))
    write(second, "brdf/lambert.glsl", lambert("0.125"))
    write(second, "math/helper.glsl", HELPER.format(value="1.0"))
    files = Shaders([first, second])
    for name, folder in (("brdf/lambert.glsl", first), ("math/helper.glsl", second), ("brdf/phong.glsl", shader_files.SHIPPED)):
        found = files.find(name)
        assert found is not None
        assert found.path == folder / name
    with Renderer(shaders=[second, first]) as renderer:
        assert shown(renderer, scene()) == pytest.approx(np.pi / 16, rel=1e-6)


def test_an_override_may_include_a_new_file(tmp_path: Path) -> None:
    subject = scene()
    write(tmp_path, "brdf/lambert.glsl", HELPED)
    with Renderer(shaders=tmp_path) as renderer:
        with pytest.raises(ShaderError, match=r"lambert\.glsl:1: no shader file"):
            renderer.render(subject)
        write(tmp_path, "math/helper.glsl", HELPER.format(value="0.25"))
        assert shown(renderer, subject) == pytest.approx(np.pi / 8, rel=1e-6)
        write(tmp_path, "math/helper.glsl", HELPER.format(value="0.125"))
        assert shown(renderer, subject) == pytest.approx(np.pi / 16, rel=1e-6)


def test_the_digest_tells_contents_and_not_places(tmp_path: Path) -> None:
    here, there = tmp_path / "here", tmp_path / "there"
    for folder in (here, there):
        write(folder, "brdf/lambert.glsl", lambert("0.25"))
    digest = current([here]).digest
    assert digest == current([there]).digest != current().digest
    write(there, "brdf/lambert.glsl", lambert("0.125"))
    edited = current([there]).digest
    assert edited != digest
    write(there, "math/helper.glsl", HELPER.format(value="1.0"))
    assert current([there]).digest not in (digest, edited)
    shutil.copytree(shader_files.SHIPPED / "brdf", tmp_path / "same" / "brdf")
    assert current([tmp_path / "same"]).digest == current().digest


def test_other_functions_take_folders(tmp_path: Path) -> None:
    write(tmp_path, "brdf/lambert.glsl", lambert("0.25"))
    for on in ("vertex", "fragment"):
        value = evaluate(BRDFS["lambert"](kd=0.5), [0, 0, 1], [0, 0, 1], on, shaders=tmp_path)  # type: ignore[arg-type]
        assert value == pytest.approx([0.125] * 3)
    assert render(scene(), dtype="float32", shaders=tmp_path).pixels[0, 0, 0] == pytest.approx(np.pi / 8, rel=1e-6)
    assert verify(scene()).verdict == "verified"
    assert verify(scene(), shaders=tmp_path).verdict == "failed"


def test_names_do_not_lead_out_of_the_folders(tmp_path: Path) -> None:
    write(tmp_path, "secret.glsl", "")
    (tmp_path / "own").mkdir()
    files = Shaders([tmp_path / "own"])
    assert files.find("../secret.glsl") is None
    assert files.find(str(tmp_path / "secret.glsl")) is None


def test_nothing_is_read_again_while_nothing_changes(tmp_path: Path) -> None:
    write(tmp_path, "brdf/lambert.glsl", lambert("0.25"))
    assert current([tmp_path]) is current([tmp_path])
    subject = scene()
    with Renderer(shaders=tmp_path) as renderer, renderer.context.gl:
        assert renderer.prepare(subject, None, "linear") is renderer.prepare(subject, None, "linear")
