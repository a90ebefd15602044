"""The ``[camera.NAME]`` tables: preset, lens, detector and mount."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from simgl.errors import AssetError, ConfigError
from simgl.physics.spectrum import photon_mean
from simgl.scenario.fields import Four, craft_named, direction, exactly_one, fractions, place_on
from simgl.scenario.library import load_preset
from simgl.scenario.optics import check_optics, read_lidar, read_optics
from simgl.scenario.optics_schema import OpticsTable
from simgl.scenario.schema import CameraPresetTable, CameraTable
from simgl.scene.camera import Camera, Detector, Lens
from simgl.scene.spacecraft import SpacecraftModel
from simgl.scene.trajectory import BodyMount, FreeMount, Mount, OrbitingMount


def _quantum_efficiency(
    table: CameraTable, preset: CameraPresetTable, temperature: float, where: str
) -> Four:
    """Per band: given, or the preset's curve averaged over the Sun's photons in the band."""
    if table.quantum_efficiency is not None:
        return fractions(table.quantum_efficiency, where, "quantum_efficiency")
    wavelength = np.array(preset.qe_wavelength_nm) * 1e-9
    red, green, blue, nir = photon_mean(wavelength, np.array(preset.qe), temperature).tolist()
    return red, green, blue, nir


def read_camera(
    where: str, name: str, table: CameraTable, sun_temperature: float, base: Path
) -> Camera:
    """A camera: its preset, changed where the table gives a key.

    sun_temperature : [K], of the spectrum that the quantum efficiency is averaged over
    base : folder that a relative preset path starts from
    """
    try:
        preset = load_preset(table.preset, base)
    except AssetError as error:
        raise AssetError(f"{where}: preset: {error}") from None

    def chosen(key: str) -> Any:
        own = getattr(table, key)
        return getattr(preset, key) if own is None else own

    bits, pedestal = chosen("bits"), chosen("pedestal_dn")
    if pedestal >= 2**bits - 1:
        problem = f"must lie below the largest DN, {2**bits - 1}, got {pedestal:g}"
        raise ConfigError(where, "pedestal_dn", problem)
    detector = Detector(
        width=chosen("width_px"),
        height=chosen("height_px"),
        pixel_pitch=chosen("pixel_pitch_um") * 1e-6,
        quantum_efficiency=_quantum_efficiency(table, preset, sun_temperature, where),
        full_well=chosen("full_well_e"),
        read_noise=chosen("read_noise_e"),
        bits=bits,
        pedestal=pedestal,
        gain_dn_per_e=1.0 / chosen("gain_e_per_dn"),
    )
    lens = Lens(
        focal_length=table.focal_length_mm * 1e-3,
        f_number=table.f_number,
        transmission=fractions(table.transmission, where, "transmission"),
        **read_optics(chosen("optics") or OpticsTable(), where, base),
    )
    camera = Camera(
        name=name,
        lens=lens,
        detector=detector,
        exposure_time=table.exposure_time_s,
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
