"""LRU: a cache that is bounded by bytes and evicts the values that were used least recently."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Hashable
from threading import RLock
from typing import Generic, TypeVar
from weakref import WeakValueDictionary

Key = TypeVar("Key", bound=Hashable)
Value = TypeVar("Value")


class Lru(Generic[Key, Value]):
    """Values by key, up to a limit of bytes.

    The `spare` values that were used last always stay, however large they are, because somebody is about to use them.
    """

    def __init__(self, limit: int, *, most: int | None = None, spare: int = 1) -> None:
        """limit: the largest sum of the sizes of all values [bytes]. most: optional, the largest number of values."""
        self.limit, self.most, self.spare = limit, most, spare
        self._kept: OrderedDict[Key, tuple[Value, int]] = OrderedDict()
        # The keys whose values have not been used since the last call of `age`.
        self._unused: set[Key] = set()
        self.size = 0
        # Several threads may share a cache. The lock is held while its tables change, and not while a value is made.
        self._lock = RLock()

    def __len__(self) -> int:
        return len(self._kept)

    def get(self, key: Key) -> Value | None:
        """Returns the value of a key, which now counts as the most recently used; None if the key has no value."""
        with self._lock:
            found = self._kept.get(key)
            if found is None:
                return None
            self._kept.move_to_end(key)
            self._unused.discard(key)
            return found[0]

    def put(self, key: Key, value: Value, size: int) -> Value:
        """Stores a value of a size [bytes], in place of the key's old value. Evicts others if need be. Returns the value."""
        with self._lock:
            self.drop(key)
            self._kept[key] = value, size
            self.size += size
            while len(self._kept) > self.spare and (self.size > self.limit or len(self._kept) > (self.most or len(self._kept))):
                self.drop(next(iter(self._kept)))
        return value

    def find(self, key: Key, make: Callable[[], Value], size: Callable[[Value], int]) -> Value:
        """Returns the value of a key. If the key has no value, `make` makes one and `size` measures it [bytes]."""
        found = self.get(key)
        if found is None:
            found = make()
            self.put(key, found, size(found))
        return found

    def newest_first(self) -> list[tuple[Key, Value]]:
        """Returns all keys and values, those that were used last first. They do not count as used."""
        with self._lock:
            return [(key, value) for key, (value, _) in reversed(self._kept.items())]

    def drop(self, key: Key) -> None:
        """Removes a key and its value, if the key has one."""
        with self._lock:
            found = self._kept.pop(key, None)
            self._unused.discard(key)
            if found is not None:
                self.size -= found[1]

    def age(self) -> None:
        """Marks all values as unused. A value that is looked up or stored afterwards counts as used again."""
        with self._lock:
            self._unused = set(self._kept)

    def evict_unused(self) -> None:
        """Evicts the values that have not been used since the last call of `age`."""
        for key in tuple(self._unused):
            self.drop(key)

    def clear(self) -> None:
        """Removes all values."""
        with self._lock:
            self._kept.clear()
            self._unused.clear()
            self.size = 0


class WeakLru(Lru[Key, Value]):
    """An Lru that still finds an evicted value for as long as somebody else holds it. Its values must allow weak references."""

    def __init__(self, limit: int, *, most: int | None = None, spare: int = 1) -> None:
        super().__init__(limit, most=most, spare=spare)
        self._alive: WeakValueDictionary[Key, Value] = WeakValueDictionary()

    def get(self, key: Key) -> Value | None:
        """Returns the value of a key; None if the key has no value, or if its value was evicted and nobody holds it."""
        found = super().get(key)
        return self._alive.get(key) if found is None else found

    def put(self, key: Key, value: Value, size: int) -> Value:
        """Stores a value, as `Lru.put` does."""
        self._alive[key] = value
        return super().put(key, value, size)

    def clear(self) -> None:
        """Removes all values, including evicted ones that somebody else still holds."""
        super().clear()
        self._alive.clear()
