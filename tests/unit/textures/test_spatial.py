"""Spatial variation: bump maps, direction maps, channels, and textures on every parameter of every model."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError
from support.unused import nothing_unused

from glshade import BRDFS, Image, Mesh, Renderer, Scene, SceneError, explain, reference, verify
from glshade.brdfs import Brdf
from glshade.glsl.generator import generate
from glshade.glsl.plan import ProgramPlan
from glshade.scene.object import Rate
from glshade.textures.texels import normals
from glshade.verification.mutations import Mutation

RATES: tuple[Rate, ...] = ("flat", "gouraud", "phong")
FRONT: dict[str, Any] = {"type": "orthographic", "eye": [0, 0, 5], "target": [0, 0, 0], "height": 2}
SUN = {"type": "directional", "direction": [-0.3, -0.5, -1]}
LIGHTS = [SUN, {"type": "point", "position": [1, 3, 2], "intensity": 0.7}, {"type": "ambient", "intensity": 0.1}]
# A low view over a floor to the horizon, so that textures are magnified in front and minified behind.
FLOOR = {"type": "perspective", "eye": [0.4, 0.6, 2.2], "target": [0, 0, 0], "fov": 50}
ROUNDING = 2e-6

Save = Callable[..., str]


@pytest.fixture(scope="session")
def picture(tmp_path_factory: pytest.TempPathFactory) -> Save:
    """A function that saves linear values without loss, with row 0 at the top, and returns the path of the file."""
    folder = tmp_path_factory.mktemp("pictures")

    def save(name: str, pixels: Any) -> str:
        pixels = np.asarray(pixels, dtype=np.float32)
        path = folder / f"{name}.exr"
        Image(np.repeat(pixels[..., None], 3, axis=2) if pixels.ndim == 2 else pixels).save(path)
        return str(path)

    return save


def grey(folder: Path, codes: Any) -> str:
    """Saves an 8-bit picture of these codes and returns its path."""
    pixels = np.asarray(codes, dtype=np.uint8)
    path = folder / "grey.png"
    Image(np.repeat(pixels[..., None], 3, axis=2) if pixels.ndim == 2 else pixels).save(path)
    return str(path)


def noise(shape: tuple[int, ...], low: float = 0.0, high: float = 1.0, seed: int = 0) -> Any:
    return np.random.default_rng(seed).uniform(low, high, shape)


def square(material: dict[str, Any], uvs: Any = ((0, 0), (1, 0), (1, 1), (0, 1))) -> dict[str, Any]:
    """Returns a square that fills the picture of a camera in front of it."""
    corners = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], dtype=float)
    mesh = Mesh.build(corners, np.array([[0, 1, 2], [0, 2, 3]]), uvs=np.array(uvs, dtype=float))
    return {"mesh": mesh, "material": material}


def floor(material: Any, rate: Rate, size: int = 48) -> Scene:
    """Returns a scene with a floor whose edges lie outside the picture."""
    shape = {"type": "plane", "segments": 12}
    item = {"shape": shape, "sides": "both", "transform": {"scale": 8}, "shading": rate, "material": material}
    film = {"size": (size, size)}
    return Scene.model_validate({"film": film, "camera": FLOOR, "objects": [item], "lights": LIGHTS})


def program(material: Any, **keys: Any) -> ProgramPlan:
    """Returns the plan of the only program of a scene with one object. keys: further keys of the object."""
    item = {"shape": "sphere", "material": material, **keys}
    (plan,) = explain(Scene.model_validate({"objects": [item], "lights": [SUN]})).programs
    return plan


def text(plan: ProgramPlan) -> str:
    """Returns the GLSL of both stages."""
    source = generate(plan)
    assert source.fragment is not None
    return source.vertex.text + source.fragment.text


def fault(material: dict[str, Any]) -> str:
    """Returns the only fault of a material, with its key path."""
    with pytest.raises(ValidationError) as caught:
        Scene.model_validate({"objects": [{"shape": "sphere", "material": material}]})
    (error,) = caught.value.errors()
    return f"{'.'.join(map(str, error['loc']))}: {error['msg']}"


class TestHeights:
    """Bump maps."""

    def lit(self, draw: Any, bumps: dict[str, Any], light: Any, size: int = 32, **more: Any) -> Any:
        lights = [{"type": "directional", "direction": [-c for c in light]}]
        return draw(square({"brdf": "lambert", "kd": 1, "bump_map": bumps}, **more), lights, (size, size), camera=FRONT)[..., 0]

    @pytest.mark.parametrize("rate", RATES)
    @pytest.mark.parametrize("axis", [0, 1])
    def test_a_slope_is_a_tilted_plane(self, axis: int, rate: Rate, draw: Any, picture: Save) -> None:
        """The normal of a slope of 0.5 is (-0.5, 0, 1) or (0, -0.5, 1), made unit. v runs upward, a file's rows downward."""
        along_u, along_v = np.meshgrid(np.arange(16) / 16, np.arange(16)[::-1] / 16)
        path = picture(f"slope{axis}", (along_u, along_v)[axis])
        tilt = np.array([-0.5, 0.0, 1.0] if axis == 0 else [0.0, -0.5, 1.0]) / math.hypot(0.5, 1)
        # The square shows the middle of the picture, because the slope is 0 at the border.
        uvs = ((0.25, 0.25), (0.75, 0.25), (0.75, 0.75), (0.25, 0.75))
        item = square({"brdf": "lambert", "kd": 1, "bump_map": {"texture": path, "height": 0.5, "wrap": "clamp"}}, uvs)
        for light in (tilt, (0.6, 0.0, 0.8), (0.0, -0.6, 0.8)):
            lights = [{"type": "directional", "direction": [-c for c in light]}]
            pixels = draw(item, lights, (32, 32), camera=FRONT, shading=rate)[..., 0]
            assert pixels == pytest.approx(float(np.dot(tilt, light)), abs=ROUNDING)

    def test_texels_are_square(self, picture: Save) -> None:
        """A picture twice as wide as high has the same slopes across and upward."""
        z = np.add.outer(np.arange(8), np.arange(16)) / 16.0
        n = normals(z.astype(np.float32), ("repeat", "repeat"))[3, 5]
        assert n == pytest.approx([0, 0])

    def test_white_stands_out(self, draw: Any, picture: Save) -> None:
        """A hill is bright on the side of the light. A pit is bright on the other side, like a hill of negative height."""
        y, x = np.mgrid[-1:1:64j, -1:1:64j]
        hill = np.clip(1 - 2 * (x * x + y * y), 0, 1)
        for heights, height, sign in ((hill, 0.2, 1), (1 - hill, 0.2, -1), (hill, -0.2, -1)):
            pixels = self.lit(draw, {"texture": picture("hill", heights), "height": height}, (-0.6, 0, 0.8), 64)
            assert sign * (pixels[:, 12:28].mean() - pixels[:, 36:52].mean()) > 0.1

    def test_integer_files_are_read_as_they_are(self, draw: Any, tmp_path: Path, picture: Save) -> None:
        codes = np.arange(0, 256, 16)[None].repeat(16, axis=0)
        bumps = {"height": 0.3, "wrap": "clamp"}
        encoded = self.lit(draw, {"texture": grey(tmp_path, codes), **bumps}, (-0.6, 0, 0.8))
        linear = self.lit(draw, {"texture": picture("codes", codes / 255), **bumps}, (-0.6, 0, 0.8))
        assert encoded == pytest.approx(linear, abs=ROUNDING)

    def test_heights_are_read_from_red(self, draw: Any, picture: Save) -> None:
        heights = noise((8, 8, 3))
        coloured = self.lit(draw, {"texture": picture("rgb", heights)}, (-0.6, 0, 0.8))
        red = self.lit(draw, {"texture": picture("red", heights[..., 0])}, (-0.6, 0, 0.8))
        assert np.ptp(coloured) > 0.1
        assert (coloured == red).all()

    @pytest.mark.parametrize("wrap", ["repeat", "clamp", "mirror"])
    def test_across_the_border(self, wrap: str) -> None:
        z = np.array([[0.0, 1.0, 4.0, 6.0]], dtype=np.float32)
        slopes = 1 - 2 * normals(z, (wrap, "repeat"))[0, :, 0]  # type: ignore[arg-type]
        expected = {"repeat": [-10, 8, 10, -8], "clamp": [0, 8, 10, 0], "mirror": [2, 8, 10, 4, -4, -10, -8, -2]}[wrap]
        assert slopes == pytest.approx(expected)

    def test_one_texel_is_level(self) -> None:
        for wrap in ("repeat", "clamp", "mirror"):
            assert normals(np.ones((1, 1), dtype=np.float32), (wrap, wrap))[..., :2] == pytest.approx(0.5)  # type: ignore[arg-type]

    @pytest.mark.parametrize("axis", [0, 1])
    def test_a_mirrored_hill_is_a_hill(self, axis: int, draw: Any, picture: Save) -> None:
        """A mirrored bump map equals a bump map of the picture beside its mirror image, which repeats."""
        heights = noise((8, 8))
        flipped = np.flip(heights, 1 - axis)
        # Rows of a file run downward, so the picture itself is the lower half.
        both = np.concatenate([heights, flipped], 1) if axis == 0 else np.concatenate([flipped, heights], 0)
        wrap = ["mirror", "repeat"] if axis == 0 else ["repeat", "mirror"]
        uvs = np.array([(0, 0), (1, 0), (1, 1), (0, 1)]) * 4.0 - 1.25
        # Heights are counted in widths of the picture, so the number is half as large in a picture twice as wide.
        height = 0.05 if axis == 0 else 0.1
        mirrored = {"texture": picture("single", heights), "height": 0.1, "wrap": wrap}
        by_mirror = self.lit(draw, mirrored, (-0.5, 0.3, 0.8), 64, uvs=uvs)
        halved = uvs / np.array([2, 1] if axis == 0 else [1, 2])
        by_hand = self.lit(draw, {"texture": picture("double", both), "height": height}, (-0.5, 0.3, 0.8), 64, uvs=halved)
        assert np.ptp(by_mirror) > 0.2
        assert by_mirror == pytest.approx(by_hand, abs=10 * ROUNDING)

    def test_from_afar_it_is_the_mean_slope(self, draw: Any, picture: Save) -> None:
        """From far away, only the mean slope is left of a slope with fine ripples."""
        x = np.arange(256)
        heights = (x / 256 + 0.01 * (x % 2))[None].repeat(256, axis=0)
        pixels = self.lit(draw, {"texture": picture("ripples", heights), "height": 0.5, "wrap": "clamp"}, (-0.6, 0, 0.8), 8)
        assert pixels[2:-2, 2:-2] == pytest.approx((0.3 + 0.8) / math.hypot(0.5, 1), abs=1e-4)

    def test_the_height_does_not_change_the_program(self, picture: Save) -> None:
        bumps = {"texture": picture("flat", noise((4, 4)))}
        low, high = (program({"brdf": "phong", "bump_map": {**bumps, "height": h}}) for h in (0.1, 0.2))
        assert low == high
        assert low == program({"brdf": "phong", "normal_map": bumps}), "the same program as a normal map's"

    def test_not_beside_a_normal_map(self, picture: Save) -> None:
        bumps = {"texture": picture("flat", noise((4, 4)))}
        message = fault({"brdf": "phong", "normal_map": bumps, "bump_map": bumps})
        assert message == "objects.0.material.bump_map: cannot be used together with normal_map, since both set the normal"
        assert program({"brdf": "phong", "normal_map": None, "bump_map": bumps}).normal_map


