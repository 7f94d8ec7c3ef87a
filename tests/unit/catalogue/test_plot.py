"""Plots: their data, their pictures, the figures, and the command `glshade plot`."""

from __future__ import annotations

import sys
import warnings
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest

import glshade
from glshade import BRDFS, evaluate
from glshade.brdfs import Brdf
from glshade.catalogue import figures as plots
from glshade.catalogue import lobe, pictures
from glshade.catalogue.albedo import directional_albedo
from glshade.image import file as picture_file

THIRTY, SIXTY = np.radians(30), np.radians(60)
SCENE = """
objects = [{ name = "ball", shape = "sphere", material = { brdf = "lambert", kd = 0.25 } }]
[materials]
red = { brdf = "phong", kd = [0.5, 0.1, 0.1], exponent = 7, alpha = 0.5, alpha_mode = "blend" }
wood = { brdf = "lambert", kd = { texture = "t.png" } }
"""


def make(name: str, **parameters: Any) -> Brdf:
    """Returns a material of the model `name`."""
    return BRDFS[name](**parameters)


@pytest.fixture
def run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Any:
    """A function that runs glshade with arguments in a folder with s.toml, and returns (exit code, stdout, stderr)."""
    glshade.Image(np.zeros((2, 2, 3), dtype=np.uint8)).save(tmp_path / "t.png")
    (tmp_path / "s.toml").write_text(SCENE)
    monkeypatch.chdir(tmp_path)

    def run(*arguments: object) -> tuple[int, str, str]:
        from glshade.cli import run as main

        monkeypatch.setattr(sys, "argv", ["glshade", *map(str, arguments)])
        with pytest.raises(SystemExit) as exit:
            main()
        return int(exit.value.code or 0), *capsys.readouterr()

    # main() redirects warnings to stderr, which must not last beyond the test.
    with warnings.catch_warnings():
        yield run


def written(folder: Path) -> list[str]:
    """Returns the names of the files in a folder that were not there before."""
    return sorted(path.name for path in folder.iterdir() if path.name not in {"s.toml", "t.png"})


