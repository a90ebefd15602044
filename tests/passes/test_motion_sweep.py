"""Into which parts the way of a snapshot is divided."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from simgl.passes.motion_sweep import Span, Sweep
from simgl.view.image_paths import ImagePaths

SIZE, FILLED = (640, 480), (100, 100, 200, 220)


def sweep(way_px: float, more_px: float, span: Span = Span()) -> Sweep:
    """Of what is so much further at both ends than an even way would bring it."""
    node = np.array([way_px, 0.0, -4.0 * more_px, 0.0], dtype=np.float32)
    paths = ImagePaths(origin=(100.0, 100.0), step=11.0, nodes=np.tile(node, (20, 20, 1)))
    return Sweep(paths=paths, size=SIZE, filled=FILLED, target_size=SIZE, span=span)


def reads(one: Sweep) -> float:
    """Of the snapshot and of what steps make of it, for each pixel; twice where pixel by pixel."""
    total = 0.0
    for part in one.parts:
        first, *chunks = part.steps
        total += (2 * first + 1) * (2.0 if part.uneven else 1.0) + sum(chunks)
    return total


@pytest.mark.parametrize(("way", "more"), [(0.0, 40.0), (60.0, 40.0), (20.0, 5.0), (150.0, 60.0)])
def test_what_accelerates_is_swept_in_parts_that_are_even_or_short(way: float, more: float) -> None:
    one = sweep(way, more)
    spans = [part.span for part in one.parts]
    ends = [span.first for span in spans] + [spans[-1].last]
    assert ends[0] == -0.5
    assert ends[-1] == 0.5
    assert [span.last for span in spans[:-1]] == ends[1:-1]
    # Pixel by pixel the whole of it would be read, and each pixel takes twice as long.
    assert reads(one) < 0.7 * 2.0 * max(one.paths.reach)
    assert all(not part.paths.uneven or max(part.paths.reach) < 13.0 for part in one.parts)


def test_parts_cover_no_more_than_what_comes_there() -> None:
    """To the right, slowly at first: it begins at rest."""
    one = sweep(100.0, 25.0)
    for part in one.parts:
        first, last = (100.0 * t + 100.0 * t**2 for t in (part.span.first, part.span.last))
        x, _, width, _ = one.area_of(part.span)
        # With the pixels that interpolation reads, and where an arc may leave its chords.
        assert x == pytest.approx(100.0 + first, abs=6.0)
        assert x + width == pytest.approx(300.0 + last, abs=6.0)


@pytest.mark.parametrize(("way", "more"), [(60.0, 0.0), (60.0, 40.0)])
def test_snapshots_of_several_lights_share_the_time(way: float, more: float) -> None:
    parts = replace(sweep(way, more), lights=3).parts
    for light in range(3):
        spans = [part.span for part in parts if part.light == light]
        assert spans[0].first == pytest.approx(-0.5 + light / 3.0)
        assert spans[-1].last == pytest.approx(-0.5 + (light + 1.0) / 3.0)
        assert sum(span.last - span.first for span in spans) == pytest.approx(1.0 / 3.0)


def test_an_even_way_is_one_part() -> None:
    assert len(sweep(200.0, 10.0).parts) == 1


def test_rows_that_begin_at_their_own_times_are_swept_together() -> None:
    assert len(sweep(60.0, 40.0, Span(row_rate=0.01)).parts) == 1
