"""Bakes in files: found again, mended when damaged, done without when they cannot be kept."""

from __future__ import annotations

import weakref
from pathlib import Path

import numpy as np
import pytest

from simgl.disk_cache import cache_folder
from simgl.radiosity import transport_store
from simgl.radiosity.bake import BakeSettings, bake
from simgl.radiosity.light_transport import LightTransport
from simgl.radiosity.transport_store import MAX_BYTES, TransportStore, transport_of
from simgl.scene.mesh import Mesh
from simgl.scene.spacecraft import SpacecraftModel
from tests.radiosity.shapes import OPEN_BOX, moved, quads

QUICK = BakeSettings(patches=50, patch_rays=32, gather_rays=16, added_triangles=50)


@pytest.fixture(autouse=True)
def _empty_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))


def test_a_bake_is_found_again_bit_for_bit(monkeypatch: pytest.MonkeyPatch) -> None:
    calls: list[tuple[int, int]] = []
    mesh = quads(OPEN_BOX)
    first = transport_of(
        mesh, open_sheets=True, settings=QUICK, progress=lambda *done: calls.append(done)
    )
    assert calls[0][0] == 0
    assert calls[-1][0] == calls[-1][1] > 0
    monkeypatch.setattr(transport_store, "bake", None)
    again = transport_of(mesh, open_sheets=True, settings=QUICK)
    assert first is not None
    assert again is not None
    assert again.mesh.digest == first.mesh.digest
    assert again.sides == 2
    assert (again.gather != first.gather).nnz == 0
    assert (again.form_factors != first.form_factors).nnz == 0
    np.testing.assert_array_equal(again.gather_point_of_vertex, first.gather_point_of_vertex)
    assert (again.sun_gather != first.sun_gather).nnz == 0
    assert again.cells is not None
    assert first.cells is not None
    assert (again.cells.gather != first.cells.gather).nnz == 0
    for name in ("patch", "points", "normals"):
        np.testing.assert_array_equal(getattr(again.cells, name), getattr(first.cells, name))
    assert again.grids is not None
    assert first.grids is not None
    assert (again.grids.gather != first.grids.gather).nnz == 0
    np.testing.assert_array_equal(again.grids.triangles, first.grids.triangles)
    np.testing.assert_array_equal(again.grids.point_of_node, first.grids.point_of_node)
    np.testing.assert_array_equal(again.grids.row_of_node, first.grids.row_of_node)
    assert again.means is not None
    assert first.means is not None
    assert (again.means != first.means).nnz == 0


@pytest.mark.parametrize("content", [b"", b"not a file of arrays", None])
def test_a_damaged_file_is_made_anew(content: bytes | None) -> None:
    mesh = quads(OPEN_BOX)
    transport_of(mesh, open_sheets=True, settings=QUICK)
    (path,) = cache_folder("transport").iterdir()
    complete = path.read_bytes()
    path.write_bytes(complete[: len(complete) // 2] if content is None else content)
    assert transport_of(mesh, open_sheets=True, settings=QUICK) is not None
    assert path.read_bytes() == complete
    assert list(cache_folder("transport").iterdir()) == [path]


@pytest.mark.parametrize(
    ("array", "value"),
    [
        ("gather.indices", 10**6),
        ("form_factors.indices", -1),
        ("sky.indptr", 10**6),
        ("mesh.triangles", 10**6),
        ("patch_of_side", -1),
        ("sky_rays_row", 10**6),
        ("gather_point_of_vertex", 10**6),
        ("sun_gather.indices", 10**6),
        ("cells.gather.indices", 10**6),
        ("cells.patch", 10**6),
        ("grids.gather.indices", 10**6),
        ("grids.point_of_node", -2),
        ("grids.row_of_node", -1),
        ("grids.triangles", 10**6),
        ("means.indices", 10**6),
    ],
)
def test_a_file_whose_indices_point_nowhere_is_made_anew(array: str, value: int) -> None:
    """Sparse products are compiled code, which would read past its arrays."""
    mesh = quads(OPEN_BOX)
    transport_of(mesh, open_sheets=True, settings=QUICK)
    (path,) = cache_folder("transport").iterdir()
    complete = path.read_bytes()
    with np.load(path) as data:
        arrays = dict(data)
    arrays[array].flat[3] = np.array(value).astype(arrays[array].dtype)
    with path.open("wb") as file:
        np.savez(file, **arrays)
    assert transport_of(mesh, open_sheets=True, settings=QUICK) is not None
    assert path.read_bytes() == complete


@pytest.mark.parametrize("names", [("sky_rays",), ("sky_rays_row", "stranger")])
def test_a_file_of_other_arrays_is_made_anew(names: tuple[str, ...]) -> None:
    mesh = quads(OPEN_BOX)
    transport_of(mesh, open_sheets=True, settings=QUICK)
    (path,) = cache_folder("transport").iterdir()
    complete = path.read_bytes()
    with np.load(path) as data:
        arrays = dict(data)
    first = arrays.pop(names[0], arrays.pop(f"{names[0]}.data", None))
    assert first is not None
    arrays |= dict.fromkeys(names[1:], first)
    with path.open("wb") as file:
        np.savez(file, **arrays)
    assert transport_of(mesh, open_sheets=True, settings=QUICK) is not None
    assert path.read_bytes() == complete


def test_a_folder_that_cannot_be_written_costs_the_file_only(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    blocked = tmp_path / "file"
    blocked.write_text("in the way")
    monkeypatch.setenv("XDG_CACHE_HOME", str(blocked))
    assert transport_of(quads(OPEN_BOX), open_sheets=True, settings=QUICK) is not None
    assert "Not a directory; light between surfaces is traced" in caplog.text


def test_other_settings_are_another_file() -> None:
    mesh = quads(OPEN_BOX)
    transport_of(mesh, open_sheets=True, settings=QUICK)
    transport_of(mesh, open_sheets=False, settings=QUICK)
    assert len(list(cache_folder("transport").iterdir())) == 2


def test_what_has_to_be_traced_is_known_before(monkeypatch: pytest.MonkeyPatch) -> None:
    def quick(mesh: Mesh, *, open_sheets: bool, **_: object) -> LightTransport | None:
        return bake(mesh, open_sheets=open_sheets, settings=QUICK)

    monkeypatch.setattr(transport_store, "bake", quick)
    box = SpacecraftModel(name="box", mesh=quads(OPEN_BOX), parts=("box",), materials=())
    store = TransportStore()
    assert store.to_trace([box], "exact")
    store.prepare([box], "exact")
    assert not TransportStore().to_trace([box], "exact")


def test_of_the_many_shapes_of_an_arm_on_the_move_the_last_ones_are_kept(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    traced: list[str] = []

    class Traced:
        """Stands for a transport."""

        nbytes = MAX_BYTES // 4

    def trace(mesh: Mesh, **_: object) -> Traced:
        traced.append(mesh.digest)
        return Traced()

    monkeypatch.setattr(transport_store, "transport_of", trace)
    box = quads(OPEN_BOX)
    poses = [
        SpacecraftModel(name="arm", mesh=moved(box, (0.0, 0.0, z)), parts=("arm",), materials=())
        for z in np.linspace(1.0, 2.0, 5).tolist()
    ]
    transports = TransportStore()
    first = weakref.ref(transports.of(poses[0]))
    for pose in 2 * poses[1:]:
        transports.of(pose)
    assert traced == [pose.mesh.digest for pose in poses]
    assert first() is None
