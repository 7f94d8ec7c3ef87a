"""Judge: compares picture files, and folders of them, by a rule."""

from __future__ import annotations

import filecmp
import os
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np

from glshade.errors import AssetError, GlshadeError
from glshade.golden.pair import Pair
from glshade.golden.result import Finding, LayerResult, Outcome, Result
from glshade.golden.rules import Rule
from glshade.image import file as picture_file
from glshade.image.contents import Part
from glshade.limits import DEFAULT, TEXELS_PER_BYTE

NOT_FINITE = Finding(Outcome.FAIL, "a value is infinite or NaN")


def compare_folders(reference: Path, test: Path, rule: Rule) -> Iterator[Result]:
    """Yields the result of every pair of files with the same path in both folders, in the order of their names.

    Files whose names start with a dot are left out, and so are folders of such names. Links to folders are not followed. A file
    on one side only, and a file that cannot be read, has the outcome FILE, and the others are still compared.
    Errors: GlshadeError where a folder cannot be listed, or where both are empty.
    """
    left, right = set(_names(reference)), set(_names(test))
    if not left | right:
        raise GlshadeError(f"{reference} and {test} hold no files to compare")
    for name in sorted(left | right):
        if name not in right:
            yield Result(name, str(reference / name), Outcome.FILE, f"is only in the reference folder {reference}")
        elif name not in left:
            yield Result(name, str(test / name), Outcome.FILE, f"is only in the test folder {test}")
        else:
            yield compare_files(reference / name, test / name, rule, name)


def compare_files(reference: Path, test: Path, rule: Rule, name: str = "") -> Result:
    """Returns the result of one pair of picture files, named `name`, by default the test's path.

    Files with the same bytes are the same; their headers are read, and their pixels only to look for infinite and NaN values.
    A file that cannot be read has the outcome FILE.
    """
    name = name or str(test)
    try:
        finding, layers = _compare(reference, test, rule)
    except AssetError as error:
        return Result(name, str(test), Outcome.FILE, str(error).removeprefix(f"{name}: "))
    except MemoryError:
        return Result(name, str(test), Outcome.FILE, "there is not enough memory to compare the pictures")
    return Result(name, str(test), finding.outcome, finding.reason, layers)


def _compare(reference: Path, test: Path, rule: Rule) -> tuple[Finding, tuple[LayerResult, ...]]:
    """Returns the worst finding, and the results of the layers. Errors: AssetError, MemoryError."""
    parts = _parts(reference)
    if _same_bytes(reference, test):
        return (Finding(Outcome.SAME) if _finite(reference, parts) else NOT_FINITE), ()
    finding = difference_of_headers(parts, _parts(test))
    if finding is not None:
        return finding, ()
    layers = tuple(_judged(pair, rule) for pair in pairs(reference, test))
    worst = max(layers, key=lambda layer: layer.finding.outcome)
    reason = worst.finding.reason
    return Finding(worst.finding.outcome, f"layer {worst.name}: {reason}" if worst.name and reason else reason), layers


def pairs(reference: Path, test: Path) -> Iterator[Pair]:
    """Yields the layers of two files whose headers agree, a part at a time. Errors: AssetError.

    The channels `normal.X`, `normal.Y` and `normal.Z` are the layer `normal`; channels without a dot are the picture itself.
    """
    for left, right in zip(_parts(reference), _parts(test), strict=True):
        # Decoding takes longer than comparing, and OpenImageIO lets two threads decode at the same time.
        with ThreadPoolExecutor(2) as threads:
            pixels, other = threads.map(picture_file.read_part, (reference, test), (left, right))
        for layer, channels in _layers(left).items():
            here, there = ([part.channels.index(channel) for channel in channels] for part in (left, right))
            # Pixels of a file with one layer are used as they are, without a copy.
            whole = here == there == list(range(pixels.shape[2]))
            yield Pair(
                ":".join(text for text in (left.name, layer) if text),
                tuple(channel.rpartition(".")[2] for channel in channels),
                pixels if whole else pixels[..., here],
                other if whole else other[..., there],
            )


