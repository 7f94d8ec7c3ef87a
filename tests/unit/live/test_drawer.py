"""The drawer: what it shows after each edit, and what it says about files that are broken."""

from __future__ import annotations

import os
import pickle
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.drawn import FROM_ABOVE, SCENE, Drawn, drawn, pixels_of

from glshade import Image, Renderer, load
from glshade.live import drawer as drawing
from glshade.live.messages import JPEG, PNG, Draw, Failed, Loaded, Pick, Picked, ReadSource, Restore, Save, Saved, Source


@pytest.fixture
def live(tmp_path: Path) -> Iterator[Drawn]:
    with drawn(tmp_path) as made:
        yield made


def messages(answer: Any) -> list[str]:
    return [problem["message"] for problem in answer.problems]


def places(answer: Loaded) -> set[tuple[str, int]]:
    return {(Path(problem["file"]).name, problem["line"]) for problem in answer.problems}


def test_a_still_picture_has_the_pixels_of_render(live: Drawn, renderer: Renderer) -> None:
    assert live.load().ok
    frame = live.draw()
    assert (frame.mime, frame.width, frame.height, frame.revision) == (PNG, 48, 32, 1)
    assert np.array_equal(live.pixels(), renderer.render(load(live.scene)).pixels)
    side = live.pixels(camera={"name": "side"})
    assert np.array_equal(
        side, renderer.render(load(live.scene, [("camera", "{ eye = [6, 0, 0], target = [0, 0, 0] }")])).pixels
    )


def test_a_moving_picture_is_a_jpeg_and_smaller_where_drawing_is_slow(live: Drawn, monkeypatch: pytest.MonkeyPatch) -> None:
    live.load()
    frame = live.draw(still=False)
    assert (frame.mime, frame.width) == (JPEG, 48)
    monkeypatch.setattr(drawing, "SLOW", 1e-9)
    live.draw(still=False, **FROM_ABOVE)
    frame = live.draw(still=False)
    assert (frame.width, frame.height) == (24, 16)
    assert live.draw().width == 48, "a still picture is always whole"
    monkeypatch.setattr(drawing, "SLOW", 10.0)
    live.draw(still=False, **FROM_ABOVE)
    assert live.draw(still=False).width == 48


def rebuilt(answer: Loaded) -> list[str]:
    return [name for program in answer.info["programs"] if program["rebuilt"] for name in program["objects"]]


def test_only_programs_whose_text_changed_are_rebuilt(live: Drawn) -> None:
    assert rebuilt(live.load()) == ["one", "two"]
    before = live.pixels()
    live.write("phong", "// A comment.\n\n" + live.shipped("phong").replace("    ", "  ") + "/* And\nmore. */ // And more.\n")
    answer = live.load()
    assert answer.ok
    assert rebuilt(answer) == []
    live.write("phong", live.shipped("phong").replace("return ", "return 0.5 * ", 1))
    assert rebuilt(live.load()) == ["one"]
    after = live.pixels()
    assert not np.array_equal(after[:, :24], before[:, :24])
    assert np.array_equal(after[:, 24:], before[:, 24:])


def test_the_last_good_picture_stays_through_broken_shaders_and_a_mend_clears_them(live: Drawn) -> None:
    live.load()
    before = live.pixels(**FROM_ABOVE)
    live.write("phong", live.shipped("phong") + "\nfloat wrong() {\n    return missing;\n}\n")
    live.write("lambert", live.shipped("lambert").replace("return ", "return nothing * ", 1))
    answer = live.load()
    assert not answer.ok
    assert (answer.revision, answer.shown) == (2, 1)
    lambert = live.shipped("lambert").split("\n")
    wrong = next(number for number, line in enumerate(lambert, 1) if "return " in line)
    assert ("lambert.glsl", wrong) in places(answer)
    assert all(problem["excerpt"] and problem["caret"] for problem in answer.problems)
    assert np.array_equal(live.pixels(**FROM_ABOVE), before)
    assert live.draw(size=[20, 10]).width == 20
    for name in ("phong", "lambert"):
        live.write(name, live.shipped(name))
    answer = live.load()
    assert answer.ok
    assert answer.problems == []
    assert answer.shown == 3


def test_all_programs_are_tried(live: Drawn) -> None:
    for name in ("phong", "lambert"):
        live.write(name, live.shipped(name).replace("return ", f"return {name}_is_missing * ", 1))
    text = " ".join(messages(live.load()))
    assert "phong_is_missing" in text
    assert "lambert_is_missing" in text


def test_unformatted_shaders_are_read_too(live: Drawn) -> None:
    live.write(
        "phong", live.shipped("phong") + "\nfloat half_of(float x) { return 0.5 * x; }\nfloat b(float x)\n{\nreturn x; }\n"
    )
    answer = live.load()
    assert answer.ok, answer.problems


