"""Command `glshade compare`: compares pictures with reference pictures, for continuous integration (CI)."""

from __future__ import annotations

import math
import os
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from glshade.cli._options import driver, models, overrides, shaders
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
        from glshade.cli._stderr import without_libpng

        try:
            with without_libpng():
                return super().invoke(ctx)
        except click.UsageError as error:
            raise WrongUsage(error.format_message(), error.ctx) from None
        except BrokenPipeError:
            raise
        except OSError as error:
            raise UnusableFile(f"{error.filename or 'error'}: {error.strerror or error}") from None
        except (GlshadeError, MemoryError) as error:
            raise UnusableFile(str(error) or "there is not enough memory") from None


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
@click.argument("reference", metavar="REF", type=click.Path(readable=False, path_type=Path))
@click.argument("test", type=click.Path(readable=False, path_type=Path))
@click.option("--rule", "name", metavar="NAME", help="Rule that judges: codes (the default), exact, or idiff.")
@idiff_options
@click.option("--flip", is_flag=True, help="Measures FLIP, an estimate of how visible the difference is.")
@click.option("--max-flip", type=click.FloatRange(0, 1), metavar="N", help="Fails if FLIP exceeds this, beside the rule.")
@click.option(
    "--scene",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="Scene of the pictures, whose float64 reference judges them. By default, the sidecar of each reference names it.",
)
@overrides
@models
@shaders
@driver
@click.option("--json", "as_json", is_flag=True, help="Prints the results as JSON.")
@click.option("--junit", type=click.Path(path_type=Path), metavar="FILE", help="Writes the results as JUnit's XML.")
@click.option("--github", is_flag=True, help="Prints annotations for GitHub, and adds to the step's summary.")
@click.option(
    "--diff", type=click.Path(path_type=Path), metavar="FILE", help="Writes a picture of the difference of two files."
)
@click.option(
    "--report",
    "folder",
    type=click.Path(path_type=Path),
    metavar="FOLDER",
    help="Writes a page with the results to this folder, from which `glshade approve` approves pictures.",
)
def command(
    reference: Path,
    test: Path,
    name: str | None,
    flip: bool,
    max_flip: float | None,
    scene: Path | None,
    overrides: list[tuple[str, str]],
    models: tuple[str, ...],
    shaders: tuple[str, ...],
    backend: Any,
    device: int | None,
    as_json: bool,
    junit: Path | None,
    github: bool,
    diff: Path | None,
    folder: Path | None,
    **thresholds: float | None,
) -> None:
    """Compares the picture TEST with the picture REF, or the pictures of the folder TEST with those of the same names in REF.

    The rule "codes" lets 8-bit values differ by 1, and a few pixels take the value of a neighbour. "exact" allows no
    difference. "idiff" judges by thresholds, as OpenImageIO's idiff does; giving one of its options chooses it. An 8-bit value
    counts as a number from 0 to 1.

    With a scene, a picture fails if it is not what the scene allows. A warning says that only the new picture is right, or that
    both are right and differ.

    Exit codes: 0 same, 1 warning, 2 failure, 3 the sizes differ, 4 a file is missing or cannot be read, 64 wrong usage. The
    exit code of two folders is that of their worst pair.
    """
    rule, name = _rule(name, {key: value for key, value in thresholds.items() if value is not None})
    folders = os.path.isdir(reference)
    if folders != os.path.isdir(test) and os.path.exists(reference) and os.path.exists(test):
        raise click.UsageError("REF and TEST must both be files or both be folders")
    if github and as_json:
        raise click.UsageError("--github and --json both print to stdout; give one of them")
    if max_flip is not None and math.isnan(max_flip):
        raise click.BadParameter("NaN is not a limit", param_hint="'--max-flip'")
    if diff is not None:
        _check_diff(diff, folders)
    _check_outputs((reference, test), {"--diff": diff, "--junit": junit, "--report": folder})
    if flip and max_flip is None:
        max_flip = math.inf

    if overrides and scene is None:
        raise click.UsageError("--set changes the scene that --scene names; give both")

    from glshade.golden import report
    from glshade.golden.judge import compare_folders, compare_variants, variants_of
    from glshade.golden.scene_judge import SceneJudge

    scenes = None
    # A rule that the user names judges in place of a scene that only a sidecar names.
    if rule is None or scene is not None:
        scenes = SceneJudge(scene, overrides, backend=backend, device=device, models=models, shaders=shaders)
    if folders:
        found = compare_folders(reference, test, rule, scenes, max_flip=max_flip)
    else:
        variants = variants_of(reference.parent, reference.name, test)
        found = iter([compare_variants(variants, test, rule, scenes=scenes, max_flip=max_flip)])
    changes = {"scene": str(scene.absolute()), "overrides": tuple("=".join(pair) for pair in overrides)} if scene else {}
    page = _Page(folder, reference, rule, changes) if folder is not None else None
    if page is not None:
        found = iter(page.added(found))
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
    if page is not None:
        page.write()
    if diff is not None and results[0].layers:
        from glshade.golden.difference_picture import write_difference

        write_difference(reference, test, diff)
    raise SystemExit(int(worst))


