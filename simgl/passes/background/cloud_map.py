"""The weather: one map of clouds over the whole Earth, made once for a seed and a cover."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import moderngl
import numpy as np

from simgl import assets
from simgl.arrays import Array, Array32, Image8
from simgl.disk_cache import is_computed
from simgl.gpu.fullscreen import FullscreenProgram
from simgl.gpu.glsl import assemble
from simgl.gpu.pipeline_state import State
from simgl.gpu.release import release_all
from simgl.gpu.render_targets import Format, ImageTarget
from simgl.gpu.uniform_blocks import Block
from simgl.passes.background.earth_maps import (
    MADE_BY,
    digest_of,
    land_inputs,
    shore_inputs,
)
from simgl.passes.background.map_levels import MapLevels, halvings, map_levels, map_once
from simgl.scene.cyclones import DECKS, anvils, commas, seed_shift, swirls
from simgl.scene.earth import Clouds, EarthMaps, MapImage
from simgl.scene.noise_volume import SIZE, noise_volume

# Optical thickness of code 1; that of code 0 is 1, logarithmic between, as in planet/cloud.glsl.
THICKEST = 100.0
# Optical thickness that reflects half of diffuse light: 4 / (3 (1 - g)), droplets' asymmetry 0.85.
_HALF_REFLECTED = 4.0 / (3.0 * (1.0 - 0.85))
# Enough to find the mean cover by.
_SMALL = (512, 256)

_SHADER = "cloud_map/cloud_map"
_FIELDS = ("swirls", "commas", "anvils", "amounts")
AMOUNTS = "cloud_amounts.csv", "cloud_thickness.csv"
_WEATHER = Block(
    "Weather",
    16,
    np.dtype(
        [
            ("decks", "f4", (len(DECKS), 4)),
            ("seed_shift", "f4", 4),
            ("map_size", "f4", 2),
            ("cover_shift", "f4"),
            ("_padding", "f4"),
        ]
    ),
)


def noise_texture(ctx: moderngl.Context, seed: int) -> moderngl.Texture3D:
    """The volume of ``simgl.scene.noise_volume``, repeating, without mipmaps."""
    texture = ctx.texture3d((SIZE,) * 3, 4, noise_volume(seed).tobytes(), alignment=1)
    texture.filter = (moderngl.LINEAR, moderngl.LINEAR)
    texture.repeat_x = texture.repeat_y = texture.repeat_z = True
    return texture


def cloud_amounts() -> Array32:
    """(18, 36, 2) what places have beside the climate, from the north and 180 deg west on.

    What is added to their clouds, in a unit of which 0.13 is one standard deviation of the noise
    that breaks clouds up, and to the logarithm of their thickness (``tools/cloud_amounts.py``).
    """
    folder = assets.data() / "earth"
    read = [np.loadtxt(folder / name, delimiter=",", dtype=np.float32) for name in AMOUNTS]
    return np.stack(read, axis=-1)


def weather_map(
    ctx: moderngl.Context,
    clouds: Clouds,
    maps: EarthMaps,
    ground: Sequence[moderngl.Texture],
) -> MapLevels:
    """What ``weather_codes`` returns, with its halvings, made once on a machine.

    ground : of these maps
    """
    if (image := clouds.image) is not None:
        of_image = ("clouds", image.digest, clouds.thickness)
        made_by = __name__, *MADE_BY
        return map_once(made_by, of_image, lambda: _from_image(clouds, image), weather_levels)

    def drawn() -> Image8:
        noise = noise_texture(ctx, clouds.seed)
        try:
            return weather_codes(ctx, clouds, noise, ground)
        finally:
            noise.release()

    return map_once(*_source(ctx, clouds, maps), drawn, weather_levels)


def weather_levels(codes: Image8) -> MapLevels:
    """The halvings of a weather map, which reflect as much light as the map.

    Cloud is thick where there is much of it: a mean cover times the reflectance of a mean thickness
    would lose a tenth of the light of the tropics in pixels of 100 km. A level has the thickness
    whose reflectance is the mean of the map's, weighted by cover.
    """
    levels = map_levels(codes)
    share = codes[..., 0].astype(np.float32)
    reflected = np.take(_diffuse_reflectance(np.arange(256) / 255.0), codes[..., 1])
    clouded = np.stack([share, share * reflected], axis=-1)
    for level, means in zip(levels[1:], halvings(clouded), strict=True):
        cloudy = means[..., 0] > 0.0
        mean = means[cloudy, 1] / means[cloudy, 0]
        thickness = _HALF_REFLECTED * mean / (1.0 - mean)
        level[cloudy, 1] = np.round(255.0 * np.log(thickness) / np.log(THICKEST))
    return levels


def _diffuse_reflectance(code: Array) -> Array32:
    """Of cloud for light from all sides (planet/cloud.glsl), by the code of its thickness."""
    thickness = THICKEST**code
    reflected: Array32 = (thickness / (thickness + _HALF_REFLECTED)).astype(np.float32)
    return reflected


def has_weather(ctx: moderngl.Context, clouds: Clouds, maps: EarthMaps) -> bool:
    """Whether ``weather_map`` need not draw it; an image is read in no time."""
    return clouds.image is not None or is_computed("earth", *_source(ctx, clouds, maps))


def _source(
    ctx: moderngl.Context, clouds: Clouds, maps: EarthMaps
) -> tuple[tuple[str, ...], tuple[object, ...]]:
    """The modules that draw the weather, and all else that it depends on."""
    shader = assemble(assets.shaders(), f"{_SHADER}.frag", None, {_WEATHER.include: _WEATHER.glsl})
    driver = ctx.info["GL_RENDERER"], ctx.info["GL_VERSION"]
    of_ground = land_inputs(maps.land), shore_inputs(maps.water), digest_of(None, *AMOUNTS)
    inputs = ("weather", clouds.seed, clouds.cover, shader.text, driver, of_ground)
    return (__name__, "simgl.scene.cyclones", "simgl.scene.noise_volume", *MADE_BY), inputs


def weather_codes(
    ctx: moderngl.Context,
    clouds: Clouds,
    noise: moderngl.Texture3D,
    ground: Sequence[moderngl.Texture],
    width: int = 4096,
    amounts: Array32 | None = None,
) -> Image8:
    """(h, w, 4) share of cloud, code of its thickness, thin high cloud, code of its kind.

    clouds : without an image
    noise : of the same seed; ground : as ``simgl.passes.background.earth_maps`` gives them
    width : of the map; its height is half of that
    amounts : in place of ``cloud_amounts``
    """
    amounts = cloud_amounts() if amounts is None else amounts
    samplers = ["noise_volume", *_FIELDS, "land_map", "shore_map"]
    program = FullscreenProgram(ctx, _SHADER, _WEATHER, samplers)
    land, _, shore, _ = ground
    made = swirls(clouds.seed), commas(clouds.seed), anvils(clouds.seed), amounts
    drawn = [_field_texture(ctx, field) for field in made]
    small = ImageTarget(ctx, _SMALL, [Format("f4", 4)])
    full = ImageTarget(ctx, (width, width // 2), [Format("f1", 4)])
    given: dict[str, object] = {"decks": DECKS, "seed_shift": (*seed_shift(clouds.seed), 0.0)}

    def draw(target: ImageTarget, shift: float) -> None:
        area = (0, 0, *target.size)
        State().apply(ctx, target.framebuffer, area, area)
        size = {"map_size": target.size, "cover_shift": shift}
        program.draw(given | size, [noise, *drawn, land, shore])

    try:
        draw(full, _shift_for(clouds.cover, small, draw))
        codes = np.frombuffer(full.textures[0].read(alignment=1), dtype=np.uint8)
        return codes.reshape(width // 2, width, 4)
    finally:
        release_all(ctx, program, *drawn, small, full)


def _from_image(clouds: Clouds, image: MapImage) -> Image8:
    share = np.asarray(image.read("L"))
    code = np.log(clouds.thickness) / np.log(THICKEST)
    values = np.zeros((*share.shape, 4), dtype=np.uint8)
    values[..., 0] = share
    values[..., 1] = np.uint8(np.clip(np.round(255.0 * code), 0, 255))
    # Lumps (shaders/planet/puffs.glsl).
    values[..., 3] = 255
    return values


def _field_texture(ctx: moderngl.Context, field: Array32) -> moderngl.Texture:
    """A map of the whole Earth (h, w, parts)."""
    size, parts = field.shape[1::-1], field.shape[2]
    texture = ctx.texture(size, parts, field.tobytes(), dtype="f4", alignment=1)
    texture.repeat_x, texture.repeat_y = True, False
    return texture


def _mean_share(target: ImageTarget) -> float:
    """Of cloud over the Earth's area."""
    share = target.read()[..., 0].mean(axis=1)
    rows = (np.arange(share.size) + 0.5) * np.pi / share.size
    return float(np.average(share, weights=np.sin(rows)))


def _shift_for(
    cover: float, small: ImageTarget, draw: Callable[[ImageTarget, float], None]
) -> float:
    """By how much to shift the weather so that its mean share is ``cover``."""
    low, high = -3.0, 3.0
    for _ in range(12):
        middle = 0.5 * (low + high)
        draw(small, middle)
        low, high = (middle, high) if _mean_share(small) < cover else (low, middle)
    return 0.5 * (low + high)
