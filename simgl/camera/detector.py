"""A detector as data: pixels, fixed pattern, dark current, shutter and converter."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np

from simgl.arrays import Array
from simgl.camera.spectral_response import ResponseCurve
from simgl.physics.spectrum import BANDS, Bands, PerBand
from simgl.value_checks import (
    LARGEST_SEED,
    check_bands,
    check_choice,
    check_integer,
    check_positive,
    check_within,
)

ORDERS = ("RGGB", "BGGR", "GRBG", "GBRG")

_BOLTZMANN_EV = 8.617333262e-5  # [eV K-1] CODATA 2018
REFERENCE_TEMPERATURE = 300.0  # [K] of stated dark currents

# DN are uint16.
MAX_BITS = 16

# More pixels along an edge than any OpenGL driver draws.
_LARGEST_EDGE = 2**20


def band_gap(temperature: float) -> float:
    """Band gap of silicon [eV]: 1.1557 - 7.021e-4 T^2 / (T + 1108) (Varshni 1967).

    temperature : T [K]
    """
    return 1.1557 - 7.021e-4 * temperature**2 / (temperature + 1108.0)


def _depletion_current(temperature: float) -> float:
    """T^1.5 exp(-E / 2kT) [K^1.5]."""
    exponent = band_gap(temperature) / (2.0 * _BOLTZMANN_EV * temperature)
    return float(temperature**1.5 * np.exp(-exponent))


def dark_current_ratio(temperature: float) -> float:
    """Dark current at a temperature relative to that at 300 K.

    temperature : T [K]

    Generation in the depletion region, proportional to T^1.5 exp(-E / 2kT) with the band gap E,
    which doubles every 8 K. In warm sensors diffusion dominates, which follows exp(-E / kT) and
    doubles every 5 to 7 K, as data sheets say.
    """
    return _depletion_current(temperature) / _depletion_current(REFERENCE_TEMPERATURE)


@dataclass(frozen=True, kw_only=True)
class Mosaic:
    """Colour filters over squares of 2 x 2 pixels (Bayer).

    order : colours of the square row by row from the top left, one of ``ORDERS``
    red, green, blue : electrons per photon in each band of a pixel under that filter
    curves : the same of red, green and blue over wavelength; None where it is constant in each band
    """

    order: str
    red: PerBand
    green: PerBand
    blue: PerBand
    curves: tuple[ResponseCurve, ResponseCurve, ResponseCurve] | None = field(
        default=None, repr=False
    )

    def __post_init__(self) -> None:
        check_choice("mosaic: order", self.order, ORDERS)
        for colour in ("red", "green", "blue"):
            check_bands(f"mosaic: {colour}", getattr(self, colour))

    @property
    def square(self) -> tuple[PerBand, PerBand, PerBand, PerBand]:
        """Electrons per photon of the pixels (0, 0), (1, 0), (0, 1), (1, 1), column first."""
        colours = {"R": self.red, "G": self.green, "B": self.blue}
        a, b, c, d = (colours[letter] for letter in self.order)
        return a, b, c, d


@dataclass(frozen=True, kw_only=True)
class FixedPattern:
    """Fixed-pattern noise: differences between pixels that are the same in every frame.

    prnu : rms variation of the response, fraction of its mean
    dead_pixels : fraction of the pixels without response to light
    dsnu : offset of single pixels [e- rms]
    rows, columns : offset of rows and columns [e- rms]
    hot_pixels : fraction of the pixels with an additional, exponentially distributed dark current
    hot_current : mean of that current at 300 K [e- s-1]
    """

    prnu: float = 0.0
    dead_pixels: float = 0.0
    dsnu: float = 0.0
    rows: float = 0.0
    columns: float = 0.0
    hot_pixels: float = 0.0
    hot_current: float = 0.0

    def __post_init__(self) -> None:
        for name in ("prnu", "dead_pixels", "hot_pixels"):
            check_within(f"pattern: {name}", getattr(self, name), 0.0, 1.0)
        for name in ("dsnu", "rows", "columns", "hot_current"):
            check_within(f"pattern: {name}", getattr(self, name), 0.0)


@dataclass(frozen=True, kw_only=True)
class Particles:
    """Charged particles through the detector.

    flux : through the detector plane from both sides [m-2 s-1]; half of an isotropic,
        omnidirectional flux
    depth : of the layer whose charge is collected [m]
    charge : released per path length [e- m-1]
    """

    flux: float
    depth: float
    charge: float

    def __post_init__(self) -> None:
        check_within("particles: flux", self.flux, 0.0)
        check_positive("particles: depth", self.depth)
        check_positive("particles: charge", self.charge)


@dataclass(frozen=True, kw_only=True)
class Detector:
    """Pixels and converter.

    width, height : [px]
    pixel_pitch : [m]
    quantum_efficiency : electrons per photon in each band of a pixel without filter
    bands : these bands, which are those of all light in the camera
    full_well : [e-]
    read_noise : [e- rms]
    bits : resolution of the converter
    pedestal : added before conversion [DN]
    gain_dn_per_e : of pixel, amplifier and converter together [DN / e-]
    fill_factor : fraction of a pixel's light that reaches its photodiode
    mosaic : None for a monochrome detector
    curve : quantum efficiency over wavelength; None where it is constant in each band
    dark_current_300k : of every pixel at 300 K [e- s-1]
    temperature : [K]
    pattern : fixed-pattern noise
    serial : seed of the fixed pattern
    row_noise : offset of rows, new in every frame [e- rms]
    blooming : fraction of the charge beyond the full well that flows along the column
    particles : None without radiation
    row_time : between the starts of adjacent rows [s]; 0 for a global shutter
    """

    width: int
    height: int
    pixel_pitch: float
    quantum_efficiency: PerBand
    full_well: float
    read_noise: float
    bits: int
    pedestal: float
    gain_dn_per_e: float
    fill_factor: float = 1.0
    mosaic: Mosaic | None = None
    curve: ResponseCurve | None = field(default=None, repr=False)
    dark_current_300k: float = 0.0
    temperature: float = REFERENCE_TEMPERATURE
    pattern: FixedPattern = FixedPattern()
    serial: int = 0
    row_noise: float = 0.0
    blooming: float = 0.0
    particles: Particles | None = None
    row_time: float = 0.0
    bands: Bands = BANDS

    def __post_init__(self) -> None:
        for name, low, high in (
            ("width", 1, _LARGEST_EDGE),
            ("height", 1, _LARGEST_EDGE),
            ("bits", 1, MAX_BITS),
            ("serial", 0, LARGEST_SEED),
        ):
            check_integer(f"detector: {name}", getattr(self, name), low, high)
        for name in ("pixel_pitch", "full_well", "gain_dn_per_e", "fill_factor", "temperature"):
            check_positive(f"detector: {name}", getattr(self, name))
        for name in ("read_noise", "pedestal", "dark_current_300k", "row_noise", "row_time"):
            check_within(f"detector: {name}", getattr(self, name), 0.0)
        check_within("detector: blooming", self.blooming, 0.0, 1.0)
        check_bands("detector: quantum_efficiency", self.quantum_efficiency)

    @property
    def dark_current(self) -> float:
        """Dark current of every pixel at the detector's temperature [e- s-1]."""
        return self.dark_current_300k * dark_current_ratio(self.temperature)

    @property
    def hot_current(self) -> float:
        """Mean additional dark current of a hot pixel at the detector's temperature [e- s-1]."""
        return self.pattern.hot_current * dark_current_ratio(self.temperature)

    @property
    def noise_of_reading(self) -> float:
        """Sum of all offsets and noises that are added when a pixel is read [e- rms]."""
        p = self.pattern
        return math.hypot(self.read_noise, self.row_noise, p.dsnu, p.rows, p.columns)

    def pixels_within(self, low: Array, high: Array) -> tuple[int, int, int, int] | None:
        """x0, y0, x1, y1 of the pixels that a rectangle touches; None if it is out of view.

        low, high : (2,) corners of the rectangle [px]
        """
        limits = np.array([self.width, self.height])
        first = np.clip(np.floor(low), 0, limits).astype(int)
        end = np.clip(np.ceil(high), 0, limits).astype(int)
        if np.any(end <= first):
            return None
        return int(first[0]), int(first[1]), int(end[0]), int(end[1])

    @property
    def largest_dn(self) -> int:
        """Full scale of the converter [DN]."""
        return int(2**self.bits - 1)

    @property
    def square(self) -> tuple[PerBand, PerBand, PerBand, PerBand]:
        """Electrons per photon of the pixels (0, 0), (1, 0), (0, 1), (1, 1), column first."""
        qe = self.quantum_efficiency
        return (qe, qe, qe, qe) if self.mosaic is None else self.mosaic.square

    @property
    def pixel_curves(self) -> tuple[ResponseCurve, ...]:
        """Electrons per photon over wavelength of the pixels of a square, or of one of them where
        they are alike; none where each band is even."""
        if self.mosaic is None:
            return () if self.curve is None else (self.curve,)
        if self.mosaic.curves is None:
            return ()
        by_letter = dict(zip("RGB", self.mosaic.curves, strict=True))
        return tuple(by_letter[letter] for letter in self.mosaic.order)

    def by_colour(self) -> tuple[ColourPixels, ...]:
        """Its pixels by colour filter; all pixels for a monochrome detector."""
        mosaic = self.mosaic
        if mosaic is None:
            curve = self.curve or ResponseCurve(bands=self.quantum_efficiency, intervals=self.bands)
            return (ColourPixels(self, self.quantum_efficiency, curve),)
        blind = (0.0, 0.0, 0.0, 0.0)
        pixels = []
        for index, colour in enumerate(("red", "green", "blue")):
            qe = getattr(mosaic, colour)
            flat = ResponseCurve(bands=qe, intervals=self.bands)
            curve = flat if mosaic.curves is None else mosaic.curves[index]
            one = replace(mosaic, **{"red": blind, "green": blind, "blue": blind, colour: qe})
            pixels.append(ColourPixels(replace(self, mosaic=one), qe, curve))
        return tuple(pixels)


@dataclass(frozen=True)
class ColourPixels:
    """The pixels of one colour of a detector.

    detector : with all other pixels blind
    quantum_efficiency : electrons per photon in each band, for sunlight
    curve : the same over wavelength
    """

    detector: Detector
    quantum_efficiency: PerBand
    curve: ResponseCurve