class TestSlices:
    """The functions lobe.polar_slice and lobe.surface."""

    @pytest.mark.parametrize("name", BRDFS)
    def test_every_model(self, name: str) -> None:
        for azimuth in (0.0, 0.7):
            angles, value = lobe.polar_slice(make(name), SIXTY, azimuth)
            assert angles[0] == -np.pi / 2
            assert angles[-1] == np.pi / 2
            assert np.all(np.diff(angles) > 0)
            assert np.all(np.isfinite(value))
            l, v = lobe.direction(-SIXTY, azimuth), lobe.direction(angles[::40], azimuth)
            np.testing.assert_allclose(value[::40], evaluate(make(name), l, v), rtol=1e-3, atol=1e-5)

    def test_light_comes_from_the_left_and_its_mirror_direction_is_on_the_right(self) -> None:
        np.testing.assert_allclose(lobe.direction(-THIRTY), [-0.5, 0, np.sqrt(0.75)], atol=1e-15)
        np.testing.assert_allclose(lobe.direction(THIRTY, np.pi / 2), [0, 0.5, np.sqrt(0.75)], atol=1e-15)
        for name, peak in (("phong_normalised", SIXTY), ("retro_phong", -SIXTY)):
            angles, value = lobe.polar_slice(make(name, exponent=1000), SIXTY)
            assert angles[value[:, 0].argmax()] == pytest.approx(peak, abs=1e-3)

    @pytest.mark.parametrize("exponent", [1, 1e3, 1e6, 1e8])
    def test_no_lobe_is_too_narrow(self, exponent: float) -> None:
        angles, value = lobe.polar_slice(make("phong_normalised", kd=0, ks=1, exponent=exponent), SIXTY)
        peak = (exponent + 2) / (2 * np.pi) * 0.5
        assert value.max() == pytest.approx(peak, rel=1e-6)
        assert np.count_nonzero(value[:, 0] > peak / 2) > 20
        # cos^p is 1/2 at sqrt(2 ln 2/p) from the peak. The width of the curve agrees within a tenth.
        if exponent > 1:
            over = angles[value[:, 0] > peak / 2]
            assert np.ptp(over) == pytest.approx(2 * np.sqrt(2 * np.log(2) / exponent), rel=0.1)

    def test_the_quantity(self) -> None:
        _, leaving = lobe.polar_slice(make("lambert", kd=0.5), SIXTY)
        assert leaving[100:-100] == pytest.approx(0.5 / np.pi * 0.5)
        _, bare = lobe.polar_slice(make("lambert", kd=0.5), SIXTY, quantity="f")
        assert bare[100:-100] == pytest.approx(0.5 / np.pi)
        with pytest.raises(ValueError, match="less than 90 degrees"):
            lobe.polar_slice(make("lambert"), np.pi / 2)

    def test_azimuth(self) -> None:
        wide = make("ward", kd=0, alpha_x=0.5, alpha_y=0.1)
        along, across = (lobe.polar_slice(wide, 0.0, azimuth) for azimuth in (0.0, np.pi / 2))
        values = [np.interp(0.3, angles, value[:, 0]) for angles, value in (along, across)]
        assert values[0] > 5 * values[1] > 0

    @pytest.mark.parametrize("azimuth", [0.0, 1.0])
    def test_a_surface_is_the_same_lobe(self, azimuth: float) -> None:
        material = make("ward", alpha_x=0.3, alpha_y=0.1)
        found = lobe.surface(material, THIRTY, azimuth)
        # The plane of incidence is y = 0 for every azimuth.
        flat = np.abs(found.directions[:, 1]) < 1e-12
        angles, value = lobe.polar_slice(material, THIRTY, azimuth)
        theta = np.arctan2(found.directions[flat, 0], found.directions[flat, 2])
        inner = np.abs(theta) < 1.5
        np.testing.assert_allclose(found.values[flat][inner, 0], np.interp(theta[inner], angles, value[:, 0]), rtol=0.02)

    def test_a_surface_is_seen_from_outside(self) -> None:
        found = lobe.surface(make("lambert", kd=1), THIRTY)
        vertices = found.vertices(np.ones(len(found.directions)))
        a, b, c = vertices[found.triangles].transpose(1, 0, 2)
        volumes = np.einsum("ij,ij->i", a, np.cross(b, c)) / 6
        assert volumes.min() > -1e-15
        assert volumes.sum() == pytest.approx(2 / 3 * np.pi, rel=1e-3)

    def test_unbounded_lobes(self) -> None:
        unbounded = {name for name in BRDFS if lobe.unbounded(make(name), SIXTY)}
        assert {"ward", "ward_duer", "minnaert"} <= unbounded
        assert not unbounded & {"lambert", "phong", "ggx", "metal", "ward_gmd", "ashikhmin_shirley"}
        angles = np.radians([-89, 0, 50, 86])
        assert lobe.drawn_height(angles, np.array([9.0, 1, 2, 8]), True) == 2
        assert lobe.drawn_height(angles, np.array([9.0, 1, 2, 8]), False) == 9


