"""Plots of an assessment over time: geometry, and what the images show of the target."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np

from simgl.arrays import Array
from simgl.assess.requirement_check import Check
from simgl.figures.style import (
    BLUE,
    GREEN,
    INK,
    ORANGE,
    PAPER,
    PURPLE,
    RED,
    SHADE,
    SOFT,
    figure_style,
)
from simgl.physics.ephemeris import utc_from_tai_ns
from simgl.sequence.journal import Row

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

NO_BANDS: Mapping[str, Array] = MappingProxyType({})
_WIDTH, _PANEL_HEIGHT = 10.4, 1.55
# A quantity that changes by less than this share of itself is constant.
_CONSTANT = 1e-6
# A quantity that spans more than this ratio is drawn over a logarithmic axis.
_LOG_RATIO = 10.0
# A signal-to-noise ratio below this is none, on a logarithmic axis.
_MIN_SNR = 0.1


def column(rows: Sequence[Row], name: str) -> Array:
    """(rows,) a column of numbers; NaN where it has none."""
    return np.array([np.nan if row[name] is None else float(row[name] or 0.0) for row in rows])


def minutes_of(rows: Sequence[Row]) -> Array:
    """(rows,) minutes from the first epoch."""
    start = int(rows[0]["tai_ns"] or 0)
    return np.array([(int(row["tai_ns"] or 0) - start) / 60e9 for row in rows])


class TimePlot:
    """Panels over one time axis, with the Earth's shadow behind them.

    bands : (3, rows) 5, 50 and 95 % of columns that draws vary

    Use it within ``figure_style``.
    """

    def __init__(
        self,
        rows: Sequence[Row],
        checks: Sequence[Check],
        panels: int,
        bands: Mapping[str, Array] = NO_BANDS,
    ) -> None:
        from matplotlib.figure import Figure

        self.rows, self.minutes = rows, minutes_of(rows)
        self._checks, self._bands = checks, bands
        self.figure = Figure(figsize=(_WIDTH, _PANEL_HEIGHT * panels + 0.5), layout="constrained")
        grid = self.figure.subplots(panels, 1, sharex=True, squeeze=False)
        self.panels: list[Axes] = list(grid[:, 0])

    def line(
        self, panel: Axes, name: str, colour: str, label: str = "", scale: float = 1.0
    ) -> None:
        """A column over time, with its band and the limits that requirements set it."""
        values = scale * column(self.rows, name)
        marker = "o" if len(self.rows) < 40 else ""
        panel.plot(self.minutes, values, color=colour, label=label or None, marker=marker)
        if (band := self._bands.get(name)) is not None:
            self.band(panel, scale * band[0], scale * band[2], colour)
        for check in self._checks:
            if check.requirement.of.column == name:
                self._limit(panel, check, scale)

    def band(self, panel: Axes, low: Array, high: Array, colour: str) -> None:
        """What lies between two values at each epoch."""
        panel.fill_between(self.minutes, low, high, color=colour, alpha=0.3, linewidth=0)

    def _limit(self, panel: Axes, check: Check, scale: float) -> None:
        limit = scale * check.requirement.limit
        panel.axhline(limit, color=RED, linewidth=1.0, linestyle=(0, (5, 2)))
        panel.annotate(
            "min" if check.requirement.is_minimum else "max",
            (1.0, limit), xycoords=("axes fraction", "data"), xytext=(4, 0),
            textcoords="offset points", fontsize=7, color=RED, va="center", annotation_clip=False,
        )  # fmt: skip

    def finish(self) -> Figure:
        """The figure, with shadow, ticks and the label of its time axis."""
        for panel in self.panels:
            self._shade(panel)
            low, high = panel.get_ylim()
            if high - low < _CONSTANT * abs(high):
                # Its rounding errors are no news.
                panel.set_ylim(0.99 * low, 1.01 * high)
            panel.margins(x=0.01)
        start = utc_from_tai_ns(int(self.rows[0]["tai_ns"] or 0))[:19]
        self.panels[-1].set_xlabel(f"time from {start.replace('T', ' ')} UTC [min]")
        self.figure.align_ylabels(self.panels)
        return self.figure

    def _shade(self, panel: Axes) -> None:
        """The Earth's shadow on the target."""
        dark = column(self.rows, "sunlight") < 0.5
        edges = np.flatnonzero(np.diff(np.concatenate([[False], dark, [False]]).astype(int)))
        middle = 0.5 * (self.minutes[1:] + self.minutes[:-1])
        bounds = np.concatenate([self.minutes[:1], middle, self.minutes[-1:]])
        for begin, end in zip(edges[::2], edges[1::2], strict=True):
            panel.axvspan(bounds[begin], bounds[end], color=SHADE, linewidth=0, zorder=0)


def _spread(panel: Axes, values: Array) -> None:
    """A logarithmic axis for a quantity that spans decades."""
    known = values[np.isfinite(values) & (values > 0.0)]
    if known.size and known.max() > _LOG_RATIO * known.min():
        panel.set_yscale("log")
        panel.yaxis.set_major_formatter("{x:g}")


