"""Comparison with pyrender: the figures of docs/pyrender.md for each kind of scene, and pyrender's own example and test.

The example and the test need a checkout of pyrender's repository: GLSHADE_PYRENDER_EXAMPLES=/path/to/its/checkout.
"""

from __future__ import annotations

import importlib.util
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

# Draws every kind of scene with both renderers in one process, and writes the pictures to argv[1].
DRAW = """
import sys
import warnings
import numpy as np
import pyrender
import trimesh
from glshade.pyrender import OffscreenRenderer

warnings.simplefilter("ignore")

def look(x, y, z):
    back = np.array([x, y, z]) / np.linalg.norm([x, y, z])
    right = np.cross([0, 0, 1], back) / np.linalg.norm(np.cross([0, 0, 1], back))
    return np.vstack([np.column_stack([right, np.cross(back, right), back, [x, y, z]]), [0, 0, 0, 1]])

def at(x, y, z):
    return trimesh.transformations.translation_matrix([x, y, z])

def stage(*meshes, camera=None):
    scene = pyrender.Scene(bg_color=[0.2, 0.3, 0.4, 1.0], ambient_light=[0.05] * 3)
    for mesh, pose in meshes:
        scene.add(mesh, pose=pose)
    scene.add(pyrender.DirectionalLight(intensity=3.0), pose=look(-1, -2, 2))
    scene.add(pyrender.PointLight(color=[1, 0.6, 0.3], intensity=3.0), pose=look(1, -1, 1))
    spot = pyrender.SpotLight(color=[0.3, 0.6, 1], intensity=15.0, innerConeAngle=0.1, outerConeAngle=0.6)
    scene.add(spot, pose=look(-1.2, -1.5, 0.2))
    scene.add(camera or pyrender.PerspectiveCamera(yfov=0.7, znear=0.1, zfar=10.0), pose=look(0, -2.5, 0.6))
    return scene

def material(**changes):
    return pyrender.MetallicRoughnessMaterial(
        **{"baseColorFactor": [0.8, 0.4, 0.2, 1.0], "metallicFactor": 0.0, "roughnessFactor": 0.5, **changes})

def picture(red, green, blue):
    codes = np.clip(np.stack(np.broadcast_arrays(red, green, blue), axis=-1), 0, 1) * 255
    return pyrender.Texture(source=codes.astype(np.uint8), source_channels="RGB")

def board(**changes):
    x, z = (c.ravel() for c in np.meshgrid(np.linspace(-0.6, 0.6, 8), np.linspace(-0.6, 0.6, 8)))
    first = np.array([8 * i + j for i in range(7) for j in range(7)])
    faces = np.concatenate([np.stack([first, first + 1, first + 9], 1), np.stack([first, first + 9, first + 8], 1)])
    primitive = pyrender.Primitive(positions=np.stack([x, 0 * x, z], 1), normals=np.tile([0.0, -1, 0], (64, 1)), indices=faces,
        texcoord_0=np.stack([x, z], 1) / 1.2 + 0.5, material=material(**changes), mode=4)
    return pyrender.Mesh([primitive]), np.eye(4)

ball = trimesh.creation.icosphere(subdivisions=3, radius=0.5)
mesh_of = pyrender.Mesh.from_trimesh
rng = np.random.default_rng(0)
speckled, patched = ball.copy(), trimesh.creation.box(extents=[0.7] * 3)
speckled.visual.vertex_colors = rng.integers(0, 255, (len(ball.vertices), 4)) | [0, 0, 0, 255]
patched.visual.face_colors = rng.integers(0, 255, (12, 4)) | [0, 0, 0, 255]
v, u = np.mgrid[:64, :64] / 64
tilt = 0.6 * np.cos(12 * u)
up = 1 / np.hypot(tilt, 1)
glass = material(baseColorFactor=[0.2, 0.9, 0.3, 0.5], alphaMode="BLEND")
plain = mesh_of(ball, material=material()), np.eye(4)
quarters = [np.diag([0.4, 0.4, 0.4, 1]) @ at(x, 0, z) for x in (-1, 1) for z in (-1, 1)]
line = np.array([[-0.5, 0, -0.4], [0.5, 0, 0.4], [-0.5, 0.2, 0.4], [0.5, -0.8, -0.4]])
kinds = {
    "dielectric": stage(plain),
    "smooth dielectric": stage((mesh_of(ball, material=material(roughnessFactor=0.2)), np.eye(4))),
    "metal": stage((mesh_of(ball, material=material(metallicFactor=1.0, roughnessFactor=0.4)), np.eye(4))),
    "rough metal": stage((mesh_of(ball, material=material(metallicFactor=1.0, roughnessFactor=0.9)), np.eye(4))),
    "default material, faces": stage((mesh_of(ball, smooth=False), np.eye(4))),
    "vertex colours": stage((mesh_of(speckled), np.eye(4))),
    "face colours": stage((mesh_of(patched, smooth=False), trimesh.transformations.rotation_matrix(0.5, [0, 0, 1]))),
    "textured": stage(board(baseColorTexture=picture(0.2 + 0.6 * u, 0.9 - 0.6 * v, 0.5 + 0.4 * np.sin(12 * u)))),
    "normal map": stage(board(normalTexture=picture(0.5 + 0.5 * tilt * up, 0.5, 0.5 + 0.5 * up))),
    "metallic and rough map": stage(
        board(metallicFactor=1.0, roughnessFactor=1.0, metallicRoughnessTexture=picture(0, 0.3 + 0.6 * u, v))),
    "blended": stage(plain, (mesh_of(ball, material=glass), at(0.2, -0.8, 0))),
    "instances": stage((mesh_of(ball, material=material(), poses=quarters), np.eye(4))),
    "points": stage((pyrender.Mesh.from_points(ball.vertices, colors=rng.uniform(size=ball.vertices.shape)), np.eye(4))),
    "lines": stage((pyrender.Mesh([pyrender.Primitive(positions=line, mode=1, material=material())]), np.eye(4))),
    "wireframe": stage((mesh_of(trimesh.creation.icosphere(2, 0.5), material=material(), wireframe=True), np.eye(4))),
    "orthographic": stage(plain, camera=pyrender.OrthographicCamera(xmag=1, ymag=0.8, znear=0.1, zfar=10.0)),
    "intrinsics": stage(plain, camera=pyrender.IntrinsicsCamera(fx=300, fy=280, cx=150, cy=130, znear=0.1, zfar=10.0)),
    "no far plane": stage(plain, camera=pyrender.PerspectiveCamera(yfov=0.7, znear=0.1)),
}
theirs, ours = pyrender.OffscreenRenderer(320, 240), OffscreenRenderer(320, 240)
flags = pyrender.RenderFlags
kept = {}
for kind, scene in kinds.items():
    for who, renderer in (("theirs", theirs), ("ours", ours)):
        kept[f"{kind} colour {who}"], kept[f"{kind} depth {who}"] = renderer.render(scene)
        kept[f"{kind} flat {who}"], _ = renderer.render(scene, flags.FLAT)
        kept[f"{kind} alone {who}"] = renderer.render(scene, flags.DEPTH_ONLY)
        colours = {node: 40 * (i + 1) for i, node in enumerate(scene.mesh_nodes)}
        kept[f"{kind} segments {who}"], kept[f"{kind} middle {who}"] = renderer.render(scene, flags.SEG, colours)
np.savez(sys.argv[1], **kept)
"""


