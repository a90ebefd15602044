"""The approach as a film: the kept images with what the chaser found in them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image

from examples.closed_loop.loop import ReportImage
from examples.closed_loop.report import caption, show
from simgl.figures.style import figure_style, plain_axes
from simgl.output import complete_file

FILM = "docking.webp"

_IMAGE_TIME_MS = 160
# The last image stays.
_LAST_TIME_MS = 2000


def write_film(report_images: Sequence[ReportImage], folder: Path) -> Path:
    """Write an animated WebP file of 400 x 430 pixels; returns its path."""
    with figure_style():
        first, *rest = [_image(report_image) for report_image in report_images]
    with complete_file(folder / FILM) as path:
        first.save(
            path,
            format="WEBP",
            save_all=True,
            append_images=rest,
            duration=[_IMAGE_TIME_MS] * len(rest) + [_LAST_TIME_MS],
            loop=0,
            quality=60,
        )
    return folder / FILM


def _image(report_image: ReportImage) -> Image.Image:
    figure = Figure(figsize=(4.0, 4.3), dpi=100, layout="constrained")
    canvas = FigureCanvasAgg(figure)
    axes = figure.subplots()
    plain_axes(axes)
    show(axes, report_image)
    axes.set_title(caption(report_image.frame), fontsize=10)
    canvas.draw()  # type: ignore[no-untyped-call]
    pixels = canvas.buffer_rgba()  # type: ignore[no-untyped-call]
    return Image.frombuffer("RGBA", canvas.get_width_height(), pixels).convert("RGB")
