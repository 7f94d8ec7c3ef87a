"""Page: writes the results of a comparison as one HTML page, in which a person sees what changed, and approves it."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any

from glshade.errors import GlshadeError, printable
from glshade.golden.page_pictures import CasePictures, pictures_of
from glshade.golden.result import SceneVerdict
from glshade.page import template
from glshade.page.ramp import RAMP
from glshade.verification.report import CLASS_COLOURS, CLASS_MEANING, UNEXPLAINED, UNEXPLAINED_MEANING

if TYPE_CHECKING:
    from glshade.golden.results import Case

VIEWER = Path(__file__).parent / "viewer"
# The page embeds exact pictures, the worst cases' first, up to this size of the page [bytes]. The other exact pictures are
# files beside the page, so that a page of 1,000 cases opens within two seconds. Where few cases fail, one file holds all.
EMBEDDED = 24_000_000
# The page embeds thumbnails up to this size of the page [bytes].
LARGEST = 48_000_000
# The cases whose pictures are in memory at the same time. Reading a picture leaves Python's lock, so two threads read.
AT_ONCE, THREADS = 8, 2
# What the page calls an outcome, and its kind: good, warn or bad; the worst outcome first.
OUTCOMES = {
    "fail": ("failed", "bad"),
    "sizes": ("sizes differ", "bad"),
    "file": ("file error", "bad"),
    "warn": ("warning", "warn"),
    "same": ("same", "good"),
}
MISSING = ("no baseline", "warn")
# The pictures that a case may have, in the order of their links.
ROLES = ("expected", "actual", "difference", "classes", "mask")


def write_page(folder: Path, cases: Sequence[Case]) -> Path:
    """Writes index.html into a folder of results, and returns its path.

    The page holds thumbnails of all cases that differ, and their exact pictures as far as there is room. The exact pictures of
    the other cases that did not pass are written as pixels.js beside the pictures, because a page that was opened from a disk
    may not read a picture's values, but may run a script.
    cases: the cases of the folder, as ResultsWriter.finish returns them.
    Errors: GlshadeError where a file cannot be written, or the path of a picture leads out of the folder.
    """
    ordered = sorted(cases, key=_severity)
    groups = _groups(ordered)
    rows = [_row(index, case, groups[index]) for index, case in enumerate(ordered)]
    text = template.render(
        VIEWER / "page.html.j2",
        [VIEWER / "page.css"],
        [VIEWER / name for name in ("pictures.js", "stage.js", "cases.js", "details.js", "main.js")],
        beside=True,
        rows=rows,
        pictures=_pictures(folder, ordered),
        counts=_counts(rows),
        verdicts=[verdict for verdict in SceneVerdict if any(row["verdict"] == verdict for row in rows)],
        settings={"ramp": RAMP.astype(int).tolist(), "classes": _legend(), "folder": os.path.abspath(folder)},
        classes=_legend(),
    )
    page = folder / "index.html"
    template.write(page, text)
    return page


def _severity(case: Case) -> tuple[int, float, str]:
    """Returns a key that sorts the worst cases first: by outcome, then by the size of the change, then by id."""
    outcomes = list(OUTCOMES)
    rank = 2 * outcomes.index(case.outcome) + case.missing
    if case.outcome == "same" and case.verdict == SceneVerdict.FREEDOM:
        rank -= 1
    return rank, -(change if (change := _change(case)) is not None else float("inf")), case.id


def _change(case: Case) -> float | None:
    """Returns the root of the mean squared error of the layer that changed most; None where it is not known."""
    known = [layer["metrics"]["rmse"] for layer in case.layers if layer.get("metrics")]
    return max(known, default=None)


def _groups(cases: Sequence[Case]) -> list[str]:
    """Returns the cause of each case, in words; cases with equal words have an equal cause.

    Where no cause is known, numbers in the reason do not count: "12 pixels differ" and "13 pixels differ" are one reason.
    """
    groups = []
    for case in cases:
        causes = [printable(str(cause["text"])) for cause in case.causes]
        groups.append("; ".join(causes) or re.sub(r"\d[\d.,:e+-]*", "…", printable(case.reason)))
    return groups


def _row(index: int, case: Case, group: str) -> dict[str, Any]:
    """Returns a case as the template and the script need it. Names of files come from strangers, so they are made printable."""
    missing = case.missing
    word, kind = MISSING if missing else OUTCOMES[case.outcome]
    name, id_ = case.name, str(case.id)
    return {
        "index": index,
        "id": printable(id_),
        "name": printable(name),
        "only": _pattern(name),
        "outcome": "missing" if missing else case.outcome,
        "verdict": case.verdict or "",
        "label": case.verdict or word,
        "kind": kind,
        "reason": printable(case.reason),
        "group": group,
        "change": _change(case),
        "causes": [{key: printable(v) if isinstance(v, str) else v for key, v in cause.items()} for cause in case.causes],
        "layers": case.layers,
        "facts": dict(_facts(case)),
        "distances": case.distances,
        "notes": [printable(note) for note in case.notes],
        "files": {role: _address(path) for role, path in _files(case).items()},
        "approvable": case.outcome != "same" and case.actual is not None,
        "variant": case.driver.family if case.driver and case.verdict == SceneVerdict.BOTH_RIGHT else "",
    }


def _facts(case: Case) -> Iterator[tuple[str, str]]:
    """Yields the name and the value of the figures of a case that are known, as texts."""
    if case.driver is not None:
        known = (case.driver.renderer, case.driver.version, case.driver.backend)
        yield "driver", printable(", ".join(text for text in known if text))
    elif case.made_by == "reference":
        yield "drawn by", "the float64 reference"
    yield "rule", printable(" ".join((case.rule.name, *(f"{key} = {value}" for key, value in case.rule.options.items()))))
    if case.baseline is not None:
        yield "baseline", printable(case.baseline)
    yield "folder of baselines", printable(case.baseline_root)
    if case.scene is not None:
        yield "scene", printable(" ".join((case.scene, *case.overrides)))


def _files(case: Case) -> dict[str, str]:
    """Returns role -> path of the picture, relative to the folder of results."""
    files = {**case.files, "actual": case.actual}
    return {role: path for role in ROLES if (path := files.get(role))}


def _address(path: str) -> str:
    """Returns a relative path as a relative address."""
    from urllib.parse import quote

    return quote(path, errors="replace")


def _pattern(name: str) -> str:
    """Returns a pattern for `glshade approve --only` that matches a name and can be pasted into a terminal as one line.

    Characters with a meaning in patterns are put into brackets. A question mark, which matches any character, stands for each
    character that a terminal might obey.
    """
    from glob import escape

    return "".join(escape(character) if printable(character) == character else "?" for character in name)


def _counts(rows: Sequence[Mapping[str, Any]]) -> list[tuple[str, str, str, int]]:
    """Returns (outcome, word, kind, number of cases) of each outcome that some case has, the worst first."""
    words = {**OUTCOMES, "missing": MISSING}
    order = ["fail", "sizes", "file", "missing", "warn", "same"]
    numbers = {outcome: sum(row["outcome"] == outcome for row in rows) for outcome in order}
    return [(outcome, *words[outcome], number) for outcome, number in numbers.items() if number]


def _legend() -> list[dict[str, Any]]:
    """Returns the classes of pixels with their colours and meanings."""
    known = [
        {"name": kind.name.lower(), "colour": colour, "meaning": CLASS_MEANING[kind]} for kind, colour in CLASS_COLOURS.items()
    ]
    return [*known, {"name": "unexplained", "colour": UNEXPLAINED, "meaning": UNEXPLAINED_MEANING}]


def _pictures(folder: Path, cases: Sequence[Case]) -> Iterator[tuple[int, Any]]:
    """Yields (index, pictures to embed) of each case that has some. Writes the exact pictures that are too large to embed.

    Errors: GlshadeError.
    """

    def of_case(index: int) -> CasePictures:
        return pictures_of(folder, cases[index])

    size = 0
    with ThreadPoolExecutor(THREADS) as threads:
        ahead = iter(range(len(cases)))
        while chunk := list(islice(ahead, AT_ONCE)):
            for index, found in zip(chunk, threads.map(of_case, chunk), strict=True):
                values = _embedded(folder, found, cases[index], size)
                size += _length(values.get("exact", {})) + sum(map(len, values.get("thumbnails", {}).values()))
                yield index, values


def _embedded(folder: Path, found: CasePictures, case: Case, size: int) -> dict[str, Any]:
    """Returns the pictures of a case that the page embeds: all, thumbnails alone, or none, as there is room.

    Exact pictures that are not embedded are written to pixels.js, unless the case has passed.
    size: the size of the pictures that are embedded already [bytes].
    Errors: GlshadeError.
    """
    values: dict[str, Any] = {"layer": printable(found.layer), "reduced": found.reduced}
    if size < LARGEST:
        values["thumbnails"] = found.thumbnails
    if found.exact and size + _length(found.exact) <= EMBEDDED:
        values["exact"] = found.exact
    elif found.exact and not case.passed:
        beside = Path(next(iter(_files(case).values()))).with_name("pixels.js")
        address = _address(beside.as_posix())
        _write_script(folder / beside, f"glshadePixels({json.dumps(address)}, {json.dumps(found.exact)});\n")
        values["beside"] = address
    return values


def _write_script(path: Path, text: str) -> None:
    """Writes a script beside the page, without waiting for the disk: until the page is complete, nothing refers to it.

    Errors: GlshadeError.
    """
    try:
        path.write_text(text, encoding="ascii")
    except OSError as error:
        raise GlshadeError(f"{path}: cannot be written: {error.strerror or error}") from None


def _length(exact: Mapping[str, Any]) -> int:
    """Returns the length of exact pictures as text."""
    return sum(len(picture["data"]) for picture in exact.values())