BRUSHED: dict[str, Any] = {"brdf": "ashikhmin_shirley", "ks": 0.5, "pu": 400.0, "pv": 10.0}
LAMP = [{"type": "point", "position": [0.5, 0.25, 1], "falloff": "none"}]


class TestDirections:
    """Anisotropic models, whose tangents are turned by an angle or by a direction map."""

    def drawn(self, draw: Any, uvs: Any = ((0, 0), (1, 0), (1, 1), (0, 1)), **material: Any) -> Any:
        return draw(square({**BRUSHED, **material}, uvs), LAMP, (32, 32), camera=FRONT)

    def test_a_quarter_turn_exchanges_the_axes(self, draw: Any) -> None:
        turned = self.drawn(draw, tangent_direction=90)
        assert turned == pytest.approx(self.drawn(draw, pu=10.0, pv=400.0), abs=ROUNDING)
        assert np.abs(turned - self.drawn(draw)).max() > 0.1

    @pytest.mark.parametrize("rate", RATES)
    def test_it_turns_from_u_toward_v(self, rate: Rate, draw: Any) -> None:
        """A turn of the tangents equals a turn of the texture coordinates, also where these are mirrored."""
        c, s = math.cos(math.radians(30)), math.sin(math.radians(30))
        for mirror in (1, -1):
            uvs = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * [mirror, 1.0]
            # The turned u grows along (c, s), and the turned v along (-s, c), in the plane of u and v.
            turned_uvs = uvs @ np.array([[c, -s], [s, c]])
            items = (square({**BRUSHED, "tangent_direction": 30}, uvs), square(BRUSHED, turned_uvs), square(BRUSHED, uvs))
            by_angle, by_uvs, plain = (draw(item, LAMP, (32, 32), camera=FRONT, shading=rate) for item in items)
            assert by_angle == pytest.approx(by_uvs, abs=4 * ROUNDING)
            assert np.abs(by_angle - plain).max() > 1e-3

    @pytest.mark.parametrize(("angle", "length"), [(0, 1.0), (50, 1.0), (-130, 0.3), (90, 0.02)])
    def test_a_map_of_one_direction_is_an_angle(self, angle: float, length: float, draw: Any, picture: Save) -> None:
        a = math.radians(angle)
        rgb = [0.5 + 0.5 * length * math.cos(a), 0.5 + 0.5 * length * math.sin(a), 0.125]
        path = picture("direction", np.broadcast_to(rgb, (2, 2, 3)))
        mapped = self.drawn(draw, tangent_direction={"texture": path})
        assert mapped == pytest.approx(self.drawn(draw, tangent_direction=angle), abs=1e-4)
        rotated = self.drawn(draw, tangent_direction={"texture": path, "rotate": 25})
        assert rotated == pytest.approx(self.drawn(draw, tangent_direction=angle + 25), abs=1e-4)

    @pytest.mark.parametrize("code", [127, 128])
    def test_no_direction_keeps_the_tangent(self, code: int, draw: Any, tmp_path: Path, picture: Save) -> None:
        plain = self.drawn(draw)
        for path in (grey(tmp_path, np.full((2, 2), code)), picture("half", np.full((3, 3), 0.5))):
            assert self.drawn(draw, tangent_direction={"texture": path}) == pytest.approx(plain, abs=ROUNDING)
            turned = self.drawn(draw, tangent_direction={"texture": path, "rotate": 90})
            assert turned == pytest.approx(self.drawn(draw, pu=10.0, pv=400.0), abs=ROUNDING)

    def test_it_bends_with_the_normal(self, draw: Any, picture: Save) -> None:
        """A quarter turn exchanges the axes under a bump map too."""
        bumps = {"texture": picture("bumps", noise((4, 4))), "height": 0.1}
        turned = self.drawn(draw, bump_map=bumps, tangent_direction=90)
        assert turned == pytest.approx(self.drawn(draw, bump_map=bumps, pu=10.0, pv=400.0), abs=4 * ROUNDING)

    def test_full_turns_do_not_change_the_program(self) -> None:
        for angle in (0, 360, -720.0):
            assert program({**BRUSHED, "tangent_direction": angle}) == program(BRUSHED)
        by_30, by_40 = (program({**BRUSHED, "tangent_direction": angle}) for angle in (30, 40))
        assert by_30 == by_40 != program(BRUSHED)
        assert not program({"brdf": "ggx", "anisotropy": 0, "tangent_direction": 30}).turned, "isotropic"

    def test_isotropic_models_refuse_it(self) -> None:
        expected = "objects.0.material.tangent_direction: has no effect, because phong is isotropic"
        assert fault({"brdf": "phong", "tangent_direction": 30}) == expected
        for model in BRDFS.values():
            material = {"brdf": model.model_fields["brdf"].default, "tangent_direction": 30}
            if model.anisotropic:
                model.model_validate(material)
            else:
                assert "is isotropic" in fault(material)

    def test_a_mesh_without_coordinates(self) -> None:
        """An angle needs no texture coordinates, but direction maps and bump maps do."""
        assert program({**BRUSHED, "tangent_direction": 30}, shape="icosphere").turned
        for key in ("tangent_direction", "bump_map"):
            item = {"shape": "icosphere", "material": {**BRUSHED, key: {"texture": __file__}}}
            with pytest.raises(SceneError, match=f"{key} is a texture, but its mesh has no texture coordinates"):
                explain(Scene.model_validate({"objects": [item]}))


