"""The shipped models as the library gives them."""

from __future__ import annotations

import numpy as np
import pytest

from simgl.model_files.model_library import load_model, shipped_models


@pytest.mark.parametrize("name", shipped_models())
def test_every_shipped_model_has_its_parts_and_keypoints_in_body_axes(name: str) -> None:
    model = load_model(name)
    assert model.name == name
    assert len(set(model.parts)) == len(model.parts)
    assert set(model.mesh.part.tolist()) == set(range(len(model.parts)))
    assert int(model.mesh.material.max()) < len(model.materials)
    corners = model.mesh.positions[model.mesh.triangles]
    # The middles of edges too: a flat face of two triangles has one in its own middle.
    surface = np.concatenate([corners, 0.5 * (corners + np.roll(corners, 1, axis=1))]).reshape(
        -1, 3
    )
    # Keypoints lie on the craft or a hand's breadth off it, which tells swapped axes.
    for place in model.keypoints.values():
        nearest = np.linalg.norm(surface - place, axis=1).min()
        assert nearest < 0.15 * model.mesh.radius


def test_the_cubesat_has_the_corners_of_the_source_studys_12u() -> None:
    model = load_model("cubesat_12u")
    # 0.30 x 0.29 x 0.20 m along x, y, z about the origin.
    for x in (-0.15, 0.15):
        for y in (-0.145, 0.145):
            for z in (-0.1, 0.1):
                distance = np.linalg.norm(model.mesh.positions - np.array([x, y, z]), axis=1)
                # The edges of its rails are broken by a millimetre or two.
                assert distance.min() < 4e-3
