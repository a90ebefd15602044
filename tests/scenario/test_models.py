"""Model files: glTF, OBJ and STL come in with their places, normals, parts and materials."""

from __future__ import annotations

import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from simgl import assets
from simgl.errors import AssetError, ConfigError
from simgl.scenario.detectors import Response
from simgl.scenario.library import (
    load_model,
    load_preset,
    preset_path,
    shipped_models,
    shipped_presets,
)
from tests.scenario.gltf import UNSIGNED_SHORT, Document, triangle

# float32 of numbers near one.
FLOAT32 = 2e-7


def refusal(path: Path) -> str:
    """The line with which a model file is refused."""
    with pytest.raises(AssetError) as caught:
        load_model(str(path))
    assert "\n" not in str(caught.value)
    return str(caught.value)


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


def _without_position(j: Any) -> None:
    j["meshes"][0]["primitives"][0]["attributes"] = {}


def _put(*path: Any, value: Any) -> Callable[[Any], None]:
    """A damage that sets one value in a document."""

    def damage(j: Any) -> None:
        for step in path[:-1]:
            j = j[step]
        j[path[-1]] = value

    return damage


PRIMITIVE = ("meshes", 0, "primitives", 0)


@pytest.mark.parametrize(
    ("damage", "message"),
    [
        (_put("scene", value=3), "names scene 3, but holds only 1"),
        (_put("scenes", 0, "nodes", value=[7]), "names node 7, but holds only 1"),
        (_put("nodes", 0, "mesh", value=2), "names mesh 2, but holds only 1"),
        (_put("nodes", 0, "children", value=[0]), "node 0 is its own ancestor"),
        (_put("nodes", 0, "rotation", value=[0, 0, 0, 0]), "node 0 has a rotation of all zeros"),
        (
            _put("nodes", 0, "rotation", value=[0, 0, 1]),
            "nodes[0].rotation must be a list of length 4, got [0, 0, 1]",
        ),
        (_put("nodes", 0, "scale", value=[1, 0, 1]), 'part "facet" is scaled to nothing'),
        (
            _put("nodes", 0, "translation", value=[1e300, 0, 0]),
            "holds vertices that are not finite",
        ),
        (_put(*PRIMITIVE, "mode", value=1), 'part "facet" is not made of triangles'),
        (_put(*PRIMITIVE, "material", value=0), "names material 0, but holds only 0"),
        (
            _put(*PRIMITIVE, "indices", value=0),
            "accessor 0 must be SCALAR of u1 or u2 or u4, got VEC3 of f4",
        ),
        (_without_position, "meshes[0].primitives[0].attributes.POSITION is missing"),
        (_put("accessors", 0, "count", value=2), 'part "facet" ends within a triangle'),
        (_put("accessors", 0, "count", value=4), "accessor 0 runs past the end of its buffer"),
        (
            _put("accessors", 0, "count", value=-1),
            "accessors[0].count must be a whole number >= 1, got -1",
        ),
        (
            _put("accessors", 0, "componentType", value=7),
            "accessors[0].componentType must be one of 5120, 5121, 5122, 5123, 5125, 5126, got 7",
        ),
        (
            _put("accessors", 0, "type", value="VEC2"),
            "accessor 0 must be VEC3 of f4, got VEC2 of f4",
        ),
        (
            _put("accessors", 0, "sparse", value={"count": 1}),
            "accessor 0 is sparse or empty; that is not read",
        ),
        (_put("accessors", 0, "bufferView", value=3), "names buffer view 3, but holds only 1"),
        (
            _put("extensionsRequired", value=["KHR_draco_mesh_compression"]),
            "needs the glTF extension KHR_draco_mesh_compression, which simgl does not read",
        ),
        (
            _put("materials", value=[{"pbrMetallicRoughness": {"baseColorFactor": [2, 0, 0, 1]}}]),
            'material "material_0": reflectance and metallic lie in 0..1, got 2',
        ),
        (_put("meshes", value=[]), "names mesh 0, but holds only 0"),
        (_put("nodes", value=[{}]), "holds no mesh"),
    ],
)
def test_a_broken_gltf_file_is_refused_in_one_line(
    damage: Callable[[Any], None], message: str, tmp_path: Path
) -> None:
    document = triangle()
    damage(document.json)
    path = document.write_gltf(tmp_path / "broken.gltf")
    assert refusal(path) == f"{path}: {message}"


