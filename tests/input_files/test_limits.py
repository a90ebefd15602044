"""Files of valid form beyond any use, nested, doubling, huge or of many parts: one line each."""

from __future__ import annotations

import gzip
import io
import json
import struct
import time
import zipfile
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from benchmarks.damaged_files.valid_files import CARD, SCENE, glb, gltf, png, write_all
from simgl.config.validation import MAX_DEPTH
from simgl.decoded_files import array_in, arrays_in, copy_pixels, decoded_image
from simgl.disk_cache import read_arrays
from simgl.errors import AssetError, ConfigError, SimglError, did_you_mean
from simgl.model_files.gltf_file import MAX_NODE_DEPTH, MAX_NODES
from simgl.model_files.model_from_mesh import MAX_TRIANGLES, model_from_mesh
from simgl.model_files.model_library import load_model
from simgl.scenario.loader import load_scenario, scenario_from_dict
from tests import patience
from tests.model_files.gltf import Document, triangle

PLATE = {"plate": {"width_m": 1.0, "height_m": 1.0, "material": {"reflectance": 0.5}}}
EPOCH = {"utc": "2026-03-20T12:00:00"}
NESTED = f"is nested too deeply; at most {MAX_DEPTH} tables and lists lie within each other"


def refusal(path: Path) -> str:
    """The line with which a scenario or a model is refused, within seconds."""
    start = time.monotonic()
    with pytest.raises(SimglError) as caught:
        load_scenario(path) if path.suffix == ".toml" else load_model(str(path))
    assert time.monotonic() - start < patience.limit(20.0)
    assert "\n" not in str(caught.value)
    return str(caught.value)


@pytest.mark.parametrize("depth", [MAX_DEPTH + 1, 1000, 100_000])
@pytest.mark.parametrize("form", ["list", "inline table", "dotted key", "table name"])
def test_nested_toml_is_refused_in_one_line(form: str, depth: int, tmp_path: Path) -> None:
    text = {
        "list": "seed = " + depth * "[" + depth * "]",
        "inline table": "seed = " + depth * "{a=" + "0" + depth * "}",
        "dotted key": "seed" + depth * ".a" + " = 0",
        "table name": "[render" + depth * ".a" + "]",
    }[form]
    path = tmp_path / "scene.toml"
    path.write_text(f"{SCENE}\n[assess]\n{text}\n")
    assert refusal(path) == f"{path}: {NESTED}"


def test_data_that_hold_themselves_are_refused() -> None:
    """As a program may build them: a table within itself, and lists that double 60 times."""
    circle: dict[str, Any] = {"epoch": EPOCH}
    circle["render"] = circle
    with pytest.raises(ConfigError, match=NESTED):
        scenario_from_dict(circle)
    double: list[Any] = []
    for _ in range(25):
        double = [double, double]
    with pytest.raises(ConfigError, match="holds more than 4000000 values in its tables and lists"):
        scenario_from_dict({"epoch": EPOCH, "render": {"seed": double}})


@pytest.mark.parametrize("ending", ["gltf", "glb"])
@pytest.mark.parametrize("brackets", [(b"[", b"]"), (b'{"a":', b"0}")])
def test_nested_json_is_refused_in_one_line(
    brackets: tuple[bytes, bytes], ending: str, tmp_path: Path
) -> None:
    left, right = (100_000 * bracket for bracket in brackets)
    content = b'{"asset": {"version": "2.0"}, "extras": ' + left + right + b"}"
    content += b" " * (-len(content) % 4)
    if ending == "glb":
        head = struct.pack("<4sIIII", b"glTF", 2, 20 + len(content), len(content), 0x4E4F534A)
        content = head + content
    path = tmp_path / f"deep.{ending}"
    path.write_bytes(content)
    assert refusal(path) == f"{path}: is not a glTF file (it is nested too deeply)"


def test_a_nested_value_in_an_error_is_shown_in_short(tmp_path: Path) -> None:
    document = triangle()
    value: list[Any] = []
    for _ in range(300):
        value = [value]
    document.json["nodes"][0]["rotation"] = value
    path = document.write_gltf(tmp_path / "a.gltf")
    assert refusal(path).endswith(
        "nodes[0].rotation must be a list of length 4, got a list of lists"
    )


def _doubling(levels: int, breadth: int = 2) -> Document:
    """Each node holds the next one some times."""
    document = triangle()
    facet = document.json["nodes"].pop()
    document.json["nodes"] = [{"children": [i + 1] * breadth} for i in range(levels)] + [facet]
    return document