class TestChannels:
    """Parameters that are one number, which may be read from any channel."""

    @pytest.mark.parametrize("channel", "rgba")
    def test_every_channel_can_be_read(self, channel: str, draw: Any, picture: Save) -> None:
        path = picture("rgba", np.broadcast_to([1.0, 4.0, 16.0, 0.5], (2, 2, 4)))
        material = {"brdf": "phong", "kd": 0, "ks": 1}
        textured = {"texture": path, "channel": channel, "factor": 3}
        item = square({**material, "exponent": textured})
        scene = draw.scene(item, [SUN], camera=FRONT)
        # The colours of an EXR file are premultiplied, so they are divided by alpha.
        exponent = 3 * {"r": 2.0, "g": 8.0, "b": 32.0, "a": 0.5}[channel]
        expected = draw(square({**material, "exponent": exponent}), [SUN], camera=FRONT)
        assert draw(item, [SUN], camera=FRONT) == pytest.approx(expected, rel=1e-5)
        assert reference.radiance(scene)[..., :3] == pytest.approx(expected, rel=1e-5)

    def test_red_is_the_default(self, picture: Save) -> None:
        texture = {"texture": picture("rgb", noise((4, 4, 3)))}
        default, red = (program({"brdf": "phong", "exponent": {**texture, **more}}) for more in ({}, {"channel": "r"}))
        assert default == red

    def test_colours_have_no_channel(self, picture: Save) -> None:
        message = fault({"brdf": "phong", "kd": {"texture": picture("rgb", noise((4, 4, 3))), "channel": "g"}})
        assert message == 'objects.0.material.kd: a colour reads three channels, so channel = "g" is not allowed'

    def test_a_picture_is_bound_once(self, picture: Save) -> None:
        path = picture("rgb", noise((4, 4, 3)))
        packed = {
            "brdf": "ggx",
            "roughness": {"texture": path, "channel": "g"},
            "metallic": {"texture": path, "channel": "b", "factor": 0.5},
        }
        assert text(program(packed)).count("uniform sampler2D") == 1
        # With another wrap mode the same picture is another texture.
        assert text(program({**packed, "metallic": {"texture": path, "wrap": "clamp"}})).count("uniform sampler2D") == 2

    @pytest.mark.parametrize("rate", RATES)
    def test_8_bits_are_numbers(self, rate: Rate, tmp_path: Path, renderer: Renderer) -> None:
        """Neither renderer decodes the texels of a parameter that is not a colour."""
        pixels = (noise((4, 4, 3)) * 255).astype(np.uint8)
        path = grey(tmp_path, pixels)
        material = {"brdf": "phong", "ks": 1, "exponent": {"texture": path, "factor": 40, "channel": "g"}}
        assert verify(floor(material, rate), renderer=renderer).verdict == "verified"


