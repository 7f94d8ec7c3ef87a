"""Stage: the scene of all works, as arrays for the programs that are compared and as a scene file for glshade.

A unit sphere of triangles, seen by a square perspective camera: diffuse and a Phong highlight under white light from one
direction, or under eight coloured lamps, and a little ambient light. Values are linear and stay so: no encoding.

NumPy only: what a cold process imports here is on the bill of each program.
"""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.bench.works import Work

Array = NDArray[Any]

FOV, NEAR, FAR = 45.0, 0.5, 10.0  # vertical [degrees]; planes [scene units]
DISTANCE = 3.0
EYE = (0.0, 0.0, DISTANCE)
KD, KS, EXPONENT, AMBIENT = (0.8, 0.3, 0.2), 0.5, 32.0, 0.1
TO_LIGHT = tuple(float(x) for x in np.array([0.5, 0.7, 1.0]) / np.linalg.norm([0.5, 0.7, 1.0]))
LAMPS = 8
_turns = np.arange(LAMPS) / LAMPS
# Round the sphere, nearer and farther in turn; all hues; dim enough that eight of them stay below white.
POSITIONS = np.stack([3 * np.cos(2 * np.pi * _turns), 3 * np.sin(2 * np.pi * _turns), 2 + 0.5 * (np.arange(LAMPS) % 2)], axis=1)
COLOURS = 0.25 * (0.6 + 0.4 * np.cos(2 * np.pi * (_turns[:, None] + np.arange(3) / 3)))
# Frames of a whole turn.
TURN = 100


def eye(frame: int) -> tuple[float, float, float]:
    """Where the camera is in a frame: 1 is EYE, then round about +y."""
    angle = 2 * np.pi * (frame - 1) / TURN
    return float(DISTANCE * np.sin(angle)), 0.0, float(DISTANCE * np.cos(angle))


def look_at(eye: Any) -> Array:
    """(4, 4) view from world of a camera that looks at the origin, +y up."""
    z = np.asarray(eye, dtype=float)
    z = z / np.linalg.norm(z)
    x = np.cross((0.0, 1.0, 0.0), z)
    x /= np.linalg.norm(x)
    view = np.eye(4)
    view[:3, :3] = x, np.cross(z, x), z
    view[:3, 3] = -view[:3, :3] @ eye
    return view


def perspective() -> Array:
    """(4, 4) OpenGL's clip from view."""
    t = 1 / np.tan(np.radians(FOV) / 2)
    depth = (FAR + NEAR) / (NEAR - FAR), 2 * FAR * NEAR / (NEAR - FAR)
    return np.array([[t, 0, 0, 0], [0, t, 0, 0], [0, 0, *depth], [0, 0, -1, 0]])


@dataclass(frozen=True)
class Stage:
    """The scene of a work on disk. mesh: an .npz with what `arrays` gives; scene: a .toml with the same; side [pixels];
    frames: how many of an animation."""

    mesh: str
    scene: str
    side: int
    lights: str
    frames: int

    @classmethod
    def load(cls, path: str) -> Stage:
        """What `set_up` wrote."""
        return cls(**json.loads(Path(path).read_text(encoding="utf-8")))

    def arrays(self) -> tuple[Array, Array]:
        """Positions (V, 3) float32, which are the normals too, and triangles (T, 3) uint32."""
        with np.load(self.mesh) as held:
            return held["positions"], held["triangles"]


def sphere(subdivisions: int, scattered: bool = False) -> tuple[Array, Array]:
    """Positions (V, 3) float32 and triangles (T, 3) uint32, in local order, or shuffled."""
    from glshade.mesh.mesh import in_local_order
    from glshade.mesh.primitives import icosphere

    mesh = in_local_order(icosphere(subdivisions))
    positions, triangles = mesh.positions, mesh.triangles
    if scattered:
        # Always the same disorder; a driver takes it as it takes the order of plain subdivision, within 2 %.
        random = np.random.default_rng(0)
        moved = random.permutation(len(positions))
        place = np.empty(len(positions), dtype=np.uint32)
        place[moved] = np.arange(len(positions), dtype=np.uint32)
        positions, triangles = positions[moved], place[random.permutation(triangles)]
    return positions, triangles


def set_up(work: Work, folder: Path) -> Path:
    """Writes mesh and scene of a work into a folder; the path of its `Stage`."""
    positions, triangles = sphere(work.subdivisions, work.scattered)
    mesh, scene, path = folder / "mesh.npz", folder / "scene.toml", folder / "stage.json"
    np.savez(mesh, positions=positions, triangles=triangles)
    write_ply(folder / "mesh.ply", positions, triangles)
    scene.write_text(scene_text(work), encoding="utf-8")
    path.write_text(json.dumps(asdict(Stage(str(mesh), str(scene), work.side, work.lights, work.frames))), encoding="utf-8")
    return path


def write_ply(path: Path, positions: Array, triangles: Array) -> None:
    """A binary PLY file with the positions as normals."""
    header = ["ply", "format binary_little_endian 1.0", f"element vertex {len(positions)}"]
    header += [f"property float {name}" for name in ("x", "y", "z", "nx", "ny", "nz")]
    header += [f"element face {len(triangles)}", "property list uchar int vertex_indices", "end_header", ""]
    faces = np.empty(len(triangles), dtype=[("count", "u1"), ("corners", "<u4", 3)])
    faces["count"], faces["corners"] = 3, triangles
    with path.open("wb") as file:
        file.write("\n".join(header).encode())
        file.write(np.hstack([positions, positions]).astype("<f4").tobytes())
        file.write(faces.tobytes())


def scene_text(work: Work) -> str:
    """The scene file: `mesh.ply` beside it, and a turntable."""
    if work.lights == "points":
        lamps = [
            f'[[lights]]\ntype = "point"\nposition = {p.tolist()}\ncolour = {c.tolist()}\nfalloff = "none"\n'
            for p, c in zip(POSITIONS, COLOURS, strict=True)
        ]
    else:
        lamps = [f'[[lights]]\ntype = "directional"\ndirection = {[-x for x in TO_LIGHT]}\n']
    last = 360 * (work.frames - 1) / TURN
    turn = f'[[animation]]\nkey = "camera.turn"\nframes = [1, {work.frames}]\nvalues = [0, {last}]\n' if work.frames > 1 else ""
    return f"""\
[film]
size = [{work.side}, {work.side}]
encoding = "linear"

[camera]
eye = {list(EYE)}
target = [0, 0, 0]
fov = {FOV}
near = {NEAR}
far = {FAR}

[[objects]]
mesh = "mesh.ply"
material = {{ brdf = "phong", kd = {list(KD)}, ks = {KS}, exponent = {EXPONENT}, ka = {[AMBIENT * x for x in KD]} }}

[[lights]]
type = "ambient"

{"".join(lamps)}
{turn}"""
