"""Camera parameters that Basilisk does not send: exposure, lens and detector, from a file."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

from simgl.config.path_sandbox import Base, SandboxedFolder
from simgl.config.validation import convert, read_toml
from simgl.errors import ConfigError
from simgl.physics.constants import SOLAR_TEMPERATURE
from simgl.scenario.schema import CameraTable

# Camera id: a 64-bit integer in Basilisk.
_ID = re.compile(r"-?[0-9]{1,18}")
# Basilisk sends these.
_SENT = (
    *("width_px", "height_px", "focal_length_mm"),
    *("on", "position_body_m", "keypoint", "about", "position_icrf_m"),
    *("look_at", "boresight", "up"),
)


@dataclass(frozen=True, kw_only=True, eq=False)
class CameraOverrides:
    """Keys of a ``[camera.NAME]`` table.

    where : opens error messages
    base : folder of relative paths
    auto_exposed : no exposure time is given; ``auto_exposure`` computes it
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
