"""Earth and sky before one pinhole, float32 in its axes: behind an image, or on a face of a sky.

A pinhole's axes: z boresight, x along columns, y along rows.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from functools import cache
from operator import attrgetter
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np

from simgl.arrays import Array, Array32
from simgl.environment_map import DOWN, FORWARD, RIGHT
from simgl.errors import ConfigError
from simgl.lru_cache import HashedOnce
from simgl.physics.air_profile import AIR_TOP
from simgl.physics.frames import norm
from simgl.physics.lunar_model import moonlight
from simgl.physics.spectrum import Bands
from simgl.scene.earth import Earth
from simgl.scene.frost import year_share
from simgl.scene.star_catalogue import StarSky
from simgl.scene.state import BodyState, CameraState, EarthState, SceneState, SunSeen
from simgl.view.celestial import CelestialView, EarthCone, ImageCone, celestial

# Texels along an edge of a sky's faces: under a high Sun and in the dark; where the terminator may
# be all that is lit; where it lies along the limb or the Earth is far away, of tiles that hold
# nearly all light, while the others have those of the dark. At the terminator, what the Sun's disc
# sends past it onto a plate that looks away, 3e-7 of full daylight, comes out within 5 %; the light
# of a Lambertian Earth along the limb within 1 % or 0.0015 W m-2.
SKY_TEXELS, TERMINATOR_TEXELS, LIMB_TEXELS = 64, 128, 256
# From the horizontal, of a Sun that is high, and, past the limb, of one that leaves even high air
# dark [rad].
_HIGH_SUN, _TWILIGHT = np.radians(5.0), np.radians(10.0)
# Little but the limb is lit where the terminator is seen so close to it [rad].
_NARROW_STRIP = np.radians(5.8)
# Of the Earth, where it is so far away that it spans few texels [rad]: from 18,000 km on.
_SMALL_EARTH = np.radians(15.0)
# Spacecraft see the same sky where the ground lies in directions this close [rad].
_SAME_SKY = 1e-4


@dataclass(frozen=True, kw_only=True, eq=False)
class Moonlight:
    """The Moon as a light.

    direction_itrf : (3,) float32 unit, from the Earth's centre
    irradiance : (4,) float32 at the Earth [W m-2]
    """

    direction_itrf: Array32
    irradiance: Array32


@dataclass(frozen=True, kw_only=True, eq=False)
class PlanetView:
    """The Earth before a pinhole, in a space where it is the unit sphere.

    sphere_from_camera : (3, 3) float32, turns and stretches directions
    camera_in_sphere : (3,) float32, place of the pinhole
    outside : |camera|^2 - 1, taken in float64
    sun_direction_itrf : (3,) float32
    sun_irradiance : (4,) float32 at the Earth [W m-2]
    moonlight : None where the Moon lights nothing
    moonlit : whether the Moon is in the Sun's place
    year_share : share of the year that is over, for ice and snow
    """

    earth: Earth
    sphere_from_camera: Array32
    camera_in_sphere: Array32
    outside: float
    sun_direction_itrf: Array32
    sun_irradiance: Array32
    moonlight: Moonlight | None = None
    moonlit: bool = False
    year_share: float = 0.0

    @property
    def height(self) -> float:
        """Of the pinhole, as on the sphere of the equator's radius [m]."""
        share = self.outside / (1.0 + float(np.sqrt(1.0 + self.outside)))
        return self.earth.equatorial_radius * share

    def in_moonlight(self, moon: Moonlight) -> PlanetView:
        """The same with the Moon in the Sun's place, and no light of the Earth's own."""
        return replace(
            self,
            sun_direction_itrf=moon.direction_itrf,
            sun_irradiance=moon.irradiance,
            moonlit=True,
            earth=replace(self.earth, airglow=False, aurora_kp=None),
        )


