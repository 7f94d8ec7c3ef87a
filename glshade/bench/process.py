"""Process: runs programs in processes of their own, which may fail, crash or hang without ending the benchmark."""

from __future__ import annotations

import json
import os
import selectors
import signal
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from time import monotonic
from typing import Any

from glshade.errors import GlshadeError

# The longest time that a program may take to start, or to answer a request [s]. The slowest round of any program takes half a
# minute on a machine with two cores.
PATIENCE = 240.0
# The length of a message about a failure [characters]: a line on a screen or two.
LONGEST_FAULT = 200
# Words in the message of a failed program, and the advice that follows the message.
ADVICE = {
    "LLVM ERROR": "its LLVM library does not suit it: install another (Debian: libllvm19) or name one in DRJIT_LIBLLVM_PATH",
    "libLLVM": "it needs an LLVM library (Debian: libllvm19; elsewhere name one in DRJIT_LIBLLVM_PATH)",
}


# Python's variable that keeps it from storing compiled modules. Without them each start compiles all modules anew, which takes
# longer than what is measured.
UNCACHED = "PYTHONDONTWRITEBYTECODE"


class ProgramError(GlshadeError):
    """The exception that is raised if a program ended before it had done its work. The message says why, in one line."""


@dataclass(frozen=True)
class Run:
    """One finished command.

    seconds: wall-clock time from the start to the end of its process [s]
    peak: largest resident memory of its largest process [bytes]
    out: text of its stdout
    """

    seconds: float
    peak: int
    out: str


def timed(command: Sequence[str], name: str, environment: Mapping[str, str] | None = None) -> Run:
    """Runs a command and measures it.

    command: the command
    name: name of the program, for messages
    environment: environment variables that are added or replaced
    Errors: ProgramError if it cannot be started, its exit code is not 0, or it takes longer than PATIENCE.
    """
    with tempfile.TemporaryDirectory(prefix="glshade-bench-") as folder:
        result = Path(folder) / "result.json"
        launcher = [sys.executable, "-I", "-S", str(Path(__file__).with_name("launcher.py")), str(result), *command]
        process = subprocess.Popen(
            launcher,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            errors="replace",
            env=_environment(environment or {}),
            start_new_session=True,
        )
        try:
            out, errors = process.communicate(timeout=PATIENCE)
        except subprocess.TimeoutExpired:
            raise ProgramError(f"{name} {_late()}") from None
        finally:
            end(process)
        if not result.is_file():
            raise ProgramError(fault(name, errors, process.returncode))
        measured = json.loads(result.read_text(encoding="utf-8"))
    if measured["code"]:
        raise ProgramError(fault(name, errors, measured["code"]))
    return Run(measured["seconds"], measured["peak"], out)


class Conversation:
    """A process that answers questions. Each question and each answer is one line of JSON."""

    def __init__(self, name: str, command: Sequence[str]) -> None:
        """Starts the process and waits for its first answer, which `first` holds. Errors: ProgramError."""
        self._name = name
        # stderr goes to a file, because a pipe that nobody reads would fill up and block the process.
        self._errors = tempfile.TemporaryFile("w+", errors="replace")  # noqa: SIM115 it stays open as long as the process runs
        try:
            self._process = subprocess.Popen(
                command,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=self._errors,
                env=_environment({}),
                start_new_session=True,
            )
        except OSError as error:
            self._errors.close()
            raise ProgramError(f"{name} cannot be started: {error.strerror or error}") from None
        self._rest = b""
        self.first: Any = self._answer()

    def ask(self, question: Any) -> Any:
        """Returns the answer to a question. Errors: ProgramError."""
        assert self._process.stdin is not None
        # Where the process has ended, `_answer` raises its last message.
        with suppress(BrokenPipeError):
            self._process.stdin.write(json.dumps(question).encode() + b"\n")
            self._process.stdin.flush()
        return self._answer()

    def _answer(self) -> Any:
        line = self._line()
        if line:
            try:
                return json.loads(line)
            except ValueError:
                raise ProgramError(self._ended(f"{self._name} answered something that is not JSON")) from None
        with suppress(subprocess.TimeoutExpired):
            self._process.wait(PATIENCE)
        self._errors.seek(0)
        raise ProgramError(self._ended(fault(self._name, self._errors.read(), self._process.returncode)))

    def _line(self) -> bytes:
        """Returns the next line of the process; empty if it has ended. Errors: ProgramError after PATIENCE."""
        assert self._process.stdout is not None
        latest = monotonic() + PATIENCE
        with selectors.DefaultSelector() as selector:
            selector.register(self._process.stdout, selectors.EVENT_READ)
            while b"\n" not in self._rest:
                if not selector.select(max(0.0, latest - monotonic())):
                    raise ProgramError(self._ended(f"{self._name} {_late()}"))
                read = os.read(self._process.stdout.fileno(), 1 << 16)
                if not read:
                    return b""
                self._rest += read
        line, _, self._rest = self._rest.partition(b"\n")
        return line

    def _ended(self, message: str) -> str:
        """Ends the process at once and returns the message."""
        end(self._process)
        self._errors.close()
        return message

    def close(self) -> None:
        """Lets the process end by itself."""
        if not self._errors.closed:
            with suppress(subprocess.TimeoutExpired):
                self._process.communicate(timeout=PATIENCE)
            self._ended("")


def _environment(added: Mapping[str, str]) -> dict[str, str]:
    """Returns the environment of a program: that of this process with some variables added, and without UNCACHED."""
    return {name: value for name, value in {**os.environ, **added}.items() if name != UNCACHED}


def end(process: subprocess.Popen[Any]) -> None:
    """Kills a process that still runs, with its children: it leads a session of its own."""
    if process.poll() is None:
        with suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()
    for stream in (process.stdin, process.stdout, process.stderr):
        if stream is not None:
            with suppress(BrokenPipeError):
                stream.close()


def fault(name: str, output: str, code: int | None) -> str:
    """Returns why a program ended early, in one line: its signal, and its last line that mentions an error, or its last line.

    name: name of the program
    output: text that it printed to stderr
    code: its exit code; negative for a signal; None if it is not known
    """
    lines = [line.strip() for line in output.splitlines() if line.strip()]
    errors = [line for line in lines if "error" in line.lower()]
    last = (errors or lines or ["it printed nothing"])[-1][:LONGEST_FAULT]
    by = ""
    if code is not None and code < 0:
        by = f" by {signal.Signals(-code).name}" if -code in set(signal.Signals) else f" by signal {-code}"
    advice = next((f"; {text}" for words, text in ADVICE.items() if words in last), "")
    return f"{name} ended early{by}: {last}{advice}"


def _late() -> str:
    return f"took longer than {PATIENCE:g} s and was ended"