def test_the_plan_names_every_feature(picture: Save) -> None:
    path = picture("rgb", noise((4, 4, 3)))
    material = {
        "brdf": "ggx",
        "anisotropy": 0.5,
        "roughness": {"texture": path, "channel": "g"},
        "bump_map": {"texture": path, "wrap": "mirror"},
        "tangent_direction": {"texture": path, "rotate": 30},
    }
    explanation = explain(Scene.model_validate({"objects": [{"name": "ball", "shape": "sphere", "material": material}]}))
    reasons = dict(explanation.reasons)
    assert reasons["bump map"] == reasons["directions of tangents"] == reasons["texture of roughness"] == "ball"
    assert reasons["tangents turned"] == "ball, by 30 degrees"
    (plan,) = explanation.programs
    for words in ("roughness textured (g)", "normal map (mirrored)", "tangents by a map", "tangents turned"):
        assert words in str(plan)
    everything, nothing = text(plan), text(program({"brdf": "ggx", "anisotropy": 0.5}))
    for word in ("turned_frame", "mapped_direction", "mapped_frame", "u_turn", "u_normal_map", "u_direction_map"):
        assert word in everything
        assert word not in nothing


# name -> a material with that feature, which is compared with the float64 reference.
FEATURES = {
    "bumps": {"brdf": "phong", "bump_map": {"texture": "heights", "height": 0.2}},
    "mirrored bumps": {"brdf": "phong", "bump_map": {"texture": "heights", "height": 0.2, "wrap": ["mirror", "clamp"]}},
    "turned": {**BRUSHED, "tangent_direction": 33},
    "directions": {**BRUSHED, "tangent_direction": {"texture": "circle", "rotate": 20}},
    "directions and bumps": {
        **BRUSHED,
        "tangent_direction": {"texture": "circle", "wrap": "mirror"},
        "bump_map": {"texture": "heights", "height": 0.1},
    },
    "packed": {
        "brdf": "ggx",
        "kd": {"texture": "noise"},
        "roughness": {"texture": "noise", "channel": "g"},
        "metallic": {"texture": "noise", "channel": "b"},
        "anisotropy": {"texture": "noise", "channel": "r"},
        "tangent_direction": 45,
    },
}


