"""Camera presets by name or file, and cameras from ``[camera.NAME]`` tables."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

from msgspec.structs import replace

from simgl import assets
from simgl.camera.calibration import Calibration, read_calibration
from simgl.camera.camera import Camera, Detector, Lens
from simgl.camera.camera_schema import (
    MAX_EDGE,
    CalibrationTable,
    CameraPresetTable,
    CameraSettingsTable,
)
from simgl.camera.detector_tables import read_detector, read_event_sensor
from simgl.camera.lens_schema import OpticsTable
from simgl.camera.lens_tables import check_optics, read_lidar, read_optics
from simgl.camera.thermal_tables import read_thermal, thermal_pixels
from simgl.config.path_sandbox import Base, folder_of
from simgl.config.validation import convert, read_toml, shown
from simgl.config.value_types import fractions
from simgl.errors import AssetError, ConfigError, did_you_mean
from simgl.physics.spectrum import BANDS, Bands


def shipped_presets() -> list[str]:
    """Names of the camera presets in the package."""
    return sorted(p.stem for p in (assets.data() / "cameras").glob("*.toml"))


def preset_path(name: str, base: Base = Path()) -> Path:
    """The file of a camera preset, given by its name or by the path of a .toml file.

    Raises AssetError for unknown names and for paths outside the sandbox of ``base``.
    """
    if name.endswith(".toml"):
        return base / name
    if name not in shipped_presets():
        raise AssetError(f'no camera preset "{name}"; {did_you_mean(name, shipped_presets())}')
    return assets.data() / "cameras" / f"{name}.toml"


def load_preset(path: Path) -> CameraPresetTable:
    """Read a camera preset; ConfigError for impossible values."""
    return convert(read_toml(path), CameraPresetTable, str(path))


def read_camera(
    where: str,
    name: str,
    table: CameraSettingsTable,
    sun_temperature: float,
    base: Base,
    bands: Bands = BANDS,
) -> Camera:
    """A camera: its preset with the overrides of the table.

    where : of the table, for errors
    sun_temperature : of the spectrum that weights the quantum efficiency [K]
    base : folder of relative paths
    bands : that the scenario's light has

    Raises ConfigError for impossible values, AssetError for missing files.
    """
    thermal = read_thermal(where, table)
    try:
        path = preset_path(table.preset, base)
        preset = load_preset(path)
    except AssetError as error:
        raise AssetError(f"{where}: preset: {error}") from None

    curves = folder_of(path, base) if table.preset.endswith(".toml") else path.parent
    calibration = _calibration(where, table, base)
    if calibration is not None:
        table = _with_size(where, table, calibration)
    detector = read_detector(where, name, table, preset, path, sun_temperature, curves, bands)
    if thermal is not None:
        detector = thermal_pixels(thermal, bands, detector.serial)
    optics = table.optics or preset.optics or OpticsTable()
    if calibration is not None:
        optics = replace(optics, distortion=None)
    transmission = fractions(table.transmission, where, "transmission")
    lens = Lens(
        f_number=table.f_number if thermal is None else thermal.table.f_number,
        transmission=bands.of_rgbn(transmission, sun_temperature),
        **_image_plane(where, table, calibration, detector),
        **read_optics(optics, where, base),
    )
    if calibration is not None:
        lens = dataclasses.replace(lens, distortion=calibration.distortion)
    camera = Camera(
        name=name,
        lens=lens,
        detector=detector,
        exposure_time=table.exposure_time_s if thermal is None else thermal.exposure_time,
        readout_time=table.readout_time_s,
        transport_latency=table.transport_latency_s,
        lidar=read_lidar(table.lidar, bands, sun_temperature, where),
        event_sensor=read_event_sensor(where, table.event_sensor, detector),
        thermal=thermal,
    )
    check_optics(camera, where)
    return camera


_DEFAULT_FOCAL_LENGTH_MM = 13.0
# Focal length along columns over that along rows, of pixels that anybody makes.
_MAX_ASPECT = 4.0
# Skew over the focal length; 45 deg between the axes.
_MAX_SKEW = 1.0


def _calibration(where: str, table: CameraSettingsTable, base: Base) -> Calibration | None:
    """The calibration that a table names; None where it names none."""
    if table.calibration is None:
        return None
    for key in ("focal_length_mm", "focal_length_px", "principal_point_px", "skew_px"):
        if getattr(table, key) is not None:
            raise ConfigError(where, key, "contradicts calibration, which has it")
    if table.optics is not None and table.optics.distortion is not None:
        raise ConfigError(where, "optics.distortion", "contradicts calibration, which has it")
    given = table.calibration
    if isinstance(given, str):
        given = CalibrationTable(file=given)
    try:
        return read_calibration(base / given.file, given.camera)
    except AssetError as error:
        raise AssetError(f"{where}: calibration: {error}") from None


def _with_size(
    where: str, table: CameraSettingsTable, calibration: Calibration
) -> CameraSettingsTable:
    """The table with the image size of its calibration, where that tells it."""
    if calibration.binning != (1, 1) and table.pixel_pitch_um is None:
        across, down = calibration.binning
        problem = (
            f"is missing; calibration is of pixels binned {across} x {down}, which get more light"
        )
        raise ConfigError(where, "pixel_pitch_um", problem)
    size = calibration.size
    if size is None:
        return table
    for key, given, calibrated in zip(
        ("width_px", "height_px"), (table.width_px, table.height_px), size, strict=True
    ):
        if calibrated > MAX_EDGE:
            problem = f"is of {size[0]} x {size[1]} pixels, at most {MAX_EDGE} along an edge"
            raise ConfigError(where, "calibration", problem)
        if given not in (None, calibrated):
            problem = f"must be {calibrated} as in calibration, or left out, got {given}"
            raise ConfigError(where, key, problem)
    return replace(table, width_px=size[0], height_px=size[1])


def _image_plane(
    where: str, table: CameraSettingsTable, calibration: Calibration | None, detector: Detector
) -> dict[str, Any]:
    """Arguments of a Lens that say where the normalised image plane lies on the detector."""
    size, pitch = (detector.width, detector.height), detector.pixel_pitch
    if table.focal_length_mm is not None and table.focal_length_px is not None:
        raise ConfigError(where, "focal_length_px", "contradicts focal_length_mm; give one of them")
    point, skew, key = table.principal_point_px, table.skew_px or 0.0, "{}_px"
    focal = table.focal_length_px
    if calibration is not None:
        point, skew, key = calibration.principal_point, calibration.skew, "calibration"
        focal = calibration.focal_length
    fx, fy = focal if isinstance(focal, tuple) else (focal, focal)
    if fx is None or fy is None:
        mm = _DEFAULT_FOCAL_LENGTH_MM if table.focal_length_mm is None else table.focal_length_mm
        focal_length, aspect = mm * 1e-3, 1.0
    elif fx > 0.0 and fy > 0.0:
        focal_length, aspect = fx * pitch, fy / fx
    else:
        problem = f"must hold positive focal lengths, got {fx:g} and {fy:g}"
        raise ConfigError(where, key.format("focal_length"), problem)
    if not 1.0 / _MAX_ASPECT <= aspect <= _MAX_ASPECT:
        problem = f"must hold focal lengths within a factor of {_MAX_ASPECT:g}, got {aspect:g}"
        raise ConfigError(where, key.format("focal_length"), problem)
    skew *= pitch / focal_length
    if not abs(skew) <= _MAX_SKEW:
        problem = f"must lie within +-{_MAX_SKEW:g} of the focal length, got {skew:g} of it"
        raise ConfigError(where, key.format("skew"), problem)
    offset = (0.0, 0.0)
    if point is not None:
        for one, pixels in zip(point, size, strict=True):
            if not -pixels <= one <= 2 * pixels:
                problem = (
                    f"must hold a principal point within an image's size around the image, "
                    f"got {shown([*point])} for {size[0]} x {size[1]} pixels"
                )
                raise ConfigError(where, key.format("principal_point"), problem)
        offset = (point[0] - 0.5 * size[0]) * pitch, (point[1] - 0.5 * size[1]) * pitch
    return {
        "focal_length": focal_length,
        "aspect": aspect,
        "skew": skew,
        "principal_offset": offset,
    }
