"""The command line: each module without a leading underscore is a command. docs/exit-codes.md lists the exit codes."""

from __future__ import annotations

import atexit
import importlib
import io
import os
import sys
import warnings
from contextlib import suppress
from pathlib import Path
from typing import NoReturn

import click

from glshade.errors import GlshadeError, printable
from glshade.startup import shorten
from glshade.version import __version__

COMMANDS = tuple(sorted(path.stem for path in Path(__file__).parent.glob("*.py") if not path.stem.startswith("_")))
# Exit code after Ctrl-C: 128 plus the number of SIGINT, as in shells.
INTERRUPTED = 130


class Commands(click.Group):
    """Imports a command's module only when the command is run, so that each command imports only what it needs."""

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
            # The reader of stdout has gone. This is not an error, but click would exit with code 1.
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
    """Redirects stdout to /dev/null. For use after the reader of stdout has closed it, as in `| head`."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def open_streams() -> None:
    """Opens /dev/null in place of the standard streams that the caller has closed, as with `2>&-`.

    Otherwise the next file to be opened would get the number of a standard stream, and drivers would print into it.
    """
    for number, name in enumerate(("stdin", "stdout", "stderr")):
        if getattr(sys, name) is None:
            # The new file gets the lowest free number, which is that of the stream.
            file = os.open(os.devnull, os.O_RDWR)
            os.set_inheritable(file, True)
            setattr(sys, name, os.fdopen(file, "w" if number else "r"))


@click.group(cls=Commands, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(__version__, prog_name="glshade")
def cli() -> None:
    """A GLSL shader suite on headless OpenGL: a scene goes in; a picture, and the proof that it is right, come out."""


def main() -> None:
    """Runs the `glshade` command and ends the process.

    The process ends without the shutdown of interpreter and driver, which would take 0.1 s. The operating system frees the
    memory faster.
    """
    shorten()
    open_streams()
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
    """Runs the command line, and raises SystemExit with an exit code of docs/exit-codes.md.

    Known errors are printed to stderr, one line for each fault.
    """
    warnings.showwarning = lambda message, *_: click.echo(f"glshade: warning: {printable(str(message))}", err=True)
    try:
        code = cli.main(standalone_mode=False)
    except GlshadeError as error:
        for line in str(error).split("\n"):
            click.echo(f"glshade: {printable(line)}", err=True)
        code = error.exit_code
    except click.ClickException as error:
        shown = io.StringIO()
        error.show(shown)
        for line in shown.getvalue().rstrip("\n").split("\n"):
            click.echo(printable(line), err=True)
        code = error.exit_code
    except (click.Abort, KeyboardInterrupt):
        click.echo("glshade: interrupted", err=True)
        code = INTERRUPTED
    except (OSError, MemoryError) as error:
        click.echo(f"glshade: {printable(str(error))}", err=True)
        code = 1
    sys.exit(code if isinstance(code, int) else 0)
