"""Camera presets by name or file, and cameras from ``[camera.NAME]`` tables."""

from __future__ import annotations

from pathlib import Path

from simgl import assets
from simgl.camera.camera import Camera, Lens
from simgl.camera.camera_schema import CameraPresetTable, CameraSettingsTable
from simgl.camera.detector_tables import read_detector
from simgl.camera.lens_schema import OpticsTable
from simgl.camera.lens_tables import check_optics, read_lidar, read_optics
from simgl.config.path_sandbox import Base, folder_of
from simgl.config.validation import convert, read_toml
from simgl.config.value_types import fractions
from simgl.errors import AssetError, did_you_mean


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
    where: str, name: str, table: CameraSettingsTable, sun_temperature: float, base: Base
) -> Camera:
    """A camera: its preset with the overrides of the table.

    where : of the table, for errors
    sun_temperature : of the spectrum that weights the quantum efficiency [K]
    base : folder of relative paths

    Raises ConfigError for impossible values, AssetError for missing files.
    """
    try:
        path = preset_path(table.preset, base)
        preset = load_preset(path)
    except AssetError as error:
        raise AssetError(f"{where}: preset: {error}") from None

    curves = folder_of(path, base) if table.preset.endswith(".toml") else path.parent
    detector = read_detector(where, name, table, preset, path, sun_temperature, curves)
    optics = table.optics or preset.optics or OpticsTable()
    lens = Lens(
        focal_length=table.focal_length_mm * 1e-3,
        f_number=table.f_number,
        transmission=fractions(table.transmission, where, "transmission"),
        **read_optics(optics, where, base),
    )
    camera = Camera(
        name=name,
        lens=lens,
        detector=detector,
        exposure_time=table.exposure_time_s,
        readout_time=table.readout_time_s,
        transport_latency=table.transport_latency_s,
        lidar=read_lidar(table.lidar),
    )
    check_optics(camera, where)
    return camera
