"""The verdict on an image of a target."""

from __future__ import annotations

import math
from enum import StrEnum
from typing import Protocol

from simgl.assess.target_light import FrameAssessment
from simgl.scenario.schema import UsabilityCriteria


class Verdict(StrEnum):
    """The verdict on an image."""

    GOOD = "good"
    NOT_IN_VIEW = "not in view"
    TOO_BRIGHT = "too bright"
    TOO_DARK = "too dark"
    CONFUSED = "confused with background"


class ImageFigures(Protocol):
    """What a verdict needs to know of an image, as in ``FrameAssessment``."""

    @property
    def target_pixels(self) -> int:
        """Pixels that see the target."""

    @property
    def saturated(self) -> float:
        """Share of them that is full."""

    @property
    def dark(self) -> float:
        """Share of them in the noise."""

    @property
    def median_snr(self) -> float:
        """Of these pixels."""

    @property
    def contrast(self) -> float | None:
        """To what is behind; None without a background."""


def verdict(assessment: ImageFigures, limits: UsabilityCriteria) -> tuple[Verdict, tuple[str, ...]]:
    """The verdict and its reasons, the most important first; none for a good image.

    assessment : figures of an image, such as a ``FrameAssessment``
    limits : of a usable image, such as ``scenario.criteria``
    """
    if assessment.target_pixels < limits.min_target_pixels:
        text = f"{assessment.target_pixels} pixels of the target, "
        text += f"{limits.min_target_pixels} are needed"
        return Verdict.NOT_IN_VIEW, (text,)
    faults: list[tuple[Verdict, str]] = []
    if assessment.saturated > limits.max_saturated_share:
        text = f"{_percent(assessment.saturated)} saturated, "
        text += f"{_percent(limits.max_saturated_share)} allowed"
        faults.append((Verdict.TOO_BRIGHT, text))
    if assessment.dark > limits.max_dark_share:
        text = (
            f"{_percent(assessment.dark)} in the noise, {_percent(limits.max_dark_share)} allowed"
        )
        faults.append((Verdict.TOO_DARK, text))
    if assessment.median_snr < limits.min_snr:
        text = f"signal over noise {assessment.median_snr:.1f}, {limits.min_snr:g} is needed"
        faults.append((Verdict.TOO_DARK, text))
    if assessment.contrast is not None and assessment.contrast < limits.min_contrast:
        text = f"contrast {assessment.contrast:.2f} to the background, "
        text += f"{limits.min_contrast:g} needed"
        faults.append((Verdict.CONFUSED, text))
    if not faults:
        return Verdict.GOOD, ()
    return faults[0][0], tuple(reason for _, reason in faults)


def _percent(share: float) -> str:
    return f"{100.0 * share:.3g} %"


def assessment_text(assessment: FrameAssessment, limits: UsabilityCriteria) -> str:
    """The verdict and the assessment as lines for a terminal."""
    a = assessment
    kind, reasons = verdict(a, limits)
    contrast = "no background" if a.contrast is None else f"{a.contrast:.2f}"
    shares = " ".join(f"{100 * share:.1f} %" for share in (a.saturated, a.dark, a.usable))
    lines = {
        "verdict": ": ".join([kind.value, *(["; ".join(reasons)] if reasons else [])]),
        "range": f"{a.range:.2f} m",
        "phase angle": f"{math.degrees(a.phase_angle):.1f} deg",
        "Sun to boresight": f"{math.degrees(a.sun_to_boresight):.1f} deg",
        "sunlight on target": f"{100 * a.sunlight:.1f} %",
        "behind the target": f"{a.backdrop.value}, contrast {contrast}",
        "target's pixels": f"{a.target_pixels}{', cut off' if a.cut_off else ''}",
        "saturated dark usable": shares,
        "median signal/noise": f"{a.median_snr:.1f}",
        **_light_lines(a),
        **_temperature_lines(a),
    }
    return "\n".join(f"{name:<21} {text}" for name, text in lines.items())


def _light_lines(a: FrameAssessment) -> dict[str, str]:
    """Of visible light."""
    if a.exitance is None or a.relative_flux is None:
        return {}
    factor = a.better_exposure
    return {
        "exitance": f"{a.exitance:.0f} W/m2 (pi x radiance, 400-1000 nm)",
        "relative flux": f"{a.relative_flux:.0f} W/m2 (source study's definition)",
        "better exposure": "no light" if factor is None else f"{factor:.3g} times this one",
    }


def _temperature_lines(a: FrameAssessment) -> dict[str, str]:
    """Of a thermal camera."""
    if (seen := a.temperatures) is None:
        return {}
    around = "nothing beside it" if seen.background is None else f"{seen.background:.1f} K beside"
    return {
        "temperatures": f"{seen.lowest:.1f} to {seen.highest:.1f} K, mean {seen.mean:.1f} K",
        "brightness": f"{seen.brightness:.1f} K, {around}; NETD {1e3 * seen.netd:.0f} mK",
    }
