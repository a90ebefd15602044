"""A mesh in memory is a model like one from a file."""

from __future__ import annotations

from typing import Any

import moderngl
import numpy as np
import pytest
import trimesh
from simgl_bridge.hashes import scene_hash

from simgl.errors import AssetError, ConfigError
from simgl.model_files.model_from_mesh import model_from_mesh
from simgl.model_files.surface_tables import load_finish
from simgl.scenario.loader import load_scenario, scenario_from_dict
from simgl.scenario.scenario import Scenario
from simgl.scene.materials import Material
from simgl.scene.mesh import box
from simgl.scene.spacecraft import SpacecraftModel
from tests.scenes import SUN, lambert, radiance

SIZE = (2.0, 3.0, 4.0)
GREY = Material(name="grey", reflectance=(0.5, 0.5, 0.5, 0.5))

TETRA = (
    np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], dtype=float),
    np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]),
)


def cuboid() -> tuple[np.ndarray[Any, Any], np.ndarray[Any, Any]]:
    """Eight shared corners and twelve triangles, as numpy arrays."""
    mesh = trimesh.creation.box(extents=SIZE)
    return np.array(mesh.vertices), np.array(mesh.faces)


def tables(craft: dict[str, Any]) -> dict[str, Any]:
    """A scene in deep space with one spacecraft, "cube"."""
    return {
        "epoch": {"utc": "2026-03-20T12:00:00"},
        "sun": {**SUN, "direction_icrf": [0.3, -0.9, 0.4]},
        "earth": {"shape": "none"},
        "spacecraft": {"cube": {"position_icrf_m": [0, 0, 0], **craft}},
        "camera": {
            "cam": {
                "position_icrf_m": [7.0, -20.0, 9.0],
                "look_at": "cube",
                "width_px": 96,
                "height_px": 96,
            }
        },
    }


def cube_scene(model: SpacecraftModel) -> Scenario:
    return scenario_from_dict(tables({}), models={"cube": model})


def test_a_cube_of_arrays_looks_like_the_primitive(gl: moderngl.Context) -> None:
    cube = model_from_mesh(cuboid(), name="cube", materials=[GREY], double_sided=False)
    primitive = scenario_from_dict(
        tables({"model": {"box": {"size_m": list(SIZE), "material": lambert(0.5)}}})
    )
    ours, theirs = radiance(gl, cube_scene(cube)), radiance(gl, primitive)
    assert theirs.max() > 10.0
    # The triangles split the faces along other diagonals: float32 rounding of places and samples.
    np.testing.assert_allclose(ours, theirs, rtol=1e-4, atol=1e-4 * theirs.max())


def test_a_trimesh_gives_the_mesh_of_its_arrays() -> None:
    from_arrays = model_from_mesh(cuboid(), name="cube")
    from_object = model_from_mesh(trimesh.creation.box(extents=SIZE), name="cube")
    assert from_object.mesh.digest == from_arrays.mesh.digest


def test_facets_are_flat_without_normals_and_each_corner_is_a_vertex() -> None:
    mesh = model_from_mesh(cuboid()).mesh
    assert len(mesh.positions) == 36
    expected = box(SIZE)
    assert {tuple(n) for n in mesh.normals.tolist()} == {
        tuple(n) for n in expected.normals.tolist()
    }


def test_given_normals_are_made_unit_and_vertices_stay_shared() -> None:
    vertices, faces = cuboid()
    mesh = model_from_mesh((vertices, faces), normals=3.0 * vertices).mesh
    assert len(mesh.positions) == 8
    np.testing.assert_allclose(np.linalg.norm(mesh.normals, axis=1), 1.0, rtol=1e-6)
    np.testing.assert_array_equal(mesh.positions[mesh.triangles], vertices[faces])


@pytest.mark.parametrize("normals", [None, TETRA[0] + 1.0], ids=["flat", "normals"])
def test_materials_and_parts_follow_their_triangles(
    normals: np.ndarray[Any, Any] | None,
) -> None:
    model = model_from_mesh(
        TETRA,
        materials=[GREY, "mli_gold"],
        material_of_triangle=[0, 0, 0, 1],
        parts=["side", "top"],
        part_of_triangle=[0, 1, 0, 0],
        normals=normals,
    )
    mesh = model.mesh
    assert model.materials == (GREY, load_finish("mli_gold"))
    for corner in range(3):
        assert mesh.material[mesh.triangles[:, corner]].tolist() == [0, 0, 0, 1]
        assert mesh.part[mesh.triangles[:, corner]].tolist() == [0, 1, 0, 0]
    np.testing.assert_array_equal(mesh.positions[mesh.triangles], TETRA[0][TETRA[1]])


