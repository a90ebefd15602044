"""Pass timers, with fences and with timer queries."""

from __future__ import annotations

import time

import moderngl
import pytest

from simgl.gpu import timers
from simgl.gpu.context import temporary_context
from simgl.gpu.timers import PassTimer


@pytest.mark.parametrize("software", [True, False])
def test_sections_of_one_name_add_up(monkeypatch: pytest.MonkeyPatch, software: bool) -> None:
    monkeypatch.setattr(timers, "is_software", lambda _: software)
    # A context of its own: moderngl cannot free the queries.
    with temporary_context() as ctx:
        timer = PassTimer(ctx, enabled=True)
        target = ctx.simple_framebuffer((512, 512))
        for _ in range(3):
            with timer.measure("clear"):
                target.clear(0.1, 0.2, 0.3)
                if software:
                    time.sleep(0.01)
        with timer.measure("nothing"):
            pass
        assert set(timer.seconds) == {"clear", "nothing"}
        assert 0.0 <= timer.seconds["nothing"] < 1.0
        # The clock sees the sleeps; a timer query sees the GPU's work alone.
        assert timer.seconds["clear"] >= 0.03 if software else timer.seconds["clear"] >= 0.0
        ctx.detect_framebuffer(0).use()
        target.release()


def test_a_disabled_timer_records_nothing(gl: moderngl.Context) -> None:
    timer = PassTimer(gl)
    with timer.measure("anything"):
        pass
    assert timer.seconds == {}