class TestCurves:
    """The functions lobe.albedo_curve, lobe.furnace and lobe.fresnel_curves."""

    @pytest.mark.parametrize("name", BRDFS)
    def test_albedo_of_every_model(self, name: str) -> None:
        angles, value = lobe.albedo_curve(make(name), 0.3, count=4)
        np.testing.assert_allclose(value, directional_albedo(make(name), lobe.direction(angles, 0.3), within=1e-6), atol=1e-3)

    def test_a_white_lambert_looks_like_the_sky_of_a_furnace(self) -> None:
        found, coverage = lobe.furnace(make("lambert", kd=1), 24)
        assert found == pytest.approx(1, abs=1e-3)
        assert coverage[0, 0] == 0
        assert coverage[12, 12] == 1
        # The sphere is a disc with a radius of 0.92 of half the picture.
        assert coverage.mean() == pytest.approx(np.pi / 4 * 0.92**2, abs=5e-3)

    def test_a_furnace_with_tangents(self) -> None:
        size = 24
        material = make("ward", kd=0.0, ks=0.5, alpha_x=0.6, alpha_y=0.05)
        found, _ = lobe.furnace(material, size)
        for row, column in ((12, 12), (6, 12), (12, 6), (5, 15), (19, 7)):
            x, y = ((column + 0.5) * 2 / size - 1) / 0.92, (1 - (row + 0.5) * 2 / size) / 0.92
            n = np.array([x, y, np.sqrt(1 - x * x - y * y)])
            t = np.cross([0, 1, 0], n) / np.linalg.norm(np.cross([0, 1, 0], n))
            v = np.stack([t, np.cross(n, t), n])[:, 2]
            assert found[row, column] == pytest.approx(directional_albedo(material, v), rel=0.02), (row, column)

    def test_fresnel(self) -> None:
        exact, schlick = lobe.fresnel_curves(make("metal", eta=(0.2, 1.0, 1.5), k=(3.0, 2.0, 0.0)))
        assert (exact.kind, schlick.kind) == ("exact", "schlick")
        for curve in (exact, schlick):
            assert curve.reflectance[0] == pytest.approx([(0.64 + 9) / (1.44 + 9), 4 / 8, 0.04])
            assert curve.reflectance[-1] == pytest.approx([1, 1, 1])
        # The exact curve of a conductor has a dip, and Schlick's has none.
        assert np.diff(exact.reflectance[:, 0]).min() < 0 <= np.diff(schlick.reflectance, axis=0).min()
        exact, schlick = lobe.fresnel_curves(make("plastic", ior=1.5))
        assert exact.reflectance[0] == pytest.approx([0.04] * 3)
        # The value is from Fresnel's equations, for light at 60 degrees from the normal.
        assert np.interp(SIXTY, exact.angles, exact.reflectance[:, 0]) == pytest.approx(0.0892, abs=1e-4)
        (curve,) = lobe.fresnel_curves(make("ggx", kd=(0.9, 0.6, 0.3), f0=0.1, metallic=0.5))
        assert curve.reflectance[0] == pytest.approx([0.5, 0.35, 0.2])
        (curve,) = lobe.fresnel_curves(make("ashikhmin_shirley", ks=0.3))
        assert curve.reflectance[0] == pytest.approx([0.3] * 3)
        for name in ("lambert", "phong", "retro_phong"):
            assert lobe.fresnel_curves(make(name)) == ()


