"""The shipped models: closed, sized as stated, and the same bytes wherever they are generated."""

import tomllib
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pygltflib
import pytest
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial.transform import Rotation

from simgl import assets
from simgl.generate.__main__ import GENERATORS, main, write_model
from simgl.generate.debris_rocket_body import DENTS
from simgl.generate.glb import R_FILE_FROM_BODY
from simgl.generate.materials import GREY_STEPS, MATERIALS

Floats = NDArray[np.float64]

MODELS = Path(__file__).parents[2] / "models"
FINISHES = assets.data() / "finishes.toml"
ATV_WINGS = ("upper_right", "lower_right", "lower_left", "upper_left")
NAMES = tuple(GENERATORS)
TARGETS = ("calibration_board", "marker_board", "mirror", "wedge")
JOINTED = tuple(name for name in NAMES if name not in TARGETS)


@dataclass(frozen=True)
class Piece:
    """One node of a committed file in the body frame, its primitives joined.

    corners, normals : (m, 3, 3) of each triangle's corners [m], [-]
    vertices : (m, 3) numbers of the corners, equal where positions are equal
    """

    corners: Floats
    normals: Floats
    vertices: NDArray[np.int64]


@cache
def _file(name: str) -> Any:
    return pygltflib.GLTF2.load_from_bytes((MODELS / name / f"{name}.glb").read_bytes())


def _array(document: Any, accessor: int, dtype: str) -> Any:
    """(n, 3) rows: the vectors of an accessor, or its indices three by three."""
    entry = document.accessors[accessor]
    view = document.bufferViews[entry.bufferView]
    content = document.binary_blob()[view.byteOffset or 0 :][: view.byteLength]
    rows = np.frombuffer(content, dtype).reshape(-1, 3)
    assert entry.count == (rows.size if entry.type == "SCALAR" else len(rows))
    return rows


def _turn(node: Any) -> Rotation:
    return Rotation.from_quat(node.rotation or [0, 0, 0, 1])


def _placed(document: Any) -> dict[str, tuple[Any, Rotation, Floats]]:
    """Node name to the node, its turn and its place in the file's axes, through all above it."""
    found: dict[str, tuple[Any, Rotation, Floats]] = {}

    def visit(number: int, turn: Rotation, place: Floats) -> None:
        node = document.nodes[number]
        place = place + turn.apply(node.translation or [0.0, 0.0, 0.0])
        found[node.name] = node, turn * _turn(node), place
        for child in node.children or []:
            visit(child, *found[node.name][1:])

    for root in document.scenes[0].nodes:
        visit(root, Rotation.identity(), np.zeros(3))
    assert len(found) == len(document.nodes)
    return found


@cache
def pieces(name: str) -> dict[str, Piece]:
    """Part name to geometry, read from the committed file."""
    document = _file(name)
    found = {}
    for node, R_file_from_node, place in _placed(document).values():
        positions, normals = [], []
        for primitive in document.meshes[node.mesh].primitives:
            rows = _array(document, primitive.indices, "<u4")
            positions.append(_array(document, primitive.attributes.POSITION, "<f4")[rows])
            normals.append(_array(document, primitive.attributes.NORMAL, "<f4")[rows])
        local = np.concatenate(positions)
        _, vertices = np.unique(local.reshape(-1, 3), axis=0, return_inverse=True)
        R_body_from_node = R_FILE_FROM_BODY.T @ R_file_from_node.as_matrix()
        offset = R_FILE_FROM_BODY.T @ place
        found[node.name] = Piece(
            corners=local.astype(np.float64) @ R_body_from_node.T + offset,
            normals=np.concatenate(normals).astype(np.float64) @ R_body_from_node.T,
            vertices=vertices.reshape(-1, 3),
        )
    return found


def _record(name: str) -> dict[str, Any]:
    return tomllib.loads((MODELS / name / "model.toml").read_text())


def _all_corners(name: str, *parts: str) -> Floats:
    chosen = parts or tuple(pieces(name))
    return np.concatenate([pieces(name)[part].corners for part in chosen])


def _extent(corners: Floats) -> tuple[Floats, Floats]:
    return corners.min(axis=(0, 1)), corners.max(axis=(0, 1))


