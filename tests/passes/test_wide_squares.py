"""Squares of 4 x 4 cells in smooth light share four shading points: the image does not show it.

The reference has a shading point for each cell. Each term of the light may err by 2e-4 of its
value. The reference's points lie in the middle of a cell's samples, up to a fifth of a cell from
the cell's own middle, so that it errs by as much of what light changes by from cell to cell. In a
wide penumbra the Sun's directions scatter by 1 % of full sunlight in both.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import moderngl
import numpy as np
import pytest

from simgl.arrays import AnyArray, Array
from simgl.gpu.compute_screen import ComputeScreen
from simgl.passes.even_squares import (
    PARTLY_LIT,
    UNEVEN,
    EvenSquares,
    with_larger,
    without_penumbras,
)
from simgl.passes.gbuffer import GBufferPass
from simgl.passes.shading_points import (
    ENTRIES,
    ShadingPoints,
    at_pages,
    page_table,
)
from simgl.passes.sunlight import SunlightPass
from simgl.scenario.scenario import Scenario
from simgl.simulator import Product, Simulator
from simgl.view.raster_tiles import RasterTile
from tests.passes.test_penumbra import GREEN, disc_share
from tests.radiosity.boxes import c6_scene
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
WIDE, OF_WIDTH = 1 << 30, 1 << 28


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
def kinds(monkeypatch: pytest.MonkeyPatch) -> list[AnyArray]:
    """What squares were found to be, tile by tile."""
    found: list[AnyArray] = []
    ask = GBufferPass._even_squares

    def kept(*values: Any) -> EvenSquares:
        squares = ask(*values)
        found.append(squares.kinds)
        return squares

    monkeypatch.setattr(GBufferPass, "_even_squares", kept)
    return found


def light_of_others(gl: moderngl.Context, scenario: Scenario) -> Array:
    """(h, w) radiance in green of light from other surfaces alone: the search through the Sun's
    disc depends on how points are numbered."""
    with Simulator(scenario, gl) as simulator:
        state = scenario.at(scenario.epoch_tai_ns)
        layers = simulator.capture(state, "cam", {Product.LAYERS}).layers
    assert layers is not None
    return layers.layers["inter_reflected"][..., 1].astype(np.float64)


def with_and_without(
    gl: moderngl.Context,
    monkeypatch: pytest.MonkeyPatch,
    scenario: Scenario,
    light: Callable[[moderngl.Context, Scenario], Array] = image,
) -> tuple[Array, Array]:
    """The image, and the reference."""
    shared = light(gl, scenario)
    monkeypatch.setattr(SunlightPass, "even_light", lambda *_: None)
    return shared, light(gl, scenario)


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
    kinds: list[AnyArray],
    camera: dict[str, Any],
    ramp: float,
    samples: int,
) -> None:
    shared, every = with_and_without(
        gl, monkeypatch, wall(GLOSSY, camera, samples), partial(image, ramp=ramp)
    )
    assert (kinds[0] != UNEVEN).mean() > 0.5
    assert (shared != every).mean() > 0.4
    assert_alike(shared, every)
    # Half of the thousandth that pictures may differ by inside surfaces.
    assert np.sqrt(np.mean((shared - every) ** 2)) < 5e-4 * every.mean()


def test_edges_and_shadows_are_those_of_every_cell(
    gl: moderngl.Context, monkeypatch: pytest.MonkeyPatch, kinds: list[AnyArray]
) -> None:
    """A cell is a pixel here: where squares are not wide, the image is the same to the bit."""
    shared, every = with_and_without(gl, monkeypatch, wall(lambert(0.5)))
    in_wide = np.kron(kinds[0] != UNEVEN, np.ones((4, 4), dtype=bool))
    np.testing.assert_array_equal(shared[~in_wide], every[~in_wide])
    # None is wide in a penumbra of five pixels, or at the edge of the wall.
    lit = every > 0.0
    partly = (every < 0.999 * every.max()) & lit
    assert partly.sum() > 100
    assert not (partly & in_wide).any()
    assert not in_wide[:, 1:][lit[:, 1:] != lit[:, :-1]].any()


def test_without_a_gradient_light_is_the_same(
    gl: moderngl.Context, monkeypatch: pytest.MonkeyPatch, kinds: list[AnyArray]
) -> None:
    """A matt wall in sunlight alone: rounding is left."""
    shared, every = with_and_without(gl, monkeypatch, wall(lambert(0.5)))
    assert (kinds[0] != UNEVEN).mean() > 0.5
    np.testing.assert_allclose(shared, every, rtol=1e-6)


def test_a_narrow_highlight_has_a_point_for_each_cell(
    gl: moderngl.Context, kinds: list[AnyArray]
) -> None:
    """Of a width of 0.01, where a square spans 0.004 rad."""
    image(gl, wall({**GLOSSY, "roughness": 0.1}))
    assert not kinds[0].any()


def ball() -> Scenario:
    """It fills the image; its normals turn by 0.004 to 0.007 over a square, and light changes by a
    hundredth from pixel to pixel."""
    model = {"sphere": {"radius_m": 1.8, "material": GLOSSY | {"roughness": 0.7}}}
    craft = {"ball": {"model": model, "position_icrf_m": [0.0, 0.0, 0.4]}}
    return scene(craft, CAMERA, sun_direction=(0.0, 0.6, 0.8), render={"samples_per_pixel": 5})


def test_light_of_a_curved_surface_is_that_of_every_cell(
    gl: moderngl.Context, monkeypatch: pytest.MonkeyPatch, kinds: list[AnyArray]
) -> None:
    shared, every = with_and_without(gl, monkeypatch, ball())
    assert (kinds[0] != UNEVEN).mean() > 0.1
    assert_alike(shared, every)


@pytest.fixture
def triangles(monkeypatch: pytest.MonkeyPatch, kinds: list[AnyArray]) -> list[AnyArray]:
    """(rows, columns, 16) numbers of the triangles in the middles of the cells of squares, tile by
    tile."""
    found: list[AnyArray] = []
    group = GBufferPass.group

    def looked_at(
        geometry: GBufferPass,
        tile: RasterTile,
        seen_by: Sequence[moderngl.Texture],
        *more: Any,
        **named: Any,
    ) -> ShadingPoints:
        points = group(geometry, tile, seen_by, *more, **named)
        triangles = seen_by[0]
        seen = np.frombuffer(triangles.read(), dtype=np.uint32).reshape(triangles.height, -1)
        row, column = np.mgrid[: tile.cells.size[1], : tile.cells.size[0]]
        middles = np.stack([column + 0.5, row + 0.5, np.ones(row.shape)], axis=-1)
        x, y = np.moveaxis((middles @ tile.cells.raster_from_cell.T).astype(int), -1, 0)
        rows, columns = kinds[-1].shape
        of_square = seen[y, x][: 4 * rows, : 4 * columns].astype(np.int64)
        of_square = of_square.reshape(rows, 4, columns, 4).swapaxes(1, 2)
        found.append(of_square.reshape(rows, columns, 16) - 1)
        return points

    monkeypatch.setattr(GBufferPass, "group", looked_at)
    return found


def test_a_wide_square_lies_in_one_plane(
    gl: moderngl.Context, kinds: list[AnyArray], triangles: list[AnyArray]
) -> None:
    """Of a ball, whose facets are pairs of triangles: unit normals differ by 1e-3 at most from that
    in the middle."""
    scenario = ball()
    image(gl, scenario)
    mesh = scenario.models["ball"].mesh
    a, b, c = np.moveaxis(mesh.positions[mesh.triangles].astype(np.float64), 1, 0)
    across = np.cross(b - a, c - a)
    normals = across / np.linalg.norm(across, axis=1, keepdims=True)
    wide = triangles[0][kinds[0] != UNEVEN]
    assert len(wide) > 50
    assert (np.ptp(wide, axis=-1) > 0).sum() > 20
    off = normals[wide] - normals[wide[:, :1]]
    np.testing.assert_array_less(np.linalg.norm(off, axis=-1), 2.5e-3)


def test_light_of_other_surfaces_over_several_triangles_is_that_of_every_cell(
    gl: moderngl.Context,
    monkeypatch: pytest.MonkeyPatch,
    kinds: list[AnyArray],
    triangles: list[AnyArray],
) -> None:
    """It is linear over each triangle, and bends from one to the next. Where the mean of opposite
    corners is two thousandths off the middle, one bend makes it err by 1.25 times as much, and two
    by twice that. A peak of light at a vertex may lie between the five places that are looked at:
    few do, and it errs by the peak's height, two hundredths. Half of the floor gets none."""
    shared, every = with_and_without(gl, monkeypatch, c6_scene(0.8, on=True), light_of_others)
    of_several = np.ptp(triangles[0], axis=-1) > 0
    assert (of_several & (kinds[0] != UNEVEN)).sum() > 50
    # And some bends are larger.
    assert (of_several & (kinds[0] == UNEVEN)).sum() > 50
    around = [np.roll(every, shift, axis) for axis in (0, 1) for shift in (-1, 1)]
    change = np.max(np.abs(np.array(around) - every), axis=0)
    off = np.abs(shared - every) - 0.2 * change
    assert (off > 5e-3 * every + 1e-9).mean() < 3e-4
    np.testing.assert_array_less(off, 2e-2 * every + 1e-9)
    # Half of the thousandth that pictures may differ by inside surfaces.
    assert np.sqrt(np.mean((shared - every) ** 2)) < 5e-4 * every.mean()


