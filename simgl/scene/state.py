"""The scene at one instant: float64, SI, ICRF axes. An image is a pure function of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from simgl.arrays import Array
from simgl.camera.camera import Camera
from simgl.html_table import html_table
from simgl.physics.constants import ASTRONOMICAL_UNIT, MOON_RADIUS
from simgl.physics.eclipse import past_the_moon, sunlit_shares, sunlit_transmission
from simgl.physics.ephemeris import utc_from_tai_ns
from simgl.physics.frames import Pose, angle_between, norm, unit
from simgl.physics.lunar_model import moonlight
from simgl.physics.solar_disc import UNIFORM
from simgl.physics.spectrum import BandLight, Bands
from simgl.scene.earth import Earth
from simgl.scene.lamps import LampState, beam_profile
from simgl.scene.spacecraft import SpacecraftModel
from simgl.scene.star_catalogue import StarSky

# Share of the lamps' light below which the Moon's is not seen to cast shadows.
_DROWNED = 0.01


@dataclass(frozen=True, kw_only=True, eq=False)
class SunSeen:
    """The Sun as seen from one point.

    direction_icrf : (3,) unit, towards the Sun
    irradiance : (4,) per band on a surface that faces it, unobstructed [W m-2]
    angular_radius : of the disc [rad]
    limb : (2, 4) darkening of the disc towards its limb, zeros where it is uniform
    """

    direction_icrf: Array
    irradiance: Array
    angular_radius: float
    limb: Array = field(default_factory=UNIFORM.copy)

    @property
    def radiance(self) -> Array:
        """(4,) mean over the disc [W m-2 sr-1]."""
        return self.irradiance / (np.pi * np.sin(self.angular_radius) ** 2)


@dataclass(frozen=True, kw_only=True, eq=False)
class SunAtPosition:
    """A Sun at a position; its light decreases with the distance squared.

    position : (3,) [m]
    light_at_1_au : per band
    radius : of the photosphere [m]
    visible : whether the disc itself is drawn
    limb : (2, 4) darkening of the disc towards its limb
    """

    position: Array
    light_at_1_au: BandLight
    radius: float
    visible: bool = True
    limb: Array = field(default_factory=UNIFORM.copy)

    def seen_from(self, point: Array) -> SunSeen:
        """The Sun as seen from a point.

        point : (3,) in GCRF [m]
        """
        offset = self.position - point
        distance = norm(offset)
        return SunSeen(
            direction_icrf=offset / distance,
            irradiance=self.light_at_1_au.irradiance * (ASTRONOMICAL_UNIT / distance) ** 2,
            angular_radius=float(np.arcsin(self.radius / distance)),
            limb=self.limb,
        )

    @property
    def photons_per_joule(self) -> Array:
        """(4,) [J-1]."""
        return self.light_at_1_au.photons_per_joule

    @property
    def bands(self) -> Bands:
        """Of its light."""
        return self.light_at_1_au.bands


@dataclass(frozen=True, kw_only=True, eq=False)
class SunInDirection:
    """A Sun infinitely far away, its irradiance given at the scene.

    direction_icrf : (3,) unit, towards the Sun
    light : per band, at the scene
    angular_radius : [rad]
    visible : whether the disc itself is drawn
    limb : (2, 4) darkening of the disc towards its limb
    """

    direction_icrf: Array
    light: BandLight
    angular_radius: float
    visible: bool = True
    limb: Array = field(default_factory=UNIFORM.copy)

    def seen_from(self, point: Array) -> SunSeen:  # noqa: ARG002 - the same from everywhere
        """The Sun, the same from any point.

        point : (3,) in GCRF [m]
        """
        return SunSeen(
            direction_icrf=unit(self.direction_icrf),
            irradiance=self.light.irradiance,
            angular_radius=self.angular_radius,
            limb=self.limb,
        )

    @property
    def photons_per_joule(self) -> Array:
        """(4,) [J-1]."""
        return self.light.photons_per_joule

    @property
    def bands(self) -> Bands:
        """Of its light."""
        return self.light.bands


Sun = SunAtPosition | SunInDirection


@dataclass(frozen=True, kw_only=True, eq=False)
class EarthState:
    """The Earth at an instant.

    earth : surface, clouds and air
    position : (3,) of its centre [m]; the origin, unless a whole scene is shifted
    R_itrf_from_icrf : (3, 3)
    """

    earth: Earth
    position: Array
    R_itrf_from_icrf: Array

    @property
    def radii(self) -> tuple[float, float, float]:
        """Of the ellipsoid's axes [m]."""
        return self.earth.radii


