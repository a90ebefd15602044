"""Bounds on the casters of a shadow map: never less than what stands within their reach."""

from __future__ import annotations

import re

import moderngl
import numpy as np
from scipy.ndimage import maximum_filter, minimum_filter

from simgl import assets
from simgl.arrays import Array32
from simgl.gpu.release import release_all
from simgl.passes.caster_planes import CasterPlanes
from simgl.passes.mesh_store import MeshStore
from simgl.passes.shadow import ShadowPass
from simgl.view.shadow_views import CELL, REACHES, ShadowMap
from tests.passes.shadow_scenes import sun_shadow
from tests.scenes import lambert, scene


def _drawn_maps(gl: moderngl.Context) -> tuple[ShadowMap, Array32, Array32, Array32]:
    """The Sun's map of a ball of 1 m below a box, its depths, bounds and planes of its cells."""
    box = {"box": {"size_m": [0.5, 0.3, 0.2], "material": lambert(0.5)}}
    scenario = scene(
        {
            "ball": {
                "model": {"sphere": {"radius_m": 1.0, "material": lambert(0.5)}},
                "position_icrf_m": [0.0, 0.0, 0.0],
            },
            "box": {"model": box, "position_icrf_m": [0.4, -0.2, 1.5]},
        },
        {"position_icrf_m": [0.0, 0.0, 500.0], "boresight": [0, 0, -1], "up": [0, 1, 0]},
    )
    view = sun_shadow(scenario, "ball")
    meshes = MeshStore(gl)
    shadows = ShadowPass(gl, meshes)
    ((depths, _, tops, *_),) = shadows.cast([view])
    shadows.complete([view])
    size = view.wide.size
    texture = gl.texture((size // CELL, size // CELL), 4, dtype="f4")
    target, planes = gl.framebuffer([texture]), CasterPlanes(gl)
    planes.draw(depths, 0, size, target)
    drawn = np.frombuffer(depths.read(), "<f4").reshape(depths.height, depths.width)[:size, :size]
    bounds = np.frombuffer(tops.read(), "<f4").reshape(tops.height, tops.width, 2)
    over = np.frombuffer(texture.read(), "<f4").reshape(texture.height, texture.width, 4)
    release_all(gl, target, texture, planes, shadows, meshes)
    return view.wide, drawn, bounds, over


def test_bounds_hold_the_nearest_and_farthest_depth_within_each_reach(
    gl: moderngl.Context,
) -> None:
    _, drawn, bounds, _ = _drawn_maps(gl)
    edge = len(drawn) // CELL
    cells = drawn.reshape(edge, CELL, edge, CELL)
    low, high = cells.min(axis=(1, 3)), cells.max(axis=(1, 3))
    assert low.min() < high.max()
    for level, reach in enumerate(REACHES):
        found = bounds[:edge, level * edge : (level + 1) * edge]
        width = 2 * reach + 1
        # All within the reach, and nothing beyond it; a step of 24-bit depth by the read-back.
        nearest = minimum_filter(low, width, mode="nearest")
        farthest = maximum_filter(high, width, mode="nearest")
        np.testing.assert_allclose(found[..., 0], nearest, rtol=0.0, atol=6e-8)
        np.testing.assert_allclose(found[..., 1], farthest, rtol=0.0, atol=6e-8)


def test_no_caster_of_the_cells_around_stands_over_a_cell_s_plane(gl: moderngl.Context) -> None:
    wide, drawn, _, planes = _drawn_maps(gl)
    size, edge = len(drawn), len(drawn) // CELL
    along, down, middle = np.moveaxis(planes[:edge, :edge, :3].astype(np.float64), -1, 0)
    least, under = np.full((edge, edge), np.inf), np.zeros((edge, edge))
    # All texels from a cell's width before the cell to a cell's width behind it.
    for row in range(-CELL, 2 * CELL):
        for column in range(-CELL, 2 * CELL):
            rows = CELL * np.arange(edge) + row
            columns = CELL * np.arange(edge) + column
            on_map = np.outer((rows >= 0) & (rows < size), (columns >= 0) & (columns < size))
            depth = drawn[np.ix_(rows.clip(0, size - 1), columns.clip(0, size - 1))]
            x, y = column + 0.5 - 0.5 * CELL, row + 0.5 - 0.5 * CELL
            gap = depth - (middle + along * x + down * y)
            least = np.where(on_map, np.minimum(least, gap), least)
            if min(row, column) >= 0 and max(row, column) < CELL:
                under = np.maximum(under, gap)
    # Rounding of 24-bit depth and of the plane's float32.
    assert least.min() > -3e-7
    # Over half of the ball's disc its slope changes by less than 2.8 / radius, so that a cell's
    # surface lies under its plane by no more than it bends within two cells; at edges by more.
    bend = 2.8 * (2.0 * CELL * wide.texel) ** 2 / wide.depth
    seen = drawn.reshape(edge, CELL, edge, CELL).max(axis=(1, 3)) < 1.0
    assert np.median(under[seen]) < bend


def test_the_shader_knows_the_reaches_of_the_bounds() -> None:
    text = (assets.shaders() / "surface" / "caster_bounds.glsl").read_text()
    (body,) = re.findall(r"int caster_level\(float reach\) \{(.*?)\n\}", text, flags=re.DOTALL)
    steps = re.findall(r"step\(vec\d\(([\d., ]+)\)", body)
    reaches = [float(reach) for step in steps for reach in step.split(",")]
    assert reaches == [CELL * reach for reach in REACHES]
    assert f"const int CASTER_LEVELS = {len(REACHES)};" in text
