"""Earth and Sun: the background of the picture, one full-screen draw."""

from __future__ import annotations

import moderngl
import numpy as np

from simgl.gpu.blocks import Block
from simgl.gpu.context import is_software
from simgl.gpu.fullscreen import FullscreenProgram
from simgl.gpu.state import State
from simgl.passes.earth_maps import HEIGHT
from simgl.passes.earth_textures import SAMPLERS, EarthTextures
from simgl.passes.weather import THICKEST
from simgl.physics.sea import water_body, wave_slope_variance
from simgl.view.background import Background, PlanetView

_PLANET = Block(
    "Planet",
    4,
    np.dtype(
        [
            ("sphere_from_camera", "f4", (4, 4)),
            ("camera_in_sphere", "f4", 4),
            # Equatorial radius over each semi-axis: turns a sphere's point into the normal.
            ("sphere_axes", "f4", 4),
            ("sun_direction", "f4", 4),
            ("sun_direction_itrf", "f4", 4),
            ("sun_radiance", "f4", 4),
            ("sun_limb_u", "f4", 4),
            ("sun_limb_v", "f4", 4),
            ("earth_sun_irradiance", "f4", 4),
            ("earth_albedo", "f4", 4),
            # Of the water without its surface's mirror.
            ("water_body", "f4", 4),
            # Of the brightest lamps [W m-2 sr-1].
            ("night_radiance", "f4", 4),
            # fx, fy, cx, cy [pixels]
            ("intrinsics", "f4", 4),
            ("outside", "f4"),
            ("sun_angular_radius", "f4"),
            ("has_earth", "f4"),
            ("planet_km", "f4"),
            ("cloud_km", "f4"),
            ("high_cloud_thickness", "f4"),
            ("wave_slope_variance", "f4"),
            ("_padding", "f4"),
        ]
    ),
)


# The maps' texels are so many radians long; a picture whose pixels are shorter by this factor where
# it looks straight down needs no mipmaps, which cost software renderers more than all the rest.
_TEXEL = np.pi / HEIGHT
_MAGNIFIED = 0.25
# Brightest texel of the night map, all bands together [W m-2 sr-1]: 200 nW cm-2 sr-1, the core of
# a city of millions in VIIRS's day-night band (Elvidge et al. 2017), over 10 km; and its share in
# each band, between sodium lamps and white ones.
_NIGHT_RADIANCE = 2e-3 * np.array([0.40, 0.32, 0.06, 0.22])
# Optical thickness of the thickest of the thin high clouds.
_HIGH_CLOUD = 1.5


class PlanetPass:
    """Draws the Earth as an exact ellipsoid, and the Sun's disc, behind everything."""

    state = State()

    def __init__(self, ctx: moderngl.Context) -> None:
        self._ctx = ctx
        thickness = {"LOG_THICKEST": float(np.log(THICKEST))}
        # Software renderers pay for what a shader could do: an Earth of one albedo has its own.
        self._plain = FullscreenProgram(ctx, "planet/planet", _PLANET, [], thickness)
        self._mapped = FullscreenProgram(
            ctx, "planet/planet", _PLANET, SAMPLERS, thickness | {"EARTH_MAPS": 1}
        )
        self._textures = EarthTextures(ctx)
        self._hardware = not is_software(ctx)

    def draw(
        self, background: Background, target: moderngl.Framebuffer, area: tuple[int, int, int, int]
    ) -> None:
        """Fill a rectangle with what lies behind the spacecraft [W m-2 sr-1].

        area : x, y, width, height [pixels]
        """
        planet = background.planet
        mapped = planet is not None and planet.earth.albedo is None
        textures = []
        if planet is not None and mapped:
            textures = self._textures.of(
                planet.earth, mipmaps=not self._magnified(planet, background)
            )
        self.state.apply(self._ctx, target, area, area)
        if planet is None and not background.sun_radiance.any():
            target.clear(0.0, 0.0, 0.0, 0.0, viewport=area)
            return
        program = self._mapped if mapped else self._plain
        program.draw(_values(background, area), textures)

    def _magnified(self, planet: PlanetView, background: Background) -> bool:
        """Whether the maps' texels are larger than pixels wherever they are not seen at a slant."""
        if self._hardware:
            return False
        altitude = float(np.linalg.norm(planet.camera_in_sphere)) - 1.0
        return altitude / float(background.intrinsics[0, 0]) < _MAGNIFIED * _TEXEL

    def release(self) -> None:
        """Free everything."""
        self._plain.release()
        self._mapped.release()
        self._textures.release()


def _values(view: Background, area: tuple[int, int, int, int]) -> dict[str, object]:
    k = view.intrinsics
    values: dict[str, object] = {
        "sun_direction": (*view.sun_direction, 0.0),
        "sun_radiance": view.sun_radiance,
        "sun_limb_u": view.sun_limb[0],
        "sun_limb_v": view.sun_limb[1],
        "sun_angular_radius": view.sun_angular_radius,
        "intrinsics": (k[0, 0], k[1, 1], k[0, 2] + area[0], k[1, 2] + area[1]),
    }
    planet = view.planet
    if planet is None:
        names = [name for name in _PLANET.dtype.names or () if "_padding" not in name]
        empty = {name: 0.0 for name in names if name not in values}
        return values | empty
    matrix = np.zeros((4, 4), dtype=np.float32)
    matrix[:3, :3] = planet.sphere_from_camera
    earth, clouds = planet.earth, planet.earth.clouds
    radii = np.array(earth.radii)
    return values | {
        "sphere_from_camera": matrix,
        "camera_in_sphere": (*planet.camera_in_sphere, 0.0),
        "sphere_axes": (*(radii[0] / radii), 0.0),
        "sun_direction_itrf": (*planet.sun_direction_itrf, 0.0),
        "earth_sun_irradiance": planet.sun_irradiance,
        "earth_albedo": earth.albedo or (0.0, 0.0, 0.0, 0.0),
        "water_body": water_body(earth.wind),
        "night_radiance": _NIGHT_RADIANCE,
        "outside": planet.outside,
        "has_earth": 1.0,
        "planet_km": radii[0] * 1e-3,
        "cloud_km": clouds.height * 1e-3 if clouds else 0.0,
        "high_cloud_thickness": _HIGH_CLOUD if clouds else 0.0,
        "wave_slope_variance": wave_slope_variance(earth.wind),
    }
