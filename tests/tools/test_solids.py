"""The shipped models are closed solids of a sensible number of triangles."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from tests.tools.shipped import MODELS, NAMES, all_corners, pieces


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
    triangles = len(all_corners(name))
    assert least <= triangles <= most
    # 12 bytes of indices a triangle and 24 a vertex; hard edges all over split it three ways.
    # The rest is the table of contents.
    assert (MODELS / name / f"{name}.glb").stat().st_size < 60 * triangles + 20_000
