"""Works: what is measured, as the figures of docs/benchmarks.md name it, and how fast glshade is to be."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Literal

# Who draws: glshade itself, the program written by hand with nothing but moderngl, and in targets the fastest but glshade.
GLSHADE, BY_HAND, FASTEST = "glshade", "moderngl", "fastest"


@dataclass(frozen=True)
class Work:
    """One piece of work that every program does.

    kind: "frame", one picture in memory, drawn again and again; "files", `frames` PNG files; "cold", a new process that ends
    with one. subdivisions: of the icosahedron, 20 * 4^n triangles; side: of the picture [pixels]; scattered: shuffled
    triangles and vertices. targets: program -> the most that glshade may take, as a share of that program's time; "peers":
    every one whose picture is the same. limit: the most that the whole command of glshade may take [s].
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
        """The same in a moment, to see that it works; its times say nothing."""
        return replace(self, subdivisions=min(self.subdivisions, 3), side=64, frames=min(self.frames, 3))


# "Four times as fast" is a quarter of the time.
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
        limit=1.5,
    ),
    "W5": Work("a new process to one PNG file of 512x512", kind="cold", side=512, targets={BY_HAND: 1.7, "pyrender": 1 / 3}),
}