def run(*arguments: str, folder: Path | None = None) -> subprocess.CompletedProcess[str]:
    """Runs Python in a process of its own, where pyrender uses EGL. folder: the working directory."""
    return subprocess.run(
        [sys.executable, *arguments],
        capture_output=True,
        text=True,
        env={**os.environ, "PYOPENGL_PLATFORM": "egl"},
        cwd=folder,
        timeout=300,
        check=False,
    )


# Creates pyrender's smallest renderer, to find out whether it works on this machine.
TRY_PYRENDER = "import pyrender; pyrender.OffscreenRenderer(8, 8).delete()"


@pytest.fixture(scope="module")
def pyrender_draws() -> None:
    """Skips the tests where pyrender cannot draw."""
    if importlib.util.find_spec("pyrender") is None:
        pytest.skip("pyrender is not installed: pip install 'glshade[pyrender]'")
    done = run("-c", TRY_PYRENDER)
    if done.returncode:
        pytest.skip(f"pyrender cannot draw on this machine: {(done.stderr.strip().splitlines() or ['no message'])[-1]}")


@pytest.fixture(scope="module")
def drawn(pyrender_draws: None, tmp_path_factory: pytest.TempPathFactory) -> Any:
    """The pictures of every kind of scene by both renderers."""
    path = tmp_path_factory.mktemp("pictures") / "pictures.npz"
    done = run("-c", DRAW, str(path))
    assert done.returncode == 0, done.stderr
    return np.load(path)


