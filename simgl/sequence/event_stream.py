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
from simgl.view.image_motion import background_motion, spacecraft_motion

# Largest motion of the image between two sub-frames [px]: the light of a pixel at an edge is
# nearly linear in time for as long as the edge crosses half of it.
LARGEST_MOTION = 0.5


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
    ``LARGEST_MOTION``. The first sub-frame is what the pixels have memorised at the start.

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
        start, coming = state.tai_ns, scenario.at(end)
        parts = int(np.ceil(_motion(state, coming, span.camera) / LARGEST_MOTION))
        count = min(max(parts, 1), end - start)
        for part in range(1, count + 1):
            state = scenario.at(start + (end - start) * part // count)
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


def _motion(first: SceneState, second: SceneState, camera: str) -> float:
    """Upper bound on how far anything moves in the image [px]."""
    bounds = spacecraft_motion, background_motion
    return max(motion(first, second, camera) for motion in bounds)
