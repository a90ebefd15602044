"""Maps of an exposure: false colours and heat maps with their scales and units, as PNG."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from simgl.arrays import AnyArray
from simgl.camera.camera_equation import blender_exposure, exposure_value
from simgl.false_colour import (
    LEGEND,
    SOURCE_SOLAR_CONSTANT,
    false_colour,
    relative_flux,
    scene_value,
)
from simgl.images import ElectronFrame, FrameInfo
from simgl.output import complete_file
from simgl.physics.ephemeris import utc_from_tai_ns
from simgl.simulator import Capture

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def write_maps(exposure: Capture, folder: Path, name: str) -> list[Path]:
    """A PNG for each map that the frames of an exposure allow: ``NAME.map.radiance.png`` and so on.

    returns : the paths written
    """
    maps: list[tuple[str, Callable[[], Figure]]] = []
    if (radiance := exposure.radiance) is not None:
        maps += [
            ("radiance", lambda: _radiance(radiance.info, radiance.radiance)),
            ("flux", lambda: _flux(radiance.info, radiance.radiance)),
            ("false_colour", lambda: _false_colours(radiance.info, radiance.radiance)),
        ]
    if (irradiance := exposure.irradiance) is not None:
        maps.append(("photons", lambda: _photons(irradiance.info, irradiance.photons)))
    if (electrons := exposure.electrons) is not None:
        maps.append(("electrons", lambda: electron_map(electrons)))
    if (truth := exposure.truth) is not None:
        maps.append(("range", lambda: _range(truth.info, truth.range)))
    if (lidar := exposure.lidar) is not None:
        maps.append(("lidar", lambda: _range(lidar.info, lidar.range, "LIDAR, range")))
        maps.append(("lidar_return", lambda: _returned(lidar.info, lidar.electrons)))
    paths = []
    for kind, draw in maps:
        path = folder / f"{name}.map.{kind}.png"
        figure = draw()
        with complete_file(path) as temporary:
            figure.savefig(temporary, dpi=_DPI)
        paths.append(path)
    return paths


_DPI = 100
_MARGINS = 0.4, 1.7, 0.45, 0.55  # left, right, bottom, top [inch]


def _sheet(info: FrameInfo, title: str, shape: tuple[int, ...]) -> tuple[Figure, Axes]:
    """A figure in which a pixel of the picture takes a whole number of pixels."""
    from matplotlib.figure import Figure

    height, width = shape[:2]
    grown = max(1, round(640 / width))
    left, right, bottom, top = _MARGINS
    inner = width * grown / _DPI, height * grown / _DPI
    whole = inner[0] + left + right, inner[1] + bottom + top
    figure = Figure(figsize=whole)
    axes = figure.add_axes(
        (left / whole[0], bottom / whole[1], inner[0] / whole[0], inner[1] / whole[1])
    )
    figure.text(
        left / whole[0],
        1.0 - 0.5 * top / whole[1],
        f"{title}\n{info.camera.name}, {utc_from_tai_ns(info.epoch_tai_ns)} UTC",
        fontsize=11,
        va="center",
    )
    axes.tick_params(labelsize=9)
    return figure, axes


def _drawn(
    info: FrameInfo, title: str, values: AnyArray, label: str, norm: Any, colours: str
) -> Figure:
    figure, axes = _sheet(info, title, values.shape)
    extent = (0, values.shape[1], values.shape[0], 0)
    shown = axes.imshow(values, norm=norm, cmap=colours, interpolation="nearest", extent=extent)
    box = axes.get_position()
    bar = figure.add_axes((box.x1 + 0.015, box.y0, 0.02, box.height))
    figure.colorbar(shown, cax=bar, label=label, extend=_extension(values, norm))
    bar.tick_params(labelsize=9)
    bar.yaxis.label.set_fontsize(10)
    return figure


def _extension(values: AnyArray, norm: Any) -> Any:
    # Where nothing is there is nothing to compare.
    with np.errstate(invalid="ignore"):
        low, high = bool(np.any(values < norm.vmin)), bool(np.any(values > norm.vmax))
    return {(False, False): "neither", (True, False): "min", (False, True): "max"}.get(
        (low, high), "both"
    )


def _log_norm(values: AnyArray, decades: float = 5.0) -> Any:
    """Whole decades below the brightest of most pixels; the Sun's disc may lie beyond."""
    from matplotlib.colors import LogNorm

    lit = values[np.isfinite(values) & (values > 0.0)]
    top = float(np.percentile(lit, 99.9)) if lit.size else 1.0
    high = 10.0 ** math.ceil(math.log10(top))
    return LogNorm(high / 10.0**decades, high)