class TestPictures:
    """The module pictures."""

    def test_a_sphere_shows_the_model(self, renderer: glshade.Renderer) -> None:
        material = make("phong_normalised", kd=0.3, ks=0.3, exponent=3)
        pixels = renderer.render(pictures.sphere(material, 65), dtype="float32").pixels
        l = np.array([-0.55, 0.6, 0.6]) / np.linalg.norm([0.55, 0.6, 0.6])
        assert pixels[32, 32, :3] == pytest.approx(np.pi * evaluate(material, l, [0, 0, 1]), rel=1e-3)
        assert pixels[0, 0].tolist() == [0, 0, 0, 0]

    def test_lobes_stand_where_they_should(self, renderer: glshade.Renderer) -> None:
        def blue(material: Brdf, **options: Any) -> Any:
            scene, _ = pictures.solid(material, np.radians(45), size=120, **options)
            pixels = renderer.render(scene, dtype="float32").pixels
            return pixels[..., 2] > 1.5 * pixels[..., 0] + 0.01

        mirror, retro, diffuse = (
            blue(make(name, **more))
            for name, more in (
                ("phong_normalised", {"kd": 0, "exponent": 50}),
                ("retro_phong", {"kd": 0, "exponent": 50}),
                ("lambert", {}),
            )
        )
        assert mirror[:, 62:].sum() > 50 > 5 * mirror[:, :58].sum()
        assert retro[:, :58].sum() > 50 > 5 * retro[:, 62:].sum()
        assert diffuse.sum() > 5 * mirror.sum()
        # On a logarithmic scale, a narrow lobe is wide.
        log = blue(make("phong_normalised", kd=0, exponent=50), scale="log")
        assert log.sum() > 2 * mirror.sum()
        assert not blue(make("ambient")).any()

    def test_a_lobe_has_its_own_colours_and_size(self) -> None:
        scene, most = pictures.solid(make("lambert", kd=(0.8, 0.4, 0.2)), SIXTY)
        mesh: Any = scene.objects[-1].mesh
        assert most == pytest.approx(0.8 / np.pi / 2)
        np.testing.assert_allclose(mesh.colours[:, :3], np.broadcast_to([1, 0.5, 0.25], (len(mesh.positions), 3)), atol=1e-6)
        assert np.linalg.norm(mesh.positions, axis=1).max() == pytest.approx(1, rel=1e-5)

    def test_radii(self) -> None:
        heights = np.array([0.0, 1e-9, 0.01, 1, 100, 1000])
        assert pictures.radii(heights, "linear", 100).tolist() == pytest.approx([0, 1e-11, 1e-4, 0.01, 1, 1])
        assert pictures.radii(heights, "log", 100).tolist() == pytest.approx([0, 0, 0, 0.5, 1, 1])
        assert pictures.radii(np.zeros(2), "log", 0).tolist() == [0, 0]

    def test_a_furnace_shows_lost_and_excess_light(self) -> None:
        for kd, centre in ((1.0, 0.5), (0.5, 0.25), (1.6, 0.8)):
            picture, (least, most) = pictures.furnace(make("phong", kd=kd, ks=0), 32)
            assert picture.pixels[16, 16] == pytest.approx(centre, rel=1e-3)
            assert picture.pixels[0, 0] == pytest.approx(0.5)
            assert (least, most) == pytest.approx((kd, kd), rel=1e-3)


