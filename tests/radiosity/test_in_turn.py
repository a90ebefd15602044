"""Rays that are traced part by part give what they give all at once."""

from __future__ import annotations

import numpy as np
import pytest

from simgl.radiosity import in_turn
from simgl.radiosity.bake import bake
from simgl.radiosity.transport_store import _packed
from tests.radiosity.boxes import QUICK
from tests.radiosity.shapes import LID, OPEN_BOX, quads


@pytest.mark.parametrize("open_sheets", [False, True], ids=["closed", "sheets"])
def test_light_between_surfaces_does_not_depend_on_the_size_of_parts(
    open_sheets: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    def arrays() -> dict[str, bytes]:
        transport = bake(quads((*OPEN_BOX, LID)), open_sheets=open_sheets, settings=QUICK)
        assert transport is not None
        return {name: np.asarray(values).tobytes() for name, values in _packed(transport).items()}

    at_once = arrays()
    # Some dozens of points each.
    monkeypatch.setattr(in_turn, "_AT_ONCE", 5_000)
    assert arrays() == at_once


def test_points_are_done_in_order_and_counted() -> None:
    told: list[int] = []
    points = np.arange(700_000)
    parts = in_turn.in_turn(lambda part: part, points, 1, told.append)
    assert np.array_equal(np.concatenate(parts), points)
    assert told == sorted(told)
    assert told[-1] == len(points)
