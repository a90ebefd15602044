"""Detectors and event sensors from preset files and ``[camera.NAME]`` tables."""

from __future__ import annotations

import zlib
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from simgl.arrays import Array
from simgl.camera.camera_schema import (
    CameraPresetTable,
    CameraSettingsTable,
    CurveTable,
    EventSensorTable,
    ParticlesTable,
)
from simgl.camera.detector import (
    REFERENCE_TEMPERATURE,
    Detector,
    FixedPattern,
    Mosaic,
    Particles,
)
from simgl.camera.event_sensor import EventSensor
from simgl.camera.spectral_response import ResponseCurve
from simgl.config.curve_files import check_wavelengths, read_curve_file
from simgl.config.path_sandbox import Base
from simgl.config.validation import exactly_one
from simgl.config.value_types import fractions
from simgl.errors import ConfigError
from simgl.physics.spectrum import (
    BANDS,
    LONGEST_NM,
    SHORTEST_NM,
    Bands,
    Curve,
    PerBand,
    channels,
    photon_mean,
)

_PATTERN_KEYS = {
    "prnu": "prnu",
    "dead_pixels": "dead_pixels",
    "dsnu": "dsnu_e",
    "rows": "row_pattern_e",
    "columns": "column_pattern_e",
    "hot_pixels": "hot_pixels",
    "hot_current": "hot_current_e_s",
}

# Curves are multiplied at these wavelengths [nm]: all that bands may hold, in steps of 1 nm.
_WAVELENGTHS: Array = np.linspace(SHORTEST_NM, LONGEST_NM, 2201)


def _curve(table: CurveTable, path: Path, key: str, folder: Base) -> Curve:
    """A preset's curve."""
    where = str(path)
    exactly_one({"value": table.value, "csv": table.csv}, where, key)
    wavelength: Any = table.wavelength_nm
    value: Any = table.value
    if table.csv is not None:
        if wavelength is not None:
            raise ConfigError(where, f"{key}.wavelength_nm", "contradicts csv; give one of them")
        file, wavelength, value = read_curve_file(table.csv, folder, where, f"{key}.csv")
        where = str(file)
    if wavelength is None or len(wavelength) != len(value):
        raise ConfigError(where, f"{key}.value", f"needs one number for each {key}.wavelength_nm")
    check_wavelengths(where, f"{key}.wavelength_nm", wavelength)
    for one in value:
        if not 0.0 <= one <= 1.0:
            raise ConfigError(where, f"{key}.value", f"must lie in 0..1, got {one:g}")
    return tuple(wavelength), tuple(value)


def _sampled(curves: Sequence[Curve]) -> Array:
    """(2201,) product of curves at ``_WAVELENGTHS``."""
    product = np.ones(len(_WAVELENGTHS))
    for wavelength, value in curves:
        product = product * np.interp(_WAVELENGTHS, wavelength, value, left=0.0, right=0.0)
    return product


class SpectralResponse:
    """Electrons per photon of a preset's pixels in each band, weighted by the Sun's photons."""

    def __init__(
        self,
        preset: CameraPresetTable,
        path: Path,
        sun_temperature: float,
        bands: Bands = BANDS,
        qe: PerBand | None = None,
        folder: Base | None = None,
    ) -> None:
        """
        path : of the preset
        sun_temperature : [K]
        bands : that the scenario's light has
        qe : of pixels without filter, instead of the preset's curves
        folder : base of the curves' CSV paths; by default the preset's folder
        """
        folder = path.parent if folder is None else folder
        self._temperature = sun_temperature
        self._bands = bands
        self._qe = qe
        self._common = [_curve(preset.qe, path, "qe", folder)]
        for key in ("window", "micro_lens"):
            table = getattr(preset, key)
            if table is not None:
                self._common.append(_curve(table, path, key, folder))
        filters = {} if preset.filters is None else msgspec.structs.asdict(preset.filters)
        self._filters = {
            colour: _curve(table, path, f"filters.{colour}", folder)
            for colour, table in filters.items()
        }

    @property
    def has_filters(self) -> bool:
        """Whether the preset has colour filters."""
        return bool(self._filters)

    def plain(self) -> PerBand:
        """Quantum efficiency of a pixel without filter in each band."""
        return self._over_bands(self._common) if self._qe is None else self._qe

    def under(self, colour: str) -> PerBand:
        """Quantum efficiency of a pixel under a filter, "red", "green" or "blue"."""
        if self._qe is None:
            return self._over_bands([*self._common, self._filters[colour]])
        share = self._over_bands([self._filters[colour]])
        return channels(a * f for a, f in zip(self._qe, share, strict=True))

    def curve(self, colour: str | None = None) -> ResponseCurve:
        """The same over wavelength, of a pixel without filter or under one."""
        filters = () if colour is None else (self._filters[colour],)
        if self._qe is not None:
            return ResponseCurve(bands=self._qe, intervals=self._bands, factors=filters)
        return ResponseCurve(intervals=self._bands, factors=(*self._common, *filters))

    def _over_bands(self, curves: Sequence[Curve]) -> PerBand:
        """Mean of a product of curves in each band, weighted by the Sun's photons."""
        product = _sampled(curves)
        a, b, c, d = photon_mean(1e-9 * _WAVELENGTHS, product, self._temperature, self._bands)
        return float(a), float(b), float(c), float(d)


