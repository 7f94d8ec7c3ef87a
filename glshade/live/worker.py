"""Worker: the work of a child process that draws, apart from its answers."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping
from typing import Any

from glshade.gl.renderer import Renderer
from glshade.live.faults import FAULTS, tables
from glshade.live.messages import Answer, Failed, Request


class RenderWorker:
    """A `child.Worker` with a Renderer of its own. A subclass says how it answers each kind of request.

    handlers: kind of request -> the function that answers it.
    """

    handlers: Mapping[type[Request], Callable[[Any], Answer]]

    def __init__(self, backend: str, device: str) -> None:
        """Does not open a context yet.

        backend: as for Renderer.
        device: an index of `glshade devices`, or empty for the default.
        """
        self._backend: Any = backend
        self._device = int(device) if device else None
        self._opened: Renderer | None = None

    @property
    def renderer(self) -> Renderer:
        """The renderer, which opens the context at first use. Errors: ContextError."""
        if self._opened is None:
            self._opened = Renderer(self._backend, self._device)
        return self._opened

    def answer(self, request: Request) -> Answer:
        """Returns the answer to a request. A fault of the user's files becomes an answer, too."""
        with warnings.catch_warnings():
            # Warnings about the scene would be printed once for each picture.
            warnings.simplefilter("ignore")
            try:
                return self.handlers[type(request)](request)
            except FAULTS as error:
                return Failed(id=request.id, problems=tables(error))

    def answered(self) -> None:
        """Does the work that is left after an answer was sent; nothing by default."""

    def idle(self) -> None:
        """Does the work that can wait until no request has come for a while; nothing by default."""