class TestFigures:
    """The functions figures.figure and figures.save."""

    @pytest.mark.parametrize("kind", plots.KINDS)
    def test_every_kind(self, kind: plots.Kind, renderer: glshade.Renderer, tmp_path: Path) -> None:
        figure = plots.figure({"gold $1": make("metal")}, [kind], angles=[THIRTY], renderer=renderer)
        for suffix in (".png", ".svg"):
            plots.save(figure, tmp_path / f"x{suffix}")
        assert written(tmp_path) == ["x.png", "x.svg"]
        assert np.ptp(picture_file.read(tmp_path / "x.png")[0][..., :3]) > 0.9
        text = (tmp_path / "x.svg").read_text()
        assert ElementTree.fromstring(text).tag.endswith("svg")
        assert "gold" in text

    def test_materials_lie_over_each_other(self) -> None:
        both = {"a": make("lambert", kd=0.2), "b": make("lambert", kd=0.6)}
        figure = plots.figure(both, ["albedo", "polar"], angles=[0.0, THIRTY])
        titles = [axes.get_title() for axes in figure.axes]
        assert titles == ["Light at 0°", "Light at 30°", "Directional albedo"]
        (legend,) = figure.legends
        assert [text.get_text() for text in legend.get_texts()] == ["a", "b"]
        curves = figure.axes[-1].get_lines()[:2]
        assert [np.mean(line.get_ydata()) for line in curves] == pytest.approx([0.2, 0.6], rel=1e-3)
        colours = [line.get_color() for line in curves]
        assert colours == [handle.get_color() for handle in legend.get_lines()]
        assert len(set(colours)) == 2

    def test_a_colour_has_three_curves(self) -> None:
        figure = plots.figure({"a": make("lambert", kd=(0.8, 0.4, 0.2))}, ["albedo"])
        lines = {line.get_label(): line for line in figure.axes[-1].get_lines()}
        for name, kd in (("red", 0.8), ("green", 0.4), ("blue", 0.2)):
            assert np.mean(lines[name].get_ydata()) == pytest.approx(kd, rel=1e-3)
            colour = lines[name].get_color()
            assert np.argmax(colour) == ("red", "green", "blue").index(name)

    @pytest.mark.parametrize(("scale", "log"), [("auto", True), ("linear", False), ("log", True)])
    def test_the_scale_of_slices(self, scale: plots.Scale, log: bool) -> None:
        two = {"a": make("phong_normalised", ks=1, kd=0, exponent=500), "b": make("lambert")}
        figure = plots.figure(two, ["polar"], angles=[THIRTY], scale=scale)
        (axes,) = figure.axes
        assert ("log over 4 decades" in axes.get_xlabel()) == log
        radius = np.hypot(*axes.get_lines()[-1].get_data()).max()
        assert (radius > 0.3) == log
        assert "cut off" not in axes.get_xlabel()
        axes = plots.figure({"a": make("minnaert")}, ["polar"], angles=[THIRTY], quantity="f").axes[0]
        assert "cut off" in axes.get_xlabel()
        assert "cos" not in axes.get_xlabel()

    @pytest.mark.parametrize("scale", ["auto", "linear", "log"])
    @pytest.mark.parametrize("count", [1, 2])
    def test_materials_that_reflect_nothing(self, count: int, scale: plots.Scale, tmp_path: Path) -> None:
        """Every curve is drawn and lies at 0: a slice for each material and angle, and an albedo for each material."""
        angles = [0.0, THIRTY]
        black = {str(i): make("ambient") for i in range(count)}
        figure = plots.figure(black, ["polar", "albedo"], angles=angles, scale=scale)
        *polar, albedos = figure.axes
        # The lines of the grid and of the directions to the light have fewer points.
        curves = [line.get_xydata() for axes in polar for line in axes.get_lines() if len(line.get_xydata()) > 200]
        assert len(curves) == count * len(angles)
        assert not any(curve.any() for curve in curves)
        values = [line.get_ydata() for line in albedos.get_lines() if len(line.get_ydata()) > 2]
        assert len(values) == count
        assert not any(value.any() for value in values)
        plots.save(figure, tmp_path / "x.png")
        assert np.ptp(picture_file.read(tmp_path / "x.png")[0]) > 0.5

    def test_fresnel_of_a_model_without_a_fresnel_term(self) -> None:
        (axes,) = plots.figure({"a": make("lambert")}, ["fresnel"]).axes
        assert "no Fresnel" in axes.texts[0].get_text()

    def test_the_users_own_style_changes_nothing(self, tmp_path: Path) -> None:
        import matplotlib

        for name, size in (("a", 9), ("b", 30)):
            with matplotlib.rc_context({"font.size": size, "axes.labelsize": size, "lines.linewidth": size}):
                plots.save(plots.figure({"x": make("lambert")}, ["albedo"]), tmp_path / f"{name}.svg")
        assert (tmp_path / "a.svg").read_bytes() == (tmp_path / "b.svg").read_bytes()

    def test_files_that_cannot_be_written(self, tmp_path: Path) -> None:
        figure = plots.figure({"x": make("lambert")}, ["fresnel"])
        for path, message in (("x.gif", "cannot write a figure as .gif"), ("no/x.svg", "does not exist")):
            with pytest.raises(glshade.GlshadeError, match=message):
                plots.save(figure, tmp_path / path)
        (tmp_path / "x.svg").mkdir()
        with pytest.raises(glshade.GlshadeError, match=r"x\.svg: cannot be written: Is a directory"):
            plots.save(figure, tmp_path / "x.svg")
        assert written(tmp_path) == ["x.svg"]


