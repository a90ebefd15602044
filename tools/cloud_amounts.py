"""How much cloud places have beside the drawn climate: ``simgl/data/earth/cloud_amounts.csv``.

    python -m tools.cloud_amounts TRUTH

TRUTH : the folder of flight data of ``python -m benchmarks.flight``, of which CERES's mean all-sky
albedo of 2018 is read

In cells of 10 deg the albedo of the weather of many seeds is brought to what CERES sees, over
simgl's own clear sky, but for the mean of each row of cells: there the cover stays that of the
drawn climate. Clouds reflect here as by two streams under the mean Sun of a year; what that
misses of simgl's light is one factor for each row of cells. Poleward of 50 deg, where snow and ice
decide, less and less is changed.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from functools import partial
from pathlib import Path

import moderngl
import numpy as np
from scipy.ndimage import gaussian_filter

from benchmarks.flight.__main__ import in_bands
from benchmarks.flight.distant_earth import DATES, Reflected, reflected
from simgl import assets
from simgl.arrays import Array, Array32, Image8
from simgl.gpu.context import temporary_context
from simgl.passes.background.cloud_map import noise_texture, weather_codes
from simgl.passes.background.earth_maps import ground_textures
from simgl.scene.earth import Clouds, EarthMaps

ROWS, COLUMNS = 18, 36
_WIDTH = 720
# Seeds whose mean weather is the climate: the albedo of a cell then scatters by 0.01.
_SEEDS = range(24)
# Times of each date at which simgl's Earth is looked at.
_HOURS = 4
_ROUNDS = 12
# Of albedo per unit of the amounts, at most (that of cover is about 1); and the largest amount.
_RESPONSE, _LARGEST = 0.5, 0.6
# Added at the end over the Pacific from 180 to 100 W, 40 N to 40 S: by the light of its full disc
# the fit of cells leaves too little.
_PACIFIC, _MORE = (slice(5, 13), slice(0, 8)), 0.05
# Of the cells by which amounts are smoothed, and the light of clouds beside that by two streams.
_SMOOTH, _AROUND = 0.6, 1.5


def _mean_sun(latitude: Array) -> Array:
    """Mean cosine of the Sun's zenith angle over the sunlight of a year; latitude : (n,) [rad]."""
    declination = np.radians(23.44) * np.sin(np.radians(np.arange(0.0, 360.0, 10.0)))[:, None]
    hour = np.radians(np.arange(2.5, 180.0, 5.0))
    cosine = (
        np.sin(latitude)[:, None, None] * np.sin(declination)
        + np.cos(latitude)[:, None, None] * np.cos(declination) * np.cos(hour)
    ).clip(0.0)
    return np.asarray((cosine**2).sum(axis=(1, 2)) / cosine.sum(axis=(1, 2)))


def _cells(values: Array) -> Array:
    """(18, 36) means of a map (18 n, 36 n)."""
    n = len(values) // ROWS
    return np.asarray(values.reshape(ROWS, n, COLUMNS, n).mean(axis=(1, 3)))


def _of_clouds(codes: Image8) -> Array:
    """(3, 18, 36) reflectance of clouds for the Sun's light and for light from below; two streams,
    as in shaders/planet/cloud.glsl and ground.glsl. And the cover."""
    share, code, high, _ = np.moveaxis(codes / 255.0, -1, 0)
    rows = len(codes)
    mu = _mean_sun(np.pi * (0.5 - (np.arange(rows) + 0.5) / rows))[:, None]
    scaled, asymmetry = (1.0 - 0.85**2) * 100.0**code, 0.85 / 1.85
    g1, g3 = 0.75 * (1.0 - asymmetry), 0.5 - 0.75 * asymmetry * mu
    direct = (g1 * scaled + (g3 - g1 * mu) * (1.0 - np.exp(-scaled / mu))) / (1.0 + g1 * scaled)
    back = g1 * scaled / (1.0 + g1 * scaled)
    thin, from_below = 1.5 * high / (1.5 * high + 7.7 * mu), 1.5 * high / (1.5 * high + 7.7)
    past = (1.0 - thin) * (1.0 - from_below)
    from_ground = from_below + (1.0 - from_below) ** 2 * share * back
    seen = thin + past * share * direct, from_ground, share
    return np.stack([_cells(one) for one in seen])


