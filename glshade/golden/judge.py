"""Judge: compares picture files, and folders of them, by a rule."""

from __future__ import annotations

import filecmp
import os
from collections import deque
from collections.abc import Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from glshade.errors import AssetError, GlshadeError
from glshade.golden.baselines import Baselines, Variant, rule_of
from glshade.golden.names import SIDECAR_SUFFIX, is_no_pair, sidecar_path
from glshade.golden.pair import Pair
from glshade.golden.report import largest
from glshade.golden.result import Cause, Finding, LayerResult, Outcome, Result
from glshade.golden.rules import Rule
from glshade.golden.rules.codes import Codes
from glshade.image import file as picture_file
from glshade.image.contents import Part
from glshade.limits import DEFAULT, TEXELS_PER_BYTE

if TYPE_CHECKING:
    from glshade.golden.scene_judge import SceneFinding, SceneJudge
    from glshade.golden.sidecar import Origin

Flags = NDArray[np.bool_]

# The largest number of pairs that are compared at the same time: decoding and much of NumPy's work run in parallel.
AT_ONCE = 4
NOT_FINITE = Finding(Outcome.FAIL, "a value is infinite or NaN")


@dataclass(frozen=True)
class Settings:
    """How pictures are compared.

    rule: the rule that judges where no scene does; None for the one in the baseline's sidecar, by default `codes`.
    scenes: optional; judges the pictures whose scene it knows.
    max_flip: the FLIP above which a pair fails in any case; infinity to measure it alone; None to leave it out.
    mask: optional (H, W), the pixels that are left out of the comparison.
    origin: optional, the origin of the test picture; by default its sidecar or its attributes tell it.
    """

    rule: Rule | None
    scenes: SceneJudge | None = None
    max_flip: float | None = None
    mask: Flags | None = None
    origin: Origin | None = None


def compare_folders(
    reference: Path, test: Path, rule: Rule | None, scenes: SceneJudge | None = None, *, max_flip: float | None = None
) -> Iterator[Result]:
    """Yields the result of every pair of files with the same path in both folders, in the order of their names.

    Files whose names start with a dot are left out, and so are folders of such names. Links to folders are not followed. A file
    on one side only, and a file that cannot be read, has the outcome FILE, and the others are still compared. A reference with
    variants (docs/ci.md) is compared by the one that fits best.
    rule, scenes, max_flip: as in `Settings`.
    Errors: GlshadeError where a folder cannot be listed, or where both are empty.
    """
    closed: dict[str, str] = {}
    left, right = set(_names(reference, closed)), set(_names(test, closed))
    left = {name for name in left if not is_no_pair(reference / name)}
    right = {name for name in right if not name.endswith(SIDECAR_SUFFIX)}
    if not left | right | closed.keys():
        raise GlshadeError(f"{reference} and {test} hold no files to compare")
    for name, reason in sorted(closed.items()):
        yield Result(name, str(test / name), Outcome.FILE, reason)
    # Nothing is known about the files of a folder that cannot be listed, so the other side's files in it are left out.
    below = tuple(f"{name}/" for name in closed)
    settings = Settings(rule, scenes, max_flip)

    def compared(name: str) -> Result:
        if name not in right:
            path = str(reference / name)
            return Result(name, path, Outcome.FILE, f"is only in the reference folder {reference}", baseline=path)
        if name not in left:
            return Result(name, str(test / name), Outcome.FILE, f"is only in the test folder {test}")
        return _compared_with_variants(variants_of(reference, name, test / name), test / name, settings, name)

    names = sorted(n for n in left | right if not n.startswith(below))
    with ThreadPoolExecutor(min(AT_ONCE, os.cpu_count() or 1)) as threads:
        # A few pairs are taken ahead of the one that is waited for, so that the memory does not grow with their number.
        ahead: deque[Future[Result]] = deque()
        for name in names:
            ahead.append(threads.submit(compared, name))
            if len(ahead) > 2 * AT_ONCE:
                yield ahead.popleft().result()
        while ahead:
            yield ahead.popleft().result()


def compare_variants(
    variants: Sequence[Variant],
    test: Path,
    rule: Rule | None,
    name: str = "",
    scenes: SceneJudge | None = None,
    *,
    max_flip: float | None = None,
    mask: Flags | None = None,
    origin: Origin | None = None,
) -> Result:
    """Returns the best result of a picture and the approved pictures of a baseline, with the distances of all that were tried.

    variants: at least one, the nearest first, as `Baselines.variants` returns them.
    rule, scenes, max_flip, mask, origin: as in `Settings`.
    Errors: GlshadeError for a mask of another size than the pictures'.
    """
    return _compared_with_variants(variants, test, Settings(rule, scenes, max_flip, mask, origin), name)


