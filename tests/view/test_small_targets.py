"""Small targets: which they are, and where their rasters lie."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from simgl.arrays import Array
from simgl.sample_grid import MAX_SAMPLES, MIN_TARGET_SAMPLES
from simgl.view.small_targets import in_pixels, is_small, nearer, outline_area, raster_window
from tests.passes.exposures import camera

quick = settings(deadline=None, database=None, max_examples=60)
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
    assert not is_small(rod, outline_area(rod))
    square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    edge = np.sqrt(MIN_TARGET_SAMPLES / MAX_SAMPLES)
    assert is_small(0.99 * edge * square, (0.99 * edge) ** 2)
    assert not is_small(1.01 * edge * square, (1.01 * edge) ** 2)


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
    window = raster_window(drawn, factor, CAMERA)
    seen, outline = in_pixels(hull, CAMERA), in_pixels(drawn, CAMERA)
    on_raster = outline @ window.raster_from_image[:, :2].T + window.raster_from_image[:, 2]
    assert on_raster.min() >= 0.9
    assert np.all(on_raster.max(axis=0) <= np.array(window.size) - 0.9)
    assert outline_area(on_raster) == pytest.approx(MIN_TARGET_SAMPLES, rel=0.02)
    back = on_raster @ window.image_from_raster[:, :2].T + window.image_from_raster[:, 2]
    # Drawn nearer, its depth shows in perspective: by its radius over 1e4 or more of its radii.
    # Pixel coordinates of some hundred are good to 1e-13.
    extent = float(np.ptp(seen, axis=0).max())
    np.testing.assert_allclose(back, seen, rtol=0.0, atol=2e-4 * extent + 1e-11)
    density = outline_area(on_raster) / outline_area(seen)
    assert window.samples_per_pixel == pytest.approx(density, rel=0.01)
    assert int(np.prod(window.size)) < 4 * MIN_TARGET_SAMPLES


def test_a_near_target_is_drawn_where_it_is() -> None:
    assert nearer(octahedron(0.5, np.array([0.0, 0.0, 1e4]))) == 1.0
    assert nearer(octahedron(0.5, np.array([0.0, 0.0, 1e6]))) == pytest.approx(20.0)
