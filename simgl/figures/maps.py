"""Maps of a capture as PNG: false colours and heat maps with scales and units."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from simgl.arrays import AnyArray
from simgl.camera.camera_equation import blender_exposure, exposure_value
from simgl.figures.false_colour import (
    LEGEND,
    SOURCE_SOLAR_CONSTANT,
    false_colour,
    relative_flux,
    scene_value,
)
from simgl.figures.style import DN_MAP, LIGHT_MAP, VALUE_MAP, figure_style
from simgl.images import ElectronFrame, FrameInfo, ThermalFrame
from simgl.output import complete_file
from simgl.physics.ephemeris import utc_from_tai_ns
from simgl.physics.spectrum import BANDS
from simgl.progress import ProgressCallback, silent
from simgl.simulator import Capture

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def write_maps(
    capture: Capture, folder: Path, name: str, progress: ProgressCallback | None = None
) -> list[Path]:
    """Write a PNG per map that the captured frames allow, such as ``NAME.map.radiance.png``.

    returns : the written paths
    """
    maps: list[tuple[str, Callable[[], Figure]]] = []
    if (radiance := capture.radiance) is not None:
        maps.append(("radiance", lambda: _radiance(radiance.info, radiance.radiance)))
    # The study's displays weight R, G and B.
    if radiance is not None and radiance.info.bands == BANDS:
        maps += [
            ("flux", lambda: _flux(radiance.info, radiance.radiance)),
            ("false_colour", lambda: _false_colours(radiance.info, radiance.radiance)),
        ]
    if (irradiance := capture.irradiance) is not None:
        maps.append(("photons", lambda: _photons(irradiance.info, irradiance.photons)))
    if (electrons := capture.electrons) is not None:
        maps.append(("electrons", lambda: electron_map(electrons)))
    if (truth := capture.truth) is not None:
        maps.append(("range", lambda: _range(truth.info, truth.range)))
    if (lidar := capture.lidar) is not None:
        maps.append(("lidar", lambda: _range(lidar.info, lidar.range, "LIDAR, range")))
        maps.append(("lidar_return", lambda: _returned(lidar.info, lidar.electrons)))
    if (thermal := capture.thermal) is not None:
        maps.append(("brightness_temperature", lambda: thermal_map(thermal)))
    report = silent if progress is None else progress
    paths = []
    for number, (kind, draw) in enumerate(maps):
        report(number, len(maps))
        path = folder / f"{name}.map.{kind}.png"
        with figure_style(), complete_file(path) as temporary:
            draw().savefig(temporary, dpi=_DPI)
        paths.append(path)
    return paths


_DPI = 100
_MARGINS = 0.65, 1.7, 0.6, 0.6  # left, right, bottom, top [inch]


def _sheet(info: FrameInfo, title: str, shape: tuple[int, ...]) -> tuple[Figure, Axes]:
    """A figure that shows a pixel of the image as an integer number of pixels."""
    from matplotlib.figure import Figure

    height, width = shape[:2]
    zoom = max(1, round(640 / width))
    left, right, bottom, top = _MARGINS
    inner = width * zoom / _DPI, height * zoom / _DPI
    size = inner[0] + left + right, inner[1] + bottom + top
    figure = Figure(figsize=size)
    axes = figure.add_axes(
        (left / size[0], bottom / size[1], inner[0] / size[0], inner[1] / size[1])
    )
    figure.text(
        left / size[0],
        1.0 - 0.5 * top / size[1],
        f"{title}\n{info.camera.name}, {utc_from_tai_ns(info.epoch_tai_ns)} UTC",
        fontsize=11,
        va="center",
    )
    axes.grid(False)
    axes.set(xlabel="column [px]", ylabel="row [px]")
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
    return figure


def _extension(values: AnyArray, norm: Any) -> Any:
    # NaN stands for no spacecraft.
    with np.errstate(invalid="ignore"):
        low, high = bool(np.any(values < norm.vmin)), bool(np.any(values > norm.vmax))
    return {(False, False): "neither", (True, False): "min", (False, True): "max"}.get(
        (low, high), "both"
    )


def decades_norm(values: AnyArray) -> Any:
    """Logarithmic scale of five full decades to the 99.9th percentile; the Sun may lie beyond."""
    from matplotlib.colors import LogNorm

    lit = values[np.isfinite(values) & (values > 0.0)]
    top = float(np.percentile(lit, 99.9)) if lit.size else 1.0
    high = 10.0 ** math.ceil(math.log10(top))
    return LogNorm(high / 1e5, high)


def thermal_map(frame: ThermalFrame) -> Figure:
    """Map of the brightness temperature, without the coldest and warmest pixels."""
    from matplotlib.colors import Normalize

    thermal = frame.info.camera.thermal
    assert thermal is not None
    low, high = thermal.table.band_um
    kelvin = frame.brightness_temperature
    norm = Normalize(*np.percentile(kelvin, [1.0, 99.5]))
    label = f"brightness temperature {low:g}-{high:g} \u00b5m [K]"
    title = f"Thermal radiance; temperatures {frame.history}"
    return _drawn(frame.info, title, kelvin, label, norm, LIGHT_MAP)


def _positive(values: AnyArray) -> AnyArray:
    """The values with zeros replaced, for a logarithmic scale."""
    return np.maximum(values, np.finfo(np.float32).tiny)


def _range_nm(info: FrameInfo) -> str:
    edges = 1e9 * np.array(info.bands.edges)
    return f"{edges.min():.10g}-{edges.max():.10g} nm"


def _radiance(info: FrameInfo, radiance: AnyArray) -> Figure:
    total = radiance.sum(axis=-1, dtype=np.float64)
    label = f"radiance {_range_nm(info)} [W m$^{{-2}}$ sr$^{{-1}}$]"
    return _drawn(info, "Radiance", _positive(total), label, decades_norm(total), LIGHT_MAP)


def _flux(info: FrameInfo, radiance: AnyArray) -> Figure:
    from matplotlib.colors import Normalize

    label = f"relative luminance x {SOURCE_SOLAR_CONSTANT:g} [W m$^{{-2}}$]"
    norm = Normalize(0.0, SOURCE_SOLAR_CONSTANT)
    return _drawn(info, "Relative flux", relative_flux(radiance), label, norm, DN_MAP)


def _photons(info: FrameInfo, photons: AnyArray) -> Figure:
    label = f"photons {_range_nm(info)} per pixel and exposure"
    return _drawn(info, "Photons", _positive(photons), label, decades_norm(photons), LIGHT_MAP)


def electron_map(frame: ElectronFrame) -> Figure:
    """Map of the mean electrons, from the read noise (at least 1 e-) to the full well."""
    from matplotlib.colors import LogNorm

    detector = frame.info.camera.detector
    norm = LogNorm(max(detector.read_noise, 1.0), detector.full_well)
    title, label = "Mean electrons, read noise to full well", "electrons per pixel and exposure"
    return _drawn(frame.info, title, _positive(frame.electrons), label, norm, LIGHT_MAP)


def _range(info: FrameInfo, distance: AnyArray, title: str = "Range") -> Figure:
    from matplotlib.colors import Normalize

    seen = distance > 0.0
    low, high = (distance[seen].min(), distance[seen].max()) if seen.any() else (0.0, 1.0)
    shown = np.where(seen, distance, np.nan)
    norm = Normalize(float(low), float(max(high, low * (1.0 + 1e-6))))
    return _drawn(info, title, shown, "range [m]", norm, f"{VALUE_MAP}_r")


def _returned(info: FrameInfo, electrons: AnyArray) -> Figure:
    label = "electrons of one pulse and of sunlight per pixel"
    norm = decades_norm(electrons)
    return _drawn(info, "LIDAR, return", _positive(electrons), label, norm, LIGHT_MAP)


def _false_colours(info: FrameInfo, radiance: AnyArray) -> Figure:
    value = exposure_value(info.camera.lens.f_number, info.camera.exposure_time)
    setting = blender_exposure(value)
    title = f"False colours, EV {value:.2f} (Blender exposure {setting:.2f})"
    image = false_colour(scene_value(radiance, setting))
    figure, axes = _sheet(info, title, image.shape)
    axes.imshow(image, interpolation="nearest", extent=(0, image.shape[1], image.shape[0], 0))
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
    # Of the three entries about 0 EV only the middle one has room for its name.
    named = [step for step in LEGEND if "0.01" not in step.name]
    bar.set_yticks(
        [math.log2(step.value) for step in named], [f"{s.name}  {s.value:.4g}" for s in named]
    )
    bar.yaxis.tick_right()
    bar.grid(False)
    bar.set_xticks([])
    return figure
