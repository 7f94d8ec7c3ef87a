"""The command line, run in the process of the test."""

from __future__ import annotations

import sys
import warnings
from typing import NamedTuple

import pytest


class Result(NamedTuple):
    """The result of a command: its exit code, and the texts that it wrote to stdout and stderr."""

    code: int
    out: str
    err: str


def run_command(capsys: pytest.CaptureFixture[str], *arguments: object) -> Result:
    """Runs `glshade` with these arguments in this process and returns its Result."""
    from glshade.cli import run

    with pytest.MonkeyPatch.context() as patch, warnings.catch_warnings():
        patch.setattr(sys, "argv", ["glshade", *map(str, arguments)])
        # The command prints warnings to stderr, while pytest turns them into errors.
        warnings.simplefilter("default")
        with pytest.raises(SystemExit) as exit:
            run()
    out, err = capsys.readouterr()
    assert "Traceback" not in err
    return Result(int(exit.value.code or 0), out, err)