def _winding_number(point: Floats, corners: Floats) -> float:
    """How many closed surfaces hold the point: solid angles of all triangles over 4 pi.

    Solid angle of a triangle after Van Oosterom and Strackee (1983).
    """
    a, b, c = np.moveaxis(corners - point, 1, 0)
    la, lb, lc = (np.linalg.norm(v, axis=1) for v in (a, b, c))
    triple = np.einsum("ij,ij->i", a, np.cross(b, c))
    below = la * lb * lc + (a * b).sum(1) * lc + (b * c).sum(1) * la + (c * a).sum(1) * lb
    return float(2.0 * np.arctan2(triple, below).sum() / (4.0 * np.pi))


def _ray_hits(origin: Floats, direction: Floats, corners: Floats) -> Floats:
    """Sorted distances at which a ray meets the triangles (Moller and Trumbore 1997) [m]."""
    a, b, c = np.moveaxis(corners, 1, 0)
    across = np.cross(direction, c - a)
    determinant = np.einsum("ij,ij->i", b - a, across)
    facing = np.abs(determinant) > 1e-15
    a, b, c, across, determinant = (v[facing] for v in (a, b, c, across, determinant))
    u = np.einsum("ij,ij->i", origin - a, across) / determinant
    lifted = np.cross(origin - a, b - a)
    v = lifted @ direction / determinant
    distance = np.einsum("ij,ij->i", c - a, lifted) / determinant
    inside = (u >= 0.0) & (v >= 0.0) & (u + v <= 1.0) & (distance > 0.0)
    return np.asarray(np.sort(distance[inside]))


@pytest.mark.parametrize("name", NAMES)
def test_generating_again_gives_the_committed_files_byte_for_byte(
    name: str, tmp_path: Path
) -> None:
    folder = write_model(name, tmp_path)
    for file in (f"{name}.glb", "model.toml"):
        assert (folder / file).read_bytes() == (MODELS / name / file).read_bytes(), file


def test_an_unknown_name_is_refused_with_the_names_there_are(
    capsys: pytest.CaptureFixture[str],
) -> None:
    with pytest.raises(SystemExit):
        main(["soyuz"])
    assert f"no generator for soyuz; there is {', '.join(NAMES)}" in capsys.readouterr().err


@pytest.mark.parametrize("name", NAMES)
def test_every_edge_is_shared_by_two_triangles_that_run_along_it_opposite_ways(name: str) -> None:
    for part, piece in pieces(name).items():
        v = piece.vertices
        edges = np.concatenate([v[:, [0, 1]], v[:, [1, 2]], v[:, [2, 0]]])
        forward, counts = np.unique(edges, axis=0, return_counts=True)
        backward = np.unique(edges[:, ::-1], axis=0)
        assert (counts == 1).all(), part
        np.testing.assert_array_equal(forward, backward, err_msg=part)


@pytest.mark.parametrize("name", NAMES)
def test_every_connected_surface_encloses_a_positive_volume(name: str) -> None:
    for part, piece in pieces(name).items():
        v = piece.vertices
        links = np.concatenate([v[:, [0, 1]], v[:, [1, 2]]])
        size = int(v.max()) + 1
        graph = coo_array((np.ones(len(links)), tuple(links.T)), shape=(size, size))
        _, labels = connected_components(graph, directed=False)
        a, b, c = np.moveaxis(piece.corners, 1, 0)
        signed = np.einsum("ij,ij->i", a, np.cross(b, c)) / 6.0
        volumes = np.bincount(labels[v[:, 0]], weights=signed)
        # The smallest solids are the CubeSat's brackets, about a cubic centimetre; 1e-8 m3 is
        # far above what float32 positions leave of a flat sheet.
        assert (volumes > 1e-8).all(), part


@pytest.mark.parametrize("name", NAMES)
def test_triangles_have_area_and_normals_that_face_outward(name: str) -> None:
    for part, piece in pieces(name).items():
        c = piece.corners
        faces = np.cross(c[:, 1] - c[:, 0], c[:, 2] - c[:, 0])
        doubled_area = np.linalg.norm(faces, axis=1)
        assert np.isfinite(c).all(), part
        assert (doubled_area > 1e-8).all(), part  # a square tenth of a millimetre
        lengths = np.linalg.norm(piece.normals, axis=2)
        # Components rounded to 1e-6: 1e-6 relative on the length, doubled for float32.
        np.testing.assert_allclose(lengths, 1.0, atol=2e-6, err_msg=part)
        outward = np.einsum("ijk,ik->ij", piece.normals, faces / doubled_area[:, None])
        assert (outward > 0.5).all(), part