def test_nodes_that_double_are_refused_at_once(tmp_path: Path) -> None:
    path = _doubling(40).write_gltf(tmp_path / "double.gltf")
    limit = f"{path}: places more than {MAX_NODES} nodes, each counted wherever it is used"
    assert refusal(path) == limit
    path = _doubling(1, 200_000).write_gltf(tmp_path / "many.gltf")
    assert refusal(path) == limit.replace("double.gltf", "many.gltf")


def test_nodes_that_double_a_few_times_are_all_placed(tmp_path: Path) -> None:
    model = load_model(str(_doubling(6).write_gltf(tmp_path / "few.gltf")))
    assert len(model.parts) == 2**6


@pytest.mark.parametrize("depth", [MAX_NODE_DEPTH, 40_000])
def test_a_long_chain_of_nodes_is_refused(depth: int, tmp_path: Path) -> None:
    path = _doubling(depth, 1).write_gltf(tmp_path / "chain.gltf")
    expected = f"{path}: has nodes more than {MAX_NODE_DEPTH} levels below each other"
    assert refusal(path) == expected


def test_the_longest_chain_of_nodes_is_read(tmp_path: Path) -> None:
    path = _doubling(MAX_NODE_DEPTH - 1, 1).write_gltf(tmp_path / "chain.gltf")
    model = load_model(str(path))
    assert len(model.branches) == MAX_NODE_DEPTH


def test_triangles_count_wherever_they_are_placed(tmp_path: Path) -> None:
    """A thousand parts of ten thousand triangles each."""
    document = triangle()
    corners = np.zeros((30_000, 3), dtype=np.float32)
    corners[1::3, 0] = corners[2::3, 1] = 1.0
    mesh = document.mesh(attributes={"POSITION": document.accessor(corners)})
    document.json["nodes"] = [{"mesh": mesh} for _ in range(1000)]
    document.json["scenes"][0]["nodes"] = list(range(1000))
    path = document.write_glb(tmp_path / "heavy.glb")
    # Refused with the first part beyond the limit.
    count = MAX_TRIANGLES + 10_000
    assert refusal(path) == f"{path}: holds {count} triangles, at most {MAX_TRIANGLES} are drawn"


def test_a_mesh_in_memory_has_the_same_limits() -> None:
    faces = np.zeros((MAX_TRIANGLES + 1, 3), dtype=np.int32)
    with pytest.raises(AssetError, match=f"at most {MAX_TRIANGLES} are drawn"):
        model_from_mesh((np.zeros((3, 3)), faces))


def test_an_obj_file_with_many_materials_is_read_at_once(tmp_path: Path) -> None:
    lines = ["v 0 0 0", "v 1 0 0", "v 0 1 0", "mtllib parts.mtl"]
    lines += [f"o part{i}\n usemtl m{i}\nf 1 2 3" for i in range(20_000)]
    path = tmp_path / "many.obj"
    path.write_text("\n".join(lines))
    start = time.monotonic()
    assert len(load_model(str(path)).mesh.triangles) == 20_000
    assert time.monotonic() - start < patience.limit(10.0)


@pytest.mark.parametrize("kind", ["camera", "spacecraft", "lamp"])
def test_very_many_tables_are_refused_before_any_is_read(kind: str, tmp_path: Path) -> None:
    path = tmp_path / "scene.toml"
    tables = "".join(f"[{kind}.n{i}]\n" for i in range(20_000))
    path.write_text(f'[epoch]\nutc = "{EPOCH["utc"]}"\n{tables}')
    assert refusal(path) == f"{path}: {kind} holds 20000 tables, at most 1000"


def test_a_million_cameras_are_more_than_a_scenario_file_holds(tmp_path: Path) -> None:
    path = tmp_path / "scene.toml"
    path.write_text("".join(f"[camera.n{i}]\n" for i in range(1_000_000)))
    size = path.stat().st_size
    assert refusal(path) == f"{path}: is too large, {size} bytes; at most 4 MiB are read"