def feature(name: str, picture: Save) -> dict[str, Any]:
    """Returns the material of a feature, with the paths of its texture files in place of their names."""
    y, x = np.mgrid[0:16, 0:16] - 7.5
    files = {
        "heights": picture("heights", noise((12, 16))),
        "circle": picture("circle", 0.5 + 0.5 * np.stack([-y, x, 0 * x], -1) / np.hypot(x, y)[..., None]),
        "noise": picture("noise", noise((8, 8, 3))),
    }

    def placed(value: Any) -> Any:
        return {**value, "texture": files[value["texture"]]} if isinstance(value, dict) else value

    return {key: placed(value) for key, value in FEATURES[name].items()}


@pytest.mark.parametrize("rate", RATES)
@pytest.mark.parametrize("name", FEATURES)
def test_every_feature_is_verified(name: str, rate: Rate, picture: Save, renderer: Renderer) -> None:
    verdict = verify(floor(feature(name, picture), rate, 64), renderer=renderer)
    assert verdict.verdict == "verified", str(verdict)
    assert np.ptp(verdict.picture) > 0.05


@pytest.mark.parametrize("rate", RATES)
@pytest.mark.parametrize("name", FEATURES)
def test_no_declaration_is_unused(name: str, rate: Rate, picture: Save, renderer: Renderer) -> None:
    for plan in explain(floor(feature(name, picture), rate)).programs:
        nothing_unused(plan, renderer)


