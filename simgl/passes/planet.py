"""Earth and Sun: the background of the picture, one full-screen draw."""

from __future__ import annotations

from functools import lru_cache

import moderngl
import numpy as np
from PIL import Image

from simgl import assets
from simgl.gpu.blocks import Block
from simgl.gpu.fullscreen import FullscreenProgram
from simgl.gpu.state import State
from simgl.passes.air import AIR_SAMPLERS, AIR_VIEW, AirPass
from simgl.passes.air_tables import AIR
from simgl.view.background import Background

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
            # fx, fy, cx, cy [pixels]
            ("intrinsics", "f4", 4),
            ("outside", "f4"),
            ("sun_angular_radius", "f4"),
            ("has_earth", "f4"),
            ("albedo_from_map", "f4"),
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
    """Draws the Earth as an exact ellipsoid, and the Sun's disc, behind everything."""

    state = State()

    def __init__(self, ctx: moderngl.Context, air: AirPass) -> None:
        self._ctx, self._air = ctx, air
        self._programs: dict[tuple[str, ...], FullscreenProgram] = {}
        self._program_for(())
        self._maps = [_map_texture(ctx, image) for image in _day_map()]

    def draw(
        self, background: Background, target: moderngl.Framebuffer, area: tuple[int, int, int, int]
    ) -> None:
        """Fill a rectangle with what lies behind the spacecraft [W m-2 sr-1].

        area : x, y, width, height [pixels]
        """
        before = None if background.planet is None else self._air.before(background.planet)
        self.state.apply(self._ctx, target, area, area)
        if background.planet is None and not background.sun_radiance.any():
            target.clear(0.0, 0.0, 0.0, 0.0, viewport=area)
            return
        values = _values(background, area)
        if before is None:
            self._program_for(()).draw(values, self._maps)
            return
        variant = ("AIR", "AIR_INSIDE") if before.inside else ("AIR",)
        self._program_for(variant).draw(values, [*self._maps, *before.textures])

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
                shared=blocks if variant else (),
                spare=() if variant else blocks,
                defines=dict.fromkeys(variant, 1),
            )
        return self._programs[variant]

    def release(self) -> None:
        """Free everything."""
        for program in self._programs.values():
            program.release()
        for texture in self._maps:
            texture.release()


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
        empty = {name: 0.0 for name in _PLANET.dtype.names or () if name not in values}
        return values | empty
    matrix = np.zeros((4, 4), dtype=np.float32)
    matrix[:3, :3] = planet.sphere_from_camera
    radii = np.array(planet.earth.radii)
    return values | {
        "sphere_from_camera": matrix,
        "camera_in_sphere": (*planet.camera_in_sphere, 0.0),
        "sphere_axes": (*(radii[0] / radii), 0.0),
        "sun_direction_itrf": (*planet.sun_direction_itrf, 0.0),
        "earth_sun_irradiance": planet.sun_irradiance,
        "earth_albedo": planet.earth.albedo or (0.0, 0.0, 0.0, 0.0),
        "outside": planet.outside,
        "has_earth": 1.0,
        "albedo_from_map": float(planet.earth.albedo is None),
    }
