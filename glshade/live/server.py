"""Server: answers requests by HTTP and by the WebSocket. It reads the files of the page, and asks the session for the rest.

Nothing can be changed by HTTP, and by the WebSocket only the scene file.
"""

from __future__ import annotations

import asyncio
import contextlib
import re
import socket
from collections.abc import AsyncIterator, Awaitable, Callable, MutableMapping
from pathlib import Path
from typing import Any, TypeAlias

import uvicorn
from starlette.applications import Starlette
from starlette.datastructures import MutableHeaders
from starlette.requests import Request
from starlette.responses import HTMLResponse, PlainTextResponse, Response
from starlette.routing import Route, WebSocketRoute
from starlette.websockets import WebSocket, WebSocketDisconnect

from glshade.errors import GlshadeError, printable
from glshade.live.access import METHODS, SOCKET, Access, Decision, RequestFacts, bracketed, decide
from glshade.live.messages import Frame
from glshade.live.session import Session, TooManyPages
from glshade.live.viewer import POLICY_VIOLATION, TRY_AGAIN_LATER, SlowReader, Viewer, text_of
from glshade.live.wire import LARGEST_MESSAGE, as_json, parse_view

PAGE = Path(__file__).parent / "page"
# The files of the page, by the ends of their names.
MEDIA_TYPES = {
    ".html": "text/html; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".svg": "image/svg+xml",
    ".png": "image/png",
    ".woff2": "font/woff2",
}
NAME = re.compile(r"[A-Za-z0-9_-]+(\.[a-z0-9]+)+")
# The connections that may be open at the same time, with those of pages that are just being loaded.
MOST_CONNECTIONS = 64
# Code of the WebSocket protocol for a message that is too large.
MESSAGE_TOO_BIG = 1009
# The time in which connections must end when the server ends [s].
FAREWELL = 1

Scope: TypeAlias = MutableMapping[str, Any]
Receive: TypeAlias = Callable[[], Awaitable[MutableMapping[str, Any]]]
Send: TypeAlias = Callable[[MutableMapping[str, Any]], Awaitable[None]]
# An answer with 303 would lose the cookie: a browser that followed a link in another site's page, such as a terminal in the
# browser, does not send a cookie with SameSite=Strict to the address of a redirect. It does when the page itself goes on.
ENTRANCE = """<!doctype html><html lang="en"><meta charset="utf-8"><meta http-equiv="refresh" content="0; url=/">
<title>glshade</title><link rel="icon" href="/page/icon.svg"><p><a href="/">Continue</a></p></html>
"""


def app(session: Session, access: Access, lifespan: Any = None) -> Callable[[Scope, Receive, Send], Awaitable[None]]:
    """Returns the ASGI application.

    session: state that the pages share
    access: the secret and the names of the server
    lifespan: context in which requests are answered, as Starlette takes it; optional
    """

    async def page(request: Request) -> Response:
        return _file("index.html")

    async def page_file(request: Request) -> Response:
        return _file(request.path_params["name"])

    async def state(request: Request) -> Response:
        return Response(as_json(session.state()), media_type="application/json")

    async def frame(request: Request) -> Response:
        try:
            view = parse_view(request.query_params)
        except ValueError as error:
            return _line(400, str(error))
        answer = await session.still_picture(view)
        if not isinstance(answer, Frame):
            return _line(503 if session.shown == 0 else 400, text_of(answer))
        return Response(answer.data, media_type=answer.mime, headers={"X-Glshade-Revision": str(answer.revision)})

    async def page_socket(websocket: WebSocket) -> None:
        await websocket.accept()
        await _serve(session, websocket)

    routes = [
        Route("/", page),
        Route("/page/{name}", page_file),
        Route("/state.json", state),
        Route("/frame.png", frame),
        WebSocketRoute(SOCKET, page_socket),
    ]
    inner = Starlette(routes=routes, exception_handlers={404: _not_found}, lifespan=lifespan)

    async def guarded(scope: Scope, receive: Receive, send: Send) -> None:
        """Answers a request if access is granted, with headers that keep other sites out."""
        if scope["type"] == "lifespan":
            await inner(scope, receive, send)
            return
        facts = RequestFacts.of(scope)
        decision = decide(access, facts)
        answer = inner if decision.granted and decision.cookie is None else _answer_to(decision)
        # A refused Host is not repeated.
        host = facts.hosts[0] if decision.granted else ""
        await answer(scope, receive, _with_headers(send, host))

    return guarded


class Listener:
    """A socket that listens. Its port is known before the server starts."""

    def __init__(self, host: str, port: int) -> None:
        """Binds an address. Errors: GlshadeError if it is taken, or not an address of this machine."""
        family = socket.AF_INET6 if ":" in host else socket.AF_INET
        try:
            self.socket = socket.create_server((host, port), family=family)
            # Nagle's algorithm would hold the picture back for 40 ms, until the browser has acknowledged the state before it.
            # asyncio switches it off only where a socket names its protocol; connections inherit the option.
            self.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        except (OSError, OverflowError) as error:
            reason = error.strerror if isinstance(error, OSError) else str(error)
            raise GlshadeError(f"{bracketed(host)}:{port}: cannot listen there: {reason}") from None
        self.port: int = self.socket.getsockname()[1]


