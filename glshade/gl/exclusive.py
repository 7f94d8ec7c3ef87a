"""Exclusive: a context that one thread uses at a time, and that refuses to be used in a forked process.

OpenGL lets a context be current in one thread only, and drivers do not survive a fork: their own threads are gone in the child,
which then waits for them for ever.
"""

from __future__ import annotations

import os
import threading
from typing import Any, Protocol

from glshade.errors import ContextError

FORKED = (
    "OpenGL was used before this process was forked, and does not survive that: start processes by spawn "
    '(multiprocessing.get_context("spawn"), DataLoader(multiprocessing_context="spawn")), or make the first Renderer after the '
    "fork"
)

# The addresses of GL functions. moderngl never frees the number that it is given for each function of each context, so equal
# addresses are one object.
_ADDRESSES: dict[int, int] = {}
# The process in which the driver was first loaded; None before that.
_home: int | None = None


def note_driver() -> None:
    """Notes that this process loads a driver. Errors: ContextError in a process that was forked afterwards."""
    global _home
    if _home is None:
        _home = os.getpid()
    check_fork()


def check_fork() -> None:
    """Checks that no driver was loaded before this process was forked. Errors: ContextError."""
    if _home not in (None, os.getpid()):
        raise ContextError(FORKED)


class Currency(Protocol):
    """How a platform tells and sets the context that is current in a thread."""

    def current(self) -> Any:
        """Returns what `restore` needs to make the context current again that is current now, or none."""

    def restore(self, current: Any) -> None:
        """Makes a context current again. For None, no context stays current if the platform bears that."""


class Exclusive:
    """A context object for moderngl that wraps the one of glcontext or OSMesa.

    While a thread is between `__enter__` and `__exit__`, other threads wait in `__enter__`. A thread may enter several times,
    and other contexts in between. Afterwards that context is current which was current before.
    """

    def __init__(self, window: Any, currency: Currency) -> None:
        """window: the context object that moderngl would otherwise get as `context=`."""
        self._window, self._currency = window, currency
        self._lock = threading.RLock()
        # What was current at each `__enter__` that has not ended.
        self._before: list[Any] = []

    def load_opengl_function(self, name: str) -> int:
        """Returns the address of a GL function, 0 if the driver does not have it."""
        address: int = self._window.load_opengl_function(name)
        return _ADDRESSES.setdefault(address, address)

    def __enter__(self) -> None:
        check_fork()
        self._lock.acquire()
        self._before.append(self._currency.current())
        self._window.__enter__()

    def __exit__(self, *unused: Any) -> None:
        try:
            self._currency.restore(self._before.pop())
        finally:
            self._lock.release()

    def leave(self) -> None:
        """Lets other threads enter a new context, which is current in the thread that made it."""
        self._currency.restore(None)

    def release(self) -> None:
        """Destroys the context, once no other thread uses it. In a forked process it is left to its own process."""
        if _home == os.getpid():
            with self._lock:
                self._window.release()