def test_infrared_that_is_no_number_is_refused(tmp_path: Path) -> None:
    document = triangle()
    document.json["materials"] = [{"name": "foil", "extras": {"nir_reflectance": "bright"}}]
    path = document.write_gltf(tmp_path / "a.gltf")
    expected = f'{path} material "foil" extras: nir_reflectance must be a number, got "bright"'
    assert refusal(path) == expected


def test_indices_past_the_vertices_are_refused(tmp_path: Path) -> None:
    document = triangle()
    document.json["meshes"][0]["primitives"][0]["indices"] = document.accessor(
        [0, 1, 3], UNSIGNED_SHORT
    )
    path = document.write_gltf(tmp_path / "a.gltf")
    assert refusal(path) == f'{path}: part "facet" has an index past its vertices'


@pytest.mark.parametrize("share", [0.0001, 0.01, 0.1, 0.5, 0.9, 0.99999])
def test_a_glb_that_was_cut_short_says_by_how_much(share: float, tmp_path: Path) -> None:
    whole = (assets.models() / "cubesat_12u" / "cubesat_12u.glb").read_bytes()
    kept = int(len(whole) * share)
    path = tmp_path / "cut.glb"
    path.write_bytes(whole[:kept])
    assert refusal(path) == f"{path}: is cut short, {kept} of {len(whole)} bytes"


@pytest.mark.parametrize("kept", [0, 3, 4, 11, 12, 19])
def test_a_glb_cut_within_its_header_is_no_gltf(kept: int, tmp_path: Path) -> None:
    path = tmp_path / "cut.glb"
    path.write_bytes(triangle().write_glb(tmp_path / "whole.glb").read_bytes()[:kept])
    assert refusal(path) == f"{path}: is not a binary glTF file (no glTF header)"


def test_a_glb_whose_chunks_contradict_its_length_is_refused(tmp_path: Path) -> None:
    content = bytearray(triangle().write_glb(tmp_path / "whole.glb").read_bytes())
    content[12:16] = struct.pack("<I", 10**6)
    path = tmp_path / "long_chunk.glb"
    path.write_bytes(content)
    assert refusal(path) == f"{path}: has a chunk that runs past the end of the file"
    content[4:8] = struct.pack("<I", 1)
    path = tmp_path / "version.glb"
    path.write_bytes(content)
    assert refusal(path) == f"{path}: is glTF version 1; simgl reads version 2"


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("a.glb", "a text\nof two lines\n" * 9, "is not a binary glTF file (no glTF header)"),
        (
            "a.gltf",
            "{]",
            "is not a glTF file (JSON is malformed: object keys must be strings (byte 1))",
        ),
        ("a.gltf", "[1, 2]", "must be a table, got [1, 2]"),
        ("a.gltf", "{}", "names scene 0, but holds only 0"),
        ("a.obj", "a text\nof two lines\n", "holds no triangles; is it a whole OBJ file?"),
        ("a.obj", "", "holds no triangles; is it a whole OBJ file?"),
        ("a.obj", "v 0 0 0\nv 1 0 0\nf 1 2 9\n", "is not a readable OBJ file"),
        ("a.obj", "v 0 0 nan\nv 1 0 0\nv 0 1 0\nf 1 2 3", "holds vertices that are not finite"),
        ("a.obj", "v 0 0 1e99\nv 1 0 0\nv 0 1 0\nf 1 2 3", "holds vertices that are not finite"),
        ("a.stl", "a text\nof two lines\n", "holds no triangles; is it a whole STL file?"),
        ("a.stl", "solid a\nendsolid a\n", "holds no triangles; is it a whole STL file?"),
        (
            "a.stl",
            "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 x\nendloop\n"
            "endfacet\nendsolid\n",
            "is not a readable STL file",
        ),
        (
            "a.stl",
            "\0" * 80 + "\x0a\0\0\0" + "\0" * 60,
            "holds no triangles; is it a whole STL file?",
        ),
    ],
)
def test_a_file_that_is_no_mesh_is_refused_in_one_line(
    name: str, content: str, message: str, tmp_path: Path
) -> None:
    path = tmp_path / name
    path.write_text(content)
    assert refusal(path) == f"{path}: {message}"


