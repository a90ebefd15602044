"""Heat maps of a spacecraft's temperatures in K, and tables of them over time."""

from __future__ import annotations

import csv
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from simgl.arrays import AnyArray, Array
from simgl.figures.style import LIGHT_MAP, figure_style, plain_axes
from simgl.output import complete_file
from simgl.physics.ephemeris import utc_from_tai_ns
from simgl.physics.frames import unit
from simgl.rays import RayTracer
from simgl.thermal.body import ThermalBody, patches_met
from simgl.thermal.history import ThermalState

# Direction from the body to the viewer; body axes, -z up in the image.
_VIEWS = {
    "ahead, right, above": (1.0, 1.0, -0.8),
    "behind, left, above": (-1.0, -1.0, -0.8),
    "ahead, left, below": (1.0, -1.0, 0.8),
    "behind, right, below": (-1.0, 1.0, 0.8),
}
_PIXELS = 700


def write_temperatures(path: Path, body: ThermalBody, states: Iterable[ThermalState]) -> None:
    """A CSV of the parts' temperatures over time.

    Columns: UTC, seconds, for each part the lowest, mean (by area) and highest temperature of its
    surface and that of its structure, and for each node inside its own [K].
    """
    with complete_file(path) as temporary, temporary.open("w", newline="") as file:
        table = csv.writer(file)
        names = body.part_names
        kinds = ("min_k", "mean_k", "max_k", "structure_k")
        header = [f"{name}.{kind}" for name in names for kind in kinds]
        table.writerow(["utc", "seconds", *header, *(f"{n}.node_k" for n in body.inner_names)])
        inner = slice(body.patch_count + len(names), None)
        first = None
        for state in states:
            first = state.tai_ns if first is None else first
            seconds = f"{1e-9 * (state.tai_ns - first):.3f}"
            of_parts = part_temperatures(body, state).ravel()
            values = np.concatenate([of_parts, state.temperatures[inner]])
            cells = ["" if np.isnan(v) else f"{v:.3f}" for v in values]
            table.writerow([utc_from_tai_ns(state.tai_ns), seconds, *cells])


def part_temperatures(body: ThermalBody, state: ThermalState) -> Array:
    """(parts, 4) lowest, mean and highest of a part's free surface, and its structure [K].

    Not a number for a part without any.
    """
    count = body.patch_count
    result = np.full((len(body.part_names), 4), np.nan)
    for part in range(len(result)):
        seen = np.flatnonzero((body.part == part) & ~body.views.covered)
        if len(seen):
            t = state.temperatures[seen]
            mean = np.average(t, weights=body.patches.areas[seen])
            result[part] = t.min(), mean, t.max(), state.temperatures[count + part]
    return result


def write_heat_map(path: Path, body: ThermalBody, state: ThermalState) -> None:
    """Four views of a body, coloured by temperature, joints as stored, as PNG."""
    from matplotlib.colors import Normalize
    from matplotlib.figure import Figure

    images = _cropped([_seen_from(body, state, unit(side)) for side in _VIEWS.values()])
    shown = np.concatenate([image[np.isfinite(image)] for image in images])
    # The full range would be spent on a bracket or two.
    norm = Normalize(*np.percentile(shown, [0.5, 99.5]))
    with figure_style():
        figure = Figure(figsize=(9.6, 8.2))
        axes = figure.subplots(2, 2)
        drawn: Any = None
        for axis, image, title in zip(axes.flat, images, _VIEWS, strict=True):
            drawn = axis.imshow(image, norm=norm, cmap=LIGHT_MAP, interpolation="nearest")
            axis.set_title(f"from {title}")
            plain_axes(axis)
        figure.suptitle(
            f"{body.name}, {utc_from_tai_ns(state.tai_ns)} UTC, {state.history} "
            f"({shown.min():.0f} to {shown.max():.0f} K)"
        )
        figure.subplots_adjust(left=0.02, right=0.86, top=0.9, bottom=0.03, wspace=0.03)
        bar = figure.colorbar(drawn, cax=figure.add_axes((0.89, 0.08, 0.02, 0.78)), extend="both")
        bar.set_label("temperature [K]")
        with complete_file(path) as temporary:
            figure.savefig(temporary, dpi=100)


def _cropped(images: list[AnyArray]) -> list[AnyArray]:
    """The middle of all images, of one size, that the body is in."""
    steps = np.abs(np.arange(_PIXELS) - 0.5 * (_PIXELS - 1))
    seen = np.any([np.isfinite(image) for image in images], axis=0)
    half = (steps[seen.any(axis=axis)].max(initial=1.0) for axis in (1, 0))
    rows, columns = (np.flatnonzero(steps <= 1.04 * h) for h in half)
    return [image[np.ix_(rows, columns)] for image in images]


def _seen_from(body: ThermalBody, state: ThermalState, side: Array) -> AnyArray:
    """(n, n) temperatures as parallel lines of sight meet them; not a number beyond the body."""
    mesh = body.mesh
    right = unit(np.cross((0.0, 0.0, -1.0), side))
    above = np.cross(side, right)
    steps = (2.0 * (np.arange(_PIXELS) + 0.5) / _PIXELS - 1.0) * mesh.radius
    flat = steps[None, :, None] * right - steps[:, None, None] * above
    origins = (mesh.centre + 1.5 * mesh.radius * side + flat).reshape(-1, 3)
    triangle, _ = RayTracer(mesh).hits(origins, np.tile(-side, (len(origins), 1)))
    patch = patches_met(body, triangle.astype(np.int64), -side)
    seen = np.where(triangle >= 0, state.temperatures[patch], np.nan)
    return seen.reshape(_PIXELS, _PIXELS)