@pytest.mark.parametrize(
    ("name", "old", "new"),
    [
        ("turned", r"d\.x \* f\.b - d\.y", "d.x * f.b + d.y"),
        ("turned", r"turned_frame\((tangent_frame\(.*?\)), u_turn\)", r"\1"),
        ("directions", r"2\.0 \* rg - 1\.0", "2.0 * rg.yx - 1.0"),
        ("directions", r"vec2 rg\) \{", "vec2 rg) { rg.y = 1.0 - rg.y;"),
        ("bumps", r"scale \* m\.x", "scale * -m.x"),
        ("bumps", r"scale \* m\.y", "1.01 * scale * m.y"),
        ("mirrored bumps", r" / vec2\(2\.0, 1\.0\)", ""),
        ("packed", r"\.g, ", ".r, "),
        ("packed", r"(m\.metallic = .*?)\.b", r"\1.g"),
    ],
)
def test_a_fault_is_found(name: str, old: str, new: str, picture: Save, faulty: Renderer) -> None:
    faulty.rewrite = Mutation("fault", "made by this test", ((old, new),)).rewrite
    verdict = verify(floor(feature(name, picture), "phong"), renderer=faulty)
    assert verdict.verdict == "failed"


@pytest.fixture(scope="module")
def faulty() -> Iterator[Renderer]:
    with Renderer() as renderer:
        yield renderer