def _rule(name: str | None, thresholds: dict[str, float]) -> tuple[Rule | None, str]:
    """Returns the rule that the options choose, None if they choose none, and its name. Errors: click.UsageError."""
    from glshade.document import nearest
    from glshade.golden.rules import RULES

    for option, value in thresholds.items():
        # No error is larger than NaN, so that every picture would pass.
        if math.isnan(value):
            raise click.BadParameter("NaN is not a threshold", param_hint=f"'--{option}'")
    if thresholds and name not in (None, "idiff"):
        raise click.UsageError(f"--{next(iter(thresholds))} is an option of the rule idiff, not of {name!r}")
    if name is None and not thresholds:
        return None, "codes"
    name = name or "idiff"
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


def _check_outputs(compared: Sequence[Path], outputs: dict[str, Path | None]) -> None:
    """Checks that no output would replace a compared picture, or become one at the next comparison. Errors: click.UsageError.

    outputs: option -> the file or folder to write; None where the option is not given.
    """
    given = {option: path for option, path in outputs.items() if path is not None}
    for option, path in given.items():
        for other in compared:
            if os.path.exists(path) and os.path.exists(other) and os.path.samefile(path, other):
                raise click.UsageError(f"{option} would replace {other}, which is compared; name another file")
            if os.path.isdir(other) and os.path.realpath(path).startswith(os.path.join(os.path.realpath(other), "")):
                raise click.UsageError(f"{option} writes into {other}, whose files are compared; name another place")


class _Page:
    """Collects the results in a folder, one after the other, and writes the page."""

    def __init__(self, folder: Path, reference: Path, rule: Rule | None, known: dict[str, Any]) -> None:
        """Nothing is written yet.

        reference: the folder of the reference pictures, or the only one.
        rule: the rule that judges; None for the one that each reference's sidecar names.
        known: what is known of the origin of all test pictures, by the name of the attribute.
        """
        from glshade.golden.results import ResultsWriter

        self._known = known

        self._folders, self._reference, self._rule, self._folder = os.path.isdir(reference), reference, rule, folder
        self._writer = ResultsWriter(folder, "compare")

    def added(self, results: Iterable[Result]) -> Iterable[Result]:
        """Adds the results to the folder, and yields them without their large parts. Errors: GlshadeError."""
        for result in results:
            self._add(result)
            yield replace(result, classes=None)

    def _add(self, result: Result) -> None:
        """Adds one result. Errors: GlshadeError."""
        from tempfile import TemporaryDirectory

        from glshade.golden.results import case_of
        from glshade.golden.sidecar import origin_of
        from glshade.image import file as picture_file
        from glshade.image.contents import PictureContents

        name = result.name if self._folders else self._reference.name
        # A file that is on one side only has no partner, and another may be missing altogether.
        pictures = {"actual": Path(result.path), "expected": Path(result.baseline)}
        pictures = {kind: path for kind, path in pictures.items() if os.path.isfile(path)}
        if result.path == result.baseline:
            del pictures["actual"]
        root = self._reference if self._folders else self._reference.parent
        case = case_of(
            result,
            id=name,
            name=name,
            root=root,
            rule=self._rule or _rule_beside(root, name, Path(result.path)),
            origin=origin_of(pictures["actual"]).model_copy(update=self._known) if "actual" in pictures else None,
            missing="expected" not in pictures,
        )
        with TemporaryDirectory() as folder:
            if result.classes is not None:
                pictures["classes"] = Path(folder) / "classes.png"
                picture_file.write(pictures["classes"], PictureContents(result.classes, "srgb", premultiplied=False))
            self._writer.add(case, pictures)

    def write(self) -> None:
        """Writes the page. Errors: GlshadeError."""
        from glshade.golden.page import write_page

        write_page(self._folder, self._writer.finish())


def _rule_beside(root: Path, name: str, test: Path) -> Rule:
    """Returns the rule that the sidecar of a reference picture names, by default `codes`.

    root: the folder of reference pictures. name: the picture's name in it. test: the test picture.
    """
    from glshade.golden.baselines import rule_of
    from glshade.golden.judge import variants_of
    from glshade.golden.rules.codes import Codes

    try:
        return rule_of(variants_of(root, name, test))
    except GlshadeError:
        # The result tells the fault of the sidecar.
        return Codes()


def _printed(results: Iterable[Result], every: bool) -> Iterable[Result]:
    """Yields the results, and prints each that is not the same; `every` prints those that are the same, too."""
    from glshade.golden import report

    for result in results:
        if every or result.outcome:
            click.echo(report.line(result))
        yield result


def _print_for_github(results: Sequence[Result]) -> None:
    """Prints annotations, and adds to the file that GITHUB_STEP_SUMMARY names, if it names one. Errors: OSError."""
    from glshade.golden import report

    for annotation in report.github_annotations(results):
        click.echo(annotation)
    summary = os.environ.get("GITHUB_STEP_SUMMARY")
    if summary:
        with open(summary, "a", encoding="utf-8") as file:
            file.write(report.step_summary(results))
