"""What clouds places have beside the drawn climate: ``simgl/data/earth/cloud_amounts.csv``, of
their cover, and ``cloud_thickness.csv``, of the logarithm of their thickness.

    python -m tools.cloud_amounts TRUTH

TRUTH : the folder of flight data of ``python -m benchmarks.flight``, of which CERES's mean all-sky
albedo of 2018 is read

In cells of 10 deg the albedo of the weather of many seeds is brought to what CERES sees, over
simgl's own clear sky. What a cell lacks beside the others of its row it gets as cover and, along
with that, thickness; what its row lacks, as thickness alone: there the cover stays that of the
drawn climate. Clouds reflect here as by two streams under the mean Sun of a year on rough tops;
what that misses of simgl's light is one factor for the surroundings of each cell. Poleward of
50 deg, where snow and ice decide, less and less is changed.
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
from benchmarks.flight.distant_earth import Reflected, reflected
from simgl import assets
from simgl.arrays import Array, Array32, Image8
from simgl.gpu.context import temporary_context
from simgl.gpu.release import release_all
from simgl.passes.background.cloud_map import AMOUNTS, noise_texture, weather_codes
from simgl.passes.background.earth_maps import ground_textures
from simgl.scene.earth import Clouds, EarthMaps

ROWS, COLUMNS = 18, 36
_WIDTH = 720
# Seeds whose mean weather is the climate: the albedo of a cell then scatters by 0.012.
_SEEDS = range(16)
# Cameras about simgl's Earth and times of each date, each with the weather of a seed.
_VIEWS, _HOURS = 16, 4
_ROUNDS = 8
# Of albedo per unit of cover with its thickness, and of rows' thickness alone; the largest of both.
_OF_COVER, _OF_THICKNESS, _LARGEST = 0.8, 0.15, 1.0
# Steps of a cell grow as long as it lacks light, so that one gets there in which more cover brings
# little by now, and shrink where it has had too much.
_GROW, _SHRINK, _SLOWEST, _FASTEST = 1.3, 0.6, 0.5, 3.0
# Where there is more cloud than in the drawn climate, it is thicker, too: so much of the logarithm
# per unit of cover, an estimate.
_THICKER = 1.6
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
    on_tops = 0.4 + 0.46 * mu
    scaled, asymmetry = (1.0 - 0.85**2) * 100.0**code, 0.85 / 1.85
    g1, g3 = 0.75 * (1.0 - asymmetry), 0.5 - 0.75 * asymmetry * on_tops
    direct = g1 * scaled + (g3 - g1 * on_tops) * (1.0 - np.exp(-scaled / on_tops))
    direct /= 1.0 + g1 * scaled
    back = g1 * scaled / (1.0 + g1 * scaled)
    thin, from_below = 1.5 * high / (1.5 * high + 7.7 * mu), 1.5 * high / (1.5 * high + 7.7)
    past = (1.0 - thin) * (1.0 - from_below)
    from_ground = from_below + (1.0 - from_below) ** 2 * share * back
    seen = thin + past * share * direct, from_ground, share
    return np.stack([_cells(one) for one in seen])


class Climate:
    """Mean over the weather of some seeds."""

    def __init__(self, ctx: moderngl.Context, seeds: Sequence[int]) -> None:
        self._ctx, self._ground = ctx, ground_textures(ctx, EarthMaps())
        self._noise = {seed: noise_texture(ctx, seed) for seed in seeds}

    def clouds(self, amounts: Array32) -> Array:
        """(3, 18, 36) ``_of_clouds`` with amounts (18, 36, 2)."""
        weathers = (
            weather_codes(self._ctx, Clouds(seed=seed), noise, self._ground, _WIDTH, amounts)
            for seed, noise in self._noise.items()
        )
        return np.mean([_of_clouds(codes) for codes in weathers], axis=0)

    def release(self) -> None:
        release_all(self._ctx, *self._ground, *self._noise.values())


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


def _logged(amounts: Array32, rows: Array) -> Array32:
    """(18, 36, 2) amounts of cover with thickness; rows : (18, 1) of theirs alone."""
    return np.stack([amounts, _THICKER * amounts + rows], axis=-1).astype(np.float32)


def fit(
    climate: Climate, clear: Array, all_sky: Array, measured: Array, before: Array32
) -> Array32:
    """(18, 36, 2) the amounts; all albedos (18, 36) from the north on.

    clear, all_sky : of simgl without clouds, and with the amounts ``before``, in the weather of the
        climate's seeds
    measured : that are wanted
    """
    drawn = climate.clouds(before)
    # Of all cells around: few clouds tell little of their light.
    around = partial(gaussian_filter, sigma=_AROUND, mode=("nearest", "wrap"))
    of_light = around(all_sky - clear) / around(_albedo(drawn, clear) - clear)
    latitude = 85.0 - 10.0 * np.arange(ROWS)
    area = np.cos(np.radians(latitude))
    weight = np.clip((70.0 - np.abs(latitude)) / 20.0, 0.0, 1.0)[:, None]
    of_rows = drawn[2].mean(axis=1)
    cover = before[..., 0]
    pace, last = np.ones_like(cover), np.zeros_like(cover)
    rows = (before[..., 1] - _THICKER * cover).mean(axis=1, keepdims=True)
    for _ in range(_ROUNDS):
        clouds = climate.clouds(_logged(cover, rows))
        error = measured - (clear + of_light * (_albedo(clouds, clear) - clear))
        rms = np.sqrt(np.average((error**2).mean(axis=1), weights=area * weight[:, 0]))
        print(f"rms difference of the albedo {rms:.4f}", flush=True)
        of_row = weight * error.mean(axis=1, keepdims=True)
        step = gaussian_filter(weight * error - of_row, _SMOOTH, mode=("nearest", "wrap"))
        pace = np.clip(pace * np.where(step * last < 0.0, _SHRINK, _GROW), _SLOWEST, _FASTEST)
        last = step
        cover = np.clip(cover + pace * step / _OF_COVER, -_LARGEST, _LARGEST).astype(np.float32)
        cover += (of_rows - clouds[2].mean(axis=1)).astype(np.float32)[:, None]
        rows = np.clip(rows + of_row / _OF_THICKNESS, -_LARGEST, _LARGEST)
    return _logged(cover, rows)


def _written(amounts: Array32) -> None:
    for name, values in zip(AMOUNTS, np.moveaxis(amounts, -1, 0), strict=True):
        np.savetxt(assets.data() / "earth" / name, values, fmt="%.2f", delimiter=",")


def main() -> None:
    """Fit and write them.

    The fit begins without amounts, so that it does not depend on those of an earlier run; they are
    lost where it is interrupted.
    """
    amounts = np.zeros((ROWS, COLUMNS, 2), dtype=np.float32)
    _written(amounts)
    broadband = np.loadtxt(Path(sys.argv[1]) / "ceres_2018_all_sky_1deg.csv", delimiter=",")[::-1]
    measured = _cells(in_bands(broadband, clear=False))
    seen = partial(reflected, views=_VIEWS, hours=_HOURS)
    with temporary_context() as ctx:
        climate = Climate(ctx, _SEEDS)
        clear = _by_cells(seen(ctx, clouds={"cover": 0.0}))
        all_sky = _by_cells(seen(ctx, clouds={}))
        _written(fit(climate, clear, all_sky, measured, amounts))
        climate.release()


if __name__ == "__main__":
    main()
