"""The Earth: the background of the picture, one full-screen draw."""

from __future__ import annotations

from functools import lru_cache

import moderngl
import numpy as np
from PIL import Image

from simgl import assets
from simgl.gpu.blocks import Block
from simgl.gpu.fullscreen import FullscreenProgram
from simgl.gpu.state import SRC1_COLOR, State
from simgl.passes.air import AIR_SAMPLERS, AIR_VIEW, AirPass
from simgl.passes.air_tables import AIR
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
            ("sun_direction_itrf", "f4", 4),
            ("earth_sun_irradiance", "f4", 4),
            ("earth_albedo", "f4", 4),
            # fx, fy, cx, cy [pixels]
            ("intrinsics", "f4", 4),
            ("outside", "f4"),
            ("sun_angular_radius", "f4"),
            ("albedo_from_map", "f4"),
            ("planet_padding", "f4"),
        ]
    ),
)


@lru_cache(maxsize=1)
def _day_map() -> tuple[Image.Image, Image.Image]:
    """Red, green, blue and near-infrared reflectance of the cloud-free Earth, as square roots."""
    folder = assets.data() / "earth"
    with Image.open(folder / "day_rgb.jpg") as rgb, Image.open(folder / "day_nir.jpg") as nir:
        return rgb.convert("RGB"), nir.convert("L")


def _map_texture(ctx: moderngl.Context, image: Image.Image) -> moderngl.Texture:
    channels = len(image.getbands())
    texture = ctx.texture(image.size, channels, image.tobytes(), alignment=1)
    texture.build_mipmaps()
    texture.filter = (moderngl.LINEAR_MIPMAP_LINEAR, moderngl.LINEAR)
    texture.repeat_x, texture.repeat_y = True, False
    return texture


class PlanetPass:
    """Draws the Earth as an exact ellipsoid, alone or before what lies beyond it."""

    state = State()
    before = State(blend=(moderngl.ONE, SRC1_COLOR))

    def __init__(self, ctx: moderngl.Context, air: AirPass) -> None:
        self._ctx, self._air = ctx, air
        self._programs: dict[tuple[str, ...], FullscreenProgram] = {}
        self._program_for(())
        self._maps = [_map_texture(ctx, image) for image in _day_map()]

    def draw(
        self, background: Background, target: moderngl.Framebuffer, area: tuple[int, int, int, int]
    ) -> None:
        """Fill a rectangle with the Earth [W m-2 sr-1].

        Where the view has heavens, the target holds them already; they stay as far as they are
        seen past the Earth.

        area : x, y, width, height [pixels]
        """
        planet = background.planet
        air = None if planet is None else self._air.before(planet)
        alone = background.heavens is None
        state = self.state if alone else self.before
        state.apply(self._ctx, target, area, area)
        if planet is not None:
            values = _values(background, planet, area)
            if air is None:
                self._program_for(()).draw(values, self._maps)
            else:
                variant = ("AIR", "AIR_INSIDE") if air.inside else ("AIR",)
                self._program_for(variant).draw(values, [*self._maps, *air.textures])
        elif alone:
            target.clear(0.0, 0.0, 0.0, 0.0, viewport=area)

    def _program_for(self, variant: tuple[str, ...]) -> FullscreenProgram:
        """The program with or without air; what there is not costs nothing."""
        if variant not in self._programs:
            samplers = ["day_map_rgb", "day_map_nir", *(AIR_SAMPLERS if variant else ())]
            blocks = [AIR, AIR_VIEW]
            self._programs[variant] = FullscreenProgram(
                self._ctx,
                "planet/planet",
                _PLANET,
                samplers,
                variant,
                shared=blocks if variant else (),
                spare=() if variant else blocks,
            )
        return self._programs[variant]

    def release(self) -> None:
        """Free everything."""
        for program in self._programs.values():
            program.release()
        for texture in self._maps:
            texture.release()


def _values(
    view: Background, planet: PlanetView, area: tuple[int, int, int, int]
) -> dict[str, object]:
    k = view.intrinsics
    matrix = np.zeros((4, 4), dtype=np.float32)
    matrix[:3, :3] = planet.sphere_from_camera
    radii = np.array(planet.earth.radii)
    return {
        "sphere_from_camera": matrix,
        "camera_in_sphere": (*planet.camera_in_sphere, 0.0),
        "sphere_axes": (*(radii[0] / radii), 0.0),
        "sun_direction_itrf": (*planet.sun_direction_itrf, 0.0),
        "earth_sun_irradiance": planet.sun_irradiance,
        "earth_albedo": planet.earth.albedo or (0.0, 0.0, 0.0, 0.0),
        "intrinsics": (k[0, 0], k[1, 1], k[0, 2] + area[0], k[1, 2] + area[1]),
        "outside": planet.outside,
        "sun_angular_radius": view.sun_angular_radius,
        "albedo_from_map": float(planet.earth.albedo is None),
    }
