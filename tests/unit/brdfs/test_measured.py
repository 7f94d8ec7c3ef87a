"""The model `measured` shows the values of its file, at every rate and on every way from the file to the picture."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.extremes import FACTOR, ORDINARY, exact
from support.merl import rough, write_merl
from support.strategies import directions

import glshade
from glshade import BRDFS, Renderer, Scene, evaluate
from glshade.arrays import unit_and_length
from glshade.brdfs.measured import SAMPLE, coordinates
from glshade.errors import AssetError, SceneError
from glshade.glsl.generator import generate
from glshade.live.dependencies import leniently_named
from glshade.live.revision import with_pictures
from glshade.measured.rusinkiewicz import angles, mirrored
from glshade.measured.table import Table, of_function
from glshade.reference.freedom import Freedom
from glshade.reference.picture import render
from glshade.scene.digest import scene_digest
from glshade.textures.volume import Volume
from glshade.verification.candidates import find_candidates
from glshade.verification.verdict import verdict_of

SUN = {"type": "directional", "direction": [-0.4, -0.6, -0.7], "intensity": 0.6}
ON: Any = ("text", "vertex", "fragment")


def material(**keys: Any) -> Any:
    return BRDFS["measured"](**keys)


def scene(**keys: Any) -> Scene:
    """Returns a small picture of two balls of measured reflectance, which the reference computes together."""
    ball = {"shape": {"type": "sphere", "segments": 16, "rings": 8}, "material": {"brdf": "measured", **keys}}
    balls = [{**ball, "name": "ball"}, {**ball, "name": "other", "transform": {"translate": [2, 0, 0]}}]
    return Scene.model_validate({"objects": balls, "lights": [SUN], "film": {"size": [60, 32]}})


def in_memory(monkeypatch: pytest.MonkeyPatch, table: Table) -> Any:
    """Returns a material whose table is this one."""
    monkeypatch.setattr("glshade.measured.file.load", lambda path, reciprocity: table)
    return material()


class TestAngles:
    """The coordinates in the table, which the GLSL, the reference and the readers of files compute each in their own way."""

    @given(st.integers(0, 2**32 - 1), st.booleans())
    def test_they_are_those_of_the_readers(self, seed: int, retro: bool) -> None:
        l, v = (unit_and_length(directions(64, seed + k).astype(np.float64))[0] for k in (0, 1))
        found = coordinates(l, v, math.pi, retro)
        theta_h, theta_d, phi_d = angles(mirrored(l) if retro else l, v)
        assert found[:, 0] ** 2 == pytest.approx(np.minimum(theta_h / (math.pi / 2), 1), abs=1e-7)
        assert found[:, 1] == pytest.approx(theta_d / (math.pi / 2), abs=1e-7)
        # Azimuths that differ by whole turns are equal.
        assert np.exp(2j * math.pi * found[:, 2]) == pytest.approx(np.exp(2j * phi_d), abs=1e-5)

    def test_special_directions_have_finite_coordinates(self) -> None:
        up, low = np.array([0, 0, 1.0]), np.array([1.0, 0, 1e-30])
        for dtype in (np.float32, np.float64):
            for l, v in ((up, up), (low, low), (low, -low), (low, up), (low, low * [-1, 1, 1])):
                found = coordinates(l.astype(dtype), v.astype(dtype), math.pi, False)
                assert np.isfinite(found).all()
                assert found.dtype == dtype


class TestValues:
    """f cos of a material."""

    @settings(max_examples=5)
    @given(seed=st.integers(0, 2**32 - 1), turn=st.sampled_from([math.pi, 2 * math.pi]), retro=st.booleans())
    def test_the_gpu_and_the_text_show_what_the_reference_shows(
        self, renderer: Renderer, seed: int, turn: float, retro: bool
    ) -> None:
        """A rough table whose values differ by up to 4 between neighbours. Its rows at the poles do not depend on phi_d."""
        random = np.random.default_rng(seed)
        values = random.uniform(-1, 1, (10, 6, 8, 3))
        values[:, 0] = values[:1, 0]
        values[:, :, 0] = values[:1, :, 0]
        table = Table(values.astype(np.float16), turn, retro, f"{seed}, {turn}, {retro}")
        l, v = directions(256, seed), directions(256, seed + 1)
        v[:64] = l[:64]
        v[64:128] = l[64:128] * np.float32([-1, -1, 1])
        with pytest.MonkeyPatch.context() as patch:
            chosen = in_memory(patch, table)
            value, conditioning = exact(chosen, l, v)
            lit = (l[:, 2:] > 0) & (v[:, 2:] > 0)
            both = (l.astype(np.float64), v.astype(np.float64))
            assert value == pytest.approx(np.where(lit, table.at(*both) * both[0][:, 2:], 0), abs=1e-6)
            enough = np.maximum(3 * ORDINARY * np.maximum(1, np.abs(value)), FACTOR * conditioning)
            for on in ON:
                assert np.all(np.abs(evaluate(chosen, l, v, on=on, context=renderer.context) - value) <= enough), on

    def test_the_special_directions_are_finite(self, renderer: Renderer) -> None:
        up, low = np.float32([0, 0, 1]), np.float32([1, 0, 1e-20])
        l = np.stack([up, up, low, low, low, -up])
        v = np.stack([up, low, up, low, low * np.float32([-1, 1, 1]), up])
        for on in ("reference", *ON):
            found = evaluate(material(), l, v, on=on, context=renderer.context)
            assert np.isfinite(found).all(), on
            assert np.all(found >= 0)
            assert np.all(found[-1] == 0)
            assert np.all(found[0] > 0)

    @given(st.integers(0, 2**32 - 1))
    def test_where_phi_d_has_no_meaning_it_has_no_effect(self, seed: int) -> None:
        """f is continuous at h = n and at l = v: directions that are nearly so give nearly the same value."""
        random = np.random.default_rng(seed)
        l = directions(2, seed)[1:].astype(np.float64)
        for v in (l, l * [-1, -1, 1]):
            near = v + 1e-7 * random.normal(size=(16, 3))
            near /= np.linalg.norm(near, axis=1, keepdims=True)
            value = evaluate(material(), np.broadcast_to(l, near.shape), near)
            # The root of theta_h makes an angle of 1e-7 a coordinate of 3e-4.
            assert value == pytest.approx(np.broadcast_to(value[:1], value.shape), rel=0.02, abs=1e-12)

    def test_retro_reflective_data_peak_where_the_viewer_stands_beside_the_light(self, monkeypatch: pytest.MonkeyPatch) -> None:
        def lobe(l: Any, v: Any) -> Any:
            return np.exp(-200 * (1 - np.sum(l * v, axis=-1, keepdims=True))) * [1.0, 0.8, 0.1] + 0.01

        chosen = in_memory(monkeypatch, of_function(lobe, retro=True, size=(40, 40, 40), digest="lobe"))
        angle = np.radians(np.linspace(-70, 70, 141))
        v = np.stack([np.sin(angle), np.zeros_like(angle), np.cos(angle)], axis=1)
        for tilt in (0, 20, 45):
            l = np.array([np.sin(np.radians(tilt)), 0, np.cos(np.radians(tilt))])
            found = evaluate(chosen, l, v)
            assert np.degrees(angle[found[:, 0].argmax()]) == pytest.approx(tilt, abs=2)
            assert found[:, 0].max() > 20 * np.median(found[:, 0])

    def test_only_a_table_that_is_its_own_mirror_image_is_not_handed(self, tmp_path: Path) -> None:
        f = rough(1)
        for name, values, handed in (("even", f + f[:, :, ::-1], False), ("odd", f, True)):
            assert material(file=write_merl(tmp_path / f"{name}.binary", values)).is_handed is handed
        assert not BRDFS["ggx"]().is_handed

    def test_the_scale_multiplies_and_the_ambient_reflectance_is_given(self) -> None:
        l, v = directions(32, 1), directions(32, 2)
        plain, scaled = evaluate(material(), l, v), evaluate(material(scale=(2, 0.5, 0), ka=0.25), l, v)
        assert scaled == pytest.approx(plain * [2, 0.5, 0])
        assert material(ka=0.25).asked("ambient") == {"ka"}

    def test_reciprocity_is_a_choice(self, tmp_path: Path, renderer: Renderer) -> None:
        """Enforced, light and viewer may be exchanged, whatever was measured."""
        path = write_merl(tmp_path / "rough.binary", rough(3))
        l, v = directions(64, 3), directions(64, 4)
        value, exchanged = evaluate(material(file=path), l, v), evaluate(material(file=path), v, l)
        cosines = l[:, 2:].astype(np.float64), v[:, 2:].astype(np.float64)
        assert value * cosines[1] == pytest.approx(exchanged * cosines[0], rel=1e-6, abs=1e-9)


class TestVerification:
    """Pictures of measured materials against the reference."""

    @pytest.mark.parametrize("rate", ["flat", "gouraud", "phong"])
    def test_every_rate_is_verified(self, rate: Any, tmp_path: Path, renderer: Renderer) -> None:
        steep = scene(file=write_merl(tmp_path / "steep.binary", rough(7, (12, 9, 12), 4.0)))
        verdict = glshade.verify(steep, shading=rate, renderer=renderer)
        assert verdict.verdict == "verified", str(verdict)

    def test_a_picture_of_another_file_fails(self, tmp_path: Path, renderer: Renderer) -> None:
        one, other = (scene(file=write_merl(tmp_path / f"{seed}.binary", rough(seed))) for seed in (1, 2))
        picture = renderer.render(other, dtype="float32").pixels
        assert glshade.verify(one, picture=picture, renderer=renderer).verdict == "failed"

    def test_weights_of_eight_bits_are_allowed_to_the_driver_that_has_them(
        self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        steep = scene(file=write_merl(tmp_path / "steep.binary", rough(7, (12, 9, 12), 4.0)))
        along = Volume._along

        def coarse(self: Volume, axis: int, at: Any) -> Any:
            indices, share = along(self, axis, at)
            return indices, np.floor(share * 256) / 256

        with monkeypatch.context() as patch:
            patch.setattr(Volume, "_along", coarse)
            picture = render(steep).pixels
        for table, derived, expected in ((0.0, False, "failed"), (1 / 256, False, "verified"), (1 / 256, True, "verified")):
            candidates = find_candidates(steep, driver=Freedom(table=table), derived=derived)
            assert verdict_of(picture, candidates, explain=False).verdict == expected

    def test_the_text_alone_verifies_it(self, renderer: Renderer) -> None:
        verdict = glshade.verify(scene(), renderer=renderer, derived=True)
        assert verdict.verdict == "verified", str(verdict)


class TestFiles:
    """The file that a material names."""

    def toml(self, folder: Path, file: str) -> Path:
        path = folder / "scene.toml"
        path.write_text(
            f'objects = [{{ shape = "sphere", material = "paint" }}]\nlights = [{json.dumps(SUN).replace(":", "=")}]\n'
            f'[materials]\npaint = {{ brdf = "measured", file = "{file}" }}\n',
            encoding="utf-8",
        )
        return path

    def test_a_missing_file_is_reported_at_its_place(self, tmp_path: Path) -> None:
        path = self.toml(tmp_path, "nowhere.binary")
        with pytest.raises(SceneError) as error:
            glshade.load(path)
        assert error.value.exit_code == 3
        assert str(error.value) == f"{path}: materials.paint.file: {tmp_path / 'nowhere.binary'} does not exist"

    @pytest.mark.parametrize("content", [b"", b"nonsense", b"\x08\0\0\0\x06\0\0\0\x0a\0\0\0" + bytes(100)])
    def test_a_damaged_file_is_reported_in_one_line_at_its_place(self, content: bytes, tmp_path: Path) -> None:
        (tmp_path / "damaged.binary").write_bytes(content)
        path = self.toml(tmp_path, "damaged.binary")
        with pytest.raises(SceneError) as error:
            glshade.load(path)
        assert len(error.value.problems) == 1
        assert f"materials.paint.file: {tmp_path / 'damaged.binary'}: " in str(error.value)

    def test_a_scene_made_in_python_reports_the_file_when_it_is_drawn(self, tmp_path: Path, renderer: Renderer) -> None:
        path = tmp_path / "damaged.binary"
        path.write_bytes(b"nonsense")
        with pytest.raises(AssetError, match=r"damaged\.binary: "):
            renderer.render(scene(file=path))

    def test_the_digest_is_that_of_the_content(self, tmp_path: Path) -> None:
        one, twin, other = (
            write_merl(tmp_path / f"{name}.binary", rough(seed)) for name, seed in (("a", 1), ("b", 1), ("c", 2))
        )
        assert scene_digest(scene(file=one)) == scene_digest(scene(file=twin)) != scene_digest(scene(file=other))

    def test_dev_watches_it_even_while_it_is_missing(self, tmp_path: Path) -> None:
        assert tmp_path / "nowhere.binary" in leniently_named(self.toml(tmp_path, "nowhere.binary"))

    def test_dev_draws_a_copy_that_nobody_changes(self, tmp_path: Path) -> None:
        path = write_merl(tmp_path / "a.binary", rough(1))
        copy = write_merl(tmp_path / "copy.binary", rough(1))
        copied = with_pictures(scene(file=path), {path: copy}.__getitem__)
        assert {item.material.file for item in copied.objects} == {copy}
        unnamed = scene()
        assert with_pictures(unnamed, {}.__getitem__).objects[0].material is unnamed.objects[0].material

    def test_without_a_file_it_is_the_sample(self) -> None:
        l, v = directions(32, 1), directions(32, 2)
        assert np.array_equal(evaluate(material(), l, v), evaluate(material(file=SAMPLE), l, v))
        blue = evaluate(material(), l, v)
        assert np.all(blue[:, 2] >= blue[:, 0])


class TestPrograms:
    """The text of programs with and without a table."""

    def test_only_programs_that_read_a_table_declare_one(self, tmp_path: Path) -> None:
        programs = glshade.explain(scene()).programs
        assert ["u_reflectance" in _text(program) for program in programs] == [True]
        others = scene().model_copy(update={"lights": ()})
        ambient = Scene.model_validate(
            {"objects": [{"shape": "sphere", "material": {"brdf": "measured", "ka": 0.5}}], "lights": [{"type": "ambient"}]}
        )
        plain = Scene.model_validate({"objects": [{"shape": "sphere", "material": {"brdf": "ggx"}}], "lights": [SUN]})
        for other in (ambient, plain, others.model_copy(update={"lights": ambient.lights})):
            assert not any("sampler3D" in _text(program) for program in glshade.explain(other).programs)

    def test_materials_of_one_kind_share_a_program(self, tmp_path: Path) -> None:
        paths = [write_merl(tmp_path / f"{seed}.binary", rough(seed)) for seed in (1, 2)]
        objects = [{"shape": "sphere", "material": {"brdf": "measured", "file": path}} for path in paths]
        both = Scene.model_validate({"objects": objects, "lights": [SUN]})
        assert len(glshade.explain(both).programs) == 1

    def test_explain_says_what_the_table_says(self, monkeypatch: pytest.MonkeyPatch) -> None:
        table = of_function(lambda l, v: np.full_like(l, 0.3), size=(4, 4, 4), digest="flat", notes=("Nothing was measured.",))
        in_memory(monkeypatch, table)
        assert ("Nothing was measured", "ball") in glshade.explain(scene()).reasons


def _text(program: Any) -> str:
    source = generate(program)
    return "".join(stage.text for stage in source.stages)
