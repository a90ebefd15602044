"""Exposure time for a target: no saturation, its dark side visible, the sky dark.

Electrons are proportional to the exposure time, so one capture gives the limits of all times.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from simgl.arrays import Array, Array32
from simgl.camera.camera import Camera
from simgl.camera.camera_equation import blender_exposure, exposure_value
from simgl.errors import ConfigError, did_you_mean
from simgl.scenario.schema import UsabilityCriteria
from simgl.scene.state import SceneState
from simgl.simulator import Capture

Electrons = Array32 | Array

# A pixel is dark where its signal does not stand out from its own noise by this factor.
DETECTION = 3.0
# Glints may saturate, this share of the pixels that the criteria allow; slits, the darkest share of
# the target's pixels, may stay invisible. A pixel may fill to the last share of the full well: the
# rest is room for noise.
GLINTS, SLITS, FILLED = 0.5, 0.05, 0.9
# The sky is this darkest share of the pixels beside all spacecraft; the Earth may be the rest.
SKY = 0.1


@dataclass(frozen=True, kw_only=True)
class ExposureLimits:
    """Limits of the exposure time [s]; infinite where there is no limit.

    unsaturated : longest without saturation on the target
    dark_side_visible : shortest that lifts the target's darkest parts out of the noise
    sky_dark : longest that leaves the sky beside all spacecraft in the noise
    """

    unsaturated: float
    dark_side_visible: float
    sky_dark: float

    @property
    def meets_all(self) -> bool:
        """Whether one time meets the three criteria."""
        return self.dark_side_visible <= min(self.unsaturated, self.sky_dark)

    @property
    def time(self) -> float:
        """The longest that meets all three, or else the longest without saturation."""
        return min(self.unsaturated, self.sky_dark) if self.meets_all else self.unsaturated


@dataclass(frozen=True, kw_only=True)
class ExposureAdvice(ExposureLimits):
    """The limits that one capture gives.

    target_pixels : pixels whose centre sees the target
    """

    camera: Camera
    target: str
    target_pixels: int


def exposure_limits(
    on_target: Electrons, sky: Electrons, camera: Camera, criteria: UsabilityCriteria
) -> ExposureLimits:
    """Limits from mean electrons of a capture, which are proportional to the exposure time.

    on_target : (n,) of the target's pixels, at least one
    sky : (m,) of the pixels beside all spacecraft
    """
    bright, dark = np.quantile(
        on_target.astype(np.float64), [1.0 - GLINTS * criteria.max_saturated_share, SLITS]
    )
    detected, exposure_time = _detected(camera), camera.exposure_time
    darkest = float(np.quantile(sky, SKY)) if sky.size else 0.0
    return ExposureLimits(
        unsaturated=_ratio(FILLED * full_electrons(camera), bright) * exposure_time,
        dark_side_visible=_ratio(detected, dark) * exposure_time,
        sky_dark=_ratio(detected, darkest) * exposure_time,
    )


def advise(
    capture: Capture,
    state: SceneState,
    target: str,
    criteria: UsabilityCriteria = UsabilityCriteria(),
) -> ExposureAdvice:
    """Limits from a capture of a state that holds electrons and truth.

    Raises ConfigError for an unknown target or one out of view.
    """
    if target not in state.bodies:
        problem = f"is not in the scenario; {did_you_mean(target, state.bodies)}"
        raise ConfigError("exposure", f'target "{target}"', problem)
    assert capture.electrons is not None
    assert capture.truth is not None
    camera = capture.info.camera
    instances = capture.truth.instance
    on_target = instances == list(state.bodies).index(target) + 1
    if not on_target.any():
        raise ConfigError("exposure", f'target "{target}"', "is not in the image")
    electrons = capture.electrons.electrons
    limits = exposure_limits(electrons[on_target], electrons[instances == 0], camera, criteria)
    return ExposureAdvice(
        camera=camera,
        target=target,
        target_pixels=int(on_target.sum()),
        unsaturated=limits.unsaturated,
        dark_side_visible=limits.dark_side_visible,
        sky_dark=limits.sky_dark,
    )


def full_electrons(camera: Camera) -> float:
    """Electrons at which the well or the converter is full."""
    d = camera.detector
    return float(min(d.full_well, (d.largest_dn - d.pedestal) / d.gain_dn_per_e))


def _detected(camera: Camera) -> float:
    """Electrons e with e = DETECTION sqrt(e + read noise^2)."""
    square = DETECTION**2
    noise = camera.detector.read_noise
    return float(0.5 * (square + math.sqrt(square**2 + 4.0 * square * noise**2)))


def _ratio(wanted: float, measured: float) -> float:
    return wanted / measured if measured > 0.0 else math.inf


def advice_document(advice: ExposureAdvice) -> dict[str, object]:
    """The advice as ``simgl exposure --json`` prints it."""
    return {
        "camera": advice.camera.name,
        "target": advice.target,
        "target_pixels": advice.target_pixels,
        "max_unsaturated_s": advice.unsaturated,
        "min_dark_side_visible_s": advice.dark_side_visible,
        "max_dark_sky_s": advice.sky_dark,
        "advised_s": advice.time,
        "given_s": advice.camera.exposure_time,
        "meets_all": advice.meets_all,
    }


def advice_text(advice: ExposureAdvice) -> str:
    """The advice as lines for a terminal."""

    def line(name: str, time: float) -> str:
        if not math.isfinite(time):
            return f"{name:<22}{'no limit':>13}"
        value = exposure_value(advice.camera.lens.f_number, time)
        setting = blender_exposure(value)
        amount, unit = (time, "s ") if time >= 1.0 else (1e3 * time, "ms")
        return (
            f"{name:<22}{amount:>10.4g} {unit}   EV {value:6.2f}   Blender exposure {setting:6.2f}"
        )

    lines = [
        line("no saturation up to", advice.unsaturated),
        line("dark side visible from", advice.dark_side_visible),
        line("dark sky up to", advice.sky_dark),
        line("advised", advice.time),
        line("given", advice.camera.exposure_time),
    ]
    if not advice.meets_all:
        lines.append("no time meets all three: the target's range of light is too large")
    return "\n".join(lines)
