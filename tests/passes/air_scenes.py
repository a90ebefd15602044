"""Looking through the air without a whole simulator: one pass for many rays and parameters."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import lru_cache

import moderngl
import numpy as np

from simgl.arrays import Array, Array32
from simgl.camera.camera import Camera
from simgl.gpu.render_targets import Format, ImageTarget
from simgl.passes.background.air import AtmospherePass
from simgl.passes.background.planet import PlanetPass
from simgl.physics.atmosphere import SOURCE
from simgl.physics.spectrum import BandLight
from simgl.scene.earth import Earth
from simgl.scene.state import CameraState, EarthState, SceneState, SunInDirection
from simgl.view.background import PlanetView, background
from simgl.view.celestial import CelestialView
from tests.scenes import scene

RADIUS = 6.371e6
SUN_HALF_ANGLE = np.radians(0.2666)


def sphere(albedo: float, air: object = SOURCE) -> Earth:
    """The sphere of the truth tables, evenly grey."""
    return Earth(
        equatorial_radius=RADIUS,
        polar_radius=RADIUS,
        albedo=(albedo,) * 4,
        air=air,  # type: ignore[arg-type]
    )


def axes(view: Array, up: Array | None = None) -> Array:
    """(3, 3) rows x right, y down, z along the view."""
    z = view / np.linalg.norm(view)
    hint = np.eye(3)[int(np.argmin(np.abs(z)))] if up is None else up
    y = -(hint - np.dot(hint, z) * z)
    y /= np.linalg.norm(y)
    return np.stack([np.cross(y, z), y, z])


@dataclass(frozen=True, eq=False)
class Window:
    """Draws planet and air for sunlight of 1 W m-2 in each band."""

    ctx: moderngl.Context
    air: AtmospherePass
    planet: PlanetPass

    def picture(
        self,
        earth: Earth,
        place: Array,
        view: Array,
        sun: Array,
        *,
        up: Array | None = None,
        size: tuple[int, int] = (3, 3),
        pixel: float = 1e-5,
        behind: float = 0.0,
        moon: Array | None = None,
    ) -> Array32:
        """(height, width, 4) radiance factor pi L / E.

        pixel : its angle [rad]
        behind : radiance factor of what lies beyond Earth and air, everywhere
        moon : its place [m]
        """
        state, camera = _state(earth, place, axes(view, up), sun, size, pixel)
        # Refuses before anything is made.
        background(state, camera)
        target = ImageTarget(self.ctx, size, (Format("f4", 4),))
        target.framebuffer.clear(*(behind / np.pi,) * 4)
        self.draw(earth, place, view, sun, target, up=up, pixel=pixel, beyond=True, moon=moon)
        picture = np.pi * target.read()
        self.ctx.detect_framebuffer(0).use()
        target.release()
        return np.asarray(picture, np.float32)

    def draw(
        self,
        earth: Earth,
        place: Array,
        view: Array,
        sun: Array,
        target: ImageTarget,
        *,
        up: Array | None = None,
        pixel: float,
        beyond: bool = False,
        moon: Array | None = None,
    ) -> None:
        """Into a target; ``beyond``: over what it holds already."""
        state, camera = _state(earth, place, axes(view, up), sun, target.size, pixel)
        state = replace(state, moon=moon)
        drawn = CelestialView(
            focal_length=1.0, principal_point=(0.0, 0.0), stars=None, sun=None, moon=None
        )
        seen = replace(background(state, camera), celestial=drawn if beyond else None)
        area = 0, 0, *target.size
        self.planet.draw(self.planet.planned(seen, target.framebuffer, area, None))

    def ray(self, earth: Earth, place: Array, view: Array, sun: Array) -> Array:
        """(4,) radiance factor in one direction."""
        return np.asarray(self.picture(earth, place, view, sun)[1, 1], np.float64)


def planet_view(earth: Earth, place: Array, view: Array, sun: Array) -> PlanetView:
    """The Earth before a camera that looks one way."""
    planet = background(*_state(earth, place, axes(view), sun, (3, 3), 1e-5)).planet
    assert planet is not None
    return planet


@contextmanager
def window(ctx: moderngl.Context) -> Iterator[Window]:
    """Everything freed at the end."""
    air = AtmospherePass(ctx)
    planet = PlanetPass(ctx, air)
    try:
        yield Window(ctx, air, planet)
    finally:
        planet.release()
        air.release()


def _state(
    earth: Earth,
    place: Array,
    R_camera_from_icrf: Array,
    sun: Array,
    size: tuple[int, int],
    pixel: float,
) -> tuple[SceneState, CameraState]:
    light = BandLight(irradiance=np.ones(4), photons_per_joule=np.ones(4))
    seen = SunInDirection(direction_icrf=sun, light=light, angular_radius=SUN_HALF_ANGLE)
    seat = CameraState(
        camera=_camera(size, pixel), position=place, R_camera_from_icrf=R_camera_from_icrf
    )
    state = SceneState(
        tai_ns=0,
        sun=seen,
        earth=EarthState(earth=earth, position=np.zeros(3), R_itrf_from_icrf=np.eye(3)),
        moon=None,
        bodies={},
        cameras={"cam": seat},
    )
    return state, seat


@lru_cache(maxsize=64)
def _camera(size: tuple[int, int], pixel: float) -> Camera:
    table = {
        "position_icrf_m": [0, 0, 0],
        "boresight": [0, 0, 1],
        "up": [0, 1, 0],
        "width_px": size[0],
        "height_px": size[1],
        "pixel_pitch_um": 1.0,
        "focal_length_mm": 1e-3 / pixel,
    }
    return scene({}, table).cameras["cam"]
