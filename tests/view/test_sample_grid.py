"""The turned sampling grid: complete, even, and within its raster."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from simgl.arrays import Array, IndexArray
from simgl.passes.shading_points import LAYERS
from simgl.sample_grid import (
    MAX_SAMPLES,
    MIN_SAMPLES,
    MIN_TARGET_SAMPLES,
    PIXEL_CENTRES,
    SampleGrid,
    choose_sample_grid,
    rotated_sample_grid,
    target_samples,
)
from simgl.view.raster_tiles import CellGrid

quick = settings(deadline=None, database=None, max_examples=60)
lattices = pytest.mark.parametrize("samples", [MIN_SAMPLES, 7.3, 16, 37, 101, MAX_SAMPLES])
sizes = st.integers(1, 60)


def sample_places(sample_grid: SampleGrid, width: int, height: int) -> Array:
    """(n, 2) pixel coordinates of the centres of all texels of a tile's raster."""
    columns, rows = sample_grid.raster_size(width, height)
    u, v = np.meshgrid(np.arange(columns) + 0.5, np.arange(rows) + 0.5, indexing="ij")
    raster_from_pixel = sample_grid.raster_from_pixel(width)
    texels = np.stack([u.ravel(), v.ravel()]) - raster_from_pixel[:, 2:]
    return np.asarray(np.linalg.solve(raster_from_pixel[:, :2], texels).T)


def per_pixel(sample_grid: SampleGrid, width: int, height: int) -> IndexArray:
    """(width, height) samples within each pixel."""
    edges = [np.arange(width + 1), np.arange(height + 1)]
    counts, _ = np.histogramdd(sample_places(sample_grid, width, height), bins=edges)
    return counts.astype(np.int64)


@lattices
def test_a_pixel_holds_n_samples_on_average_and_never_none(samples: float) -> None:
    counts = per_pixel(rotated_sample_grid(samples), 60, 40)
    assert counts.min() >= 1
    # A convex region of area n and perimeter 4 sqrt(n) has about one sample an edge length too many
    # or few along its rim of 200 sqrt(n) grid steps: far below a perimeter of samples.
    assert abs(counts.sum() - samples * 60 * 40) < 200.0 * np.sqrt(samples)


@lattices
def test_the_samples_of_a_pixel_stand_in_different_columns_and_rows(samples: float) -> None:
    sample_grid = rotated_sample_grid(samples)
    places = sample_places(sample_grid, 3, 3)
    inside = places[np.all((places > 1.0) & (places < 2.0), axis=1)]
    for axis in range(2):
        gaps = np.diff(np.sort(inside[:, axis]))
        # A grid along the pixels would repeat each column sqrt(n) times, with gaps of zero. The
        # three-gap theorem for a slope of type [0; 4, 4, ...] keeps them above 1 / (6 n) or so.
        assert gaps.min() > 1.0 / (10.0 * samples)


@lattices
def test_samples_do_not_favour_a_side_of_the_pixel(samples: float) -> None:
    sample_grid = rotated_sample_grid(samples)
    places = sample_places(sample_grid, 60, 40)
    inside = np.all((places > 0.0) & (places < [60.0, 40.0]), axis=1)
    mean = np.mod(places[inside], 1.0).mean(axis=0)
    # Positions spread evenly modulo 1: a discrepancy of a few parts in the count.
    count = int(inside.sum())
    np.testing.assert_allclose(mean, 0.5, rtol=0.0, atol=0.2 * np.sqrt(1.0 / count) + 1e-3)


@quick
@given(st.floats(MIN_SAMPLES, MAX_SAMPLES), sizes, sizes)
def test_the_raster_holds_every_sample_of_its_tile(samples: float, width: int, height: int) -> None:
    sample_grid = rotated_sample_grid(samples)
    columns, rows = sample_grid.raster_size(width, height)
    corners = np.array([[0, 0, 1], [width, 0, 1], [0, height, 1], [width, height, 1]])
    u, v = sample_grid.raster_from_pixel(width) @ corners.T
    # Of a texel that reaches out by less than this, the centre is well inside.
    assert u.min() >= -1e-9
    assert v.min() >= -1e-9
    assert u.max() <= columns + 1e-9
    assert v.max() <= rows + 1e-9
    # And it is no larger than it must be.
    assert columns - u.max() < 1.0
    assert rows - v.max() < 1.0