@dataclass(frozen=True, kw_only=True, eq=False)
class Background:
    """Everything behind the spacecraft, for one pinhole.

    intrinsics : (3, 3) float32 [pixels]
    sun_angular_radius : [rad]
    planet : None where there is no Earth, or none in the field of view
    celestial : None where nothing beyond the Earth is drawn
    """

    intrinsics: Array32
    sun_angular_radius: float
    planet: PlanetView | None
    celestial: CelestialView | None


@dataclass(frozen=True, kw_only=True, eq=False)
class MoonInSky:
    """The Moon as a point of a sky.

    direction : (3,) float32 unit, in the sky's axes
    irradiance : (4,) float32 past the Earth [W m-2]
    """

    direction: Array32
    irradiance: Array32


@dataclass(frozen=True, kw_only=True, eq=False)
class SkyView:
    """What a spacecraft sees around it; one that is close to another shares its sky.

    faces : six pinholes at the spacecraft whose sky it is, in its body axes; in the order of
        ``simgl.environment_map``
    texels : along an edge of each, where it is drawn finest
    R_sky_from_body : (3, 3) to those axes from the body axes of the spacecraft that sees it
    moon : None where the Moon gives no light, or is the main light and so no part of the sky
    key : equal keys mean equal faces and Moons: what these are made of
    """

    faces: tuple[Background, ...]
    texels: int
    R_sky_from_body: Array
    moon: MoonInSky | None
    key: HashedOnce

    def with_edge(self, texels: int) -> tuple[Background, ...]:
        """The faces with so many texels along an edge."""
        if texels == self.texels:
            return self.faces
        intrinsics = _float32(_of_face(0.5 * texels))
        return tuple(replace(face, intrinsics=intrinsics) for face in self.faces)


# Of each state that is in use, by the spacecraft: all cameras and all that share a sky ask for it.
_skies = WeakKeyDictionary[SceneState, dict[BodyState, SkyView]]()
# Likewise: how the Moon lights the Earth.
_moons = WeakKeyDictionary[SceneState, Moonlight | None]()


def background(state: SceneState, camera: CameraState) -> Background:
    """What a camera sees behind the spacecraft.

    Raises ConfigError where the camera is inside the Earth.
    """
    optics, R = camera.camera, camera.R_camera_from_icrf
    cone = ImageCone(optics.half_diagonal_angle, 1.0 / optics.focal_length_px)
    seen = state.sun.seen_from(camera.position)
    earth = hidden = None
    if state.earth is not None:
        earth = _earth_from(state, state.earth, camera.position, f"[camera.{optics.name}]")
        hidden = EarthCone(direction_icrf=earth.direction_icrf, angular_radius=earth.within)
        earth = replace(earth, view=replace(earth.view, moonlight=_moonlight(state, state.earth)))
    # Stars and Moon are no light of the thermal infrared.
    beyond = celestial(state, camera, cone, hidden) if optics.thermal is None else None
    return _background(_float32(optics.intrinsics), R, cone, seen, earth, beyond)


def sky_view(state: SceneState, name: str, body: BodyState) -> SkyView | None:
    """What a spacecraft sees around it: the Earth, stars, and the Moon unless it is the main
    light; None where there is no Earth.

    Raises ConfigError where the spacecraft is inside the Earth.
    """
    if state.earth is None:
        return None
    earth = _earth_from(state, state.earth, body.pose.position, f"[spacecraft.{name}]")
    owner = _first_within(state, body, _SAME_SKY * earth.view.height)
    of_state = _skies.setdefault(state, {})
    if owner not in of_state:
        if owner is not body:
            earth = _earth_from(state, state.earth, owner.pose.position, f"[spacecraft.{name}]")
        of_state[owner] = _sky_around(state, state.earth, earth, owner)
    if owner is body:
        return of_state[owner]
    R_sky_from_body = owner.pose.R_icrf_from_body.T @ body.pose.R_icrf_from_body
    return replace(of_state[owner], R_sky_from_body=R_sky_from_body)


