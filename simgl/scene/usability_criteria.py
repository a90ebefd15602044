"""What makes a picture of a target usable."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class UsabilityCriteria:
    """Limits that a usable picture keeps.

    target, camera : what to look for, and through which camera; None for the first of the scenario
    least_pixels : of the target
    most_saturated : share of the target's pixels that may be saturated
    most_dark : share of them that may drown in noise
    least_snr : median signal over noise of the target
    least_contrast : of target against background, |t - b| / (t + b) of their median electrons
    """

    target: str | None = None
    camera: str | None = None
    least_pixels: int = 25
    most_saturated: float = 0.05
    most_dark: float = 0.5
    least_snr: float = 10.0
    least_contrast: float = 0.1
