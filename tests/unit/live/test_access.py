"""Access: which requests the live server answers. test_server.py sends the same table of requests to a server that runs."""

from __future__ import annotations

from urllib.parse import unquote

import pytest
from support.requests import COOKIE, REQUESTS, TOKEN, Asked

from glshade.live.access import Access, RequestFacts, cookie_name, decide, hosts, is_loopback

PORT = 8123
ACCESS = Access(TOKEN, hosts("127.0.0.1", PORT))


def facts(asked: Asked) -> RequestFacts:
    """Returns a request of the table as the server sees it."""
    headers = asked.headers(PORT, ACCESS.cookie_value)
    path, _, query = asked.target.partition("?")

    def values(name: str) -> tuple[str, ...]:
        return tuple(value for key, value in headers if key == name)

    return RequestFacts(
        kind="websocket" if asked.socket else "http",
        method=asked.method,
        path=unquote(path),
        query=query,
        hosts=values("Host"),
        origins=values("Origin"),
        cookies=values("Cookie"),
        authorizations=values("Authorization"),
    )


@pytest.mark.parametrize("name", REQUESTS)
def test_the_table_of_requests(name: str) -> None:
    asked = REQUESTS[name]
    decision = decide(ACCESS, facts(asked))
    # Only the server knows which paths exist, and how a WebSocket is opened.
    assert decision.status == (200 if asked.unknown or asked.status == 101 else asked.status)
    assert decision.granted == (not decision.reason)
    assert TOKEN not in decision.reason
    assert ACCESS.cookie_value not in decision.reason


def test_the_table_has_forty_requests_of_each_kind_of_answer() -> None:
    assert len(REQUESTS) >= 40
    assert {asked.status for asked in REQUESTS.values()} == {200, 101, 401, 403, 404, 405, 421}


def test_only_the_exchange_sets_a_cookie() -> None:
    setting = [name for name, asked in REQUESTS.items() if decide(ACCESS, facts(asked)).cookie is not None]
    assert setting == [name for name, asked in REQUESTS.items() if asked.exchanges]
    assert all(decide(ACCESS, facts(REQUESTS[name])).status == 200 for name in setting)


def test_the_cookie_is_not_the_token() -> None:
    assert TOKEN not in ACCESS.cookie_value
    assert Access(TOKEN + "x", ACCESS.hosts).cookie_value != ACCESS.cookie_value


def test_two_servers_have_cookies_of_different_names() -> None:
    assert cookie_name("127.0.0.1:8123") == COOKIE.format(port=8123) != cookie_name("127.0.0.1:8124")
    assert cookie_name("localhost") == "glshade-80"


class TestHosts:
    """The values of Host that name a server."""

    def test_loopback_with_the_port(self) -> None:
        assert hosts("127.0.0.1", 8123) == {"127.0.0.1:8123", "localhost:8123"}
        assert hosts("::1", 8123) == {"[::1]:8123", "localhost:8123"}

    def test_a_browser_leaves_out_port_80(self) -> None:
        assert hosts("127.0.0.1", 80) == {"127.0.0.1:80", "localhost:80", "127.0.0.1", "localhost"}

    def test_allowed_names_have_the_servers_port_or_their_own(self) -> None:
        own = hosts("127.0.0.1", 8123)
        assert hosts("127.0.0.1", 8123, ("localhost:9000", "Box")) == own | {"localhost:9000", "box:8123"}

    def test_at_another_address_only_the_allowed_names_count(self) -> None:
        assert hosts("0.0.0.0", 8123, ("box",)) == {"box:8123"}

    @pytest.mark.parametrize("host", ["127.0.0.1", "127.9.9.9", "::1", "localhost"])
    def test_loopback(self, host: str) -> None:
        assert is_loopback(host)

    @pytest.mark.parametrize("host", ["0.0.0.0", "::", "192.168.0.2", "example.org", "localhost.example.org", ""])
    def test_not_loopback(self, host: str) -> None:
        assert not is_loopback(host)