def _sky_around(
    state: SceneState, about: EarthState, earth: _EarthFrom, owner: BodyState
) -> SkyView:
    """What a spacecraft sees that looks along its own axes; earth : from its place."""
    R_body_from_icrf = owner.pose.R_icrf_from_body.T
    seen = state.sun.seen_from(owner.pose.position)
    texels = _sky_texels(earth.view)
    moonlit = replace(earth.view, moonlight=_moonlight(state, about))
    earth = replace(earth, view=moonlit)

    half = 0.5 * texels
    intrinsics = _float32(_of_face(half))
    cone = ImageCone(float(np.arctan(np.sqrt(2.0))), 1.0 / half)
    stars = None if state.stars is None else _even_sky(half, state.stars, state.bands)
    axes = np.stack([RIGHT, DOWN, FORWARD], axis=1)
    faces = tuple(
        _background(intrinsics, one @ R_body_from_icrf, cone, seen, earth, stars) for one in axes
    )
    moon = _moon_in_sky(state, owner)
    turned = earth.sphere_from_icrf.tobytes(), R_body_from_icrf.tobytes()
    shared = replace(faces[0], planet=earth.view)
    return SkyView(
        faces=faces,
        texels=texels,
        R_sky_from_body=np.eye(3),
        moon=moon,
        key=HashedOnce((texels, *turned, *_key(shared), *(_key(moon) if moon else ()))),
    )


def _of_face(half: float) -> Array:
    """(3, 3) intrinsics of a face that is twice ``half`` texels wide."""
    return np.array([[half, 0.0, half], [0.0, half, half], [0.0, 0.0, 1.0]])


def _even_sky(half: float, stars: StarSky, bands: Bands) -> CelestialView:
    """Stars and zodiacal light before a face of a sky that is twice ``half`` texels wide."""
    red, green, blue, near_infrared = stars.mean_radiance(bands).tolist()
    return CelestialView(
        focal_length=half,
        principal_point=(half, half),
        stars=None,
        sun=None,
        moon=None,
        radiance=(red, green, blue, near_infrared),
    )


def _moon_in_sky(state: SceneState, body: BodyState) -> MoonInSky | None:
    moon = state.direct_light(body.pose.position).lesser
    if moon is None or not moon.irradiance.any():
        return None
    return MoonInSky(
        direction=_float32(body.pose.R_icrf_from_body.T @ moon.direction_icrf),
        irradiance=_float32(moon.irradiance),
    )


def _first_within(state: SceneState, body: BodyState, reach: float) -> BodyState:
    """The first body of the scene that is no farther from another one [m], or that one."""
    place = body.pose.position
    return next(
        other
        for other in state.bodies.values()
        if other is body or norm(other.pose.position - place) < reach
    )


def _sky_texels(planet: PlanetView) -> int:
    """Along an edge of a sky's finest faces, by what the Sun lights of the Earth seen there."""
    place = planet.camera_in_sphere.astype(np.float64)
    distance = norm(place)
    sine = float(np.dot(place, planet.sun_direction_itrf)) / distance
    height = float(np.arcsin(np.clip(sine, -1.0, 1.0)))
    radius = float(np.arcsin(min(1.0 / distance, 1.0)))
    if radius < _SMALL_EARTH:
        return LIMB_TEXELS
    seen = 0.5 * np.pi - radius
    if not -seen - _TWILIGHT < height < _HIGH_SUN:
        return SKY_TEXELS
    # Angles from the nadir.
    terminator = float(np.arctan2(-np.sin(height), distance - np.cos(height)))
    strip = radius - terminator
    return TERMINATOR_TEXELS if strip > _NARROW_STRIP else LIMB_TEXELS


@dataclass(frozen=True, kw_only=True, eq=False)
class _EarthFrom:
    """The Earth from one place, and a view along ICRF.

    angular_radius, within : of circles around all of it, and inside its limb [rad]
    """

    direction_icrf: Array
    angular_radius: float
    within: float
    sphere_from_icrf: Array
    view: PlanetView


