"""Samples of a cell that see one smooth surface share their shading: the image does not show it.

The reference shades every sample by itself: its meshes are said to be curved everywhere.
"""

from __future__ import annotations

from typing import Any

import moderngl
import numpy as np
import pytest

from simgl.arrays import Array
from simgl.scene.mesh import Mesh
from tests.scenes import lambert, radiance, scene

FACING: dict[str, Any] = {"position_icrf_m": [0.3, 0.2, 8.0], "look_at": "body"}
GLOSSY = {"reflectance": 0.6, "metallic": 1.0, "roughness": 0.35}


def bodies(material: dict[str, Any]) -> dict[str, dict[str, Any]]:
    """A ball, a box, and a plate into which the edge of another one's shadow falls."""
    ball = {"sphere": {"radius_m": 1.0, "material": material}}
    box = {"box": {"size_m": [1.4, 1.0, 0.8], "material": material}}
    plate = {"plate": {"width_m": 2.0, "height_m": 2.0, "material": material}}
    origin = {"position_icrf_m": [0, 0, 0]}
    turned = {"quaternion_icrf_from_body_xyzw": [0.2, 0.3, 0.1, 0.927361849549570]}
    shade = {"plate": {"width_m": 0.9, "height_m": 0.9, "material": material}}
    return {
        "ball": {"body": {"model": ball, **origin}},
        "box": {"body": {"model": box, **origin, **turned}},
        "shadow": {
            "body": {"model": plate, **origin},
            "shade": {"model": shade, "position_icrf_m": [0.5, 0.3, 0.6]},
        },
    }


def pictures(
    gl: moderngl.Context, monkeypatch: pytest.MonkeyPatch, shape: str, material: dict[str, Any]
) -> tuple[Array, Array]:
    """(h, w, 4) radiance, and that with every sample shaded by itself."""

    def image() -> Array:
        camera = {**FACING, "focal_length_mm": 10.0}
        sun = (0.35, 0.2, np.sqrt(1.0 - 0.35**2 - 0.2**2))
        return radiance(gl, scene(bodies(material)[shape], camera, sun_direction=sun)).astype(float)

    shared = image()

    def curved(mesh: Mesh) -> Array:
        return np.full(len(mesh.triangles), 1e4)

    monkeypatch.setattr("simgl.passes.mesh_store.curvatures", curved)
    return shared, image()


MATERIALS = pytest.mark.parametrize("material", [lambert(0.5), GLOSSY], ids=["dull", "glossy"])


@pytest.mark.parametrize("shape", ["ball", "box"])
@MATERIALS
def test_shared_shading_gives_the_image_of_every_sample_shaded(
    gl: moderngl.Context, monkeypatch: pytest.MonkeyPatch, shape: str, material: dict[str, Any]
) -> None:
    """Within surfaces, at edges between them and at silhouettes."""
    shared, every = pictures(gl, monkeypatch, shape, material)
    difference = np.abs(shared - every)
    assert np.max(difference) < 0.02 * every.max()
    assert np.sqrt(np.mean(difference**2)) < 1e-3 * np.sqrt(np.mean(every[every > 0.0] ** 2))
    # The same samples are covered.
    np.testing.assert_array_equal(shared[..., 1] > 0.0, every[..., 1] > 0.0)


@MATERIALS
def test_shared_shading_gives_the_shadow_edge_of_every_sample_shaded(
    gl: moderngl.Context, monkeypatch: pytest.MonkeyPatch, material: dict[str, Any]
) -> None:
    """Of a sample's sunlight 1 / 20 is uncertain at the edge, which so many directions look past.

    A pixel has 5 samples, and the two images do not share directions.
    """
    shared, every = pictures(gl, monkeypatch, "shadow", material)
    difference = np.abs(shared - every)
    around = [np.roll(every, shift, axis) for axis in (0, 1) for shift in (-1, 1)]
    is_edge = np.ptp([every, *around], axis=0) > 0.01 * every.max()
    assert np.max(difference[~is_edge]) < 1e-3 * every.max()
    assert np.max(difference) < 4.0 * np.sqrt(2.0 / 5.0) / 20.0 * every.max()
    # The edge is at its place.
    np.testing.assert_allclose(shared.sum(), every.sum(), rtol=1e-3)


def test_a_highlight_keeps_its_energy(
    gl: moderngl.Context, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The light of a glossy ball, most of it in a highlight of some pixels."""
    shared, every = pictures(gl, monkeypatch, "ball", {**GLOSSY, "roughness": 0.2})
    np.testing.assert_allclose(shared.sum(axis=(0, 1)), every.sum(axis=(0, 1)), rtol=1e-3)