def test_compute_shaders_share_the_same_points(
    gl: moderngl.Context, monkeypatch: pytest.MonkeyPatch, kinds: list[AnyArray]
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
    np.testing.assert_array_equal(kinds[1], kinds[0])
    np.testing.assert_allclose(by_compute, by_fragments, rtol=2e-5, atol=1e-6 * by_fragments.max())


DISC = np.radians(2.5)
PX = 3e-3  # of the wall below [m]
TO_SUN = np.array([0.3, 0.3, 0.9]) / np.linalg.norm([0.3, 0.3, 0.9])
TURN, BLIND = 0.2, 1.5
# Radiance of the wall in all of the Sun, in green.
FULL = 0.5 / np.pi * GREEN * TO_SUN[2]


def penumbra(cube: float = 0.0) -> tuple[Scenario, Array]:
    """A wall in the penumbra of a blind beside the image, of a radius of 23 pixels; with a cube of
    an edge [m] nearer to the wall beside it, too. The lit share of the wall without the cube."""
    material = lambert(0.5)
    edge, middle = TO_SUN[:2] / TO_SUN[2] * BLIND
    craft = {
        "wall": {
            "model": {"plate": {"width_m": 6.0, "height_m": 6.0, "material": material}},
            "position_icrf_m": [0.0, 0.0, 0.0],
        },
        "blind": {
            "model": {"plate": {"width_m": 0.5, "height_m": 0.8, "material": material}},
            "position_icrf_m": [edge + 0.25, middle, BLIND],
        },
    }
    if cube:
        box = {"size_m": [cube, cube, cube], "material": material}
        craft["cube"] = {"model": {"box": box}, "position_icrf_m": [-0.03, 0.19, 0.3]}
    up = [np.sin(TURN), np.cos(TURN), 0.0]
    camera = CAMERA | {"position_icrf_m": [0.0, 0.0, 3.0], "boresight": [0.0, 0.0, -1.0], "up": up}
    row, column = np.mgrid[:96, :128] + 0.5
    x = PX * ((column - 64) * np.cos(TURN) - (row - 48) * np.sin(TURN))
    # From the plane through the place and the edge to the Sun's middle.
    tilt = np.arctan2(edge - x, BLIND)
    beside = np.arcsin(TO_SUN[0] * np.cos(tilt) - TO_SUN[2] * np.sin(tilt))
    found = scene(
        craft,
        camera,
        sun_direction=tuple(TO_SUN),
        render={"samples_per_pixel": 5},
        sun={"angular_diameter_deg": 5.0},
    )
    return found, disc_share(-beside / DISC).astype(np.float64)


def test_light_in_a_wide_penumbra_is_that_of_the_suns_disc(
    gl: moderngl.Context, kinds: list[AnyArray]
) -> None:
    """Linear over squares it errs by 0.3 % at most; the directions scatter by 1 %, as without."""
    scenario, truth = penumbra()
    lit = image(gl, scenario)
    assert lit.min() >= 0.0
    error = lit / FULL - truth
    partly = (truth > 0.01) & (truth < 0.99)
    in_squares = np.kron(kinds[0] == PARTLY_LIT, np.ones((4, 4), dtype=bool))
    assert in_squares[partly].mean() > 0.8
    assert np.sqrt(np.mean(error[in_squares] ** 2)) < 0.01
    # Of the edge's place, 0.1 pixel.
    assert abs(error[in_squares].mean()) < 0.1 * 2.0 / np.pi * PX / (BLIND * DISC)
    np.testing.assert_array_less(np.abs(error), 0.04)


@pytest.mark.parametrize(("cube", "depth"), [(0.016, 0.4), (0.006, 0.05)])
def test_a_narrow_shadow_in_a_wide_penumbra_is_that_of_every_cell(
    gl: moderngl.Context,
    monkeypatch: pytest.MonkeyPatch,
    kinds: list[AnyArray],
    cube: float,
    depth: float,
) -> None:
    """Over the cube the Sun's disc has a radius of 4 pixels. Both scatter by up to 3 %."""
    scenario, without_cube = penumbra(cube)
    shared, every = with_and_without(gl, monkeypatch, scenario)
    # The middle of the cube's shadow.
    row, column = 27, 15
    around = slice(row - 1, row + 2), slice(column - 1, column + 2)
    assert (without_cube - every / FULL)[around].mean() > depth
    assert kinds[0][row // 4, column // 4] == UNEVEN
    assert (kinds[0] == PARTLY_LIT).sum() > 50
    np.testing.assert_array_less(np.abs(shared - every), 0.06 * FULL)


def test_shares_of_pages_lie_where_their_points_are() -> None:
    """As shaders/gbuffer/page_places.glsl places them."""
    values = np.arange(1500 * 4, dtype=np.float32).reshape(1500, 4, 1) + 1.0
    texels = at_pages(values)
    assert texels.shape == (8, ENTRIES, 1)
    for page in (0, 1, 2, 3, 1023, 1024, 1499):
        square = page // 4
        row = 4 * (square // (ENTRIES // 4)) + page // 2 % 2 * 2
        column = 4 * (square % (ENTRIES // 4)) + page % 2 * 2
        of_page = texels[row : row + 2, column : column + 2].ravel()
        np.testing.assert_array_equal(of_page, values[page].ravel())
    assert np.count_nonzero(texels) == values.size


def test_a_wide_page_stands_for_all_blocks_of_its_square() -> None:
    """In a table of blocks with pages of their own, and an odd row and column of them."""
    random = np.random.default_rng(2)
    counts = random.integers(0, 5, (41, 67)).astype(np.uint8)
    kinds = np.where(random.random((20, 33)) < 0.4, random.integers(1, 4, (20, 33)), UNEVEN)
    smooth = random.random((10, 16)) < 0.4
    # Some of 2 x 2 squares of one kind; those partly lit stay apart.
    kinds[:20, :32] = np.where(
        np.kron(random.random((10, 16)) < 0.5, np.ones((2, 2), dtype=bool)),
        np.kron(random.integers(1, 4, (10, 16)), np.ones((2, 2), dtype=np.int64)),
        kinds[:20, :32],
    )
    even = with_larger(without_penumbras(kinds.astype(np.uint8)), smooth)
    assert even.larger.sum() > 10
    assert not (even.larger & (kinds[:20:2, :32:2] == PARTLY_LIT)).any()
    entries, first, rows = page_table(counts, even)
    pages = entries.ravel()
    assert rows == (1, 1, 1)
    wide = kinds != UNEVEN
    in_larger = np.zeros(kinds.shape, dtype=bool)
    in_larger[:, :32] = np.kron(even.larger, np.ones((2, 2), dtype=bool))
    of_wide = np.kron(wide, np.ones((2, 2), dtype=bool))
    own = counts.astype(int)
    own[:40, :66][of_wide] = 0
    of_squares = (wide & ~in_larger).sum() + even.larger.sum()
    assert np.count_nonzero(pages) == own.sum() + of_squares
    assert entries.shape[1] == ENTRIES
    place = first & (OF_WIDTH - 1)
    np.testing.assert_array_equal(first[:40, :66] & WIDE != 0, of_wide)
    squares = [(2, 4 * r, 4 * c) for r, c in np.argwhere(even.larger)]
    squares += [(1, 2 * r, 2 * c) for r, c in np.argwhere(wide & ~in_larger)]
    for width, row, column in squares:
        page = place[row, column]
        # Lit, dark and partly lit ones in a row each.
        assert page // ENTRIES == kinds[row // 2, column // 2] - 1
        blocks = first[row : row + 2 * width, column : column + 2 * width]
        assert np.all(blocks == (page | WIDE | width * OF_WIDTH))
        assert pages[page] == (3 << 30 | width << 26 | row << 13 | column)
    row, column = np.nonzero(own)
    np.testing.assert_array_equal(
        pages[place[row, column] + own[row, column] - 1],
        1 << 31 | (own[row, column] - 1) << 26 | row << 13 | column,
    )