def geometry_plot(
    rows: Sequence[Row], checks: Sequence[Check], bands: Mapping[str, Array] = NO_BANDS
) -> Figure:
    """Range, size, phase angle, Sun and Earth about the boresight, beta angle, sunlight."""
    has_orbit = any(row["beta_angle_deg"] is not None for row in rows)
    with figure_style():
        plot = TimePlot(rows, checks, 6 if has_orbit else 5, bands)
        distance, size, phase, exclusion, *orbit, sunlight = plot.panels
        plot.line(distance, "range_m", BLUE)
        distance.set_ylabel("range [m]")
        _spread(distance, column(rows, "range_m"))
        plot.line(size, "target_size_px", BLUE)
        size.set_ylabel("target size [px]")
        _spread(size, column(rows, "target_size_px"))
        plot.line(phase, "phase_angle_deg", BLUE)
        phase.set_ylabel("phase angle [deg]")
        # In eclipse the Sun is where it is, though it does not count.
        exclusion.plot(plot.minutes, column(rows, "sun_to_boresight_deg"), color=ORANGE, alpha=0.5,
                       linewidth=1.0, linestyle=":")  # fmt: skip
        plot.line(exclusion, "sun_exclusion_deg", ORANGE, "Sun")
        if any(row["earth_limb_deg"] is not None for row in rows):
            plot.line(exclusion, "earth_limb_deg", GREEN, "Earth's limb, negative: Earth in sight")
        exclusion.set_ylabel("from boresight [deg]")
        exclusion.legend(loc="best", ncols=2)
        for panel in orbit:
            plot.line(panel, "beta_angle_deg", PURPLE)
            panel.set_ylabel("beta angle [deg]")
            # The angle drifts by less than a degree an hour.
            middle = float(np.nanmean(column(rows, "beta_angle_deg")))
            panel.set_ylim(middle - 5.0, middle + 5.0)
        plot.line(sunlight, "sunlight", ORANGE, scale=100.0)
        sunlight.set(ylabel="sunlight [%]", ylim=(-5.0, 105.0))
        return plot.finish()


def image_plot(
    rows: Sequence[Row],
    checks: Sequence[Check],
    colours: Mapping[str, str],
    bands: Mapping[str, Array] = NO_BANDS,
) -> Figure:
    """Shares of the target's pixels, signal-to-noise ratio, contrast, and electrons or, of a
    thermal camera, temperatures.

    colours : of the shares usable, dark and saturated
    """
    with figure_style():
        plot = TimePlot(rows, checks, 4, bands)
        shares, signal, contrast, last = plot.panels
        names = list(colours)
        shares.stackplot(
            plot.minutes,
            [100.0 * np.nan_to_num(column(rows, name)) for name in names],
            labels=names,
            colors=[colours[name] for name in names],
            alpha=0.85,
        )
        for name in names:
            for check in checks:
                if check.requirement.of.column == name:
                    shares.axhline(100.0 * check.requirement.limit, color=RED, linewidth=1.0,
                                   linestyle=(0, (5, 2)))  # fmt: skip
        if bands:
            # Of the borders between the areas: above the usable, below the saturated.
            usable, saturated = 100.0 * bands["usable"], 100.0 * bands["saturated"]
            plot.band(shares, usable[0], usable[2], PAPER)
            plot.band(shares, 100.0 - saturated[2], 100.0 - saturated[0], PAPER)
        shares.set(ylabel="target pixels [%]", ylim=(0.0, 100.0))
        shares.legend(loc="upper center", bbox_to_anchor=(0.5, 1.22), ncols=3)
        plot.line(signal, "median_snr", GREEN)
        signal.set_ylabel("signal-to-noise\nratio, median [1]")
        if column(rows, "median_snr").max() > _LOG_RATIO:
            signal.set_yscale("log")
            signal.set_ylim(bottom=max(_MIN_SNR, 0.5 * float(column(rows, "median_snr").min())))
        plot.line(contrast, "contrast", PURPLE)
        contrast.set(ylabel="contrast to\nbackground [1]", ylim=(-0.05, 1.05))
        if "netd_k" in rows[0]:
            _temperature(plot, last)
        else:
            _electrons(plot, last)
        return plot.finish()


def _electrons(plot: TimePlot, panel: Axes) -> None:
    """Of the target's pixels, and how many are full."""
    full = column(plot.rows, "full_electrons")[0]
    for name, colour, label in (
        ("bright_electrons", ORANGE, "brightest 2 %"),
        ("median_electrons", BLUE, "median"),
    ):
        plot.line(panel, name, colour, label)
    panel.axhline(full, color=INK, linewidth=1.0, linestyle=":", label="full")
    panel.set_ylabel("electrons [e⁻]")
    panel.set_yscale("symlog", linthresh=10.0)
    panel.set_ylim(bottom=0.0)
    panel.tick_params(axis="y", which="minor", left=False)
    panel.legend(loc="best", ncols=3, labelcolor=SOFT)


def _temperature(plot: TimePlot, panel: Axes) -> None:
    """Temperatures of the target's surfaces in view, and what is seen of it and beside it."""
    for name, colour, label in (
        ("target_highest_k", RED, "highest"),
        ("target_mean_k", ORANGE, "mean"),
        ("target_lowest_k", BLUE, "lowest"),
        ("target_brightness_k", INK, "brightness"),
        ("background_brightness_k", GREEN, "brightness beside"),
    ):
        plot.line(panel, name, colour, label)
    panel.set_ylabel("temperature [K]")
    panel.legend(loc="best", ncols=5, labelcolor=SOFT)