@quick
@given(st.floats(MIN_SAMPLES, MAX_SAMPLES), st.integers(0, 30), st.integers(0, 30))
def test_the_window_of_a_cell_holds_all_its_samples(samples: float, column: int, row: int) -> None:
    sample_grid = rotated_sample_grid(samples)
    raster_from_cell = sample_grid.raster_from_pixel(31)
    raster_from_cell[:, :2] /= sample_grid.cells_per_edge
    cells = CellGrid(size=(31, 31), raster_from_cell=raster_from_cell)
    middle = raster_from_cell @ np.array([column + 0.5, row + 0.5, 1.0])
    first = np.ceil(middle - cells.reach - 0.5)
    steps = np.stack(np.meshgrid(*2 * [np.arange(-2, cells.texels + 2)]), axis=-1).reshape(-1, 2)
    from_raster = np.linalg.inv(raster_from_cell[:, :2])
    place = (first + steps + 0.5 - raster_from_cell[:, 2]) @ from_raster.T
    inside = np.all(np.floor(place) == (column, row), axis=1)
    assert steps[inside].min() >= 0
    assert steps[inside].max() < cells.texels
    # Neither are the windows larger than the shader's bits allow.
    assert cells.texels <= 5


def test_the_grid_is_square_and_keeps_its_handedness() -> None:
    turn = rotated_sample_grid(37.0).turn
    # n samples for each unit of area, both directions alike, at a right angle.
    np.testing.assert_allclose(turn @ turn.T, 37.0 * np.eye(2), rtol=1e-14, atol=1e-13)
    assert np.linalg.det(turn) == pytest.approx(37.0, rel=1e-14)


def test_pixel_centres_are_the_pixels_themselves() -> None:
    assert PIXEL_CENTRES.raster_size(7, 5) == (7, 5)
    np.testing.assert_array_equal(PIXEL_CENTRES.raster_from_pixel(7), np.eye(2, 3))


@pytest.mark.parametrize(
    ("pixels", "budget", "samples"),
    [
        (1000, 37_000, 37),
        (1000, 37_999, 37),
        (10**6, 10**6, MIN_SAMPLES),  # never fewer, whatever it costs
        (10, 10**9, MAX_SAMPLES),
    ],
)
def test_the_budget_chooses_the_finest_grid_it_can_pay(
    pixels: int, budget: int, samples: int
) -> None:
    assert choose_sample_grid(pixels, budget) == rotated_sample_grid(samples)


@pytest.mark.parametrize(
    ("wanted", "needed", "samples"),
    [
        (16, 4.0, 16),
        (16, 64.0, 64),
        (256, 64.0, 256),
        (None, 64.0, 500),
        (None, 1500.0, 1500),
        (16, 4000.0, 2000),  # as many as four budgets pay
        (16, 4096.0, 500),  # nor more than one where four are far from enough
    ],
)
def test_a_wish_is_no_less_than_what_the_smallest_target_needs(
    wanted: int | None, needed: float, samples: int
) -> None:
    assert choose_sample_grid(100, 50_000, wanted, needed) == rotated_sample_grid(samples)


def test_a_crescent_needs_samples_by_its_width_and_what_is_lit() -> None:
    """Per pixel of its outline: fewer for wider ones, by 4^(2/3) for four times the width; hardly
    any where most of it is lit."""
    full, half, thin = (np.cos(np.radians(phase)) for phase in (0.0, 90.0, 150.0))
    of = [target_samples(thin, width) / (0.25 * np.pi * width**2) for width in (50.0, 200.0)]
    assert of[0] / of[1] == pytest.approx(4.0 ** (2.0 / 3.0))
    assert 200.0 < of[0] < 350.0
    assert target_samples(full, 36.0) == MIN_TARGET_SAMPLES
    assert target_samples(half, 36.0) < 2.0 * MIN_TARGET_SAMPLES
    # Not without end towards a new Moon.
    assert target_samples(-1.0, 36.0) < 4.0 * target_samples(thin, 36.0)


@pytest.mark.parametrize("samples_per_pixel", [*np.arange(5.0, 46.0, 0.5), 96.0, 480.0])
def test_no_cell_holds_more_samples_than_there_are_layers(samples_per_pixel: float) -> None:
    """So that each may see a surface of its own; whatever the place of the grid."""
    sample_grid = rotated_sample_grid(samples_per_pixel)
    edge = 6.0 * sample_grid.scale
    for phase in (0.0, 0.3, 0.7):
        columns = np.arange(-edge, edge) + phase
        samples = np.stack(np.meshgrid(columns, columns)).reshape(2, -1)
        cells = np.floor(
            sample_grid.cells_per_edge * np.linalg.solve(sample_grid.turn, samples)
        ).astype(int)
        _, counts = np.unique(cells, axis=1, return_counts=True)
        assert counts.max() <= LAYERS