@dataclass(frozen=True, kw_only=True, eq=False)
class BodyState:
    """A spacecraft at an instant.

    model : with moved joints
    pose : of its body axes
    """

    model: SpacecraftModel
    pose: Pose

    def in_body(self, point: Array) -> Array:
        """(3,) a point in body axes [m].

        point : (3,) in GCRF [m]
        """
        return self.pose.R_icrf_from_body.T @ (point - self.pose.position)

    def encloses(self, point: Array) -> bool:
        """Whether a point lies inside its skin.

        point : (3,) in GCRF [m]
        """
        mesh, place = self.model.posed_mesh, self.in_body(point)
        if norm(place - mesh.centre) > mesh.radius:
            return False
        # Nor beyond a plane that has its hull on the other side.
        directions = np.vstack([place - mesh.centre, np.eye(3)])
        across, at = directions @ mesh.hull.T, directions @ place
        if np.any((at < across.min(axis=1)) | (at > across.max(axis=1))):
            return False
        return mesh.encloses(place)


@dataclass(frozen=True, kw_only=True, eq=False)
class CameraState:
    """A camera at an instant.

    camera : lens, detector and settings
    position : (3,) of the pinhole [m]
    R_camera_from_icrf : (3, 3)
    velocity : (3,) relative to the Earth, ICRF axes [m s-1]; for the aberration of stars
    """

    camera: Camera
    position: Array
    R_camera_from_icrf: Array
    velocity: Array = field(default_factory=lambda: np.zeros(3))


@dataclass(frozen=True, kw_only=True, eq=False)
class DirectLight:
    """Sun and Moon at one point, attenuated by Earth and atmosphere.

    main : the one that gives more light, and casts the shadows
    lesser : the Moon if the Sun is the main light; None without one
    """

    main: SunSeen
    lesser: SunSeen | None


