"""The LRU cache: what it evicts, and when it makes values."""

from __future__ import annotations

from functools import partial

import pytest

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


def test_values_with_sizes_share_bytes_and_the_newest_stays() -> None:
    evicted: list[str] = []
    cache = LruCache[int, str](10, evicted.append, max_bytes=10)
    for key, value in enumerate(("aaaa", "bbb", "ccc")):
        cache.get(key, partial(str, value), len)
    assert (cache.nbytes, evicted) == (10, [])
    cache.get(3, lambda: "d", 1)
    assert (cache.nbytes, evicted) == (7, ["aaaa"])
    cache.get(4, lambda: "e" * 20, 20)
    assert (cache.nbytes, evicted) == (20, ["aaaa", "bbb", "ccc", "d"])


def test_small_values_are_bounded_in_number() -> None:
    cache = LruCache[int, int](3, max_bytes=1000)
    for key in range(9):
        cache.get(key, partial(int, key), 1)
    assert cache.values() == [6, 7, 8]
    assert cache.nbytes == 3


def test_reserved_values_stay_whatever_their_sizes() -> None:
    cache = LruCache[int, int](10, max_bytes=10)
    cache.reserve(3)
    for key in range(4):
        cache.get(key, partial(int, key), 8)
    assert cache.values() == [1, 2, 3]
    cache.reserve(1)
    cache.get(9, partial(int, 9), 2)
    assert cache.values() == [3, 9]


def test_a_value_that_cannot_be_made_is_not_cached() -> None:
    cache = LruCache[int, int](2)
    with pytest.raises(ZeroDivisionError):
        cache.get(1, lambda: 1 // 0)
    assert 1 not in cache
    assert cache.get(1, lambda: 5) == 5
    assert cache.values() == [5]
