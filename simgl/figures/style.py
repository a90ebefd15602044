"""One style for all plots: colours that stay apart for the colour-blind, light and dark pages.

Lines take the colours of Okabe and Ito (Color Universal Design, 2008), which people of every
common colour vision tell apart. Maps of a quantity are perceptually even: ``LIGHT_MAP`` for light,
``VALUE_MAP`` for everything else.
"""

from __future__ import annotations

import io
import re
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

INK, SOFT, LINE, PAPER = "#1d2430", "#4a5363", "#c9ced6", "#fefefe"
BLUE, ORANGE, GREEN, RED, PURPLE, SKY = (
    "#0072b2", "#e69f00", "#009e73", "#d55e00", "#cc79a7", "#56b4e9"
)  # fmt: skip
CYCLE = (BLUE, RED, GREEN, PURPLE, ORANGE, SKY)
# The Earth's shadow behind a plot over time, and an area of no interest.
SHADE, PALE = "#e3e7ee", "#c8ccd4"
# Darkness, seen on light pages and dark ones.
NIGHT = "#4a5d80"
# Radiance, photons and electrons; every other quantity.
LIGHT_MAP, VALUE_MAP, DN_MAP = "inferno", "viridis", "gray"

# What each colour becomes on a dark page. The others stay readable on both.
_ON_DARK = {
    INK: "#e3e6ec",
    SOFT: "#a3abb9",
    LINE: "#3a414e",
    PAPER: "#14171c",
    BLUE: "#4aa8e0",
    SHADE: "#262d39",
    PALE: "#5a6372",
}


def on_dark(colour: str) -> str:
    """What a colour of this style, "#rrggbb", becomes on a dark page."""
    return _ON_DARK.get(colour, colour)


_TEXT_SIZE = 9.0
_STYLE: dict[Any, Any] = {
    "figure.facecolor": PAPER,
    "savefig.facecolor": PAPER,
    "axes.facecolor": PAPER,
    "axes.edgecolor": SOFT,
    "axes.labelcolor": INK,
    "axes.titlecolor": INK,
    "axes.titlesize": 10.0,
    "axes.labelsize": _TEXT_SIZE,
    "axes.linewidth": 0.8,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.formatter.useoffset": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": LINE,
    "grid.linewidth": 0.6,
    "text.color": INK,
    "xtick.color": SOFT,
    "ytick.color": SOFT,
    "xtick.labelcolor": INK,
    "ytick.labelcolor": INK,
    "xtick.labelsize": 8.0,
    "ytick.labelsize": 8.0,
    "lines.linewidth": 1.5,
    "lines.markersize": 4.0,
    "font.size": _TEXT_SIZE,
    "legend.fontsize": 8.0,
    "legend.frameon": False,
    "image.cmap": VALUE_MAP,
    "image.interpolation": "nearest",
    # Text stays text: it can be searched, read aloud and printed sharp.
    "svg.fonttype": "none",
}


@contextmanager
def figure_style() -> Iterator[None]:
    """Figures made and saved within it have simgl's style."""
    import matplotlib
    from cycler import cycler

    with matplotlib.rc_context({**_STYLE, "axes.prop_cycle": cycler(color=CYCLE)}):
        yield


def plain_axes(axes: Axes) -> None:
    """Axes of an image or a sketch: no grid, no ticks."""
    axes.grid(False)
    axes.set_xticks([])
    axes.set_yticks([])
    axes.spines[["left", "bottom", "top", "right"]].set_visible(False)


def _lay_out(figure: Figure) -> None:
    """Work out where the parts of a figure lie in an SVG, for good.

    Saving it would do so, and draw all of it once more for that.
    """
    from matplotlib.backends.backend_svg import FigureCanvasSVG

    engine = figure.get_layout_engine()
    if engine is not None:
        FigureCanvasSVG(figure)
        engine.execute(figure)
        figure.set_layout_engine(None)


def svg_bytes(figure: Figure) -> bytes:
    """A figure as SVG that follows the reader's choice of light or dark pages.

    The same figure gives the same bytes.
    """
    import matplotlib

    buffer = io.StringIO()
    with matplotlib.rc_context({**_STYLE, "svg.hashsalt": "simgl"}):
        _lay_out(figure)
        figure.savefig(buffer, format="svg", metadata={"Date": None, "Creator": None})
    text = buffer.getvalue()
    names = {colour: f"--c{index}" for index, colour in enumerate(_ON_DARK)}
    for colour, name in names.items():
        text = re.sub(rf"(fill|stroke): ?{colour}\b", rf"\1: var({name})", text)
    light = "".join(f"{name}:{colour};" for colour, name in names.items())
    dark = "".join(f"{names[colour]}:{other};" for colour, other in _ON_DARK.items())
    style = (
        f"<style>:root{{{light}}}"
        f"@media screen and (prefers-color-scheme:dark){{:root{{{dark}}}}}"
        "text{font-family:system-ui,'DejaVu Sans',sans-serif!important}</style>"
    )
    head, body = text.split("<defs>", 1)
    return f"{head}{style}<defs>{body}".encode()
