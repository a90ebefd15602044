"""The LRU cache: what it evicts, and when it makes values."""

from __future__ import annotations

from functools import partial

from simgl.lru_cache import LruCache


def test_the_least_recently_used_value_is_evicted() -> None:
    evicted: list[str] = []
    cache = LruCache[int, str](2, evicted.append)
    for key in (1, 2, 1, 3):
        assert cache.get(key, partial("value {}".format, key)) == f"value {key}"
    assert evicted == ["value 2"]
    assert cache.values() == ["value 1", "value 3"]


def test_a_cached_value_is_not_made_again() -> None:
    cache = LruCache[int, object](1)
    first = cache.get(1, object)
    assert cache.get(1, object) is first
    cache.get(2, object)
    assert cache.get(1, object) is not first


def test_clearing_evicts_all_values() -> None:
    evicted: list[str] = []
    cache = LruCache[int, str](3, evicted.append)
    cache.get(1, lambda: "a")
    cache.get(2, lambda: "b")
    cache.clear()
    assert evicted == ["a", "b"]
    assert cache.values() == []
