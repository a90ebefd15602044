"""Frames of a thermal camera: radiance from the renderer, DN from its detector."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from simgl.images import DigitalFrame, ThermalFrame
from simgl.still_scene import StillScene
from simgl.thermal.scene_temperatures import Temperatures, ThermalBodies
from simgl.thermal.thermal_view import thermal_view


def thermal_frames(
    still: StillScene, bodies: ThermalBodies, temperatures: Temperatures
) -> tuple[ThermalFrame, Callable[[], DigitalFrame]]:
    """What a thermal camera sees, and what makes DN of it.

    temperatures : of every spacecraft
    """
    info, camera = still.info, still.camera
    detector = camera.thermal
    assert detector is not None
    of_bodies = {
        name: (bodies.of(name, body.model), temperatures[name])
        for name, body in still.state.bodies.items()
    }
    scene = thermal_view(still.state, detector, of_bodies)
    seen = still.renderer.thermal(still.view, scene).read()
    watts, counted, kelvin, share = np.moveaxis(seen, -1, 0)
    mean = np.divide(kelvin, share, out=np.zeros_like(kelvin), where=share > 0.0)
    frame = ThermalFrame(
        info=info,
        radiance=np.ascontiguousarray(watts),
        temperature=mean,
        state=scene.digest,
        history=scene.history,
    )

    def digital() -> DigitalFrame:
        dn = detector.digitised(
            counted.astype(np.float64),
            (info.seed, camera.detector.serial),
            info.epoch_tai_ns,
            info.draw,
        )
        return DigitalFrame(info=info, dn=dn)

    return frame, digital
