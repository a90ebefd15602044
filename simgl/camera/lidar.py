"""A flash LIDAR that shares a camera's lens and pixels, and its detection of a pulse."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from simgl.arrays import Array
from simgl.physics.constants import LIGHT_SPEED, PLANCK, SOLAR_TEMPERATURE
from simgl.physics.spectrum import BANDS, Bands, planck_radiance

# Full width at half maximum of a Gaussian in standard deviations.
_FWHM = 2.0 * np.sqrt(2.0 * np.log(2.0))

# Of an integral over a spectrum: Planck's law over 300 nm to 1e-6, corners of filters to 1 nm.
_STEPS = 300


@dataclass(frozen=True, kw_only=True)
class Lidar:
    """A pulsed emitter; the receiver is the camera's lens and pixels.

    wavelength : [m]
    pulse_energy : [J]
    pulse_length : full width at half maximum [s]
    half_angle : of the cone of uniform intensity about the boresight [rad]
    offset : of the emitter from the pinhole, camera axes [m]
    quantum_efficiency : electrons per photon
    filter_width : of the optical filter about the wavelength [m]
    gate : time during which sunlight is collected [s]
    range_noise : standard deviation of a range with ample signal [m]
    threshold : smallest signal that gives a range [e-]
    bands : that the scenario's light has
    sun_temperature : of the black body that stands for the Sun [K]
    """

    wavelength: float
    pulse_energy: float
    pulse_length: float
    half_angle: float
    offset: tuple[float, float, float]
    quantum_efficiency: float
    filter_width: float
    gate: float
    range_noise: float
    threshold: float
    bands: Bands = BANDS
    sun_temperature: float = SOLAR_TEMPERATURE

    @property
    def band(self) -> int:
        """Index of the band that contains the wavelength."""
        inside = [low <= self.wavelength <= high for low, high in self.bands.edges]
        return inside.index(True)

    @property
    def electrons_per_joule(self) -> float:
        """Electrons per energy that reaches a pixel [e- J-1]."""
        photons = self.wavelength / (PLANCK * LIGHT_SPEED)
        return self.quantum_efficiency * photons

    @property
    def filter_share(self) -> float:
        """Share of the sunlight in the band that the filter transmits.

        It is the Sun's spectrum within the filter that counts, and not the filter's width: from
        700 to 1000 nm sunlight falls by half.
        """
        low, high = self.bands.edges[self.band]
        half = 0.5 * self.filter_width
        first, last = max(self.wavelength - half, low), min(self.wavelength + half, high)
        passed = self._sunlight(first, last)
        return passed / self._sunlight(low, high)

    def _sunlight(self, first: float, last: float) -> float:
        """Sunlight between two wavelengths [m], in any unit."""
        edges = np.linspace(first, last, _STEPS + 1)
        middles = 0.5 * (edges[1:] + edges[:-1])
        light = planck_radiance(middles, self.sun_temperature) * self.bands.transmission(middles)
        return float(np.sum(light) * (last - first) / _STEPS)


def detected(
    lidar: Lidar, distance: Array, signal: Array, sunlight: Array, rng: np.random.Generator
) -> tuple[Array, Array]:
    """Ranges [m], 0 where none is detected, and counted electrons of one pulse.

    distance : half the path from the emitter via the surface to the pinhole [m]; 0 for no surface
    signal, sunlight : mean electrons of the pulse, and of sunlight while the gate is open [e-]
    rng : source of the noise

    Electrons are Poisson distributed. The range's variance is the sum of ``range_noise`` squared
    and the pulse's variance over the electrons.
    """
    counted = rng.poisson(signal + sunlight).astype(np.float64)
    detectable = (counted - sunlight >= lidar.threshold) & (distance > 0.0)
    pulse = LIGHT_SPEED * lidar.pulse_length / (2.0 * _FWHM)
    scatter = np.hypot(lidar.range_noise, pulse / np.sqrt(np.maximum(counted, 1.0)))
    ranges = np.where(detectable, distance + scatter * rng.standard_normal(distance.shape), 0.0)
    return ranges, counted