class TestNames:
    """The names of materials on the command line."""

    @pytest.mark.parametrize(
        ("text", "label", "expected"),
        [
            ("phong", "phong", {"brdf": "phong"}),
            ("phong:exponent=7", "phong exponent 7", {"brdf": "phong", "exponent": 7}),
            ("phong:kd=0.6,0.1,.05,exponent=7", "phong kd 0.6, 0.1, 0.05 exponent 7", {"kd": (0.6, 0.1, 0.05), "exponent": 7}),
            ("phong:kd=[0.6,0.1,0.05]", "phong kd 0.6, 0.1, 0.05", {"kd": (0.6, 0.1, 0.05)}),
            ("metal:fresnel=schlick", "metal fresnel schlick", {"fresnel": "schlick"}),
            ("gold:roughness=0.25", "gold roughness 0.25", {"brdf": "metal", "roughness": 0.25, "k": (4.834, 2.196, 1.676)}),
            ("s.toml:red", "red", {"brdf": "phong", "exponent": 7, "alpha": 1, "alpha_mode": "opaque"}),
            ("s.toml:red:exponent=9", "red exponent 9", {"exponent": 9, "kd": (0.5, 0.1, 0.1)}),
            ("s.toml:ball", "ball", {"brdf": "lambert", "kd": (0.25,) * 3}),
            ("s.toml:wood:kd=0.5", "wood kd 0.5", {"kd": (0.5,) * 3}),
        ],
    )
    def test_a_material(self, text: str, label: str, expected: dict[str, Any], run: Any) -> None:
        from glshade.cli._material import materials

        ((found_label, material),) = materials([text]).items()
        assert found_label == label
        assert {key: getattr(material, key) for key in expected} == expected

    def test_several_with_a_parameter_for_all(self, run: Any) -> None:
        from glshade.cli._material import materials

        found = materials(["phong", "phong:exponent=9", "s.toml:red"], ["exponent=4", "kd=0.5"])
        assert [(m.exponent, m.kd) for m in found.values()] == [(4, (0.5,) * 3), (9, (0.5,) * 3), (4, (0.5,) * 3)]  # type: ignore[attr-defined]
        assert list(materials(["s.toml"], ["kd=0.5"])) == ["red", "wood"]


