"""Images of single epochs for a report: DN as an algorithm gets them, beside radiance."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from simgl.arrays import AnyArray, Mask
from simgl.assess.trajectory_assessment import Assignment
from simgl.assess.verdict import Verdict
from simgl.figures.html_page import plot_source
from simgl.figures.maps import decades_norm
from simgl.figures.style import DN_MAP, LIGHT_MAP, ORANGE, figure_style, plain_axes
from simgl.output import write_dn_png
from simgl.sequence.journal import Row
from simgl.simulator import Capture, Simulator

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# A page shows no more pixels along a row; the PNG beside it has all.
_MAX_SHOWN = 1280
# The enlarged part is this much larger than the target, and at least so many pixels.
_AROUND, _MIN_PART = 1.3, 24
# Brightness temperatures below this are of space [K].
_COLDEST_SHOWN = 150.0


def shown_epochs(rows: Sequence[Row]) -> list[tuple[str, Row]]:
    """Title and row of the best epoch, the worst in view, and the middle one of each verdict."""
    in_view = [row for row in rows if row["verdict"] != Verdict.NOT_IN_VIEW.value]
    if not in_view:
        return []

    def worth(row: Row) -> tuple[float, float]:
        return float(row["usable"] or 0.0), float(row["median_snr"] or 0.0)

    titled = [("best", max(in_view, key=worth)), ("worst", min(in_view, key=worth))]
    for kind in (Verdict.TOO_BRIGHT, Verdict.TOO_DARK, Verdict.CONFUSED, Verdict.GOOD):
        of_kind = [row for row in in_view if row["verdict"] == kind.value]
        if of_kind:
            titled.append((kind.value, of_kind[len(of_kind) // 2]))
    by_frame: dict[object, tuple[str, Row]] = {}
    for title, row in titled:
        by_frame.setdefault(row["frame"], (title, row))
    return list(by_frame.values())


def with_worst_of_requirements(
    shown: list[tuple[str, Row]], worst: Sequence[tuple[str, int]], rows: Sequence[Row]
) -> list[tuple[str, Row]]:
    """Epochs to show, with those at which requirements are broken most.

    worst : requirement and epoch [TAI ns]
    """
    by_frame = {row["frame"]: (title, row) for title, row in shown}
    for key, tai_ns in worst:
        row = next(row for row in rows if row["tai_ns"] == tai_ns)
        title, _ = by_frame.get(row["frame"], ("", row))
        by_frame[row["frame"]] = (f"{title}; worst for {key}" if title else f"worst for {key}", row)
    return sorted(by_frame.values(), key=lambda one: int(one[1]["tai_ns"] or 0))


def epoch_images(
    work: Assignment, title: str, row: Row, simulator: Simulator, folder: Path
) -> dict[str, object]:
    """What the page shows of one epoch; the DN also go into the folder, as 16-bit PNG."""
    tai_ns = int(row["tai_ns"] or 0)
    state, capture = work.capture(simulator, tai_ns)
    assert capture.digital is not None
    assert capture.truth is not None
    on_target = capture.truth.instance == list(state.bodies).index(work.target) + 1
    name = f"{int(row['frame'] or 0):06d}.dn.png"
    write_dn_png(folder / "images" / name, capture.digital)
    dn, detector = capture.digital.dn, capture.info.camera.detector
    levels = np.percentile(dn[on_target], [2, 50, 98]) if on_target.any() else [0.0, 0.0, 0.0]
    return {
        "title": title,
        "row": row,
        "file": f"images/{name}",
        "plot": plot_source(_plot(capture, on_target)),
        "dn": [f"{float(level):.0f}" for level in levels],
        "pedestal": f"{detector.pedestal:.0f}",
        "largest_dn": detector.largest_dn,
        "mosaic": None if detector.mosaic is None else detector.mosaic.order,
        "others": [_image_by(work, camera, tai_ns, simulator) for camera in work.other_cameras],
    }


def _image_by(work: Assignment, camera: str, tai_ns: int, simulator: Simulator) -> dict[str, str]:
    """The image of a camera of the other kind at the same epoch."""
    other = replace(work, camera=camera)
    state, capture = other.capture(simulator, tai_ns)
    assert capture.truth is not None
    on_target = capture.truth.instance == list(state.bodies).index(work.target) + 1
    history = "" if capture.thermal is None else f"; temperatures {capture.thermal.history}"
    return {"camera": f"{camera}{history}", "plot": plot_source(_plot(capture, on_target))}


def _plot(capture: Capture, on_target: Mask) -> Figure:
    """DN from 0 to full scale, the target enlarged, and radiance with its scale, of a thermal
    camera the brightness temperature."""
    from matplotlib.colors import Normalize
    from matplotlib.figure import Figure
    from matplotlib.patches import Rectangle

    assert capture.digital is not None
    dn = capture.digital.dn
    height, width = dn.shape
    full = Normalize(0, capture.info.camera.detector.largest_dn)
    with figure_style():
        figure = Figure(figsize=(10.4, 0.75 + 3.05 * height / width), layout="constrained")
        image, part, light = figure.subplots(1, 3)
        _show(figure, image, dn, full, DN_MAP, "DN, linear from 0 to full scale")
        box = _part(on_target)
        title = "the target, DN"
        if box is None:
            part.set_visible(False)
        else:
            top, bottom, left, right = box
            edge = Rectangle((left - 0.5, top - 0.5), right - left, bottom - top, fill=False,
                             color=ORANGE, linewidth=0.8)  # fmt: skip
            image.add_patch(edge)
            cut = dn[top:bottom, left:right]
            part_norm = Normalize(float(cut.min()), max(float(cut.max()), float(cut.min()) + 1.0))
            title += f", enlarged {width / (right - left):.2g} times, scale of its own"
            _show(figure, part, cut, part_norm, DN_MAP, title)
        _show(figure, light, *_scene_light(capture))
    return figure


def _scene_light(capture: Capture) -> tuple[AnyArray, object, str, str]:
    """Values, scale, colours and title of what reaches the camera."""
    from matplotlib.colors import Normalize

    if (thermal := capture.thermal) is not None:
        kelvin = thermal.brightness_temperature
        # The full range would be spent on space.
        warm = kelvin[kelvin > _COLDEST_SHOWN]
        norm = Normalize(*np.percentile(warm if warm.size else kelvin, [1.0, 99.5]))
        return kelvin, norm, LIGHT_MAP, "brightness temperature [K]"
    assert capture.radiance is not None
    radiance = capture.radiance.radiance.sum(axis=-1, dtype=np.float64)
    positive = np.maximum(radiance, np.finfo(np.float32).tiny)
    label = "radiance 400-1000 nm [W m⁻² sr⁻¹]"
    return positive, decades_norm(radiance), LIGHT_MAP, label


def _show(
    figure: Figure, panel: Axes, values: AnyArray, norm: object, colours: str, title: str
) -> None:
    step = -(-values.shape[1] // _MAX_SHOWN)
    shown = panel.imshow(
        values[::step, ::step],
        norm=norm,  # type: ignore[arg-type]
        cmap=colours,
        # As they are, in the page too.
        interpolation="none",
        extent=(-0.5, values.shape[1] - 0.5, values.shape[0] - 0.5, -0.5),
    )
    plain_axes(panel)
    panel.set_title(title, fontsize=8)
    bar = figure.colorbar(shown, ax=panel, location="bottom", pad=0.02, aspect=30)
    bar.ax.tick_params(labelsize=7)
    bar.outline.set_visible(False)


def _part(on_target: Mask) -> tuple[int, int, int, int] | None:
    """Rows and columns of a square about the target; None where it is not in view."""
    rows, columns = np.nonzero(on_target)
    if rows.size == 0:
        return None
    height, width = on_target.shape
    span = max(int(np.ptp(rows)), int(np.ptp(columns))) + 1
    side = min(max(round(_AROUND * span), _MIN_PART), height, width)
    top = int(np.clip((rows.min() + rows.max() + 1 - side) // 2, 0, height - side))
    left = int(np.clip((columns.min() + columns.max() + 1 - side) // 2, 0, width - side))
    return top, top + side, left, left + side
