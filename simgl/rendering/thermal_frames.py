"""Frames of a thermal camera: radiance from the renderer, DN from its detector."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from simgl.arrays import Array, Array32
from simgl.images import Capture, DigitalFrame, ThermalFrame
from simgl.products import Product
from simgl.rendering.still_scene import StillScene
from simgl.scene.state import SceneState
from simgl.thermal.scene_temperatures import Temperatures, ThermalBodies
from simgl.thermal.thermal_view import ThermalView, posed_as, thermal_view
from simgl.view.frame_view import FrameView
from simgl.view.thermal_exposure import thermal_exposure


@dataclass(frozen=True, eq=False)
class ThermalScene:
    """What a thermal camera is to see.

    temperatures : of every spacecraft
    during : the scene at other epochs [TAI ns]; None where it stands still
    view_of : what the camera draws of a state
    """

    still: StillScene
    bodies: ThermalBodies
    temperatures: Temperatures
    during: Callable[[int], SceneState] | None
    view_of: Callable[[SceneState], FrameView]


def thermal_capture(frames: Capture, seen: ThermalScene, products: frozenset[Product]) -> Capture:
    """A capture with what a thermal camera alone has: its thermal frame and DN, if wanted.

    The thermal frame is that of the instant; DN hold what the detector's pixels do.
    """
    if not products & {Product.DN, Product.THERMAL}:
        return frames
    still = seen.still
    detector = still.camera.thermal
    assert detector is not None
    of_bodies = {
        name: (seen.bodies.of(name, body.model), seen.temperatures[name])
        for name, body in still.state.bodies.items()
    }
    skies = {
        name: seen.bodies.skies.in_band(still.state, name, detector) for name in still.state.bodies
    }
    scene = thermal_view(still.state, detector, of_bodies, skies)
    drawn = still.renderer.thermal(still.view, scene).read()
    watts, counted, kelvin, share = np.moveaxis(drawn, -1, 0)
    if Product.THERMAL in products:
        mean = np.divide(kelvin, share, out=np.zeros_like(kelvin), where=share > 0.0)
        thermal = ThermalFrame(
            info=frames.info,
            radiance=np.ascontiguousarray(watts),
            temperature=mean,
            state=scene.digest,
            history=scene.history,
        )
        frames = replace(frames, thermal=thermal)
    if Product.DN in products:
        info, serial = frames.info, still.camera.detector.serial
        held = _held(seen, scene, counted)
        dn = detector.digitised(held, (info.seed, serial), info.epoch_tai_ns, info.draw)
        frames = replace(frames, digital=DigitalFrame(info=info, dn=dn))
    return frames


def _held(seen: ThermalScene, scene: ThermalView, counted: Array32) -> Array:
    """(h, w) radiance in the detector's pixels, as it counts; that of the instant is known."""
    state, name = seen.still.state, seen.still.camera.name
    parts = () if seen.during is None else thermal_exposure(state, name, seen.during)
    if not parts:
        return counted.astype(np.float64)
    total = np.zeros(counted.shape)
    for part, weight in parts:
        drawn = seen.still.renderer.thermal(seen.view_of(part), posed_as(scene, part)).read()
        total += weight * drawn[..., 1]
    return total
