"""Bodies at 400 km in the light of a Lambertian Earth, and the irradiance they have there."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from functools import partial
from typing import Any

import moderngl
import numpy as np
from scipy.spatial.transform import Rotation

from simgl.arrays import Array32
from simgl.scenario.scenario import Scenario
from tests.scenes import IN_BANDS, TOTAL, Table, opened, radiance, scene

Array = np.ndarray[Any, np.dtype[np.float64]]

R, ALTITUDE = 6.371e6, 4.0e5
EARTH = {"shape": "sphere", "radius_km": 6371.0, "albedo": 0.3, "atmosphere": "none"}
BARE = {**EARTH, "albedo": 0.0}
UP = np.array([1.0, 0.0, 0.0])
PLACE = (R + ALTITUDE) * UP

# Irradiance [W m-2] of a plate at 400 km from a Lambertian Earth of albedo 0.3 under 1367 W m-2 of
# 0.526 deg: nadir, and vertical at 0, 90 and 180 deg from the Sun's azimuth; direct quadrature.
IRRADIANCE = {
    0.0: (361.6074, 117.4835, 117.4835, 117.4835),
    60.0: (180.8037, 67.1348, 58.7418, 50.3487),
    90.0: (8.3209, 9.6915, 3.0872, 6.7e-5),
}
# The same under a Sun whose light comes from along the limb: three of those plates, and two at 45
# and 70 deg from nadir towards the Sun's azimuth.
LOW_SUN = {
    97.0: (0.5498, 1.2308, 0.2308, 1.2591, 1.3446),
    100.0: (0.1614, 0.3966, 0.0619, 0.3946, 0.4279),
    104.0: (0.0194, 0.0512, 0.0059, 0.0499, 0.0547),
    108.0: (0.0003, 0.0007, 0.0000, 0.0007, 0.0008),
}
LOW_PLATES = ((0.0, 0.0), (90.0, 0.0), (90.0, 90.0), (45.0, 0.0), (70.0, 0.0))
TILT_AZIMUTH = ((0.0, 0.0), (90.0, 0.0), (90.0, 90.0), (90.0, 180.0))


def sun_at(zenith_deg: float) -> tuple[float, float, float]:
    z = np.radians(zenith_deg)
    return float(np.cos(z)), float(np.sin(z)), 0.0


def facing(tilt_deg: float, azimuth_deg: float) -> Array:
    """Normal of a plate: tilt from nadir, azimuth from the Sun's."""
    t, a = np.radians([tilt_deg, azimuth_deg])
    return np.array([-np.cos(t), np.sin(t) * np.cos(a), np.sin(t) * np.sin(a)])


def attitude(normal: Array, roll: float = 0.0) -> Rotation:
    """Of a body whose +z points along a normal, rolled about it [rad]; ICRF from body."""
    x = np.cross(normal, np.eye(3)[int(np.argmin(np.abs(normal)))])
    x /= np.linalg.norm(x)
    R_icrf_from_body = np.stack([x, np.cross(normal, x), normal], axis=1)
    return Rotation.from_matrix(R_icrf_from_body) * Rotation.from_rotvec([0.0, 0.0, roll])


def before(
    model: Table,
    R_icrf_from_body: Rotation,
    towards_camera: Array,
    zenith_deg: float,
    *,
    earth: Table,
    turned: Rotation | None = None,
    beside: Table | None = None,
) -> Scenario:
    """A body at 400 km and a camera 20 m from it; the whole scene may be turned.

    beside : another spacecraft, listed first
    """
    turn = turned or Rotation.identity()
    sun = turn.apply(sun_at(zenith_deg))
    return scene(
        ({} if beside is None else {"beside": beside})
        | {
            "body": {
                "model": model,
                "position_icrf_m": turn.apply(PLACE).tolist(),
                "quaternion_icrf_from_body_xyzw": (turn * R_icrf_from_body).as_quat().tolist(),
            }
        },
        {
            "position_icrf_m": turn.apply(PLACE + 20.0 * towards_camera).tolist(),
            "look_at": "body",
            # Not parallel to any line of sight here, whatever the turn.
            "up": turn.apply([0.3, 0.2, 0.9]).tolist(),
            "focal_length_mm": 100.0,
        },
        sun_direction=(float(sun[0]), float(sun[1]), float(sun[2])),
        earth=earth,
    )


def plate(material: Table) -> Table:
    return {"plate": {"width_m": 4.0, "height_m": 4.0, "material": material}}


def earthshine(gl: moderngl.Context, *arguments: Any, **options: Any) -> Array:
    """(128, 128, 4) radiance less that with a black Earth, which leaves the sunlight alone."""
    return _of_earth(partial(radiance, gl), partial(radiance, gl), *arguments, **options)


@contextmanager
def opened_earthshine(
    gl: moderngl.Context, model: Table, beside: Table | None = None
) -> Iterator[Callable[..., Array]]:
    """``earthshine`` of one model in whatever place, attitude and sunlight, beside another."""
    scenarios = (
        before(model, Rotation.identity(), UP, 0.0, earth=earth, beside=beside)
        for earth in (EARTH, BARE)
    )
    with ExitStack() as stack:
        with_earth, without = (stack.enter_context(opened(gl, scenario)) for scenario in scenarios)
        yield partial(_of_earth, with_earth, without, model, beside=beside)


def _of_earth(
    with_earth: Callable[[Scenario], Array32],
    without: Callable[[Scenario], Array32],
    *arguments: Any,
    **options: Any,
) -> Array:
    lit = with_earth(before(*arguments, earth=EARTH, **options)).astype(np.float64)
    return lit - without(before(*arguments, earth=BARE, **options))


def as_irradiance(picture: Array) -> float:
    """Of a white Lambertian surface, as if all sunlight lay in the bands [W m-2]."""
    return float(np.pi * picture[60:68, 60:68].mean(axis=(0, 1)).sum() * TOTAL / IN_BANDS)
