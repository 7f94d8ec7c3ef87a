"""Frames: lists the pictures that a command makes of its scenes, and names their files."""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path

# Largest number of frames in a range, so that a typing error does not start a month of work.
MOST = 10_000_000
# A placeholder in a pattern: one or more # for the digits of the frame number, or a {name}.
PLACE = re.compile(r"#+|\{(.*?)\}")
# Characters of a sweep's key or value that are replaced in a file name.
UNNAMED = re.compile(r"[^\w.+-]+")
# Texts that would lead to another folder: separators anywhere in a name, and a name of dots alone.
LEADING_OUT = re.compile(r"[/\\\0]|^\.+$")


@dataclass(frozen=True)
class Shot:
    """One picture to make.

    scene: path of the scene or mesh file
    overrides: (key, text) pairs of the sweeps, as --set takes them
    frame: frame number of the animation; None draws the scene without animation
    camera: name of one of the scene's `cameras`; None selects the scene's main camera
    output: path of the picture file
    """

    scene: Path
    overrides: tuple[tuple[str, str], ...]
    frame: int | None
    camera: str | None
    output: Path


@dataclass(frozen=True)
class Sweep:
    """A key of the scene and the values that it takes one after another.

    key: dotted key, as --set takes it
    values: texts of the values
    """

    key: str
    values: tuple[str, ...]

    @property
    def short(self) -> str:
        """The last part of the key, without quotes."""
        return self.key.rpartition(".")[2].strip("\"'")


def parse(text: str) -> list[int]:
    """Returns the frames of a range such as 1-100x5, 1,3,7-9 or, in Blender's notation, 1..100. Errors: ValueError."""
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
    """Returns the sweep of KEY=a,b,c. Commas within brackets or quotes belong to a value. Errors: ValueError."""
    from glshade.scene.override import ASSIGNMENT, pairs

    match = ASSIGNMENT.fullmatch(text)
    if not match or not match[2].strip():
        raise ValueError(f"{text!r} is not KEY=VALUE,VALUE such as materials.body.exponent=10,100,1000")
    key = match[1].strip()
    values = tuple(_split(match[2]))
    pairs((key, value) for value in values)
    return Sweep(key, values)


def check_count(scenes: int, cameras: int, frames: int, sweeps: Sequence[Sweep], most: int) -> None:
    """Checks the number of pictures of a batch, before they are listed. Errors: ValueError for more than `most`.

    scenes, cameras, frames: their numbers; no camera counts as one
    """
    count = math.prod([scenes, cameras or 1, frames, *(len(sweep.values) for sweep in sweeps)])
    if count > most:
        raise ValueError(f"the scenes, cameras, frames and swept values give {count:,} pictures; {most:,} are allowed")


def _split(text: str) -> Iterator[str]:
    """Yields the parts of a text between the commas that are outside of brackets and quotes."""
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
) -> Iterator[Shot]:
    """Yields one picture for each combination of a scene, the sweeps' values, a camera and a frame; the frame varies fastest.

    scenes: paths of scene or mesh files
    frames: frame numbers; None draws the scenes without animation
    cameras: names of cameras; empty selects each scene's main camera
    pattern: file name with {scene}, {camera}, a sweep's {key} or the last part of its key, and one # for each digit of the
        frame; None selects SCENE.png with the parts inserted that differ between the pictures
    sweeps: keys with the values that they take
    Errors: ValueError if two pictures would have the same name, or if the pattern has an unknown placeholder.
    """
    short = Counter(sweep.short for sweep in sweeps)
    if pattern is None:
        pattern = _default_pattern(frames, cameras, sweeps, short)
    _check_pattern(pattern, frames, sweeps, short)
    outputs: set[Path] = set()
    for scene in scenes:
        for values in product(*(sweep.values for sweep in sweeps)):
            overrides = tuple((sweep.key, value) for sweep, value in zip(sweeps, values, strict=True))
            words = {sweep.short: value for sweep, value in zip(sweeps, values, strict=True)} | dict(overrides)
            words = {key: _inside(UNNAMED.sub("_", value).strip("_")) for key, value in words.items()}
            for camera in cameras or (None,):
                # The names of scene and camera win over a sweep whose key ends in "scene" or "camera".
                parts = words | {"scene": _inside(scene.stem), "camera": _inside(camera or "camera")}
                for frame in frames or (None,):
                    output = Path(_named(pattern, parts, frame))
                    if output in outputs:
                        missing = _missing_place(pattern, sweeps, cameras, frames)
                        raise ValueError(f"{pattern!r} gives several pictures the same name: it lacks {missing}")
                    outputs.add(output)
                    yield Shot(scene, overrides, frame, camera, output)


def _default_pattern(frames: Sequence[int] | None, cameras: Sequence[str], sweeps: Sequence[Sweep], short: Counter[str]) -> str:
    """Returns the pattern of SCENE.png, with placeholders for sweeps, camera and frame if there are any.

    short: last part of a key -> number of sweeps whose keys end with it
    """
    keys = [sweep.short if short[sweep.short] == 1 else sweep.key for sweep in sweeps]
    swept = "".join(f".{UNNAMED.sub('_', key)}-{{{sweep.key}}}" for key, sweep in zip(keys, sweeps, strict=True))
    camera = ".{camera}" if cameras else ""
    frame = ".####" if frames is not None else ""
    return "{scene}" + swept + camera + frame + ".png"


def _check_pattern(pattern: str, frames: Sequence[int] | None, sweeps: Sequence[Sweep], short: Counter[str]) -> None:
    """Checks a pattern. Errors: ValueError for an unknown placeholder, or for a # if there are no frames.

    short: last part of a key -> number of sweeps whose keys end with it
    """
    known = {"scene", "camera", *(sweep.key for sweep in sweeps), *(name for name, count in short.items() if count == 1)}
    used = {match[1] for match in PLACE.finditer(pattern) if match[1] is not None}
    if used - known:
        places = ", ".join(f"{{{name}}}" for name in ("scene", "camera", *sorted(known - {"scene", "camera"})))
        raise ValueError(f"{pattern!r}: {{{min(used - known)}}} is not known; known: {places} and # for digits of the frame")
    if "#" in pattern and frames is None:
        raise ValueError(f"{pattern!r} has a # for the frame number, but there are no frames: add --frames")


def _named(pattern: str, words: Mapping[str, str], frame: int | None) -> str:
    """Returns the pattern with its placeholders filled in. words: placeholder -> text."""

    def fill(place: re.Match[str]) -> str:
        if place[1] is not None:
            return words[place[1]]
        assert frame is not None
        # Each # is one digit; a minus sign comes before them.
        sign = "-" if frame < 0 else ""
        return f"{sign}{abs(frame):0{len(place[0])}d}"

    return PLACE.sub(fill, pattern)


def _inside(name: str) -> str:
    """Returns a name from a scene file or an option as a part of a file name, which cannot lead to another folder."""
    return LEADING_OUT.sub("_", name)


def _missing_place(pattern: str, sweeps: Sequence[Sweep], cameras: Sequence[str], frames: Sequence[int] | None) -> str:
    """Returns a placeholder that is missing in the pattern: with it, the pictures would have different names."""
    if frames is not None and len(frames) > 1 and "#" not in pattern:
        return "#"
    for sweep in sweeps:
        if len(sweep.values) > 1 and f"{{{sweep.key}}}" not in pattern and f"{{{sweep.short}}}" not in pattern:
            return f"{{{sweep.key}}}"
    return "{camera}" if "{camera}" not in pattern and len(cameras) > 1 else "{scene}"
