"""One frame's light on one target: geometry of the Sun, and how many of its pixels can be used."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simgl.errors import ConfigError, did_you_mean
from simgl.images import saturated
from simgl.physics.frames import unit
from simgl.scene.state import SceneState
from simgl.simulator import Exposure

Array = NDArray[np.float64]

# A pixel is dark where its signal does not stand out from its own noise by this factor.
DETECTION = 3.0


@dataclass(frozen=True, kw_only=True)
class FrameAssessment:
    """What one image shows of a target.

    range : camera to the target's body origin [m]
    phase_angle : Sun - target - camera [rad]
    sun_to_boresight : [rad]
    sunlight : share of the Sun's light that reaches the target past Earth, air and Moon, over all
        bands
    target_pixels : whose centre sees the target
    saturated, dark, usable : shares of them; together 1, all 0 where there are none
    median_snr : signal over noise of the target's pixels; 0 where there are none
    """

    target: str
    range: float
    phase_angle: float
    sun_to_boresight: float
    sunlight: float
    target_pixels: int
    saturated: float
    dark: float
    usable: float
    median_snr: float


def _angle(a: Array, b: Array) -> float:
    """Between two unit vectors [rad], exact for small and large ones."""
    return float(2.0 * np.arctan2(np.linalg.norm(a - b), np.linalg.norm(a + b)))


def assess_frame(exposure: Exposure, state: SceneState, target: str) -> FrameAssessment:
    """The assessment of an exposure that holds DN, electrons and truth of a state.

    Raises ConfigError for an unknown target.
    """
    if target not in state.bodies:
        problem = f"is not in the scenario; {did_you_mean(target, state.bodies)}"
        raise ConfigError("assess", f'target "{target}"', problem)
    assert exposure.digital is not None
    assert exposure.electrons is not None
    assert exposure.truth is not None
    info = exposure.info
    position = state.bodies[target].pose.position
    sun = state.sun.seen_from(position)
    to_camera = info.position - position
    instance = list(state.bodies).index(target) + 1
    on_target = exposure.truth.part_id // 65536 == instance
    detector = info.camera.detector
    electrons = exposure.electrons.electrons[on_target].astype(np.float64)
    full = saturated(exposure.digital.dn[on_target], detector)
    snr = electrons / np.sqrt(electrons + detector.read_noise**2 + 1.0 / 12.0)
    dark = ~full & (snr < DETECTION)
    count = int(on_target.sum())

    def share(mask: NDArray[np.bool_]) -> float:
        return float(mask.sum()) / max(count, 1)

    return FrameAssessment(
        target=target,
        range=float(np.linalg.norm(to_camera)),
        phase_angle=_angle(sun.direction_icrf, unit(to_camera)),
        sun_to_boresight=_angle(info.sun_direction_icrf, info.R_camera_from_icrf[2]),
        sunlight=float(sun.irradiance @ state.sunlight(position) / sun.irradiance.sum()),
        target_pixels=count,
        saturated=share(full),
        dark=share(dark),
        usable=share(~full & ~dark),
        median_snr=float(np.median(snr)) if count else 0.0,
    )
