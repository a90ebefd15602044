"""Camera parameters that Basilisk does not send: from a file, or by automatic exposure."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from simgl.arrays import Array
from simgl.assess.exposure_advice import full_electrons
from simgl.camera.camera import Camera
from simgl.camera.camera_equation import irradiance_per_radiance, square_electrons_per_irradiance
from simgl.config.path_sandbox import Base, SandboxedFolder
from simgl.config.validation import convert, read_toml
from simgl.errors import ConfigError
from simgl.physics.constants import SOLAR_TEMPERATURE
from simgl.physics.regolith import face_on, geometric_albedo
from simgl.scenario.schema import CameraTable
from simgl.scene.state import EarthState, Sun

# Camera id: a 64-bit integer in Basilisk.
_ID = re.compile(r"-?[0-9]{1,18}")
# Basilisk sends these.
_SENT = (
    *("width_px", "height_px", "focal_length_mm", "focal_length_px", "principal_point_px"),
    *("skew_px", "calibration"),
    *("on", "position_body_m", "keypoint", "about", "position_icrf_m"),
    *("look_at", "boresight", "up"),
)

# Share of a pixel's range that the brightest surface fills: one stop is left for glints.
FILLED = 0.5
# Reflectance factor of the brightest surface where no single albedo is known: thick cloud under a
# high Sun, or white paint.
WHITE = 0.85


@dataclass(frozen=True, kw_only=True, eq=False)
class CameraOverrides:
    """Keys of a ``[camera.NAME]`` table.

    where : opens error messages
    base : folder of relative paths
    auto_exposed : no exposure time is given; see ``auto_exposed``
    sun_temperature : of the spectrum that bands are averaged over [K]
    """

    table: CameraTable
    where: str
    base: Base
    auto_exposed: bool = False
    sun_temperature: float = SOLAR_TEMPERATURE


DEFAULT_OVERRIDES = CameraOverrides(
    table=CameraTable(), where="camera", base=Path(), auto_exposed=True
)


def load_camera_file(path: Path, root: Path | None = None) -> CameraOverrides:
    """A camera file; raises ConfigError or AssetError with one clear line.

    root : folder that the files it names must lie in; None allows any
    """
    data = read_toml(path)
    for key in _SENT:
        if key in data:
            raise ConfigError(str(path), key, "comes from Basilisk; leave it out here")
    base: Base = path.parent if root is None else SandboxedFolder(path.parent, root.resolve())
    table = convert(data, CameraTable, str(path))
    auto_exposed = "exposure_time_s" not in data
    return CameraOverrides(table=table, where=str(path), base=base, auto_exposed=auto_exposed)


def load_camera_files(
    entries: list[str], root: Path | None = None, command: str = "simgl serve"
) -> dict[int, CameraOverrides]:
    """Camera files by camera id, from texts such as ``1=navcam.toml``.

    command : name of the command in error messages
    """
    overrides = {}
    for entry in entries:
        number, _, path = entry.partition("=")
        if not _ID.fullmatch(number.strip()) or not path:
            problem = f'must be ID=FILE such as 1=navcam.toml, got "{entry}"'
            raise ConfigError(command, "--camera", problem)
        if int(number) in overrides:
            raise ConfigError(command, "--camera", f"has camera {int(number)} twice")
        overrides[int(number)] = load_camera_file(Path(path), root)
    return overrides


def auto_exposed(camera: Camera, sun: Sun, globe: EarthState | None) -> Camera:
    """The camera with the exposure time that fills its pixels to ``FILLED`` in full sunlight.

    The reference surface is the planet at the scene's origin, at zero phase angle; clouds or white
    paint where the planet has maps or there is none. The exposure does not depend on what is in
    view, so the images of a series compare.
    """
    albedo, law = (None, None) if globe is None else (globe.earth.albedo, globe.earth.regolith)
    reflectance = np.full(4, WHITE) if albedo is None else np.asarray(albedo)
    if law is not None:
        reflectance = reflectance * (2.0 / 3.0 * face_on(law) / geometric_albedo(law))
    radiance = reflectance / np.pi * sun.seen_from(np.zeros(3)).irradiance
    irradiance: Array = irradiance_per_radiance(camera) * radiance
    square = square_electrons_per_irradiance(camera, sun.photons_per_joule)
    electrons = float((square @ irradiance).max())
    time = camera.exposure_time * FILLED * full_electrons(camera) / electrons
    return replace(camera, exposure_time=time)