@pytest.mark.parametrize(
    ("name", "least", "most"),
    [
        ("cubesat_12u", 1_000, 5_000),
        ("space_rider", 48_000, 55_000),
        ("atv_like", 50_000, 60_000),
        ("iss_like", 70_000, 150_000),
        ("debris_rocket_body", 25_000, 60_000),
        ("servicer", 8_000, 20_000),
        ("calibration_board", 100, 1_000),
        ("marker_board", 5_000, 10_000),
        ("mirror", 100, 1_000),
        ("wedge", 8, 20),
    ],
)
def test_triangle_count_keeps_to_its_budget(name: str, least: int, most: int) -> None:
    triangles = len(_all_corners(name))
    assert least <= triangles <= most
    # 12 bytes of indices a triangle and 24 a vertex; hard edges all over split it three ways.
    # The rest is the table of contents.
    assert (MODELS / name / f"{name}.glb").stat().st_size < 60 * triangles + 20_000


def test_space_rider_has_its_stated_size() -> None:
    low, high = _extent(_all_corners("space_rider"))
    np.testing.assert_allclose([low[0], high[0]], [-3.9, 3.9], atol=1e-6)  # origin midway
    np.testing.assert_allclose([low[1], high[1]], [-5.0, 5.0], atol=1e-6)
    low, high = _extent(_all_corners("space_rider", "body"))
    # Thruster bells reach behind the base and antennas above the top, each by less than 0.1 m.
    np.testing.assert_allclose(high - low, [4.6, 2.2, 1.9], atol=0.1)
    low, high = _extent(_all_corners("space_rider", "service_module"))
    np.testing.assert_allclose((high - low)[1:], [2.3, 2.4], atol=0.05)


def test_cubesat_body_has_its_stated_size() -> None:
    corners = _all_corners("cubesat_12u", "body")
    rails = np.abs(corners[(np.abs(corners[..., 0]) <= 0.1501).all(axis=1)]).max(axis=(0, 1))
    np.testing.assert_allclose(rails[0], 0.15, atol=1e-6)
    low, high = _extent(_all_corners("cubesat_12u"))
    assert high[1] - low[1] == pytest.approx(1.086, abs=1e-5)


def test_cargo_craft_has_its_stated_size() -> None:
    low, high = _extent(_all_corners("atv_like"))
    np.testing.assert_allclose([low[0], high[0]], [-5.1, 5.1], atol=1e-6)  # origin midway
    record = _record("atv_like")
    tips = np.array([record["keypoints"][f"wing_tip_{where}"] for where in ATV_WINGS])
    np.testing.assert_allclose(np.hypot(tips[:, 1], tips[:, 2]), 22.3 / 2.0, atol=1e-5)
    body = _all_corners("atv_like", "cargo_carrier", "propulsion_module")
    blanket = body[np.abs(body[..., 0] - 1.0).max(axis=1) < 0.5]
    # Between the handrails the blanket is the outermost: its radius is 2.24 m.
    radii = np.hypot(blanket[..., 1], blanket[..., 2])
    assert 2.2 < np.median(radii) <= 2.24


def test_station_truss_and_wings_span_100_m() -> None:
    low, high = _extent(_all_corners("iss_like"))
    # The outer blankets' boxes end 50 m less 2 cm from the middle.
    np.testing.assert_allclose([low[1], high[1]], [-50.0, 50.0], atol=0.025)
    low, high = _extent(_all_corners("iss_like", "outer_truss_right"))
    np.testing.assert_allclose([low[0], high[0]], [-37.15, 37.15], atol=1e-5)


