"""Orbit propagation: Keplerian with secular J2 rates, SGP4, and Clohessy-Wiltshire."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import erfa
import numpy as np
from scipy.spatial.transform import Rotation
from sgp4.api import SGP4_ERRORS, WGS72, Satrec

from simgl.arrays import Array
from simgl.errors import ConfigError
from simgl.physics.constants import EARTH_J2, EARTH_MU, WGS84_EQUATORIAL_RADIUS
from simgl.physics.ephemeris import itrf_from_icrf, utc_julian_date
from simgl.physics.frames import cross, rotation_zxz


@dataclass(frozen=True, kw_only=True)
class KeplerianOrbit:
    """An Earth orbit by its elements in GCRF; lengths [m], angles [rad].

    true_anomaly : at ``epoch_tai_ns``
    oblate : secular drift of node, perigee and mean anomaly by the Earth's J2. The elements are
        then mean elements; periodic J2 effects within a revolution (some km) are neglected
    """

    semi_major_axis: float
    eccentricity: float
    inclination: float
    raan: float
    argument_of_perigee: float
    true_anomaly: float
    epoch_tai_ns: int
    oblate: bool = False

    def state(self, tai_ns: int) -> tuple[Array, Array]:
        """Position [m] and velocity [m s-1], (3,) in GCRF."""
        a, e = self.semi_major_axis, self.eccentricity
        # Python floats: numpy takes ten times as long for single numbers.
        root = math.sqrt((1.0 + e) / (1.0 - e))
        eccentric = 2.0 * math.atan(math.tan(0.5 * self.true_anomaly) / root)
        motion = math.sqrt(EARTH_MU / a**3)
        elapsed = (tai_ns - self.epoch_tai_ns) * 1e-9
        node_rate, perigee_rate, anomaly_rate = self._drift(motion)
        swept = eccentric - e * math.sin(eccentric) + (motion + anomaly_rate) * elapsed
        mean = swept % (2.0 * math.pi)
        big_e = mean if e < 0.8 else math.pi
        # Newton's method on Kepler's equation converges quadratically: 12 steps suffice for e < 1.
        for _ in range(12):
            big_e -= (big_e - e * math.sin(big_e) - mean) / (1.0 - e * math.cos(big_e))
        cosine, sine = math.cos(big_e), math.sin(big_e)
        minor = math.sqrt(1.0 - e * e)
        rate = (motion + anomaly_rate) * a / (1.0 - e * cosine)
        in_plane_r = a * np.array([cosine - e, minor * sine, 0.0])
        in_plane_v = rate * np.array([-sine, minor * cosine, 0.0])
        node = self.raan + node_rate * elapsed
        perigee = self.argument_of_perigee + perigee_rate * elapsed
        R_icrf_from_plane = rotation_zxz(node, self.inclination, perigee)
        position = R_icrf_from_plane @ in_plane_r
        # The orbit plane and the perigee rotate, which adds to the velocity.
        spin = np.array([0.0, 0.0, node_rate]) + perigee_rate * R_icrf_from_plane[:, 2]
        return position, R_icrf_from_plane @ in_plane_v + cross(spin, position)

    def _drift(self, motion: float) -> tuple[float, float, float]:
        """Secular rates of node, perigee and mean anomaly [rad s-1] (Vallado, 4th ed., 9.6.2)."""
        if not self.oblate:
            return 0.0, 0.0, 0.0
        squeeze = 1.0 - self.eccentricity**2
        cosine = np.cos(self.inclination)
        parameter = self.semi_major_axis * squeeze
        common = 1.5 * motion * EARTH_J2 * (WGS84_EQUATORIAL_RADIUS / parameter) ** 2
        return (
            float(-common * cosine),
            float(0.5 * common * (5.0 * cosine**2 - 1.0)),
            float(0.5 * common * np.sqrt(squeeze) * (3.0 * cosine**2 - 1.0)),
        )


def keplerian_orbit(position: Array, velocity: Array, tai_ns: int) -> KeplerianOrbit:
    """The two-body orbit through a state in GCRF.

    position : (3,) [m]
    velocity : (3,) [m s-1]

    Raises ValueError for a state that is on no closed orbit outside the Earth.
    """
    r, v = np.linalg.norm(position), np.linalg.norm(velocity)
    momentum = np.cross(position, velocity)
    if r == 0.0 or np.linalg.norm(momentum) == 0.0:
        raise ValueError("must be a state on an orbit, got a radial velocity")
    axis = 1.0 / (2.0 / r - v * v / EARTH_MU)
    pole = momentum / np.linalg.norm(momentum)
    to_perigee = np.cross(velocity, momentum) / EARTH_MU - position / r
    eccentricity = float(np.linalg.norm(to_perigee))
    if eccentricity >= 1.0:
        raise ValueError(f"must be on a closed orbit, got the eccentricity {eccentricity:.6g}")
    if axis * (1.0 - eccentricity) <= WGS84_EQUATORIAL_RADIUS:
        below = (WGS84_EQUATORIAL_RADIUS - axis * (1.0 - eccentricity)) / 1e3
        raise ValueError(
            f"must be on an orbit outside the Earth, got a perigee {below:.1f} km under"
        )
    # Of an equatorial orbit the node is x; of a circular one any place will do as perigee.
    node = np.array([-pole[1], pole[0], 0.0])
    node = node / np.linalg.norm(node) if np.any(node) else np.array([1.0, 0.0, 0.0])
    across = np.cross(pole, node)
    perigee = float(np.arctan2(to_perigee @ across, to_perigee @ node))
    place = float(np.arctan2(position @ across, position @ node))
    return KeplerianOrbit(
        semi_major_axis=float(axis),
        eccentricity=eccentricity,
        inclination=float(np.arccos(np.clip(pole[2], -1.0, 1.0))),
        raan=float(np.arctan2(node[1], node[0])),
        argument_of_perigee=perigee,
        true_anomaly=place - perigee,
        epoch_tai_ns=tai_ns,
    )


# The compiled elements cannot be pickled or hashed by content.
@lru_cache(maxsize=256)
def _satellite(first: str, second: str) -> Satrec:
    return Satrec.twoline2rv(first, second, WGS72)


@dataclass(frozen=True, kw_only=True, eq=False)
class TwoLineElements:
    """A two-line element set, propagated by SGP4.

    name : of the object, for error messages
    lines : both, 69 characters each

    Raises ValueError for lines that are no elements, or that SGP4 refuses.
    """

    name: str
    lines: tuple[str, str]

    def __post_init__(self) -> None:
        if self._satellite.error:
            raise ValueError("SGP4 refuses the elements")

    @property
    def _satellite(self) -> Satrec:
        return _satellite(*self.lines)

    def state(self, tai_ns: int) -> tuple[Array, Array]:
        """Position [m] and velocity [m s-1], (3,) in GCRF.

        SGP4 works in TEME: true equator, and the equinox of the sidereal time of 1982.
        Raises ConfigError if SGP4 fails, such as for a decayed orbit.
        """
        day, fraction = utc_julian_date(tai_ns)
        error, r_km, v_km_s = self._satellite.sgp4(day, fraction)
        if error:
            problem = f"has no place at this epoch: {SGP4_ERRORS[error]}"
            raise ConfigError(f'"{self.name}"', "two-line elements", problem)
        R = icrf_from_teme(tai_ns)
        return R @ (1e3 * np.array(r_km)), R @ (1e3 * np.array(v_km_s))


def icrf_from_teme(tai_ns: int) -> Array:
    """R_icrf_from_teme: to the Earth by the sidereal time of 1982, to ICRF by IAU 2006/2000A."""
    angle = float(erfa.gmst82(*utc_julian_date(tai_ns)))
    R_itrf_from_teme = Rotation.from_euler("z", -angle).as_matrix()
    return itrf_from_icrf(tai_ns).T @ R_itrf_from_teme


def clohessy_wiltshire(
    position_lvlh: Array, velocity_lvlh: Array, mean_motion: float, elapsed: float
) -> tuple[Array, Array]:
    """Relative position [m] and velocity [m s-1] in LVLH axes of a circular orbit, propagated.

    position_lvlh, velocity_lvlh : (3,) at the start [m], [m s-1]
    mean_motion : of the reference [rad s-1]
    elapsed : time since the start [s]

    Linear solution of Clohessy and Wiltshire (1960); the error grows as the distance squared over
    the orbit's radius.
    """
    n, c, s = mean_motion, np.cos(mean_motion * elapsed), np.sin(mean_motion * elapsed)
    phase = n * elapsed
    # Ahead, out of plane, up: LVLH has y against the orbit normal and z down.
    ahead, across, up = position_lvlh * [1.0, -1.0, -1.0]
    ahead_rate, across_rate, up_rate = velocity_lvlh * [1.0, -1.0, -1.0]
    position = np.array(
        [
            6.0 * (s - phase) * up
            + ahead
            - 2.0 / n * (1.0 - c) * up_rate
            + (4.0 * s - 3.0 * phase) / n * ahead_rate,
            c * across + s / n * across_rate,
            (4.0 - 3.0 * c) * up + s / n * up_rate + 2.0 / n * (1.0 - c) * ahead_rate,
        ]
    )
    velocity = np.array(
        [
            6.0 * n * (c - 1.0) * up - 2.0 * s * up_rate + (4.0 * c - 3.0) * ahead_rate,
            -n * s * across + c * across_rate,
            3.0 * n * s * up + c * up_rate + 2.0 * s * ahead_rate,
        ]
    )
    return position * [1.0, -1.0, -1.0], velocity * [1.0, -1.0, -1.0]
