"""Squares of 4 x 4 cells in smooth light share four shading points: the image does not show it.

The reference has a shading point for each cell. Each term of the light may err by 2e-4 of its
value. The reference's points lie in the middle of a cell's samples, up to a fifth of a cell from
the cell's own middle, so that it errs by as much of what light changes by from cell to cell.
"""

from __future__ import annotations

from typing import Any

import moderngl
import numpy as np
import pytest

from simgl.arrays import AnyArray, Array, Mask
from simgl.gpu.compute_screen import ComputeScreen
from simgl.passes.gbuffer import GBufferPass
from simgl.passes.shading_points import ENTRIES, ShadingPoints, page_table
from simgl.passes.sunlight import SunlightPass
from simgl.scenario.scenario import Scenario
from simgl.simulator import Simulator
from simgl.view.raster_tiles import RasterTile
from tests.scenes import lambert, scene

GLOSSY = {"reflectance": 0.6, "metallic": 1.0, "roughness": 0.5}
CAMERA: dict[str, Any] = {
    "preset": "ideal",
    "width_px": 128,
    "height_px": 96,
    "pixel_pitch_um": 5.0,
    "focal_length_mm": 5.0,
    "position_icrf_m": [0.8, 0.3, 3.0],
    "boresight": [-0.26, -0.1, -1.0],
    "up": [0.2, 1.0, 0.0],
}
DISTORTED = {"optics": {"distortion": {"k1": -0.05}}}
WIDE = 1 << 30


def wall(
    material: dict[str, Any], camera: dict[str, Any] | None = None, samples: int = 5
) -> Scenario:
    """A wall that ends within the image, and on it the shadow of a sheet beside the image."""
    plate = {"plate": {"width_m": 6.0, "height_m": 6.0, "material": material}}
    shade = {"plate": {"width_m": 0.1, "height_m": 0.1, "material": material}}
    craft = {
        "wall": {"model": plate, "position_icrf_m": [-2.85, 0.0, 0.0]},
        "shade": {"model": shade, "position_icrf_m": [-0.57, -0.3, 1.5]},
    }
    sun = np.array([-0.3, -0.2, 0.9]) / np.linalg.norm([-0.3, -0.2, 0.9])
    return scene(
        craft,
        CAMERA | (camera or {}),
        sun_direction=tuple(sun),
        render={"samples_per_pixel": samples},
    )


def image(gl: moderngl.Context, scenario: Scenario, ramp: float = 0.0) -> Array:
    """(h, w) radiance in green."""
    with Simulator(scenario, gl) as simulator:
        still = simulator._still(scenario.at(scenario.epoch_tai_ns), "cam")
        return still._with_ramps((ramp,) * 4).read()[..., 1].astype(np.float64)


@pytest.fixture
def wide(monkeypatch: pytest.MonkeyPatch) -> list[Mask]:
    """Which squares were found to be wide, tile by tile."""
    found: list[Mask] = []
    ask = GBufferPass._wide

    def kept(*values: Any) -> Mask | None:
        squares = ask(*values)
        if squares is not None:
            found.append(squares)
        return squares

    monkeypatch.setattr(GBufferPass, "_wide", kept)
    return found


def with_and_without(
    gl: moderngl.Context, monkeypatch: pytest.MonkeyPatch, scenario: Scenario, ramp: float = 0.0
) -> tuple[Array, Array]:
    """The image, and the reference."""
    shared = image(gl, scenario, ramp)
    monkeypatch.setattr(SunlightPass, "even_light", lambda *_: None)
    return shared, image(gl, scenario, ramp)


def assert_alike(shared: Array, every: Array) -> None:
    """Within what the terms may err by, and the places of the reference's points."""
    around = [np.roll(every, shift, axis) for axis in (0, 1) for shift in (-1, 1)]
    change = np.max(np.abs(np.array(around) - every), axis=0)
    np.testing.assert_array_less(np.abs(shared - every), 2e-4 * every + 0.2 * change + 1e-9)


@pytest.mark.parametrize(
    ("camera", "ramp", "samples"),
    [({}, 0.0, 5), ({}, 0.75, 5), ({}, 0.75, 80), (DISTORTED, 0.0, 5)],
    ids=["sharp", "soft", "cells", "distorted"],
)
def test_light_is_that_of_every_cell(
    gl: moderngl.Context,
    monkeypatch: pytest.MonkeyPatch,
    wide: list[Mask],
    camera: dict[str, Any],
    ramp: float,
    samples: int,
) -> None:
    shared, every = with_and_without(gl, monkeypatch, wall(GLOSSY, camera, samples), ramp)
    assert wide[0].mean() > 0.5
    assert (shared != every).mean() > 0.4
    assert_alike(shared, every)
    assert np.sqrt(np.mean((shared - every) ** 2)) < 2e-4 * every.mean()


def test_edges_and_shadows_are_those_of_every_cell(
    gl: moderngl.Context, monkeypatch: pytest.MonkeyPatch, wide: list[Mask]
) -> None:
    """A cell is a pixel here: where squares are not wide, the image is the same to the bit."""
    shared, every = with_and_without(gl, monkeypatch, wall(lambert(0.5)))
    in_wide = np.kron(wide[0], np.ones((4, 4), dtype=bool))
    np.testing.assert_array_equal(shared[~in_wide], every[~in_wide])
    # None is wide in the penumbra, or at the edge of the wall.
    lit = every > 0.0
    partly = (every < 0.999 * every.max()) & lit
    assert partly.sum() > 100
    assert not (partly & in_wide).any()
    assert not in_wide[:, 1:][lit[:, 1:] != lit[:, :-1]].any()