# kind -> the largest (mean, 95th percentile) of the differences between pixels that show a surface, in 8-bit codes of the
# channel that differs most
FIGURES = {
    "dielectric": (4, 6),
    "smooth dielectric": (4, 6),
    "metal": (6, 11),
    "rough metal": (8, 17),
    "default material, faces": (5, 7),
    "vertex colours": (16, 24),
    "face colours": (16, 24),
    "textured": (4, 5),
    "normal map": (5, 6),
    "metallic and rough map": (3, 4),
    "blended": (4, 6),
    "instances": (4, 7),
    "points": (1, 2),
    "lines": (5, 10),
    "wireframe": (4, 7),
    "orthographic": (5, 8),
    "intrinsics": (4, 6),
    "no far plane": (4, 6),
}


@pytest.mark.slow
@pytest.mark.parametrize("kind", FIGURES)
def test_colours_differ_by_the_stated_figures(drawn: Any, kind: str) -> None:
    theirs, ours = (drawn[f"{kind} colour {who}"].astype(int) for who in ("theirs", "ours"))
    seen = drawn[f"{kind} depth ours"] > 0
    assert seen.sum() > 100
    np.testing.assert_array_equal(ours[0, 0], theirs[0, 0])
    difference = np.abs(ours - theirs).max(axis=2)[seen]
    mean, most = FIGURES[kind]
    assert difference.mean() <= mean
    assert np.percentile(difference, 95) <= most
    # The scene is lit, so that the two do not merely agree on black.
    assert kind == "points" or np.ptp(ours[seen]) > 50


@pytest.mark.parametrize("kind", FIGURES)
def test_base_colours_and_segments_are_the_same(drawn: Any, kind: str) -> None:
    flat, segments = (
        np.abs(drawn[f"{kind} {what} ours"].astype(int) - drawn[f"{kind} {what} theirs"]).max(axis=2)
        for what in ("flat", "segments")
    )
    # pyrender extrapolates vertex colours at outlines to places outside the triangle. Textures are averaged in linear light.
    assert np.percentile(flat, 99) <= (12 if kind == "vertex colours" else 1)
    # Without several samples, pyrender draws lines by OpenGL's rules for lines, which cover other pixels than strips.
    assert (segments > 0).sum() <= (200 if kind == "lines" else 3)


@pytest.mark.parametrize("kind", FIGURES)
def test_depth_agrees_to_pyrenders_precision(drawn: Any, kind: str) -> None:
    """In every mode the same pixels are covered, and depths differ by few of its steps."""
    for what in ("depth", "alone", "middle"):
        theirs, ours = drawn[f"{kind} {what} theirs"], drawn[f"{kind} {what} ours"].astype(np.float64)
        assert ((theirs > 0) != (ours > 0)).sum() <= (200 if (kind, what) == ("lines", "middle") else 3)
        if kind == "orthographic":
            # pyrender inverts a perspective projection by mistake. The value of the depth buffer gives the right distance.
            window = (1 / theirs.astype(np.float64, copy=True).clip(1e-9) - 1 / 0.1) / (1 / 10 - 1 / 0.1)
            theirs = np.where(theirs > 0, 0.1 + window * 9.9, 0)
        both = (theirs > 0) & (ours > 0)
        # At the distance 2.5, pyrender's 2^24 steps from 0.1 to 10 are relative steps of 1.5e-6. OpenGL ends lines elsewhere.
        difference = np.abs(theirs - ours)[both] / ours[both]
        assert np.percentile(difference, 99) <= (1e-3 if kind == "lines" else 4e-6)


