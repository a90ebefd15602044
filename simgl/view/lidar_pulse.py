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
from simgl.view.raster_tiles import RasterTile
from simgl.view.spacecraft_view import SpacecraftView

# A beam falls from all to nothing over this share of its half angle, about the edge of its cone: so
# it has the cone's solid angle to 2e-5.
_EDGE = 0.02
# Of the aperture; nothing closer to it casts [m].
_RADIUS = 0.01


def pulse_view(
    view: FrameView, lidar: Lidar, state: SceneState, camera: CameraState
) -> FrameView | None:
    """What a pulse lights, radiance in J m-2 sr-1; None where it meets no spacecraft."""
    energy = np.zeros(4)
    passed = lidar.bands.transmission(np.array([lidar.wavelength]))
    energy[lidar.band] = lidar.pulse_energy * passed[0]
    R_icrf_from_camera = camera.R_camera_from_icrf.T
    emitter = Lamp(
        name="lidar",
        spacecraft="",
        position_body=np.zeros(3),
        boresight_body=np.array([0.0, 0.0, 1.0]),
        look_at=None,
        power=energy,
        half_angle=(1.0 - 0.5 * _EDGE) * lidar.half_angle,
        edge=_EDGE * lidar.half_angle,
        radius=_RADIUS,
    )
    place = LampState(
        lamp=emitter,
        position=camera.position + R_icrf_from_camera @ np.array(lidar.offset),
        direction=unit(R_icrf_from_camera[:, 2]),
    )

    def lit(seen: FrameView) -> FrameView:
        R = np.eye(3) if seen.field is None else seen.field.R_pinhole_from_camera
        turned = replace(camera, R_camera_from_icrf=R @ camera.R_camera_from_icrf)
        lamp = lamp_view(place, R_icrf_from_camera, state, turned)
        black = replace(seen.background, celestial=None, planet=None)
        tiles = () if lamp is None else tuple(map(_in_the_dark, seen.tiles))
        lamps = () if lamp is None else (lamp,)
        return replace(seen, background=black, tiles=tiles, lamps=lamps)

    first, *others = map(lit, view.pinholes)
    if not any(seen.tiles for seen in (first, *others)):
        return None
    return replace(first, other_pinholes=tuple(others))


def _in_the_dark(tile: RasterTile) -> RasterTile:
    return replace(tile, spacecraft=tuple(_unlit(one) for one in tile.spacecraft))


def _unlit(view: SpacecraftView) -> SpacecraftView:
    dark = np.zeros(4, dtype=np.float32)
    return replace(view, sun_irradiance=dark, sky=None, incident_light=None, near=None)