def test_without_a_gradient_light_is_the_same(
    gl: moderngl.Context, monkeypatch: pytest.MonkeyPatch, wide: list[Mask]
) -> None:
    """A matt wall in sunlight alone: rounding is left."""
    shared, every = with_and_without(gl, monkeypatch, wall(lambert(0.5)))
    assert wide[0].mean() > 0.5
    np.testing.assert_allclose(shared, every, rtol=1e-6)


def test_a_narrow_highlight_has_a_point_for_each_cell(
    gl: moderngl.Context, wide: list[Mask]
) -> None:
    """Of a width of 0.01, where a square spans 0.004 rad."""
    image(gl, wall({**GLOSSY, "roughness": 0.1}))
    assert not wide[0].any()


def ball() -> Scenario:
    """It fills the image; its normals turn by 0.004 to 0.007 over a square, and light changes by a
    hundredth from pixel to pixel."""
    model = {"sphere": {"radius_m": 1.8, "material": GLOSSY | {"roughness": 0.7}}}
    craft = {"ball": {"model": model, "position_icrf_m": [0.0, 0.0, 0.4]}}
    return scene(craft, CAMERA, sun_direction=(0.0, 0.6, 0.8), render={"samples_per_pixel": 5})


def test_light_of_a_curved_surface_is_that_of_every_cell(
    gl: moderngl.Context, monkeypatch: pytest.MonkeyPatch, wide: list[Mask]
) -> None:
    shared, every = with_and_without(gl, monkeypatch, ball())
    assert wide[0].mean() > 0.1
    assert_alike(shared, every)


def test_a_wide_square_shows_one_triangle(
    gl: moderngl.Context, monkeypatch: pytest.MonkeyPatch, wide: list[Mask]
) -> None:
    """Light of other surfaces is linear over each triangle, and bends from one to the next."""
    seen: list[AnyArray] = []
    group = GBufferPass.group

    def looked_at(
        geometry: GBufferPass, tile: RasterTile, texture: moderngl.Texture, *more: Any, **named: Any
    ) -> ShadingPoints:
        points = group(geometry, tile, texture, *more, **named)
        triangles = np.frombuffer(texture.read(), dtype=np.uint32).reshape(texture.height, -1, 2)
        row, column = np.mgrid[: tile.cells.size[1], : tile.cells.size[0]]
        middles = np.stack([column + 0.5, row + 0.5, np.ones(row.shape)], axis=-1)
        x, y = np.moveaxis((middles @ tile.cells.raster_from_cell.T).astype(int), -1, 0)
        seen.append(triangles[y, x, 0])
        return points

    monkeypatch.setattr(GBufferPass, "group", looked_at)
    image(gl, ball())
    rows, columns = (4 * n for n in wide[0].shape)
    of_square = seen[0][:rows, :columns].reshape(rows // 4, 4, columns // 4, 4).swapaxes(1, 2)
    of_square = of_square.reshape(*wide[0].shape, 16)
    assert wide[0].sum() > 50
    assert not np.ptp(of_square[wide[0]].astype(np.int64), axis=-1).any()


def test_compute_shaders_share_the_same_points(
    gl: moderngl.Context, monkeypatch: pytest.MonkeyPatch, wide: list[Mask]
) -> None:
    by_fragments = image(gl, wall(GLOSSY))
    monkeypatch.setattr("simgl.gpu.fullscreen.prefers_compute", bool)
    drawn: list[ComputeScreen] = []
    draw = ComputeScreen.draw

    def noted(screen: ComputeScreen, *values: Any, **named: Any) -> None:
        drawn.append(screen)
        draw(screen, *values, **named)

    monkeypatch.setattr(ComputeScreen, "draw", noted)
    by_compute = image(gl, wall(GLOSSY))
    assert drawn
    np.testing.assert_array_equal(wide[1], wide[0])
    np.testing.assert_allclose(by_compute, by_fragments, rtol=2e-5, atol=1e-6 * by_fragments.max())


def test_a_wide_page_stands_for_four_blocks() -> None:
    """In a table of blocks with pages of their own, and an odd row and column of them."""
    random = np.random.default_rng(2)
    counts = random.integers(0, 5, (41, 67)).astype(np.uint8)
    wide = random.random((20, 33)) < 0.4
    entries, first = page_table(counts, wide)
    pages = entries.ravel()
    of_wide = np.kron(wide, np.ones((2, 2), dtype=bool))
    own = counts.astype(int)
    own[:40, :66][of_wide] = 0
    assert np.count_nonzero(pages) == own.sum() + wide.sum()
    assert entries.shape[1] == ENTRIES
    place = first & (WIDE - 1)
    np.testing.assert_array_equal(first[:40, :66] & WIDE != 0, of_wide)
    for row, column in np.argwhere(wide):
        page = place[2 * row, 2 * column]
        assert np.all(place[2 * row : 2 * row + 2, 2 * column : 2 * column + 2] == page)
        assert pages[page] == (3 << 30 | 2 * row << 13 | 2 * column)
    row, column = np.nonzero(own)
    np.testing.assert_array_equal(
        pages[place[row, column] + own[row, column] - 1],
        1 << 31 | (own[row, column] - 1) << 26 | row << 13 | column,
    )
