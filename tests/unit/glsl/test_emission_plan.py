"""A program holds emission and occlusion only where they show."""

from __future__ import annotations

from itertools import product
from pathlib import Path
from typing import Any, get_args

import numpy as np
import pytest

from glshade import Image
from glshade.assembly.assembly import assemble
from glshade.glsl.explanation import explanation_of
from glshade.glsl.generator import generate
from glshade.glsl.plan import ProgramPlan
from glshade.glsl.planner import explain, further_plan, plan_instance
from glshade.glsl.uniforms import exposed_uniforms, textures
from glshade.scene.object import Rate
from glshade.scene.scene import Scene

SUN = {"type": "directional", "direction": [0, -1, -1]}
SKY = {"type": "ambient", "intensity": 0.5}
RATES: tuple[Rate, ...] = get_args(Rate)


@pytest.fixture
def picture(tmp_path: Path) -> Path:
    Image(np.full((2, 2, 3), 128, np.uint8), "srgb").save(tmp_path / "grey.png")
    return tmp_path / "grey.png"


def scene(material: dict[str, Any], *lights: dict[str, Any], **more: Any) -> Scene:
    item = {"name": "ball", "shape": "sphere", "material": {"brdf": "lambert", **material}}
    return Scene.model_validate({"objects": [item], "lights": lights, "film": {"size": [8, 8]}, **more})


def plan_of(material: dict[str, Any], *lights: dict[str, Any], rate: Rate | None = None) -> ProgramPlan:
    (program,) = explain(scene(material, *lights), rate).programs
    return program


def text_of(plan: ProgramPlan) -> str:
    source = generate(plan)
    return "".join(stage.text for stage in source.stages)


@pytest.mark.parametrize("rate", RATES)
@pytest.mark.parametrize("lights", [(), (SUN,), (SKY,), (SUN, SKY)])
def test_black_emission_changes_no_text(lights: Any, rate: Rate, picture: Path) -> None:
    plain = text_of(plan_of({}, *lights, rate=rate))
    assert "emission" not in plain
    for black in (0, (0, 0, 0), {"texture": picture, "factor": 0}):
        assert text_of(plan_of({"emission": black}, *lights, rate=rate)) == plain
    without_ambient = [light for light in lights if light is not SKY]
    occluded = {"occlusion": {"texture": picture}}
    assert text_of(plan_of(occluded, *without_ambient, rate=rate)) == text_of(plan_of({}, *without_ambient, rate=rate))
    assert text_of(plan_of({"occlusion": {"texture": picture, "strength": 0}}, *lights, rate=rate)) == plain


@pytest.mark.parametrize("rate", RATES)
def test_each_use_of_emission(rate: Rate, picture: Path) -> None:
    for emission, use, type_ in (
        (0.5, "grey", "float"),
        ((1, 0, 0), "uniform", "vec3"),
        ({"texture": picture}, "texture", "vec3"),
    ):
        plan = plan_of({"emission": emission}, rate=rate)
        text = text_of(plan)
        assert plan.emission == use
        assert f"uniform {type_} u_emission;" in text
        assert ("u_emission_texture" in text) == (use == "texture")
        # No light reaches the surface, so that neither the model nor a normal is there.
        assert "brdf_cos" not in text
        assert "a_normal" not in text


def test_a_constant_ambient_light_stays_constant(picture: Path) -> None:
    plan = plan_of({"emission": {"texture": picture}, "occlusion": {"texture": picture, "channel": "b"}}, SKY)
    assert plan.ambient == "constant"
    assert plan.occlusion == "texture.b"
    assert "Lambert" not in text_of(plan)


def test_textures_that_are_read_alike_share_a_sampler(picture: Path) -> None:
    same = {"texture": picture, "encoding": "linear"}
    plan = plan_of({"kd": same, "emission": same, "occlusion": {"texture": picture}}, SUN, SKY)
    assert dict(plan.shared) == {"emission": "kd", "occlusion": "kd"}
    assert text_of(plan).count("uniform sampler2D") == 1
    # Colours are decoded, occlusion is not.
    apart = plan_of({"kd": {"texture": picture}, "occlusion": {"texture": picture}}, SUN, SKY)
    assert text_of(apart).count("uniform sampler2D") == 2


