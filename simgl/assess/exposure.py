"""The exposure time that a target wants: nothing saturated, its back visible, the sky dark.

Electrons grow with the time, so that one picture tells the limits of all times.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from simgl.assess.frame import DETECTION
from simgl.errors import ConfigError, did_you_mean
from simgl.physics.exposure_value import blender_exposure, exposure_value
from simgl.scene.camera import Camera
from simgl.scene.state import SceneState
from simgl.simulator import Exposure

# Of the target's pixels, the brightest share may saturate and the darkest may stay invisible:
# glints and slits. A pixel fills to this share of the full well, which leaves room for noise.
GLINTS, SLITS, FILLED = 0.001, 0.05, 0.9
# The sky is the darkest share of what is seen past all spacecraft; the Earth may be the rest.
SKY = 0.1


@dataclass(frozen=True, kw_only=True)
class ExposureAdvice:
    """Limits of the exposure time [s]; infinite where there is no limit.

    unsaturated : longest without saturation on the target
    back_visible : shortest that lifts the target's darkest parts out of the noise
    sky_dark : longest in which the sky beside all spacecraft stays in the noise
    target_pixels : whose centre sees the target
    """

    camera: Camera
    target: str
    unsaturated: float
    back_visible: float
    sky_dark: float
    target_pixels: int

    @property
    def time(self) -> float:
        """The longest without saturation and with a dark sky, or what the back needs if more."""
        return min(self.unsaturated, max(self.sky_dark, self.back_visible))

    @property
    def meets_all(self) -> bool:
        """Whether one time meets the three criteria."""
        return self.back_visible <= min(self.unsaturated, self.sky_dark)


def advise(exposure: Exposure, state: SceneState, target: str) -> ExposureAdvice:
    """Limits from an exposure that holds electrons and truth of a state.

    Raises ConfigError for an unknown target or one out of view.
    """
    if target not in state.bodies:
        problem = f"is not in the scenario; {did_you_mean(target, state.bodies)}"
        raise ConfigError("exposure", f'target "{target}"', problem)
    assert exposure.electrons is not None
    assert exposure.truth is not None
    camera = exposure.info.camera
    instance = list(state.bodies).index(target) + 1
    on_target = exposure.truth.instance == instance
    if not on_target.any():
        raise ConfigError("exposure", f'target "{target}"', "is not in the picture")
    rate = exposure.electrons.electrons.astype(np.float64) / camera.exposure_time
    bright, dark = np.quantile(rate[on_target], [1.0 - GLINTS, SLITS])
    sky = rate[exposure.truth.instance == 0]
    floor = _detected(camera)
    return ExposureAdvice(
        camera=camera,
        target=target,
        unsaturated=_time(FILLED * _fullest(camera), bright),
        back_visible=_time(floor, dark),
        sky_dark=_time(floor, float(np.quantile(sky, SKY))) if sky.size else math.inf,
        target_pixels=int(on_target.sum()),
    )


def _fullest(camera: Camera) -> float:
    """Electrons at which the well or the converter is full."""
    d = camera.detector
    return float(min(d.full_well, (2**d.bits - 1 - d.pedestal) / d.gain_dn_per_e))


def _detected(camera: Camera) -> float:
    """Electrons e with e = DETECTION sqrt(e + read noise^2)."""
    square = DETECTION**2
    noise = camera.detector.read_noise
    return float(0.5 * (square + math.sqrt(square**2 + 4.0 * square * noise**2)))


def _time(electrons: float, rate: float) -> float:
    return electrons / rate if rate > 0.0 else math.inf


def advice_text(advice: ExposureAdvice) -> str:
    """The advice as lines for a terminal."""

    def line(name: str, time: float) -> str:
        if not math.isfinite(time):
            return f"{name:<22}no limit"
        value = exposure_value(advice.camera.lens.f_number, time)
        setting = blender_exposure(value)
        return f"{name:<22}{1e3 * time:.4g} ms   EV {value:.2f}   source's setting {setting:.2f}"

    lines = [
        line("no saturation up to", advice.unsaturated),
        line("back visible from", advice.back_visible),
        line("dark sky up to", advice.sky_dark),
        line("advised", advice.time),
        line("given", advice.camera.exposure_time),
    ]
    if not advice.meets_all:
        lines.append("no time meets all three: the target's range of light is too large")
    return "\n".join(lines)
