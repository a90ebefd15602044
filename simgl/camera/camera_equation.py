"""The camera equation: the irradiance that a radiance gives, and the electrons of that."""

from __future__ import annotations

import math

import numpy as np

from simgl.arrays import Array
from simgl.camera.camera import Camera

# The exposure value that the software of the source study shows at its setting 0, by its own
# account; 2^9.416 = 683.
BLENDER_ZERO = 9.416

# Constants of reflected- and incident-light meters at ISO 100 (ISO 2720).
_REFLECTED, _INCIDENT = 12.5, 250.0
_ISO = 100.0


def irradiance_per_radiance(camera: Camera) -> Array:
    """(4,) irradiance of the image plane on the axis, per unit of band radiance [sr].

    E = pi L T / (4 N^2), the form for a distant object and an aplanatic lens; the lens may ask for
    the form with 1 + 4 N^2, which is lower by 1.5 % at f/4.
    """
    lens = camera.lens
    squared = 4.0 * lens.f_number**2 + (1.0 if lens.camera_equation == "1+4N2" else 0.0)
    return np.pi * np.asarray(lens.transmission) / squared


def square_electrons_per_irradiance(camera: Camera, photons_per_joule: Array) -> Array:
    """(4, 4) electrons per unit of band irradiance of the pixels (0, 0), (1, 0), (0, 1), (1, 1),
    which are alike without colour filters [e- W-1 m2].

    photons_per_joule : (4,) of the light's spectrum in each band
    """
    detector = camera.detector
    area = detector.pixel_pitch**2 * detector.fill_factor
    photons = area * camera.exposure_time * photons_per_joule
    return photons * np.asarray(detector.square)


def exposure_value(f_number: float, exposure_time: float) -> float:
    """log2(N^2 / t), t in seconds: 16 at f/4 and 1/4096 s."""
    return math.log2(f_number**2 / exposure_time)


def exposure_time(value: float, f_number: float) -> float:
    """The time [s] that gives an exposure value at an f-number."""
    return float(f_number**2 / 2.0**value)


def blender_exposure(value: float) -> float:
    """The setting of the source study's software that stands for an exposure value."""
    return BLENDER_ZERO - value


def value_from_blender(setting: float) -> float:
    """The exposure value that a setting of the source study's software stands for."""
    return BLENDER_ZERO - setting


def value_for_luminance(luminance: float) -> float:
    """The exposure value at ISO 100 that a meter advises for a luminance [cd m-2]."""
    return math.log2(luminance * _ISO / _REFLECTED)


def value_for_illuminance(illuminance: float) -> float:
    """The exposure value at ISO 100 that an incident-light meter advises [lx]."""
    return math.log2(illuminance * _ISO / _INCIDENT)
