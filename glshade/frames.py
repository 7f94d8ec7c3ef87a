"""Frames: which pictures a command makes of its scenes, and the names of their files."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from glshade.scene_file import SceneFile

# The largest number of frames that a range may hold: a slip of the keyboard is not a month of work.
MOST = 10_000_000


@dataclass(frozen=True)
class Picture:
    """One picture to make. frame None: the scene as it is written; camera None: its own."""

    scene: SceneFile
    frame: int | None
    camera: str | None
    output: Path


def parse(text: str) -> list[int]:
    """The frames of a range such as 1-100x5, 1,3,7-9 or, as Blender writes it, 1..100. Errors: ValueError."""
    from fileseq.exceptions import FileSeqException
    from fileseq.frameset import FrameSet

    try:
        frames = [int(frame) for frame in FrameSet(text.replace("..", "-"))]
    except (FileSeqException, ValueError):
        raise ValueError(f"{text!r} is not a range of frames such as 1-100x5 or 1,3,7-9") from None
    if not frames or len(frames) > MOST:
        raise ValueError(f"{text!r} has {len(frames)} frames; from 1 to {MOST} are allowed")
    return frames


def pictures(
    scenes: Sequence[SceneFile], frames: Sequence[int] | None, cameras: Sequence[str], pattern: str | None
) -> Iterator[Picture]:
    """Every frame of every scene through every camera, in the order in which it is said.

    pattern: a file's name with {scene}, {camera} and, as many digits as there are, #; left out: NAME.png, and what it takes to
    tell the pictures apart. Errors: ValueError where two pictures would have one name, or the pattern says what is not there.
    """
    if pattern is None:
        pattern = "{scene}" + ".{camera}" * bool(cameras) + ".####" * (frames is not None) + ".png"
    unknown = set(re.findall(r"\{(.*?)\}", pattern)) - {"scene", "camera"}
    if unknown:
        raise ValueError(
            f"{pattern!r}: {{{unknown.pop()}}} is not known; known: {{scene}}, {{camera}} and # for digits of the frame"
        )
    if "#" in pattern and frames is None:
        raise ValueError(f"{pattern!r} has a place for frames: say which, by --frames")
    made: set[Path] = set()
    for scene in scenes:
        for camera in (*cameras,) or (None,):
            for frame in (*(frames or ()),) or (None,):
                named = pattern.replace("{scene}", scene.path.stem).replace("{camera}", camera or "camera")
                if frame is not None:
                    named = re.sub("#+", lambda digits, frame=frame: _digits(frame, len(digits[0])), named)  # type: ignore[misc]
                output = Path(named)
                if output in made:
                    several = frames is not None and len(frames) > 1 and "#" not in pattern
                    missing = "#" if several else "{camera}" if "{camera}" not in pattern and len(cameras) > 1 else "{scene}"
                    raise ValueError(f"{pattern!r} gives several pictures one name: it lacks {missing}")
                made.add(output)
                yield Picture(scene, frame, camera, output)


def _digits(frame: int, count: int) -> str:
    """`#` is one digit each; a minus comes before them."""
    return f"{'-' * (frame < 0)}{abs(frame):0{count}d}"
