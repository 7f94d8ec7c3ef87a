"""Division: many draws computed together give what each gives alone, and those that must not be joined stay apart."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from glshade import Scene, reference
from glshade.mesh.mesh import Mesh
from glshade.radiance.joined_draw import JoinedDraw, structure
from glshade.reference import division
from glshade.reference.bounds import Bounds, alphas, fragment_bounds
from glshade.reference.freedom import UNMEASURED
from glshade.reference.inputs import Inputs, prepare
from glshade.reference.planes import depths
from glshade.reference.raster import Fragments, rasterise
from glshade.reference.sealing import sheets
from glshade.reference.shade import shade_fragments
from glshade.reference.visible import visible_parts

SIZE = 40
LIGHTS = [{"type": "point", "position": (1, 2, 3), "intensity": 6.0}, {"type": "ambient", "intensity": 0.2}]


def scene(things: list[dict[str, Any]], lights: Any = LIGHTS, samples: int = 1) -> Scene:
    """Returns a scene in which each thing is a small cube, unless it says otherwise."""
    objects = [{"shape": "cube", **thing} for thing in things]
    camera = {"eye": (0.3, 0.5, 6.0), "target": (0, 0, 0), "fov": 40}
    film = {"size": (SIZE, SIZE), "samples": samples}
    return Scene.model_validate({"objects": objects, "lights": lights, "camera": camera, "film": film})


def coloured_mesh() -> Mesh:
    """Returns two triangles with colours that are partly transparent."""
    positions = [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)]
    colours = [(1, 0.2, 0.2, 0.9), (0.2, 1, 0.2, 0.3), (0.2, 0.2, 1, 0.8), (1, 1, 1, 0.6)]
    return Mesh.build(positions, [(0, 1, 2), (0, 2, 3)], uvs=[(0, 0), (1, 0), (1, 1), (0, 1)], colours=colours)


def checks() -> dict[str, Any]:
    """Returns a texture of four texels, as a material names it."""
    pixels = np.array([[[0.9, 0.1, 0.3], [0.2, 0.8, 0.4]], [[0.5, 0.5, 0.9], [0.7, 0.6, 0.1]]], dtype=np.float32)
    return {"texture": pixels}


@st.composite
def crowds(draw: st.DrawFn) -> Scene:
    """Draws scenes of some objects that share their structure, beside others that do not."""
    unit = st.floats(0.0, 1.0, allow_subnormal=False)
    colour = st.tuples(unit, unit, unit)
    materials = st.one_of(
        st.fixed_dictionaries({"brdf": st.just("lambert"), "kd": colour, "emission": colour}),
        st.fixed_dictionaries({"brdf": st.just("phong"), "kd": colour, "exponent": st.floats(1, 50)}),
        st.fixed_dictionaries(
            {
                "brdf": st.just("lambert"),
                "kd": st.just(0.5),
                "alpha": unit,
                "alpha_mode": st.sampled_from(["mask", "blend"]),
                "alpha_cutoff": st.floats(0.1, 0.9),
            }
        ),
        st.fixed_dictionaries({"brdf": st.just("ward"), "tangent_direction": st.floats(0, 90), "kd": colour}),
    )
    mirrored = st.sampled_from([(1, 1, 1), (-1, 1, 1), (0.4, 1.2, 1)])
    things = st.fixed_dictionaries(
        {
            "material": materials,
            "shading": st.sampled_from(["flat", "gouraud", "phong"]),
            "transform": st.fixed_dictionaries(
                {
                    "translate": st.tuples(*[st.floats(-1.5, 1.5)] * 3),
                    "scale": mirrored,
                    "rotate": st.tuples(*[st.floats(0, 90)] * 3),
                }
            ),
        },
        optional={"mesh": st.just(coloured_mesh()), "sides": st.sampled_from(["both", "front"])},
    )
    found = [
        {**({} if "mesh" in thing else {"shape": "cube"}), **thing} for thing in draw(st.lists(things, min_size=2, max_size=6))
    ]
    camera = {"eye": (0.3, 0.5, 6.0), "target": (0, 0, 0), "fov": 40}
    film = {"size": (SIZE, SIZE), "samples": draw(st.sampled_from([1, 4]))}
    return Scene.model_validate({"objects": found, "lights": LIGHTS, "camera": camera, "film": film})


def alone(inputs: Inputs, fragments: Fragments, function: Any) -> list[Any]:
    """Returns the results of a function for the fragments of each draw, one draw after the other."""
    return [function(inputs, fragments.take(fragments.draw == number)) for number in np.unique(fragments.draw)]


@given(crowds())
@settings(max_examples=8, deadline=None)
def test_draws_together_give_what_each_gives_alone(view: Scene) -> None:
    inputs = prepare(view)
    fragments = Fragments.joined(rasterise(inputs, UNMEASURED.margin))
    fragments = fragments.take(np.argsort(fragments.draw, kind="stable"))
    if not len(fragments):
        return
    np.testing.assert_allclose(
        shade_fragments(inputs, fragments), np.concatenate(alone(inputs, fragments, shade_fragments)), rtol=1e-12, atol=1e-15
    )
    flags = fragments.partial
    together = fragment_bounds(inputs, fragments, UNMEASURED, flags)
    each = [
        fragment_bounds(inputs, fragments.take(which), UNMEASURED, flags[which])
        for which in (np.flatnonzero(fragments.draw == number) for number in np.unique(fragments.draw))
    ]
    for field in fields(Bounds):
        expected = np.concatenate([getattr(part, field.name) for part in each])
        np.testing.assert_allclose(getattr(together, field.name), expected, rtol=1e-9, atol=1e-12, err_msg=field.name)
    found = depths(inputs, fragments, UNMEASURED)
    for name in ("slack", "slope", "nearest", "farthest", "cut"):
        expected = np.concatenate([getattr(part, name) for part in alone(inputs, fragments, depths_of)])
        np.testing.assert_allclose(getattr(found, name), expected, rtol=1e-12, atol=1e-15, err_msg=name)
    for index, expected in enumerate(np.concatenate(alone(inputs, fragments, alphas_of), axis=1)):
        np.testing.assert_allclose(alphas(inputs, fragments, UNMEASURED)[index], expected, rtol=1e-12, atol=1e-15)


def depths_of(inputs: Inputs, fragments: Fragments) -> Any:
    return depths(inputs, fragments, UNMEASURED)


def alphas_of(inputs: Inputs, fragments: Fragments) -> Any:
    return np.stack(alphas(inputs, fragments, UNMEASURED))


@given(crowds())
@settings(max_examples=8, deadline=None)
def test_sheets_of_draws_together_are_those_of_each_alone(view: Scene) -> None:
    inputs = prepare(view)
    fragments = Fragments.joined(rasterise(inputs, UNMEASURED.margin))
    fragments = fragments.take(fragments.partial)
    fragments = fragments.take(np.argsort(fragments.draw, kind="stable"))
    together = sheets(inputs, fragments, UNMEASURED)
    for number in np.unique(fragments.draw):
        own = fragments.draw == number
        each = sheets(inputs, fragments.take(own), UNMEASURED)
        assert ((each < 0) == (together[own] < 0)).all()
        # The two numberings have the same parts: each number of one belongs to one number of the other.
        pairs = set(zip(each.tolist(), together[own].tolist(), strict=True))
        assert len(pairs) == len(set(each.tolist())) == len(set(together[own].tolist()))
    # A sheet never holds fragments of two draws.
    owners = set(zip(together[together >= 0].tolist(), fragments.draw[together >= 0].tolist(), strict=True))
    assert len(owners) == len({sheet for sheet, _ in owners})


def test_draws_that_differ_only_in_numbers_are_one_piece() -> None:
    rows = [{"material": {"brdf": "phong", "kd": (k / 60, 0.5, 0.1), "exponent": 5.0 + k}} for k in range(60)]
    things = [
        {**row, "transform": {"translate": (k % 8 * 0.4 - 1.4, k // 8 * 0.4 - 1.4, 0), "scale": 0.15}}
        for k, row in enumerate(rows)
    ]
    inputs = prepare(scene(things))
    fragments = Fragments.joined(rasterise(inputs))
    pieces = list(division.by_structure(inputs, fragments))
    assert len(np.unique(fragments.draw)) > 30
    assert len(pieces) == 1
    draw, which, part = pieces[0]
    assert isinstance(draw, JoinedDraw)
    assert sorted(which.tolist()) == list(range(len(fragments)))
    # Every fragment still has the corners of its own triangle.
    for own, joined in zip(which[::50], part.triangle[::50], strict=True):
        right = inputs.draws[fragments.draw[own]]
        np.testing.assert_array_equal(draw.clip[draw.triangles[joined]], right.clip[right.triangles[fragments.triangle[own]]])


BALL = {"material": {"brdf": "phong", "kd": 0.5}}


@pytest.mark.parametrize(
    "other",
    [
        {"material": {"brdf": "blinn_phong", "kd": 0.5}},
        {"material": {"brdf": "phong", "kd": checks()}},
        {"material": {"brdf": "phong", "kd": 0.5, "alpha_mode": "blend", "alpha": 0.5}},
        {"material": {"brdf": "phong", "kd": 0.5}, "shading": "flat"},
        {"material": {"brdf": "phong", "kd": 0.5}, "sides": "both"},
        {"material": {"brdf": "phong", "kd": 0.5}, "name": "unlit by the lamp"},
    ],
    ids=["model", "texture", "blended", "rate", "sides", "light"],
)
def test_draws_of_different_structure_stay_apart(other: dict[str, Any]) -> None:
    lights = [{**LIGHTS[0], "only": ["first"]}] if "name" in other else LIGHTS
    first, second = prepare(scene([{**BALL, "name": "first"}, other], lights)).draws
    assert structure(first) != structure(second)
    same, changed = prepare(scene([BALL, {"material": {"brdf": "phong", "kd": 0.1, "ks": 0.9}}])).draws
    assert structure(same) == structure(changed)


def test_of_two_surfaces_at_one_depth_the_first_is_shown() -> None:
    """Both lie in one piece of fragments, in which the triangles that are clipped, here those of the first, come last."""
    red, blue = ({"brdf": "lambert", "kd": 0, "emission": colour} for colour in ((1, 0, 0), (0, 0, 1)))
    things = [{"material": red, "transform": {"scale": (50, 1, 50)}}, {"material": blue}]
    camera = {"type": "orthographic", "eye": (0, 3, 0), "target": (0, 0, 0), "up": (0, 0, 1), "height": 3}
    view = scene([{"shape": "plane", **thing} for thing in things])
    view = Scene.model_validate({**view.model_dump(exclude_unset=True), "camera": camera})
    inputs = prepare(view)
    drawn = np.concatenate([part.draw for part in rasterise(inputs)])
    assert (np.diff(drawn) < 0).any()
    np.testing.assert_array_equal(reference.render(view).pixels, np.broadcast_to([1, 0, 0], (SIZE, SIZE, 3)))


def test_large_draws_are_divided_and_kept_whole_where_that_is_asked(monkeypatch: pytest.MonkeyPatch) -> None:
    inputs = prepare(scene([{**BALL, "transform": {"translate": (x, 0, 0)}} for x in (-1.2, 0.0, 1.2)]))
    fragments = Fragments.joined(rasterise(inputs))
    counts = np.bincount(fragments.draw)
    monkeypatch.setattr(division, "PIECE", int(counts.min()) // 2)
    parts = list(division.by_structure(inputs, fragments))
    assert max(len(which) for _, which, _ in parts) <= division.PIECE
    assert sorted(np.concatenate([which for _, which, _ in parts]).tolist()) == list(range(len(fragments)))
    whole = [len(part) for _, _, part in division.by_draw(inputs, fragments, whole=True)]
    assert whole == counts.tolist()
    monkeypatch.setattr(division, "PIECE", int(counts.max()) + 1)
    together = [np.unique(fragments.draw[which]).tolist() for _, which, _ in division.by_sides(inputs, fragments, whole=True)]
    assert together == [[0], [1], [2]]


def test_visible_parts_are_those_of_the_picture() -> None:
    inputs = prepare(scene([{**BALL, "transform": {"translate": (x, 0, z)}} for x, z in ((-0.5, 0.0), (0.5, 1.0))]))
    parts = list(visible_parts(inputs))
    assert [part.draw for part in parts] == list(inputs.draws)
    pixels = np.concatenate([part.pixel for part in parts])
    assert len(pixels) == len(set(pixels.tolist())) > 100
