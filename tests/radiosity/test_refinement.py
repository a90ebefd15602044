"""Finer triangles go where light at vertices varies, about as many as were asked for."""

from __future__ import annotations

import numpy as np

from simgl.arrays import Mask
from simgl.radiosity.refinement import refined
from simgl.scene.mesh import Mesh, box, plate, sphere
from tests.radiosity.shapes import joined, moved

_ADDED, _EDGE_SHARE = 4000, 1.0 / 60.0


def near(mesh: Mesh, x: float) -> Mask:
    """(m,) triangles whose middle is within 2 m of a coordinate x."""
    return np.abs(mesh.positions[mesh.triangles][:, :, 0].mean(axis=1) - x) < 2.0


def facing_plates(gap: float) -> Mesh:
    """Two plates of 1 m, 1 cm thick, so far apart [m]."""
    one = box((1.0, 1.0, 0.01))
    return joined(one, moved(one, (0.0, 0.0, 0.01 + gap)))


def test_a_narrow_gap_takes_no_triangles_from_other_surfaces() -> None:
    """A sheet 0.3 mm above another is in sight of nothing, two boxes 0.5 m apart light each other:
    with four such sheets beside them they keep their triangles."""
    boxes = joined(box((1.0, 1.0, 1.0)), moved(box((1.0, 1.0, 1.0)), (1.5, 0.0, 0.0)))
    flag = moved(plate(0.01, 0.01), (9.0, 0.0, 0.0))  # the body is as wide in both cases
    alone = refined(joined(boxes, flag), 1, _ADDED, _EDGE_SHARE)
    stacks = [moved(facing_plates(3e-4), (7.0, y, 0.0)) for y in (-1.0, 1.0)]
    beside = refined(joined(boxes, flag, *stacks), 1, _ADDED, _EDGE_SHARE)
    assert near(beside, 0.75).sum() > 0.9 * near(alone, 0.75).sum()


def test_slivers_count_by_how_often_their_edges_are_halved() -> None:
    """Sixteen square bars of 4 m and 2 cm, whose area alone tells of a fraction of the pieces.

    All bars are alike: one more halving makes three of each piece.
    """
    bars = [
        moved(box((4.0, 0.02, 0.02)), (0.0, 0.3 * i, 0.3 * k)) for i in range(4) for k in range(4)
    ]
    mesh = joined(*bars)
    added = len(refined(mesh, 1, _ADDED, _EDGE_SHARE).triangles) - len(mesh.triangles)
    assert _ADDED / 3.0 < added < 1.5 * _ADDED


def test_edges_go_with_two_thirds_of_the_distance_in_power() -> None:
    """Plates 3 and 50 cm apart: by the mean of 1 / distance over all directions (0.667 / d between
    plates without end, less where they end) 25 times as near. Triangles go with 1 / edge^2, so
    with 25^(4/3) = 73, to a factor of two as edges are halved. With edges that go with the distance
    itself they would be 650 times as many."""
    mesh = joined(facing_plates(0.03), moved(facing_plates(0.5), (6.0, 0.0, 0.0)))
    fine = refined(mesh, 1, 20_000, 1.0 / 2000.0)
    ratio = near(fine, 0.0).sum() / near(fine, 6.0).sum()
    assert 36.0 < ratio < 146.0


def test_edges_much_shorter_than_the_distance_to_what_is_seen_stay() -> None:
    """Inside a ball of 1 m light is even, also if more triangles are asked for."""
    ball = sphere(1.0, 96)
    fine = refined(ball, 2, 5 * _ADDED, _EDGE_SHARE)
    assert len(fine.triangles) == len(ball.triangles)