def test_a_thousand_spacecraft_in_a_chain_are_placed() -> None:
    """The last one stands a thousand metres above the first."""
    table = {"model": PLATE, "position_lvlh_m": [0.0, 0.0, -1.0], "attitude": "icrf"}
    crafts: dict[str, Any] = {"n0": {"model": PLATE, "orbit": {"altitude_km": 400.0}}}
    # Named before what they refer to.
    chain = {f"n{i}": {**table, "relative_to": f"n{i - 1}"} for i in range(999, 0, -1)}
    about = {"target": "n0", "azimuth_deg": 0.0, "range_m": 9.0}
    scenario = scenario_from_dict(
        {"epoch": EPOCH, "spacecraft": {**chain, **crafts}, "camera": {"cam": {"about": about}}}
    )
    poses = scenario.poses(scenario.epoch_tai_ns)
    height = np.linalg.norm(poses["n999"].position) - np.linalg.norm(poses["n0"].position)
    # A sum of a thousand numbers of 7e6 m in float64.
    assert height == pytest.approx(999.0, abs=1e-5)


def test_a_name_as_long_as_no_file_name_may_be_is_refused() -> None:
    name = "n" * 101
    with pytest.raises(ConfigError, match=r"has 101 characters, a name at most 100$"):
        scenario_from_dict({"epoch": EPOCH, "camera": {name: {}}})


def test_very_many_joints_are_refused(tmp_path: Path) -> None:
    write_all(tmp_path)
    joint = CARD[CARD.index("[[joint]]") :]
    joints = "".join(joint.replace('"hinge"', f'"hinge{i}"') for i in range(2000))
    (tmp_path / "card.toml").write_text(CARD.replace(joint, "") + joints)
    text = refusal(tmp_path / "scene.toml")
    assert text.endswith("joint must be a list of length <= 255, got a list of tables")


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("surfaces", [{"radius_mm": 1.0, "gap_mm": 0.0, "index": 1.5}] * 10_000),
        ("field_zones", [{"at": 0.5}] * 10_000),
        ("vignetting_relative", [1.0] * 20_000),
        ("vignetting_angle_deg", [1.0] * 20_000),
    ],
)
def test_very_many_entries_of_a_lens_are_refused(key: str, value: list[Any]) -> None:
    with pytest.raises(
        ConfigError, match=rf"optics.{key} must be .*, got (a list of tables|20000)"
    ):
        scenario_from_dict({"epoch": EPOCH, "camera": {"cam": {"optics": {key: value}}}})


def test_a_long_list_of_names_is_cut_in_an_error() -> None:
    text = did_you_mean("n5x", (f"n{i}" for i in range(100_000)))
    assert len(text) < 1000
    assert text.endswith("and 99900 more)")


