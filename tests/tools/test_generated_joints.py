"""Joints of the shipped models: their hinges, and the drives that follow the Sun."""

from __future__ import annotations

import numpy as np
import pytest

from tests.tools.shipped import NAMES, corners_of, document_of, placed, record_of
from tools.spacecraft_models.glb import R_FILE_FROM_BODY

TARGETS = ("calibration_board", "marker_board", "mirror", "wedge")
JOINTED = tuple(name for name in NAMES if name not in TARGETS)


@pytest.mark.parametrize("name", JOINTED)
def test_joints_name_parts_whose_node_stands_on_the_hinge(name: str) -> None:
    places = {part: place for part, (_, _, place) in placed(document_of(name)).items()}
    joints = record_of(name)["joint"]
    assert joints
    for joint in joints:
        assert np.linalg.norm(joint["axis_body"]) == pytest.approx(1.0)
        if joint["kind"] == "prismatic":
            assert joint["range_m"][0] <= 0.0 < joint["range_m"][1]
            continue
        on_hinge = R_FILE_FROM_BODY @ joint["origin_body_m"]
        # A micrometre for each node on the way.
        np.testing.assert_allclose(places[joint["part"]], on_hinge, atol=5e-6)
        assert joint["range_deg"][0] < 0.0 < joint["range_deg"][1]


def test_the_parts_of_the_servicer_hang_under_what_carries_them() -> None:
    nodes = document_of("servicer").nodes
    above = {nodes[c].name: node.name for node in nodes for c in node.children or []}
    chain = ["finger_1"]
    while chain[-1] in above:
        chain.append(above[chain[-1]])
    assert chain[1:] == [
        "arm_hand", "arm_wrist", "arm_lower", "arm_upper", "arm_turntable", "hull"
    ]  # fmt: skip
    assert (above["wing_left"], above["dish"]) == ("yoke_left", "dish_fork")


@pytest.mark.parametrize("name", ["atv_like", "iss_like", "servicer", "space_rider"])
def test_drives_turn_the_faces_of_their_cells_to_the_sun(name: str) -> None:
    document = document_of(name)
    for joint in record_of(name)["joint"]:
        if "sunward_body" not in joint:
            continue
        assert np.dot(joint["sunward_body"], joint["axis_body"]) == pytest.approx(0.0, abs=1e-6)
        node, R_file_from_node, _ = placed(document)[joint["part"]]
        heights, facing = {}, {}
        for primitive in document.meshes[node.mesh].primitives:
            corners = corners_of(document, primitive)
            corners = corners @ R_file_from_node.as_matrix().T @ R_FILE_FROM_BODY
            across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
            material = document.materials[primitive.material].name
            heights[material] = (corners @ joint["sunward_body"]).max()
            facing[material] = np.sum(across @ joint["sunward_body"])
        if "panel_grid" in heights:  # blocks stand proud of the sunward side of their plate
            assert heights["solar_cell"] - heights["panel_grid"] == pytest.approx(0.003, abs=1e-5)
        else:  # sheets: the cells are on one side only
            assert facing["solar_cell"] > 0.0 > facing["kapton"], joint["name"]