def read_detector(
    where: str,
    camera: str,
    table: CameraSettingsTable,
    preset: CameraPresetTable,
    path: Path,
    sun_temperature: float,
    folder: Base,
    bands: Bands = BANDS,
) -> Detector:
    """A preset's detector with the overrides of a ``[camera.NAME]`` table.

    where : of the table, for errors
    camera : name of the camera
    path : of the preset
    sun_temperature : of the spectrum that weights the curves [K]
    folder : base of the curves' CSV paths
    bands : that the scenario's light has

    Raises ConfigError for impossible values, AssetError for missing files.
    """

    def chosen(key: str, default: Any = 0.0) -> Any:
        given = getattr(table, key)
        given = getattr(preset, key) if given is None else given
        return default if given is None else given

    _refuse_without_effect(where, table, chosen)
    qe = table.quantum_efficiency
    given_qe = None
    if qe is not None:
        of_rgbn = fractions(qe, where, "quantum_efficiency")
        given_qe = bands.of_rgbn(of_rgbn, sun_temperature)
    response = SpectralResponse(preset, path, sun_temperature, bands, given_qe, folder)
    return Detector(
        width=chosen("width_px"),
        height=chosen("height_px"),
        pixel_pitch=chosen("pixel_pitch_um") * 1e-6,
        quantum_efficiency=response.plain(),
        fill_factor=chosen("fill_factor", 1.0),
        mosaic=_mosaic(where, chosen("mosaic", "mono"), response, table.preset),
        curve=response.curve(),
        full_well=chosen("full_well_e"),
        read_noise=chosen("read_noise_e"),
        bits=chosen("bits"),
        pedestal=_pedestal(where, chosen("pedestal_dn"), chosen("bits")),
        gain_dn_per_e=chosen("analogue_gain", 1.0) / chosen("gain_e_per_dn"),
        dark_current_300k=chosen("dark_current_e_s"),
        temperature=chosen("temperature_k", REFERENCE_TEMPERATURE),
        pattern=FixedPattern(**{name: chosen(key) for name, key in _PATTERN_KEYS.items()}),
        serial=zlib.crc32(camera.encode()) if table.serial is None else table.serial,
        row_noise=chosen("row_noise_e"),
        blooming=chosen("blooming"),
        particles=_particles(chosen("particles", None)),
        row_time=_row_time(where, chosen("shutter", "global"), chosen("row_time_us", None)),
        bands=bands,
    )


def read_event_sensor(
    where: str, table: EventSensorTable | None, detector: Detector
) -> EventSensor | None:
    """The event sensor of a camera with these pixels; None without a table."""
    if table is None:
        return None
    if not detector.dark_current > 0.0:
        problem = "must be above 0 with an event_sensor: the logarithm of no light has no value"
        raise ConfigError(where, "dark_current_e_s", problem)
    return EventSensor(
        threshold_on=table.threshold_on,
        threshold_off=table.threshold_off,
        threshold_spread=table.threshold_spread,
        refractory_time=table.refractory_us * 1e-6,
        leak_rate=table.leak_hz,
        shot_noise_rate=table.shot_noise_hz,
    )


def _refuse_without_effect(
    where: str, table: CameraSettingsTable, chosen: Callable[[str, Any], Any]
) -> None:
    """Raise ConfigError for keys of a camera that mean nothing without another one."""
    if table.row_time_us is not None and chosen("shutter", "global") == "global":
        raise ConfigError(where, "row_time_us", 'requires shutter = "rolling"')
    for key, partner in (("hot_pixels", "hot_current_e_s"), ("hot_current_e_s", "hot_pixels")):
        if getattr(table, key) and chosen(partner, None) is None:
            raise ConfigError(where, key, f"requires {partner}, which is missing")


def _pedestal(where: str, pedestal: float, bits: int) -> float:
    largest = 2**bits - 1
    if pedestal >= largest:
        problem = f"must lie below the largest DN, {largest}, got {pedestal:g}"
        raise ConfigError(where, "pedestal_dn", problem)
    return pedestal


def _mosaic(where: str, order: str, response: SpectralResponse, preset: str) -> Mosaic | None:
    if order == "mono":
        return None
    if not response.has_filters:
        raise ConfigError(where, "mosaic", f'needs filters, which preset "{preset}" has not')
    return Mosaic(
        order=order,
        red=response.under("red"),
        green=response.under("green"),
        blue=response.under("blue"),
        curves=(response.curve("red"), response.curve("green"), response.curve("blue")),
    )


def _particles(table: ParticlesTable | None) -> Particles | None:
    if table is None or table.flux_cm2_s == 0.0:
        return None
    return Particles(
        flux=table.flux_cm2_s * 1e4, depth=table.depth_um * 1e-6, charge=table.charge_e_um * 1e6
    )


def _row_time(where: str, shutter: str, row_time_us: float | None) -> float:
    if shutter == "global":
        return 0.0
    if row_time_us is None:
        raise ConfigError(where, "row_time_us", 'is missing; shutter = "rolling" needs it')
    return row_time_us * 1e-6