@dataclass(frozen=True, kw_only=True, eq=False)
class SceneState:
    """Everything that an image depends on, at one instant.

    Positions are those of GCRF.

    tai_ns : TAI nanoseconds since 1970-01-01T00:00:00 TAI
    sun : its position, or its fixed direction and irradiance
    bodies : spacecraft name to its pose and its model with moved joints
    cameras : camera name to its pose and settings
    lamps : with their poses
    earth : None for a scene in deep space
    moon : (3,) position of its centre [m]; None if the scenario fixes the Sun
    R_moon_from_icrf : (3, 3); None for a smooth Moon without seas
    stars : None if no stars are drawn
    mean_sunlight : ``sunlight`` over an exposure, where that is not as at the instant, by the bytes
        of the place
    """

    tai_ns: int
    sun: Sun
    earth: EarthState | None
    moon: Array | None
    bodies: Mapping[str, BodyState]
    cameras: Mapping[str, CameraState]
    lamps: tuple[LampState, ...] = ()
    stars: StarSky | None = None
    R_moon_from_icrf: Array | None = None
    mean_sunlight: Mapping[bytes, Array] = field(default_factory=dict, repr=False)
    # By place: each spacecraft asks for its own light, its shadows, its sky and its patches.
    _direct: dict[bytes, DirectLight] = field(default_factory=dict, init=False, repr=False)

    @property
    def bands(self) -> Bands:
        """Of all light and reflectances."""
        return self.sun.bands

    @property
    def part_names(self) -> dict[int, str]:
        """Part id of an image to "spacecraft/part"."""
        return {
            (instance + 1) * 65536 + part + 1: f"{name}/{part_name}"
            for instance, (name, body) in enumerate(self.bodies.items())
            for part, part_name in enumerate(body.model.parts)
        }

    def _repr_html_(self) -> str:
        first = next(iter(self.bodies), None)
        bodies = [
            (
                name,
                body.model.name,
                f"{1e-3 * norm(body.pose.position):.3f}",
                f"{norm(body.pose.position - self._place_of(first)):.3f}",
                f"{100.0 * self.sunlit_share(body.pose.position):.0f}",
            )
            for name, body in self.bodies.items()
        ]
        cameras = [self._camera_row(name, first) for name in self.cameras]
        columns = ("spacecraft", "model", "from origin [km]", f"from {first} [m]", "sunlight [%]")
        title = f"State at {utc_from_tai_ns(self.tai_ns)} UTC"
        of_cameras = ("camera", f"range to {first} [m]", "phase angle [deg]", "exposure time [ms]")
        return html_table(title, columns, bodies) + html_table("Cameras", of_cameras, cameras)

    def _place_of(self, body: str | None) -> Array:
        return np.zeros(3) if body is None else self.bodies[body].pose.position

    def _camera_row(self, name: str, target: str | None) -> tuple[str, ...]:
        """Name, range [m], phase angle [deg], exposure time [ms]."""
        state, place = self.cameras[name], self._place_of(target)
        line = state.position - place
        phase = angle_between(self.sun.seen_from(place).direction_icrf, line)
        return (
            name,
            f"{norm(line):.3f}",
            f"{float(np.rad2deg(phase)):.1f}",
            f"{1e3 * state.camera.exposure_time:g}",
        )

    def sunlit_share(self, point: Array) -> float:
        """Fraction of the Sun's light, over all bands, that reaches a point.

        point : (3,) in GCRF [m]

        A Sun without light has the fraction that it would have with equal light in each band.
        """
        irradiance = self.sun.seen_from(point).irradiance
        weights = irradiance if irradiance.any() else np.ones_like(irradiance)
        return float(weights @ self.sunlight(point) / weights.sum())

    def sunlight(self, point: Array) -> Array:
        """(4,) fraction of the Sun's light that Earth, air and Moon let reach a point.

        point : (3,) in GCRF [m]
        """
        if self.mean_sunlight and (place := point.tobytes()) in self.mean_sunlight:
            return self.mean_sunlight[place]
        sun = self.sun.seen_from(point)
        share = self._past_earth(point, sun)
        if self.moon is not None:
            towards = sun.direction_icrf
            share *= past_the_moon(point, self.moon, towards, sun.angular_radius, sun.limb)
        return share

    def moonlight(self, point: Array) -> SunSeen | None:
        """The Moon's light at a point after Earth and atmosphere; None without a Moon.

        point : (3,) in GCRF [m]

        It is that of a uniform disc, at any phase.
        """
        if self.moon is None or self.earth is None or not self.earth.earth.moonlight:
            return None
        offset = self.moon - point
        distance = norm(offset)
        sun = self.sun.seen_from(self.moon)
        phase = angle_between(sun.direction_icrf, -offset)
        seen = SunSeen(
            direction_icrf=offset / distance,
            irradiance=moonlight(sun.irradiance, distance, phase, self.bands),
            angular_radius=float(np.arcsin(MOON_RADIUS / distance)),
        )
        return replace(seen, irradiance=seen.irradiance * self._past_earth(point, seen))

    def direct_light(self, point: Array) -> DirectLight:
        """The direct light on a spacecraft at a point: the Sun, attenuated by Earth, atmosphere and
        Moon, or the Moon if it gives more light, as in the Earth's shadow.

        point : (3,) in GCRF [m]

        If a lamp is much brighter than the Moon, the Moon remains the lesser light, for which no
        shadows are drawn.
        """
        place = point.tobytes()
        if place not in self._direct:
            self._direct[place] = self._direct_light(point)
        return self._direct[place]

    def _direct_light(self, point: Array) -> DirectLight:
        sun, moon = self.sun.seen_from(point), self.moonlight(point)
        sun = replace(sun, irradiance=sun.irradiance * self.sunlight(point))
        if moon is None:
            return DirectLight(main=sun, lesser=None)
        by_moon, by_lamps = moon.irradiance.sum(), self._lamplight(point).sum()
        if by_moon > sun.irradiance.sum() and by_moon > _DROWNED * by_lamps:
            return DirectLight(main=moon, lesser=None)
        return DirectLight(main=sun, lesser=moon)

    def _lamplight(self, point: Array) -> Array:
        """(4,) irradiance by all lamps of what faces them at a point (3,) [W m-2]."""
        light = np.zeros(4)
        for one in self.lamps:
            offset = point - one.position
            distance = max(norm(offset), one.lamp.radius)
            angle = angle_between(offset, one.direction)
            profile = beam_profile(np.array(angle), one.lamp.half_angle, one.lamp.edge)
            light += one.lamp.intensity * profile / distance**2
        return light

    def _past_earth(self, point: Array, disc: SunSeen) -> Array:
        """(4,) share of a disc's light that reaches a point (3,) [m] past Earth and air."""
        if self.earth is None:
            return np.ones(4)
        position = self.earth.R_itrf_from_icrf @ (point - self.earth.position)
        direction = self.earth.R_itrf_from_icrf @ disc.direction_icrf
        radii, air = np.array(self.earth.earth.radii), self.earth.earth.air
        if air is None:
            return sunlit_shares(position, direction, disc.angular_radius, radii, disc.limb)
        return sunlit_transmission(position, direction, disc.angular_radius, radii, air, disc.limb)
