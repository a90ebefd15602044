"""Events of an event camera along a trajectory.

sub-frames -> mean electrons of each -> photo-current -> EventPixels -> events
epochs        lens, point spread, QE    e-/s                            t, x, y, p
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from simgl.arrays import Array
from simgl.camera.event_pixels import EventPixels, Events
from simgl.errors import ConfigError
from simgl.progress import ProgressCallback, silent
from simgl.scenario.scenario import Scenario
from simgl.scene.state import SceneState
from simgl.simulator import Product, Simulator
from simgl.view.image_motion import background_motion
from simgl.view.motion_in_view import parts_in_view

# Largest motion of the image between two sub-frames [px]: the light of a pixel at an edge is
# nearly linear in time for as long as the edge crosses half of it.
LARGEST_MOTION = 0.5
# In so many parts a step is divided at most, so that the number of sub-frames has a bound.
MAX_PARTS = 100


@dataclass(frozen=True, kw_only=True)
class EventSpan:
    """What to watch.

    camera : name of a camera with an ``event_sensor``
    start, stop : [TAI ns]
    step : longest time between sub-frames [ns]
    """

    camera: str
    start: int
    stop: int
    step: int


def event_stream(
    simulator: Simulator, span: EventSpan, progress: ProgressCallback = silent
) -> Iterator[Events]:
    """The events between each two sub-frames, in order.

    A sub-frame is a still image of an instant. Between two of them the logarithm of each pixel's
    photo-current is linear in time. Steps are divided where the image moves by more than
    ``LARGEST_MOTION``, into ``MAX_PARTS`` at most. The first sub-frame is what the pixels have
    memorised at the start.

    progress : receives the nanoseconds done and their number

    Raises ConfigError where the camera has no event sensor, KeyError where there is no such camera,
    ValueError for an empty span.
    """
    scenario = simulator.scenario
    check_event_camera(scenario, span.camera)
    if span.stop <= span.start or span.step < 1:
        raise ValueError(f"a span needs a stop after its start, and a step, got {span}")
    state = scenario.at(span.start)
    camera = scenario.cameras[span.camera]
    pixels = EventPixels(camera, _rate(simulator, state, span), span.start, scenario.seed)
    for end in [*range(span.start + span.step, span.stop, span.step), span.stop]:
        while state.tai_ns < end:
            state = _next(scenario, span, state, end)
            yield pixels.advance(_rate(simulator, state, span), state.tai_ns)
            progress(state.tai_ns - span.start, span.stop - span.start)


def check_event_camera(scenario: Scenario, camera: str) -> None:
    """Raise ConfigError for a camera without an event sensor."""
    if scenario.cameras[camera].event_sensor is None:
        where = f"{scenario.source or scenario.name} [camera.{camera}]"
        problem = f"is missing; a table [camera.{camera}.event_sensor] gives it, even an empty one"
        raise ConfigError(where, "event_sensor", problem)


def _rate(simulator: Simulator, state: SceneState, span: EventSpan) -> Array:
    """(height, width) photo-current [e- s-1]."""
    capture = simulator.capture(state, span.camera, {Product.ELECTRONS})
    assert capture.electrons is not None
    exposure_time = capture.info.camera.exposure_time
    return capture.electrons.electrons.astype(np.float64) / exposure_time


def _next(scenario: Scenario, span: EventSpan, state: SceneState, end: int) -> SceneState:
    """The next sub-frame: at the end of the step, or before that as soon as the image has moved.

    end : [TAI ns]
    """
    shortest = max(span.step // MAX_PARTS, 1)
    after = end - state.tai_ns
    while True:
        coming = scenario.at(state.tai_ns + after)
        parts = int(np.ceil(_parts(state, coming, span.camera)))
        if parts <= 1 or after <= shortest:
            return coming
        after = max(after // parts, shortest)


def _parts(first: SceneState, second: SceneState, camera: str) -> float:
    """In how many parts the time between two states has to be divided."""
    behind = background_motion(first, second, camera) / LARGEST_MOTION
    return max(behind, parts_in_view(first, second, camera, LARGEST_MOTION))
