"""The camera equation: how many electrons a radiance gives."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simgl.scene.camera import Camera

Array = NDArray[np.float64]


def electrons_per_radiance(camera: Camera, photons_per_joule: Array) -> Array:
    """(4,) electrons that a pixel on the axis collects per unit of band radiance [e- W-1 m2 sr].

    photons_per_joule : (4,) of the light's spectrum in each band

    Image irradiance is E = pi L T / (4 N^2), the form for a distant object and an aplanatic lens;
    the form with 1 + 4 N^2 is lower by 1.5 % at f/4.
    """
    lens, detector = camera.lens, camera.detector
    irradiance = np.pi * np.asarray(lens.transmission) / (4.0 * lens.f_number**2)
    energy = irradiance * detector.pixel_pitch**2 * camera.exposure_time
    return np.asarray(energy * photons_per_joule * np.asarray(detector.quantum_efficiency))
