"""The hash of content: equal for equal content, whatever the order of what has none."""

from __future__ import annotations

from simgl.content_digest import content_digest


def test_a_set_has_one_digest_in_every_process() -> None:
    """Names hash differently from process to process, and a set follows them."""
    names = [f"joint{i}" for i in range(20)]
    assert content_digest(frozenset(names)) == content_digest(frozenset(reversed(names)))
    assert content_digest(frozenset(names)) != content_digest(frozenset(names[1:]))
    assert content_digest(frozenset(names)) != content_digest(sorted(names))
