"""What a docking must fulfil: each criterion in words, with its unit and its limit."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from simgl import __version__

if TYPE_CHECKING:
    from examples.closed_loop.report import Summary

DOCKING_RANGE = 1.6  # [m]
# A berthing mechanism of such a size catches what comes within these.
RANGE_TOLERANCE = 0.15  # [m]
LATERAL_TOLERANCE = 0.03  # [m]
ANGLE_TOLERANCE = 2.0  # [deg]
# Of errors of position that 3 sigma of a consistent filter hold, 99.7 % are expected; images of one
# flight share their errors.
HELD = 0.95


@dataclass(frozen=True, kw_only=True)
class Criterion:
    """what : it is about; value, limit : with their units; met : whether the value is within."""

    what: str
    value: str
    limit: str
    met: bool


def criteria(summary: Summary) -> list[Criterion]:
    """The criteria of a docking, in the order of its verdict."""
    off_range = abs(summary.distance_true_m - DOCKING_RANGE)
    return [
        Criterion(
            what="arrived at docking range and held it",
            value="yes" if summary.arrived else "no",
            limit="yes",
            met=summary.arrived,
        ),
        Criterion(
            what="camera's distance from the board",
            value=f"{summary.distance_true_m:.3f} m",
            limit=f"{DOCKING_RANGE:g} m ± {RANGE_TOLERANCE:g} m",
            met=off_range <= RANGE_TOLERANCE,
        ),
        Criterion(
            what="camera off the board's axis",
            value=f"{1e3 * summary.off_axis_m:.1f} mm",
            limit=f"at most {1e3 * LATERAL_TOLERANCE:g} mm",
            met=summary.off_axis_m <= LATERAL_TOLERANCE,
        ),
        Criterion(
            what="angle between camera's axis and board's axis",
            value=f"{summary.misalignment_deg:.2f} deg",
            limit=f"at most {ANGLE_TOLERANCE:g} deg",
            met=summary.misalignment_deg <= ANGLE_TOLERANCE,
        ),
        Criterion(
            what="position errors within the 3 sigma that the filter claims",
            value=f"{100.0 * summary.within_3_sigma:.1f} %",
            limit=f"at least {100.0 * HELD:g} %",
            met=summary.within_3_sigma >= HELD,
        ),
    ]


def docked(summary: Summary) -> bool:
    """Whether all criteria are met."""
    return all(criterion.met for criterion in criteria(summary))


def verdict(summary: Summary) -> str:
    """The verdict on a flight in one line."""
    place = (
        f"{summary.distance_true_m:.3f} m before the board, {1e3 * summary.off_axis_m:.0f} mm off "
        f"its axis, {summary.misalignment_deg:.2f} deg askew, {summary.simulated_time_s:.0f} s "
        f"after the start"
    )
    if not summary.arrived:
        return f"NOT DOCKED: the chaser is still on its way, {place}"
    broken = ", ".join(criterion.what for criterion in criteria(summary) if not criterion.met)
    return f"NOT DOCKED: {place}; not met: {broken}" if broken else f"DOCKED: {place}"


def facts(summary: Summary) -> dict[str, str]:
    """The other numbers of a flight, in words and with units."""
    lamp = summary.first_lamp_s
    return {
        "Images": f"{summary.frames}, {summary.blind_frames} of them without a fix, "
        f"{summary.rejected_fixes} fixes rejected by the filter",
        "Flight time": f"{summary.simulated_time_s:.0f} s",
        "Velocity change": f"{summary.delta_v_m_s:.2f} m/s",
        "Estimate against truth, along the approach": f"{1e3 * summary.range_error_m:.1f} mm rms",
        "Estimate against truth, across": f"{1e3 * summary.lateral_error_m:.1f} mm rms",
        "Estimate of the target's attitude": f"{summary.turn_error_deg:.2f} deg rms",
        "Sunlight on the target at the end": f"{100.0 * summary.sunlit_at_end:.1f} %",
        "Lamp": "not used" if lamp is None else f"on from {lamp:.0f} s",
        "Age of an image when the flight software had it": f"{summary.delay_s:.1f} s, mean",
        "Speed": f"{summary.frames_per_second:.1f} images per second, end to end",
        "Time per image": f"rendering {summary.render_p50_ms:.0f} ms (99 %: "
        f"{summary.render_p99_ms:.0f} ms), bridge {summary.bridge_p50_ms:.1f} ms, flight software "
        f"{summary.processing_p50_ms:.0f} ms (medians)",
        "Seed": str(summary.seed),
        "Version of simgl": __version__,
        "Renderer": summary.renderer,
    }
