"""Model files that are damaged, or none at all, are refused in one line."""

from __future__ import annotations

import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from simgl import assets
from simgl.errors import AssetError
from simgl.model_files.model_library import load_model
from tests.model_files.gltf import UNSIGNED_SHORT, triangle


def refusal(path: Path) -> str:
    """The line with which a model file is refused."""
    with pytest.raises(AssetError) as caught:
        load_model(str(path))
    assert "\n" not in str(caught.value)
    return str(caught.value)


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
        (_put(*PRIMITIVE, "mode", value=1), "holds no mesh of triangles"),
        (
            _put(*PRIMITIVE, "mode", value=7),
            "meshes[0].primitives[0].mode must be a whole number >= 0, <= 6, got 7",
        ),
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
        (_put("nodes", value=[{}]), "holds no mesh of triangles"),
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
        ("a.gltf", "{}", "holds no scene"),
        ("a.obj", "a text\nof two lines\n", "holds no triangles; is it a whole OBJ file?"),
        ("a.obj", "", "holds no triangles; is it a whole OBJ file?"),
        ("a.obj", "v 0 0 0\nv 1 0 0\nf 1 2 9\n", "is not a readable OBJ file"),
        (
            "a.obj",
            "v 0 0\nv 1 0\nv 0 1\nf 1 2 3\n",
            "has vertices of 2 coordinates; they must have x, y and z",
        ),
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


def test_an_stl_file_with_damaged_normals_is_read_without_a_word_of_the_library(
    tmp_path: Path, caplog: pytest.LogCaptureFixture, capfd: pytest.CaptureFixture[str]
) -> None:
    """Only its places are read; flat facets have the normals of their own."""
    path = tmp_path / "a.stl"
    corners = "vertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n"
    facet = f"facet normal 0 0 x\nouter loop\n{corners}endloop\nendfacet\n"
    path.write_text(f"solid a\n{facet}endsolid\n")
    assert load_model(str(path)).mesh.normals[0].tolist() == [0.0, 0.0, 1.0]
    assert not caplog.records
    assert capfd.readouterr() == ("", "")