def test_station_has_sixteen_thin_blankets() -> None:
    document = _file("iss_like")
    for side in ("left", "right"):
        node = next(node for node in document.nodes if node.name == f"outer_truss_{side}")
        cells = [
            primitive
            for primitive in document.meshes[node.mesh].primitives
            if document.materials[primitive.material].name == "solar_cell"
        ]
        corners = np.concatenate(
            [
                _array(document, p.attributes.POSITION, "<f4")[_array(document, p.indices, "<u4")]
                for p in cells
            ]
        )
        area = 0.5 * np.linalg.norm(
            np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
        )
        # Eight a side of 32.7 x 4.6 m, 92 % of it cells; the folds add under 1 %.
        assert area.sum() == pytest.approx(8 * 32.7 * 4.6 * 0.92, rel=0.01)


def test_rocket_body_has_its_stated_size_and_its_dents() -> None:
    low, high = _extent(_all_corners("debris_rocket_body"))
    np.testing.assert_allclose([low[0], high[0]], [-4.5, 4.5], atol=1e-6)
    for dent in DENTS:
        outward = np.array([0.0, np.sin(dent.azimuth), -np.cos(dent.azimuth)])
        start = np.array([dent.x, 0.0, 0.0]) + 5.0 * outward
        hits = _ray_hits(start, -outward, _all_corners("debris_rocket_body", "tank"))
        # A chord of the 108-sided wall lies up to 0.5 mm inside; 5 mm for the dent's own curvature.
        assert 5.0 - hits[0] == pytest.approx(1.2 - dent.depth, abs=6e-3), dent


def test_grey_steps_wear_finishes_of_the_reflectance_in_their_names() -> None:
    finishes = tomllib.loads(FINISHES.read_text())
    document = _file("calibration_board")
    for percent in GREY_STEPS:
        node = next(node for node in document.nodes if node.name == f"step_{percent:02d}")
        (primitive,) = document.meshes[node.mesh].primitives
        material = document.materials[primitive.material]
        finish = finishes[material.extras["simgl_finish"]]
        assert finish["reflectance"] == percent / 100.0
        assert set(finish) == {"source", "reflectance"}  # no gloss


def test_marker_circles_stand_on_a_grid_and_the_rings_tell_its_corner() -> None:
    keypoints = _record("marker_board")["keypoints"]
    grid = np.array([[keypoints[f"circle_{r}_{c}"] for c in range(7)] for r in range(5)])
    np.testing.assert_allclose(grid[:, 1:, 1] - grid[:, :-1, 1], -0.12, atol=1e-6)
    np.testing.assert_allclose(grid[1:, :, 2] - grid[:-1, :, 2], 0.12, atol=1e-6)
    ahead = np.array([1.0, 0.0, 0.0])
    circles = _all_corners("marker_board", "circles")
    for (row, column), point in np.ndenumerate(grid[..., 0]):
        y, z = grid[row, column, 1:]
        place = np.array([point + 0.5, y + 0.0007, z + 0.0003])
        hit = len(_ray_hits(place, -ahead, circles)) > 0
        assert hit == ((row, column) not in {(0, 0), (0, 2), (4, 0)}), (row, column)


def test_wedge_faces_lean_30_and_60_degrees() -> None:
    corners = _all_corners("wedge")
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    tilt = np.degrees(np.arctan2(normals[:, 0], -normals[:, 2]))[np.abs(normals[:, 1]) < 1e-6]
    # The long face leans forward, the short one backward, the base looks down; float32 corners.
    found = np.unique(np.round(np.abs(tilt), 3) * np.sign(tilt))
    np.testing.assert_allclose(sorted(np.unique(np.round(found % 360.0, 3))), [30.0, 180.0, 300.0])


def test_a_ray_from_above_passes_the_open_bay_and_meets_its_floor_first() -> None:
    floor = np.array(_record("space_rider")["keypoints"]["bay_floor"])
    down = np.array([0.0, 0.0, 1.0])
    # Off the exact centre, where the floor's triangles meet in one vertex.
    start = floor + np.array([0.013, 0.007, -5.0])
    np.testing.assert_allclose(_ray_hits(start, down, _all_corners("space_rider"))[0], 5.0, 1e-5)
    np.testing.assert_allclose(
        _ray_hits(start, down, _all_corners("space_rider", "cargo_bay"))[0], 5.0, 1e-5
    )


def test_no_skin_lies_over_the_bay() -> None:
    mouth = np.array(_record("space_rider")["keypoints"]["bay_mouth"])
    skin = _all_corners("space_rider", "body")
    for x in (-0.58, 0.0, 0.58):
        for y in (-0.48, 0.0, 0.48):
            start = mouth + np.array([x + 0.001, y + 0.002, -1.0])
            first = _ray_hits(start, np.array([0.0, 0.0, 1.0]), skin)[0]
            assert first > 1.8, (x, y)  # the cavity's floor, below the bay's own


