"""What a value that changes evenly enters next is known before, and the work for it is spread."""

from __future__ import annotations

import pytest

from simgl.next_step import NextStep, StepWatch


@pytest.mark.parametrize("pace", [0.4, 0.1, 0.021, -0.1, -0.4])
def test_the_next_step_is_the_one_that_an_even_motion_enters(pace: float) -> None:
    watch, places = StepWatch(), [3.2 + pace * frame for frame in range(60)]
    entered = next(frame for frame, place in enumerate(places) if round(place) != 3)
    seen = [watch.next_step(place) for place in places[:entered]]
    assert seen[0] is None
    for frame, step in enumerate(seen[1:], start=1):
        assert step is not None
        assert step.index == round(places[entered])
        # Of the frames from this one on, before the one that enters it; all but the last, so that a
        # motion that quickens a little finds all made.
        assert step.frames in {max(entered - frame - 1, 1), entered - frame}
        # A motion may end on the edge between two steps, to rounding.
        assert step.enters in {entered - frame, entered - frame + 1}


def test_parts_made_as_they_are_due_are_all_made_in_time() -> None:
    for parts in (3, 7, 69):
        made: list[int] = []
        for frames in range(7, 0, -1):
            made.append(NextStep(index=0, frames=frames, enters=frames + 1).due(parts - sum(made)))
        assert sum(made) == parts
        assert max(made) == -(-parts // 7)
        # As late as that allows.
        assert made == sorted(made)


def test_nothing_comes_next_for_a_value_that_stands_jumps_or_has_far_to_go() -> None:
    watch = StepWatch()
    assert watch.next_step(0.0) is None
    assert watch.next_step(0.0) is None
    assert watch.next_step(0.001) is None
    assert watch.next_step(0.101) is not None
    assert watch.next_step(0.7) is None
