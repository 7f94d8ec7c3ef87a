"""Command `glshade approve`: makes the pictures of a run the new baselines."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from glshade.cli._options import models
from glshade.cli._stderr import without_libpng
from glshade.errors import printable

if TYPE_CHECKING:
    from collections.abc import Sequence

    from glshade.golden.approval import Approval
    from glshade.golden.results import Case

# The value of --as-variant without a key. It is no key, since keys have no spaces.
BY_DRIVER = "by driver"
# What happened to a picture -> the word that is printed.
WORDS = {"new": "new", "replaced": "replaced", "sidecar": "sidecar", "unchanged": "same"}


@click.command()
@click.argument("results", type=click.Path(path_type=Path))
@click.option("--only", multiple=True, metavar="GLOB", help="Approves the pictures of these names, also those that passed.")
@click.option(
    "--as-variant",
    metavar="[KEY]",
    is_flag=False,
    flag_value=BY_DRIVER,
    help="Keeps the approved picture, and adds this one as NAME@KEY.png. Without KEY: the driver's name, such as llvmpipe.",
)
@click.option("--dry-run", is_flag=True, help="Prints what would be done, and changes nothing.")
@click.option(
    "--from",
    "source",
    type=click.Choice(["reference"]),
    help="Approves a picture that the float64 reference draws of the scene, in place of the run's picture.",
)
@click.option(
    "--accept-drift",
    is_flag=True,
    help="Approves also a picture that has crept away from the first approved one, in steps that all passed.",
)
@click.option(
    "--baselines",
    type=click.Path(path_type=Path, file_okay=False),
    metavar="FOLDER",
    help="Folder of baselines. Needed where the run's folder is not below the current one, as for results from CI.",
)
@models
def command(
    results: Path,
    only: tuple[str, ...],
    as_variant: str | None,
    dry_run: bool,
    source: str | None,
    accept_drift: bool,
    baselines: Path | None,
    models: tuple[str, ...],
) -> None:
    """Makes the pictures of a run the new baselines.

    RESULTS is a folder that `glshade compare --report` or pytest has written. All pictures that did not pass are approved, or
    none of them: if one cannot be approved, nothing is changed, and the exit code is 1. Look at the report first.
    """
    from glshade.golden.approval import approve, selected
    from glshade.golden.results import read

    if source and as_variant:
        raise click.UsageError(
            "--from reference makes the main picture, which is right on every driver; leave out --as-variant"
        )
    cases = read(results)
    _check_patterns(only, cases)
    wanted = selected(cases, only)
    if not wanted:
        click.echo(f"nothing to approve: {_passed(len(cases))}")
        return
    with without_libpng():
        approvals = approve(
            results,
            wanted,
            root=_root(wanted, baselines),
            as_variant=True if as_variant == BY_DRIVER else as_variant or False,
            from_reference=source is not None,
            accept_drift=accept_drift,
            dry_run=dry_run,
        )
    _print(approvals, dry_run)


def _check_patterns(only: Sequence[str], cases: Sequence[Case]) -> None:
    """Checks that every pattern of --only matches a case. Errors: click.BadParameter."""
    from glshade.document import nearest
    from glshade.golden.approval import selected

    for pattern in only:
        if not selected(cases, [pattern]):
            hint = nearest(pattern, {case.name for case in cases})
            raise click.BadParameter(printable(f"no picture of the run matches {pattern!r}{hint}"), param_hint="'--only'")


def _root(cases: Sequence[Case], given: Path | None) -> Path:
    """Returns the folder of baselines.

    The results may come from another machine, so the folder that they name is used only if it lies in the current folder.
    given: the value of --baselines; None where it is not given.
    Errors: click.UsageError.
    """
    named = sorted({case.baseline_root for case in cases})
    if len(named) > 1:
        raise click.UsageError(
            f"the results name several folders of baselines: {', '.join(named)}; choose pictures with --only"
        )
    if given is not None:
        # The folder itself is missing before the first approval.
        if not given.absolute().parent.is_dir():
            raise click.BadParameter(f"{given.parent} does not exist", param_hint="'--baselines'")
        return given
    root = Path(named[0])
    if not root.resolve().is_relative_to(Path.cwd().resolve()):
        raise click.UsageError(
            printable(f"the baselines of this run, {root}, are not in the current folder: give --baselines FOLDER")
        )
    return root


def _passed(count: int) -> str:
    """Returns in words that all pictures of a run passed."""
    if count == 0:
        return "the run compared no pictures"
    return "the only picture passed" if count == 1 else f"all {count} pictures passed"


def _print(approvals: Sequence[Approval], dry_run: bool) -> None:
    """Prints a line for each picture, and one with their number."""
    for approval in approvals:
        distance = f": distance {approval.distance:.3g}" if approval.what == "replaced" and approval.distance else ""
        click.echo(f"{WORDS[approval.what]:8}  {printable(approval.path)}{distance}")
        for note in approval.notes:
            click.echo(f"          {printable(note)}")
    changed = sum(approval.what != "unchanged" for approval in approvals)
    pictures = "1 picture" if changed == 1 else f"{changed} pictures"
    click.echo(f"{pictures} would be approved; nothing was changed" if dry_run else f"approved {pictures}")