def _compared_with_variants(variants: Sequence[Variant], test: Path, settings: Settings, name: str) -> Result:
    """Returns the best result of a picture and some variants, as `compare_variants`. The first one that is the same counts."""
    try:
        settings = replace(settings, rule=settings.rule or rule_of(variants))
    except GlshadeError as error:
        reason = f"the sidecar of {variants[0].path} cannot be used: {error}"
        return Result(name or str(test), str(test), Outcome.FILE, reason, baseline=str(variants[0].path))
    best: Result | None = None
    distances: dict[str, float] = {}
    for variant in variants:
        result = _compared(variant.path, test, settings, name, variant.note)
        metrics = largest(result)
        if metrics is not None or result.outcome is Outcome.SAME:
            distances[variant.path.name] = metrics.rmse if metrics is not None else 0.0
        if best is None or result.outcome < best.outcome:
            best = result
        if result.outcome is Outcome.SAME:
            break
    assert best is not None
    return replace(best, distances=distances)


def variants_of(folder: Path, name: str, test: Path) -> Sequence[Variant]:
    """Returns the pictures that a test picture is compared with: the reference of its name, and its variants, if it has any."""
    from glshade.golden.sidecar import origin_of

    alone = Variant(folder / name, "", None)
    try:
        baselines = Baselines(folder)
        if not os.path.exists(sidecar_path(folder / name)) and not baselines.has_variants(name):
            return [alone]
        return baselines.variants(name, origin_of(test).driver) or [alone]
    except (GlshadeError, OSError):
        # A name that no baseline can have.
        return [alone]


def compare_files(
    reference: Path,
    test: Path,
    rule: Rule,
    name: str = "",
    scenes: SceneJudge | None = None,
    *,
    max_flip: float | None = None,
    mask: Flags | None = None,
) -> Result:
    """Returns the result of one pair of picture files, named `name`, by default the test's path.

    Files with the same bytes are the same; their headers are read, and their pixels only to look for infinite and NaN values.
    A file that cannot be read has the outcome FILE, and so has a scene that cannot be used.
    rule, scenes, max_flip, mask: as in `Settings`.
    Errors: GlshadeError for a mask of another size than the pictures'.
    """
    return _compared(reference, test, Settings(rule, scenes, max_flip, mask), name)


def _compared(reference: Path, test: Path, settings: Settings, name: str, note: str = "") -> Result:
    """Returns the result of one pair. note: a further line for people; empty for none."""
    start = perf_counter()
    name = name or str(test)
    base = Result(name, str(test), Outcome.SAME, baseline=str(reference), notes=(note,) if note else ())
    try:
        found = _Comparison(reference, test, settings).result(base)
    except MaskError:
        raise
    except GlshadeError as error:
        found = replace(base, outcome=Outcome.FILE, reason=_one_line(error).removeprefix(f"{name}: "))
    except MemoryError:
        found = replace(base, outcome=Outcome.FILE, reason="there is not enough memory to compare the pictures")
    return replace(found, seconds=perf_counter() - start)


class MaskError(GlshadeError):
    """A mask has another size than the pictures that it is for."""


