"""The Earth and space in the thermal infrared: the background of a thermal image."""

from __future__ import annotations

import moderngl
import numpy as np

from simgl.gpu.fullscreen import FullscreenProgram
from simgl.gpu.pipeline_state import State
from simgl.gpu.release import all_or_nothing
from simgl.gpu.uniform_blocks import Block, UniformBuffer
from simgl.passes.background.earth_textures import WEATHER, Weather
from simgl.passes.background.planet_blocks import (
    PLANET,
    earth_values,
    image_values,
    planet_values,
)
from simgl.physics.earth_infrared import shader_values
from simgl.thermal.infrared_surroundings import InfraredSurroundings
from simgl.view.background import Background

INFRARED_EARTH = Block(
    "InfraredEarth",
    29,
    np.dtype(
        [
            # In W m-2 sr-1 and as the detector counts: of deep space; of the ground under the Sun.
            ("space_radiance", "f4", 2),
            ("sunlight_reflected", "f4", 2),
            # [K]; and the angle of the warmest hour after noon.
            ("mean_temperature", "f4"),
            ("second_harmonic", "f4"),
            ("season", "f4"),
            ("warmest_hour", "f4"),
            ("sea_swing", "f4"),
            ("land_swing", "f4"),
            ("mean_land", "f4"),
            ("air_colder", "f4"),
            # [K km-1]
            ("lapse", "f4"),
            ("air_scale_km", "f4"),
            ("zenith_depth", "f4"),
            ("grazing_mass", "f4"),
            ("coldest_air", "f4"),
            ("high_cloud_km", "f4"),
            ("infrared_padding", "f4", 2),
        ]
    ),
)


# Of the block of the planet.
_WITHOUT_MAPS = dict.fromkeys(
    ("chart_variance", "cloud_variance", "map_halvings", "weather_halvings"), 0.0
)


class InfraredEarthPass:
    """Fills an image with the band radiance of the Earth and of space."""

    state = State()

    @all_or_nothing
    def __init__(self, ctx: moderngl.Context) -> None:
        self._ctx = ctx
        self._programs: dict[bool, FullscreenProgram] = {}
        self._planet = UniformBuffer(ctx, PLANET)

    def draw(
        self,
        background: Background,
        surroundings: InfraredSurroundings,
        planck: moderngl.Texture,
        weather: Weather | None,
        target: moderngl.Framebuffer,
        area: tuple[int, int, int, int],
    ) -> None:
        """Fill a rectangle of RGBA32F: radiance in W m-2 sr-1, as the detector counts, 0, 0.

        planck : their table, of the thermal pass
        weather : None for an Earth without maps
        area : x, y, width, height [pixels]
        """
        planet, earth = background.planet, surroundings.earth
        self.state.apply(self._ctx, target, area, area)
        if planet is None or earth is None:
            target.clear(*surroundings.space, 0.0, 0.0, viewport=area)
            return
        maps = _WITHOUT_MAPS if weather is None else weather.of_block
        values = planet_values(planet, background.sun_angular_radius)
        turns = [planet.sphere_from_camera]
        image = image_values(background.intrinsics, turns, [area], target.size)
        self._planet.write({**values, **maps}, image, earth_values(planet.earth, lamps=False))
        self._planet.bind()
        climate = shader_values(earth.day, planet.earth.equatorial_radius, earth.everywhere)
        self._program_for(weather is not None).draw(
            climate
            | {
                "space_radiance": surroundings.space,
                "sunlight_reflected": earth.reflected,
                "zenith_depth": -np.log(earth.transmission),
            },
            [planck, *(() if weather is None else weather.textures)],
        )

    def _program_for(self, mapped: bool) -> FullscreenProgram:
        if mapped not in self._programs:
            self._programs[mapped] = FullscreenProgram(
                self._ctx,
                "infrared_earth/infrared_earth",
                INFRARED_EARTH,
                ["planck", *(WEATHER if mapped else ())],
                ["EARTH_MAPS"] if mapped else [],
                shared=[PLANET],
            )
        return self._programs[mapped]

    def release(self) -> None:
        """Free everything."""
        for program in self._programs.values():
            program.release()
        self._planet.release()
