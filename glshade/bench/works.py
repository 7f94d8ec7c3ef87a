"""Works: lists the pieces of work by which docs/benchmarks.md compares programs, and the targets for glshade."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Literal

# Names of programs: glshade itself, glshade where it draws pyrender's scenes, and the peer that is written by hand with
# moderngl alone. As a key of targets, FASTEST stands for the fastest peer.
GLSHADE, DOOR, BY_HAND, FASTEST = "glshade", "glshade.pyrender", "moderngl", "fastest"


@dataclass(frozen=True)
class Work:
    """One piece of work that every program does.

    what: description for the table's title
    kind: "frame" draws one picture in memory repeatedly; "files" writes `frames` PNG files; "cold" writes one PNG file in a new
        process
    subdivisions: number n of subdivisions of the icosahedron; the sphere has 20 * 4^n triangles
    side: width and height of the picture [pixels]
    lights: "directional" for one directional light, "points" for eight point lights
    scattered: True shuffles triangles and vertices
    frames: number of frames
    targets: program -> largest time of glshade, as a fraction of that program's time; the key "peers" stands for every program
        that draws the same picture
    limit: largest time of glshade's whole command [s]; None if there is no limit
    """

    what: str
    kind: Literal["frame", "files", "cold"] = "frame"
    subdivisions: int = 5
    side: int = 1024
    lights: Literal["directional", "points"] = "directional"
    scattered: bool = False
    frames: int = 1
    targets: Mapping[str, float] = field(default_factory=dict)
    limit: float | None = None

    def small(self) -> Work:
        """Returns a reduced work that takes only a moment, for a quick test. Its times are not comparable."""
        return replace(self, subdivisions=min(self.subdivisions, 3), side=64, frames=min(self.frames, 3))


# A target is the ratio of glshade's time to the other program's time: 1 / 4 means "four times as fast".
WORKS = {
    "W1": Work("20k triangles, 1 directional light, 1024x1024 pixels to NumPy", targets={BY_HAND: 0.85, "peers": 1.0}),
    "W2": Work("the same under 8 point lights", lights="points", targets={BY_HAND: 0.95}),
    "W3": Work("1.3M triangles in local order", subdivisions=8, targets={BY_HAND: 0.85, "mitsuba": 1 / 1.4}),
    "W3s": Work(
        "the same triangles in scattered order", subdivisions=8, scattered=True, targets={BY_HAND: 0.4, "mitsuba": 1 / 1.4}
    ),
    "W4": Work(
        "100 frames of 512x512 to PNG files, default settings",
        kind="files",
        side=512,
        frames=100,
        targets={"pyrender": 1 / 4, FASTEST: 1 / 2.2},
        limit=1.2,
    ),
    "W5": Work("a new process to one PNG file of 512x512", kind="cold", side=512, targets={BY_HAND: 1.4, "pyrender": 1 / 3}),
}
