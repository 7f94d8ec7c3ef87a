"""Requests: a table of requests to the live server, and the answer that each must get.

In the texts, {port} stands for the server's port, {token} for its token and {cookie} for the value of its cookie.
"""

from __future__ import annotations

from dataclasses import dataclass

TOKEN = "Zm9yLXRlc3RzLW9ubHk"
COOKIE = "glshade-{port}"
HOST = "127.0.0.1:{port}"
ORIGIN = "http://127.0.0.1:{port}"
HELD = f"{COOKIE}={{cookie}}"
BEARER = "Bearer {token}"


@dataclass(frozen=True)
class Asked:
    """A request.

    status: status code that it must get; 101 for a WebSocket that is opened
    method, target: of the request line
    host, origin, cookie, authorization: values of the headers; None leaves a header out, a tuple repeats it
    socket: whether it asks for a WebSocket
    unknown: whether it is refused only because the path does not exist
    """

    status: int
    target: str = "/state.json"
    host: str | tuple[str, ...] | None = HOST
    origin: str | tuple[str, ...] | None = None
    cookie: str | tuple[str, ...] | None = None
    authorization: str | tuple[str, ...] | None = None
    method: str = "GET"
    socket: bool = False
    unknown: bool = False

    @property
    def exchanges(self) -> bool:
        """Whether the answer sets the cookie."""
        return self.status == 200 and "token" in self.target

    def headers(self, port: int, cookie: str) -> list[tuple[str, str]]:
        """Returns the headers as pairs of a name and a value."""
        given = {"Host": self.host, "Origin": self.origin, "Cookie": self.cookie, "Authorization": self.authorization}
        pairs = []
        for name, value in given.items():
            values = value if isinstance(value, tuple) else () if value is None else (value,)
            pairs += [(name, text.format(port=port, token=TOKEN, cookie=cookie)) for text in values]
        return pairs


def _socket(status: int, **given: object) -> Asked:
    return Asked(status, **{"target": "/socket", "socket": True, "origin": ORIGIN, "cookie": HELD, **given})  # type: ignore[arg-type]


REQUESTS = {
    # The token, which the address holds.
    "the printed address": Asked(200, f"/?token={TOKEN}"),
    "the printed address under localhost": Asked(200, f"/?token={TOKEN}", host="localhost:{port}"),
    "a wrong token": Asked(401, "/?token=wrong"),
    "an empty token": Asked(401, "/?token="),
    "two tokens": Asked(401, f"/?token={TOKEN}&token={TOKEN}"),
    "a wrong token beside the cookie": Asked(401, "/?token=wrong", cookie=HELD),
    "a token that is not ASCII": Asked(401, "/?token=%C3%A9%FF"),
    "the token at another path": Asked(401, f"/frame.png?token={TOKEN}"),
    "the token in an address for another host": Asked(421, f"/?token={TOKEN}", host="evil.example"),
    # The secret in a header.
    "no secret": Asked(401),
    "no secret for the page": Asked(401, "/"),
    "no secret for a path that does not exist": Asked(401, "/nothing"),
    "the cookie": Asked(200, cookie=HELD),
    "the cookie for the page": Asked(200, "/", cookie=HELD),
    "the cookie among others": Asked(200, cookie=f"a=b; {HELD}; c=d"),
    "the cookie in a header of its own": Asked(200, cookie=("a=b", HELD)),
    "a wrong cookie": Asked(401, cookie=f"{COOKIE}=wrong"),
    "the token as cookie": Asked(401, cookie=f"{COOKIE}={{token}}"),
    "the cookie of another port": Asked(401, cookie="glshade-1={cookie}"),
    "the bearer": Asked(200, authorization=BEARER),
    "the bearer in capitals": Asked(200, authorization="BEARER {token}"),
    "a wrong bearer": Asked(401, authorization="Bearer wrong"),
    "the cookie's value as bearer": Asked(401, authorization="Bearer {cookie}"),
    "the token by another scheme": Asked(401, authorization="Basic {token}"),
    "two bearers": Asked(401, authorization=(BEARER, BEARER)),
    # Host: a page under another name would read the answers after its name was bound to 127.0.0.1.
    "another host": Asked(421, host="evil.example:{port}", cookie=HELD),
    "another port": Asked(421, host="127.0.0.1:1", cookie=HELD),
    "no port": Asked(421, host="127.0.0.1", cookie=HELD),
    "another loopback address": Asked(421, host="127.0.0.2:{port}", cookie=HELD),
    "another address": Asked(421, host="192.168.1.7:{port}", cookie=HELD),
    "a host that begins like this one": Asked(421, host="127.0.0.1:{port}.evil.example", cookie=HELD),
    "a host below localhost": Asked(421, host="a.localhost:{port}", cookie=HELD),
    # Origin: a browser adds it to requests of a script.
    "its own origin": Asked(200, origin=ORIGIN, cookie=HELD),
    "another origin": Asked(403, origin="http://evil.example", cookie=HELD),
    "the origin null": Asked(403, origin="null", cookie=HELD),
    "an origin of another port": Asked(403, origin="http://127.0.0.1:1", cookie=HELD),
    "an origin of another scheme": Asked(403, origin="https://127.0.0.1:{port}", cookie=HELD),
    "an origin under the server's other name": Asked(403, origin="http://localhost:{port}", cookie=HELD),
    "two origins": Asked(403, origin=(ORIGIN, "http://evil.example"), cookie=HELD),
    # Methods and paths.
    "HEAD": Asked(200, method="HEAD", cookie=HELD),
    "POST": Asked(405, method="POST", origin=ORIGIN, cookie=HELD),
    "PUT": Asked(405, method="PUT", origin=ORIGIN, cookie=HELD),
    "DELETE without a secret": Asked(405, method="DELETE"),
    "OPTIONS of another site": Asked(403, method="OPTIONS", origin="http://evil.example"),
    "a path that does not exist": Asked(404, "/nothing", cookie=HELD, unknown=True),
    "a file beside the page's": Asked(404, "/page/../session.py", cookie=HELD, unknown=True),
    "a file beside the page's, encoded": Asked(404, "/page/%2e%2e%2fsession.py", cookie=HELD, unknown=True),
    "a file by its absolute path": Asked(404, "/page//etc/passwd", cookie=HELD, unknown=True),
    "a file with a NUL byte": Asked(404, "/page/index.html%00", cookie=HELD, unknown=True),
    # The WebSocket.
    "the socket": _socket(101),
    "the socket with the bearer": _socket(101, cookie=None, authorization=BEARER),
    "the socket under localhost": _socket(101, host="localhost:{port}", origin="http://localhost:{port}"),
    "the socket without a secret": _socket(401, cookie=None),
    "the socket with the token in the address": _socket(401, target=f"/socket?token={TOKEN}", cookie=None),
    "the socket without an origin": _socket(403, origin=None),
    "the socket without an origin, with the bearer": _socket(403, origin=None, cookie=None, authorization=BEARER),
    "the socket from the origin null": _socket(403, origin="null"),
    "the socket from another site": _socket(403, origin="http://evil.example"),
    "the socket from another port": _socket(403, origin="http://127.0.0.1:1"),
    "the socket from another address": _socket(403, origin="http://192.168.1.7:{port}"),
    "the socket from another scheme": _socket(403, origin="https://127.0.0.1:{port}"),
    "the socket at another host": _socket(421, host="evil.example:{port}", origin="http://evil.example:{port}"),
    "a socket at another path": _socket(404, target="/"),
    "the socket's path by HTTP": Asked(404, "/socket", cookie=HELD),
}