def climate(ctx: moderngl.Context, amounts: Array32, seeds: Sequence[int]) -> Array:
    """(3, 18, 36) ``_of_clouds``, mean over seeds."""
    ground = ground_textures(ctx, EarthMaps())
    result = np.zeros((3, ROWS, COLUMNS))
    for seed in seeds:
        noise = noise_texture(ctx, seed)
        codes = weather_codes(ctx, Clouds(seed=seed), noise, ground, _WIDTH, amounts)
        result += _of_clouds(codes) / len(seeds)
        noise.release()
    for texture in ground:
        texture.release()
    return result


def _albedo(clouds: Array, clear: Array) -> Array:
    return np.asarray(
        clouds[0] + (1.0 - clouds[0]) * (1.0 - clouds[1]) * clear / (1.0 - clear * clouds[1])
    )


def _by_cells(light: Reflected) -> Array:
    """(18, 36) albedo from the north on."""
    sent, received = (
        one.sum(axis=-1).reshape(ROWS, 2, COLUMNS, 2).sum(axis=(1, 3))[::-1]
        for one in (light.sent, light.received)
    )
    return np.asarray(sent / received)


def fit(ctx: moderngl.Context, clear: Array, all_sky: Array, measured: Array) -> Array32:
    """(18, 36) the amounts; all arguments albedos (18, 36) from the north on.

    clear, all_sky : of simgl without amounts, with the seeds of ``reflected``
    measured : that are wanted
    """
    amounts = np.zeros((ROWS, COLUMNS), dtype=np.float32)
    seen = _albedo(climate(ctx, amounts, range(len(DATES) * _HOURS)), clear)
    # Of all cells around: few clouds tell little of their light.
    around = partial(gaussian_filter, sigma=_AROUND, mode=("nearest", "wrap"))
    of_light = around(all_sky - clear) / around(seen - clear)
    latitude = 85.0 - 10.0 * np.arange(ROWS)
    weight = np.clip((70.0 - np.abs(latitude)) / 20.0, 0.0, 1.0)[:, None]
    of_rows = climate(ctx, amounts, _SEEDS)[2].mean(axis=1)
    for _ in range(_ROUNDS):
        clouds = climate(ctx, amounts, _SEEDS)
        seen = _albedo(clouds, clear)
        error = measured - (clear + of_light * (seen - clear))
        error -= error.mean(axis=1, keepdims=True)
        step = gaussian_filter(weight * error / _RESPONSE, _SMOOTH, mode=("nearest", "wrap"))
        amounts = np.clip(amounts + step, -_LARGEST, _LARGEST).astype(np.float32)
        amounts += (of_rows - clouds[2].mean(axis=1)).astype(np.float32)[:, None]
        area = np.cos(np.radians(latitude))
        rms = np.sqrt(np.average((error**2).mean(axis=1), weights=area * weight[:, 0]))
        print(f"rms difference of the albedo {rms:.4f}")
    return amounts


def main() -> None:
    """Fit and write them.

    The fit begins without amounts, so that it does not depend on those of an earlier run; they are
    lost where it is interrupted.
    """
    path = assets.data() / "earth" / "cloud_amounts.csv"
    np.savetxt(path, np.zeros((ROWS, COLUMNS)), fmt="%.2f", delimiter=",")
    truth = Path(sys.argv[1]) / "ceres_2018_all_sky_1deg.csv"
    broadband = np.loadtxt(truth, delimiter=",")[::-1]
    with temporary_context() as ctx:
        clear = _by_cells(reflected(ctx, clouds={"cover": 0.0}, hours=_HOURS))
        all_sky = _by_cells(reflected(ctx, clouds={}, hours=_HOURS))
        amounts = fit(ctx, clear, all_sky, _cells(in_bands(broadband, clear=False)))
    amounts[_PACIFIC] += _MORE
    np.savetxt(path, amounts, fmt="%.2f", delimiter=",")


if __name__ == "__main__":
    main()
