"""The Earth: the background of the picture, one full-screen draw."""

from __future__ import annotations

from collections.abc import Sequence

import moderngl
import numpy as np

from simgl.gpu.blocks import Block, UniformBuffer
from simgl.gpu.context import is_software
from simgl.gpu.fullscreen import Texture
from simgl.gpu.state import SRC1_COLOR, State
from simgl.gpu.tiles import TileProgram
from simgl.passes.air import AIR_SAMPLERS, AIR_VIEW, AirPass
from simgl.passes.air_tables import AIR
from simgl.passes.earth_maps import HEIGHT
from simgl.passes.earth_textures import SAMPLERS, EarthTextures
from simgl.physics.constants import WGS84_EQUATORIAL_RADIUS
from simgl.physics.regolith import Regolith, geometric_albedo
from simgl.physics.sea import water_body, wave_slope_variance
from simgl.scene.chart import LEVELS, SIZE, TEXEL_KM
from simgl.view.background import Background, PlanetView
from simgl.view.tiles import BLOCK, TILE, Tiles, tiles_of

PLANET = Block(
    "Planet",
    4,
    np.dtype(
        [
            ("sphere_from_camera", "f4", (4, 4)),
            ("camera_in_sphere", "f4", 4),
            # Equatorial radius over each semi-axis: turns a sphere's point into the normal.
            ("sphere_axes", "f4", 4),
            ("sun_direction_itrf", "f4", 4),
            ("earth_sun_irradiance", "f4", 4),
            ("earth_albedo", "f4", 4),
            # Of the water without its surface's mirror.
            ("water_body", "f4", 4),
            # Of the brightest lamps [W m-2 sr-1].
            ("night_radiance", "f4", 4),
            # fx, fy, cx, cy [pixels]
            ("intrinsics", "f4", 4),
            # Of the picture: its first corner [pixels], and clip space per pixel.
            ("area", "f4", 4),
            # Variance of the noise of clouds and of hills by the chart's halvings.
            ("chart_kept", "f4", (LEVELS, 4)),
            ("outside", "f4"),
            # The same from the sphere that the clouds lie on.
            ("cloud_outside", "f4"),
            ("sun_angular_radius", "f4"),
            ("planet_km", "f4"),
            ("cloud_km", "f4"),
            ("high_cloud_thickness", "f4"),
            ("wave_slope_variance", "f4"),
            # 1 where the camera is above the clouds.
            ("clouds_below", "f4"),
            # Of a texel of the maps on the equator, and of the chart [km].
            ("map_texel_km", "f4"),
            ("chart_texel_km", "f4"),
            # The chart's last halving, and its repetitions between a face's middle and edge.
            ("chart_texels", "f4"),
            ("chart_last", "f4"),
            ("chart_repeats", "f4"),
            ("planet_padding", "f4"),
            ("planet_padding2", "f4", 2),
        ]
    ),
)

