"""Light along a trajectory: usable stretches, the worst epoch, and advice."""

from __future__ import annotations

import itertools
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from simgl.assess.verdict import Verdict


@dataclass(frozen=True, kw_only=True)
class Moment:
    """One epoch of a trajectory.

    better_exposure : factor on the exposure time that would suit it; None where there is no light
    """

    tai_ns: int
    verdict: Verdict
    phase_angle: float
    sunlight: float
    usable: float
    median_snr: float
    better_exposure: float | None


@dataclass(frozen=True, kw_only=True)
class Window:
    """A stretch of one verdict, first and last epoch [TAI ns]."""

    verdict: Verdict
    start_ns: int
    stop_ns: int
    epochs: int

    @property
    def duration(self) -> float:
        """[s]"""
        return (self.stop_ns - self.start_ns) * 1e-9


@dataclass(frozen=True, kw_only=True)
class Timeline:
    """Summary of a trajectory's light.

    shares : of all epochs, by verdict
    windows : stretches of one verdict, in order of time
    best : the longest good stretches, the longest first
    worst : the epoch in view with the smallest usable share of the target, None if never in view
    advice : sentences
    """

    shares: dict[Verdict, float]
    windows: tuple[Window, ...]
    best: tuple[Window, ...]
    worst: Moment | None
    advice: tuple[str, ...]


def timeline_document(summary: Timeline) -> dict[str, object]:
    """A summary as ``simgl assess --json`` prints it."""
    return {
        "shares": {kind.value: share for kind, share in summary.shares.items()},
        "stretches": [
            {
                "verdict": window.verdict.value,
                "start_tai_ns": window.start_ns,
                "stop_tai_ns": window.stop_ns,
                "epochs": window.epochs,
            }
            for window in summary.windows
        ],
        "advice": list(summary.advice),
    }


# Stretches that a summary lists.
_LISTED = 5
# Advice is given where it would help at least this share of the epochs.
_MIN_SHARE = 0.02


def timeline(moments: Sequence[Moment]) -> Timeline:
    """The summary of epochs in order of time, at least one."""
    counts = Counter(moment.verdict for moment in moments)
    windows = _windows(moments)
    good = [window for window in windows if window.verdict is Verdict.GOOD]
    in_view = [moment for moment in moments if moment.verdict is not Verdict.NOT_IN_VIEW]
    return Timeline(
        shares={verdict: counts[verdict] / len(moments) for verdict in Verdict},
        windows=tuple(windows),
        best=tuple(sorted(good, key=lambda w: (-w.duration, w.start_ns))[:_LISTED]),
        worst=min(in_view, key=lambda m: (m.usable, m.median_snr), default=None),
        advice=tuple(_advice(moments)),
    )


def _windows(moments: Sequence[Moment]) -> list[Window]:
    """Consecutive epochs of one verdict."""
    windows = []
    for verdict, group in itertools.groupby(moments, key=lambda moment: moment.verdict):
        stretch = list(group)
        start, stop = stretch[0].tai_ns, stretch[-1].tai_ns
        windows.append(Window(verdict=verdict, start_ns=start, stop_ns=stop, epochs=len(stretch)))
    return windows


def _advice(moments: Sequence[Moment]) -> Iterator[str]:
    """Sentences on what would help."""

    def worth(some: Sequence[Moment]) -> str | None:
        """Share of all epochs in words; None where it is too small for advice."""
        share = len(some) / len(moments)
        return f"{100.0 * share:.0f} % of the epochs" if share >= _MIN_SHARE else None

    for verdict, word in ((Verdict.TOO_BRIGHT, "shorter"), (Verdict.TOO_DARK, "longer")):
        lit = [m for m in moments if m.verdict is verdict and m.sunlight > 0.01]
        factors = [m.better_exposure for m in lit if m.better_exposure is not None]
        if (share := worth(lit)) and factors:
            factor = float(np.median(factors))
            times = 1.0 / factor if factor < 1.0 else factor
            if (factor < 1.0) == (word == "shorter"):
                yield (
                    f"{share} are {verdict} in sunlight: an exposure {times:.3g} times {word} "
                    "would suit them."
                )
    dark = [m for m in moments if m.verdict is Verdict.TOO_DARK and m.sunlight <= 0.01]
    if share := worth(dark):
        yield (
            f"{share} are too dark in the Earth's shadow: only a lamp or other epochs would help."
        )
    if share := worth([m for m in moments if m.verdict is Verdict.CONFUSED]):
        yield (
            f"{share} do not stand out from what is behind: another direction of approach, or a "
            "background of space, would help."
        )
    good = [m for m in moments if m.verdict is Verdict.GOOD]
    if good and len(good) < len(moments):
        low, high = np.degrees(np.percentile([m.phase_angle for m in good], [5, 95]))
        yield f"Good epochs have phase angles of {low:.0f} to {high:.0f} deg."
