"""What the first image waits for is made while light is traced, and the image stays the same."""

from __future__ import annotations

from typing import Any

import moderngl
import pytest

from simgl import Simulator
from simgl.radiosity.transport_store import TransportStore
from simgl.scenario.scenario import Scenario
from tests.radiosity.boxes import c6_scene
from tests.scenes import lambert, scene


def _ball() -> Scenario:
    """No surface of which sees another."""
    ball = {"sphere": {"radius_m": 1.0, "material": lambert(0.5)}}
    camera = {"position_icrf_m": [0.0, 0.0, 9.0], "boresight": [0, 0, -1], "up": [0, 1, 0]}
    return scene({"ball": {"model": ball, "position_icrf_m": [0.0, 0.0, 0.0]}}, camera)


@pytest.mark.parametrize("scenario", [_ball(), c6_scene(0.5, on=True)], ids=["ball", "box"])
def test_all_shaders_of_the_first_image_are_compiled_while_light_is_traced(
    scenario: Scenario, monkeypatch: pytest.MonkeyPatch
) -> None:
    compiled = []
    # Compute shaders, too, where the renderer draws with them.
    for kind in ("program", "compute_shader"):

        def counted(
            self: moderngl.Context,
            *args: Any,
            compile_: Any = getattr(moderngl.Context, kind),
            **kwargs: Any,
        ) -> Any:
            compiled.append(compile_(self, *args, **kwargs))
            return compiled[-1]

        monkeypatch.setattr(moderngl.Context, kind, counted)

    def first_image(traced: bool) -> tuple[bytes, int]:
        """And how many programs were compiled for it."""
        monkeypatch.setattr(TransportStore, "to_trace", lambda *_: traced)
        with Simulator(scenario) as simulator:
            before = len(compiled)
            capture = simulator.capture(scenario.at(scenario.epoch_tai_ns), "cam")
            assert capture.digital is not None
            return capture.digital.dn.tobytes(), len(compiled) - before

    alone, late = first_image(traced=False)
    after, later = first_image(traced=True)
    assert after == alone
    assert late > 0
    assert later == 0
