"""Plan: the programs of a scene have the features that it needs, and no others."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from support.strategies import MATERIALS

from glshade import BRDFS, LIGHTS, Image, Mesh, Plan, Scene, explain

SUN = {"type": "directional"}
LAMP = {"type": "point", "position": [0, 3, 3]}
SKY = {"type": "ambient"}


def plan(objects: Any, lights: Any = (SUN,), **more: Any) -> Plan:
    objects = [objects] if isinstance(objects, dict) else objects
    return explain(Scene.model_validate({"objects": objects, "lights": list(lights), **more}))


def ball(**keys: Any) -> dict[str, Any]:
    return {"shape": "sphere", "material": {"brdf": "phong", "kd": [0.1, 0.2, 0.3]}, **keys}


def test_the_same_features_are_one_program() -> None:
    balls = [
        ball(material={"brdf": "phong", "kd": [0.1, 0.1, 0.1 * i + 0.2], "exponent": i}, transform={"translate": [3 * i, 0, 0]})
        for i in range(5)
    ]
    found = plan(balls)
    assert len(found.programs) == 1
    assert [which for _, which in found.draws] == [0] * 5


@pytest.mark.parametrize(
    "other",
    [
        {"shading": "flat"},
        {"shading": "gouraud"},
        {"material": {"brdf": "lambert", "kd": [0.1, 0.2, 0.3]}},
        {"sides": "both"},
    ],
)
def test_other_features_are_another_program(other: dict[str, Any]) -> None:
    assert len(plan([ball(sides="front"), ball(sides="front") | other]).programs) == 2


def test_what_is_not_used_changes_nothing() -> None:
    before = plan(ball())
    unused = {name: {"brdf": name} for name in BRDFS}
    assert plan(ball(), materials=unused) == before
    elsewhere = [
        {"type": name, "only": [], **({"position": [0, 0, 0]} if "position" in LIGHTS[name].model_fields else {})}
        for name in LIGHTS
    ]
    assert plan(ball(), [SUN, *elsewhere]).programs == before.programs
    assert plan(ball(), [SUN, {**LAMP, "intensity": 0}, {**SKY, "colour": 0}]).programs == before.programs
    assert plan(ball(), [SUN], film={"size": [3, 3], "exposure": 2}).programs == before.programs


@given(material=MATERIALS)
def test_values_are_no_features(material: Any) -> None:
    """A material of half the colours has the same program, for every model."""
    halved = {
        name: tuple(c / 2 for c in value)
        for name in material.parameters()
        if isinstance(value := getattr(material, name), tuple)
    }
    assert len(plan([ball(material=material), ball(material=material.model_copy(update=halved))]).programs) == 1


@pytest.mark.parametrize("brdf", ["phong", "blinn_phong"])
def test_a_lobe_of_no_weight_is_lambert(brdf: str) -> None:
    dull = ball(material={"brdf": brdf, "kd": [0.1, 0.2, 0.3], "ks": 0, "exponent": 7})
    lambert = ball(material={"brdf": "lambert", "kd": [0.1, 0.2, 0.3]})
    assert plan(dull).programs == plan(lambert).programs
    # With ambient light and a ka of its own, the material reflects more than lambert.
    own = ball(material={"brdf": brdf, "kd": [0.1, 0.2, 0.3], "ks": 0, "ka": [0.3, 0.2, 0.1]})
    assert plan(own, [SUN]).programs == plan(lambert, [SUN]).programs
    assert plan(own, [SUN, SKY]).programs != plan(lambert, [SUN, SKY]).programs


def test_light_linking_is_planned() -> None:
    found = plan([ball(name="a"), ball(name="b")], [SUN, {**LAMP, "only": ["b"]}])
    (first, second) = (found.programs[which] for _, which in found.draws)
    assert "point" not in str(first)
    assert "point" in str(second)


def test_a_model_of_ambient_light_has_no_other_lights() -> None:
    (program,) = plan(ball(material={"brdf": "ambient"}), [SUN, LAMP, SKY]).programs
    assert not program.lights
    assert "ambient" in str(program).removeprefix("ambient per pixel")
    assert not program.both_sides


def test_no_light_at_all() -> None:
    (program,) = plan(ball(), []).programs
    assert not program.lights
    assert "no light" in str(program)


def test_exact_counts_up_to_eight() -> None:
    found = {count: plan(ball(), [LAMP] * count, film={"encoding": "linear"}).programs for count in (1, 7, 8, 9, 300, 1000)}
    assert {len(programs) for programs in found.values()} == {1}
    programs = {count: one for count, (one,) in found.items()}
    assert programs[7] != programs[8] != programs[9]
    assert programs[9] == programs[300] == programs[1000], "one program for any number"


def test_a_closed_mesh_seen_from_outside_is_culled() -> None:
    camera = {"eye": [0, 0, 4], "target": [0, 0, 0]}
    for shape in ("sphere", "cube", "torus", "cylinder", "cone", "icosphere"):
        (program,) = plan({"shape": shape}, camera=camera).programs
        assert not program.both_sides, shape
    (program,) = plan({"shape": "plane"}, camera=camera).programs
    assert program.both_sides
    (program,) = plan(ball(), camera={"eye": [0, 0, 0.5], "target": [0, 0, 0]}).programs
    assert program.both_sides, "the viewer is inside"


def test_a_closed_mesh_in_a_fitted_view_is_culled() -> None:
    for camera in ({}, {"type": "orthographic"}, {"fov": 90}):
        (program,) = plan(ball(), camera=camera).programs
        assert not program.both_sides


def test_what_is_worked_on_afterwards_is_drawn_in_linear_light() -> None:
    assert plan(ball()).programs[0].encoding == "srgb"
    blended = {"brdf": "lambert", "alpha_mode": "blend"}
    film = {"size": [8, 8]}
    for scene in (
        plan(ball(), film={**film, "samples": 4}),
        plan(ball(), film={**film, "background": [0, 0, 0, 0]}),
        plan(ball(), quality={"storage": "rgba16f"}),
        plan([ball(), ball(material=blended)]),
        plan(ball(), [LAMP] * 300),
    ):
        assert {program.encoding for program in scene.programs} == {"linear"}


def test_vertex_colours_are_for_models_with_a_colour_of_their_own() -> None:
    mesh = Mesh.build([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], colours=[[1, 0, 0, 0.5]] * 3)
    for brdf, alpha in itertools.product(("lambert", "metal"), ("opaque", "mask")):
        item = {"mesh": mesh, "material": {"brdf": brdf, "alpha_mode": alpha}}
        (program,) = plan(item, [SUN, SKY]).programs
        assert program.vertex_colours == (brdf == "lambert" or alpha == "mask")
        assert program.coloured == (brdf == "lambert")
        assert program.ambient == ("varying" if brdf == "lambert" else "constant")


def test_ambient_light_varies_where_its_own_parameters_do(tmp_path: Any) -> None:
    Image(np.zeros((2, 2, 3), dtype=np.uint8)).save(tmp_path / "t.png")
    kd = {"texture": tmp_path / "t.png"}
    for more, how in (({}, "varying"), ({"ka": 0.5}, "constant")):
        (program,) = plan(ball(material={"brdf": "phong", "kd": kd, **more}), [SUN, SKY]).programs
        assert program.ambient == how
        assert program.textured == ("kd",)
    # Without flakes, the texture of their colour is not read.
    (program,) = plan(ball(material={"brdf": "paint", "flakes": 0, "flake_colour": kd}), [SUN, SKY]).programs
    assert (program.ambient, program.textured) == ("constant", ())


def test_ambient_light_on_black_is_none() -> None:
    for ka, how in ((0, "none"), (0.1, "constant")):
        (program,) = plan(ball(material={"brdf": "phong", "ka": ka}), [SUN, SKY]).programs
        assert program.ambient == how


def test_a_mask_that_cuts_nothing_out_is_none() -> None:
    for alpha, cutoff, mode in ((1, 0.5, "opaque"), (0.5, 0.5, "opaque"), (0.25, 0.5, "mask")):
        material = {"brdf": "lambert", "alpha_mode": "mask", "alpha": alpha, "alpha_cutoff": cutoff}
        (program,) = plan(ball(material=material)).programs
        assert program.alpha == mode


def test_sides_may_be_set() -> None:
    assert plan(ball(sides="both")).programs[0].both_sides
    assert not plan({"shape": "plane", "sides": "front"}).programs[0].both_sides
    two_sided = {"brdf": "lambert", "sides": "both"}
    assert plan(ball(material=two_sided)).programs[0].both_sides
    assert not plan(ball(material=two_sided, sides="front")).programs[0].both_sides


def test_every_feature_has_a_reason(tmp_path: Any) -> None:
    Image(np.zeros((2, 2, 3), dtype=np.uint8)).save(tmp_path / "t.png")
    textured = {
        "brdf": "ashikhmin_shirley",
        "kd": {"texture": tmp_path / "t.png"},
        "normal_map": {"texture": tmp_path / "t.png"},
    }
    objects = [ball(name="ball"), {"name": "floor", "shape": "plane", "material": textured, "shading": "phong"}]
    found = plan(objects, [{**SUN, "name": "sun"}, LAMP, SKY])
    reasons = dict(found.reasons)
    assert reasons["brdf phong per pixel"] == "ball"
    assert reasons["brdf ashikhmin_shirley per pixel"] == "floor"
    assert reasons["texture of kd"] == reasons["normal map"] == "floor"
    assert any("directional" in feature and reason == "sun" for feature, reason in reasons.items())
    assert any("point" in feature and reason == "lights[1]" for feature, reason in reasons.items())
    assert reasons["light ambient"] == "lights[2]"
    text = str(found)
    assert all(feature in text for feature in reasons)


def test_plans_are_values() -> None:
    assert plan(ball()) == plan(ball())
    assert len({plan(ball()).programs, plan(ball()).programs}) == 1
    with pytest.raises(AttributeError):
        plan(ball()).programs[0].rate = "flat"  # type: ignore[misc]
