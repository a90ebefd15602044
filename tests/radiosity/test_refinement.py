"""Finer triangles go where light at vertices varies."""

from __future__ import annotations

import numpy as np

from simgl.radiosity.bake import BakeSettings, refined
from simgl.scene.mesh import Mesh, box, plate, sphere
from tests.radiosity.shapes import joined, moved


def between_boxes(mesh: Mesh) -> int:
    """Triangles whose middle is within 2 m of a pair of boxes."""
    return int((np.abs(mesh.positions[mesh.triangles][:, :, 0].mean(axis=1) - 0.75) < 2.0).sum())


def test_a_narrow_gap_takes_no_triangles_from_other_surfaces() -> None:
    """A sheet of 2 m that lies 0.3 mm above another sees nothing but that, and nobody sees what is
    between them; two boxes 0.5 m apart light each other. The boxes keep their triangles when two
    pairs of such sheets come beside them. Counted as near to each other, the sheets took all."""
    boxes = joined(box((1.0, 1.0, 1.0)), moved(box((1.0, 1.0, 1.0)), (1.5, 0.0, 0.0)))
    # The body is as wide in both cases.
    ends = [moved(plate(0.01, 0.01), (9.0, y, 0.0)) for y in (-2.5, 2.5)]
    sheet = box((2.0, 2.0, 0.01))
    pair = joined(sheet, moved(sheet, (0.0, 0.0, 0.01 + 3e-4)))
    pairs = [moved(pair, (7.0, y, 0.0)) for y in (-1.25, 1.25)]
    alone = refined(joined(boxes, *ends), 1, BakeSettings())
    beside = refined(joined(boxes, *ends, *pairs), 1, BakeSettings())
    assert between_boxes(alone) > 500
    assert between_boxes(beside) > 0.9 * between_boxes(alone)


def test_edges_much_shorter_than_the_distance_to_what_is_seen_stay() -> None:
    """Inside a ball of 1 m light is even, also if more triangles are asked for."""
    ball = sphere(1.0, 96)
    fine = refined(ball, 2, BakeSettings(added_triangles=20_000))
    assert len(fine.triangles) == len(ball.triangles)