def middling(model: type[Brdf], name: str) -> float:
    """Returns a middle value of a parameter's usual range, which is never 0, so that no lobe is left out."""
    low, high = model.parameters()[name].usual
    return math.sqrt(low * high) if low > 0 else (low + high) / 2 or high / 2


def textured(model: type[Brdf], names: Any, picture: Save) -> dict[str, Any]:
    """Returns a material in which the named parameters have textures over their whole usual range, and the others one value."""
    material: dict[str, Any] = {"brdf": model.model_fields["brdf"].default}
    for seed, name in enumerate(model.parameters()):
        if name not in names:
            material[name] = middling(model, name)
            continue
        low, high = model.parameters()[name].usual
        # The texels lie within [-1, 1], and the factor scales them to the range.
        factor = max(abs(low), abs(high))
        path = picture(f"{material['brdf']}-{name}", noise((4, 4, 3), low / factor, high / factor, seed))
        material[name] = {"texture": path, "factor": factor}
        if not model.is_colour(name):
            material[name]["channel"] = "rgb"[seed % 3]
    return material


def check_textured(name: str, names: Any, rate: Rate, picture: Save, renderer: Renderer) -> None:
    scene = floor(textured(BRDFS[name], names, picture), rate)
    (plan,) = explain(scene).programs
    assert set(names) <= set(plan.textured), "its program does not read the textures"
    verdict = verify(scene, renderer=renderer)
    assert verdict.verdict == "verified", str(verdict)


@pytest.mark.parametrize("name", BRDFS)
def test_all_parameters_of_a_model_may_be_textures(name: str, picture: Save, renderer: Renderer) -> None:
    check_textured(name, BRDFS[name].parameters(), "phong", picture, renderer)


@pytest.mark.slow
@pytest.mark.parametrize("rate", RATES)
@pytest.mark.parametrize(("name", "parameter"), [(name, p) for name in BRDFS for p in BRDFS[name].parameters()])
def test_each_parameter_may_be_a_texture(name: str, parameter: str, rate: Rate, picture: Save, renderer: Renderer) -> None:
    check_textured(name, [parameter], rate, picture, renderer)