def test_a_unit_scales_the_vertices_and_keypoints_are_metres() -> None:
    model = model_from_mesh(TETRA, unit_m=0.001, keypoints={"tip": [0.0, 0.0, 0.001]})
    assert model.mesh.positions.max() == np.float32(0.001)
    np.testing.assert_array_equal(model.keypoints["tip"], [0.0, 0.0, 0.001])


VERTICES, TRIANGLES = TETRA
WRONG: dict[str, tuple[Any, dict[str, Any], str]] = {
    "flat vertices": ((VERTICES[:, :2], TRIANGLES), {}, "vertices must have the shape (n, 3)"),
    "words": (([["a", "b", "c"]], TRIANGLES), {}, "vertices must be an array of numbers"),
    "nan": ((VERTICES * np.nan, TRIANGLES), {}, "vertices holds numbers that are not finite"),
    "infinite": ((VERTICES + np.inf, TRIANGLES), {}, "vertices holds numbers that are not finite"),
    "beyond float32": ((VERTICES * 1e39, TRIANGLES), {}, "holds vertices that are not finite"),
    "quads": ((VERTICES, [[0, 1, 2, 3]]), {}, "must have the shape (m, 3), got (1, 4)"),
    "none": ((VERTICES, np.zeros((0, 3), int)), {}, "must have the shape (m, 3), got (0, 3)"),
    "real indices": ((VERTICES, TRIANGLES * 1.0), {}, "must be whole numbers, got float64"),
    "too high": ((VERTICES, TRIANGLES + 1), {}, "holds index 4, but there are 4 vertices"),
    "negative": ((VERTICES, TRIANGLES - 1), {}, "holds index -1, but there are 4 vertices"),
    "normals": (TETRA, {"normals": VERTICES[:2]}, "has 2 normals for 4 vertices"),
    "materials": (TETRA, {"materials": []}, "but there are 0 materials"),
    "finish": (TETRA, {"materials": ["white_pant"]}, 'did you mean "white_paint"?'),
    "labels": (
        TETRA,
        {"material_of_triangle": [0, 0, 0]},
        "material_of_triangle must have the shape (4), got (3,)",
    ),
    "label": (
        TETRA,
        {"part_of_triangle": [0, 0, 0, 1]},
        "part_of_triangle holds index 1, but there are 1 parts",
    ),
    "keypoint": (TETRA, {"keypoints": {"tip": [0, 0]}}, "keypoint tip must have the shape (n, 3)"),
}


@pytest.mark.parametrize("case", sorted(WRONG))
def test_a_wrong_mesh_is_refused_in_one_line(case: str) -> None:
    mesh, more, problem = WRONG[case]
    with pytest.raises(AssetError) as caught:
        model_from_mesh(mesh, name="my mesh", **more)
    assert problem in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_model_takes_the_place_of_the_one_in_the_file() -> None:
    cube = model_from_mesh(cuboid(), name="cube")
    scenario = load_scenario("examples/approach.toml", models={"target": cube})
    assert scenario.models["target"] is cube
    assert scenario.models["chaser"].name == "cubesat_12u"


def test_a_model_for_no_spacecraft_is_refused() -> None:
    cube = model_from_mesh(cuboid())
    with pytest.raises(ConfigError, match='models names no spacecraft: "cub"; did you mean "cube"'):
        scenario_from_dict(tables({}), models={"cub": cube})


def test_keys_of_a_file_do_not_go_with_a_model_in_memory() -> None:
    cube = model_from_mesh(cuboid())
    with pytest.raises(ConfigError, match="unit is allowed only for a mesh file"):
        scenario_from_dict(tables({"unit": "mm"}), models={"cube": cube})


def test_without_a_model_the_table_needs_one() -> None:
    with pytest.raises(ConfigError, match=r"\[spacecraft.cube\]: model is missing"):
        scenario_from_dict(tables({}))


def test_the_scene_hash_follows_the_arrays() -> None:
    """Client and server see from the hash that they have different meshes."""
    vertices, faces = cuboid()
    hashes = [
        scene_hash(cube_scene(model_from_mesh(mesh, name="cube")))
        for mesh in ((vertices, faces), (vertices.copy(), faces), (1.001 * vertices, faces))
    ]
    assert hashes[0] == hashes[1]
    assert hashes[0] != hashes[2]
