"""The ``[camera.NAME]`` tables: preset, lens, detector and mount."""

from __future__ import annotations

import numpy as np

from simgl.errors import AssetError, ConfigError
from simgl.scenario.detectors import read_detector
from simgl.scenario.fields import craft_named, direction, exactly_one, fractions, place_on
from simgl.scenario.folder import Base, beside
from simgl.scenario.library import load_preset, preset_path
from simgl.scenario.optics import check_optics, read_lidar, read_optics
from simgl.scenario.optics_schema import OpticsTable
from simgl.scenario.schema import CameraTable
from simgl.scene.camera import Camera, Lens
from simgl.scene.spacecraft import SpacecraftModel
from simgl.scene.trajectory import BodyMount, FreeMount, Mount, OrbitingMount


def read_camera(
    where: str, name: str, table: CameraTable, sun_temperature: float, base: Base
) -> Camera:
    """A camera: its preset, changed where the table gives a key.

    sun_temperature : [K], of the spectrum that the quantum efficiency is averaged over
    base : folder that a relative preset path starts from
    """
    try:
        path = preset_path(table.preset, base)
        preset = load_preset(path)
    except AssetError as error:
        raise AssetError(f"{where}: preset: {error}") from None

    curves = beside(base, path) if table.preset.endswith(".toml") else path.parent
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


def read_mount(where: str, table: CameraTable, models: dict[str, SpacecraftModel]) -> Mount:
    """Where a camera sits and what it looks at; models by spacecraft name."""
    exactly_one(table, where, "mount", ("on", "about", "position_icrf_m"))

    def craft(key: str, name: str) -> str:
        return craft_named(name, models, where, key)

    look_at = None if table.look_at is None else craft("look_at", table.look_at)
    if table.about is not None:
        about = table.about
        for key in ("look_at", "boresight", "up"):
            if getattr(table, key) is not None:
                raise ConfigError(where, key, "contradicts about, which looks at its target")
        return OrbitingMount(
            target=craft("about.target", about.target),
            azimuth=np.radians(about.azimuth_deg),
            elevation=np.radians(about.elevation_deg),
            range=about.range_m,
        )
    if (look_at is None) == (table.boresight is None):
        raise ConfigError(where, "look_at", "or boresight is needed, and not both")
    boresight = direction(table.boresight or (1.0, 0.0, 0.0), where, "boresight")
    up = direction(table.up or (0.0, 0.0, -1.0), where, "up")
    if table.on is None:
        return FreeMount(
            position=np.array(table.position_icrf_m),
            boresight_icrf=boresight,
            up_icrf=up,
            look_at=look_at,
        )
    model = models[craft("on", table.on)]
    return BodyMount(
        spacecraft=table.on,
        position_body=place_on(model, table, where),
        boresight_body=boresight,
        up_body=up,
        look_at=look_at,
    )