class _Comparison:
    """The comparison of one pair of files."""

    def __init__(self, reference: Path, test: Path, settings: Settings) -> None:
        self.reference, self.test, self.settings = reference, test, settings
        self.scene: SceneFinding | None = None
        self.causes: tuple[Cause, ...] = ()

    def result(self, base: Result) -> Result:
        """Returns the result. base: a result with the names. Errors: GlshadeError, MemoryError."""
        parts = checked_parts(self.reference)
        if _same_bytes(self.reference, self.test):
            same = Finding(Outcome.SAME) if _finite(self.reference, parts) else NOT_FINITE
            return replace(base, outcome=same.outcome, reason=same.reason)
        headers = difference_of_headers(parts, checked_parts(self.test))
        if headers is not None:
            return replace(base, outcome=headers.outcome, reason=headers.reason)
        layers = tuple(self._layer(pair) for pair in pairs(self.reference, self.test))
        worst = max(layers, key=lambda layer: layer.finding.outcome)
        reason = worst.finding.reason
        found = replace(
            base,
            outcome=worst.finding.outcome,
            reason=f"layer {worst.name}: {reason}" if worst.name and reason else reason,
            layers=layers,
            causes=self.causes,
        )
        if self.scene is None:
            return found
        # A layer that only the rule judges may be worse than the picture.
        verdict = self.scene.verdict
        return replace(
            found,
            verdict=verdict if verdict is not None and verdict.outcome is found.outcome else None,
            notes=(*found.notes, *self.scene.notes),
            classes=self.scene.classes,
            drivers=(_driver_name(self._origins[0]), _driver_name(self._origins[1])),
            scene=self.settings.scenes.path_for(self._origins[0]) if self.settings.scenes else "",
        )

    @cached_property
    def _origins(self) -> tuple[Origin, Origin]:
        from glshade.golden.sidecar import origin_of

        return origin_of(self.reference), self.settings.origin or origin_of(self.test)

    def _layer(self, pair: Pair) -> LayerResult:
        """Returns the result of one layer."""
        pair = self._masked(pair)
        finding = self._by_scene(pair) if pair.name == "" and pair.count and self.settings.scenes else None
        if finding is None:
            rule = self.settings.rule or Codes()
            finding = rule.judge(pair) if pair.finite else NOT_FINITE
            if finding.outcome is Outcome.FAIL and pair.name == "":
                self.causes = _causes(pair)
        if not pair.finite:
            return LayerResult(pair.name, finding, None)
        result = LayerResult(pair.name, finding, pair.metrics())
        if self.settings.max_flip is None:
            return result
        from glshade.golden.flip import with_flip

        return with_flip(result, pair, self.settings.max_flip)

    def _by_scene(self, pair: Pair) -> Finding | None:
        """Returns the finding of the scene on the picture's layer; None where no scene judges it. Errors: GlshadeError."""
        assert self.settings.scenes is not None
        self.scene = self.settings.scenes.judge(pair, *self._origins, self.settings.mask)
        if self.scene is None or self.scene.verdict is None:
            return None
        self.causes = self.scene.causes
        return Finding(self.scene.verdict.outcome, self.scene.reason)

    def _masked(self, pair: Pair) -> Pair:
        """Returns a pair in which the masked pixels of the test are those of the reference. Errors: MaskError."""
        mask = self.settings.mask
        if mask is None:
            return pair
        if mask.shape != pair.test.shape[:2]:
            height, width = pair.test.shape[:2]
            raise MaskError(f"the mask has the shape {mask.shape}, not that of the pictures, ({height}, {width})")
        test = pair.test.copy()
        if test.dtype == pair.reference.dtype:
            test[mask] = pair.reference[mask]
        return Pair(pair.name, pair.channels, pair.reference, test)


def _causes(pair: Pair) -> tuple[Cause, ...]:
    """Returns the faults of the whole picture that explain why a pair fails; nothing where none does."""
    from glshade.golden.whole_picture import not_finite, whole_picture_causes

    if not np.isfinite(pair.test).all():
        return (not_finite(pair.test),)
    if pair.reference.dtype != pair.test.dtype or not pair.finite or len(pair.channels) > 4:
        return ()
    return whole_picture_causes(pair.reference, pair.test, pair.channels[-1] == "A", pair.changed)


def _driver_name(origin: Origin) -> str:
    """Returns the name of the driver that drew a picture, "reference" for the float64 reference; empty if it is not known."""
    return "reference" if origin.made_by == "reference" else origin.driver.renderer if origin.driver else ""


def _one_line(error: GlshadeError) -> str:
    """Returns an error's message in one line."""
    return "; ".join(str(error).splitlines())


def pairs(reference: Path, test: Path) -> Iterator[Pair]:
    """Yields the layers of two files whose headers agree, a part at a time. Errors: AssetError.

    The channels `normal.X`, `normal.Y` and `normal.Z` are the layer `normal`; channels without a dot are the picture itself.
    """
    for left, right in zip(checked_parts(reference), checked_parts(test), strict=True):
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


def checked_parts(path: Path) -> list[Part]:
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


def _names(folder: Path, closed: dict[str, str]) -> Iterator[str]:
    """Yields the paths of the files in a folder and the folders in it, relative to the folder.

    closed: gets the path of each folder that cannot be listed, with the reason. Errors: GlshadeError for `folder` itself.
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
            closed[within] = f"{folder / within}: the folder cannot be listed: {error.strerror or error}"
            continue
        for entry in found:
            path = f"{within}/{entry.name}" if within else entry.name
            if entry.is_dir(follow_symlinks=False):
                ahead.append(path)
            else:
                yield path
