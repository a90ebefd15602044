"""What lies beyond the Earth before one pinhole: stars, the Sun's disc, the Moon.

Directions are float64 until they are pixels. A disc on the sky is a cone; a pinhole shows it as an
ellipse, exactly.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from simgl.arrays import Array, Array32, IndexArray, Mask
from simgl.physics.constants import MOON_RADIUS
from simgl.physics.frames import angle_between, norm
from simgl.physics.lunar_model import earthlight, lommel_seeliger_share, surface_factor
from simgl.physics.spectrum import PerBand
from simgl.physics.starlight import aberrated, directions
from simgl.physics.zodiacal_light import faint_starlight, zodiacal_radiance
from simgl.scene.state import CameraState, EarthState, SceneState, SunSeen
from simgl.view.bent_sight import LIFT, BentSight, SeenDisc

# A star's light reaches so far from its place [pixels].
STAR_REACH = 1.5
# Between nodes of the diffuse sky [rad], and at most so many steps along an edge: the interpolation
# errs by 1 % from 15 deg off the Sun.
_DIFFUSE_STEP, _MAX_STEPS = np.radians(1.5), 96
# Light's aberration at 30 + 8 km/s, parallax and a century of the fastest proper motion, and what
# the air lifts them [rad].
_STARS_MOVE = 3e-2


@dataclass(frozen=True)
class ImageCone:
    """The cone around an image: its half angle, and the angle of a pixel [rad]."""

    half_diagonal: float
    pixel: float

    def holds(self, boresight: Array, direction: Array, angular_radius: float) -> bool:
        """Whether a disc on the sky may touch the image."""
        # Nearly a pixel more than enough: a disc's edge is drawn over one.
        reach = self.half_diagonal + angular_radius + self.pixel
        return angle_between(boresight, direction) < reach


@dataclass(frozen=True, kw_only=True, eq=False)
class Ellipse:
    """A disc on the sky as the pinhole shows it.

    centre : (2,) float64 [pixels]
    form : (2, 2) float64 [pixels^-2]; offsets d from the centre with d . form . d <= 1 lie on it
    box : x, y, width, height of the pixels that it can touch
    """

    centre: Array
    form: Array
    box: tuple[int, int, int, int]

    @property
    def radius(self) -> float:
        """Of the circle with the same area [pixels]."""
        return float(np.linalg.det(self.form) ** -0.25)


@dataclass(frozen=True, kw_only=True, eq=False)
class SunDisc:
    """The Sun's disc.

    radiance : (4,) mean over it [W m-2 sr-1]
    limb : (2, 4) darkening u and v per band: 1 - u (1 - mu) - v (1 - mu)^2
    """

    ellipse: Ellipse
    radiance: Array32
    limb: Array32


@dataclass(frozen=True, kw_only=True, eq=False)
class MoonDisc:
    """The Moon.

    disc_from_pixel : (2, 2) float64; turns offsets from the centre into units of the radius, along
        two axes square to the line of sight
    sun : (3,) unit, along these axes and towards the camera
    lommel_seeliger : share of mu0 / (mu0 + mu) in the disc function, the rest is mu0 / 2
    radiance : (4,) where the disc function is 1 [W m-2 sr-1]
    earthshine : (4,) of the face that the Earth lights [W m-2 sr-1]
    moon_from_disc : (3, 3) from these three axes to the Moon's own; None for a Moon without seas
    """

    ellipse: Ellipse
    disc_from_pixel: Array
    sun: Array32
    lommel_seeliger: float
    radiance: Array32
    earthshine: Array32
    moon_from_disc: Array32 | None


@dataclass(frozen=True, kw_only=True, eq=False)
class StarPoints:
    """Stars in view.

    pixels : (n, 2) float32
    irradiance : (n, 4) float32, facing the star [W m-2]
    widths : (n, 2) float32, full width at half height of the triangle that blurs the star, along
        columns and rows [pixels]
    """

    pixels: Array32
    irradiance: Array32
    widths: Array32


@dataclass(frozen=True, kw_only=True, eq=False)
class DiffuseSky:
    """Light between the stars at the nodes of a regular grid, the first in the image's corner.

    columns, rows : of nodes
    radiance : (rows * columns, 4) float32, row by row [W m-2 sr-1]
    """

    columns: int
    rows: int
    radiance: Array32


@dataclass(frozen=True, kw_only=True, eq=False)
class CelestialView:
    """Everything beyond the Earth that an image may show; None where it shows none of a kind.

    focal_length, principal_point : of the pinhole [pixels]
    radiance : (4,) of all directions, for a sky whose stars are not drawn one by one [W m-2 sr-1]
    """

    focal_length: float
    principal_point: tuple[float, float]
    stars: StarPoints | None
    sun: SunDisc | None
    moon: MoonDisc | None
    diffuse: DiffuseSky | None = None
    radiance: PerBand = (0.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True, kw_only=True, eq=False)
class EarthCone:
    """What the Earth hides for sure: a cone about its centre, from one place."""

    direction_icrf: Array
    angular_radius: float


@dataclass(frozen=True, kw_only=True, eq=False)
class StarPlaces:
    """Catalogue stars and planets within an image, the stars first, in the catalogue's order.

    rows : (n,) in the catalogue; from its length on, in the sky's planets
    direction_icrf : (n, 3) unit, as the moving camera sees them, through the air where it is
    pixels : (n, 2) float64
    irradiance : (n, 4) without the air [W m-2]
    share : (n,) of their light that is left where the air spreads it
    """

    rows: IndexArray
    direction_icrf: Array
    pixels: Array
    irradiance: Array
    share: Array


def celestial(
    state: SceneState, camera: CameraState, cone: ImageCone, earth: EarthCone | None
) -> CelestialView | None:
    """What a camera sees beyond the Earth; None where that is nothing."""
    hidden = _Hidden(earth, cone.pixel)
    if hidden.image(camera, cone):
        return None
    points = _star_points(state, camera, hidden)
    sun = _sun_disc(state, camera, cone, hidden)
    moon = _moon_disc(state, camera, cone, hidden)
    diffuse = _diffuse_sky(state, camera, hidden)
    if points is None and sun is None and moon is None and diffuse is None:
        return None
    k = camera.camera.intrinsics
    return CelestialView(
        focal_length=float(k[0, 0]),
        principal_point=(float(k[0, 2]), float(k[1, 2])),
        stars=points,
        sun=sun,
        moon=moon,
        diffuse=diffuse,
    )


def star_places(state: SceneState, camera: CameraState) -> StarPlaces | None:
    """Stars and planets within an image, or just outside, where the lens shows them; None where the
    scene has no stars."""
    if state.stars is None:
        return None
    sky, catalogue = state.stars, state.stars.catalogue
    optics, R = camera.camera, camera.R_camera_from_icrf
    d = optics.detector
    reach = optics.half_diagonal_angle + _STARS_MOVE + 2.0 * STAR_REACH / optics.focal_length_px
    rows = catalogue.around(R[2], min(reach, np.pi))
    centre = np.zeros(3) if state.earth is None else state.earth.position
    still = directions(
        catalogue.direction[rows],
        catalogue.motion[rows],
        catalogue.parallax[rows],
        sky.years,
        sky.earth_position + camera.position - centre,
    )
    light = catalogue.irradiance[rows]
    if sky.planets:
        offsets = np.stack([p.position for p in sky.planets]) - (camera.position - centre)
        still = np.concatenate([still, offsets / np.linalg.norm(offsets, axis=1)[:, None]])
        light = np.concatenate([light, np.stack([p.irradiance for p in sky.planets])])
        rows = np.concatenate([rows, len(catalogue.hip) + np.arange(len(sky.planets))])
    seen = aberrated(still, sky.earth_velocity + camera.velocity)
    bent, share = BentSight.at(state, camera.position), np.ones(len(rows))
    if bent is not None:
        seen, share = bent.points(seen)
    in_camera = seen @ R.T
    pixels = optics.project(in_camera)  # NaN where the lens sees nothing
    size = np.array([d.width, d.height])
    inside = np.all((pixels > -STAR_REACH) & (pixels < size + STAR_REACH), axis=1)
    return StarPlaces(
        rows=rows[inside],
        direction_icrf=seen[inside],
        pixels=pixels[inside],
        irradiance=light[inside],
        share=share[inside],
    )


@dataclass(frozen=True)
class _Hidden:
    """Tells what lies wholly behind the Earth, two pixels and more from its limb."""

    earth: EarthCone | None
    pixel: float

    def image(self, camera: CameraState, cone: ImageCone) -> bool:
        """Whether that is all that an image, or a star just outside, may show."""
        if self.earth is None:
            return False
        away = angle_between(self.earth.direction_icrf, camera.R_camera_from_icrf[2])
        reach = cone.half_diagonal + (2.0 + 2.0 * STAR_REACH) * self.pixel
        return away + reach < self.earth.angular_radius

    def disc(self, disc: SeenDisc) -> bool:
        if self.earth is None:
            return False
        away = angle_between(self.earth.direction_icrf, disc.direction)
        return away + float(disc.half_angles.max()) + 2.0 * self.pixel < self.earth.angular_radius

    def points(self, direction: Array) -> Mask:
        if self.earth is None:
            return np.zeros(len(direction), dtype=bool)
        inner = max(self.earth.angular_radius - 2.0 * self.pixel, 0.0)
        return direction @ self.earth.direction_icrf > np.cos(inner)


def _star_points(state: SceneState, camera: CameraState, hidden: _Hidden) -> StarPoints | None:
    places = star_places(state, camera)
    if places is None:
        return None
    seen = ~hidden.points(places.direction_icrf)
    if not seen.any():
        return None
    return StarPoints(
        pixels=_float32(places.pixels[seen]),
        irradiance=_float32(places.irradiance[seen] * places.share[seen, None]),
        widths=np.ones((int(seen.sum()), 2), dtype=np.float32),
    )


def _diffuse_sky(state: SceneState, camera: CameraState, hidden: _Hidden) -> DiffuseSky | None:
    if state.stars is None or not state.stars.diffuse:
        return None
    d = camera.camera.detector
    rays, (columns, rows) = _nodes(camera.camera.intrinsics.tobytes(), (d.width, d.height))
    seen = rays @ camera.R_camera_from_icrf
    if hidden.points(seen).all():
        return None
    sun = state.sun.seen_from(camera.position).direction_icrf
    bands = state.bands
    light = zodiacal_radiance(seen, sun, bands) + faint_starlight(seen, bands)
    return DiffuseSky(columns=columns, rows=rows, radiance=_float32(light))


@lru_cache(maxsize=16)
def _nodes(intrinsics: bytes, size: tuple[int, int]) -> tuple[Array, tuple[int, int]]:
    """(n, 3) unit rays to the nodes of the diffuse sky of an image, camera axes; its columns and
    rows."""
    k = np.frombuffer(intrinsics).reshape(3, 3)
    columns, rows = (
        int(np.clip(np.ceil(side / k[0, 0] / _DIFFUSE_STEP), 2, _MAX_STEPS)) + 1 for side in size
    )
    x, y = np.meshgrid(np.linspace(0, size[0], columns), np.linspace(0, size[1], rows))
    rays = np.stack([x.ravel() - k[0, 2], y.ravel() - k[1, 2], np.full(x.size, k[0, 0])], axis=1)
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    rays.flags.writeable = False
    return rays, (columns, rows)


def _sun_disc(
    state: SceneState, camera: CameraState, cone: ImageCone, hidden: _Hidden
) -> SunDisc | None:
    seen: SunSeen = state.sun.seen_from(camera.position)
    if not state.sun.visible:
        return None
    disc = _seen_disc(state, camera, cone, seen.direction_icrf, seen.angular_radius)
    if disc is None or hidden.disc(disc):
        return None
    ellipse = _ellipse(camera, cone, disc)
    if ellipse is None or not seen.irradiance.any():
        return None
    return SunDisc(ellipse=ellipse, radiance=_float32(seen.radiance), limb=_float32(seen.limb))


def _moon_disc(
    state: SceneState, camera: CameraState, cone: ImageCone, hidden: _Hidden
) -> MoonDisc | None:
    if state.moon is None:
        return None
    offset = state.moon - camera.position
    distance = norm(offset)
    towards, radius = offset / distance, float(np.arcsin(min(MOON_RADIUS / distance, 1.0)))
    disc = _seen_disc(state, camera, cone, towards, radius)
    if disc is None or hidden.disc(disc):
        return None
    ellipse = _ellipse(camera, cone, disc)
    if ellipse is None:
        return None
    sun = state.sun.seen_from(state.moon)
    phase = angle_between(sun.direction_icrf, -towards)
    axes, disc_from_pixel = _disc_axes(camera, ellipse, towards)
    disc_from_icrf = np.stack([*axes, -towards])
    turned = None
    if state.R_moon_from_icrf is not None:
        turned = _float32(state.R_moon_from_icrf @ disc_from_icrf.T)
    return MoonDisc(
        ellipse=ellipse,
        disc_from_pixel=disc_from_pixel,
        sun=_float32(disc_from_icrf @ sun.direction_icrf),
        lommel_seeliger=lommel_seeliger_share(phase),
        radiance=_float32(sun.irradiance * surface_factor(phase, state.bands)),
        earthshine=_float32(_earthshine(state, state.earth)),
        moon_from_disc=turned,
    )


def _earthshine(state: SceneState, earth: EarthState | None) -> Array:
    """(4,) radiance of the Moon by the Earth's light, as seen from near the Earth [W m-2 sr-1]."""
    if earth is None or state.moon is None:
        return np.zeros(4)
    to_moon = state.moon - earth.position
    sun = state.sun.seen_from(earth.position)
    phase = angle_between(sun.direction_icrf, to_moon)
    light = earthlight(sun.irradiance, norm(to_moon), phase, state.bands)
    # At full phase the disc function is 1/2 all over.
    return 0.5 * surface_factor(0.0, state.bands) * light


