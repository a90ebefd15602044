"""Where it happens: the ground track, the orbit with Sun and shadow, and the camera's path."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from simgl.arrays import Array
from simgl.assess.time_plots import column
from simgl.assess.trajectory_assessment import Assignment
from simgl.figures.style import (
    BLUE,
    GREEN,
    INK,
    LINE,
    ORANGE,
    PAPER,
    RED,
    SHADE,
    SOFT,
    figure_style,
    plain_axes,
)
from simgl.passes.background.earth_maps import shore_map
from simgl.physics.ephemeris import itrf_from_icrf
from simgl.physics.frames import unit
from simgl.sequence.journal import Row

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Of the map of shores, for two pixels a degree behind a ground track.
_EVERY = 22
# Fields of view that a sketch of the camera's path shows.
_WEDGES = 5


def ground_track(
    work: Assignment, rows: Sequence[Row], marked: Sequence[tuple[str, int]]
) -> Figure | None:
    """The track below the target over land, lit and eclipsed, with night at its middle.

    marked : name and epoch [TAI ns] of places to mark
    returns : None for a scene without Earth
    """
    if rows[0]["latitude_deg"] is None:
        return None
    from matplotlib.figure import Figure

    longitude, latitude = column(rows, "longitude_deg"), column(rows, "latitude_deg")
    with figure_style():
        figure = Figure(figsize=(10.4, 4.9), layout="constrained")
        panel = figure.subplots()
        panel.imshow(_land(), extent=(-180, 180, -90, 90), interpolation="bilinear", zorder=0.5)
        middle = rows[len(rows) // 2]
        _draw_night(panel, work, int(middle["tai_ns"] or 0))
        dark = column(rows, "sunlight") < 0.5
        # A step across the date line starts a new stroke.
        breaks = np.abs(np.diff(longitude, prepend=longitude[0])) > 180.0
        for mask, colour, name in (
            (~dark, ORANGE, "sunlit"),
            (dark, BLUE, "in the Earth's shadow"),
        ):
            shown = np.where(mask & ~breaks, latitude, np.nan)
            panel.plot(longitude, shown, ".-", color=colour, label=name, markersize=4)
        panel.plot(longitude[0], latitude[0], "o", color=INK, markersize=7, fillstyle="none",
                   label="start")  # fmt: skip
        for name, tai_ns in marked:
            row = next(row for row in rows if row["tai_ns"] == tai_ns)
            at = float(row["longitude_deg"] or 0.0), float(row["latitude_deg"] or 0.0)
            panel.plot(*at, "x", color=RED, markersize=7)
            panel.annotate(name, at, xytext=(6, 5), textcoords="offset points", fontsize=8)
        panel.set(xlim=(-180, 180), ylim=(-90, 90), aspect="equal",
                  xlabel="longitude [deg]", ylabel="latitude [deg]")  # fmt: skip
        panel.set_xticks(range(-180, 181, 60))
        panel.set_yticks(range(-90, 91, 30))
        panel.legend(loc="lower left", ncols=4)
    return figure


def _land() -> Array:
    """(height, width, 4) RGBA: land in a soft grey, sea transparent."""
    # Codes above the middle are sea.
    shore = shore_map(None)[0][_EVERY // 2 :: _EVERY, _EVERY // 2 :: _EVERY, 0].astype(np.float64)
    red, green, blue = (int(SOFT[i : i + 2], 16) / 255.0 for i in (1, 3, 5))
    alpha = 0.35 * np.clip((140.0 - shore) / 24.0, 0.0, 1.0)
    return np.stack([np.full_like(alpha, c) for c in (red, green, blue)] + [alpha], axis=-1)


def _draw_night(panel: Axes, work: Assignment, tai_ns: int) -> None:
    """Where the Sun is below the horizon, and where it is overhead."""
    R_itrf_from_icrf = itrf_from_icrf(tai_ns)
    x, y, z = R_itrf_from_icrf @ work.scenario.at(tai_ns).sun.seen_from(np.zeros(3)).direction_icrf
    latitudes, longitudes = (
        np.radians(np.linspace(-90, 90, 181)),
        np.radians(np.linspace(-180, 180, 361)),
    )
    up = (
        np.cos(latitudes)[:, None] * (np.cos(longitudes) * x + np.sin(longitudes) * y)
        + np.sin(latitudes)[:, None] * z
    )
    panel.contourf(np.degrees(longitudes), np.degrees(latitudes), up, levels=[-2.0, 0.0],
                   colors=[SHADE], zorder=0.2)  # fmt: skip
    panel.plot(math.degrees(math.atan2(y, x)), math.degrees(math.asin(z)), "*", color=ORANGE,
               markersize=12, label="Sun overhead, night grey")  # fmt: skip


def geometry_sketch(work: Assignment, rows: Sequence[Row]) -> Figure | None:
    """The orbit from its north, and the camera's path about the target with its fields of view.

    returns : None where the target is on no orbit
    """
    if rows[0]["camera_x_lvlh_m"] is None:
        return None
    from matplotlib.figure import Figure

    with figure_style():
        figure = Figure(figsize=(10.4, 4.6), layout="constrained")
        orbit, local = figure.subplots(1, 2, width_ratios=(1.0, 1.25))
        _draw_orbit(orbit, work, rows)
        _draw_path(local, work, rows)
    return figure


def _draw_orbit(panel: Axes, work: Assignment, rows: Sequence[Row]) -> None:
    """To scale, seen against the orbit's normal; the Sun's direction in the orbit plane."""
    from matplotlib.patches import Circle, Polygon

    scenario = work.scenario
    states = [scenario.at(int(row["tai_ns"] or 0)) for row in rows]
    places = np.array([state.bodies[work.target].pose.position for state in states])
    first = states[0].bodies[work.target].pose
    along = unit(first.position)
    normal = unit(np.cross(first.position, first.velocity))
    across = np.cross(normal, along)
    sun = states[len(states) // 2].sun.seen_from(first.position).direction_icrf
    sunward = np.array([along @ sun, across @ sun])
    length = float(np.linalg.norm(sunward))
    assert scenario.earth is not None
    radius = scenario.earth.equatorial_radius * 1e-3
    flat = np.stack([places @ along, places @ across], axis=1) * 1e-3
    reach = 1.25 * float(np.linalg.norm(flat, axis=1).max())
    if length > 1e-3:
        direction = sunward / length
        side = np.array([-direction[1], direction[0]]) * radius
        away = -2.0 * reach * direction
        shadow = Polygon([side, -side, away - side, away + side], color=SHADE, zorder=0.2)
        panel.add_patch(shadow)
        panel.annotate(
            "Sun", xy=tuple(0.88 * reach * direction), xytext=tuple(1.1 * reach * direction),
            fontsize=9, ha="center", va="center", annotation_clip=False,
            arrowprops={"arrowstyle": "->", "color": ORANGE, "linewidth": 1.5},
        )  # fmt: skip
    panel.add_patch(Circle((0.0, 0.0), radius, color=GREEN, alpha=0.35, zorder=0.5))
    panel.text(0.0, 0.0, "Earth", ha="center", va="center")
    turn = np.linspace(0.0, 2.0 * np.pi, 181)
    size = float(np.linalg.norm(flat[0]))
    panel.plot(size * np.cos(turn), size * np.sin(turn), color=LINE, linewidth=1.0)
    dark = column(rows, "sunlight") < 0.5
    for mask, colour, name in ((~dark, ORANGE, "sunlit"), (dark, BLUE, "eclipsed")):
        panel.plot(flat[mask, 0], flat[mask, 1], ".", color=colour, label=name)
    panel.plot(*flat[0], "o", color=INK, fillstyle="none", markersize=8, label="start")
    panel.set(xlim=(-reach, reach), ylim=(-reach, reach), aspect="equal")
    plain_axes(panel)
    beta = float(rows[len(rows) // 2]["beta_angle_deg"] or 0.0)
    panel.set_title(f"Orbit of {work.target} to scale, from its north; beta {beta:.1f} deg")
    panel.legend(loc="lower center", bbox_to_anchor=(0.5, -0.12), ncols=3)


def _draw_path(panel: Axes, work: Assignment, rows: Sequence[Row]) -> None:
    """The camera about the target in the plane of V-bar and R-bar, with fields of view."""
    from matplotlib.patches import Polygon

    camera = np.stack([column(rows, f"camera_{axis}_lvlh_m") for axis in "xz"], axis=1)
    sight = np.stack([column(rows, f"boresight_{axis}_lvlh") for axis in "xz"], axis=1)
    sun = np.stack([column(rows, f"sun_{axis}_lvlh") for axis in "xz"], axis=1)
    half = 0.5 * work.scenario.cameras[work.camera].fields_of_view[0]
    chosen = np.unique(np.linspace(0, len(rows) - 1, min(_WEDGES, len(rows))).round().astype(int))
    reach = float(np.abs(camera).max())
    for index in chosen:
        start, direction = camera[index], sight[index]
        angle = math.atan2(direction[1], direction[0])
        distance = float(np.linalg.norm(start))
        corners = [
            start + distance * np.array([math.cos(angle + turn), math.sin(angle + turn)])
            for turn in np.linspace(-half, half, 9)
        ]
        panel.add_patch(
            Polygon([start, *corners], color=BLUE, alpha=0.13, linewidth=0.0, zorder=0.6)
        )
        panel.annotate(
            "", start + 0.16 * reach * sun[index], xytext=start, annotation_clip=False,
            arrowprops={"arrowstyle": "->", "color": ORANGE, "linewidth": 1.3},
        )  # fmt: skip
    panel.plot(camera[:, 0], camera[:, 1], ".-", color=BLUE, label="camera, with its field of view")
    panel.plot(*camera[0], "o", color=INK, fillstyle="none", markersize=8, label="start")
    panel.plot(0.0, 0.0, "s", color=RED, markeredgecolor=PAPER, markersize=7, label=work.target)
    panel.plot([], [], "-", color=ORANGE, label="towards the Sun, projected")
    panel.set(
        aspect="equal",
        xlabel="along track, x of LVLH (V-bar) [m]",
        ylabel="towards the Earth, z of LVLH (R-bar) [m]",
    )
    panel.set_adjustable("datalim")
    panel.margins(0.12)
    panel.invert_yaxis()
    panel.set_title(f"{work.camera} about {work.target}, in the orbit plane")
    panel.legend(loc="best", fontsize=7)
