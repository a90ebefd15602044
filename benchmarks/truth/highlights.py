"""Highlights of the Sun's disc: peak and width."""

from __future__ import annotations

import moderngl

from benchmarks.truth.rows import Row, Table, relative, worst
from tests.reference.highlights import LIMB, highlight, width_at_half

_GOAL = 0.01
_PHASES = (0.01, 30.0, 60.0, 90.0, 120.0, 150.0)


def table(gl: moderngl.Context) -> Table:
    """The worst phase angle of each roughness."""
    rows: list[Row] = []
    for roughness in (0.02, 0.05, 0.1, 0.2, 0.4, 0.8):
        peaks, widths = [], []
        for phase in _PHASES:
            steps, got, expected = highlight(gl, roughness, phase, LIMB)
            for name, shown, truth in zip(("in", "across"), got, expected, strict=True):
                where = f"roughness {roughness:g}, phase angle {phase:.0f} deg, {name} the plane"
                case = f"peak, {where}"
                peaks.append(relative(case, float(truth.max()), float(shown.max()), _GOAL))
                if max(truth[0], truth[-1]) < 0.5 * truth.max():
                    true, shown_width = width_at_half(steps, truth), width_at_half(steps, shown)
                    widths.append(relative(f"width, {where}", true, shown_width, _GOAL))
        rows += [worst(one) for one in (peaks, widths) if one]
    return Table(
        title="Highlights of the Sun on a sphere",
        reference="quadrature over the Sun's disc, limb darkened; the worst of six phase angles",
        quantity="BRDF times cosine [sr-1]; width at half height over the lobe's",
        error="relative",
        rows=rows,
    )
