"""Boards and wedges to calibrate with: reflectances, places and angles."""

from __future__ import annotations

import tomllib

import numpy as np

from simgl import assets
from tests.tools.shipped import all_corners, document_of, ray_hits, record_of
from tools.spacecraft_models.materials import GREY_STEPS

FINISHES = assets.data() / "finishes.toml"


def test_grey_steps_wear_finishes_of_the_reflectance_in_their_names() -> None:
    finishes = tomllib.loads(FINISHES.read_text())
    document = document_of("calibration_board")
    for percent in GREY_STEPS:
        node = next(node for node in document.nodes if node.name == f"step_{percent:02d}")
        (primitive,) = document.meshes[node.mesh].primitives
        material = document.materials[primitive.material]
        finish = finishes[material.extras["simgl_finish"]]
        assert finish["reflectance"] == percent / 100.0
        assert set(finish) == {"source", "reflectance"}  # no gloss


def test_marker_circles_stand_on_a_grid_and_the_rings_tell_its_corner() -> None:
    keypoints = record_of("marker_board")["keypoints"]
    grid = np.array([[keypoints[f"circle_{r}_{c}"] for c in range(7)] for r in range(5)])
    np.testing.assert_allclose(grid[:, 1:, 1] - grid[:, :-1, 1], -0.12, atol=1e-6)
    np.testing.assert_allclose(grid[1:, :, 2] - grid[:-1, :, 2], 0.12, atol=1e-6)
    ahead = np.array([1.0, 0.0, 0.0])
    circles = all_corners("marker_board", "circles")
    for (row, column), point in np.ndenumerate(grid[..., 0]):
        y, z = grid[row, column, 1:]
        place = np.array([point + 0.5, y + 0.0007, z + 0.0003])
        hit = len(ray_hits(place, -ahead, circles)) > 0
        assert hit == ((row, column) not in {(0, 0), (0, 2), (4, 0)}), (row, column)


def test_wedge_faces_lean_30_and_60_degrees() -> None:
    corners = all_corners("wedge")
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    tilt = np.degrees(np.arctan2(normals[:, 0], -normals[:, 2]))[np.abs(normals[:, 1]) < 1e-6]
    # The long face leans forward, the short one backward, the base looks down; float32 corners.
    found = np.unique(np.round(np.abs(tilt), 3) * np.sign(tilt))
    np.testing.assert_allclose(sorted(np.unique(np.round(found % 360.0, 3))), [30.0, 180.0, 300.0])
