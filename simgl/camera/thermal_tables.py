"""Thermal cameras from ``[camera.NAME.thermal]`` tables."""

from __future__ import annotations

import math

from msgspec import structs

from simgl.camera.camera_schema import (
    CameraSettingsTable,
    DetectorTable,
    ThermalCameraTable,
)
from simgl.camera.detector import Detector
from simgl.camera.infrared_detector import (
    InfraredDetector,
    InfraredDetectorTable,
    load_infrared_detector,
)
from simgl.errors import AssetError, ConfigError
from simgl.physics.spectrum import Bands

# Wavelengths that Planck's law of anything in orbit reaches [um].
_SHORTEST, _LONGEST = 1.0, 100.0
# Keys of a camera that a thermal detector has, too.
_SHARED = {"width_px", "height_px", "pixel_pitch_um"}
_VISIBLE = sorted(
    {field.name for field in structs.fields(DetectorTable)} - _SHARED
    | {"optics", "lidar", "event_sensor", "quantum_efficiency"}
)
# The same with a default, which stands for a key that is not given.
_VISIBLE_DEFAULTS = ("preset", "f_number", "exposure_time_s", "transmission")
_ELSEWHERE = {
    "f_number": "thermal.f_number",
    "exposure_time_s": "thermal.integration_time_ms",
    "transmission": "thermal.transmission",
    "preset": "thermal.detector",
}
_OF_KIND = {"netd_mk": "bolometer", "range_k": "bolometer", "integration_time_ms": "photon"}


def read_thermal(where: str, table: CameraSettingsTable) -> InfraredDetector | None:
    """The thermal detector of a camera; None where it sees visible light.

    Raises ConfigError for keys that contradict it, AssetError for an unknown preset.
    """
    given = table.thermal
    if given is None:
        return None
    for key in (*_VISIBLE, *_VISIBLE_DEFAULTS):
        default = next(f.default for f in structs.fields(CameraSettingsTable) if f.name == key)
        if getattr(table, key) != default:
            instead = f"; write {_ELSEWHERE[key]}" if key in _ELSEWHERE else ""
            raise ConfigError(where, key, f"is not allowed with thermal{instead}")
    try:
        preset = load_infrared_detector(given.detector)
    except AssetError as error:
        raise AssetError(f"{where}: thermal.detector: {error}") from None
    for key, kind in _OF_KIND.items():
        if getattr(given, key) is not None and preset.table.kind != kind:
            problem = f"requires a {kind} detector; {given.detector} is none"
            raise ConfigError(where, f"thermal.{key}", problem)
    _check_order(where, "thermal.band_um", given.band_um, (_SHORTEST, _LONGEST))
    _check_order(where, "thermal.range_k", given.range_k, (100.0, 3000.0))
    return InfraredDetector(
        name=preset.name,
        table=_overridden(preset.table, table, given),
        minutes_since_shutter=given.minutes_since_shutter,
    )


def _overridden(
    preset: InfraredDetectorTable, table: CameraSettingsTable, given: ThermalCameraTable
) -> InfraredDetectorTable:
    overrides = {key: getattr(table, key) for key in _SHARED}
    overrides |= {
        key: value
        for key, value in structs.asdict(given).items()
        if key not in ("detector", "minutes_since_shutter")
    }
    return structs.replace(preset, **{k: v for k, v in overrides.items() if v is not None})


def _check_order(
    where: str, key: str, pair: tuple[float, float] | None, limits: tuple[float, float]
) -> None:
    if pair is None:
        return
    low, high = pair
    if not limits[0] <= low < high <= limits[1]:
        allowed = f"must rise within {limits[0]:g}..{limits[1]:g}"
        raise ConfigError(where, key, f"{allowed}, got {low:g} and {high:g}")


def thermal_pixels(thermal: InfraredDetector, bands: Bands, serial: int) -> Detector:
    """The pixels and the converter of a thermal detector, for what any image has.

    Without noise of their own: that is the thermal detector's. A pixel counts in DN.
    """
    t = thermal.table
    levels = float(thermal.levels)
    return Detector(
        width=t.width_px,
        height=t.height_px,
        pixel_pitch=1e-6 * t.pixel_pitch_um,
        quantum_efficiency=(0.0, 0.0, 0.0, 0.0),
        full_well=levels,
        read_noise=0.0,
        bits=round(math.log2(levels)),
        pedestal=0.0,
        gain_dn_per_e=1.0,
        serial=serial,
        bands=bands,
    )
