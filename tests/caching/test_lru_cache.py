"""What is kept while it is in use."""

from __future__ import annotations

from functools import partial

from simgl.lru_cache import LruCache


def test_of_too_many_the_one_unused_for_longest_goes() -> None:
    gone: list[str] = []
    kept = LruCache[int, str](2, gone.append)
    for key in (1, 2, 1, 3):
        assert kept.get(key, partial("thing {}".format, key)) == f"thing {key}"
    assert gone == ["thing 2"]
    assert kept.values() == ["thing 1", "thing 3"]


def test_what_is_kept_is_not_made_again() -> None:
    kept = LruCache[int, object](1)
    first = kept.get(1, object)
    assert kept.get(1, object) is first
    kept.get(2, object)
    assert kept.get(1, object) is not first


def test_clearing_lets_go_of_all() -> None:
    gone: list[str] = []
    kept = LruCache[int, str](3, gone.append)
    kept.get(1, lambda: "a")
    kept.get(2, lambda: "b")
    kept.clear()
    assert gone == ["a", "b"]
    assert kept.values() == []