REGOLITH = Block(
    "Regolith",
    25,
    np.dtype(
        [
            ("grain_albedo", "f4"),
            ("lobe_width", "f4"),
            ("lobe_backward", "f4"),
            ("surge_height", "f4"),
            ("surge_width", "f4"),
            # Of the slopes' mean angle, and what they leave of the cosine of a level plane.
            ("slope_tangent", "f4"),
            ("slope_chi", "f4"),
            # 2/3, a white Lambertian globe's geometric albedo, over this law's.
            ("regolith_scale", "f4"),
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


# Variants that find light and place at the corners of tiles; the others are cheap or rare.
_EVEN = ("EARTH_MAPS", "AIR"), ("EARTH_MAPS", "FAR", "AIR")
# Pixels larger than this [m] resolve nothing of the chart.
_FAR = 6e3


class PlanetPass:
    """Draws the Earth as an exact ellipsoid, alone or before what lies beyond it."""

    state = State()
    before = State(blend=(moderngl.ONE, SRC1_COLOR))

    def __init__(self, ctx: moderngl.Context, air: AirPass) -> None:
        self._ctx, self._air = ctx, air
        # Software renderers pay for what a shader could do: an Earth of one albedo has its own, and
        # so has one without air.
        self._programs: dict[tuple[str, ...], TileProgram] = {}
        self._block = UniformBuffer(ctx, PLANET)
        self._regolith = UniformBuffer(ctx, REGOLITH)
        self._textures = EarthTextures(ctx)
        self._hardware = not is_software(ctx)

    def draw(
        self, background: Background, target: moderngl.Framebuffer, area: tuple[int, int, int, int]
    ) -> None:
        """Fill a rectangle with the Earth [W m-2 sr-1].

        Where the view has heavens, the target holds them already; they stay as far as they are
        seen past the Earth.

        area : x, y, width, height [pixels]
        """
        planet = background.planet
        mapped = planet is not None and planet.earth.albedo is None
        textures: Sequence[Texture] = ()
        if planet is not None and mapped:
            magnified = self._magnified(planet, background)
            textures = self._textures.of(planet.earth, mipmaps=not magnified)
        air = None if planet is None else self._air.before(planet)
        alone = background.heavens is None
        state = self.state if alone else self.before
        state.apply(self._ctx, target, area, area)
        if planet is not None:
            inside = air is not None and air.inside
            regolith = None if mapped else planet.earth.regolith
            if regolith is not None:
                self._regolith.write(_regolith_values(regolith))
                self._regolith.bind()
            far = mapped and _nadir_pixel(planet, background) > _FAR
            present = {
                "EARTH_MAPS": mapped,
                "REGOLITH": regolith,
                "FAR": far,
                "AIR": air,
                "AIR_INSIDE": inside,
            }
            variant = tuple(d for d, there in present.items() if there)
            through = () if air is None else air.textures
            for unit, texture in enumerate((*textures, *through)):
                texture.use(unit)
            self._block.write(
                _values(background, planet, area) | {"chart_kept": self._textures.chart_kept}
            )
            self._block.bind()
            open_sea = self._textures.open_sea if mapped else None
            tiles = tiles_of(planet, background.intrinsics, area[2:], open_sea)
            if alone:
                target.clear(0.0, 0.0, 0.0, 0.0, viewport=area)
            ground = tiles.ground
            if variant in _EVEN:
                self._draw_even(tiles, variant, textures)
            else:
                ground = ground | tiles.even[:: BLOCK // TILE, :: BLOCK // TILE]
            # One large face costs less than its parts.
            edge = max(area[2:]) if ground.all() else BLOCK
            ground = ground[:1, :1] if ground.all() else ground
            self._program_for("planet/planet", variant).draw(ground, edge)
            if air is not None:
                self._program_for("planet/air", variant).draw(tiles.air, BLOCK)
        elif alone:
            target.clear(0.0, 0.0, 0.0, 0.0, viewport=area)

    def _draw_even(
        self, tiles: Tiles, variant: tuple[str, ...], textures: Sequence[Texture]
    ) -> None:
        """Tiles found at their corners, by the halving of the noise that their pixels show."""
        kinds = {("EVEN",): tiles.even & ~tiles.sea, ("EVEN", "SEA"): tiles.sea}
        level = np.zeros(tiles.even.shape, dtype=np.int64)
        if "FAR" not in variant:
            level = np.rint(np.log2(tiles.pixel / (1e3 * TEXEL_KM))).astype(np.int64)
            level = np.clip(level, 0, LEVELS - 1)
        for each in np.unique(level[tiles.even]).tolist():
            if "FAR" not in variant:
                self._textures.chart_with(each).use(len(SAMPLERS) - 1)
            for kind, mask in kinds.items():
                program = self._program_for("planet/tiles", (*kind, *variant))
                program.draw(mask & (level == each), TILE, sheet=each)
        textures[-1].use(len(SAMPLERS) - 1)

    def _program_for(self, name: str, variant: tuple[str, ...]) -> TileProgram:
        key = name, *variant
        if key not in self._programs:
            ground = SAMPLERS if "EARTH_MAPS" in variant else []
            air = AIR_SAMPLERS if "AIR" in variant else ()
            samplers = {sampler: unit for unit, sampler in enumerate((*ground, *air))}
            unread = ["chart"] if "FAR" in variant else []
            unread += ["land_map", "form_map"] if "SEA" in variant else []
            for sampler in unread:
                samplers.pop(sampler)
            if name == "planet/air":
                samplers = {sampler: samplers[sampler] for sampler in AIR_SAMPLERS[2:]}
            blocks = [AIR, AIR_VIEW]
            self._programs[key] = TileProgram(
                self._ctx,
                name,
                samplers,
                variant,
                shared=[
                    PLANET,
                    *(blocks if "AIR" in variant else ()),
                    *([REGOLITH] if "REGOLITH" in variant else ()),
                ],
                spare=(
                    *(() if "AIR" in variant else blocks),
                    *(() if "REGOLITH" in variant else (REGOLITH,)),
                ),
            )
        return self._programs[key]

    def _magnified(self, planet: PlanetView, background: Background) -> bool:
        """Whether the maps' texels are larger than pixels wherever they are not seen at a slant."""
        if self._hardware:
            return False
        return _nadir_pixel(planet, background) < _MAGNIFIED * _TEXEL * WGS84_EQUATORIAL_RADIUS

    def release(self) -> None:
        """Free everything."""
        for program in self._programs.values():
            program.release()
        self._block.release()
        self._regolith.release()
        self._textures.release()


def _nadir_pixel(planet: PlanetView, background: Background) -> float:
    """Edge of a pixel straight below [m]."""
    return planet.height / float(background.intrinsics[0, 0])


def _regolith_values(ground: Regolith) -> dict[str, object]:
    tangent = np.tan(ground.roughness)
    return {
        "grain_albedo": ground.single_scattering,
        "lobe_width": ground.lobe,
        "lobe_backward": ground.backward,
        "surge_height": ground.surge,
        "surge_width": ground.surge_width,
        "slope_tangent": tangent,
        "slope_chi": 1.0 / np.sqrt(1.0 + np.pi * tangent**2),
        "regolith_scale": 2.0 / 3.0 / geometric_albedo(ground),
    }


def _values(
    view: Background, planet: PlanetView, area: tuple[int, int, int, int]
) -> dict[str, object]:
    k = view.intrinsics
    matrix = np.zeros((4, 4), dtype=np.float32)
    matrix[:3, :3] = planet.sphere_from_camera
    earth, clouds = planet.earth, planet.earth.clouds
    radii = np.array(earth.radii)
    cloud_height = clouds.height / radii[0] if clouds else 0.0
    return {
        "sphere_from_camera": matrix,
        "camera_in_sphere": (*planet.camera_in_sphere, 0.0),
        "sphere_axes": (*(radii[0] / radii), 0.0),
        "sun_direction_itrf": (*planet.sun_direction_itrf, 0.0),
        "earth_sun_irradiance": planet.sun_irradiance,
        "earth_albedo": earth.albedo or (0.0, 0.0, 0.0, 0.0),
        "water_body": water_body(earth.wind),
        "night_radiance": _NIGHT_RADIANCE,
        "outside": planet.outside,
        "cloud_outside": planet.outside - cloud_height * (2.0 + cloud_height),
        "map_texel_km": _TEXEL * radii[0] * 1e-3,
        "chart_texel_km": TEXEL_KM,
        "chart_texels": SIZE,
        "chart_last": LEVELS - 1,
        # In the middle of a face the chart is drawn together to 0.8, at its edges out to 1.0 of
        # this, and most between.
        "chart_repeats": radii[0] * 1e-3 / (1.2 * SIZE * TEXEL_KM),
        "planet_km": radii[0] * 1e-3,
        "cloud_km": clouds.height * 1e-3 if clouds else 0.0,
        "high_cloud_thickness": _HIGH_CLOUD if clouds else 0.0,
        "clouds_below": float(clouds is not None and planet.height > clouds.height),
        "wave_slope_variance": wave_slope_variance(earth.wind),
        "area": (area[0], area[1], 2.0 / area[2], 2.0 / area[3]),
        "intrinsics": (k[0, 0], k[1, 1], k[0, 2] + area[0], k[1, 2] + area[1]),
        "sun_angular_radius": view.sun_angular_radius,
    }
