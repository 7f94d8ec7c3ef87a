"""Reports: writes results as lines of text, JSON, JUnit's XML, and GitHub's annotations and summary.

Names of files come from strangers. Each format gets them without control characters, and with its own special characters
replaced.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from glshade.errors import GlshadeError, printable
from glshade.files import replacing
from glshade.github import annotation
from glshade.golden.result import Cause, Metrics, Outcome, Result, SceneVerdict

# GitHub shows 10 errors and 10 warnings for a step, and drops the others.
MOST_ANNOTATIONS = 10
# XML 1.0 has no way to write these two characters; `printable` has replaced the others.
_NOT_IN_XML = str.maketrans(dict.fromkeys("\ufffe\uffff", "\ufffd"))


def line(result: Result) -> str:
    """Returns a result as one line: outcome, name, what went wrong, and the sizes of the differences."""
    metrics = largest(result)
    parts = [why(result), _figures(metrics) if metrics and metrics.worst else ""]
    text = "; ".join(part for part in parts if part)
    return f"{_word(result.outcome):5}  {printable(result.name)}" + (f": {text}" if text else "")


def why(result: Result) -> str:
    """Returns what went wrong as one line: the scene's verdict, the causes, the reason, the distances and the notes.

    It is empty where there is nothing to tell.
    """
    verdict = str(result.verdict) if result.verdict not in (None, SceneVerdict.SAME) else ""
    # One approved picture has the distance that the figures tell.
    distances = [f"{name} {rmse:.3g}" for name, rmse in result.distances.items()] if len(result.distances) > 1 else []
    parts = [
        f"{verdict}: {told(result.causes)}" if verdict and result.causes else verdict or told(result.causes),
        result.reason,
        f"distances (RMSE): {', '.join(distances)}" if distances else "",
        *result.notes,
    ]
    return printable("; ".join(part for part in parts if part))


def told(causes: Sequence[Cause]) -> str:
    """Returns causes as one line, each with the share of the change that it explains."""
    return "; ".join(
        f"{cause.text} (explains {cause.explained:.0%} of the change)" if 0 < cause.explained < 1 else cause.text
        for cause in causes
    )


def summary(results: Sequence[Result]) -> str:
    """Returns the number of pairs of each outcome as one line, such as `3 pairs: 2 same, 1 fail`."""
    counts = {outcome: sum(result.outcome is outcome for result in results) for outcome in Outcome}
    listed = ", ".join(f"{count} {_word(outcome)}" for outcome, count in counts.items() if count)
    return f"{len(results)} {'pair' if len(results) == 1 else 'pairs'}: {listed}"


def largest(result: Result) -> Metrics | None:
    """Returns the largest of each metric of the layers; None where no layer has metrics."""
    found = [layer.metrics for layer in result.layers if layer.metrics]
    if not found:
        return None
    values: dict[str, Any] = {}
    for metrics in found:
        for name, value in asdict(metrics).items():
            if value is not None:
                values[name] = max(values.get(name, value), value)
    return Metrics(**values)


def as_json(results: Sequence[Result], rule: str) -> dict[str, Any]:
    """Returns the results as values for JSON."""
    return {
        "rule": rule,
        "outcome": _word(worst(results)),
        "pairs": [
            {
                "name": printable(result.name),
                "outcome": _word(result.outcome),
                "verdict": None if result.verdict is None else str(result.verdict),
                "reason": printable(result.reason),
                "causes": [
                    {**asdict(cause), "text": printable(cause.text), "object": printable(cause.object)}
                    for cause in result.causes
                ],
                "scene": printable(result.scene) or None,
                "drivers": {
                    key: printable(driver) or None for key, driver in zip(("reference", "test"), result.drivers, strict=True)
                },
                "baseline": printable(result.baseline) or None,
                "distances": {printable(name): rmse for name, rmse in result.distances.items()},
                "notes": [printable(note) for note in result.notes],
                "layers": [
                    {
                        "name": printable(layer.name),
                        "outcome": _word(layer.finding.outcome),
                        "reason": layer.finding.reason,
                        "metrics": asdict(layer.metrics) if layer.metrics else None,
                    }
                    for layer in result.layers
                ],
            }
            for result in results
        ],
    }


def worst(results: Sequence[Result]) -> Outcome:
    """Returns the worst outcome of some results."""
    return max((result.outcome for result in results), default=Outcome.SAME)


def write_junit(path: Path, results: Sequence[Result]) -> None:
    """Writes the results as JUnit's XML, a test case for each pair.

    FAIL and SIZES are failures, FILE is an error, and WARN is a test that has passed with a message. Errors: GlshadeError.
    """
    suite = ElementTree.Element(
        "testsuite",
        name="glshade compare",
        tests=str(len(results)),
        failures=str(sum(result.outcome in (Outcome.FAIL, Outcome.SIZES) for result in results)),
        errors=str(sum(result.outcome is Outcome.FILE for result in results)),
        skipped="0",
    )
    elements = {Outcome.FAIL: "failure", Outcome.SIZES: "failure", Outcome.FILE: "error"}
    for result in results:
        case = ElementTree.SubElement(suite, "testcase", classname="glshade.compare", name=_in_xml(result.name))
        message = _in_xml(line(result))
        if result.outcome in elements:
            element = ElementTree.SubElement(case, elements[result.outcome], message=_in_xml(why(result)))
            element.text = message
        elif result.outcome is Outcome.WARN:
            ElementTree.SubElement(case, "system-out").text = message
    root = ElementTree.Element("testsuites")
    root.append(suite)
    ElementTree.indent(root)
    try:
        with replacing(path) as temporary:
            ElementTree.ElementTree(root).write(temporary, encoding="utf-8", xml_declaration=True)
    except OSError as error:
        raise GlshadeError(f"{path}: cannot be written: {error.strerror or error}") from None


def github_annotations(results: Sequence[Result]) -> list[str]:
    """Returns GitHub's annotations of the pairs that are not the same, the worst ones first, one line each."""
    differing = sorted((result for result in results if result.outcome), key=lambda result: -result.outcome)
    return [
        annotation(
            "warning" if result.outcome is Outcome.WARN else "error",
            printable(line(result)),
            file=printable(result.path),
            title=f"glshade compare: {_word(result.outcome)}",
        )
        for result in differing[:MOST_ANNOTATIONS]
    ]


