"""The camera equation: the irradiance that a radiance gives, and the electrons of that."""

from __future__ import annotations

import numpy as np

from simgl.arrays import Array
from simgl.camera.camera import Camera


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
