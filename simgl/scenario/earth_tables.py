"""The ground, the sea and the clouds of the ``[earth]`` table."""

from __future__ import annotations

from pathlib import Path

from simgl.config.path_sandbox import Base
from simgl.errors import AssetError, ConfigError
from simgl.scenario.schema import CloudsTable, EarthTable
from simgl.scene.earth import Clouds, Earth, EarthMaps
from simgl.scene.image_files import read_picture

# Keys of what an Earth with an albedo given by hand, or none at all, does not have.
_OF_MAPS = (
    "wind_m_s",
    "moonlight",
    "airglow",
    "clouds",
    "land_picture",
    "water_picture",
    "night_picture",
)


def refuse_ground(table: EarthTable, where: str, because: str) -> None:
    """Raises ConfigError where the table asks for what only an Earth with maps has."""
    for key in _OF_MAPS:
        if getattr(table, key) is not None:
            raise ConfigError(where, key, f"goes with an Earth that has maps, got {because}")


def read_ground(
    table: EarthTable, where: str, base: Base
) -> tuple[float, Clouds | None, EarthMaps]:
    """Wind [m s-1], clouds and maps; relative paths start at ``base``."""
    wind = Earth.wind if table.wind_m_s is None else table.wind_m_s
    maps = EarthMaps(
        land=_picture(table.land_picture, where, "land_picture", "RGB", base),
        water=_picture(table.water_picture, where, "water_picture", "L", base),
        night=_picture(table.night_picture, where, "night_picture", "L", base),
    )
    return wind, _clouds(table.clouds or CloudsTable(), f"{where[:-1]}.clouds]", base), maps


def _clouds(table: CloudsTable, where: str, base: Base) -> Clouds | None:
    if table.picture is None:
        if table.optical_thickness is not None:
            raise ConfigError(where, "optical_thickness", "goes with picture, which is missing")
        if table.cover == 0.0:
            return None
        return Clouds(
            cover=Clouds.cover if table.cover is None else table.cover,
            seed=Clouds.seed if table.seed is None else table.seed,
            height=table.height_km * 1e3,
        )
    for key in ("cover", "seed"):
        if getattr(table, key) is not None:
            raise ConfigError(where, key, "contradicts picture, which says where clouds are")
    thickness = table.optical_thickness
    return Clouds(
        picture=_picture(table.picture, where, "picture", "L", base),
        height=table.height_km * 1e3,
        thickness=Clouds.thickness if thickness is None else thickness,
    )


def _picture(name: str | None, where: str, key: str, mode: str, base: Base) -> Path | None:
    """The path of a picture that was read once to see that it is whole."""
    if name is None:
        return None
    try:
        path = base / name
        read_picture(path, mode)
    except AssetError as error:
        raise ConfigError(where, key, str(error)) from None
    return path