def test_the_doors_close_over_the_bay() -> None:
    record = _record("space_rider")
    for joint in record["joint"]:
        if not joint["name"].startswith("bay_door"):
            continue
        angle = np.radians(joint["range_deg"][0])
        swing = Rotation.from_rotvec(angle * np.array(joint["axis_body"]))
        origin = np.array(joint["origin_body_m"])
        corners = pieces("space_rider")[joint["part"]].corners.reshape(-1, 3)
        closed = swing.apply(corners - origin) + origin
        side = np.sign(origin[1])
        assert 0.003 < (side * closed[:, 1]).min() < 0.005, joint["name"]
        # The outer face meets the top of the skin at the centre line.
        assert closed[:, 2].min() == pytest.approx(-1.0, abs=1e-3)


def test_left_is_port_and_right_is_starboard() -> None:
    for name in NAMES:
        for part, piece in pieces(name).items():
            if part.endswith("_left"):
                assert piece.corners[..., 1].max() < 0.0, part
            if part.endswith("_right"):
                assert piece.corners[..., 1].min() > 0.0, part


@pytest.mark.parametrize("name", ["cubesat_12u", "space_rider"])
def test_solar_cells_stand_three_millimetres_above_their_plate(name: str) -> None:
    document = _file(name)
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


@pytest.mark.parametrize("name", NAMES)
def test_accessors_state_the_bounds_of_their_positions(name: str) -> None:
    document = _file(name)
    for mesh in document.meshes:
        for primitive in mesh.primitives:
            accessor = document.accessors[primitive.attributes.POSITION]
            positions = _array(document, primitive.attributes.POSITION, "<f4")
            assert accessor.min == positions.min(axis=0).tolist()
            assert accessor.max == positions.max(axis=0).tolist()


@pytest.mark.parametrize(
    ("name", "point"),
    [
        ("cubesat_12u", "camera_aperture"),
        ("cubesat_12u", "docking_port"),
        ("space_rider", "bay_centre"),
        ("space_rider", "bay_mouth"),
        ("atv_like", "engine_upper_left"),
        ("iss_like", "docking_port_forward"),
        ("debris_rocket_body", "adapter_centre"),
        ("debris_rocket_body", "nozzle_exit"),
        ("servicer", "capture_ring"),
        ("servicer", "grip"),
    ],
)
def test_open_keypoints_lie_outside_every_solid(name: str, point: str) -> None:
    position = np.array(_record(name)["keypoints"][point])
    # A closed surface around the point counts 1, none counts 0.
    assert _winding_number(position, _all_corners(name)) == pytest.approx(0.0, abs=1e-3)


def test_camera_aperture_is_5_mm_ahead_of_all_of_the_camera() -> None:
    aperture = _record("cubesat_12u")["keypoints"]["camera_aperture"]
    foremost = _all_corners("cubesat_12u")[..., 0].max()
    assert aperture[0] - foremost == pytest.approx(0.005, abs=1e-6)


ON_THE_SURFACE = {
    "space_rider": ["nose", "belly", "bay_floor", "flap_tip_left", "flap_tip_right"],
    "atv_like": [
        "docking_probe",
        *(f"docking_rim_{side}" for side in ("top", "bottom", "left", "right")),
        *(f"wing_tip_{where}" for where in ATV_WINGS),
    ],
    "iss_like": [
        "aft_end",
        *(
            f"wing_tip_{number}_{end}_{side}"
            for number in (1, 2)
            for end in ("forward", "aft")
            for side in ("left", "right")
        ),
    ],
    "debris_rocket_body": [
        f"{place}_{side}"
        for place in ("adapter", "skirt")
        for side in ("top", "bottom", "left", "right")
    ],
    "servicer": ["wing_tip_left", "wing_tip_right", "dish_feed"],
    "calibration_board": [f"step_{percent:02d}" for percent in GREY_STEPS],
    "marker_board": [f"circle_{row}_{column}" for row in range(5) for column in range(7)],
    "mirror": ["centre"],
    "wedge": [
        "face_30",
        "face_60",
        "base",
        *(f"{edge}_{side}" for edge in ("toe", "ridge", "heel") for side in ("left", "right")),
    ],
}


