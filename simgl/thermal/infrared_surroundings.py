"""The Earth in the thermal infrared as a scene has it: what its passes take, and sunlight there."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from simgl.arrays import Array, Array32
from simgl.camera.infrared_detector import InfraredDetector
from simgl.physics.constants import SOLAR_TEMPERATURE, STEFAN_BOLTZMANN
from simgl.physics.earth_infrared import (
    SUNLIGHT_REFLECTED,
    clear_transmission,
    longwave_radiance,
    temperature_of_flux,
)
from simgl.physics.spectrum import Bands, black_body_light
from simgl.physics.thermal_radiation import band_photon_radiance, band_radiance
from simgl.scene.frost import year_share
from simgl.scene.state import EarthState, SceneState
from simgl.thermal.network import SPACE_TEMPERATURE

# Planck's law is looked up at so many temperatures up to the highest [K]: 1e-5 at 300 K in 3 to
# 5 um.
PLANCK_STEPS, HOTTEST = 4096, 1024.0


@dataclass(frozen=True, kw_only=True, eq=False)
class InfraredEarth:
    """The Earth in a band.

    transmission : of clear air at zenith, to space; 1 where emission has the air in it
    day : of the year
    everywhere : temperature of all the ground [K]; None for the climate's
    reflected : sunlight that ground under the Sun sends, in W and as counted [m-2 sr-1]
    """

    transmission: float
    day: float
    everywhere: float | None
    reflected: tuple[float, float]


@dataclass(frozen=True, kw_only=True, eq=False)
class InfraredSurroundings:
    """Earth and space in a band.

    planck : (PLANCK_STEPS, 2) float32, radiance of a black body at 0..``HOTTEST`` K, in
        W m-2 sr-1 and as the detector counts
    space : (2,) the same of deep space
    earth : None where there is none
    """

    planck: Array32
    space: tuple[float, float]
    earth: InfraredEarth | None


def surroundings_in_band(state: SceneState, detector: InfraredDetector) -> InfraredSurroundings:
    """As a detector sees them."""
    earth = None
    if state.earth is not None:
        sun = state.sun.seen_from(state.earth.position)
        total = total_sunlight(sun.irradiance, state.bands)
        one, other = (SUNLIGHT_REFLECTED / np.pi * total * x for x in sunlight_in_band(detector))
        clear = state.earth.earth.air is None or state.earth.earth.longwave is not None
        transmission = 1.0 if clear else clear_transmission(detector.band)
        earth = _earth(state, state.earth, transmission, (one, other))
    planck = _planck(detector.table.kind, detector.band)
    return InfraredSurroundings(planck=planck, space=space_in_band(detector), earth=earth)


def surroundings_at_all_wavelengths(state: SceneState) -> InfraredSurroundings:
    """Their long-wave heat; that of space, which a thermal network knows by itself, is left out."""
    earth = None
    law = "black body"
    if state.earth is not None:
        earth = _earth(state, state.earth, 1.0, (0.0, 0.0))
        if state.earth.earth.longwave is None:
            law = "clear air" if state.earth.earth.albedo is None else "usual clouds"
    return InfraredSurroundings(planck=_longwave(law), space=(0.0, 0.0), earth=earth)


def _earth(
    state: SceneState, about: EarthState, transmission: float, reflected: tuple[float, float]
) -> InfraredEarth:
    flux = about.earth.longwave
    return InfraredEarth(
        transmission=transmission,
        day=365.2425 * year_share(state.tai_ns),
        everywhere=None if flux is None else temperature_of_flux(flux),
        reflected=reflected,
    )


@lru_cache(maxsize=16)
def _planck(kind: str, band: tuple[float, float]) -> Array32:
    temperatures = np.linspace(0.0, HOTTEST, PLANCK_STEPS)[1:]
    counted = band_radiance if kind == "bolometer" else band_photon_radiance
    columns = [radiance(band, temperatures) for radiance in (band_radiance, counted)]
    return np.concatenate([np.zeros((1, 2)), np.stack(columns, axis=1)]).astype(np.float32)


@lru_cache(maxsize=3)
def _longwave(law: str) -> Array32:
    """As ``planck`` of the surroundings at all wavelengths."""
    temperatures = np.linspace(0.0, HOTTEST, PLANCK_STEPS)
    if law == "black body":
        radiance = STEFAN_BOLTZMANN / np.pi * temperatures**4
    else:
        radiance = longwave_radiance(temperatures, separate_clouds=law == "clear air")
    return np.stack([radiance, radiance], axis=1).astype(np.float32)


def total_sunlight(irradiance: Array, bands: Bands) -> float:
    """Over all wavelengths of what is in the bands (4,), of the Sun or reflected [W m-2].

    What is reflected beyond the bands is so as in their mean.
    """
    return float(irradiance.sum()) / share_in_bands(bands)


@lru_cache(maxsize=16)
def share_in_bands(bands: Bands) -> float:
    """Of all sunlight what is in bands, and passes their filter.

    The Sun is a black body of 5772 K: another temperature by 5 K changes this by 0.02 %.
    """
    return float(black_body_light(1.0, SOLAR_TEMPERATURE, bands).irradiance.sum())


@lru_cache(maxsize=16)
def sunlight_in_band(detector: InfraredDetector) -> tuple[float, float]:
    """For each W m-2 of sunlight what is in a detector's band, in W and as it counts [m-2]."""
    total = STEFAN_BOLTZMANN * SOLAR_TEMPERATURE**4 / np.pi
    sun = np.array(SOLAR_TEMPERATURE)
    return float(detector.watts(sun)) / total, float(detector.emission(sun)) / total


@lru_cache(maxsize=16)
def space_in_band(detector: InfraredDetector) -> tuple[float, float]:
    """Radiance of deep space, in W and as a detector counts [m-2 sr-1]."""
    space = np.array(SPACE_TEMPERATURE)
    return float(detector.watts(space)), float(detector.emission(space))
