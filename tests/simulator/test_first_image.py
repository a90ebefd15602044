"""What the first image waits for is made while light is traced, and the image stays the same."""

from __future__ import annotations

from typing import Any

import moderngl
import pytest

from simgl import Simulator
from simgl.radiosity.transport_store import TransportStore
from tests.scenes import lambert, scene


def test_shaders_of_the_first_image_are_compiled_while_light_is_traced(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    ball = {"sphere": {"radius_m": 1.0, "material": lambert(0.5)}}
    camera = {"position_icrf_m": [0.0, 0.0, 9.0], "boresight": [0, 0, -1], "up": [0, 1, 0]}
    scenario = scene({"ball": {"model": ball, "position_icrf_m": [0.0, 0.0, 0.0]}}, camera)
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

    def first_image() -> tuple[bytes, int]:
        """And how many programs were compiled for it."""
        with Simulator(scenario) as simulator:
            before = len(compiled)
            capture = simulator.capture(scenario.at(scenario.epoch_tai_ns), "cam")
            assert capture.digital is not None
            return capture.digital.dn.tobytes(), len(compiled) - before

    alone, late = first_image()
    monkeypatch.setattr(TransportStore, "to_trace", lambda *_: True)
    after, later = first_image()
    assert after == alone
    # All but those of the detector.
    assert later <= late // 2