def _earth_from(state: SceneState, earth: EarthState, place: Array, who: str) -> _EarthFrom:
    radii = np.array(earth.earth.radii)
    position = earth.R_itrf_from_icrf @ (place - earth.position)
    in_sphere = position / radii
    outside = float(np.dot(in_sphere, in_sphere)) - 1.0
    if outside <= 0.0:
        depth = -0.5 * outside * radii[0]
        raise ConfigError(who, "position", f"is {depth:.0f} m below the Earth's surface")
    distance = norm(position)
    sphere_from_icrf = (radii[0] / radii)[:, None] * earth.R_itrf_from_icrf
    sun = state.sun.seen_from(earth.position)
    return _EarthFrom(
        direction_icrf=(earth.position - place) / distance,
        angular_radius=_limb_angle(earth.earth, distance),
        within=float(np.arcsin(min(float(radii.min()) / distance, 1.0))),
        sphere_from_icrf=sphere_from_icrf,
        view=PlanetView(
            earth=earth.earth,
            sphere_from_camera=_float32(sphere_from_icrf),
            camera_in_sphere=_float32(in_sphere),
            outside=outside,
            sun_direction_itrf=_float32(earth.R_itrf_from_icrf @ sun.direction_icrf),
            sun_irradiance=_float32(sun.irradiance),
            year_share=year_share(state.tai_ns) if earth.earth.frost else 0.0,
        ),
    )


def _moonlight(state: SceneState, earth: EarthState) -> Moonlight | None:
    if state not in _moons:
        _moons[state] = _moonlight_at(state, earth)
    return _moons[state]


def _moonlight_at(state: SceneState, earth: EarthState) -> Moonlight | None:
    if state.moon is None or not earth.earth.moonlight:
        return None
    towards = state.moon - earth.position
    distance = norm(towards)
    sun = state.sun.seen_from(state.moon)
    cosine = float(-towards @ sun.direction_icrf) / distance
    phase = float(np.arccos(np.clip(cosine, -1.0, 1.0)))
    return Moonlight(
        direction_itrf=_float32(earth.R_itrf_from_icrf @ towards / distance),
        irradiance=_float32(moonlight(sun.irradiance, distance, phase, state.bands)),
    )


def _limb_angle(earth: Earth, distance: float) -> float:
    """Largest angle from nadir at which Earth, air or clouds are seen [rad]; pi within them."""
    clouds = 0.0 if earth.clouds is None else earth.clouds.height
    highest = max(earth.radii) + max(clouds, 0.0 if earth.air is None else AIR_TOP)
    if distance <= highest:
        return np.pi
    return float(np.arcsin(min(highest / distance, 1.0)))


def _background(
    intrinsics: Array32,
    R_camera_from_icrf: Array,
    cone: ImageCone,
    sun: SunSeen,
    earth: _EarthFrom | None,
    beyond: CelestialView | None,
) -> Background:
    planet = None
    boresight = R_camera_from_icrf[2]
    if earth is not None and cone.holds(boresight, earth.direction_icrf, earth.angular_radius):
        turned = _float32(earth.sphere_from_icrf @ R_camera_from_icrf.T)
        planet = replace(earth.view, sphere_from_camera=turned)
    return Background(
        intrinsics=intrinsics,
        sun_angular_radius=sun.angular_radius,
        planet=planet,
        celestial=beyond,
    )


@cache
def _values_of(kind: type) -> Callable[[Any], tuple[Any, ...]]:
    """Reads all fields of a class of views, of which each has several."""
    return attrgetter(*(field.name for field in fields(kind)))


def _key(part: Any) -> tuple[object, ...]:
    """Every value of a view, in a form that can be compared."""
    key: list[object] = []
    for value in _values_of(part.__class__)(part):
        if isinstance(value, np.ndarray):
            key.append(value.tobytes())
        elif isinstance(value, PlanetView | CelestialView | Moonlight):
            key.extend(_key(value))
        else:
            key.append(value)
    return tuple(key)


def _float32(values: Array) -> Array32:
    return np.asarray(values, dtype=np.float32)
