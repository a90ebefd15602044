"""The verdict on a picture of a target."""

from __future__ import annotations

from enum import StrEnum

from simgl.assess.target_light import FrameAssessment
from simgl.scenario.schema import UsabilityCriteria


class Verdict(StrEnum):
    """What a picture is worth."""

    GOOD = "good"
    NOT_IN_VIEW = "not in view"
    TOO_BRIGHT = "too bright"
    TOO_DARK = "too dark"
    CONFUSED = "confused with background"


def verdict(found: FrameAssessment, limits: UsabilityCriteria) -> tuple[Verdict, tuple[str, ...]]:
    """The verdict and its reasons, the weightiest first; none for a good picture."""
    if found.target_pixels < limits.least_pixels:
        reason = f"{found.target_pixels} pixels of the target, {limits.least_pixels} are needed"
        return Verdict.NOT_IN_VIEW, (reason,)
    faults: list[tuple[Verdict, str]] = []
    if found.saturated > limits.most_saturated:
        text = f"{_percent(found.saturated)} saturated, {_percent(limits.most_saturated)} allowed"
        faults.append((Verdict.TOO_BRIGHT, text))
    if found.dark > limits.most_dark:
        text = f"{_percent(found.dark)} in the noise, {_percent(limits.most_dark)} allowed"
        faults.append((Verdict.TOO_DARK, text))
    if found.median_snr < limits.least_snr:
        text = f"signal over noise {found.median_snr:.1f}, {limits.least_snr:g} is needed"
        faults.append((Verdict.TOO_DARK, text))
    if found.contrast is not None and found.contrast < limits.least_contrast:
        text = f"contrast {found.contrast:.2f} to the background, {limits.least_contrast:g} needed"
        faults.append((Verdict.CONFUSED, text))
    if not faults:
        return Verdict.GOOD, ()
    return faults[0][0], tuple(reason for _, reason in faults)


def _percent(share: float) -> str:
    return f"{100.0 * share:.3g} %"
