"""Command `glshade check`: compiles all programs that scenes and shader files are part of, and lists every error."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from glshade.cli._options import driver, unread_folders
from glshade.errors import printable
from glshade.github import annotation, path_in_repository

if TYPE_CHECKING:
    from glshade.gl.check import Check
    from glshade.problem import Problem

HINT = " that a scene can ask for; --shaders or --models names the folder that it belongs to"


@click.command()
@click.argument("files", metavar="[FILE]...", nargs=-1, type=click.Path(path_type=Path))
@driver
@unread_folders
@click.option("--json", "as_json", is_flag=True, help="Prints the errors as one JSON object.")
@click.option("--github", is_flag=True, help="Prints the errors as annotations of a GitHub workflow.")
def command(
    files: tuple[Path, ...],
    backend: Any,
    device: int | None,
    shaders: tuple[str, ...],
    models: tuple[str, ...],
    as_json: bool,
    github: bool,
) -> None:
    """Compiles every program that each FILE is part of, and lists all errors.

    A FILE is a scene, a mesh file or a GLSL file. Without FILE, the programs use all models at all shading rates with all kinds
    of light. Nothing is drawn. The exit code is 4 if a shader has errors, and 3 if only scenes have; it is 2 if no program
    contains a FILE that was named.
    """
    from glshade.gl.check import SHADER_SUFFIXES, check_files
    from glshade.gl.context import open_context

    for path in files:
        if path.suffix.lower() in SHADER_SUFFIXES and not path.is_file():
            raise click.BadParameter(f"{path} does not exist", param_hint="'[FILE]...'")
    context = open_context(backend, device)
    try:
        result = check_files(context, files, shaders, models)
    finally:
        context.release()
    if as_json:
        from glshade.cli import _table

        _table.as_json(result.as_dict())
    else:
        _print(result, github)
    for unused in result.unused:
        click.echo(f"glshade: warning: {printable(unused)} is part of no program{HINT}", err=True)
    raise SystemExit(result.exit_code or (2 if files and result.unused else 0))


def _print(result: Check, github: bool) -> None:
    """Prints the errors, and a last line with their number. github: whether to print annotations of a workflow."""
    for problem in result.problems:
        if github:
            click.echo(_annotation(problem))
        else:
            click.echo("\n".join(map(printable, problem.text().split("\n"))))
    found = len(result.problems)
    click.echo(f"{result.programs} programs, {found or 'no'} {'error' if found == 1 else 'errors'}")


def _annotation(problem: Problem) -> str:
    """Returns an error as a command of GitHub's workflows: `::error file=...,line=...,col=...::message`."""
    # A file of generated text is in no repository.
    is_file = bool(problem.file) and not problem.file.startswith("<")
    if not is_file:
        return annotation("error", str(problem))
    return annotation("error", problem.message, file=path_in_repository(problem.file), line=problem.line, col=problem.column)