def _png_of(width: int, height: int) -> bytes:
    """A whole PNG of zeros, 1 bit each; small, whatever its size."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        return (
            struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
        )

    packer, rows = zlib.compressobj(9), b""
    line = bytes(1 + (width + 7) // 8)
    for _ in range(height):
        rows += packer.compress(line)
    rows += packer.flush()
    head = struct.pack(">IIBBBBB", width, height, 1, 0, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", rows) + chunk(b"IEND", b"")


@pytest.fixture(scope="module")
def bomb() -> bytes:
    """An image of 100,000 x 100,000 pixels in some megabytes: its rows are as promised at first."""
    short = bytearray(_png_of(100_000, 100))
    struct.pack_into(">I", short, 20, 100_000)
    struct.pack_into(">I", short, 29, zlib.crc32(short[12:29]))
    return bytes(short)


@pytest.mark.parametrize("name", ["land.png", "water.png", "night.png", "clouds.png", "psf.png"])
def test_an_image_of_ten_thousand_million_pixels_is_not_decoded(
    name: str, bomb: bytes, tmp_path: Path
) -> None:
    write_all(tmp_path)
    (tmp_path / name).write_bytes(bomb)
    text = refusal(tmp_path / "scene.toml")
    assert str(tmp_path / name) in text
    assert "is damaged" in text or "is neither an image" in text or "pixels" in text


def test_a_texture_of_ten_thousand_million_pixels_is_not_decoded(
    bomb: bytes, tmp_path: Path
) -> None:
    write_all(tmp_path)
    (tmp_path / "skin.png").write_bytes(bomb)
    path = tmp_path / "part.gltf"
    expected = f'{path}: image "skin.png" has more pixels than the 8192 x 8192 that are read'
    assert refusal(path) == expected


def test_pixels_are_counted_before_they_are_decoded() -> None:
    image = png(np.zeros((20, 30)))
    assert decoded_image(image, 600).size == (30, 20)
    with pytest.raises(ValueError, match="has 30 x 20 pixels, at most 599 in all are read"):
        decoded_image(image, 599)


@pytest.mark.parametrize("mode", ["L", "RGB"])
def test_pixels_are_copied_into_channels_of_an_array(mode: str) -> None:
    """Of more rows than are copied at once, and no multiple of these."""
    values = np.random.default_rng(1).integers(0, 256, (41, 30, len(mode)), dtype=np.uint8)
    pixels = np.zeros((41, 30, 4), dtype=np.uint8)
    copy_pixels(Image.fromarray(values.squeeze(), mode), pixels[..., : len(mode)])
    np.testing.assert_array_equal(pixels[..., : len(mode)], values)
    assert not np.any(pixels[..., len(mode) :])


def test_an_image_that_another_program_would_have_to_open_is_none() -> None:
    with pytest.raises(ValueError, match="is not an image that Pillow can read"):
        decoded_image(b"%!PS-Adobe-3.0 EPSF-3.0\n%%BoundingBox: 0 0 10 10\nshowpage\n", 100)


def _npy(values: Any) -> bytes:
    file = io.BytesIO()
    np.save(file, values)
    return file.getvalue()


@pytest.mark.parametrize("order", ["C", "F"])
def test_an_array_comes_back_as_it_was(order: Any) -> None:
    values = np.array(np.arange(24.0).reshape(2, 3, 4), order=order)
    read = array_in(_npy(values))
    np.testing.assert_array_equal(read, values)
    read[0] = 1.0  # one's own to write to


def test_bytes_that_fill_a_file_are_read_without_a_copy() -> None:
    file = io.BytesIO()
    codes, half = np.resize(np.arange(200, dtype=np.uint8), (100, 100)), np.array([0.5])
    np.savez(file, codes=codes, half=half, few=codes[0])
    content = file.getvalue()
    arrays = arrays_in(content)
    for name, values in {"codes": codes, "half": half, "few": codes[0]}.items():
        np.testing.assert_array_equal(arrays[name], values)
    assert np.shares_memory(arrays["codes"], np.frombuffer(content, np.uint8))
    assert not arrays["codes"].flags.writeable
    # A small one does not hold the file in memory.
    assert not np.shares_memory(arrays["few"], np.frombuffer(content, np.uint8))


def test_an_array_that_promises_more_than_there_is_takes_no_memory(tmp_path: Path) -> None:
    huge = _npy(np.zeros((2, 3))).replace(b"(2, 3)", b"(99999999, 99999999)")[:-21] + bytes(48)
    with pytest.raises(ValueError, match=r"^does not hold what its header says"):
        array_in(huge)
    with pytest.raises(ValueError, match=r"does not hold|OBJECT"):
        array_in(_npy(np.array([{}], dtype=object)))
    path = tmp_path / "cache.npz"
    path.write_bytes(gzip.compress(huge))
    assert read_arrays(path) is None


def test_a_packed_file_that_unpacks_to_more_than_memory_is_refused() -> None:
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        for name in ("a.npy", "b.npy"):
            archive.writestr(name, bytes(1000))
    # Both places where the length stands, of each of two files.
    content = file.getvalue().replace(struct.pack("<I", 1000), struct.pack("<I", 0xFFFFFFF0))
    with pytest.raises(ValueError, match="holds arrays of more than 4 GiB"):
        arrays_in(content)


def test_buffers_and_images_of_one_file_are_limited_together(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from simgl.model_files import gltf_file

    monkeypatch.setattr(gltf_file, "_MAX_NAMED_BYTES", 10_000)
    document, data = gltf("part.bin", "skin.png")
    document["buffers"] = 100 * document["buffers"]
    (tmp_path / "part.bin").write_bytes(data)
    path = tmp_path / "a.gltf"
    path.write_text(json.dumps(document))
    assert refusal(path) == f"{path}: names buffers and images of more than 4 GiB"
    assert load_model(str(_glb(tmp_path)))


def _glb(folder: Path) -> Path:
    path = folder / "whole.glb"
    path.write_bytes(glb(*gltf(None, None)))
    return path


def test_more_materials_than_can_be_drawn_are_refused_when_the_file_is_read(
    tmp_path: Path,
) -> None:
    document = triangle()
    document.json["materials"] = [{"name": f"m{i}"} for i in range(64)]
    path = document.write_gltf(tmp_path / "many.gltf")
    assert refusal(path) == f"{path}: holds 64 materials, at most 63 are drawn"
    document.json["materials"].pop()
    assert len(load_model(str(document.write_gltf(tmp_path / "some.gltf"))).materials) == 64
