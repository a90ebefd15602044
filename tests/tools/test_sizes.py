"""The shipped spacecraft have the sizes that their pages state."""

from __future__ import annotations

import numpy as np
import pytest

from simgl.arrays import Array
from tests.tools.shipped import ATV_WINGS, all_corners, corners_of, document_of, ray_hits, record_of
from tools.spacecraft_models.debris_rocket_body import DENTS


def extent(corners: Array) -> tuple[Array, Array]:
    return corners.min(axis=(0, 1)), corners.max(axis=(0, 1))


def test_space_rider_has_its_stated_size() -> None:
    low, high = extent(all_corners("space_rider"))
    np.testing.assert_allclose([low[0], high[0]], [-3.9, 3.9], atol=1e-6)  # origin midway
    np.testing.assert_allclose([low[1], high[1]], [-5.0, 5.0], atol=1e-6)
    low, high = extent(all_corners("space_rider", "body"))
    # Thruster bells reach behind the base and antennas above the top, each by less than 0.1 m.
    np.testing.assert_allclose(high - low, [4.6, 2.2, 1.9], atol=0.1)
    low, high = extent(all_corners("space_rider", "service_module"))
    np.testing.assert_allclose((high - low)[1:], [2.3, 2.4], atol=0.05)


def test_cubesat_body_has_its_stated_size() -> None:
    corners = all_corners("cubesat_12u", "body")
    rails = np.abs(corners[(np.abs(corners[..., 0]) <= 0.1501).all(axis=1)]).max(axis=(0, 1))
    np.testing.assert_allclose(rails[0], 0.15, atol=1e-6)
    low, high = extent(all_corners("cubesat_12u"))
    assert high[1] - low[1] == pytest.approx(1.086, abs=1e-5)


def test_cargo_craft_has_its_stated_size() -> None:
    low, high = extent(all_corners("atv_like"))
    np.testing.assert_allclose([low[0], high[0]], [-5.1, 5.1], atol=1e-6)  # origin midway
    record = record_of("atv_like")
    tips = np.array([record["keypoints"][f"wing_tip_{where}"] for where in ATV_WINGS])
    np.testing.assert_allclose(np.hypot(tips[:, 1], tips[:, 2]), 22.3 / 2.0, atol=1e-5)
    body = all_corners("atv_like", "cargo_carrier", "propulsion_module")
    blanket = body[np.abs(body[..., 0] - 1.0).max(axis=1) < 0.5]
    # Between the handrails the blanket is the outermost: its radius is 2.24 m.
    radii = np.hypot(blanket[..., 1], blanket[..., 2])
    assert 2.2 < np.median(radii) <= 2.24


def test_station_truss_and_wings_span_100_m() -> None:
    low, high = extent(all_corners("iss_like"))
    # The outer blankets' boxes end 50 m less 2 cm from the middle.
    np.testing.assert_allclose([low[1], high[1]], [-50.0, 50.0], atol=0.025)
    low, high = extent(all_corners("iss_like", "outer_truss_right"))
    np.testing.assert_allclose([low[0], high[0]], [-37.15, 37.15], atol=1e-5)


def test_station_has_sixteen_thin_blankets() -> None:
    document = document_of("iss_like")
    for side in ("left", "right"):
        node = next(node for node in document.nodes if node.name == f"outer_truss_{side}")
        cells = [
            primitive
            for primitive in document.meshes[node.mesh].primitives
            if document.materials[primitive.material].name == "solar_cell"
        ]
        corners = np.concatenate([corners_of(document, primitive) for primitive in cells])
        area = 0.5 * np.linalg.norm(
            np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
        )
        # Eight a side of 32.7 x 4.6 m, 92 % of it cells; the folds add under 1 %.
        assert area.sum() == pytest.approx(8 * 32.7 * 4.6 * 0.92, rel=0.01)


def test_rocket_body_has_its_stated_size_and_its_dents() -> None:
    low, high = extent(all_corners("debris_rocket_body"))
    np.testing.assert_allclose([low[0], high[0]], [-4.5, 4.5], atol=1e-6)
    for dent in DENTS:
        outward = np.array([0.0, np.sin(dent.azimuth), -np.cos(dent.azimuth)])
        start = np.array([dent.x, 0.0, 0.0]) + 5.0 * outward
        hits = ray_hits(start, -outward, all_corners("debris_rocket_body", "tank"))
        # A chord of the 108-sided wall lies up to 0.5 mm inside; 5 mm for the dent's own curvature.
        assert 5.0 - hits[0] == pytest.approx(1.2 - dent.depth, abs=6e-3), dent


@pytest.mark.parametrize("name", ["cubesat_12u", "space_rider"])
def test_solar_cells_stand_three_millimetres_above_their_plate(name: str) -> None:
    document = document_of(name)
    panels = [node for node in document.nodes if "panel" in node.name]
    assert len(panels) == 2
    for node in panels:
        heights = {
            document.materials[primitive.material].name: document.accessors[
                primitive.attributes.POSITION
            ].max[1]  # +Y of the file is up
            for primitive in document.meshes[node.mesh].primitives
        }
        assert heights["solar_cell"] - heights["panel_grid"] == pytest.approx(0.003, abs=1e-6)
