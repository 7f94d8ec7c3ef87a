"""The float64 reference agrees with the ray tracer of tests/support/third, which shares no code with it.

So faults in the code that the reference shares with the GPU renderer are noticed. `script/prove third_opinion` compares many
more scenes.
"""

import ast
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support import third
from support.opinions import agreement
from support.planted import FAULTS, Fault, planted
from support.third.generator import Generator, features
from support.third.models import MODELS

from glshade import Scene
from glshade.verification.laws import check_laws

FEATURES = {
    *("film.background", "film.crop", "film.exposure"),
    *("camera.fov", "camera.up", "camera.turn", "camera.matrix", "camera.near", "camera.far", "camera.type orthographic"),
    *(f"object.shape.type {name}" for name in ("cube", "plane", "sphere", "icosphere", "cylinder", "cone", "torus")),
    *("object.mesh", "object.vertex_colours", "object.parent", "object.transform.matrix", "object.transform.rotate"),
    *(f"object.shading {name}" for name in ("flat", "gouraud", "phong")),
    *(f"object.normals {name}" for name in ("auto", "face", "smooth")),
    *("object.threshold", "object.sides front", "object.sides both", "object.material", "material.sides both"),
    *(f"material.brdf {name}" for name in MODELS),
    *("material.tangent_direction", "normal_map.scale", "bump_map.height"),
    *("material.emission", "occlusion.strength", "occlusion.channel g", "material.unlit"),
    *(f"{name}.wrap {mode}" for name in ("texture", "normal_map", "bump_map") for mode in ("repeat", "clamp", "mirror")),
    *("texture.factor", "texture.channel g", "texture.encoding srgb", "texture.encoding linear"),
    *(f"light.type {name}" for name in ("ambient", "directional", "point", "spot", "gltf_spot")),
    *(f"light.falloff {name}" for name in ("none", "1/r", "1/r^2")),
    *("light.colour", "light.only", "light.inner", "light.outer", "light.r_min"),
}


@pytest.mark.parametrize("number", range(20))
def test_the_reference_agrees_with_the_ray_tracer(number: int, tmp_path: Path) -> None:
    result = agreement(Generator(tmp_path, 1, number).scene())
    assert result.holds, f"differs by {result.worst:.1e} of the brightest value at {result.place}"
    assert result.compared > 0.9


def test_the_random_scenes_have_every_feature(tmp_path: Path) -> None:
    found = set().union(*(features(Generator(tmp_path, 0, number).scene()) for number in range(100)))
    assert found >= FEATURES, sorted(FEATURES - found)


def test_the_random_scenes_show_something(tmp_path: Path) -> None:
    """A picture of nothing but background would agree with any other."""
    scenes = [Generator(tmp_path, 0, number).scene() for number in range(30)]
    shown = [np.mean(third.trace(scene).pixels != scene["film"]["background"]) for scene in scenes]
    assert np.median(shown) > 0.2


def test_the_ray_tracer_has_no_code_of_glshade() -> None:
    for path in Path(third.__file__).parent.glob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            names = [node.module or ""] if isinstance(node, ast.ImportFrom) else []
            names += [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            assert not [name for name in names if name.split(".")[0] == "glshade"], path


@pytest.mark.parametrize("fault", [fault for fault in FAULTS if not fault.test], ids=lambda fault: fault.name)
def test_a_fault_in_shared_code_is_noticed(fault: Fault, tmp_path: Path) -> None:
    """`script/prove planted_faults` prints a table that says what notices each fault."""
    scene = fault.scene(tmp_path)
    assert agreement(scene).holds
    with planted(fault):
        assert not agreement(scene).holds or _breaks_a_law(scene)


def _breaks_a_law(scene: dict[str, Any]) -> bool:
    return any(finding.outcome == "broken" for finding in check_laws(Scene.model_validate(scene)))
