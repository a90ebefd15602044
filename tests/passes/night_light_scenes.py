"""Plates in the Earth's shadow, and the irradiance that they have there."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from itertools import pairwise
from typing import Any

import numpy as np

from simgl.arrays import Array
from simgl.physics.airglow import GLOW_DEPTH, path_in_layers, zenith_glow
from simgl.physics.atmosphere import STANDARD, grazing_optical_depth
from simgl.physics.constants import MOON_RADIUS
from simgl.physics.lunar_model import lommel_seeliger_share, surface_factor
from simgl.physics.zodiacal_light import mean_diffuse_sky
from simgl.scenario.loader import scenario_from_dict
from simgl.scenario.scenario import Scenario
from simgl.scene.star_catalogue import shipped_stars
from simgl.scene.state import SceneState
from simgl.simulator import Product, Simulator
from tests.passes.earth_light_scenes import attitude, plate
from tests.scenes import lambert

# Stars and diffuse light of the whole sky, spread over it [W m-2 sr-1].
SKY = shipped_stars().mean_radiance + mean_diffuse_sky()

R, ALTITUDE = 6.371e6, 4.0e5


def scenario() -> Scenario:
    """A white plate somewhere at 400 km and a camera before it, under the real Sun and Moon."""
    return scenario_from_dict(
        {
            "epoch": {"utc": "2026-03-20T12:00:00"},
            "earth": {"shape": "sphere", "radius_km": 6371.0, "albedo": 0.0},
            "spacecraft": {
                "plate": {"model": plate(lambert(1.0)), "position_icrf_m": [R + ALTITUDE, 0, 0]}
            },
            "camera": {
                "cam": {
                    "width_px": 64,
                    "height_px": 64,
                    "focal_length_mm": 100.0,
                    "position_icrf_m": [R + ALTITUDE + 20.0, 0.0, 0.0],
                    "look_at": "plate",
                    "up": [0.3, 0.2, 0.9],
                }
            },
        }
    )


def night(
    base: Scenario,
    normal: Array,
    *,
    moon_deg: float,
    sun_deg: float = 180.0,
    stars: bool = False,
    **earth: Any,
) -> SceneState:
    """The plate and nothing else that gives light by night.

    Axes: x up, z towards the azimuth of the Moon, and the Sun's opposite one.

    normal : (3,) of the plate, in these axes
    moon_deg, sun_deg : from the zenith, seen from the Earth's centre
    earth : fields of the Earth that differ from a black one without air, Moon and airglow
    """
    state = base.at(base.epoch_tai_ns)
    assert state.moon is not None
    assert state.earth is not None
    body, camera = state.bodies["plate"], state.cameras["cam"]
    axes = _axes(state, sun_deg)
    position, n = (R + ALTITUDE) * axes[0], normal @ axes
    pose = replace(body.pose, position=position, R_icrf_from_body=attitude(n, 0.4).as_matrix())
    moon = _from_zenith(moon_deg) @ axes
    return replace(
        state,
        earth=replace(state.earth, earth=replace(state.earth.earth, **earth)),
        moon=np.linalg.norm(state.moon) * moon,
        bodies={"plate": replace(body, pose=pose)},
        cameras={
            "cam": replace(
                camera,
                position=position + 20.0 * n,
                R_camera_from_icrf=attitude(-n, 0.2).as_matrix().T,
            )
        },
        stars=state.stars if stars else None,
    )


def _axes(state: SceneState, sun_deg: float) -> Array:
    """(3, 3) rows: axes of the scene whose Sun stands so far from the zenith, ICRF."""
    sun = state.sun.seen_from(np.zeros(3)).direction_icrf
    y = np.cross(sun, np.eye(3)[2])
    y /= np.linalg.norm(y)
    z = np.cross(sun, y)
    s, c = np.sin(np.radians(sun_deg)), np.cos(np.radians(sun_deg))
    # The Sun at c up - s ahead.
    up, ahead = c * sun + s * z, -s * sun + c * z
    return np.stack([up, np.cross(ahead, up), ahead])


def _from_zenith(angle_deg: float) -> Array:
    a = np.radians(angle_deg)
    return np.array([np.cos(a), 0.0, np.sin(a)])


def facing(tilt_deg: float, azimuth_deg: float = 0.0) -> Array:
    """Normal of a plate: tilt from the zenith, azimuth from the Moon's."""
    t, a = np.radians([tilt_deg, azimuth_deg])
    return np.array([np.cos(t), np.sin(t) * np.sin(a), np.sin(t) * np.cos(a)])


