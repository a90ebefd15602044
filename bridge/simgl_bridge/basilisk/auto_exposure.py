"""Exposure time of a camera whose file gives none: Basilisk does not send it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from simgl.arrays import Array
from simgl.assess.exposure_advice import full_electrons
from simgl.camera.camera import Camera
from simgl.camera.camera_equation import irradiance_per_radiance, square_electrons_per_irradiance
from simgl.physics.regolith import face_on, geometric_albedo
from simgl.scene.state import EarthState, Sun

# Share of a pixel's range that the brightest surface fills: one stop is left for glints.
FILLED = 0.5
# Reflectance factor of the brightest surface where no single albedo is known: thick cloud under a
# high Sun, or white paint.
WHITE = 0.85


def auto_exposed(camera: Camera, sun: Sun, globe: EarthState | None) -> Camera:
    """The camera with the exposure time that fills its pixels to ``FILLED`` in full sunlight.

    The reference surface is the planet at the scene's origin, at zero phase angle; clouds or white
    paint where the planet has maps or there is none. The exposure does not depend on what is in
    view, so the images of a series compare.
    """
    albedo, law = (None, None) if globe is None else (globe.earth.albedo, globe.earth.regolith)
    reflectance = np.full(4, WHITE) if albedo is None else np.asarray(albedo)
    if law is not None:
        reflectance = reflectance * (2.0 / 3.0 * face_on(law) / geometric_albedo(law))
    radiance = reflectance / np.pi * sun.seen_from(np.zeros(3)).irradiance
    irradiance: Array = irradiance_per_radiance(camera) * radiance
    square = square_electrons_per_irradiance(camera, sun.photons_per_joule)
    electrons = float((square @ irradiance).max())
    time = camera.exposure_time * FILLED * full_electrons(camera) / electrons
    return replace(camera, exposure_time=time)
