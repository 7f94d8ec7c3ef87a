"""Command `glshade test`: runs unit tests that are written in GLSL."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from glshade.cli._options import driver, shaders
from glshade.errors import printable

if TYPE_CHECKING:
    from glshade.debug.shader_test import Outcome
    from glshade.gl.context import Context

# The exit code where a test fails, as for a picture that is not verified.
FAILED = 6
# The exit code where no test is found, as for any wrong usage.
NONE = 2


@click.command()
@click.argument("files", metavar="[FILE]...", nargs=-1, type=click.Path(path_type=Path))
@driver
@shaders
@click.option("--only", "-k", metavar="TEXT", default="", help="Runs only tests whose names hold TEXT.")
@click.option(
    "--count",
    type=click.IntRange(1, 1 << 20),
    default=4096,
    show_default=True,
    help="Number of pairs of directions for tests that take them.",
)
@click.option("--seed", type=click.IntRange(0), default=1, show_default=True, help="Seed of the random directions.")
@click.option("--cpu", is_flag=True, help="Runs the tests on the CPU alone.")
@click.option("--json", "as_json", is_flag=True, help="Prints the outcomes as one JSON list.")
def command(
    files: tuple[Path, ...],
    backend: Any,
    device: int | None,
    shaders: tuple[str, ...],
    only: str,
    count: int,
    seed: int,
    cpu: bool,
    as_json: bool,
) -> None:
    """Runs unit tests that are written in GLSL.

    Each FILE is a file *.test.glsl, or a folder of such files; the default is the current folder. A test is a function
    `bool test_NAME()`, or `bool test_NAME(vec3 l, vec3 v)`, which must hold for many pairs of unit directions. It is run in
    float64 and in float32 on the CPU, and in both stages on the GPU. The exit code is 6 if a test fails, and 2 if there is no
    test.
    """
    from glshade.debug.shader_test import find_tests, run_test, test_files
    from glshade.glsl.shaders import current

    tests = [test for path in test_files(files or (Path(),)) for test in find_tests(path) if only in test.name]
    if not tests:
        click.echo("glshade: there is no test; a test is a function `bool test_NAME()` in a file *.test.glsl", err=True)
        raise SystemExit(NONE)
    context = None if cpu else _context(backend, device)
    outcomes = []
    try:
        for test in tests:
            outcome = run_test(test, current(shaders), context, count, seed)
            outcomes.append(outcome)
            if not as_json:
                _print(outcome)
    finally:
        if context is not None:
            context.release()
    failed = sum(not outcome.passed for outcome in outcomes)
    if as_json:
        from glshade.cli import _table

        _table.as_json([outcome.as_dict() for outcome in outcomes])
    else:
        click.echo(f"{len(outcomes) - failed} passed, {failed} failed")
    raise SystemExit(FAILED if failed else 0)


def _context(backend: Any, device: int | None) -> Context | None:
    """Returns a context; None, with a warning, where none can be opened and no backend was named."""
    from glshade.errors import ContextError
    from glshade.gl.context import open_context

    try:
        return open_context(backend, device)
    except ContextError as error:
        if backend != "auto":
            raise
        click.echo(f"glshade: warning: the tests run on the CPU alone: {error}", err=True)
        return None


def _print(outcome: Outcome) -> None:
    """Prints an outcome: one line for a test that passed, and the values of its variables for one that failed."""
    test = outcome.test
    place = printable(f"{os.path.relpath(test.path)}:{test.line}")
    if outcome.passed:
        click.echo(f"passed  {place} {test.name}")
        return
    click.echo(f"FAILED  {place} {test.name}")
    if outcome.error:
        click.echo("\n".join(f"        {printable(line)}" for line in outcome.error.splitlines()))
    for line in outcome.report():
        click.echo(f"        {printable(line)}")