def irradiance(simulator: Simulator, state: SceneState) -> Array:
    """(4,) of the white plate, by its radiance [W m-2]."""
    frame = simulator.capture(state, "cam", {Product.RADIANCE}).radiance
    assert frame is not None
    return np.pi * frame.radiance[28:36, 28:36].astype(np.float64).mean(axis=(0, 1))


def moon_irradiance(state: SceneState) -> Array:
    """(4,) of the plate by the Moon's disc: sum of radiance, solid angle and cosine over it."""
    assert state.moon is not None
    pose = state.bodies["plate"].pose
    offset = state.moon - pose.position
    distance = float(np.linalg.norm(offset))
    towards, sun = offset / distance, state.sun.seen_from(state.moon)
    # Points of the near hemisphere in equal steps of the disc.
    x, y = np.meshgrid(*(2 * [(np.arange(600) + 0.5) / 300.0 - 1.0]))
    inside = x * x + y * y < 1.0
    x, y = x[inside], y[inside]
    u = np.cross(towards, np.eye(3)[0])
    u /= np.linalg.norm(u)
    n = np.sqrt(1.0 - x * x - y * y)[:, None] * -towards + x[:, None] * u
    n = n + y[:, None] * np.cross(towards, u)
    mu0, mu = np.maximum(n @ sun.direction_icrf, 0.0), -(n @ towards)
    phase = float(np.arccos(-towards @ sun.direction_icrf))
    s = lommel_seeliger_share(phase)
    law = surface_factor(phase) * np.mean(s * mu0 / (mu0 + mu) + (1.0 - s) * 0.5 * mu0)
    solid_angle = np.pi * np.sin(np.arcsin(MOON_RADIUS / distance)) ** 2
    cosine = max(float(towards @ pose.R_icrf_from_body[:, 2]), 0.0)
    return np.asarray(sun.irradiance * law * (solid_angle * cosine))


def _over_nadir_angles(normal: Array, radiance: Any, edges: Array) -> Array:
    """(4,) integral of a radiance of the nadir angle alone times the cosine to a normal [W m-2]."""
    x, weights = np.polynomial.legendre.leggauss(40)
    azimuth = (np.arange(720) + 0.5) * (2.0 * np.pi / 720)
    total = np.zeros(4)
    for low, high in pairwise(edges):
        angle = 0.5 * (low + high) + 0.5 * (high - low) * x
        sine, cosine = np.sin(angle), np.cos(angle)
        d = np.stack(
            [
                np.broadcast_to(-cosine[:, None], (len(x), len(azimuth))),
                sine[:, None] * np.cos(azimuth),
                sine[:, None] * np.sin(azimuth),
            ],
            axis=-1,
        )
        facing = np.maximum(d @ normal, 0.0).mean(axis=1) * 2.0 * np.pi
        total += (0.5 * (high - low) * weights * sine * facing) @ radiance(angle)
    return total


def airglow_irradiance(normal: Array) -> Array:
    """(4,) of a plate at 400 km over black ground, by quadrature over the layers [W m-2]."""

    def radiance(angle: Array) -> Array:
        lowest = (R + ALTITUDE) * np.sin(angle) - R
        path = path_in_layers(R, lowest)
        beyond = np.where((lowest > 0.0)[:, None], _passed(lowest), 0.0)
        return zenith_glow(from_below=False) / GLOW_DEPTH * path * (1.0 + beyond)

    heights = np.array([0.0, 10e3, 30e3, 60e3, 82e3, 91e3, 92e3, 101e3])
    edges = np.concatenate([[0.0, 0.6, 1.0], np.arcsin((R + heights) / (R + ALTITUDE))])
    return _over_nadir_angles(normal, radiance, edges)


def _passed(lowest: Array) -> Array:
    return np.exp(-grazing_optical_depth(STANDARD, R, np.maximum(lowest, 0.0)))


@lru_cache(maxsize=32)
def _stars(normal: tuple[float, ...]) -> Array:
    limb = float(np.arcsin(R / (R + ALTITUDE)))

    def radiance(angle: Array) -> Array:
        return SKY * _passed((R + ALTITUDE) * np.sin(np.minimum(angle, np.pi / 2)) - R)

    edges = np.concatenate([limb + np.radians([0.0, 0.2, 0.6, 1.0, 1.6]), [1.5, np.pi / 2]])
    below = _over_nadir_angles(np.array(normal), radiance, edges)
    whole = np.array([np.pi / 2, 2.0, 2.6, np.pi])
    return below + _over_nadir_angles(
        np.array(normal), lambda angle: np.tile(SKY, (len(angle), 1)), whole
    )


def starlight_irradiance(normal: Array) -> Array:
    """(4,) of a plate at 400 km by stars and zodiacal light past Earth and air [W m-2]."""
    return _stars(tuple(normal.tolist()))
