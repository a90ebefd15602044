"""The light of a LIDAR's pulse alone, as a view: a lamp at the camera, and no other light."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from simgl.camera.lidar import Lidar
from simgl.physics.frames import unit
from simgl.scene.lamps import Lamp, LampState
from simgl.scene.state import CameraState, SceneState
from simgl.view.frame_view import FrameView
from simgl.view.lamp_views import lamp_view
from simgl.view.spacecraft_view import SpacecraftView

# A beam falls to nothing over this angle around its cone [rad].
_EDGE = np.radians(0.5)
# Of the aperture; nothing closer to it casts [m].
_RADIUS = 0.01


def pulse_view(
    view: FrameView, lidar: Lidar, state: SceneState, camera: CameraState
) -> FrameView | None:
    """What a pulse lights, radiance in J m-2 sr-1; None where it meets no spacecraft."""
    energy = np.zeros(4)
    energy[lidar.band] = lidar.pulse_energy
    R_icrf_from_camera = camera.R_camera_from_icrf.T
    emitter = Lamp(
        name="lidar",
        spacecraft="",
        position_body=np.zeros(3),
        boresight_body=np.array([0.0, 0.0, 1.0]),
        look_at=None,
        power=energy,
        half_angle=lidar.half_angle,
        edge=_EDGE,
        radius=_RADIUS,
    )
    place = LampState(
        lamp=emitter,
        position=camera.position + R_icrf_from_camera @ np.array(lidar.offset),
        direction=unit(R_icrf_from_camera[:, 2]),
    )
    lamp = lamp_view(place, R_icrf_from_camera, state, camera)
    if lamp is None or not view.tiles:
        return None
    black = replace(view.background, celestial=None, planet=None)
    tiles = tuple(replace(t, spacecraft=tuple(_unlit(s) for s in t.spacecraft)) for t in view.tiles)
    return replace(view, background=black, tiles=tiles, lamps=(lamp,))


def _unlit(view: SpacecraftView) -> SpacecraftView:
    dark = np.zeros(4, dtype=np.float32)
    return replace(view, sun_irradiance=dark, sky=None, incident_light=None)
