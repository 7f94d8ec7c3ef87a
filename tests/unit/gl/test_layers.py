"""Layers: they add up to the picture, agree with the float64 reference, and have their usual names in files."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO as oiio
import pytest
from pydantic import ValidationError

import glshade as g
from glshade import reference
from glshade.assembly.part import Part
from glshade.image.cryptomatte import id_floats
from glshade.image.layers import AOVS, CHANNELS, Layers
from glshade.verification.candidates import surfaces

SIZE = (96, 64)
CAMERA = {"type": "perspective", "eye": (0.6, 1.4, 4.0), "target": (0.0, 0.0, 0.0), "fov": 40}
LIGHTS = [
    {"type": "directional", "name": "key light", "direction": (-0.4, -0.6, -0.7), "colour": (1.0, 0.9, 0.8)},
    {"type": "point", "position": (2.0, 2.0, 2.0), "intensity": -0.7},
    {"type": "ambient", "name": "ambient", "intensity": 0.1, "colour": (0.5, 0.7, 1.0)},
]
BALL = {"type": "sphere", "segments": 24, "rings": 12}


def picture(folder: Path, name: str, alpha: bool = False) -> Path:
    """Returns a small coloured picture; with alpha, every other stripe is transparent."""
    y, x = np.mgrid[0:16, 0:16]
    pixels = np.stack([40 + 13 * x, 60 + 11 * y, 128 + 0 * x, np.where(x // 4 % 2, 0, 255)], axis=2).astype(np.uint8)
    g.Image(pixels[..., : 4 if alpha else 3], "srgb").save(folder / name)
    return folder / name


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Any:
    """A function that makes a scene, whose keyword arguments are settings of the film.

    The scene has several models and rates, textures, bumps, a cut-out, and lights with and without names.
    """
    folder = tmp_path_factory.mktemp("pictures")
    colour = picture(folder, "colour.png")
    cut = {"texture": picture(folder, "cut.png", alpha=True)}
    objects: list[dict[str, Any]] = [
        {
            "name": "left",
            "material": {"brdf": "ggx", "kd": {"texture": colour}, "metallic": 0.4, "roughness": 0.4},
            "transform": {"translate": (-1.2, 0, 0)},
        },
        {
            "name": "middle",
            "material": "red",
            "shading": "gouraud",
            "transform": {"translate": (0, 0, 0), "scale": (0.8, 1.0, 0.8)},
        },
        {
            "material": {"brdf": "principled", "kd": 0.5, "clearcoat": 0.5, "bump_map": {"texture": colour}},
            "transform": {"translate": (1.2, 0, 0)},
        },
        {
            "name": "cut",
            "shape": "plane",
            "material": {"brdf": "plastic", "kd": cut, "alpha_mode": "mask"},
            "shading": "flat",
            "transform": {"translate": (0, 0.2, 1.4), "rotate": (70, 0, 0), "scale": (1.6, 1.0, 0.5)},
        },
    ]
    objects = [{"shape": BALL, **item} for item in objects]
    red = {"brdf": "phong", "kd": (0.6, 0.1, 0.05), "ks": 0.4, "exponent": 20.0, "ka": (0.5, 0.5, 0.5)}

    def make(lights: Any = LIGHTS, camera: Any = CAMERA, **film: Any) -> g.Scene:
        # A textured surface has no spectrum.
        aovs = [name for name in AOVS if name != "spectrum"]
        film = {"size": SIZE, "background": (0.1, 0.2, 0.3), "aovs": aovs, **film}
        return g.Scene.model_validate(
            {"film": film, "camera": camera, "objects": objects, "lights": lights, "materials": {"red": red}}
        )

    return make


def deviations(made: Layers) -> tuple[float, float]:
    """Returns (lobes, lights): the largest difference between the sum of the layers and the picture, relative to its largest
    value.
    """
    beauty, arrays = made.image.pixels[..., :3].astype(np.float64), made.arrays
    lights = [array for name, array in arrays.items() if name.startswith("light_")]
    lobes = arrays["diffuse"].astype(np.float64) + arrays["specular"] + arrays["background"] - beauty
    apart = np.sum(lights, axis=0, dtype=np.float64) + arrays["background"] - beauty
    brightest = float(np.abs(beauty).max())
    return float(np.abs(lobes).max()) / brightest, float(np.abs(apart).max()) / brightest


def alone(scene: g.Scene) -> g.Scene:
    """Returns the scene reduced to its first object, which needs fewer programs."""
    return scene.model_copy(update={"objects": scene.objects[:1]})


SUMS = ("diffuse", "specular", "lights", "background")
# The tolerances of the sums. The diffuse lobe is a difference of float32 numbers. Each light is drawn by its own program, which
# may round the edge of a highlight differently.
LOBES, APART = 2e-7, 1e-5


@pytest.mark.parametrize(
    ("shading", "film"),
    [
        (None, {}),
        ("gouraud", {"samples": 4}),
        ("flat", {"samples": 2, "supersample": 2, "exposure": 3.5, "background": (0.1, 0.2, 0.3, 0.5)}),
    ],
    ids=["as the objects say", "several samples", "supersampled, exposed, with alpha"],
)
def test_lobes_and_lights_add_up(renderer: g.Renderer, scene: Any, shading: Any, film: Any) -> None:
    made = renderer.layers(scene(**film, aovs=SUMS), shading=shading)
    lobes, apart = deviations(made)
    assert lobes <= LOBES
    assert apart <= APART
    assert made.arrays["specular"].max() > 0.05
    assert made.arrays["light_1"].min() < -0.01, "negative light is in its layer as it is"
    assert not np.allclose(made.arrays["diffuse"], made.arrays["light_key_light"])


@pytest.mark.parametrize("count", [12, 300])
def test_many_lights_add_up(renderer: g.Renderer, scene: Any, count: int) -> None:
    generator = np.random.default_rng(count)
    lights = [
        {"type": "point", "position": tuple(p), "intensity": float(i)}
        for p, i in zip(generator.uniform(-3, 3, (count, 3)), generator.uniform(-1, 3, count) / count, strict=True)
    ]
    made = renderer.layers(alone(scene(lights, size=(24, 16), aovs=SUMS)))
    assert sum(name.startswith("light_") for name in made.arrays) == count
    lobes, apart = deviations(made)
    assert lobes <= LOBES
    assert apart <= APART


def test_the_default_lights_have_names(renderer: g.Renderer, scene: Any) -> None:
    made = renderer.layers(alone(scene(None, aovs=SUMS)))
    assert {"light_key", "light_fill", "light_ambient"} <= set(made.arrays)
    assert deviations(made)[1] <= APART


@pytest.mark.filterwarnings("ignore::glshade.gl.preparation.ApproximateWarning")
def test_blended_surfaces_add_up_too(renderer: g.Renderer) -> None:
    glass = {"brdf": "blinn_phong", "kd": 0.5, "ks": 0.5, "alpha": 0.4, "alpha_mode": "blend"}
    objects = [
        {"shape": BALL, "name": "behind", "material": {"brdf": "lambert", "kd": (0.1, 0.7, 0.2)}},
        {"shape": BALL, "name": "glass", "material": glass, "transform": {"translate": (0.4, 0, 1)}},
    ]
    film = {"size": SIZE, "background": (0.5, 0.4, 0.3), "aovs": (*SUMS, "depth", "object_id", "albedo")}
    made = renderer.layers(g.Scene.model_validate({"film": film, "camera": CAMERA, "objects": objects, "lights": LIGHTS}))
    assert max(deviations(made)) <= APART
    # The background layer has the background that is visible through the glass.
    number = made.arrays["object_id"][..., 0]
    through = made.arrays["background"][number == 2]
    assert np.any(np.isclose(through[:, 0], 0.5 * 0.6**2)), "front and back each let 60 % through"
    assert set(np.unique(number)) == {0, 1, 2}
    # Glass counts as opaque in the depth layer: its depth is less than that of the ball behind it.
    assert made.arrays["depth"][number == 2].min() < made.arrays["depth"][number == 1].min()


def test_storage_is_of_the_picture_alone(renderer: g.Renderer, scene: Any) -> None:
    plain = renderer.layers(alone(scene(aovs=SUMS)))
    coarse = alone(scene(aovs=SUMS))
    coarse = coarse.model_copy(update={"quality": coarse.quality.model_copy(update={"storage": "rgba8"})})
    made = renderer.layers(coarse)
    assert np.array_equal(made.arrays["diffuse"], plain.arrays["diffuse"])
    assert not np.array_equal(made.image.pixels, plain.image.pixels)


# The largest difference of each part from the reference, at pixels where no driver could see another surface. That of depth and
# uv comes from snapping corners to 1/256 pixel; that of textured parts from texture filters with weights of 8 bits.
TOLERANCE = {"depth": 2e-3, "uv": 2e-3, "normal": 2e-2, "dark": 1e-6, "albedo": 0.1, "specular": 0.1, "light": 0.1}


@pytest.mark.parametrize("shading", [None, "flat", "gouraud"])
def test_parts_are_the_reference_s(renderer: g.Renderer, scene: Any, shading: Any) -> None:
    plain = scene()
    _, certain = surfaces(plain)
    assert certain.mean() > 0.8
    for kind, enough in TOLERANCE.items():
        part = Part(kind)  # type: ignore[arg-type]
        (drawn,) = renderer.draw_part(plain, part, shading=shading)
        expected = reference.radiance(plain, shading=shading, part=part)
        difference = np.abs(drawn - expected)[certain]
        assert difference.max() <= enough, kind
        assert np.median(difference) <= 2e-6, kind
        assert expected[certain][:, :3].any(), kind


def test_places(renderer: g.Renderer, scene: Any) -> None:
    """Depth, position, normals and ids of a ball in front of a wall that faces the viewer have their geometric values."""
    objects = [
        {"shape": "plane", "name": "wall", "transform": {"rotate": (90, 0, 0), "translate": (0, 0, -2), "scale": (9, 1, 9)}},
        {"shape": {"type": "sphere", "segments": 128, "rings": 64}, "name": "ball", "material": "gold"},
    ]
    aovs = ("depth", "position", "normal", "view_normal", "object_id", "material_id", "uv")
    eye = np.array([0.0, 0.0, 5.0])
    for camera in ({"type": "perspective", "fov": 40}, {"type": "orthographic", "height": 3.0}):
        table = {
            "film": {"size": (65, 49), "aovs": aovs},
            "camera": {**camera, "eye": tuple(eye), "target": (0, 0, 0)},
            "objects": objects,
        }
        made = renderer.layers(g.Scene.model_validate(table))
        layer = made.arrays
        number = layer["object_id"][..., 0]
        wall, ball = number == 1, number == 2
        assert np.array_equal(wall, ~ball)
        assert ball.any()
        assert wall.any()
        assert json.loads(made.attributes["glshade:object_id"]) == ["wall", "ball"]
        assert json.loads(made.attributes["glshade:material_id"]) == ["default", "gold"]
        assert np.array_equal(layer["material_id"], layer["object_id"])
        assert layer["depth"][wall] == pytest.approx(7.0, abs=1e-5)
        assert layer["depth"][24, 32, 0] == pytest.approx(4.0, abs=1e-3)
        # The ball has radius 1 and its centre at the origin, so its normals equal its positions.
        place, normal = layer["position"], layer["normal"]
        assert np.linalg.norm(place[ball], axis=1) == pytest.approx(1.0, abs=2e-3)
        assert normal[ball] == pytest.approx(place[ball], abs=5e-3)
        assert place[wall][:, 2] == pytest.approx(-2.0, abs=1e-5)
        assert normal[wall] == pytest.approx(np.broadcast_to([0, 0, 1], normal[wall].shape), abs=1e-6)
        assert (eye[2] - place[..., 2]) == pytest.approx(layer["depth"][..., 0], abs=1e-5)
        assert np.array_equal(layer["view_normal"], normal), "this camera looks along -z"
        # Row 0 is the top, and x grows to the right.
        assert place[0, 32, 1] > 0 > place[-1, 32, 1]
        assert place[24, 0, 0] < 0 < place[24, -1, 0]
        assert layer["uv"].min() >= 0
        assert layer["uv"].max() <= 1


def test_view_normals_are_the_camera_s(renderer: g.Renderer, scene: Any) -> None:
    made = renderer.layers(scene(aovs=("normal", "view_normal", "depth")))
    normal, view = made.arrays["normal"], made.arrays["view_normal"]
    there = made.arrays["depth"][..., 0] > 0
    assert np.linalg.norm(normal[there], axis=1) == pytest.approx(1.0, abs=1e-6)
    assert not normal[~there].any()
    assert not view[~there].any()
    assert np.linalg.norm(view[there], axis=1) == pytest.approx(1.0, abs=1e-6)
    # The nearest point of the ball in the middle faces the eye.
    assert view[..., 2].max() > 0.99


def test_both_sides_look_at_the_viewer(renderer: g.Renderer) -> None:
    for shading in ("flat", "gouraud", "phong"):
        for turn in (0, 180):
            table = {
                "film": {"size": (8, 8), "aovs": ("normal",)},
                "camera": {"type": "perspective", "eye": (0, 3, 0), "target": (0, 0, 0), "up": (0, 0, 1)},
                "objects": [{"shape": "plane", "shading": shading, "transform": {"rotate": (turn, 0, 0)}}],
            }
            normal = renderer.layers(g.Scene.model_validate(table)).arrays["normal"]
            assert normal[4, 4] == pytest.approx([0, 1, 0], abs=1e-6), (shading, turn)


@pytest.mark.parametrize("size", [1.0, 1e-20, 1e20])
@pytest.mark.parametrize("kind", ["perspective", "orthographic"])
def test_depth_is_in_the_scene_s_own_unit(renderer: g.Renderer, size: float, kind: str) -> None:
    table = {
        "film": {"size": (9, 9), "aovs": ("depth", "position")},
        "camera": {"type": kind, "eye": (0, 0, 4 * size), "target": (0, 0, 0)},
        "objects": [{"shape": {"type": "cube"}, "transform": {"scale": size}}],
    }
    scene = g.Scene.model_validate(table)
    made = renderer.layers(scene)
    front = made.arrays["position"][4, 4, 2]
    assert made.arrays["depth"][4, 4, 0] == pytest.approx(4 * size - front, rel=1e-5)
    assert front == pytest.approx(size * (front / size), rel=1e-6)
    assert 0.1 < front / size < 2
    depth, number = renderer.surfaces(scene)
    assert np.array_equal(depth, made.arrays["depth"][..., 0])
    assert number[4, 4] == 0
    assert number[0, 0] in (-1, 0)


def test_layers_of_a_crop_are_the_crop_of_the_layers(renderer: g.Renderer, scene: Any) -> None:
    x, y, w, h = box = (10, 20, 33, 21)
    whole, part = renderer.layers(scene()), renderer.layers(scene(crop=box))
    assert set(whole.arrays) == set(part.arrays)
    for name, array in part.arrays.items():
        assert array.shape[:2] == (h, w)
        assert np.allclose(array, whole.arrays[name][y : y + h, x : x + w], rtol=1e-6, atol=1e-6), name
    tiled = renderer.layers(scene(), tile=24)
    for name, array in tiled.arrays.items():
        # Vertices are rounded anew in each tile, which moves a silhouette by less than a pixel.
        same = np.isclose(array, whole.arrays[name], rtol=1e-3, atol=1e-3).all(axis=2)
        assert same.mean() > 0.97, name


def test_masks_cover_what_the_picture_covers(renderer: g.Renderer, scene: Any) -> None:
    made = renderer.layers(scene(supersample=4, background=(0, 0, 0, 0), aovs=("cryptomatte",)))
    names = {"CryptoObject": ["left", "middle", "objects[2]", "cut"], "CryptoMaterial": ["left", "red", "objects[2]", "cut"]}
    for layer, expected in names.items():
        pairs = np.concatenate([made.arrays[f"{layer}{i:02}"] for i in range(3)], axis=2)
        assert np.array_equal(pairs[..., 1::2].sum(axis=2), made.image.pixels[..., 3])
        assert set(np.unique(pairs[..., 0::2])) == {0, *id_floats(expected)}
        (prefix,) = (key.removesuffix("name") for key, value in made.attributes.items() if value == layer)
        assert list(json.loads(made.attributes[f"{prefix}manifest"])) == expected
    # The masks have 16 samples per pixel even if the picture has one.
    made = renderer.layers(scene(aovs=("cryptomatte",)))
    shares = made.arrays["CryptoObject00"][..., 1]
    assert np.array_equal(np.unique(shares * 16), np.unique(np.round(shares * 16)))
    assert np.any((shares > 0) & (shares < 1))


def test_an_exr_file_holds_all(renderer: g.Renderer, scene: Any, tmp_path: Path) -> None:
    made = renderer.layers(scene(background=(0, 0, 0, 0), crop=(8, 4, 40, 30)))
    made.save(tmp_path / "a.exr", {"glshade:digest": "abc"})
    assert [path.name for path in tmp_path.iterdir()] == ["a.exr"]
    source = oiio.ImageInput.open(str(tmp_path / "a.exr"))
    spec = source.spec()
    assert (spec.x, spec.y, spec.full_width, spec.full_height) == (8, 4, *SIZE)
    assert {*"RGBA", "depth.Z", "normal.X", "view_normal.Z", "position.Y", "uv.U", "uv.V", "albedo.R", "object_id.I"} <= set(
        spec.channelnames
    )
    assert {"material_id.I", "light_key_light.R", "light_1.B", "CryptoObject00.R", "CryptoMaterial02.A"} <= set(
        spec.channelnames
    )
    # A name has at most one dot: compositing programs read the text before it as a layer, and one letter after it as a channel.
    assert all(len(name.split(".")[-1]) == 1 and name.count(".") <= 1 for name in spec.channelnames)
    pixels = source.read_image(oiio.FLOAT)
    read = {name: pixels[..., i] for i, name in enumerate(spec.channelnames)}
    assert np.array_equal(np.stack([read[c] for c in "RGBA"], axis=2), made.image.pixels)
    written = [
        (name, letter, array[..., i]) for name, array in made.arrays.items() for i, letter in enumerate(_letters(name, array))
    ]
    assert len(written) == len(made.channels) == len(spec.channelnames) - 4
    for name, letter, values in written:
        assert np.array_equal(read[f"{name}.{letter}"].view(np.uint32), values.view(np.uint32)), (
            f"{name}.{letter}: not to the bit"
        )
    saved = {item.name: item.value for item in spec.extra_attribs}
    assert saved["glshade:digest"] == "abc"
    assert saved["cryptomatte/3ae39a5/name"] == "CryptoObject"
    assert set(json.loads(saved["cryptomatte/3ae39a5/manifest"])) == {"left", "middle", "objects[2]", "cut"}


def _letters(name: str, array: Any) -> str:
    return CHANNELS.get(name, "RGBA")[: array.shape[2]]


def test_layers_lie_beside_a_picture_of_8_bits(
    renderer: g.Renderer, scene: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    import os

    made = renderer.layers(scene(aovs=("depth", "normal")), dtype="uint8")
    assert made.image.pixels.dtype == np.uint8
    order = []
    replace = os.replace
    monkeypatch.setattr(os, "replace", lambda a, b: (order.append(Path(b).name), replace(a, b))[1])
    made.save(tmp_path / "a.png", {"glshade:digest": "abc"})
    assert order == ["a.aovs.exr", "a.png"], "the picture is the mark of being done"
    assert oiio.ImageInput.open(str(tmp_path / "a.aovs.exr")).spec().channelnames == (
        "depth.Z",
        "normal.X",
        "normal.Y",
        "normal.Z",
    )
    from glshade.image.file import attributes

    assert attributes(tmp_path / "a.png")["glshade:digest"] == "abc"
    # Without layers, only the picture is written.
    renderer.layers(scene(aovs=())).save(tmp_path / "b.png")
    assert not (tmp_path / "b.aovs.exr").exists()


def test_same_scene_same_bytes(renderer: g.Renderer, scene: Any, tmp_path: Path) -> None:
    for name in ("a.exr", "b.exr"):
        renderer.layers(scene(size=(32, 24))).save(tmp_path / name)
    assert (tmp_path / "a.exr").read_bytes() == (tmp_path / "b.exr").read_bytes()


def test_lights_of_one_name_and_odd_names(renderer: g.Renderer, scene: Any) -> None:
    lights = [{"type": "ambient", "name": name, "intensity": 0.1} for name in ("a.b", "a b", "ä", "1")]
    made = renderer.layers(
        scene([*lights, {"type": "ambient", "name": "a_b", "intensity": 0.1}], aovs=("lights",), size=(8, 8))
    )
    assert list(made.arrays) == ["light_a_b", "light_a_b_1", "light__", "light_1", "light_a_b_4"]


def test_a_wrong_name_is_reported() -> None:
    with pytest.raises(ValidationError, match="unknown layer 'dept'; did you mean \"depth\""):
        g.Film(aovs=("dept",))  # type: ignore[arg-type]
    assert g.Film(aovs=["depth"]).aovs == ("depth",)  # type: ignore[arg-type]


def test_every_layer_is_explained() -> None:
    page = (Path(g.__file__).parent.parent / "docs" / "layers.md").read_text(encoding="utf-8")
    for name in AOVS:
        assert f"`{name}`" in page, name


@pytest.mark.parametrize("shading", [None, "flat", "gouraud"])
def test_parts_hold_only_what_they_use(renderer: g.Renderer, scene: Any, shading: Any) -> None:
    from glshade.gl.activity import active
    from glshade.glsl.generator import generate
    from glshade.glsl.interface import declared
    from glshade.glsl.planner import plan_instance
    from glshade.radiance.readying import ready

    for kind in ("depth", "uv", "normal"):
        assembly = Part(kind).of(ready(scene(), shading))  # type: ignore[arg-type]
        for source in {generate(plan_instance(instance, assembly, "linear")) for instance in assembly.instances}:
            assert declared(source).names == active(source, renderer.context).names, (kind, source.vertex.text)
            text = source.vertex.text + (source.fragment.text if source.fragment else "")
            assert "brdf_cos" not in text
            assert "illuminate" not in text
