"""Child: a process that answers requests one by one, and that is ended when it takes too long.

A driver may crash or hang on a user's shader. Only the child is lost then: the server starts another one.
"""

from __future__ import annotations

import asyncio
import os
import signal
import socket
import subprocess
import sys
from collections.abc import Callable, Coroutine
from dataclasses import replace
from multiprocessing.connection import Connection
from typing import Any, Protocol, TypeVar

from glshade.live.messages import Answer, Failed, Request
from glshade.problem import Problem

Result = TypeVar("Result")

# The longest time that a child may take for an answer [s].
LIMIT = 10.0
# The longest time that a child may take to start [s]: it imports NumPy and OpenGL, on a machine that may be busy.
START = 60.0
# The message with which a child says that it is ready for requests.
READY = "ready"
# A child is idle when no request has come for this time [s].
IDLE = 0.25


class ChildLost(Exception):
    """The child has died, or was ended because it took too long. Its text says which."""


class Child:
    """A process that runs the main function of a module, which is `main(connection, *arguments)`.

    limit: the longest time for an answer [s]; None: no limit.
    """

    def __init__(self, module: str, *arguments: Any, limit: float | None = LIMIT, nice: int = 0) -> None:
        """Does not start the process yet.

        module: the dotted name of the module, such as "glshade.live.drawer".
        arguments: texts that the main function gets.
        limit: the longest time for an answer [s]; None: no limit.
        nice: how much lower the priority of the process is, from 0 to 19.
        """
        self._command = [sys.executable, "-m", module]
        self._arguments = tuple(map(str, arguments))
        self.limit, self._nice = limit, nice
        self._process: subprocess.Popen[bytes] | None = None
        self._connection: Connection | None = None
        self._number = 0
        # Only one request at a time is on its way; the others wait for the lock in their order.
        self._lock = asyncio.Lock()

    @property
    def pid(self) -> int | None:
        """The id of the process; None while there is none."""
        return self._process.pid if self._process else None

    @property
    def alive(self) -> bool:
        """Whether the process runs."""
        return self._process is not None and self._process.poll() is None

    async def start(self) -> None:
        """Starts the process, unless it runs already, and waits until it is ready. Errors: ChildLost."""
        await _to_its_end(self._start_in_turn())

    async def ask(self, request: Request) -> Answer:
        """Returns the answer to a request. Starts the process where none runs.

        Cancelling the call does not cancel the request: the process answers one by one.
        Errors: ChildLost where the process dies or takes longer than `limit`, after which it is ended.
        """
        return await _to_its_end(self._ask_in_turn(request))

    def kill(self) -> None:
        """Ends the process at once. A request that is on its way raises ChildLost."""
        if self._process is not None:
            self._process.kill()
            self._process.wait()

    async def stop(self) -> None:
        """Ends the process and waits for its end."""
        self.kill()
        async with self._lock:
            self._forget()

    async def _start_in_turn(self) -> None:
        async with self._lock:
            await self._started()

    async def _ask_in_turn(self, request: Request) -> Answer:
        async with self._lock:
            await self._started()
            self._number += 1
            answer = await asyncio.to_thread(self._exchange, replace(request, id=self._number), self.limit)
            assert isinstance(answer, Answer)
            return replace(answer, id=request.id)

    async def _started(self) -> None:
        """Makes sure that the process runs. The lock must be held. Errors: ChildLost."""
        if self.alive:
            return
        self._forget()
        here, there = socket.socketpair()
        with there:
            options = [str(there.fileno()), str(self._nice), *self._arguments]
            # Standard output belongs to the server, which may write JSON to it, so the child writes to standard error.
            self._process = subprocess.Popen(
                [*self._command, *options], pass_fds=[there.fileno()], stdin=subprocess.DEVNULL, stdout=2
            )
        self._connection = Connection(here.detach())
        await asyncio.to_thread(self._exchange, None, START)

    def _exchange(self, request: Request | None, limit: float | None) -> Any:
        """Sends a request, if there is one, and returns the next message of the process. Errors: ChildLost."""
        connection, process = self._connection, self._process
        assert connection is not None
        assert process is not None
        try:
            if request is not None:
                connection.send(request)
            if not connection.poll(limit):
                process.kill()
                process.wait()
                raise ChildLost(f"took longer than {limit:g} s, and was ended")
            return connection.recv()
        except (EOFError, OSError):
            process.kill()
            raise ChildLost(_reason(process.wait())) from None

    def _forget(self) -> None:
        """Waits for the end of a process that was ended, and closes the connection to it."""
        if self._process is not None:
            self._process.kill()
            self._process.wait()
        if self._connection is not None:
            self._connection.close()
        self._process = self._connection = None


async def _to_its_end(work: Coroutine[Any, Any, Result]) -> Result:
    """Awaits some work, which goes on to its end where the caller is cancelled. Nobody then hears of its error."""
    task = asyncio.create_task(work)
    task.add_done_callback(lambda done: done.cancelled() or done.exception())
    return await asyncio.shield(task)


def _reason(code: int) -> str:
    """Returns the reason why a process ended, from its return code."""
    if code >= 0:
        return f"ended with exit code {code}"
    try:
        return f"was ended by {signal.Signals(-code).name}"
    except ValueError:
        return f"was ended by signal {-code}"


class Worker(Protocol):
    """The work of a child."""

    def answer(self, request: Any) -> Answer:
        """Returns the answer to a request."""

    def answered(self) -> None:
        """Does the work that is left after an answer was sent."""

    def idle(self) -> None:
        """Does the work that can wait until no request has come for a while."""


def serve(make: Callable[..., Worker]) -> None:
    """Runs a child: answers requests until the server closes the connection. The main part of a child's module calls it.

    make: takes the child's arguments, all of them texts, and returns its worker.
    """
    # Ctrl-C reaches all processes of the terminal. The child goes on until its server closes the connection.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    connection = Connection(int(sys.argv[1]))
    os.nice(int(sys.argv[2]))
    worker = make(*sys.argv[3:])
    try:
        connection.send(READY)
        while True:
            if not connection.poll(IDLE):
                worker.idle()
            request = connection.recv()
            connection.send(_answered(worker, request))
            worker.answered()
    except (EOFError, BrokenPipeError, ConnectionResetError):
        return


def _answered(worker: Worker, request: Request) -> Answer:
    """Returns the answer to a request. A bug of glshade must not end the child, so every exception becomes an answer."""
    try:
        return worker.answer(request)
    except Exception as error:
        line = " ".join(f"{type(error).__name__}: {error}".split())
        return Failed(id=request.id, problems=[Problem("", None, None, line, "driver").as_dict()])