@pytest.mark.parametrize(
    ("name", "edit", "expected"),
    [
        ("toml", lambda live: live.scene.write_text("[film"), "is not TOML"),
        ("empty", lambda live: live.scene.write_text(""), "is required"),
        ("unknown", lambda live: live.scene.write_text(SCENE.replace("eye =", "eyes =")), "unknown key"),
        ("folder", lambda live: (live.scene.unlink(), live.scene.mkdir()), "irectory"),
        ("gone", lambda live: live.scene.unlink(), "no such file"),
        ("binary", lambda live: live.scene.write_bytes(bytes(range(256))), "UTF-8"),
        ("binary shader", lambda live: (live.shaders / "brdf/phong.glsl").write_bytes(bytes(range(256))), "UTF-8"),
        ("large shader", lambda live: os.truncate(live.shaders / "brdf/phong.glsl", 100 << 20), "larger than"),
        ("include", lambda live: live.write("phong", '#include "../../etc/passwd"\n'), "no shader file"),
        ("absolute include", lambda live: live.write("phong", '#include "/etc/passwd"\n'), "no shader file"),
        ("itself", lambda live: live.write("phong", '#include "brdf/phong.glsl"\n'), ""),
        ("no folder", lambda live: os.rename(live.shaders, live.folder / "elsewhere"), "folder"),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_what_is_broken_gives_a_message_and_the_last_picture(live: Drawn, name: str, edit: Any, expected: str) -> None:
    live.load()
    before = live.pixels(**FROM_ABOVE)
    edit(live)
    answer = live.load()
    assert not answer.ok
    assert expected in " ".join(messages(answer))
    assert all("\n" not in message for message in messages(answer))
    assert np.array_equal(live.pixels(**FROM_ABOVE), before)


def test_a_symbolic_link_out_of_the_folder_is_not_followed(live: Drawn) -> None:
    live.load()
    path = live.shaders / "brdf/phong.glsl"
    path.unlink()
    path.symlink_to("/etc/passwd")
    answer = live.load()
    assert not answer.ok
    assert "symbolic link" in " ".join(messages(answer))
    assert "root:" not in str(answer.problems)
    inside = live.shaders / "real.glsl"
    inside.write_text(live.shipped("phong"))
    path.unlink()
    path.symlink_to("../real.glsl")
    assert live.load().ok


def textured(folder: Path) -> str:
    """Returns a scene with a mesh and two textures, one of which its material file names."""
    corners = "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n"
    (folder / "mesh.obj").write_text(f"mtllib mesh.mtl\n{corners}usemtl paint\nf 1/1 2/2 3/3\nf 1/1 3/3 4/4\n")
    (folder / "mesh.mtl").write_text("newmtl paint\nKd 1 1 1\nmap_Kd red.png\n")
    for name, colour in (("red", (200, 20, 20)), ("blue", (20, 20, 200))):
        Image(np.full((4, 4, 3), colour, dtype=np.uint8), "srgb").save(folder / f"{name}.png")
    return SCENE.replace('shape = "sphere"\nmaterial = "left"', 'mesh = "mesh.obj"').replace(
        'shape = "sphere"\nmaterial = "right"',
        'mesh = "mesh.obj"\nmaterial = { brdf = "lambert", kd = { texture = "blue.png" } }',
    )


def test_meshes_and_textures_stay_as_they_were(tmp_path: Path) -> None:
    with drawn(tmp_path, textured(tmp_path)) as live:
        answer = live.load()
        assert answer.ok, answer.problems
        names = {Path(path).name for path in answer.dependencies}
        assert names >= {"scene.toml", "mesh.obj", "mesh.mtl", "red.png", "blue.png"}
        before = live.pixels(**FROM_ABOVE)
        for name in ("mesh.obj", "red.png", "blue.png"):
            (tmp_path / name).write_text("broken")
        answer = live.load()
        assert not answer.ok
        assert np.array_equal(live.pixels(**FROM_ABOVE), before)
        for name in ("mesh.obj", "mesh.mtl", "red.png", "blue.png"):
            (tmp_path / name).unlink()
        answer = live.load()
        assert not answer.ok
        assert {Path(path).name for path in answer.dependencies} >= names
        assert np.array_equal(live.pixels(**FROM_ABOVE), before)
        assert live.draw(**FROM_ABOVE, set={"lights.sun.intensity": 2}).ignored == []
        (tmp_path / "scene.toml").write_text(textured(tmp_path))
        answer = live.load()
        assert answer.ok, answer.problems
        Image(np.full((4, 4, 3), (20, 200, 20), dtype=np.uint8), "srgb").save(tmp_path / "red.png")
        assert live.load().ok
        assert not np.array_equal(live.pixels(**FROM_ABOVE), before)


def test_values_set_by_hand_carry_over_by_name_and_type(live: Drawn, renderer: Renderer) -> None:
    live.load()
    values = {"materials.left.kd": [0.1, 0.9, 0.1], "lights.sun.intensity": 0.5, "materials.left.exponent": 5}
    pairs = [("materials.left.kd", "[0.1, 0.9, 0.1]"), ("lights.sun.intensity", "0.5"), ("materials.left.exponent", "5")]
    assert np.array_equal(live.pixels(set=values), renderer.render(load(live.scene, pairs)).pixels)
    live.scene.write_text(SCENE.replace('brdf = "phong"', 'brdf = "lambert"').replace("ks = 0.3\nexponent = 20", ""))
    assert live.load().ok
    assert live.draw(set={**values, "objects.one.material": 3, "bogus.key": 1, "film.exposure": "much"}).ignored == [
        "materials.left.exponent",
        "objects.one.material",
        "bogus.key",
        "film.exposure",
    ]
    frame = live.draw(set={"materials.left": {"brdf": "ggx"}})
    assert frame.controls is not None
    assert any(field["key"] == "materials.left.roughness" for group in frame.controls["groups"] for field in group["fields"])


def test_a_camera_that_has_gone_gives_way_to_the_own_one(live: Drawn) -> None:
    live.load()
    live.draw(camera={"name": "side"})
    live.scene.write_text(SCENE.replace("cameras.side", "cameras.back"))
    assert live.load().ok
    frame = live.draw(camera={"name": "side"})
    assert frame.ignored == ["camera"]
    assert np.array_equal(pixels_of(frame), live.pixels())


def test_the_previous_revision_is_kept(live: Drawn) -> None:
    live.load()
    before = live.pixels()
    assert isinstance(live.ask(Draw(view={"source": "previous"})), Failed)
    live.scene.write_text(SCENE.replace("[0.6, 0.3, 0.1]", "[0.1, 0.3, 0.6]"))
    live.load()
    assert not np.array_equal(live.pixels(), before)
    assert np.array_equal(live.pixels(source="previous"), before)
    assert not np.array_equal(live.pixels(source="last_good"), before)


def test_a_picture_file_can_be_shown_but_only_from_the_folder_of_the_scene(live: Drawn, tmp_path: Path) -> None:
    live.load()
    answer = live.ask(Save(path=str(live.folder / "saved.png")))
    assert isinstance(answer, Saved)
    assert np.array_equal(live.pixels(source="file:saved.png"), live.pixels())
    for name in ("/etc/passwd", "../x.png", "missing.png"):
        assert isinstance(live.ask(Draw(view={"source": f"file:{name}"})), Failed)


def test_every_layer_is_shown(live: Drawn) -> None:
    layers = live.load().info["layers"]
    assert {"normal", "depth", "light_sun", "cryptomatte", "object_id"} <= set(layers)
    for layer in layers:
        picture = live.pixels(layer=layer)
        assert picture.shape == (32, 48, 3), layer
        assert picture.any() or layer in ("background", "uv", "emission"), layer
    assert isinstance(live.ask(Draw(view={"layer": "nothing"})), Failed)


def test_pixels_that_are_not_finite_are_painted(live: Drawn) -> None:
    live.load()
    assert live.draw(paint="nan").non_finite == 0
    live.write("phong", live.shipped("phong").replace("return ", "return (n_zero() / n_zero()) * ", 1))
    live.write("phong", live.shipped("phong").replace("return ", "return vec3(uintBitsToFloat(0x7fc00000u)) + ", 1))
    assert live.load().ok
    frame = live.draw(paint="nan")
    assert frame.non_finite
    magenta = (live.pixels(paint="nan") == np.array([255, 0, 255])).all(axis=2).sum()
    assert magenta == frame.non_finite


def test_an_object_can_be_picked(live: Drawn) -> None:
    live.load()
    answer = live.ask(Pick(view={}, x=14, y=16))
    assert isinstance(answer, Picked)
    assert (answer.object, answer.key, answer.material, answer.material_key) == ("one", "objects.0", "left", "materials.left")
    assert answer.point is not None
    assert answer.point == pytest.approx((-1.2, 0, 1), abs=0.35)
    empty = live.ask(Pick(view={}, x=0, y=0))
    assert isinstance(empty, Picked)
    assert empty.object is None
    assert isinstance(live.ask(Pick(view={}, x=48, y=0)), Failed)


def test_the_files_of_an_object_are_those_that_are_drawn(live: Drawn) -> None:
    live.load()
    answer = live.ask(ReadSource(view={}, object=0))
    assert isinstance(answer, Source)
    assert (answer.name, answer.object, answer.revision) == ("one", 0, 1)
    assert answer.files[0]["name"] == "brdf/phong.glsl"
    assert "\n".join(answer.files[0]["lines"]) == live.shipped("phong").rstrip("\n")
    names = [file["name"] for file in answer.files]
    assert len(set(names)) == len(names)
    assert {"pass/phong.frag", "pass/phong.vert", "light/directional.glsl", "<surface>"} <= set(names)
    assert "brdf/lambert.glsl" not in names
    flat = live.ask(ReadSource(view={"shading": "flat"}, object=0))
    assert isinstance(flat, Source)
    assert "pass/flat.vert" in [file["name"] for file in flat.files]

    live.write("phong", "broken {")
    live.load()
    assert live.ask(ReadSource(view={}, object=0)) == answer
    missing = live.ask(ReadSource(view={}, object=7))
    assert isinstance(missing, Failed)
    assert "objects[7]" in missing.problems[0]["message"]


def test_gl_objects_are_let_go(live: Drawn) -> None:
    def round_of_edits() -> None:
        for number in range(4):
            live.write("phong", live.shipped("phong").replace("return ", f"return {1 + number}.5 * ", 1))
            assert live.load().ok
            live.pixels(**FROM_ABOVE)
            live.write("lambert", "broken {")
            assert not live.load().ok
            live.write("lambert", live.shipped("lambert"))
            live.scene.write_text(SCENE.replace("exponent = 20", f"exponent = 2{number}"))
            assert live.load().ok
        live.write("phong", live.shipped("phong"))
        live.scene.write_text(SCENE)
        assert live.load().ok
        live.pixels(**FROM_ABOVE)
        # The previous revision keeps its programs until it is no longer the previous one.
        live.load()
        live.pixels(**FROM_ABOVE)

    round_of_edits()
    before = live.objects()
    round_of_edits()
    assert live.objects() == before
    assert before["glIsProgram"] <= 4


def test_a_new_drawer_starts_from_the_snapshot(tmp_path: Path) -> None:
    with drawn(tmp_path, textured(tmp_path)) as live:
        live.load()
        before = live.pixels(**FROM_ABOVE)
        live.scene.write_text("broken")
        answer = live.load()
        assert answer.snapshot is not None
        for name in ("mesh.obj", "mesh.mtl", "red.png", "blue.png"):
            (tmp_path / name).unlink()
        live.drawer.renderer.release()
        live.drawer = drawing.Drawer("auto", "", str(tmp_path / "work"))
        restored = live.ask(Restore(folder=answer.snapshot))
        assert isinstance(restored, Loaded)
        assert restored.ok, restored.problems
        assert restored.shown == 1
        assert restored.controls == answer.controls
        assert np.array_equal(live.pixels(**FROM_ABOVE), before)


def test_a_text_that_ended_a_drawer_is_not_tried_again(live: Drawn, monkeypatch: pytest.MonkeyPatch) -> None:
    live.load()
    bad = live.shipped("phong").replace("return ", "return 0.125 * ", 1)
    live.write("phong", bad)
    with monkeypatch.context() as patch:
        # The process ends in the middle of a draw, so nothing that follows it is run.
        patch.setattr(drawing._Trying, "__exit__", lambda *_: None)
        assert live.load().ok
    live.drawer.renderer.release()
    live.drawer = drawing.Drawer("auto", "", str(live.folder / "work"))
    answer = live.load()
    assert not answer.ok
    assert "not tried again" in messages(answer)[0]
    live.scene.write_text(SCENE.replace("exponent = 20", "exponent = 30"))
    assert not live.load().ok, "another file has changed, and not the text"
    live.write("phong", bad.replace("0.125", "0.25"))
    assert live.load().ok


def test_a_model_without_reference_is_kept_with_its_parameters(live: Drawn) -> None:
    model = (
        "// A test.\nstruct Glow {\n    vec3 kd;  // [0, 1] default [0.5, 0.5, 0.5]: colour\n};\n\n"
        "vec3 brdf_cos(Glow m, Frame f, vec3 l, vec3 v) {\n    return m.kd * dot(f.n, l);\n}\n"
    )
    live.write("glow", '#include "surface/frame.glsl"\n' + model)
    live.scene.write_text(SCENE.replace('brdf = "lambert"', 'brdf = "glow"'))
    answer = live.load()
    assert answer.ok, answer.problems
    before = live.pixels(**FROM_ABOVE)
    live.write(
        "glow",
        '#include "surface/frame.glsl"\n' + model.replace("};", "    float more;  // [0, 1] default 1\n};").replace("f.n", "n"),
    )
    assert not live.load().ok
    assert np.array_equal(live.pixels(**FROM_ABOVE), before)


def test_messages_are_plain_data(live: Drawn) -> None:
    answer = live.load()
    assert pickle.loads(pickle.dumps(answer)) == answer