def test_a_missing_buffer_file_is_named(tmp_path: Path) -> None:
    path = triangle().write_gltf_and_bin(tmp_path / "a.gltf", "a.bin", "b.bin")
    expected = f'{path}: buffer "b.bin" cannot be read (No such file or directory)'
    assert refusal(path) == expected


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


@pytest.mark.parametrize("name", shipped_presets())
def test_every_shipped_preset_is_whole(name: str) -> None:
    path = preset_path(name)
    preset = load_preset(path)
    assert preset.source
    Response(preset, path, 5772.0)
    # The converter spans the full well within its bits.
    assert preset.full_well_e / preset.gain_e_per_dn < 2**preset.bits


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("value = [0.45, ", "value = [", "qe.value needs one number for each qe.wavelength_nm"),
        ("[400, 450,", "[450, 400,", "qe.wavelength_nm must increase, over two points or more"),
        ("value = [0.45, ", "value = [1.45, ", "qe.value[0] must be a number <= 1.0, got 1.45"),
        ("[qe]", '[qe]\ncsv = "a.csv"', "qe.value or csv is needed, and not both"),
        ("width_px = 1280\n", "", "width_px is missing"),
        ("bits = 12", "bits = 12\nbit = 1", 'bit is not a key here; did you mean "bits"?'),
    ],
)
def test_a_damaged_preset_is_refused(old: str, new: str, message: str, tmp_path: Path) -> None:
    text = (assets.data() / "cameras" / "mt9m034.toml").read_text()
    assert text.count(old) == 1
    path = tmp_path / "mine.toml"
    path.write_text(text.replace(old, new))
    with pytest.raises(ConfigError) as caught:
        Response(load_preset(path), path, 5772.0)
    assert str(caught.value).startswith(f"{path}: {message}")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "nm,qe\n400,0.5\n500;0.6\n",
            'line 3 must be a wavelength in nm and a value, got "500;0.6"',
        ),
        ("400,0.5\n500,1.6\n", "qe.value must lie in 0..1"),
        ("400,0.5\n500,nan\n", "qe.value must lie in 0..1"),
        ("500,0.5\n400,0.6\n", "qe.wavelength_nm must increase, over two points or more"),
        ("", "qe.wavelength_nm must increase, over two points or more"),
    ],
)
def test_a_damaged_curve_file_is_refused(text: str, message: str, tmp_path: Path) -> None:
    (tmp_path / "qe.csv").write_text(text)
    with pytest.raises(ConfigError) as caught:
        Response(load_preset(_with_curve_file(tmp_path)), tmp_path / "mine.toml", 5772.0)
    assert str(caught.value) == f"{tmp_path / 'qe.csv'}: {message}"


def test_a_curve_file_says_the_same_as_lists(tmp_path: Path) -> None:
    shipped = preset_path("mt9m034")
    curve = load_preset(shipped).qe
    assert curve.wavelength_nm is not None
    assert curve.value is not None
    rows = [f"{nm}, {value}" for nm, value in zip(curve.wavelength_nm, curve.value, strict=True)]
    (tmp_path / "qe.csv").write_text("\n".join(["nm, electrons per photon", *rows, ""]))
    path = _with_curve_file(tmp_path)
    assert Response(load_preset(path), path, 5772.0).plain() == (
        Response(load_preset(shipped), shipped, 5772.0).plain()
    )


def _with_curve_file(folder: Path) -> Path:
    head, _, _ = preset_path("mt9m034").read_text().partition("[qe]")
    (folder / "mine.toml").write_text(f'{head}[qe]\ncsv = "qe.csv"\n')
    return folder / "mine.toml"
