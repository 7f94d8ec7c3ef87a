"""Command `glshade compare`: compares pictures with reference pictures, for continuous integration (CI)."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from glshade.errors import GlshadeError

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from glshade.golden.result import Result
    from glshade.golden.rules import Rule


# Scripts read idiff's exit code 1 as a warning and 2 as a failure, so the errors below must not have these codes.
class WrongUsage(click.UsageError):
    """Wrong usage, with the exit code that BSD's sysexits.h gives it."""

    exit_code = 64


class UnusableFile(GlshadeError):
    """An error outside the comparison, such as a report that cannot be written, with idiff's exit code for a file."""

    exit_code = 4


class IdiffCodes(click.Command):
    """A command with the exit codes of OpenImageIO's idiff."""

    def make_context(self, *arguments: Any, **settings: Any) -> click.Context:
        try:
            return super().make_context(*arguments, **settings)
        except click.UsageError as error:
            raise WrongUsage(error.format_message(), error.ctx) from None

    def invoke(self, ctx: click.Context) -> Any:
        try:
            return super().invoke(ctx)
        except click.UsageError as error:
            raise WrongUsage(error.format_message(), error.ctx) from None
        except BrokenPipeError:
            raise
        except (GlshadeError, OSError, MemoryError) as error:
            raise UnusableFile(str(error)) from None


def idiff_options(command: Any) -> Any:
    """Adds idiff's options. The command gets those that are given as keyword arguments, and None for the others."""
    number = click.FloatRange(0)
    for name, kind, help in (
        ("allowfailures", click.IntRange(0), "Number of pixels that may differ by any amount [0]."),
        ("hardwarn", number, "Warns if any pixel differs by more [infinity]."),
        ("warnpercent", number, "Share of the pixels that may exceed --warn [0 %]."),
        ("warn", number, "Difference above which a pixel counts for a warning [1e-6]."),
        ("hardfail", number, "Fails if any pixel differs by more [infinity]."),
        ("failpercent", number, "Share of the pixels that may exceed --fail [0 %]."),
        ("fail", number, "Difference above which a pixel counts as failed [1e-6]."),
    ):
        command = click.option(f"--{name}", type=kind, metavar="N", help=help)(command)
    return command


@click.command(cls=IdiffCodes)
@click.argument("reference", metavar="REF", type=click.Path(path_type=Path))
@click.argument("test", type=click.Path(path_type=Path))
@click.option("--rule", "name", metavar="NAME", help="Rule that judges: codes (the default), exact, or idiff.")
@idiff_options
@click.option("--json", "as_json", is_flag=True, help="Prints the results as JSON.")
@click.option("--junit", type=click.Path(path_type=Path), metavar="FILE", help="Writes the results as JUnit's XML.")
@click.option("--github", is_flag=True, help="Prints annotations for GitHub, and adds to the step's summary.")
@click.option(
    "--diff", type=click.Path(path_type=Path), metavar="FILE", help="Writes a picture of the difference of two files."
)
def command(
    reference: Path,
    test: Path,
    name: str | None,
    as_json: bool,
    junit: Path | None,
    github: bool,
    diff: Path | None,
    **thresholds: float | None,
) -> None:
    """Compares the picture TEST with the picture REF, or the pictures of the folder TEST with those of the same names in REF.

    The rule "codes" lets 8-bit values differ by 1, and a few pixels take the value of a neighbour. "exact" allows no
    difference. "idiff" judges by thresholds, as OpenImageIO's idiff does; giving one of its options chooses it. An 8-bit value
    counts as a number from 0 to 1. Exit codes: 0 same, 1 warning, 2 failure, 3 the sizes differ, 4 a file is missing or cannot
    be read, 64 wrong usage. The exit code of two folders is that of their worst pair.
    """
    rule, name = _rule(name, {key: value for key, value in thresholds.items() if value is not None})
    folders = reference.is_dir()
    if folders != test.is_dir() and reference.exists() and test.exists():
        raise click.UsageError("REF and TEST must both be files or both be folders")
    if github and as_json:
        raise click.UsageError("--github and --json both print to stdout; give one of them")
    if diff is not None:
        _check_diff(diff, folders)

    from glshade.golden import report
    from glshade.golden.judge import compare_files, compare_folders

    found = compare_folders(reference, test, rule) if folders else iter([compare_files(reference, test, rule)])
    results = list(found if as_json else _printed(found, every=not folders))
    worst = report.worst(results)
    if as_json:
        from glshade.cli import _table

        _table.as_json(report.as_json(results, name))
    elif folders:
        click.echo(report.summary(results))
    if junit is not None:
        report.write_junit(junit, results)
    if github:
        _print_for_github(results)
    if diff is not None and results[0].layers:
        from glshade.golden.difference_picture import write_difference

        write_difference(reference, test, diff)
    raise SystemExit(int(worst))


def _rule(name: str | None, thresholds: dict[str, float]) -> tuple[Rule, str]:
    """Returns the rule that the options choose, and its name. Errors: click.UsageError."""
    import math

    from glshade.document import nearest
    from glshade.golden.rules import RULES

    for option, value in thresholds.items():
        # No error is larger than NaN, so that every picture would pass.
        if math.isnan(value):
            raise click.BadParameter("NaN is not a threshold", param_hint=f"'--{option}'")
    if thresholds and name not in (None, "idiff"):
        raise click.UsageError(f"--{next(iter(thresholds))} is an option of the rule idiff, not of {name!r}")
    name = name or ("idiff" if thresholds else "codes")
    if name not in RULES:
        raise click.BadParameter(f"no rule is named {name!r}{nearest(name, RULES)}", param_hint="'--rule'")
    return RULES[name](**thresholds), name


def _check_diff(diff: Path, folders: bool) -> None:
    """Checks that --diff can be used. Errors: click.UsageError."""
    from glshade.image.file import check_suffix

    if folders:
        raise click.UsageError("--diff compares two files, not folders")
    try:
        check_suffix(diff)
    except GlshadeError as error:
        raise click.BadParameter(str(error), param_hint="'--diff'") from None


def _printed(results: Iterable[Result], every: bool) -> Iterable[Result]:
    """Yields the results, and prints each that is not the same; `every` prints those that are the same, too."""
    from glshade.golden import report

    for result in results:
        if every or result.outcome:
            click.echo(report.line(result))
        yield result


def _print_for_github(results: Sequence[Result]) -> None:
    """Prints annotations, and adds to the file that GITHUB_STEP_SUMMARY names, if it names one. Errors: OSError."""
    import os

    from glshade.golden import report

    for annotation in report.github_annotations(results):
        click.echo(annotation)
    summary = os.environ.get("GITHUB_STEP_SUMMARY")
    if summary:
        with open(summary, "a", encoding="utf-8") as file:
            file.write(report.step_summary(results))
