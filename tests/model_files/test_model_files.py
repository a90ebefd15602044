"""Model files: glTF, OBJ and STL come in with their places, normals, parts and materials."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from simgl.errors import AssetError
from simgl.model_files.model_library import load_model
from tests.model_files.gltf import UNSIGNED_SHORT, Document, triangle

# float32 of numbers near one.
FLOAT32 = 2e-7


def two_parts() -> Document:
    """A parent turned, stretched and moved, with a child that has its own normals."""
    document = Document()
    points = document.accessor([[0, 0, 0], [1, 0, 0], [0, 1, 0]])
    normals = document.accessor([[0.0, 0.0, 1.0], [0.0, 0.6, 0.8], [0.0, 0.0, 1.0]])
    order = document.accessor([0, 1, 2], UNSIGNED_SHORT)
    flat = document.mesh(attributes={"POSITION": points})
    smooth = document.mesh(
        attributes={"POSITION": points, "NORMAL": normals}, indices=order, material=1
    )
    half = float(np.sqrt(0.5))
    document.json["nodes"] = [
        {
            "name": "hull",
            "mesh": flat,
            # First stretched, then a quarter turn about z, then moved.
            "scale": [2.0, 3.0, 4.0],
            "rotation": [0.0, 0.0, half, half],
            "translation": [10.0, 0.0, 0.0],
            "children": [1],
        },
        {"name": "panel", "mesh": smooth, "translation": [0.0, 0.0, 1.0]},
    ]
    document.json["materials"] = [
        {"name": "unused"},
        {
            "name": "foil",
            "pbrMetallicRoughness": {
                "baseColorFactor": [0.9, 0.7, 0.2, 1.0],
                "metallicFactor": 0.5,
                "roughnessFactor": 0.3,
            },
            "extras": {"nir_reflectance": 0.95, "made_by": "hand"},
        },
    ]
    return document


def test_nodes_stretch_then_turn_then_move_and_pass_it_on_to_their_children(
    tmp_path: Path,
) -> None:
    model = load_model(str(two_parts().write_gltf(tmp_path / "two.gltf")))
    # (x, y, z) -> (2x, 3y, 4z) -> (-3y, 2x, 4z) -> (10 - 3y, 2x, 4z)
    hull = [[10, 0, 0], [10, 2, 0], [7, 0, 0]]
    panel = [[10, 0, 4], [10, 2, 4], [7, 0, 4]]
    np.testing.assert_allclose(model.mesh.positions, hull + panel, rtol=0.0, atol=10 * FLOAT32)
    np.testing.assert_array_equal(model.mesh.triangles, [[0, 1, 2], [3, 4, 5]])


def test_each_node_with_a_mesh_is_a_part_with_its_own_name(tmp_path: Path) -> None:
    model = load_model(str(two_parts().write_gltf(tmp_path / "two.gltf")))
    assert model.parts == ("hull", "panel")
    np.testing.assert_array_equal(model.mesh.part, [0, 0, 0, 1, 1, 1])


def test_a_primitive_without_normals_gets_those_of_its_facets(tmp_path: Path) -> None:
    model = load_model(str(two_parts().write_gltf(tmp_path / "two.gltf")))
    np.testing.assert_allclose(model.mesh.normals[:3], [[0, 0, 1]] * 3, rtol=0.0, atol=FLOAT32)


def test_normals_stay_square_to_a_stretched_surface(tmp_path: Path) -> None:
    model = load_model(str(two_parts().write_gltf(tmp_path / "two.gltf")))
    # Normals divide by the stretch, (0, .6/3, .8/4) = (0, .2, .2), then turn: (-.2, 0, .2).
    half = np.sqrt(0.5)
    expected = [[0, 0, 1], [-half, 0, half], [0, 0, 1]]
    np.testing.assert_allclose(model.mesh.normals[3:], expected, rtol=0.0, atol=FLOAT32)


def test_materials_keep_their_factors_and_the_near_infrared_of_their_extras(
    tmp_path: Path,
) -> None:
    model = load_model(str(two_parts().write_gltf(tmp_path / "two.gltf")))
    hull, panel = (model.materials[int(i)] for i in model.mesh.material[[0, 3]])
    assert panel.name == "foil"
    assert panel.reflectance == (0.9, 0.7, 0.2, 0.95)
    assert (panel.metallic, panel.roughness) == (0.5, 0.3)
    # A primitive without a material is a white rough dielectric.
    assert (hull.name, hull.reflectance, hull.metallic) == ("default", (1.0,) * 4, 0.0)


def test_a_material_silent_on_the_near_infrared_is_as_bright_there_as_in_red(
    tmp_path: Path,
) -> None:
    document = triangle()
    document.json["materials"] = [
        {"pbrMetallicRoughness": {"baseColorFactor": [0.8, 0.1, 0.1, 1.0]}}
    ]
    material = load_model(str(document.write_gltf(tmp_path / "red.gltf"))).materials[0]
    assert material.name == "material_0"
    assert material.reflectance == (0.8, 0.1, 0.1, 0.8)
    # The glTF defaults are a rough metal.
    assert (material.metallic, material.roughness) == (1.0, 1.0)


def test_a_mirrored_node_still_faces_outwards(tmp_path: Path) -> None:
    document = triangle(scale=[-1.0, 1.0, 1.0])
    model = load_model(str(document.write_gltf(tmp_path / "mirrored.gltf")))
    a, b, c = model.mesh.positions[model.mesh.triangles[0]]
    # Mirrored in x, the facet keeps its side: counter-clockwise seen from +z.
    np.testing.assert_allclose(np.cross(b - a, c - a), [0, 0, 1], rtol=0.0, atol=FLOAT32)
    np.testing.assert_allclose(model.mesh.normals, [[0, 0, 1]] * 3, rtol=0.0, atol=FLOAT32)


def test_a_node_may_carry_a_matrix_column_by_column(tmp_path: Path) -> None:
    matrix = [0, 1, 0, 0, -1, 0, 0, 0, 0, 0, 1, 0, 5, 6, 7, 1]
    model = load_model(str(triangle(matrix=matrix).write_gltf(tmp_path / "m.gltf")))
    np.testing.assert_array_equal(model.mesh.positions, [[5, 6, 7], [5, 7, 7], [4, 6, 7]])


@pytest.mark.parametrize("form", ["data", "file", "escaped", "binary"])
def test_the_buffer_may_lie_anywhere_the_format_allows(form: str, tmp_path: Path) -> None:
    document = two_parts()
    path = {
        "data": lambda: document.write_gltf(tmp_path / "a.gltf"),
        "file": lambda: document.write_gltf_and_bin(tmp_path / "a.gltf", "a.bin", "a.bin"),
        "escaped": lambda: document.write_gltf_and_bin(tmp_path / "a.gltf", "a b.bin", "a%20b.bin"),
        "binary": lambda: document.write_glb(tmp_path / "a.glb"),
    }[form]()
    assert load_model(str(path)).mesh.positions[1].tolist() == pytest.approx([10, 2, 0], abs=1e-6)


def test_a_file_in_millimetres_is_scaled_by_its_unit(tmp_path: Path) -> None:
    path = triangle().write_gltf(tmp_path / "mm.gltf")
    np.testing.assert_allclose(
        load_model(str(path), unit_m=1e-3).mesh.positions[1], [1e-3, 0, 0], rtol=FLOAT32
    )


def test_a_doubly_sided_material_opens_the_model(tmp_path: Path) -> None:
    document = triangle()
    assert not load_model(str(document.write_gltf(tmp_path / "closed.gltf"))).open_sheets
    document.json["materials"] = [{"doubleSided": True}]
    assert load_model(str(document.write_gltf(tmp_path / "open.gltf"))).open_sheets


def tetrahedron() -> Document:
    corners = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
    document = Document()
    surface = {"POSITION": document.accessor(corners)}
    faces = document.accessor([0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3], UNSIGNED_SHORT)
    document.json["nodes"] = [{"mesh": document.mesh(attributes=surface, indices=faces)}]
    document.json["meshes"][0]["primitives"][0]["material"] = 0
    document.json["materials"] = [{"doubleSided": True}]
    return document


def test_a_closed_body_needs_no_second_side_unless_it_has_holes(tmp_path: Path) -> None:
    document = tetrahedron()
    assert not load_model(str(document.write_gltf(tmp_path / "closed.gltf"))).open_sheets
    document.json["materials"][0]["alphaMode"] = "MASK"
    assert load_model(str(document.write_gltf(tmp_path / "holes.gltf"))).open_sheets


def test_a_closed_stl_has_one_side(tmp_path: Path) -> None:
    ball = trimesh.creation.icosphere(subdivisions=2)
    ball.export(tmp_path / "ball.stl")
    assert not load_model(str(tmp_path / "ball.stl")).open_sheets
    ball.update_faces(np.arange(len(ball.faces)) > 0)
    ball.export(tmp_path / "torn.stl")
    assert load_model(str(tmp_path / "torn.stl")).open_sheets


@pytest.mark.parametrize(
    ("mode", "order"),
    [
        (5, [0, 1, 3, 2, 4]),  # strip
        (6, [0, 1, 2, 4, 3]),  # fan
    ],
)
def test_strips_and_fans_face_the_side_that_the_format_says(
    mode: int, order: list[int], tmp_path: Path
) -> None:
    """A flat pentagon, counter-clockwise seen from above; its edges as lines are a note."""
    ring = [[0, 0, 0], [2, 0, 0], [3, 1, 0], [0, 2, 0], [2, 2, 0]]
    document = Document()
    surface = {"POSITION": document.accessor(ring)}
    corners = document.accessor(order, UNSIGNED_SHORT)
    mesh = document.mesh(attributes=surface, indices=corners, mode=mode)
    edges = {"attributes": surface, "mode": 2}
    document.json["meshes"][mesh]["primitives"].append(edges)
    document.json["meshes"].append({"primitives": [edges]})
    document.json["nodes"] = [
        {"name": "plate", "mesh": mesh, "children": [1]},
        {"name": "rim", "mesh": mesh + 1},
    ]
    model = load_model(str(document.write_glb(tmp_path / "a.glb")))
    corner = model.mesh.positions[model.mesh.triangles].astype(float)
    crosses = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    assert len(crosses) == 3
    assert np.all(crosses[:, 2] > 0.0)
    assert model.parts == ("plate",)
    assert [b.name for b in model.branches] == ["plate"]
    assert model.notes == tuple(
        f'part "{name}": points and lines are not drawn' for name in ("plate", "rim")
    )


def test_an_obj_in_millimetres_comes_in_as_flat_facets_in_metres(tmp_path: Path) -> None:
    path = tmp_path / "plate.obj"
    # A comment in another encoding and a material that is not there do no harm.
    path.write_bytes(
        b"# fa\xe7ade\nmtllib no.mtl\nusemtl x\n"
        b"v 0 0 0\nv 200 0 0\nv 200 0 100\nv 0 0 100\nf 1 2 3 4\n"
    )
    model = load_model(str(path), unit_m=1e-3)
    assert model.mesh.triangles.shape == (2, 3)
    assert model.mesh.positions.max(axis=0).tolist() == pytest.approx([0.2, 0.0, 0.1])
    # Counter-clockwise in x, z is clockwise seen from +y: the plate faces -y.
    np.testing.assert_allclose(model.mesh.normals, [[0, -1, 0]] * 6, rtol=0.0, atol=FLOAT32)
    assert model.parts == ("plate",)
    assert model.open_sheets


@pytest.mark.parametrize("form", ["ascii", "binary"])
def test_an_stl_in_inches_comes_in_in_metres(form: str, tmp_path: Path) -> None:
    path = tmp_path / "facet.stl"
    corners = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]
    if form == "binary":
        path.write_bytes(bytes(80) + struct.pack("<I12fH", 1, 0, 0, 1, *corners, 0))
    else:
        path.write_text(
            "solid facet\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\n"
            "vertex 0 1 0\nendloop\nendfacet\nendsolid facet\n"
        )
    model = load_model(str(path), unit_m=0.0254)
    np.testing.assert_allclose(
        model.mesh.positions, 0.0254 * np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]]), rtol=FLOAT32
    )
    np.testing.assert_allclose(model.mesh.normals, [[0, 0, 1]] * 3, rtol=0.0, atol=FLOAT32)


def block(*nodes: dict[str, Any]) -> Document:
    """A closed wedge with a normal for each facet; nodes from the root down to its mesh."""
    corners = np.array([[0, 0, 0], [3, 0, 0], [0, 2, 0], [0, 0, 1]], dtype=np.float64)
    facets = corners[[[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]]
    outward = np.cross(facets[:, 1] - facets[:, 0], facets[:, 2] - facets[:, 0])
    outward /= np.linalg.norm(outward, axis=1, keepdims=True)
    document = Document()
    mesh = document.mesh(
        attributes={
            "POSITION": document.accessor(facets.reshape(-1, 3)),
            "NORMAL": document.accessor(np.repeat(outward, 3, axis=0)),
        }
    )
    document.json["nodes"] = [
        {"name": f"node_{index}", **node, "children": [index + 1]}
        for index, node in enumerate(nodes[:-1])
    ]
    document.json["nodes"].append({"name": "wedge", "mesh": mesh, **nodes[-1]})
    return document


MIRRORED_X = {"scale": [-1.0, 1.0, 1.0]}
TURNED = {"rotation": [0.0, 0.6, 0.0, 0.8], "translation": [1.0, 2.0, 3.0]}
# Swaps x and y, which is a mirror in their diagonal.
SWAPPED = {"matrix": [0, 1, 0, 0, 1, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]}


@pytest.mark.parametrize(
    "nodes",
    [
        [{}],
        [MIRRORED_X],
        [{"scale": [-1.0, -1.0, -1.0]}],
        [{"scale": [-1.0, -2.0, 0.5]}],
        [SWAPPED],
        [MIRRORED_X, TURNED],
        [TURNED, {"scale": [2.0, -0.5, 3.0]}],
        [MIRRORED_X, SWAPPED],
        [MIRRORED_X, TURNED, MIRRORED_X, SWAPPED],
    ],
)
def test_the_normals_of_a_closed_body_face_outwards_however_often_it_is_mirrored(
    nodes: list[dict[str, Any]], tmp_path: Path
) -> None:
    mesh = load_model(str(block(*nodes).write_gltf(tmp_path / "m.gltf"))).mesh
    corners = mesh.positions[mesh.triangles].astype(np.float64)
    facets = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    # By the divergence theorem a closed surface that is wound outwards encloses a positive volume.
    assert np.einsum("ij,ij->", corners[:, 0], facets) > 0.0
    facets /= np.linalg.norm(facets, axis=1, keepdims=True)
    for corner in range(3):
        normals = mesh.normals[mesh.triangles[:, corner]]
        np.testing.assert_allclose(normals, facets, rtol=0.0, atol=10 * FLOAT32)


def test_a_mirrored_part_moves_with_its_joint_like_any_other(tmp_path: Path) -> None:
    block(MIRRORED_X).write_glb(tmp_path / "m.glb")
    (tmp_path / "model.toml").write_text(
        'name = "m"\nfile = "m.glb"\nunit_m = 1.0\naxes = { x = "+x", y = "+y", z = "+z" }\n'
        '[[joint]]\nname = "hinge"\npart = "wedge"\nkind = "revolute"\n'
        "axis_body = [0.0, 0.0, 1.0]\norigin_body_m = [0.0, 0.0, 0.0]\nrange_deg = [0.0, 90.0]\n"
    )
    model = load_model("model.toml", tmp_path)
    mesh = model.posed({"hinge": np.pi / 2}).posed_mesh.baked()
    # A quarter turn about z: (x, y, z) -> (-y, x, z).
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    stored = model.mesh
    np.testing.assert_allclose(mesh.positions, stored.positions @ turn.T, atol=10 * FLOAT32)
    np.testing.assert_allclose(mesh.normals, stored.normals @ turn.T, atol=10 * FLOAT32)


def test_a_vertex_without_direction_takes_that_of_its_facets(tmp_path: Path) -> None:
    document = triangle()
    attributes = document.json["meshes"][0]["primitives"][0]["attributes"]
    attributes["NORMAL"] = document.accessor([[0.0, 0.0, 0.0], [0.0, 0.6, 0.8], [0.0, 0.0, 0.0]])
    mesh = load_model(str(document.write_gltf(tmp_path / "m.gltf"))).mesh
    expected = [[0.0, 0.0, 1.0], [0.0, 0.6, 0.8], [0.0, 0.0, 1.0]]
    np.testing.assert_allclose(mesh.normals, expected, rtol=0.0, atol=FLOAT32)


@pytest.mark.parametrize("unit_m", [0.0, -0.001, float("nan"), float("inf")])
def test_a_unit_that_would_mirror_or_shrink_a_model_to_nothing_is_refused(
    unit_m: float, tmp_path: Path
) -> None:
    path = triangle().write_gltf(tmp_path / "m.gltf")
    with pytest.raises(AssetError, match="unit_m must be positive and finite, got"):
        load_model(str(path), unit_m=unit_m)