def _radiance(info: FrameInfo, radiance: AnyArray) -> Figure:
    total = radiance.sum(axis=-1, dtype=np.float64)
    label = "radiance 400-1000 nm [W m$^{-2}$ sr$^{-1}$]"
    # What is black has no logarithm; it is drawn as the darkest.
    shown = np.maximum(total, np.finfo(np.float32).tiny)
    return _drawn(info, "Radiance", shown, label, _log_norm(total), "inferno")


def _flux(info: FrameInfo, radiance: AnyArray) -> Figure:
    from matplotlib.colors import Normalize

    label = f"relative luminance x {SOURCE_SOLAR_CONSTANT:g} [W m$^{{-2}}$]"
    norm = Normalize(0.0, SOURCE_SOLAR_CONSTANT)
    return _drawn(info, "Relative flux", relative_flux(radiance), label, norm, "gray")


def _photons(info: FrameInfo, photons: AnyArray) -> Figure:
    shown = np.maximum(photons, np.finfo(np.float32).tiny)
    label = "photons 400-1000 nm per pixel and exposure"
    return _drawn(info, "Photons", shown, label, _log_norm(photons), "inferno")


def electron_map(frame: ElectronFrame) -> Figure:
    """Mean electrons, from the read noise (at least one) to the full well."""
    from matplotlib.colors import LogNorm

    detector = frame.info.camera.detector
    norm = LogNorm(max(detector.read_noise, 1.0), detector.full_well)
    # What is black has no logarithm; it is drawn as the darkest.
    shown = np.maximum(frame.electrons, np.finfo(np.float32).tiny)
    title, label = "Mean electrons, read noise to full well", "electrons per pixel and exposure"
    return _drawn(frame.info, title, shown, label, norm, "inferno")


def _range(info: FrameInfo, distance: AnyArray, title: str = "Range") -> Figure:
    from matplotlib.colors import Normalize

    seen = distance > 0.0
    low, high = (distance[seen].min(), distance[seen].max()) if seen.any() else (0.0, 1.0)
    shown = np.where(seen, distance, np.nan)
    norm = Normalize(float(low), float(max(high, low * (1.0 + 1e-6))))
    return _drawn(info, title, shown, "range [m]", norm, "viridis_r")


def _returned(info: FrameInfo, electrons: AnyArray) -> Figure:
    shown = np.maximum(electrons, np.finfo(np.float32).tiny)
    label = "electrons of one pulse and of sunlight per pixel"
    return _drawn(info, "LIDAR, return", shown, label, _log_norm(electrons), "inferno")


def _false_colours(info: FrameInfo, radiance: AnyArray) -> Figure:
    value = exposure_value(info.camera.lens.f_number, info.camera.exposure_time)
    setting = blender_exposure(value)
    title = f"False colours, EV {value:.2f} (source's setting {setting:.2f})"
    picture = false_colour(scene_value(radiance, setting))
    figure, axes = _sheet(info, title, picture.shape)
    axes.imshow(picture, interpolation="nearest", extent=(0, picture.shape[1], picture.shape[0], 0))
    box = axes.get_position()
    bar = figure.add_axes((box.x1 + 0.015, box.y0, 0.02, box.height))
    low, high = LEGEND[0].value, LEGEND[-1].value
    ramp = np.geomspace(0.7 * low, 1.4 * high, 600)
    bar.imshow(
        false_colour(ramp[:, None]),
        extent=(0, 1, float(np.log2(ramp[0])), float(np.log2(ramp[-1]))),
        origin="lower",
        aspect="auto",
    )
    # Of the three about the grey one only that has room for its name.
    named = [step for step in LEGEND if "0.01" not in step.name]
    bar.set_yticks(
        [math.log2(step.value) for step in named], [f"{s.name}  {s.value:.4g}" for s in named]
    )
    bar.yaxis.tick_right()
    bar.tick_params(labelsize=9)
    bar.set_xticks([])
    return figure
