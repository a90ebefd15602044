"""A mesh is solid where no camera outside can see the back of a triangle."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from simgl.scene.mesh import Mesh, box, plate
from simgl.scene.solid import is_solid
from tests.radiosity.shapes import OPEN_BOX, joined, moved, quads

BOX = box((0.3, 2.0, 1.1))


def turned_inwards(mesh: Mesh) -> Mesh:
    return replace(mesh, triangles=mesh.triangles[:, ::-1].copy())


@pytest.mark.parametrize("mesh", [BOX, plate(2.0, 0.5)])
def test_one_closed_shape_is_solid_and_two_are_not(mesh: Mesh) -> None:
    assert is_solid(mesh)
    assert not is_solid(joined(mesh, moved(mesh, (0.1, 0.0, 0.0))))


def test_an_open_box_a_missing_triangle_and_shapes_turned_inwards_are_not() -> None:
    assert not is_solid(quads(OPEN_BOX))
    assert not is_solid(replace(BOX, triangles=BOX.triangles[1:]))
    assert not is_solid(turned_inwards(BOX))


def test_a_surface_of_two_parts_is_not_since_joints_may_open_it() -> None:
    lid = BOX.normals[:, 0] > 0.5
    assert not is_solid(replace(BOX, part=lid.astype(np.uint32)))