async def serve(session: Session, access: Access, listener: Listener) -> None:
    """Runs the session and answers requests until SIGINT or SIGTERM, and ends the session's processes then.

    session: state that the pages share, which does not run yet
    access: the secret and the names of the server
    listener: socket that listens
    Errors: those that end the session, such as BrokenPipeError of the standard output.
    """

    working: asyncio.Task[None] | None = None

    @contextlib.asynccontextmanager
    async def lifespan(_: Starlette) -> AsyncIterator[None]:
        nonlocal working
        working = asyncio.create_task(session.run())
        working.add_done_callback(lambda _: setattr(server, "should_exit", True))
        yield
        working.cancel()
        await asyncio.wait([working])

    server = uvicorn.Server(
        uvicorn.Config(
            app(session, access, lifespan),
            http="h11",
            ws="websockets-sansio",
            log_config=None,
            log_level="error",
            access_log=False,
            server_header=False,
            proxy_headers=False,
            ws_max_size=LARGEST_MESSAGE,
            # Pictures are compressed already.
            ws_per_message_deflate=False,
            limit_concurrency=MOST_CONNECTIONS,
            timeout_graceful_shutdown=FAREWELL,
        )
    )
    await server.serve(sockets=[listener.socket])
    if working is not None and not working.cancelled():
        # A session that ended by itself did so by an error.
        working.result()


async def _serve(session: Session, websocket: WebSocket) -> None:
    """Serves a page until its connection ends, and says in one line why the server ended it."""
    try:
        viewer = Viewer(session, websocket)
        with session.connected(viewer):
            await viewer.run()
    except TooManyPages as error:
        await _refuse(session, websocket, TRY_AGAIN_LATER, str(error))
    except SlowReader as error:
        await _refuse(session, websocket, POLICY_VIOLATION, str(error))
    except WebSocketDisconnect as error:
        if error.code == MESSAGE_TOO_BIG:
            text = f"a page's connection ended at a message that is too large: a page may send {LARGEST_MESSAGE} bytes"
            session.announce("refused", text=text)


async def _refuse(session: Session, websocket: WebSocket, code: int, text: str) -> None:
    """Tells a page why its connection ends, and ends it."""
    session.announce("refused", text=text)
    with contextlib.suppress(WebSocketDisconnect, RuntimeError, TimeoutError):
        async with asyncio.timeout(FAREWELL):
            if code == TRY_AGAIN_LATER:
                await websocket.send_text(as_json({"type": "error", "text": text}))
            await websocket.close(code, text)


def _file(name: str) -> Response:
    """Returns a file of the page. Only names without a folder are found."""
    path = PAGE / name
    if not NAME.fullmatch(name) or path.suffix not in MEDIA_TYPES or not path.is_file():
        return _line(404, "There is no such file.")
    return Response(path.read_bytes(), media_type=MEDIA_TYPES[path.suffix])


def _line(status: int, text: str, headers: dict[str, str] | None = None) -> Response:
    """Returns an answer that is one line of text."""
    return PlainTextResponse(f"{printable(text)}\n", status, headers)


async def _not_found(request: Request, error: Exception) -> Response:
    return _line(404, "There is no such address.")


def _answer_to(decision: Decision) -> Response:
    """Returns the answer to a request that is refused, or that exchanges the token for the cookie."""
    if decision.cookie is not None:
        answer = HTMLResponse(ENTRANCE)
        name, value = decision.cookie
        answer.set_cookie(name, value, httponly=True, samesite="strict", path="/")
        return answer
    headers = {401: {"WWW-Authenticate": "Bearer"}, 405: {"Allow": ", ".join(METHODS)}}
    return _line(decision.status, decision.reason, headers.get(decision.status))


def _with_headers(send: Send, host: str) -> Send:
    """Returns a `send` that adds headers which keep the answers out of caches and out of other sites' pages.

    host: value of the header Host, by which the page names the WebSocket
    """
    # Older versions of Safari do not take 'self' for the WebSocket.
    policy = (
        "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob:; font-src 'self'; "
        f"connect-src 'self' ws://{host}; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    )

    async def sending(message: MutableMapping[str, Any]) -> None:
        if message["type"] in ("http.response.start", "websocket.http.response.start"):
            headers = MutableHeaders(scope=message)
            headers["Content-Security-Policy"] = policy
            headers["X-Content-Type-Options"] = "nosniff"
            headers["Cache-Control"] = "no-store"
            headers["Referrer-Policy"] = "no-referrer"
            headers["Cross-Origin-Resource-Policy"] = "same-origin"
            headers["Cross-Origin-Opener-Policy"] = "same-origin"
        await send(message)

    return sending
