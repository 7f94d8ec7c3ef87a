"""The command line: one module a command, found by its presence. The table of exit codes is in docs/exit-codes.md."""

from __future__ import annotations

import atexit
import importlib
import os
import sys
import warnings
from contextlib import suppress
from pathlib import Path
from typing import NoReturn

import click

from glshade.errors import GlshadeError
from glshade.version import __version__

# pydantic would read the metadata of every installed package, to look for plug-ins of its own: 20 to 50 ms.
os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")

COMMANDS = tuple(sorted(path.stem for path in Path(__file__).parent.glob("*.py") if not path.stem.startswith("_")))
INTERRUPTED = 130


class Commands(click.Group):
    """Loads a command when it is called for: `glshade render` pays for nothing but rendering."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name not in COMMANDS:
            return None
        command = importlib.import_module(f"glshade.cli.{cmd_name}").command
        assert isinstance(command, click.Command)
        return command

    def invoke(self, ctx: click.Context) -> object:
        try:
            result: object = super().invoke(ctx)
            sys.stdout.flush()
            return result
        except BrokenPipeError:
            # Nothing more to say, nor to flush at exit. click would exit with 1.
            silence()
            return 0

    def resolve_command(self, ctx: click.Context, args: list[str]) -> tuple[str | None, click.Command | None, list[str]]:
        if args and not args[0].startswith("-") and args[0] not in COMMANDS:
            import difflib

            close = difflib.get_close_matches(args[0], COMMANDS, n=1)
            hint = f'; did you mean "{close[0]}"?' if close else f"; commands: {', '.join(COMMANDS)}"
            raise click.UsageError(f'no command "{args[0]}"{hint}', ctx)
        return super().resolve_command(ctx, args)


def silence() -> None:
    """Whoever read stdout has closed it (`| head`): what is still written goes nowhere."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


@click.group(cls=Commands, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(__version__, prog_name="glshade")
def cli() -> None:
    """A GLSL shader suite on headless OpenGL: a scene goes in; a picture, and the proof that it is right, come out."""


def main() -> None:
    """The `glshade` command, to the end of its process.

    The operating system takes memory back at once; taking interpreter and driver apart first would take 0.1 s.
    """
    try:
        run()
    except SystemExit as error:
        code = error.code
    atexit._run_exitfuncs()
    for stream in (sys.stdout, sys.stderr):
        with suppress(BrokenPipeError):
            stream.flush()
    os._exit(code if isinstance(code, int) else 0)


def run() -> NoReturn:
    """Does what the command line says and raises SystemExit, with an exit code of the table.

    Every error that is known is one line a fault on stderr.
    """
    warnings.showwarning = lambda message, *_: click.echo(f"glshade: warning: {message}", err=True)
    try:
        code = cli.main(standalone_mode=False)
    except GlshadeError as error:
        for line in str(error).splitlines():
            click.echo(f"glshade: {line}", err=True)
        code = error.exit_code
    except click.ClickException as error:
        error.show()
        code = error.exit_code
    except (click.Abort, KeyboardInterrupt):
        click.echo("glshade: interrupted", err=True)
        code = INTERRUPTED
    except (OSError, MemoryError) as error:
        click.echo(f"glshade: {error}", err=True)
        code = 1
    sys.exit(code if isinstance(code, int) else 0)
