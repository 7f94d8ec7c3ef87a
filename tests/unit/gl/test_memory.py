"""Memory: however many different scenes one Renderer draws, its caches stay within their limits."""

from __future__ import annotations

import gc
import json
import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any
from weakref import WeakSet, ref

import numpy as np
import pytest

from glshade import Image, Renderer, Scene
from glshade.gl import renderer as drawing
from glshade.gl import resources
from glshade.gl.frame import Frame
from glshade.gl.renderer import SCENES
from glshade.glsl.source import Source
from glshade.mesh.mesh import Mesh

COUNT = 200
AMBIENT = [{"type": "ambient"}]
MIB = 1 << 20
# The largest size of a process that has drawn any number of things, and how much it may grow once its caches are full [bytes].
# Measured on llvmpipe: at most 480 MiB and 50 MiB.
LARGEST, GROWTH = 600 * MIB, 96 * MIB


def scene(material: dict[str, Any] | None = None, size: tuple[int, int] = (4, 4), **subject: Any) -> Scene:
    thing = {**(subject or {"shape": "plane"}), "material": material or {"brdf": "lambert"}}
    return Scene.model_validate({"objects": [thing], "lights": AMBIENT, "film": {"size": size}})


@pytest.fixture
def limited(monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[..., Renderer]]:
    """`limited(TEXTURES=1000)` opens a Renderer whose resources have these limits [bytes]."""
    opened: list[Renderer] = []

    def limited(**limits: int) -> Renderer:
        for name, limit in limits.items():
            monkeypatch.setattr(resources, name, limit)
        opened.append(Renderer())
        return opened[-1]

    yield limited
    for renderer in opened:
        renderer.release()


def alive(references: list[ref[Any]]) -> int:
    """Returns the number of the objects that have not been freed."""
    gc.collect()
    return sum(reference() is not None for reference in references)


def test_meshes_die(limited: Callable[..., Renderer]) -> None:
    renderer = limited()
    meshes: list[ref[Any]] = []
    corners = np.array([[-1, 0, -1], [-1, 0, 1], [1, 0, 0]], dtype=np.float64)
    for number in range(COUNT):
        mesh = Mesh.build(corners * (1 + number), [[0, 1, 2]])
        meshes.append(ref(mesh))
        renderer.render(scene(mesh=mesh))
    del mesh
    assert alive(meshes) <= SCENES
    assert len(renderer.resources.vertices._buffers) <= 2 * SCENES


def test_large_scenes_are_not_kept(monkeypatch: pytest.MonkeyPatch, limited: Callable[..., Renderer]) -> None:
    """The scenes that stay prepared are few where each is large."""
    monkeypatch.setattr(drawing, "SCENES_SIZE", 1000)
    renderer = limited()
    kept: list[ref[Any]] = []
    for number in range(20):
        made = scene(shape={"type": "sphere", "segments": 8 + number, "rings": 8})
        renderer.render(made)
        kept.append(ref(renderer._prepared.get((id(made), None, "srgb", None, None))))
    assert alive(kept) == 1


def test_textures_die(limited: Callable[..., Renderer], tmp_path: Path) -> None:
    # 4 x 4, 2 x 2 and 1 texel of 4 bytes.
    size = (16 + 4 + 1) * 4
    renderer = limited(TEXTURES=10 * size)
    first = tmp_path / "first.png"
    Image(np.full((4, 4, 3), 128, dtype=np.uint8), "srgb").save(first)
    textures: list[ref[Any]] = []
    for number in range(COUNT):
        path = tmp_path / f"{number}.png"
        os.link(first, path)
        renderer.render(scene({"brdf": "lambert", "kd": {"texture": str(path)}}))
        textures.append(ref(next(reversed(renderer.resources._textures._kept.values()))[0]))
    assert renderer.resources._textures.size <= 10 * size
    assert alive(textures) == len(renderer.resources._textures) == 10


