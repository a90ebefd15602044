"""Small targets: which they are, and where their rasters lie."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from simgl.arrays import Array
from simgl.sample_grid import ANGLE
from simgl.sample_grid import MIN_TARGET_SAMPLES as SAMPLES
from simgl.view.small_targets import in_pixels, is_small, nearer, outline_area, raster_window
from tests.passes.exposures import camera

quick = settings(deadline=None, database=None, max_examples=60)
GRID_DEG = float(np.degrees(ANGLE))
CAMERA = camera()  # 2000 px of focal length, 512 x 512


def octahedron(radius: float, place: Array) -> Array:
    return place + radius * np.concatenate([np.eye(3), -np.eye(3)])


@pytest.mark.parametrize("size", [1e-6, 1.0, 1e3])
def test_the_area_of_an_outline_is_that_of_its_hull(size: float) -> None:
    square = np.array([[0, 0], [1, 0], [1, 1], [0, 1], [0.4, 0.5], [0.5, 0.0]]) * size
    assert outline_area(square + 300.0) == pytest.approx(size**2, rel=1e-6)


def test_a_line_has_no_area() -> None:
    assert outline_area(np.array([[1.0, 2.0], [1.0, 3.0], [1.0, 5.0]])) == 0.0
    assert outline_area(np.array([[1.0, 1.0], [2.0, 2.0], [3.0, 3.0]])) == pytest.approx(0.0)


def test_a_thin_outline_across_the_image_is_not_small() -> None:
    rod = np.array([[0.0, 0.0], [100.0, 0.0], [100.0, 1e-4], [0.0, 1e-4]])
    assert not is_small(rod, outline_area(rod), 200, SAMPLES, 1000)
    square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    edge = np.sqrt(SAMPLES / 2000.0)
    for step, small in ((0.99, True), (1.01, False)):
        outline, area = step * edge * square, (step * edge) ** 2
        assert is_small(outline, area, 36, SAMPLES, 72_000) == small


@quick
@given(
    st.floats(1e-3, 10.0),
    st.floats(1e4, 1e9),
    st.floats(-0.12, 0.12),
    st.floats(-0.12, 0.12),
)
def test_a_window_holds_enough_samples_where_the_target_is_seen(
    radius: float, radii: float, x: float, y: float
) -> None:
    hull = octahedron(radius, radii * radius * np.array([x, y, 1.0]))
    factor = nearer(hull)
    drawn = hull + (1.0 / factor - 1.0) * hull.mean(axis=0)
    window = raster_window(drawn, factor, CAMERA, SAMPLES)
    seen, outline = in_pixels(hull, CAMERA), in_pixels(drawn, CAMERA)
    on_raster = outline @ window.raster_from_image[:, :2].T + window.raster_from_image[:, 2]
    assert on_raster.min() >= 0.9
    assert np.all(on_raster.max(axis=0) <= np.array(window.size) - 0.9)
    assert outline_area(on_raster) == pytest.approx(SAMPLES, rel=0.02)
    back = on_raster @ window.image_from_raster[:, :2].T + window.image_from_raster[:, 2]
    # Drawn nearer, its depth shows in perspective: by its radius over 1e4 or more of its radii.
    # Pixel coordinates of some hundred are good to 1e-13.
    extent = float(np.ptp(seen, axis=0).max())
    np.testing.assert_allclose(back, seen, rtol=0.0, atol=2e-4 * extent + 1e-11)
    density = outline_area(on_raster) / outline_area(seen)
    assert window.samples_per_pixel == pytest.approx(density, rel=0.01)
    assert int(np.prod(window.size)) < 4 * SAMPLES


def test_a_near_target_is_drawn_where_it_is() -> None:
    assert nearer(octahedron(0.5, np.array([0.0, 0.0, 1e4]))) == 1.0
    assert nearer(octahedron(0.5, np.array([0.0, 0.0, 1e6]))) == pytest.approx(20.0)


@pytest.mark.parametrize("turn_deg", [0.0, GRID_DEG, 45.0, 90.0 + GRID_DEG])
@pytest.mark.parametrize("thinness", [10.0, 1e3, 1e6])
def test_a_thin_target_takes_no_more_cells_than_a_driver_loops_over(
    turn_deg: float, thinness: float
) -> None:
    """A turn of each row of cells and two of each cell, 65,535 on llvmpipe."""
    c, s = np.cos(np.radians(turn_deg)), np.sin(np.radians(turn_deg))
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * [1.0, 1.0 / thinness]
    hull = np.column_stack([corners @ np.array([[c, s], [-s, c]]), np.full(4, 1e5)])
    columns, rows = (-(-edge // 2) for edge in raster_window(hull, 1.0, CAMERA, 4 * SAMPLES).size)
    assert rows * (2 * columns + 1) < 65_535
    assert rows * columns > 3_000


def test_an_outline_that_is_one_point_has_a_window() -> None:
    """So far away that float64 no longer tells its corners apart."""
    window = raster_window(np.tile([1.0, 2.0, 1e5], (8, 1)), 1.0, CAMERA, SAMPLES)
    assert min(window.size) >= 2
    assert np.isfinite(window.image_from_raster).all()
