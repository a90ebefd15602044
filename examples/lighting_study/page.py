"""The page that sets the study's numbers beside ours, and the image of each case."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from PIL import Image

from examples.lighting_study.cases import CASES, Case, Number
from examples.lighting_study.shot import Shot
from simgl import exposure_value
from simgl.arrays import Image8
from simgl.camera.camera_equation import blender_exposure
from simgl.figures.style import DN_MAP, figure_style, plain_axes

TEMPLATE = Path(__file__).with_name("page_template.md")
# The study's exposure, and the settings of its software that it names.
STUDY_F_NUMBER, STUDY_TIME = 4.0, 1.0 / 2000.0
STUDY_SETTING, STUDY_MIRROR_SETTING = -6.584, -11.98
# A published number and ours are one if they are this close.
CLOSE = 0.2


@dataclass(frozen=True, kw_only=True)
class Reading:
    """What one number of the study is here [W m-2].

    flux : 10, 50 and 90 % of the pixels, relative luminance times 1367
    from_8_bits : median of the same, read from the 8-bit image
    exitance : median, pi times the radiance of 400 to 1000 nm
    """

    number: Number
    flux: tuple[float, float, float]
    from_8_bits: float
    exitance: float


def agrees(reading: Reading, others: Sequence[Reading]) -> str:
    """Whether a published number, or what the study says in words, is so here.

    others : readings of the same image
    """
    number, (dark, middle, bright) = reading.number, reading.flux
    if number.published is not None:
        low, high = number.published
        if (1.0 - CLOSE) * low <= middle <= (1.0 + CLOSE) * high:
            return "yes"
        return "within our range" if dark <= high and bright >= low else "no"
    if number.against is None:
        return "-"
    what, low, high = number.against
    other = next(one for one in others if one.number.what == what)
    return "in kind" if low <= middle / other.flux[1] <= high else "no"


def read(number: Number, shot: Shot) -> Reading:
    """A number from its case's image; its pixels must be in view."""
    pixels = number.pixels(shot)
    dark, middle, bright = (float(v) for v in np.percentile(shot.flux[pixels], [10, 50, 90]))
    return Reading(
        number=number,
        flux=(dark, middle, bright),
        from_8_bits=float(np.median(shot.flux_from_8_bits[pixels])),
        exitance=float(np.median(shot.exitance[pixels])),
    )


def readings(case: Case, shot: Shot) -> list[Reading]:
    """All numbers of a case."""
    return [read(number, shot) for number in case.numbers]


def sheet(shot: Shot) -> Image8:
    """(height, width, 3) sRGB: the image, the study's flux map and scale, the true exitance."""
    from matplotlib.figure import Figure

    height, width = shot.flux.shape
    buffer = io.BytesIO()
    with figure_style():
        figure = Figure(figsize=(13.6, 0.6 + 3.9 * height / width), dpi=100, layout="constrained")
        left, middle, right = figure.subplots(1, 3)
        left.imshow(shot.image, interpolation="antialiased")
        left.set_title("picture")
        for panel, values, top, title in (
            (middle, shot.flux, 1367.0, "relative luminance × 1367 [W m⁻²]"),
            (right, shot.exitance, 814.5, "π × radiance, 400-1000 nm [W m⁻²]"),
        ):
            drawn = panel.imshow(
                values, cmap=DN_MAP, vmin=0.0, vmax=top, interpolation="antialiased"
            )
            figure.colorbar(drawn, ax=panel, shrink=0.9, extend="max")
            panel.set_title(title)
        for panel in (left, middle, right):
            plain_axes(panel)
        figure.savefig(buffer, format="png")
    return np.asarray(Image.open(buffer).convert("RGB"))


def _table(rows: Sequence[Sequence[str]]) -> str:
    head, *body = rows
    lines = [head, ["---"] * len(head), *body]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def _w(value: float) -> str:
    return f"{value:.0f}" if value >= 10.0 else f"{value:.1f}" if value >= 0.1 else "< 0.1"


def _numbers(readings_of: Mapping[str, list[Reading]]) -> str:
    rows = [
        [
            "case",
            "where",
            "study",
            "study's definition, 10 / 50 / 90 %",
            "from 8 bits",
            "exitance",
            "agrees",
        ]
    ]
    for case in CASES:
        for reading in readings_of[case.name]:
            dark, middle, bright = reading.flux
            rows.append(
                [
                    case.title,
                    reading.number.what,
                    reading.number.says or "-",
                    f"{_w(dark)} / **{_w(middle)}** / {_w(bright)}",
                    _w(reading.from_8_bits),
                    _w(reading.exitance),
                    agrees(reading, readings_of[case.name]),
                ]
            )
    return _table(rows)


def _verdicts(shots: Mapping[str, Shot]) -> str:
    rows = [
        ["case", "study's figures", "study", "`simgl assess`", "saturated at 1/2000 s", "CPU time"]
    ]
    for case in CASES:
        shot = shots[case.name]
        reasons = f": {'; '.join(shot.reasons)}" if shot.reasons else ""
        contrast = shot.assessment.contrast
        contrast_text = "" if contrast is None else f", contrast {contrast:.2f}"
        rows.append(
            [
                case.title,
                case.figures,
                case.kind,
                f"**{shot.verdict.value}**{reasons}{contrast_text}",
                f"{100.0 * shot.saturated_at(STUDY_TIME):.0f} %",
                f"{shot.seconds:.1f} s",
            ]
        )
    return _table(rows)


def page(shots: Mapping[str, Shot], readings_of: Mapping[str, list[Reading]], made: str) -> str:
    """docs/lighting_study.md.

    made : date, renderer and machine
    """
    whys = [
        f"- **{case.title}, {reading.number.what}**: {reading.number.why}"
        for case in CASES
        for reading in readings_of[case.name]
        if reading.number.why
    ]
    images = [
        f"### {case.title}\n\n![{case.title}](pictures/study_{case.name}.jpg)\n\n"
        f"The study: {case.kind}. {case.text}".rstrip()
        for case in CASES
    ]
    white = 1367.0 / np.pi * 2.0**STUDY_SETTING
    mirror = 1367.0 / np.pi * 2.0**STUDY_MIRROR_SETTING
    value = exposure_value(STUDY_F_NUMBER, STUDY_TIME)
    return TEMPLATE.read_text(encoding="utf-8").format(
        made=made,
        numbers=_numbers(readings_of),
        verdicts=_verdicts(shots),
        whys="\n".join(whys),
        images="\n\n".join(images),
        white=white,
        clipped=1.0 / white,
        mirror=1367.0 * mirror,
        value=value,
        setting=blender_exposure(value),
    )