def test_a_texture_that_changes_does_not_stay(limited: Callable[..., Renderer], tmp_path: Path) -> None:
    """A file that is written again and again is a new texture each time."""
    # Linear colours of 8 bits take 8 bytes a texel.
    size = (16 + 4 + 1) * 8
    renderer = limited(TEXTURES=2 * size)
    path = tmp_path / "changes.png"
    for number in range(20):
        Image(np.full((4, 4, 3), 10 * number, dtype=np.uint8), "linear").save(path)
        os.utime(path, ns=(number, number))
        image = renderer.render(scene({"brdf": "lambert", "kd": {"texture": str(path), "encoding": "linear"}}), dtype="float32")
        assert image.pixels.max() == pytest.approx(10 * number / 255, abs=1e-6)
    assert len(renderer.resources._textures) == 2


def test_programs_die(limited: Callable[..., Renderer]) -> None:
    renderer = limited(PROGRAM=1, PROGRAMS=10)
    subject = scene()
    programs: list[ref[Any]] = []

    def numbered(source: Source, number: int) -> Source:
        stage = source.fragment
        assert stage is not None
        return replace(
            source, fragment=replace(stage, text=f"{stage.text}#define N {number}\n", lines=(*stage.lines, ("this test", 1)))
        )

    for number in range(COUNT // 4):
        renderer.rewrite = lambda source, number=number: numbered(source, number)
        renderer.render(subject, dtype="float32")
        programs.append(ref(next(reversed(renderer.resources._programs._kept.values()))[0]))
    assert alive(programs) == len(renderer.resources._programs) == 10


def test_frames_die(limited: Callable[..., Renderer]) -> None:
    limit = 10 * 32 * 32 * 8
    renderer = limited(FRAMES=limit)
    frames: WeakSet[Frame] = WeakSet()
    for number in range(COUNT):
        renderer.render(scene(size=(4 + number % 29, 4 + number % 31)))
        frames.add(next(reversed(renderer.resources._frames._kept.values()))[0])
    assert renderer.resources._frames.size <= limit
    gc.collect()
    assert len(frames) == len(renderer.resources._frames)
    assert len(renderer.resources._pixels) <= 2


def test_a_frame_larger_than_the_limit_is_drawn(limited: Callable[..., Renderer]) -> None:
    renderer = limited(FRAMES=1)
    for size in ((32, 16), (16, 32), (32, 16)):
        assert renderer.render(scene(size=size)).pixels.any()
    assert len(renderer.resources._frames) == resources.FRAMES_IN_USE


# Writes the files of many different things: a grid of triangles a file, or one picture under many names.
FILES = """
import os, sys
from pathlib import Path
import numpy as np

def grids(folder, count, n=20):
    at = np.arange(n * n).reshape(n, n)
    a, b, c, d = (x.ravel() + 1 for x in (at[:-1, :-1], at[:-1, 1:], at[1:, 1:], at[1:, :-1]))
    faces = "\\n".join(f"f {i} {j} {k}" for i, j, k in np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)]))
    x, y = (v.ravel() / n for v in np.mgrid[:n, :n])
    for number in range(count):
        z = np.sin((number + 1) * x) / 10
        vertices = "\\n".join(f"v {p:.4f} {q:.4f} {r:.4f}" for p, q, r in zip(x, y, z))
        path = folder / f"{number}.obj"
        path.write_text(f"{vertices}\\n{faces}\\n")
        yield path

def pictures(folder, count, side=1024):
    from glshade import Image
    first = folder / "first.png"
    ramp = np.linspace(0, 255, side).astype(np.uint8)
    Image(np.broadcast_to(ramp[:, None], (side, side, 3)).copy(), "srgb").save(first)
    for number in range(count):
        path = folder / f"{number}.png"
        os.link(first, path)
        yield path
"""
# One Renderer draws them. Prints the size of the process after every picture [bytes].
DRAWN = """
import json, resource
from glshade import Renderer, Scene
kind, folder, count = sys.argv[1], Path(sys.argv[2]), int(sys.argv[3])
def resident():
    return int(Path("/proc/self/statm").read_text().split()[1]) * resource.getpagesize()
def scenes():
    light = {"type": "directional"}
    if kind == "meshes":
        for path in grids(folder, count):
            yield {"mesh": path}, [light]
    elif kind == "textures":
        for path in pictures(folder, count):
            yield {"shape": "plane", "material": {"brdf": "lambert", "kd": {"texture": path}}}, [light]
    else:
        for number in range(count):
            point, spot = {"type": "point", "position": [1, 1, 1]}, {"type": "spot", "position": [1, 1, 1]}
            yield {"shape": "plane"}, [light] * (1 + number // 36) + [point] * (number // 6 % 6) + [spot] * (number % 6)
sizes = []
with Renderer() as renderer:
    for thing, lights in scenes():
        renderer.render(Scene.model_validate({"objects": [thing], "lights": lights, "film": {"size": [16, 16]}}))
        sizes.append(resident())
print(json.dumps(sizes))
"""


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "count", "full"), [("meshes", 2000, 50), ("textures", 300, 50), ("programs", 180, 110)])
def test_a_process_stays_small(kind: str, count: int, full: int, tmp_path: Path) -> None:
    """full: how many of the things fill the caches."""
    if not Path("/proc/self/statm").exists():
        pytest.skip("this system does not say how much memory a process has")
    command = [sys.executable, "-c", FILES + DRAWN, kind, str(tmp_path), str(count)]
    environment = {**os.environ, "XDG_CACHE_HOME": str(tmp_path / "cache")}
    done = subprocess.run(command, capture_output=True, text=True, env=environment, check=False)
    assert done.returncode == 0, done.stderr
    sizes = json.loads(done.stdout)
    after, last, largest = (size // MIB for size in (sizes[full], sizes[-1], max(sizes)))
    print(f"{kind}: {after} MiB after {full}, {last} MiB after {count}, at most {largest} MiB")
    assert max(sizes) < LARGEST
    assert sizes[-1] - sizes[full] < GROWTH


# The command draws a batch in one worker process. Prints the size of the largest process [bytes].
BATCH = """
import resource, subprocess
kind, folder, count = sys.argv[1], Path(sys.argv[2]), int(sys.argv[3])
if kind == "meshes":
    things = [*grids(folder, count)]
else:
    things = [folder / f"{number}.json" for number in range(count)]
    for path, picture in zip(things, pictures(folder, count)):
        kd = f'{{"texture": "{picture}"}}'
        path.write_text(f'{{"objects": [{{"shape": "plane", "material": {{"brdf": "lambert", "kd": {kd}}}}}]}}')
command = [sys.executable, "-m", "glshade", "render", *things, "-o", str(folder / "drawn" / "{scene}.png")]
subprocess.run([*command, "--size", "16x16", "--jobs", "1"], check=True, stdout=sys.stderr)
assert len(list((folder / "drawn").glob("*.png"))) == count
print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss * 1024)
"""


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "count", "full"), [("meshes", 2000, 50), ("textures", 300, 50)])
def test_a_batch_stays_small(kind: str, count: int, full: int, tmp_path: Path) -> None:
    """A batch of many is no larger than one that only fills the caches."""
    largest = {}
    for number in (full, count):
        folder = tmp_path / str(number)
        folder.mkdir()
        command = [sys.executable, "-c", FILES + BATCH, kind, str(folder), str(number)]
        environment = {**os.environ, "XDG_CACHE_HOME": str(folder / "cache")}
        done = subprocess.run(command, capture_output=True, text=True, env=environment, check=False)
        assert done.returncode == 0, done.stderr
        largest[number] = int(done.stdout)
    print(f"{kind}: at most {largest[full] / MIB:.0f} MiB for {full}, {largest[count] / MIB:.0f} MiB for {count}")
    assert largest[count] < LARGEST
    assert largest[count] - largest[full] < GROWTH
