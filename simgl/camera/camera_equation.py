"""The camera equation: radiance to irradiance and electrons; exposure values of photography."""

from __future__ import annotations

import math

import numpy as np

from simgl.arrays import Array
from simgl.camera.camera import Camera
from simgl.value_checks import check_positive, check_within

# Exposure value at setting 0 of the source study's software, by its documentation; 2^9.416 = 683.
_BLENDER_ZERO = 9.416


def irradiance_per_radiance(camera: Camera) -> Array:
    """(4,) on-axis irradiance of the image plane per band radiance [sr].

    E = pi L T / (4 N^2) for a distant object and an aplanatic lens. The alternative denominator
    1 + 4 N^2 gives 1.5 % less at f/4.
    """
    lens = camera.lens
    squared = 4.0 * lens.f_number**2 + (1.0 if lens.camera_equation == "1+4N2" else 0.0)
    return np.pi * np.array(lens.transmission) / squared


def square_electrons_per_irradiance(camera: Camera, photons_per_joule: Array) -> Array:
    """(4, 4) electrons per band irradiance [e- W-1 m2], rows the pixels of a 2 x 2 square.

    Pixels (0, 0), (1, 0), (0, 1), (1, 1), column first; equal without colour filters.

    photons_per_joule : (4,) of the light's spectrum in each band [J-1]
    """
    detector = camera.detector
    area = detector.pixel_pitch**2 * detector.fill_factor
    photons = area * camera.exposure_time * photons_per_joule
    return photons * np.array(detector.square)


def exposure_value(f_number: float, exposure_time: float) -> float:
    """Exposure value EV = log2(N^2 / t): 16 at f/4 and 1/4096 s.

    f_number : N, above 0
    exposure_time : t, above 0 [s]

    Raises ValueError for other values.
    """
    check_positive("f_number", f_number)
    check_positive("exposure_time", exposure_time)
    return math.log2(f_number**2 / exposure_time)


def exposure_time(value: float, f_number: float) -> float:
    """Exposure time of an exposure value [s].

    value : EV, -100 to 100
    f_number : above 0

    Raises ValueError for other values.
    """
    check_within("value", value, -100.0, 100.0)
    check_positive("f_number", f_number)
    return float(f_number**2 / 2.0**value)


def blender_exposure(value: float) -> float:
    """Exposure setting of the source study's software for an exposure value."""
    return _BLENDER_ZERO - value
