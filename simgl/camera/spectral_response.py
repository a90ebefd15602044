"""Electrons per photon over wavelength, and of light with another spectrum than sunlight.

A camera sees all light in up to four bands, whose quantum efficiencies are means for sunlight.
Light of another spectrum gives the electrons of sunlight times a ratio for each band
(``sunlight_ratio``): such a camera is shown that light multiplied by the ratio.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from simgl.arrays import Array
from simgl.physics.constants import LIGHT_SPEED, PLANCK
from simgl.physics.spectrum import BANDS, CHANNELS, Bands, Curve, LineSpectrum, PerBand, band_of


@dataclass(frozen=True, kw_only=True)
class ResponseCurve:
    """Quantum efficiency of a pixel over wavelength.

    bands : electrons per photon, the same all over each band
    intervals : those bands
    factors : curves that multiply it: quantum efficiency, window, filter; each is linear between
        its points and 0 outside
    """

    bands: PerBand = (1.0, 1.0, 1.0, 1.0)
    intervals: Bands = BANDS
    factors: tuple[Curve, ...] = ()

    def at(self, wavelength: Array) -> Array:
        """(n,) electrons per photon at wavelengths (n,) [m]; 0 outside of all bands."""
        band = band_of(wavelength, self.intervals)
        result = np.where(band < 0, 0.0, np.array(self.bands)[band])
        for nm, value in self.factors:
            result = result * np.interp(wavelength * 1e9, nm, value, left=0.0, right=0.0)
        return result


def sunlight_ratio(
    spectrum: LineSpectrum, response: ResponseCurve, electrons_per_joule: Array
) -> Array:
    """(4,) electrons of light of a spectrum over those of as many watts of sunlight, per band.

    response : of a pixel
    electrons_per_joule : (4,) of the pixel for sunlight: photons per joule times its quantum
        efficiency in the band [J-1]

    1 in bands without light, and 0 where the pixel is blind.
    """
    photons = spectrum.share * spectrum.wavelength / (PLANCK * LIGHT_SPEED)
    electrons = photons * response.at(spectrum.wavelength)
    band = band_of(spectrum.wavelength, response.intervals)
    ratio = np.ones(CHANNELS)
    for index in range(CHANNELS):
        light = band == index
        watts = float(np.sum(spectrum.share[light]))
        if watts > 0.0:
            per_joule = float(np.sum(electrons[light])) / watts
            blind = per_joule == 0.0
            ratio[index] = 0.0 if blind else per_joule / electrons_per_joule[index]
    return ratio
