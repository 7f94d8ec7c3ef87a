"""LRU caches: a limit of bytes, and values that outlive their eviction because somebody holds them."""

from __future__ import annotations

from glshade.lru import Lru, WeakLru


class Value:
    pass


def test_the_least_recently_used_value_goes() -> None:
    cache: Lru[str, int] = Lru(10)
    cache.put("a", 1, 4)
    cache.put("b", 2, 4)
    assert cache.get("a") == 1
    cache.put("c", 3, 4)
    assert [cache.get(key) for key in "abc"] == [1, None, 3]
    assert (len(cache), cache.size) == (2, 8)
    cache.put("a", 5, 1)
    assert (cache.get("a"), cache.size) == (5, 5)
    cache.put("large", 6, 100)
    assert (cache.get("large"), len(cache)) == (6, 1)
    assert cache.find("new", lambda: 7, lambda value: value) == 7
    cache.clear()
    assert (len(cache), cache.size) == (0, 0)


def test_an_evicted_value_is_found_while_somebody_holds_it() -> None:
    cache: WeakLru[str, Value] = WeakLru(0)
    value = cache.put("a", Value(), 1)
    cache.put("b", Value(), 1)
    assert len(cache) == 1
    assert cache.find("a", Value, lambda _: 1) is value
    del value
    assert cache.get("a") is None
    cache.clear()
    assert cache.get("b") is None