def step_summary(results: Sequence[Result]) -> str:
    """Returns a page of Markdown for GitHub's step summary: the counts, and a table of the pairs that are not the same."""
    rows = [
        f"| {_word(result.outcome)} | {_markdown(result.name)} | {_markdown(why(result))} | {_cells(largest(result))} |\n"
        for result in results
        if result.outcome
    ]
    heads = "| outcome | picture | reason | max | RMSE | p99.9 | codes |\n|---|---|---|---|---|---|---|\n"
    return f"### glshade compare\n\n{summary(results)}\n\n" + (heads + "".join(rows) if rows else "")


def _word(outcome: Outcome) -> str:
    return outcome.name.lower()


def _figures(metrics: Metrics) -> str:
    """Returns the metrics as a text."""
    flip = "" if metrics.flip is None else f"FLIP {metrics.flip:.3g}, "
    return f"max {metrics.worst:.3g}, RMSE {metrics.rmse:.3g}, p99.9 {metrics.p999:.3g}, {flip}{metrics.codes} codes differ"


def _cells(metrics: Metrics | None) -> str:
    """Returns the metrics as four cells of a Markdown table, without the outer bars."""
    if metrics is None:
        return "| | | "
    return f"{metrics.worst:.3g} | {metrics.rmse:.3g} | {metrics.p999:.3g} | {metrics.codes}"


def _in_xml(text: str) -> str:
    """Returns a text as one line of characters that XML can hold. The writer of XML replaces `<`, `&` and quotes."""
    return printable(text).translate(_NOT_IN_XML)


def _markdown(text: str) -> str:
    """Returns a text for a cell of a Markdown table. Numeric entities stand for all characters that Markdown might obey."""
    return "".join(c if c.isalnum() or c in " ./-" else f"&#{ord(c)};" for c in printable(text))
