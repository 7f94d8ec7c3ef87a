"""Frames: which pictures a command makes of its scenes, and the names of their files."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path

# The largest number of frames that a range may hold: a slip of the keyboard is not a month of work.
MOST = 10_000_000
# What a pattern leaves open.
PLACE = re.compile(r"#+|\{(.*?)\}")
# Of a value, what a file's name does not hold.
UNNAMED = re.compile(r"[^\w.+-]+")


@dataclass(frozen=True)
class Picture:
    """One picture to make. overrides: what a sweep puts in the place of the scene's values. frame None: the scene as it is
    written; camera None: its own."""

    scene: Path
    overrides: tuple[tuple[str, str], ...]
    frame: int | None
    camera: str | None
    output: Path


@dataclass(frozen=True)
class Sweep:
    """A key of the scene, dotted as --set takes it, and the texts of the values that it has in turn."""

    key: str
    values: tuple[str, ...]

    @property
    def short(self) -> str:
        """The key's last part."""
        return self.key.rpartition(".")[2].strip("\"'")


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


def parse_sweep(text: str) -> Sweep:
    """The sweep of KEY=a,b,c. Commas within brackets or quotes are a value's own. Errors: ValueError."""
    from glshade.scene.override import ASSIGNMENT, pairs

    match = ASSIGNMENT.fullmatch(text)
    if not match or not match[2].strip():
        raise ValueError(f"{text!r} is not KEY=VALUE,VALUE such as materials.body.exponent=10,100,1000")
    key = match[1].strip()
    values = tuple(_split(match[2]))
    pairs((key, value) for value in values)
    return Sweep(key, values)


def _split(text: str) -> Iterator[str]:
    """The parts between the commas that stand outside of brackets and quotes."""
    depth, quote, start = 0, "", 0
    for index, letter in enumerate(text):
        if quote:
            quote = "" if letter == quote else quote
        elif letter in "\"'":
            quote = letter
        elif letter in "[{":
            depth += 1
        elif letter in "]}":
            depth -= 1
        elif letter == "," and depth == 0:
            yield text[start:index].strip()
            start = index + 1
    yield text[start:].strip()


def pictures(
    scenes: Sequence[Path],
    frames: Sequence[int] | None,
    cameras: Sequence[str],
    pattern: str | None,
    sweeps: Sequence[Sweep] = (),
) -> Iterator[Picture]:
    """Every frame of every scene at every value of the sweeps through every camera, in the order in which it is said.

    pattern: a file's name with {scene}, {camera}, a sweep's {key} or its last part, and a # for each digit of the frame; left
    out: NAME.png, and what it takes to tell the pictures apart. Errors: ValueError where two pictures would have one name, or
    the pattern says what is not there.
    """
    short = Counter(sweep.short for sweep in sweeps)
    if pattern is None:
        keys = [sweep.short if short[sweep.short] == 1 else sweep.key for sweep in sweeps]
        swept = "".join(f".{UNNAMED.sub('_', key)}-{{{sweep.key}}}" for key, sweep in zip(keys, sweeps, strict=True))
        pattern = "{scene}" + swept + ".{camera}" * bool(cameras) + ".####" * (frames is not None) + ".png"
    known = {"scene", "camera", *(sweep.key for sweep in sweeps), *(name for name, count in short.items() if count == 1)}
    named = {match[1] for match in PLACE.finditer(pattern) if match[1] is not None}
    if named - known:
        places = ", ".join(f"{{{name}}}" for name in ("scene", "camera", *sorted(known - {"scene", "camera"})))
        raise ValueError(f"{pattern!r}: {{{min(named - known)}}} is not known; known: {places} and # for digits of the frame")
    if "#" in pattern and frames is None:
        raise ValueError(f"{pattern!r} has a place for frames: say which, by --frames")
    made: set[Path] = set()
    for scene in scenes:
        for values in product(*(sweep.values for sweep in sweeps)):
            overrides = tuple((sweep.key, value) for sweep, value in zip(sweeps, values, strict=True))
            words = {sweep.short: value for sweep, value in zip(sweeps, values, strict=True)} | dict(overrides)
            words = {key: UNNAMED.sub("_", value).strip("_") for key, value in words.items()}
            for camera in (*cameras,) or (None,):
                # The scene's and the camera's name come last: a sweep of a key called so does not.
                of = words | {"scene": scene.stem, "camera": camera or "camera"}
                for frame in (*(frames or ()),) or (None,):
                    output = Path(_named(pattern, of, frame))
                    if output in made:
                        raise ValueError(
                            f"{pattern!r} gives several pictures one name: it lacks {_lack(pattern, sweeps, cameras, frames)}"
                        )
                    made.add(output)
                    yield Picture(scene, overrides, frame, camera, output)


def _named(pattern: str, words: Mapping[str, str], frame: int | None) -> str:
    def fill(place: re.Match[str]) -> str:
        if place[1] is not None:
            return words[place[1]]
        assert frame is not None
        # `#` is one digit each; a minus comes before them.
        return f"{'-' * (frame < 0)}{abs(frame):0{len(place[0])}d}"

    return PLACE.sub(fill, pattern)


def _lack(pattern: str, sweeps: Sequence[Sweep], cameras: Sequence[str], frames: Sequence[int] | None) -> str:
    """The place that would tell the pictures apart."""
    if frames is not None and len(frames) > 1 and "#" not in pattern:
        return "#"
    for sweep in sweeps:
        if len(sweep.values) > 1 and f"{{{sweep.key}}}" not in pattern and f"{{{sweep.short}}}" not in pattern:
            return f"{{{sweep.key}}}"
    return "{camera}" if "{camera}" not in pattern and len(cameras) > 1 else "{scene}"
