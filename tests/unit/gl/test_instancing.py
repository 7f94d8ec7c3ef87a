"""Instanced drawing: pictures of many objects in one draw call are the bytes of those that are drawn one by one."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

import glshade.gl.preparation as preparation
import glshade.gl.renderer as module
import glshade.glsl.batch as batching
from glshade import AssetError, Copies, Mesh, Object, Renderer, Scene, SceneError, explain
from glshade.assembly.assembly import assemble
from glshade.assembly.values import normal_matrices, normal_matrix
from glshade.glsl.batch import ATTRIBUTES, batches, room
from glshade.glsl.generator import generate
from glshade.glsl.instancing import with_instances
from glshade.glsl.planner import plans
from glshade.scene.digest import scene_digest
from glshade.verification.candidates import find_candidates
from glshade.verification.verdict import verdict_of

SUN, LAMP = {"type": "directional", "direction": (-1, -2, -1)}, {"type": "point", "position": (2, 3, 4), "intensity": 12.0}
SKY = {"type": "ambient", "intensity": 0.2}
CAMERA = {"eye": (0, 2, 9), "target": (0, 0, 0), "near": 0.5, "far": 30.0}
TILES = np.random.default_rng(5).integers(0, 255, (8, 8, 4), dtype=np.uint8)
BUMPS = np.random.default_rng(6).integers(100, 155, (8, 8, 3), dtype=np.uint8)


def placed(count: int, seed: int = 1) -> list[dict[str, Any]]:
    """Returns transforms of objects that stand apart from each other; every other one mirrors."""
    chance = np.random.default_rng(seed)
    places = [(x, y, z) for x in (-3, -1, 1, 3) for y in (-2, 0, 2) for z in (-2, 1, 4)][:count]
    return [
        {
            "translate": place,
            "rotate": tuple(map(float, chance.uniform(0, 360, 3))),
            "scale": (0.5 * (-1) ** number, *map(float, chance.uniform(0.3, 0.6, 2))),
        }
        for number, place in enumerate(places)
    ]


def swarm(count: int = 12, colours: int = 1, shape: Any = "cube", material: Any = None, **keys: Any) -> Scene:
    """Returns a scene of many objects with one shape. colours: the number of different materials."""
    model = {"brdf": "phong", "ks": 0.3, "exponent": 30.0, **(material or {})}
    objects = [
        {"shape": shape, "transform": transform, "material": {"kd": (0.1 + 0.07 * (n % colours), 0.5, 0.4), **model}, **keys}
        for n, transform in enumerate(placed(count))
    ]
    return Scene(objects=objects, lights=(SUN, LAMP, SKY), camera=CAMERA, film={"size": (64, 48)})


def anew(scene: Scene) -> Scene:
    """Returns an equal scene that a renderer prepares anew, because it has another film."""
    return scene.model_copy(update={"film": scene.film.model_copy()})


def sizes(renderer: Renderer) -> list[int]:
    """Returns the number of instances of each draw call of the last picture."""
    assert renderer.last_prepared is not None
    return [len(call.instances) for call in renderer.last_prepared.calls]


@pytest.fixture
def few(monkeypatch: pytest.MonkeyPatch) -> None:
    """Makes batches of as few as two instances."""
    monkeypatch.setattr(batching, "LEAST", 2)


SCENES: dict[str, Scene] = {
    "one colour": swarm(),
    "own colours": swarm(colours=12),
    "both sides": swarm(colours=3, sides="both"),
    "cut out": swarm(colours=12, material={"kd": {"texture": TILES}, "alpha_mode": "mask", "alpha": 0.9}),
    "bumpy": swarm(material={"normal_map": {"texture": BUMPS}}, shape={"type": "torus", "segments": 12, "sides": 8}),
    "emitting": swarm(colours=4, material={"emission": (0.1, 0.2, 0.3)}),
}


RATES = [*((name, "phong") for name in SCENES), ("own colours", "flat"), ("own colours", "gouraud"), ("bumpy", "gouraud")]


@pytest.mark.parametrize(("name", "rate"), RATES)
def test_the_bytes_of_one_by_one(name: str, rate: Any, renderer: Renderer, monkeypatch: pytest.MonkeyPatch) -> None:
    scene = SCENES[name]
    expected = renderer.render(scene, dtype="float32", shading=rate).pixels
    assert sizes(renderer) == [1] * 12
    monkeypatch.setattr(batching, "LEAST", 2)
    found = renderer.render(anew(scene), dtype="float32", shading=rate).pixels
    assert sorted(sizes(renderer)) in ([12], [6, 6]), "mirrored objects have a batch of their own"
    np.testing.assert_array_equal(found, expected)
    assert expected.std() > 0


@pytest.mark.usefixtures("few")
def test_object_numbers_are_those_of_the_instances(renderer: Renderer) -> None:
    scene = swarm(colours=12)
    depth, number = renderer.surfaces(scene)
    assert set(np.unique(number)) == {-1, *range(12)}
    alone = scene.model_copy(update={"objects": scene.objects[7:8]})
    mine, _ = renderer.surfaces(alone)
    assert (depth[number == 7] == mine[number == 7]).all()


@pytest.mark.usefixtures("few")
def test_what_is_never_drawn_together() -> None:
    glass = swarm(material={"alpha_mode": "blend", "alpha": 0.5})
    large = swarm(count=2, shape={"type": "sphere", "segments": 160, "rings": 80})
    paged = swarm().model_copy(update={"lights": swarm().lights * 300})
    for scene in (glass, large, paged):
        assembly = assemble(scene)
        found = list(batches(assembly, plans(assembly, "linear"), 0.0))
        assert all(len(batch.instances) == 1 for batch in found)


def test_a_batch_stands_at_the_place_of_its_first_instance(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = swarm(count=9)
    cone = Object(shape="cone", material=scene.objects[0].material)
    assembly = assemble(scene.model_copy(update={"objects": (scene.objects[0], cone, *scene.objects[1:])}))

    def order() -> list[list[int]]:
        return [[i.number for i in batch.instances] for batch in batches(assembly, plans(assembly, "linear"), 0.0)]

    assert order() == [[number] for number in range(10)]
    monkeypatch.setattr(batching, "LEAST", 5)
    # The objects 0, 3, 5, 7 and 9 mirror nothing; the other four are too few.
    assert order() == [[0, 3, 5, 7, 9], [1], [2], [4], [6], [8]]


@pytest.mark.usefixtures("few")
@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize("rate", ["flat", "gouraud", "phong"])
def test_the_attributes_fit(name: str, rate: Any) -> None:
    """The count of vectors that `room` assumes for the mesh and the transforms is not exceeded."""
    assembly = assemble(SCENES[name], rate)
    for batch in batches(assembly, plans(assembly, "srgb"), 0.0):
        names = {"u_world_from_object", "u_normal_from_object", "u_number", *batch.varying}
        written = with_instances(generate(batch.plan), tuple(sorted(names)))
        vectors = {"mat4": 4, "mat3": 3}
        inputs = [vectors.get(declaration.type, 1) for declaration in written.vertex.declarations("in")]
        assert sum(inputs) <= ATTRIBUTES
        assert sum(inputs) - sum(1 for name in batch.varying) <= ATTRIBUTES - room(batch.plan)


@pytest.mark.usefixtures("few")
def test_too_many_differing_values_make_several_batches(monkeypatch: pytest.MonkeyPatch, renderer: Renderer) -> None:
    scene = swarm(colours=3)
    monkeypatch.setattr(batching, "ATTRIBUTES", 9)
    pixels = renderer.render(scene, dtype="float32").pixels
    assert sorted(sizes(renderer)) == [2] * 6, "one for each colour and handedness"
    monkeypatch.setattr(batching, "LEAST", 99)
    np.testing.assert_array_equal(pixels, renderer.render(anew(scene), dtype="float32").pixels)


@pytest.mark.usefixtures("few")
def test_a_moved_camera_plans_and_compiles_nothing(renderer: Renderer, monkeypatch: pytest.MonkeyPatch) -> None:
    first = swarm(colours=12)
    views = [first.through(first.camera.model_copy(update={"eye": (x, 1.0, 9.0)})) for x in (-2.0, 0.5, 3.0)]
    expected = [renderer.render(anew(view)).pixels for view in views]
    # Pictures of two kinds in turn each have an earlier one to start from.
    for dtype in ("uint8", "float32"):
        renderer.render(first, dtype=dtype)  # type: ignore[arg-type]
    monkeypatch.setattr(module, "ready", lambda *arguments: pytest.fail("the scene was assembled again"))
    monkeypatch.setattr(preparation, "generate", lambda *arguments: pytest.fail("a program was written again"))
    for view, picture in zip(views, expected, strict=True):
        np.testing.assert_array_equal(renderer.render(view).pixels, picture)
        renderer.render(view, dtype="float32")
        assert sorted(sizes(renderer)) == [6, 6]


CUBE = Mesh.build([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)])


def poses(count: int) -> Any:
    """Returns poses (N, 4, 4) of objects that stand apart from each other."""
    return np.array([Object(transform={**each, "scale": (0.5, 0.4, 0.6)}).transform.array() for each in placed(count)])


def copies(given: Any, **keys: Any) -> Scene:
    """Returns a scene with one object that draws the tetrahedron at several poses."""
    item = {"name": "swarm", "mesh": Copies.build(CUBE, given), "material": {"brdf": "lambert", "kd": 0.6}, **keys}
    return Scene(objects=[item], lights=(SUN, SKY), camera=CAMERA, film={"size": (64, 48)})


def test_copies_are_the_picture_of_single_objects(renderer: Renderer) -> None:
    given, turn = poses(36), {"rotate": (0, 20, 0)}
    together = copies(given, transform=turn)
    single = [
        {"mesh": CUBE, "material": {"brdf": "lambert", "kd": 0.6}, "parent": "base", "transform": {"matrix": pose.tolist()}}
        for pose in given
    ]
    base = {"name": "base", "transform": turn}
    apart = Scene(objects=[base, *single], lights=(SUN, SKY), camera=CAMERA, film={"size": (64, 48)})
    for dtype in ("uint8", "float32"):
        found = renderer.render(together, dtype=dtype).pixels  # type: ignore[arg-type]
        np.testing.assert_array_equal(found, renderer.render(apart, dtype=dtype).pixels)  # type: ignore[arg-type]
        assert found.std() > 0
    _, number = renderer.surfaces(together)
    assert set(np.unique(number)) == {-1, 0}, "they are one object"
    assert [name for name, _ in explain(together).draws] == ["swarm"] * 36


def test_an_object_that_a_scene_holds_twice_has_two_numbers() -> None:
    item = copies(poses(3)).objects[0].model_copy(update={"name": None})
    scene = Scene(objects=[item, item], lights=(SUN,), camera=CAMERA, film={"size": (64, 48)})
    assert [instance.number for instance in assemble(scene).instances] == [0, 0, 0, 1, 1, 1]


def test_new_poses_need_no_new_program(renderer: Renderer, monkeypatch: pytest.MonkeyPatch) -> None:
    given = poses(36)
    first = renderer.render(copies(given)).pixels
    with monkeypatch.context() as patched:
        patched.setattr("glshade.gl.resources.Program", lambda *arguments: pytest.fail("a program was compiled"))
        given[:, 1, 3] += 0.5
        assert not np.array_equal(renderer.render(copies(given)).pixels, first)
    assert sizes(renderer) == [36]


def test_poses_count_in_the_digest_and_in_the_limits() -> None:
    given = poses(4)
    digest = scene_digest(copies(given))
    assert digest == scene_digest(copies(given.copy()))
    given[3, 0, 3] += 1e-9
    assert digest != scene_digest(copies(given))
    with pytest.raises(AssetError, match="allowed"):
        Copies.build(CUBE, np.tile(np.eye(4), (100_001, 1, 1)))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda a: a[0], r"poses have the shape \(4, 4\)"),
        (lambda a: a[:0], "at least one pose"),
        (lambda a: np.where(np.arange(4)[:, None, None] == 2, np.nan, a), r"poses\[2\] holds a number that is not finite"),
        (lambda a: a * np.where(np.arange(4) == 1, 2.0, 1.0)[:, None, None], r"poses\[1\] must have the last row"),
        (lambda a: np.concatenate([a, [np.diag([1.0, 0.0, 1.0, 1.0])]]), r"poses\[4\] flattens the mesh"),
    ],
)
def test_faults_of_poses(change: Any, message: str) -> None:
    with pytest.raises(AssetError, match=message):
        Copies.build(CUBE, change(poses(4)))


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ("abc", r"poses must hold real numbers, not <U3"),
        ([[1, 2], [3]], r"poses have rows of several lengths"),
        (np.tile(1j * np.eye(4), (2, 1, 1)), r"poses must hold real numbers, not complex128"),
        (np.broadcast_to(np.eye(4), (10**9, 4, 4)), r"poses draw 1,000,000,000 copies"),
    ],
)
def test_poses_that_are_no_matrices_of_numbers(given: Any, message: str) -> None:
    """They are refused in plain words, and before they are copied."""
    with pytest.raises(AssetError, match=message):
        Copies.build(CUBE, given)


def test_copies_need_a_mesh() -> None:
    corners: Any = (CUBE.positions, CUBE.triangles)
    with pytest.raises(AssetError, match=r"copies need a Mesh, such as Mesh.build returns, not tuple"):
        Copies.build(corners, poses(2))


@pytest.mark.parametrize("size", [1e-300, 1e-200, 1e200, 1e300])
def test_whether_a_pose_flattens_the_mesh_does_not_depend_on_its_scale(size: float) -> None:
    assert len(Copies.build(CUBE, np.diag([size, size, size, 1.0])[None]).poses) == 1
    with pytest.raises(AssetError, match="flattens"):
        Copies.build(CUBE, np.diag([size, 0.0, size, 1.0])[None])


def test_a_pose_beyond_the_range_is_a_fault_of_the_scene() -> None:
    far = poses(2)
    far[1, 0, 3] = 1e200
    with pytest.raises(SceneError, match=r"objects\[0\].mesh: poses\[1\]: together with the object's transform"):
        assemble(copies(far))


@pytest.mark.usefixtures("few")
@pytest.mark.parametrize("name", ["u_world_from_object", "u_normal_from_object", "u_kd"])
def test_verify_finds_values_of_the_wrong_instance(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    scene = swarm(count=8, colours=8)
    candidates = find_candidates(scene)
    upload = preparation.upload

    def shifted(context: Any, program: Any, values: Any) -> Any:
        assert name in values
        return upload(context, program, values | {name: np.roll(values[name], 1, axis=0)})

    with Renderer() as renderer:
        assert verdict_of(renderer.render(scene, dtype="float32").pixels, candidates, explain=False).verdict == "verified"
        monkeypatch.setattr(preparation, "upload", shifted)
        wrong = renderer.render(anew(scene), dtype="float32").pixels
    assert verdict_of(wrong, candidates, explain=False).verdict == "failed"


ENTRY = st.floats(-1e3, 1e3, allow_subnormal=False) | st.sampled_from([0.0, 1e-12, -1e9])


@settings(max_examples=60, deadline=None)
@given(arrays(np.float64, st.tuples(st.integers(1, 5), st.just(3), st.just(3)), elements=ENTRY))
def test_normal_matrices_are_those_of_single_matrices(linear: Any) -> None:
    linear = linear + np.eye(3) * (np.abs(np.linalg.det(linear)) < 1e-6)[:, None, None] * 1e4
    found = normal_matrices(linear)
    assert all(np.array_equal(matrix, normal_matrix(each)) for matrix, each in zip(found, linear, strict=True))


def test_the_text_of_an_instanced_program() -> None:
    (plan,) = explain(swarm(count=1)).programs
    plain = generate(plan)
    written = with_instances(plain, ("u_world_from_object", "u_kd", "u_of_another_program"))
    assert [d.type for d in written.vertex.declarations("in") if d.name.startswith("u_")] == ["mat4", "vec3"]
    assert "u_kd" not in [d.name for stage in written.stages for d in stage.declarations("uniform")]
    for stage in written.stages:
        assert len(stage.lines) == len(stage.text.splitlines()), "every line has its place"
    assert with_instances(plain, ()).code == plain.code
