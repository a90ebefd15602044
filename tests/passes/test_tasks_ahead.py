"""What later frames need is made beside the frames before: no thread that draws waits for it."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from threading import Event
from typing import Any

import moderngl
import numpy as np
import pytest

from simgl import Product, Simulator
from simgl.passes.tasks_ahead import TasksAhead
from simgl.passes.visibility import VisibilityPass
from simgl.radiosity.next_sunlight import NextSunlight
from simgl.scene.state import SunInDirection
from tests.patience import limit
from tests.radiosity.boxes import c6_scene


@pytest.fixture
def executor() -> Iterator[ThreadPoolExecutor]:
    with ThreadPoolExecutor(2) as two_threads:
        yield two_threads


def test_work_that_reads_what_is_made_comes_after_it_and_holds_nobody_up(
    executor: ThreadPoolExecutor,
) -> None:
    order: list[str] = []
    goes_on = Event()

    def slow() -> None:
        assert goes_on.wait(limit(5.0))
        order.append("ahead")

    ahead = TasksAhead(executor)
    ahead.add(slow)
    ahead.begin()
    result = ahead.then(lambda: order.append("work"))
    assert not result.done()
    goes_on.set()
    result.result()
    assert order == ["ahead", "work"]


def test_what_is_due_begins_once_and_after_what_was_begun_before(
    executor: ThreadPoolExecutor,
) -> None:
    order: list[int] = []
    ahead = TasksAhead(executor)
    for number in range(3):
        ahead.add(lambda number=number: order.append(number))  # type: ignore[misc]
        ahead.begin()
    ahead.begin()
    ahead.finish()
    assert order == [0, 1, 2]


def test_an_error_is_raised_by_whoever_waits(executor: ThreadPoolExecutor) -> None:
    def fails() -> None:
        raise ValueError("no light")

    ahead = TasksAhead(executor)
    ahead.add(fails)
    ahead.begin()
    with pytest.raises(ValueError, match="no light"):
        ahead.then(lambda: None).result()
    with pytest.raises(ValueError, match="no light"):
        ahead.finish()
    ahead.finish()


def test_a_frame_draws_while_the_light_that_later_ones_need_is_made(
    gl: moderngl.Context, monkeypatch: pytest.MonkeyPatch
) -> None:
    second, drawn, seen = Event(), Event(), []
    draw = VisibilityPass.draw

    def drawing(*arguments: Any) -> tuple[moderngl.Texture, ...]:
        if second.is_set():
            drawn.set()
        return draw(*arguments)

    def make_ahead(*_: Any) -> None:
        # Of the first frame; the second one draws meanwhile.
        seen.append(drawn.wait(limit(5.0)))

    monkeypatch.setattr(VisibilityPass, "draw", drawing)
    monkeypatch.setattr(NextSunlight, "make_ahead", make_ahead)
    scenario = c6_scene(0.8, on=True)
    state = scenario.at(scenario.epoch_tai_ns)
    assert isinstance(state.sun, SunInDirection)
    turned = replace(state.sun, direction_icrf=state.sun.direction_icrf + np.array([0.0, 0.01, 0]))
    with Simulator(scenario, gl) as simulator:
        simulator.capture(state, "cam", {Product.RADIANCE})
        second.set()
        simulator.capture(replace(state, sun=turned), "cam", {Product.RADIANCE})
    assert seen[0]