class TestCommand:
    """The command `glshade plot`."""

    def test_writes_a_file_and_prints_its_path(self, run: Any, tmp_path: Path) -> None:
        assert run("plot", "phong:exponent=5", "gold", "-k", "fresnel", "-o", "x.svg") == (0, "x.svg\n", "")
        assert run("plot", "phong:exponent=5", "s.toml:red", "-k", "polar") == (
            0,
            "phong-exponent=5-s.toml-red.svg\n",
            "",
        )
        assert written(tmp_path) == ["phong-exponent=5-s.toml-red.svg", "x.svg"]

    def test_a_sheet_of_everything(self, run: Any, tmp_path: Path) -> None:
        assert run("plot", "plastic", "-o", "x.png", "--angles", "0,50", "--incidence", "30") == (0, "x.png\n", "")
        assert picture_file.read(tmp_path / "x.png")[0].shape[0] > 900

    @pytest.mark.parametrize("kind", ["lobe", "sphere", "furnace"])
    def test_bare_pictures(self, kind: str, run: Any, tmp_path: Path) -> None:
        assert run("plot", "lambert", "phong", "-k", kind, "--bare", "-o", "x.exr") == (0, "x.exr\n", "")
        height, width, _ = picture_file.read("x.exr")[0].shape
        assert (width, height) == ((1600, 600) if kind == "lobe" else (1024, 512))

    @pytest.mark.parametrize(
        ("arguments", "code", "message"),
        [
            ((), 2, "Missing argument 'MATERIAL...'"),
            (("fong",), 2, "no model or preset is named 'fong'; did you mean \"phong\"?"),
            (("goldd",), 2, "no model or preset is named 'goldd'; did you mean \"gold\"?"),
            (("phong:exponnt=3",), 2, "phong:exponnt=3: phong has no 'exponnt'; did you mean \"exponent\"?"),
            (("phong", "-p", "sigma=3"), 2, "phong has no 'sigma'; allowed: exponent, ka, kd, ks"),
            (("phong:3",), 2, "'3' must be NAME=VALUE"),
            (("phong", "-p", "3"), 2, "'--parameter': '3' must be NAME=VALUE"),
            (("phong:exponent=-3",), 2, "phong:exponent=-3: exponent must be at least 0, not -3"),
            (("phong:exponent=x",), 2, "exponent must be a number, not 'x'"),
            (("phong:exponent=nan",), 2, "nan is not a finite number"),
            (("phong:kd=1,2",), 2, "kd must be three numbers, or one that stands for three"),
            (("metal:fresnel=no",), 2, "'no' is not one of 'exact' or 'schlick'"),
            (("s.toml:rad",), 2, "s.toml: no material is named 'rad'; did you mean \"red\"?"),
            (("s.toml:wood",), 2, "s.toml:wood: kd is a texture; give a number in its place, as in s.toml:wood:kd=0.5"),
            (("none.toml:red",), 3, "none.toml: there is no such file"),
            (("phong", "--angles", "0,90"), 2, "must be from 0 to less than 90 degrees, not 90"),
            (("phong", "--angles", "a"), 2, "'a' is not a list of angles such as 0,30,60"),
            (("phong", "--azimuth", "nan"), 2, "must be finite"),
            (("phong", "-k", "polr"), 2, "'polr' is not one of"),
            (("phong", "--bare"), 2, "--bare needs one --kind that is a picture"),
            (("phong", "-o", "x.gif"), 1, "x.gif: cannot write a figure as .gif; allowed: .pdf, .png, .svg"),
            (("phong", "-k", "polar", "-o", "no/x.svg"), 1, "no/x.svg: the folder no does not exist; make it first"),
            (("phong", "--device", "99"), 5, "there is no EGL device 99"),
        ],
    )
    def test_faulty_arguments(self, arguments: tuple[str, ...], code: int, message: str, run: Any, tmp_path: Path) -> None:
        exit_code, out, err = run("plot", *arguments)
        assert (exit_code, out) == (code, "")
        assert message in err
        assert written(tmp_path) == []

    def test_without_matplotlib(self, run: Any, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setitem(sys.modules, "matplotlib", None)
        assert run("plot", "phong") == (2, "", "glshade: plots need matplotlib: pip install 'glshade[plot]'\n")
        # Pictures without axes do not need matplotlib.
        assert run("plot", "lambert", "-k", "furnace", "--bare", "-o", "x.png")[0] == 0

    def test_the_bytes_are_always_the_same(self, python: Any, tmp_path: Path) -> None:
        code = """
import sys
from glshade import BRDFS
from glshade.catalogue import figures as plots
figure = plots.figure({"gold": BRDFS["metal"]()}, ["furnace", "fresnel"])
for suffix in plots.SUFFIXES:
    plots.save(figure, sys.argv[1] + suffix)
"""
        python(code, "a", cwd=tmp_path, PYTHONHASHSEED="7")
        # This process has another hash seed, and other code has run before.
        figure = plots.figure({"gold": make("metal")}, ["furnace", "fresnel"])
        for suffix in plots.SUFFIXES:
            plots.save(figure, tmp_path / f"b{suffix}")
        for suffix in plots.SUFFIXES:
            assert (tmp_path / f"a{suffix}").read_bytes() == (tmp_path / f"b{suffix}").read_bytes(), suffix
        assert (tmp_path / "a.pdf").read_bytes()[:5] == b"%PDF-"
