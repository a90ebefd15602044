"""Light on vertices: from the body's own surfaces, and the Earth's share."""

from __future__ import annotations

import numpy as np

from simgl.arrays import Array32
from simgl.radiosity.bake import bake
from simgl.radiosity.hemisphere import SKY_CELLS
from simgl.radiosity.light_transport import LightTransport
from simgl.radiosity.solver import (
    earth_share,
    radiosity,
    reflectors,
    vertex_irradiance,
)
from simgl.scene.mesh import box, plate
from tests.radiosity.boxes import QUICK, box_faces, open_box, sunlight, white
from tests.radiosity.shapes import joined, moved


def sunlit_exitance(transport: LightTransport) -> Array32:
    """(p, 4) of white patches after all bounces [W m-2]."""
    surface = reflectors(transport, white(0.8))
    return radiosity(transport, surface, surface.albedo * sunlight(transport))


def vertex_light(transport: LightTransport, exitance: Array32) -> Array32:
    """(v, sides, 4) irradiance of the vertices from the body's own surfaces."""
    matrix = transport.of_vertices
    return vertex_irradiance(matrix, exitance).reshape(*matrix.shape, 4)


def test_vertices_get_the_light_that_the_patches_around_them_get() -> None:
    """Two ways from exitance to irradiance: the vertices' own rays, and the form factors."""
    transport = open_box()
    exitance = sunlit_exitance(transport)
    light = vertex_light(transport, exitance)
    patch = transport.form_factors @ exitance
    floor = box_faces(transport)["floor"]
    area = transport.areas[floor]
    mean = float((area * patch[floor, 0]).sum() / area.sum())
    corners = transport.mesh.positions[transport.mesh.triangles]
    flat = np.all(corners[:, :, 2] == 0.0, axis=1)
    a, b, c = np.moveaxis(corners[flat].astype(np.float64), 1, 0)
    areas = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    values = light[transport.mesh.triangles[flat], 0, 0].mean(axis=1)
    # 256 rays a vertex and light that is linear between vertices 4 cm apart: some percent at the
    # walls' feet, 1 % in the mean.
    np.testing.assert_allclose((areas * values).sum() / areas.sum(), mean, rtol=0.02)


def test_the_back_of_a_sheet_gets_nothing_of_the_light_before_it() -> None:
    transport = open_box()
    exitance = sunlit_exitance(transport)
    light = vertex_light(transport, exitance)
    assert light[:, 0].max() > 100.0
    # The outside of a convex box sees nothing of it.
    assert light[:, 1].max() == 0.0


def test_a_plate_behind_a_big_plate_gets_no_light_of_the_earth() -> None:
    shield = moved(plate(4.0, 4.0), (0.0, 0.0, 0.0))
    small = moved(plate(0.2, 0.2), (0.0, 0.0, 0.05))
    transport = bake(joined(shield, small), open_sheets=False)
    assert transport is not None
    mesh = transport.mesh
    # An Earth that fills the half space below.
    below = np.zeros((SKY_CELLS, 4), dtype=np.float32)
    below[5 * 16 : 6 * 16] = 100.0
    share = earth_share(transport.of_vertices, below)[:, 0]
    lower = mesh.normals[:, 2] < -0.9
    near = np.abs(mesh.positions[:, :2]).max(axis=1) < 0.11
    hidden = lower & near & (mesh.positions[:, 2] > 0.01)
    assert np.count_nonzero(hidden) >= 4
    assert share[hidden].max() == 0.0
    # The shield itself is free below.
    free = lower & ~near
    assert share[free].min() == 1.0


def test_a_board_whose_corners_are_inside_blocks_is_lit_between_them() -> None:
    """Solar cells on a panel: all that is seen of the panel are the gaps."""
    board = moved(plate(1.0, 1.0), (0.0, 0.0, 0.0))
    blocks = [
        moved(box((0.3, 0.3, 0.02)), (x, y, 0.0)) for x in (-0.45, 0.45) for y in (-0.45, 0.45)
    ]
    transport = bake(joined(board, *blocks), open_sheets=False, settings=QUICK)
    assert transport is not None
    above = np.zeros((SKY_CELLS, 4), dtype=np.float32)
    above[4 * 16 : 5 * 16] = 100.0
    share = earth_share(transport.of_vertices, above)[:, 0]
    mesh = transport.mesh
    corner = (mesh.normals[:, 2] > 0.9) & (mesh.positions[:, 2] == 0.0)
    assert np.count_nonzero(corner) >= 4
    # The foot of one wall sees half of the sky; a place in a gap is at most that near to a block.
    assert share[corner].min() > 0.45