@pytest.mark.parametrize(
    ("name", "point"),
    [(name, point) for name, points in ON_THE_SURFACE.items() for point in points],
)
def test_surface_keypoints_lie_on_the_surface(name: str, point: str) -> None:
    position = np.array(_record(name)["keypoints"][point])
    corners = _all_corners(name)
    # 2 mm to all sides: at a surface point some lie inside a solid and some outside.
    steps = 0.002 * np.concatenate([np.eye(3), -np.eye(3)])
    held = [round(_winding_number(position + step, corners)) for step in steps]
    assert min(held) == 0, held
    assert max(held) >= 1, held


@pytest.mark.parametrize("name", JOINTED)
def test_joints_name_parts_whose_node_stands_on_the_hinge(name: str) -> None:
    placed = _placed(_file(name))
    joints = _record(name)["joint"]
    assert joints
    for joint in joints:
        place = placed[joint["part"]][2]
        assert np.linalg.norm(joint["axis_body"]) == pytest.approx(1.0)
        if joint["kind"] == "prismatic":
            assert joint["range_m"][0] <= 0.0 < joint["range_m"][1]
            continue
        on_hinge = R_FILE_FROM_BODY @ joint["origin_body_m"]
        # A micrometre for each node on the way.
        np.testing.assert_allclose(place, on_hinge, atol=5e-6)
        assert joint["range_deg"][0] < 0.0 < joint["range_deg"][1]


@pytest.mark.parametrize("name", NAMES)
def test_the_recorded_axes_are_the_mapping_the_file_was_written_with(name: str) -> None:
    axes = _record(name)["axes"]
    for row, body_axis in enumerate("xyz"):
        sign, file_axis = axes[body_axis]
        expected = np.zeros(3)
        expected["xyz".index(file_axis)] = 1.0 if sign == "+" else -1.0
        np.testing.assert_array_equal(R_FILE_FROM_BODY[:, row], expected)
    assert np.linalg.det(R_FILE_FROM_BODY) == pytest.approx(1.0)


@pytest.mark.parametrize("name", NAMES)
def test_materials_reflect_between_nothing_and_everything(name: str) -> None:
    for material in _file(name).materials:
        surface, stated = material.pbrMetallicRoughness, MATERIALS[material.name]
        numbers = [
            *surface.baseColorFactor,
            surface.metallicFactor,
            surface.roughnessFactor,
            material.extras["nir_reflectance"],
        ]
        assert numbers == [
            *stated.rgb, 1.0, stated.metallic, stated.roughness, stated.nir
        ], material.name  # fmt: skip
        assert all(0.0 <= number <= 1.0 for number in numbers), material.name
        assert material.extras.get("simgl_finish") == stated.finish, material.name


def test_the_parts_of_the_servicer_hang_under_what_carries_them() -> None:
    nodes = _file("servicer").nodes
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
    document = _file(name)
    for joint in _record(name)["joint"]:
        if "sunward_body" not in joint:
            continue
        assert np.dot(joint["sunward_body"], joint["axis_body"]) == pytest.approx(0.0, abs=1e-6)
        node = next(node for node in document.nodes if node.name == joint["part"])
        R_file_from_node = Rotation.from_quat(node.rotation or [0, 0, 0, 1]).as_matrix()
        heights, facing = {}, {}
        for primitive in document.meshes[node.mesh].primitives:
            rows = _array(document, primitive.indices, "<u4")
            corners = _array(document, primitive.attributes.POSITION, "<f4")[rows]
            corners = corners @ R_file_from_node.T @ R_FILE_FROM_BODY
            across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
            material = document.materials[primitive.material].name
            heights[material] = (corners @ joint["sunward_body"]).max()
            facing[material] = np.sum(across @ joint["sunward_body"])
        if "panel_grid" in heights:  # blocks stand proud of the sunward side of their plate
            assert heights["solar_cell"] - heights["panel_grid"] == pytest.approx(0.003, abs=1e-5)
        else:  # sheets: the cells are on one side only
            assert facing["solar_cell"] > 0.0 > facing["kapton"], joint["name"]
