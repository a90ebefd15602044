"""Displays of radiance as in the source study: relative flux, and false colours by exposure.

The study renders a Sun whose R, G and B each carry the full solar constant, and weights them by
luminance. Here each band is relative to a white plate that faces the Sun, which gives the same
numbers for grey surfaces. The result is not a physical flux.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from simgl.arrays import Array, Array32, Image8
from simgl.display_colours import WHITE_RADIANCE

# Weights of the primaries of ITU-R BT.709.
_LUMA = np.array([0.2126, 0.7152, 0.0722])
SOURCE_SOLAR_CONSTANT = 1367.0  # [W m-2] of the source study


class Step(NamedTuple):
    """An entry of the legend: value, sRGB colour and name."""

    value: float
    colour: str
    name: str


# The source study's legend; its number at -2.5 EV, a misprint, is replaced by 0.18 2^-2.5.
LEGEND = (
    Step(0.0001762728758, "#000000", "low clip"),
    Step(0.00099436891, "#6a0dad", "-7.5 EV"),
    Step(0.005625, "#1f3fff", "-5 EV"),
    Step(0.18 * 2.0**-2.5, "#00d7e8", "-2.5 EV"),
    Step(0.178, "#19c37d", "-0.01 EV"),
    Step(0.18009142, "#808080", "0 EV"),
    Step(0.181, "#a6d608", "+0.01 EV"),
    Step(0.80779930598, "#ffe600", "+2.17 EV"),
    Step(3.62857262286, "#e00000", "+4.33 EV"),
    Step(16.29174024, "#ffffff", "high clip"),
)


def relative_luminance(radiance: Array32) -> Array:
    """(height, width), 1 for a white plate that faces the Sun at 1 au.

    radiance : (height, width, 4) [W m-2 sr-1]
    """
    return (radiance[..., :3] / WHITE_RADIANCE.astype(np.float64)) @ _LUMA


def relative_flux(radiance: Array32) -> Array:
    """The source study's flux [W m-2]: relative luminance times 1367."""
    return relative_luminance(radiance) * SOURCE_SOLAR_CONSTANT


def scene_value(radiance: Array32, setting: float) -> Array:
    """Value that the false colours encode: the study's relative radiance times 2^setting.

    setting : exposure setting of its software (``blender_exposure``)
    """
    return relative_flux(radiance) / math.pi * 2.0**setting


def false_colour(value: Array) -> Image8:
    """(height, width, 3) sRGB: the legend's colours, interpolated by the value's logarithm."""
    steps = np.log2([step.value for step in LEGEND])
    colours = np.array([_rgb(step.colour) for step in LEGEND])
    with np.errstate(divide="ignore"):
        place = np.log2(value)
    mixed = np.stack([np.interp(place, steps, channel) for channel in colours.T], axis=-1)
    mixed[value < LEGEND[0].value] = colours[0]
    mixed[value > LEGEND[-1].value] = colours[-1]
    return np.round(mixed).astype(np.uint8)


def _rgb(text: str) -> tuple[int, int, int]:
    return int(text[1:3], 16), int(text[3:5], 16), int(text[5:7], 16)
