"""Sunlight on and beside sheets and rods is what rays say, to the pixel."""

from __future__ import annotations

from dataclasses import replace

import moderngl
import numpy as np
import pytest

from tests.passes.thin_casters import (
    GREEN,
    REFLECTANCE,
    sun_directions,
    thin_scenes,
    wrong_pixels,
)
from tests.scenes import radiance

SUNS = sun_directions(10)


# The Sun 0 stands along walls to 0.6 degrees.
@pytest.mark.parametrize(
    ("name", "sun"),
    [
        ("closed corner of sheets", 0),
        ("open box", 0),
        ("open box from 5 cm", 0),
        ("open box from 5 cm, obliquely", 0),
        ("folded sheets", 0),
        ("folded sheets", 5),
        ("T of three sheets", 6),
        ("boom of 2 cm beside a bus from 0.5 m", 2),
        ("box of walls of 1 mm", 3),
    ],
)
def test_no_pixel_leaks_at_creases_of_sheets_nor_speckles_on_rods(
    gl: moderngl.Context, name: str, sun: int
) -> None:
    thin = replace(thin_scenes()[name], width_px=150)
    wrong, compared = wrong_pixels(gl, thin, SUNS[sun], rays=16)
    assert np.count_nonzero(compared) > 3000
    assert np.count_nonzero(wrong) == 0


def test_a_grazed_floor_is_dark_along_the_foot_of_the_wall_that_shades_it(
    gl: moderngl.Context,
) -> None:
    """The Sun stands 5.7 degrees over the floor, behind a wall of a metre that shades all that the
    camera sees."""
    sun = SUNS[4]
    scenario = replace(thin_scenes()["closed corner of sheets"], width_px=150).scenario(sun)
    image = radiance(gl, scenario)[..., 1] / (REFLECTANCE / np.pi * GREEN)
    # Pixels in full light: a hundredth of the crease, which runs over 100 rows. A texel's middle
    # that falls on the crease itself shows the wall and the floor at once.
    assert image.sum() / sun[2] < 0.01 * 100.0
