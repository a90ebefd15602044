"""The lamps of a scene as the pixels of a detector respond to them.

Radiance is physical. Electrons are counted per band with the response to sunlight; where a lamp has
a spectrum of its own, its power in each band is multiplied by the ratio of the response to it and
to sunlight. What is drawn of that light, direct or reflected on the way, gives its true electrons.
Under colour filters the ratio is another one for each colour.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from simgl.arrays import Array
from simgl.camera.detector import ColourPixels, Detector
from simgl.camera.spectral_response import ResponseCurve, sunlight_ratio
from simgl.physics.spectrum import LineSpectrum, PerBand
from simgl.scene.lamps import LampState
from simgl.scene.state import SceneState


@dataclass(frozen=True, kw_only=True, eq=False)
class DetectorLight:
    """The lamps for pixels of one response.

    detector : with all other pixels blind
    lamps : as those pixels respond to them
    key : equal for equal lamps; empty for those of the scene itself
    """

    detector: Detector
    lamps: tuple[LampState, ...]
    key: bytes = b""


def lit_for_detector(state: SceneState, detector: Detector) -> tuple[DetectorLight, ...]:
    """The lamps for all pixels, or for those of each colour where lamps have spectra."""
    if all(lamp.lamp.spectrum is None for lamp in state.lamps):
        return (DetectorLight(detector=detector, lamps=state.lamps),)
    photons_per_joule = state.sun.photons_per_joule.tobytes()
    lights = []
    for colour in detector.by_colour():
        lamps = tuple(_weighted(lamp, colour, photons_per_joule) for lamp in state.lamps)
        key = b"".join(lamp.lamp.power.tobytes() for lamp in lamps)
        lights.append(DetectorLight(detector=colour.detector, lamps=lamps, key=key))
    return tuple(lights)


def _weighted(state: LampState, colour: ColourPixels, photons_per_joule: bytes) -> LampState:
    lamp = state.lamp
    if lamp.spectrum is None:
        return state
    response = colour.curve, colour.quantum_efficiency
    power = lamp.power * _ratio(lamp.spectrum, *response, photons_per_joule)
    return replace(state, lamp=replace(lamp, power=power))


@lru_cache(maxsize=64)
def _ratio(
    spectrum: LineSpectrum,
    curve: ResponseCurve,
    quantum_efficiency: PerBand,
    photons_per_joule: bytes,
) -> Array:
    """(4,) as ``sunlight_ratio``: lamps, detectors and sunlight stay from frame to frame."""
    sunlight = np.frombuffer(photons_per_joule) * np.array(quantum_efficiency)
    ratio = sunlight_ratio(spectrum, curve, sunlight)
    ratio.flags.writeable = False
    return ratio
