"""The maps of the Earth on the GPU: what the ground reflects, and its form."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise
from pathlib import Path

import moderngl
import numpy as np
import scipy
from PIL import Image

from simgl import assets
from simgl.arrays import Image8, IndexArray, Mask
from simgl.decoded_files import copy_pixels, decoded_image
from simgl.disk_cache import computed_once
from simgl.lru_cache import MANY, LruCache
from simgl.passes.background.map_levels import MapLevels, map_once, map_texture, size_of
from simgl.physics.earth_spectra import land_in_bands
from simgl.physics.land_reflectance import near_infrared, reflectance_from_display
from simgl.physics.spectrum import BANDS, Bands
from simgl.scene.earth import MAX_WIDTH, EarthMaps, MapImage

# Of the shipped map of form: its texels are 3.7 km long on the equator, and those of shores 2.5 km.
WIDTH, HEIGHT = 10800, 5400
# Lamps are smoothed to that many columns, where they have fewer.
_LAMP_COLUMNS = 4096
_SHORE_STEPS_PER_KM = 6.0
_KM_PER_DEGREE = 111.19
# Cells by which open sea and land are told, from pole to pole, and the distance to a shore.
CELLS, _FAR_FROM_SHORES_KM = 1024, 10.0


_LAND, _RELIEF = ("land_rgb.jpg", "land_nir.jpg"), ("relief_east.png", "relief_north.png")
_SHORE, _NIGHT = "shore.png", "night.jpg"
# What makes the maps, for the files that they are cached in.
MADE_BY = (
    __name__,
    "simgl.passes.background.map_levels",
    "simgl.physics.land_reflectance",
    "numpy",
    "scipy",
    "pillow",
)
_BANDS_MADE_BY = (
    *MADE_BY,
    "simgl.physics.earth_spectra",
    "simgl.physics.spectral_form",
    "simgl.physics.spectrum",
)


# For the simulators of a process: two of each kind at the size of the shipped ones.
_land_maps = LruCache[MapImage | None, MapLevels](MANY, max_bytes=171 << 20)
_form_maps = LruCache[None, MapLevels](MANY, max_bytes=342 << 20)
_shore_maps = LruCache[MapImage | None, MapLevels](MANY, max_bytes=384 << 20)
_lamp_maps = LruCache[MapImage | None, MapLevels](MANY, max_bytes=86 << 20)


def _path(name: str) -> Path:
    return assets.data() / "earth" / name


def _shipped(*names: str) -> Image8:
    """(h, w, channels) the codes of shipped images of one size, those of one after the other's."""
    images = [decoded_image(_path(name).read_bytes(), MAX_WIDTH * MAX_WIDTH // 2) for name in names]
    channels = [len(image.getbands()) for image in images]
    codes = np.empty((images[0].height, images[0].width, sum(channels)), dtype=np.uint8)
    for image, count, end in zip(images, channels, np.cumsum(channels), strict=True):
        copy_pixels(image, codes[..., end - count : end])
    return codes


def digest_of(image: MapImage | None, *shipped: str) -> tuple[str, ...]:
    """Of the content of an image, or of those in its place."""
    if image is not None:
        return (image.digest,)
    return tuple(hashlib.sha256(_path(name).read_bytes()).hexdigest() for name in shipped)


def land_inputs(image: MapImage | None) -> tuple[object, ...]:
    """What ``land_map`` depends on, for hashes."""
    return "land", digest_of(image, *_LAND)


def shore_inputs(water: MapImage | None) -> tuple[object, ...]:
    """What ``shore_map`` depends on, for hashes."""
    return "shore", digest_of(water, _SHORE)


def land_map(image: MapImage | None) -> MapLevels:
    """(h, w, 4) square roots of reflectance R, G, B, N, 255 for 1, with its halvings."""

    def made() -> MapLevels:
        return map_once(MADE_BY, land_inputs(image), lambda: make_land_map(image))

    return _land_maps.get(image, made, size_of)


def make_land_map(image: MapImage | None) -> Image8:
    """The codes of ``land_map``, past the caches."""
    if image is None:
        return _shipped(*_LAND)
    rgb = reflectance_from_display(np.asarray(image.read("RGB")))
    roots = np.sqrt(np.dstack([rgb, near_infrared(rgb)]))
    return np.round(255.0 * roots).astype(np.uint8)


def land_map_in_bands(image: MapImage | None, bands: Bands) -> MapLevels:
    """(h, w, 4) square roots of reflectance in the bands, 255 for 1, with its halvings."""
    if bands == BANDS:
        return land_map(image)
    inputs = (land_inputs(image), bands, digest_of(None, "spectra.csv"))
    return map_once(_BANDS_MADE_BY, inputs, lambda: _land_in_bands(image, bands))


def _land_in_bands(image: MapImage | None, bands: Bands) -> Image8:
    codes = land_map(image)[0]
    # Row by row: of all at once the steps between take gigabytes.
    rows = (land_in_bands((row / np.float32(255.0)) ** 2, bands) for row in codes)
    return np.stack([np.round(255.0 * np.sqrt(row)).astype(np.uint8) for row in rows])


def kind_map(image: MapImage | None) -> Image8:
    """(h, w, 4) how much grows on land, how dark it is there in red, and how white: what tells
    snow and leaves by R, G, B, N (shaders/planet/ground.glsl), for bands that do not.
    """
    codes = land_map(image)[0]
    result = np.zeros_like(codes)
    for row, values in zip(result, codes, strict=True):
        red, _, blue, near = ((values / np.float32(255.0)) ** 2).T
        white = np.clip((blue - 0.2) / 0.3, 0.0, 1.0)
        kinds = (
            np.clip(4.0 * (near - 1.35 * red), 0.0, 1.0),
            np.clip(1.5 - 12.0 * red, 0.0, 0.85),
            white * white * (3.0 - 2.0 * white),
        )
        row[:, :3] = np.round(255.0 * np.stack(kinds, axis=-1))
    return result


def form_map() -> MapLevels:
    """(h, w, 2) codes of the slopes to the east and north, with its halvings."""

    def made() -> MapLevels:
        return map_once(MADE_BY, ("form", digest_of(None, *_RELIEF)), make_form_map)

    return _form_maps.get(None, made, size_of)


def make_form_map() -> Image8:
    """The codes of ``form_map``, past the caches."""
    return _shipped(*_RELIEF)


def shore_map(water: MapImage | None) -> MapLevels:
    """(h, w, 1) codes of the distance to the shore, with its halvings."""

    def made() -> MapLevels:
        return map_once(MADE_BY, shore_inputs(water), lambda: make_shore_map(water))

    return _shore_maps.get(water, made, size_of)


def make_shore_map(water: MapImage | None) -> Image8:
    """The codes of ``shore_map``, past the caches."""
    return _shipped(_SHORE) if water is None else _shore(water.read("L"))[..., None]


def lamp_map(night: MapImage | None) -> MapLevels:
    """(h, w, 1) codes of the lights at night, with its halvings."""

    def made() -> MapLevels:
        inputs = "lamps", digest_of(night, _NIGHT)
        return map_once(MADE_BY, inputs, lambda: make_lamp_map(night))

    return _lamp_maps.get(night, made, size_of)


def make_lamp_map(night: MapImage | None) -> Image8:
    """The codes of ``lamp_map``, past the caches."""
    lights = Image.fromarray(_shipped(_NIGHT)[..., 0]) if night is None else night.read("L")
    width = max(lights.width, _LAMP_COLUMNS)
    scaled = lights.resize((width, width // 2), Image.Resampling.BICUBIC)
    # Codes below 16 of the shipped image are the noise of its compression.
    dimmed = np.maximum(np.asarray(scaled).astype(np.int16) - 16, 0)
    return dimmed.astype(np.uint8)[..., None]


def _shore(water: Image.Image) -> Image8:
    """Distance to the shore in the shipped map's code, from an image that is white on water."""
    distance_transform = scipy.ndimage.distance_transform_edt
    is_water = np.asarray(water) > 127
    km = 180.0 / is_water.shape[0] * _KM_PER_DEGREE
    distance = distance_transform(is_water) - distance_transform(~is_water)
    code = np.clip(np.round(128.0 + _SHORE_STEPS_PER_KM * km * distance), 0, 255)
    return np.asarray(code, dtype=np.uint8)


def shores(maps: EarthMaps) -> tuple[IndexArray, IndexArray]:
    """``cell_sums`` of the cells that are not all open sea, and of those that are not all inland.

    Both are so far from any shore that noise frays none into them.
    """
    inputs = ("open sea and inland", shore_inputs(maps.water))
    shape = (CELLS + 1, 2 * CELLS + 1)
    names = "shores", "waters"
    sums = computed_once(
        "earth",
        MADE_BY,
        inputs,
        lambda: dict(zip(names, make_shores(maps), strict=True)),
        lambda arrays: all(
            arrays[name].shape == shape and arrays[name].dtype == np.int32 for name in names
        ),
    )
    return sums["shores"], sums["waters"]


def make_shores(maps: EarthMaps) -> tuple[IndexArray, IndexArray]:
    """``shores``, past the cache."""
    shore = shore_map(maps.water)[0][..., 0]
    far = _SHORE_STEPS_PER_KM * _FAR_FROM_SHORES_KM
    lowest, highest = over_cells(np.minimum, shore), over_cells(np.maximum, shore)
    return cell_sums(lowest <= 128 + far), cell_sums(highest >= 128 - far)


def over_cells(of_two: np.ufunc, codes: Image8) -> Image8:
    """(1024, 2048) what a function of two makes of a map's codes (h, w) in each cell."""
    height, width = codes.shape
    edges = np.arange(CELLS + 1) * height // CELLS
    columns = np.arange(2 * CELLS) * width // (2 * CELLS)
    # Rows by ``reduce``, which takes many columns at once; a cell has a row at least.
    rows = [of_two.reduce(codes[a : max(b, a + 1)], axis=0) for a, b in pairwise(edges)]
    return np.asarray(of_two.reduceat(np.stack(rows), columns, axis=1))


def cell_sums(cells: Mask) -> IndexArray:
    """(rows + 1, columns + 1) of the corners of cells: how many of those above and left of each are
    in a mask."""
    sums = np.zeros((cells.shape[0] + 1, cells.shape[1] + 1), dtype=np.int32)
    rows = np.cumsum(cells, axis=0, dtype=np.int32)
    np.cumsum(rows, axis=1, dtype=np.int32, out=sums[1:, 1:])
    return sums


def ground_makers(maps: EarthMaps, bands: Bands = BANDS) -> list[Callable[[], MapLevels]]:
    """``land_map_in_bands``, ``form_map``, ``shore_map`` and ``lamp_map``, for threads: files are
    read, checked and decoded without Python's lock."""
    return [
        lambda: land_map_in_bands(maps.land, bands),
        form_map,
        lambda: shore_map(maps.water),
        lambda: lamp_map(maps.night),
    ]


def ground_levels(maps: EarthMaps, bands: Bands = BANDS) -> list[MapLevels]:
    """What ``ground_makers`` make."""
    with ThreadPoolExecutor(thread_name_prefix="simgl-map") as threads:
        return list(threads.map(lambda one: one(), ground_makers(maps, bands)))


def ground_textures(
    ctx: moderngl.Context, maps: EarthMaps, bands: Bands = BANDS
) -> list[moderngl.Texture]:
    """``ground_levels`` as textures."""
    return [map_texture(ctx, levels) for levels in ground_levels(maps, bands)]
