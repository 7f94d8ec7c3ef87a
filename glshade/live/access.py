"""Access: decides which requests the server of `glshade dev` answers.

Every page of every web site that the user visits can send requests to a server on this machine, and so can every user of the
machine. So a request must name this server as its host, must not come from another site's page, and must hold the secret that
only the user of the server knows. docs/live.md lists the rules.
"""

from __future__ import annotations

import hmac
from collections.abc import Mapping
from dataclasses import dataclass
from ipaddress import ip_address
from typing import Any, Literal
from urllib.parse import parse_qs

# Nothing can be changed by HTTP: a page sends its wishes through the WebSocket.
METHODS = ("GET", "HEAD")
# The path of the WebSocket.
SOCKET = "/socket"
# Port that addresses of http:// leave out.
HTTP_PORT = 80


@dataclass(frozen=True)
class RequestFacts:
    """Everything about a request that the decision depends on. A header that occurs several times has several values.

    kind: "http" or "websocket"
    method: method of HTTP; a WebSocket starts with GET
    path: path without the query, decoded
    query: text after the question mark
    hosts: values of the header Host
    origins: values of the header Origin
    cookies: values of the header Cookie
    authorizations: values of the header Authorization
    """

    kind: Literal["http", "websocket"] = "http"
    method: str = "GET"
    path: str = "/"
    query: str = ""
    hosts: tuple[str, ...] = ()
    origins: tuple[str, ...] = ()
    cookies: tuple[str, ...] = ()
    authorizations: tuple[str, ...] = ()

    @classmethod
    def of(cls, scope: Mapping[str, Any]) -> RequestFacts:
        """Returns the facts of a request, from its ASGI connection scope."""

        def values(name: bytes) -> tuple[str, ...]:
            return tuple(value.decode("latin-1") for key, value in scope["headers"] if key.lower() == name)

        return cls(
            kind=scope["type"],
            method=scope.get("method", "GET"),
            path=scope["path"],
            query=scope["query_string"].decode("latin-1"),
            hosts=values(b"host"),
            origins=values(b"origin"),
            cookies=values(b"cookie"),
            authorizations=values(b"authorization"),
        )


@dataclass(frozen=True)
class Access:
    """The secret and the names of a server.

    token: secret that the printed address holds; `Authorization: Bearer` takes it too
    hosts: values of the header Host that name this server, in lower case
    """

    token: str
    hosts: frozenset[str]

    @property
    def cookie_value(self) -> str:
        """The value of the cookie. It is not the token, because browsers show cookies to all servers of a host."""
        return hmac.digest(self.token.encode(), b"cookie", "sha256").hex()


@dataclass(frozen=True)
class Decision:
    """The answer to the question whether a request is granted.

    status: status code of HTTP; 200 means that the request may be answered
    reason: sentence for the sender of a refused request; empty for a granted one
    cookie: (name, value) of the cookie that the answer sets in exchange for the token; None sets no cookie
    """

    status: int
    reason: str = ""
    cookie: tuple[str, str] | None = None

    @property
    def granted(self) -> bool:
        """Whether the request may be answered."""
        return self.status == 200


def decide(access: Access, request: RequestFacts) -> Decision:
    """Returns whether a request is answered, and if not, why."""
    if len(request.hosts) != 1 or request.hosts[0].lower() not in access.hosts:
        return Decision(421, "The header Host does not name this server; `--allow-host HOST:PORT` adds a name.")
    host = request.hosts[0].lower()
    # A browser adds Origin to each WebSocket, but leaves it out of plain GET requests of its own page.
    if (request.origins or request.kind == "websocket") and request.origins != (f"http://{host}",):
        return Decision(403, "The header Origin does not name this server.")
    if request.method not in METHODS:
        return Decision(405, f"Allowed methods: {', '.join(METHODS)}.")
    if (request.path == SOCKET) != (request.kind == "websocket"):
        return Decision(404, f"{SOCKET} is a WebSocket, and no other path is one.")
    tokens = parse_qs(request.query, keep_blank_values=True).get("token") if request.path == "/" else None
    if tokens is not None:
        if len(tokens) == 1 and _equal(tokens[0], access.token):
            return Decision(200, cookie=(cookie_name(host), access.cookie_value))
    elif _holds_secret(access, request, host):
        return Decision(200)
    return Decision(401, "Open the address that `glshade dev` printed: it holds the token of this server.")


def cookie_name(host: str) -> str:
    """Returns the name of the cookie for a server that the browser knows by this Host.

    The port is a part of the name, because a browser sends a cookie to all ports of a host: two servers would replace each
    other's cookies.
    """
    return f"glshade-{_port(host) or HTTP_PORT}"


def hosts(bound: str, port: int, allowed: tuple[str, ...] = ()) -> frozenset[str]:
    """Returns the values of the header Host that name a server.

    bound: address at which the server listens
    port: port at which it listens
    allowed: further names, each with or without a port
    """
    own = (bracketed(bound), "localhost") if is_loopback(bound) else ()
    whole = {name.lower() if _port(name) is not None else f"{name.lower()}:{port}" for name in (*own, *allowed)}
    # A browser leaves out the usual port.
    return frozenset(whole | {name.removesuffix(f":{HTTP_PORT}") for name in whole})


def bracketed(host: str) -> str:
    """Returns an address as it is written in front of a port: an IPv6 address stands in brackets."""
    return f"[{host}]" if ":" in host else host


def is_loopback(host: str) -> bool:
    """Returns whether only this machine can connect to a server that listens at an address."""
    if host == "localhost":
        return True
    try:
        return ip_address(host).is_loopback
    except ValueError:
        return False


def _port(host: str) -> int | None:
    """Returns the port of a value of Host, or None if it has none."""
    _, colon, port = host.rpartition(":")
    return int(port) if colon and port.isascii() and port.isdigit() else None


def _holds_secret(access: Access, request: RequestFacts, host: str) -> bool:
    """Returns whether a request holds the token as a bearer, or the cookie."""
    if len(request.authorizations) == 1:
        scheme, _, token = request.authorizations[0].partition(" ")
        if scheme.lower() == "bearer" and _equal(token.strip(), access.token):
            return True
    pairs = [pair.strip().partition("=") for pair in ";".join(request.cookies).split(";")]
    return any(_equal(value, access.cookie_value) for name, _, value in pairs if name == cookie_name(host))


def _equal(text: str, secret: str) -> bool:
    """Compares in a time that does not tell how many characters agree."""
    return hmac.compare_digest(text.encode(), secret.encode())