# --- pyrender's example and test ---------------------------------------------------------------------------------------

# Runs the file argv[2] unchanged, with the renderer that argv[1] names, and writes all pictures to argv[3]. The window and the
# plot that it opens are replaced by functions that do nothing.
RUN = """
import sys
import types
import warnings
import numpy as np
import pyrender
warnings.simplefilter("ignore")
who, path, result = sys.argv[1:]
if who == "glshade":
    from glshade.pyrender import OffscreenRenderer
    pyrender.OffscreenRenderer = OffscreenRenderer
pyrender.Viewer = lambda *arguments, **settings: None
plot = types.ModuleType("matplotlib.pyplot")
plot.figure = plot.imshow = plot.show = lambda *arguments: None
sys.modules["matplotlib.pyplot"] = plot
sys.modules["matplotlib"] = types.ModuleType("matplotlib")
sys.modules["matplotlib"].pyplot = plot
seen = []
class Watched(pyrender.OffscreenRenderer):
    def render(self, *arguments, **settings):
        seen.append(super().render(*arguments, **settings))
        return seen[-1]
pyrender.OffscreenRenderer = Watched
np.random.seed(0)
names = {"__name__": "example"}
exec(compile(open(path).read(), path, "exec"), names)
if "test_offscreen_renderer" in names:
    names["test_offscreen_renderer"](None)
np.savez(result, **{f"{kind}{i}": array for i, pair in enumerate(seen) for kind, array in zip(("colour", "depth"), pair)})
"""


@pytest.fixture(scope="module")
def checkout() -> Path:
    """The checkout of pyrender's repository; skips the tests where there is none."""
    given = os.environ.get("GLSHADE_PYRENDER_EXAMPLES")
    if not given:
        pytest.skip("GLSHADE_PYRENDER_EXAMPLES does not name a checkout of pyrender's repository")
    models = Path(given) / "examples" / "models"
    missing = [name for name in ("fuze.obj", "drill.obj", "wood.obj", "WaterBottle.glb") if not (models / name).is_file()]
    if missing:
        pytest.skip(f"{models} lacks {', '.join(missing)}")
    return Path(given)


@pytest.mark.parametrize(("folder", "file"), [("examples", "example.py"), (".", "tests/unit/test_offscreen.py")])
def test_pyrenders_example_and_test_run_unchanged(
    pyrender_draws: None, checkout: Path, tmp_path: Path, folder: str, file: str
) -> None:
    results = []
    for who in ("pyrender", "glshade"):
        result = tmp_path / f"{who}.npz"
        done = run("-c", RUN, who, file, str(result), folder=checkout / folder)
        assert done.returncode == 0, done.stderr
        results.append(np.load(result))
    theirs, ours = results
    assert set(ours) == set(theirs)
    assert ours["depth0"].any()
    for name in ours:
        assert ours[name].shape == theirs[name].shape
        if name.startswith("depth"):
            covered = (ours[name] > 0) & (theirs[name] > 0)
            assert ((ours[name] > 0) != (theirs[name] > 0)).mean() < 1e-3
            assert np.percentile(np.abs(ours[name] - theirs[name])[covered] / ours[name][covered], 99) < 1e-4
    difference = np.abs(ours["colour0"].astype(int) - theirs["colour0"]).max(axis=2)[ours["depth0"] > 0]
    assert difference.mean() < 16
    if "colour1" in ours:
        # example.py numbers the members of a set for its segments, and their order differs between processes.
        assert (ours["colour1"].any(axis=2) != theirs["colour1"].any(axis=2)).mean() < 1e-3
        assert len(np.unique(ours["colour1"])) == len(np.unique(theirs["colour1"])) > 3