def _seen_disc(
    state: SceneState,
    camera: CameraState,
    cone: ImageCone,
    direction: Array,
    angular_radius: float,
) -> SeenDisc | None:
    """A round disc past the Earth's air; None where it is out of view."""
    if not cone.holds(camera.R_camera_from_icrf[2], direction, angular_radius + LIFT):
        return None
    bent = BentSight.at(state, camera.position)
    if bent is None:
        return SeenDisc.round(direction, angular_radius)
    return bent.disc(direction, angular_radius)


def _ellipse(camera: CameraState, cone: ImageCone, disc: SeenDisc) -> Ellipse | None:
    """A disc's ellipse; None where it is out of view, or reaches 90 deg from the boresight."""
    R, k = camera.R_camera_from_icrf, camera.camera.intrinsics
    widest = float(disc.half_angles.max())
    if not cone.holds(R[2], disc.direction, widest):
        return None
    if angle_between(R[2], disc.direction) + widest > np.radians(89.9):
        return None
    # Rays r to the disc, s its middle, e its axes: (s.r)^2 >= sum (e.r)^2 / tan^2 of its half
    # angles; with r linear in homogeneous pixels, a conic.
    s, axes = R @ disc.direction, disc.axes @ R.T / np.tan(disc.half_angles)[:, None]
    form_of_rays = np.outer(s, s) - axes.T @ axes
    camera_from_pixel = np.linalg.inv(k)
    conic = camera_from_pixel.T @ form_of_rays @ camera_from_pixel
    centre = -np.linalg.solve(conic[:2, :2], conic[:2, 2])
    form = -conic[:2, :2] / (conic[2, 2] + np.dot(conic[:2, 2], centre))
    half = np.sqrt(np.diag(np.linalg.inv(form)))
    touched = camera.camera.detector.pixels_within(centre - half, centre + half)
    if touched is None:
        return None
    x0, y0, x1, y1 = touched
    return Ellipse(centre=centre, form=form, box=(x0, y0, x1 - x0, y1 - y0))


def _disc_axes(camera: CameraState, ellipse: Ellipse, towards: Array) -> tuple[Array, Array]:
    """Two axes (2, 3) in ICRF square to a line of sight, and the ellipse's (2, 2) map onto them.

    Of all maps that take the ellipse to the unit circle, the one nearest to the pinhole's own.
    """
    R, f = camera.R_camera_from_icrf, camera.camera.focal_length_px
    right = R[0] - np.dot(R[0], towards) * towards
    right /= norm(right)
    axes = np.stack([right, np.cross(towards, right)])
    in_camera = axes @ R.T
    s = R @ towards
    # Of a ray's slope x / z in a step along the axes; a pixel is 1 / f of it.
    slopes = (in_camera[:, :2].T - np.outer(s[:2], in_camera[:, 2]) / s[2]) / s[2] * f
    values, vectors = np.linalg.eigh(ellipse.form)
    root = vectors @ np.diag(np.sqrt(values)) @ vectors.T
    u, _, v = np.linalg.svd(np.linalg.inv(slopes) @ np.linalg.inv(root))
    return axes, u @ v @ root


def _float32(values: Array) -> Array32:
    return np.asarray(values, dtype=np.float32)
