"""The maps of the Earth on the GPU: what the ground reflects, and its form."""

from __future__ import annotations

import moderngl
import numpy as np
from PIL import Image
from scipy.ndimage import distance_transform_edt

from simgl import assets
from simgl.arrays import Image8, IndexArray
from simgl.lru_cache import MANY, LruCache
from simgl.physics.land_reflectance import near_infrared, reflectance_from_display
from simgl.scene.earth import EarthMaps, MapImage

# Texels of the shipped maps are 9.8 km long on the equator.
WIDTH, HEIGHT = 4096, 2048
_SHORE_STEPS_PER_KM = 6.0
_KM_PER_DEGREE = 111.19
# Cells by which open sea is told, from pole to pole, and the distance to a shore.
_CELLS, _OPEN_SEA_KM = 256, 10.0


def _shipped(name: str, mode: str) -> Image8:
    with Image.open(assets.data() / "earth" / name) as image:
        return np.asarray(image.convert(mode))


# For the simulators of a process: two of each kind at the size of the shipped ones.
_land_maps = LruCache[MapImage | None, Image8](MANY, max_bytes=64 << 20)
_form_maps = LruCache[tuple[MapImage | None, MapImage | None], Image8](MANY, max_bytes=64 << 20)


def size_of(values: Image8) -> int:
    """Bytes of an array, for caches."""
    return values.nbytes


def land_map(image: MapImage | None) -> Image8:
    """(h, w, 4) square roots of reflectance R, G, B, N, 255 for 1."""
    return _land_maps.get(image, lambda: make_land_map(image), size_of)


def make_land_map(image: MapImage | None) -> Image8:
    """``land_map``, past the cache."""
    if image is None:
        return np.dstack([_shipped("land_rgb.jpg", "RGB"), _shipped("land_nir.jpg", "L")])
    rgb = reflectance_from_display(np.asarray(image.read("RGB")))
    roots = np.sqrt(np.dstack([rgb, near_infrared(rgb)]))
    return np.round(255.0 * roots).astype(np.uint8)


def form_map(water: MapImage | None, night: MapImage | None) -> Image8:
    """(h, w, 4) codes of the slopes to the east and north, of the shore, and of night lights."""
    return _form_maps.get((water, night), lambda: make_form_map(water, night), size_of)


def make_form_map(water: MapImage | None, night: MapImage | None) -> Image8:
    """``form_map``, past the cache."""
    slopes = _shipped("relief.webp", "RGB")[..., :2]
    shore = _shipped("shore.webp", "L") if water is None else _shore(water.read("L"))
    lights = Image.fromarray(_shipped("night.jpg", "L")) if night is None else night.read("L")
    height, width = shore.shape
    if (height, width) != slopes.shape[:2]:
        scaled = Image.fromarray(np.dstack([slopes, slopes[..., :1]])).resize((width, height))
        slopes = np.asarray(scaled)[..., :2]
    # Codes below 16 of the shipped image are the noise of its compression.
    scaled = lights.resize((width, height), Image.Resampling.BICUBIC)
    night_code = np.maximum(np.asarray(scaled).astype(np.int16) - 16, 0).astype(np.uint8)
    return np.dstack([slopes, shore, night_code])


def _shore(water: Image.Image) -> Image8:
    """Distance to the shore in the shipped map's code, from an image that is white on water."""
    is_water = np.asarray(water) > 127
    km = 180.0 / is_water.shape[0] * _KM_PER_DEGREE
    distance = distance_transform_edt(is_water) - distance_transform_edt(~is_water)
    code = np.clip(np.round(128.0 + _SHORE_STEPS_PER_KM * km * distance), 0, 255)
    return np.asarray(code, dtype=np.uint8)


def shores(maps: EarthMaps) -> IndexArray:
    """(rows + 1, columns + 1) of the corners of cells of 0.7 deg: how many of those above and left
    of each are not all open sea.

    Open sea is so far from any shore that noise frays none into it, and no pixel of half a cell's
    width sees one.
    """
    shore = form_map(maps.water, maps.night)[..., 2]
    height, width = shore.shape
    rows, columns = (
        np.arange(_CELLS) * height // _CELLS,
        np.arange(2 * _CELLS) * width // (2 * _CELLS),
    )
    lowest = np.minimum.reduceat(np.minimum.reduceat(shore, rows, axis=0), columns, axis=1)
    sums = np.zeros((_CELLS + 1, 2 * _CELLS + 1), dtype=np.int64)
    closed = lowest <= 128 + _SHORE_STEPS_PER_KM * _OPEN_SEA_KM
    sums[1:, 1:] = np.cumsum(np.cumsum(closed, axis=0), axis=1)
    return sums


def map_texture(ctx: moderngl.Context, values: Image8) -> moderngl.Texture:
    """An equirectangular map as a texture that joins at 180 deg."""
    height, width, channels = values.shape
    texture = ctx.texture((width, height), channels, values.tobytes(), alignment=1)
    texture.build_mipmaps()
    texture.repeat_x, texture.repeat_y = True, False
    return texture


def ground_textures(ctx: moderngl.Context, maps: EarthMaps) -> list[moderngl.Texture]:
    """``land_map`` and ``form_map``."""
    return [
        map_texture(ctx, land_map(maps.land)),
        map_texture(ctx, form_map(maps.water, maps.night)),
    ]
