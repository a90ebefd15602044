"""The rows on which lines of sight end, as a polynomial, for lenses that distort."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from simgl.camera.camera import Camera
from simgl.camera.pinhole_fields import pinhole_fields
from simgl.camera.projections import Distortion, Fisheye
from simgl.camera.row_curve import row_curve, rows_on
from tests.passes.exposures import camera


def distorting(distortion: Distortion, focal_length: float) -> Camera:
    plain = camera(0.01, width=1280, height=960)
    lens = replace(plain.lens, distortion=distortion, focal_length=focal_length)
    return replace(plain, lens=lens)


@pytest.mark.parametrize(
    ("distortion", "focal_length"),
    [
        (Distortion(), 0.013),
        (Distortion(k1=-0.2, k2=0.05, p1=1e-3, p2=-5e-4), 0.008),
        (Distortion(k1=-0.25, k2=0.08, k3=-0.01), 0.007),
        (Distortion(k1=0.3), 0.006),
    ],
)
def test_each_pixels_line_of_sight_ends_on_its_row(
    distortion: Distortion, focal_length: float
) -> None:
    seen = distorting(distortion, focal_length)
    (field,) = pinhole_fields(seen)
    places = field.places[::40, ::40].astype(np.float64)
    rows = np.repeat(np.arange(960)[::40] + 0.5, places.shape[1])
    fitted = rows_on(row_curve(seen, field), field.pinhole.rays(places.reshape(-1, 2)))
    # Of 200 px of motion over 960 rows a row is 0.2 px.
    assert np.abs(fitted - rows).max() < 0.05


def test_the_rows_of_a_lens_that_sees_behind_itself_are_those_of_each_of_its_parts() -> None:
    """To 130 deg off the boresight."""
    plain = camera(0.01, width=400, height=400)
    lens = replace(plain.lens, distortion=Fisheye(k1=0.01), focal_length=130 * 5e-6)
    seen = replace(plain, lens=lens)
    fields = pinhole_fields(seen)
    assert len(fields) == 5
    rows = np.mgrid[:400, :400][0] + 0.5
    for field in fields:
        rays = field.pinhole.rays(field.places[field.drawn].astype(np.float64))
        # Of 200 px of motion over 400 rows a row is half a pixel.
        assert np.abs(rows_on(row_curve(seen, field), rays) - rows[field.drawn]).max() < 0.1