def difference_of_headers(reference: list[Part], test: list[Part]) -> Finding | None:
    """Returns the finding on two files whose parts, channels, sizes, places or orientation differ; None if they agree."""
    names, others = ([part.name for part in parts] for parts in (reference, test))
    if names != others:
        return Finding(
            Outcome.FAIL, f"the parts of the file are {_listed(names)}; in the test picture, they are {_listed(others)}"
        )
    for left, right in zip(reference, test, strict=True):
        if left.size != right.size:
            sizes = [f"{width}x{height}" for width, height in (left.size, right.size)]
            return Finding(Outcome.SIZES, f"the sizes are {sizes[0]} and {sizes[1]} pixels")
        missing = [channel for channel in left.channels if channel not in right.channels]
        added = [channel for channel in right.channels if channel not in left.channels]
        if missing or added:
            changes = [f"lacks {_listed(missing)}" if missing else "", f"adds {_listed(added)}" if added else ""]
            return Finding(Outcome.FAIL, f"the test picture {' and '.join(filter(None, changes))} (channels)")
        if (left.corner, left.whole) != (right.corner, right.whole):
            return Finding(Outcome.FAIL, "the data windows, the places of the pixels in the whole picture, differ")
        if left.orientation != right.orientation:
            return Finding(Outcome.FAIL, f"the orientations are {left.orientation} and {right.orientation} (Exif's numbers)")
    return None


def _judged(pair: Pair, rule: Rule) -> LayerResult:
    """Returns the result of one layer."""
    if not pair.finite:
        return LayerResult(pair.name, NOT_FINITE, None)
    return LayerResult(pair.name, rule.judge(pair), pair.metrics())


def _parts(path: Path) -> list[Part]:
    """Returns the parts of a file. Errors: AssetError, also for more pixels than a texture may have (docs/security.md)."""
    parts = picture_file.parts(path)
    # Four channels count as one pixel, as they do for textures.
    pixels = sum(part.size[0] * part.size[1] * max(1, -(-len(part.channels) // 4)) for part in parts)
    allowed = max(DEFAULT.max_texels, TEXELS_PER_BYTE * path.stat().st_size)
    if pixels > allowed:
        raise AssetError(f"{path}: has {pixels:,} pixels; {allowed:,} are allowed")
    return parts


def _layers(part: Part) -> dict[str, list[str]]:
    """Returns the names of a part's channels by layer, in the order of the file."""
    layers: dict[str, list[str]] = {}
    for channel in part.channels:
        layers.setdefault(channel.rpartition(".")[0], []).append(channel)
    return layers


def _finite(path: Path, parts: list[Part]) -> bool:
    """Returns whether all values of a file are finite. Errors: AssetError."""
    return all(not part.floats or bool(np.isfinite(picture_file.read_part(path, part)).all()) for part in parts)


def _same_bytes(reference: Path, test: Path) -> bool:
    """Returns whether two files have the same bytes. Errors: AssetError."""
    try:
        return filecmp.cmp(reference, test, shallow=False)
    except OSError as error:
        raise AssetError(f"{error.filename or test}: cannot be read: {error.strerror or error}") from None


def _listed(names: list[str]) -> str:
    return ", ".join(name or "without a name" for name in names)


def _names(folder: Path) -> Iterator[str]:
    """Yields the paths of the files in a folder and the folders in it, relative to the folder.

    A folder in it that cannot be listed counts as a file, so that it is reported. Errors: GlshadeError for the folder itself.
    """
    ahead = [""]
    while ahead:
        within = ahead.pop()
        try:
            with os.scandir(folder / within) as entries:
                found = [entry for entry in entries if not entry.name.startswith(".")]
        except OSError as error:
            if not within:
                raise GlshadeError(f"{folder}: cannot be listed: {error.strerror or error}") from None
            yield within
            continue
        for entry in found:
            path = f"{within}/{entry.name}" if within else entry.name
            if entry.is_dir(follow_symlinks=False):
                ahead.append(path)
            else:
                yield path
