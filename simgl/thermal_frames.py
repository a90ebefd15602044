"""Frames of a thermal camera: radiance from the renderer, DN from its detector."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from simgl.arrays import Array
from simgl.images import DigitalFrame, ThermalFrame
from simgl.scene.state import SceneState
from simgl.still_scene import StillScene
from simgl.thermal.scene_temperatures import Temperatures, ThermalBodies
from simgl.thermal.thermal_view import posed_as, thermal_view
from simgl.view.frame_view import FrameView

# Scenes of an exposure: state, what the camera draws of it, and its share of the signal.
Parts = Sequence[tuple[SceneState, Callable[[], FrameView], float]]


def thermal_frames(
    still: StillScene, bodies: ThermalBodies, temperatures: Temperatures, parts: Parts
) -> tuple[ThermalFrame, Callable[[], DigitalFrame]]:
    """What a thermal camera sees, and what makes DN of it.

    temperatures : of every spacecraft
    parts : what the detector's pixels hold of a scene that moves; none for the still scene. The
        thermal frame is that of the instant
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

    def held() -> Array:
        """(h, w) radiance in the detector's pixels, as it counts."""
        if not parts:
            return counted.astype(np.float64)
        total = np.zeros(counted.shape)
        for state, view, weight in parts:
            drawn = still.renderer.thermal(view(), posed_as(scene, state)).read()
            total += weight * drawn[..., 1]
        return total

    def digital() -> DigitalFrame:
        dn = detector.digitised(
            held(), (info.seed, camera.detector.serial), info.epoch_tai_ns, info.draw
        )
        return DigitalFrame(info=info, dn=dn)

    return frame, digital