@pytest.mark.parametrize("rate", RATES)
def test_each_sampler_is_declared_once_and_has_texels(rate: Rate, picture: Path) -> None:
    ways = (0.5, {"texture": picture}, {"texture": picture, "encoding": "linear"})
    for kd, emission, occluded, lights in product(ways, (0, *ways), (False, True), ((), (SUN,), (SKY,), (SUN, SKY))):
        material: dict[str, Any] = {"kd": kd, "emission": emission}
        material |= {"occlusion": {"texture": picture}} if occluded else {}
        assembly = assemble(scene(material, *lights), rate)
        plan = plan_instance(assembly.instances[0], assembly, "linear")
        declared = [d.name for stage in generate(plan).stages for d in stage.declarations("uniform") if d.type == "sampler2D"]
        assert sorted(declared) == sorted(textures(plan, assembly.instances[0].material))


def test_occlusion_goes_with_a_further_page(picture: Path) -> None:
    """More lights than a page holds are drawn by further calls, which must not add the emission again."""
    lamp = {"type": "point", "position": [0, 2, 0]}

    assembly = assemble(scene({"emission": 1, "occlusion": {"texture": picture}}, SKY, *[lamp] * 300))
    plan = plan_instance(assembly.instances[0], assembly, "linear")
    further = further_plan(plan, assembly.instances[0], [2], 1)
    assert (plan.emission, plan.occlusion) == ("grey", "texture.r")
    assert (further.emission, further.occlusion) == ("unused", "unused")
    assert "emission" not in text_of(further)


def test_the_exposure_multiplies_emission() -> None:
    assembly = assemble(scene({"emission": (0.25, 0.5, 1)}))
    plan = plan_instance(assembly.instances[0], assembly, "linear")
    values = exposed_uniforms(plan, assembly.instances[0], assembly, 2.0)
    assert values["u_emission"].tolist() == [1, 2, 4]


def test_it_is_explained(picture: Path) -> None:
    glowing = explanation_of(scene({"emission": (1, 0, 0), "occlusion": {"texture": picture}}, SKY))
    assert "emission" in str(glowing.plan)
    assert "occlusion textured (r)" in str(glowing.plan)
    assert {("emission", "ball"), ("texture of occlusion", "ball")} <= set(glowing.programs[0].features)
    textured = explanation_of(scene({"emission": {"texture": picture}}))
    assert ("texture of emission", "ball") in textured.programs[0].features
    unlit = explanation_of(scene({"unlit": True}, SUN))
    assert ("base colour in place of light", "ball, which is unlit") in unlit.programs[0].features


def test_the_numbers_of_variants(picture: Path) -> None:
    """`variants.valid` multiplies by four uses of emission and, with ambient light, by five of occlusion."""
    emissions = (0, 1, (1, 0, 0), {"texture": picture})
    occlusions = (None, *({"texture": picture, "channel": channel} for channel in "rgba"))
    for lights, number in (((SUN,), 4), ((SUN, SKY), 20)):
        uses = {
            (plan.emission, plan.occlusion)
            for emission, occlusion in product(emissions, occlusions)
            for plan in [plan_of({"emission": emission, "occlusion": occlusion}, *lights)]
        }
        assert len(uses) == number


def test_an_unlit_surface_takes_nothing_but_its_colour(picture: Path) -> None:
    """Whatever the lights and the model, the program is that of ambient light alone."""
    for brdf in ("ggx", "paint", "phong", "ward"):
        plan = plan_of({"brdf": brdf, "unlit": True, "kd": 0.5, "occlusion": {"texture": picture}}, SUN, SKY)
        assert (plan.brdf, plan.lights, plan.ambient, plan.occlusion) == ("lambert", (), "constant", "unused")
        plan = plan_of({"brdf": brdf, "unlit": True, "kd": {"texture": picture}}, SUN, SKY)
        assert (plan.lights, plan.ambient, plan.textured) == ((), "varying", ("kd",))
