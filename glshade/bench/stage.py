"""Stage: makes the scene of all works, as arrays for the programs that are compared and as a scene file for glshade.

The scene is a unit sphere of triangles, seen by a perspective camera in a square picture. The sphere is diffuse with a Phong
highlight. A little ambient light falls on it, and either white light from one direction or the light of eight coloured point
lights. Pixel values are linear, without encoding.

This module imports nothing large but NumPy at its start: each new process of a program imports it, and that time is measured.
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

# Vertical field of view [degrees]; distances of the near and the far plane [scene units].
FOV, NEAR, FAR = 45.0, 0.5, 10.0
# Distance of the camera from the centre of the sphere [scene units].
DISTANCE = 3.0
EYE = (0.0, 0.0, DISTANCE)
# The Phong material: diffuse and specular reflectance, exponent; intensity of the ambient light.
KD, KS, EXPONENT, AMBIENT = (0.8, 0.3, 0.2), 0.5, 32.0, 0.1
TO_LIGHT = tuple(float(x) for x in np.array([0.5, 0.7, 1.0]) / np.linalg.norm([0.5, 0.7, 1.0]))
# Number of point lights, and their angles about the view axis [turns].
LAMPS = 8
_turns = np.arange(LAMPS) / LAMPS
# The point lights stand on a circle in front of the sphere, alternately nearer and farther. They have different hues, and are
# so dim that all eight together stay below white.
POSITIONS = np.stack([3 * np.cos(2 * np.pi * _turns), 3 * np.sin(2 * np.pi * _turns), 2 + 0.5 * (np.arange(LAMPS) % 2)], axis=1)
COLOURS = 0.25 * (0.6 + 0.4 * np.cos(2 * np.pi * (_turns[:, None] + np.arange(3) / 3)))
# Number of frames in which the camera goes once around the sphere.
TURN = 100


def eye(frame: int) -> tuple[float, float, float]:
    """Returns the camera's position in a frame; frame 1 is at EYE, and the camera turns about +y."""
    angle = 2 * np.pi * (frame - 1) / TURN
    return float(DISTANCE * np.sin(angle)), 0.0, float(DISTANCE * np.cos(angle))


def look_at(eye: Any) -> Array:
    """Returns the matrix (4, 4) from world space to the space of a camera at `eye` that looks at the origin, with +y up."""
    z = np.asarray(eye, dtype=float)
    z = z / np.linalg.norm(z)
    x = np.cross((0.0, 1.0, 0.0), z)
    x /= np.linalg.norm(x)
    view = np.eye(4)
    view[:3, :3] = x, np.cross(z, x), z
    view[:3, 3] = -view[:3, :3] @ eye
    return view


def perspective() -> Array:
    """Returns the matrix (4, 4) from view space to OpenGL's clip space."""
    t = 1 / np.tan(np.radians(FOV) / 2)
    depth = (FAR + NEAR) / (NEAR - FAR), 2 * FAR * NEAR / (NEAR - FAR)
    return np.array([[t, 0, 0, 0], [0, t, 0, 0], [0, 0, *depth], [0, 0, -1, 0]])


@dataclass(frozen=True)
class WorkFiles:
    """The files of a work's scene.

    mesh: path of an .npz file with the arrays that `arrays` returns
    scene: path of a .toml scene file with the same mesh
    side: width and height of the picture [pixels]
    lights: "directional" or "points"
    frames: number of frames of the animation
    """

    mesh: str
    scene: str
    side: int
    lights: str
    frames: int

    @classmethod
    def load(cls, path: str) -> WorkFiles:
        """Reads the file that `set_up` wrote."""
        return cls(**json.loads(Path(path).read_text(encoding="utf-8")))

    def arrays(self) -> tuple[Array, Array]:
        """Returns (positions (V, 3) float32, triangles (T, 3) uint32). The normals equal the positions."""
        with np.load(self.mesh) as file:
            return file["positions"], file["triangles"]


def sphere(subdivisions: int, scattered: bool = False) -> tuple[Array, Array]:
    """Returns (positions (V, 3) float32, triangles (T, 3) uint32) of a unit sphere.

    subdivisions: number n of subdivisions of the icosahedron; the sphere has 20 * 4^n triangles
    scattered: True shuffles vertices and triangles; False puts neighbours near each other in the arrays
    """
    from glshade.mesh.order import in_local_order
    from glshade.mesh.primitives import icosphere

    mesh = in_local_order(icosphere(subdivisions))
    positions, triangles = mesh.positions, mesh.triangles
    if scattered:
        # The seed is fixed. A driver takes as long for this order as for the order of plain subdivision, to within 2 %.
        random = np.random.default_rng(0)
        moved = random.permutation(len(positions))
        place = np.empty(len(positions), dtype=np.uint32)
        place[moved] = np.arange(len(positions), dtype=np.uint32)
        positions, triangles = positions[moved], place[random.permutation(triangles)]
    return positions, triangles


def set_up(work: Work, folder: Path) -> Path:
    """Writes the mesh and the scene of a work to a folder, and returns the path of the work's `WorkFiles`."""
    positions, triangles = sphere(work.subdivisions, work.scattered)
    mesh, scene, path = folder / "mesh.npz", folder / "scene.toml", folder / "stage.json"
    np.savez(mesh, positions=positions, triangles=triangles)
    write_ply(folder / "mesh.ply", positions, triangles)
    scene.write_text(scene_text(work), encoding="utf-8")
    path.write_text(json.dumps(asdict(WorkFiles(str(mesh), str(scene), work.side, work.lights, work.frames))), encoding="utf-8")
    return path


def write_ply(path: Path, positions: Array, triangles: Array) -> None:
    """Writes a binary PLY file of positions (V, 3) and triangles (T, 3). The positions are written as normals too."""
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
    """Returns the text of the scene file, which refers to `mesh.ply` and turns the camera around the sphere."""
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
