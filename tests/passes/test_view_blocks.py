"""What passes read of a tile and of a spacecraft is packed once for all of them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from typing import Any

import moderngl
import pytest

import simgl.passes.view_blocks
from simgl import Product, Simulator
from tests.radiosity.boxes import c6_scene


def test_the_blocks_of_an_image_are_packed_once(
    gl: moderngl.Context, monkeypatch: pytest.MonkeyPatch
) -> None:
    packed = Counter[str]()

    def counted(name: str, values: Callable[..., Any]) -> Callable[..., Any]:
        def counting(*arguments: Any) -> Any:
            packed[name] += 1
            return values(*arguments)

        return counting

    names = "tile_values", "spacecraft_values", "shadow_values"
    for name in names:
        values = vars(simgl.passes.view_blocks)[name]
        monkeypatch.setattr(simgl.passes.view_blocks, name, counted(name, values))
    scenario = c6_scene(0.8, on=True)
    with Simulator(scenario, gl) as simulator:
        packed.clear()
        for number in (1, 2):
            state = scenario.at(scenario.epoch_tai_ns)
            simulator.capture(state, "cam", {Product.RADIANCE})
            assert packed == dict.fromkeys(names, number)
