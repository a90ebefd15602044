"""Levels of detail: near the original, nothing mixed up, found again in files."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from simgl.disk_cache import cache_folder
from simgl.levels import levels as module
from simgl.levels.levels import AREA_SHARE, Levels, levels_of, make_levels
from simgl.levels.measure import projected_areas
from simgl.model_files.model_library import load_model
from simgl.radiosity.remesh import subdivided
from simgl.scene.detail_steps import RUNGS, step_below
from simgl.scene.mesh import Mesh, box, cylinder, sphere


@cache
def cubesat() -> tuple[Mesh, Levels]:
    """A shipped model of five parts."""
    mesh = load_model("cubesat_12u").mesh
    return mesh, make_levels(mesh)


def level(levels: Levels, index: int) -> np.ndarray[tuple[int, ...], np.dtype[np.int64]]:
    """(m, 3) triangles of one level."""
    first, end = levels.starts[index, [0, -1]]
    return levels.triangles[first:end].astype(np.int64)


def test_a_flat_side_needs_few_triangles() -> None:
    levels = make_levels(subdivided(box((2.0, 3.0, 1.0)), 0.15))
    assert levels.counts[0, 0] > 6000
    # Its corners need 12; rounds end before the last vertex of a side is gone.
    assert levels.counts[-1, 0] < 400
    # float32 positions of metres: 1e-7 m
    assert levels.errors[-1, 0] < 1e-6


@pytest.mark.parametrize("radius", [1.0, 4.0])
def test_every_place_of_a_simplified_sphere_is_within_its_stated_error(radius: float) -> None:
    mesh = sphere(radius, 64)
    levels = make_levels(mesh)
    assert len(levels.errors) >= 4
    facets = radius * (1.0 - np.cos(np.pi / 64)) * 2.0  # the original's own, along and across
    rng = np.random.default_rng(5)
    for index in range(1, len(levels.errors)):
        corners = mesh.positions[level(levels, index)].astype(np.float64)
        share = rng.dirichlet((1.0, 1.0, 1.0), (len(corners), 20))
        inside = radius - np.linalg.norm(np.einsum("tsk,tkj->tsj", share, corners), axis=2)
        assert levels.errors[index, 0] in (0.0, *levels.errors[:, 0])
        # Sampled at other places than these: 5 % for what lies between them.
        assert inside.max() <= 1.05 * levels.errors[index, 0] + facets
        assert inside.max() >= 0.5 * levels.errors[index, 0] - facets


def test_levels_get_coarser_and_keep_to_their_steps() -> None:
    _, levels = cubesat()
    counts = levels.counts.sum(axis=1)
    assert np.all(np.diff(counts) < 0)
    assert np.all(levels.errors[0] == 0.0)
    for error in levels.errors[1:].ravel():
        assert error <= RUNGS[-1]


def test_triangles_keep_one_part_and_one_material() -> None:
    mesh, levels = cubesat()
    triangles = levels.triangles
    for labels in (mesh.part, mesh.material):
        assert np.all(labels[triangles] == labels[triangles[:, :1]])


def test_materials_keep_their_areas() -> None:
    """The border of two materials on a plane moves no farther than the error."""
    mesh = subdivided(box((2.0, 2.0, 0.5)), 0.1)
    wavy = 0.1 * np.sin(3.0 * mesh.positions[:, 1])
    corners = mesh.triangles
    painted = (mesh.positions[corners, 0] > wavy[corners]).all(axis=1)
    split = np.arange(3 * len(corners)).reshape(-1, 3).astype(np.uint32)
    label = np.repeat(painted, 3).astype(np.uint32)
    mesh = replace(
        mesh,
        positions=mesh.positions[corners.ravel()],
        normals=mesh.normals[corners.ravel()],
        triangles=split,
        part=np.zeros(len(label), dtype=np.uint32),
        material=label,
    )
    levels = make_levels(mesh)

    def areas(
        triangles: np.ndarray[tuple[int, ...], np.dtype[np.int64]],
    ) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
        a, b, c = np.moveaxis(mesh.positions[triangles].astype(np.float64), 1, 0)
        each = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
        return np.asarray(np.bincount(mesh.material[triangles[:, 0]], each), dtype=np.float64)

    before = areas(level(levels, 0))
    for index in range(1, len(levels.errors)):
        # The border is 5.5 m long with its teeth: about as much as its error times that may change.
        limit = 5.5 * max(levels.errors[index, 0], RUNGS[index - 1])
        np.testing.assert_allclose(areas(level(levels, index)), before, atol=limit)
    assert levels.counts[-1, 0] < 0.3 * levels.counts[0, 0]


def test_a_boom_thinner_than_the_errors_stays_whole() -> None:
    assert make_levels(cylinder(0.005, 3.0, 200)).counts.tolist() == [[800]]


def test_a_tube_keeps_its_width_at_every_level() -> None:
    mesh = cylinder(0.05, 3.0, 200)
    levels = make_levels(mesh)
    shell = np.zeros(len(mesh.triangles), dtype=np.int64)
    positions = mesh.positions.astype(np.float64)
    before = projected_areas(positions, level(levels, 0), shell, 1)
    assert levels.counts[-1, 0] < 0.2 * levels.counts[0, 0]
    for index in range(1, len(levels.errors)):
        triangles = level(levels, index)
        now = projected_areas(positions, triangles, shell[: len(triangles)], 1)
        assert np.abs(now - before).max() <= AREA_SHARE * before.mean()


def test_making_levels_twice_gives_the_same() -> None:
    mesh = sphere(0.5, 48)
    one, two = make_levels(mesh), make_levels(mesh)
    np.testing.assert_array_equal(one.triangles, two.triangles)
    np.testing.assert_array_equal(one.errors, two.errors)


def test_a_choice_takes_for_each_part_the_coarsest_level_within_its_error() -> None:
    levels = Levels(
        triangles=np.zeros((12, 3), dtype=np.uint32),
        starts=np.array([[0, 4, 7], [7, 9, 10], [10, 11, 12]]),
        errors=np.array([[0.0, 0.0], [0.01, 0.02], [0.05, 0.04]]),
    )
    assert levels.chosen((0.0, 0.0)) == (0, 0)
    assert levels.chosen((0.01, 0.03)) == (1, 1)
    assert levels.chosen((0.04, 0.04)) == (1, 2)
    assert levels.ranges((0, 0)) == [(0, 7)]
    assert levels.ranges((0, 1)) == [(0, 4), (9, 1)]
    assert levels.ranges((2, 1)) == [(10, 1), (9, 1)]
    assert levels.error((1, 2)) == 0.04


def test_errors_are_asked_for_in_steps() -> None:
    assert step_below(0.5 * RUNGS[0]) == 0.0
    assert step_below(RUNGS[3]) == RUNGS[3]
    assert step_below(1.9 * RUNGS[3]) == RUNGS[3]


@pytest.fixture
def small(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Mesh:
    """A mesh quickly simplified, with an empty cache."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    return sphere(0.5, 32)


def test_levels_are_found_again(small: Mesh, monkeypatch: pytest.MonkeyPatch) -> None:
    told: list[tuple[int, int]] = []
    first = levels_of(small, lambda *done: told.append(done))
    assert told[0][0] == 0
    assert told[-1][0] == told[-1][1] > 0
    monkeypatch.setattr(module, "make_levels", None)
    again = levels_of(small)
    np.testing.assert_array_equal(again.triangles, first.triangles)
    np.testing.assert_array_equal(again.starts, first.starts)
    np.testing.assert_array_equal(again.errors, first.errors)


@pytest.mark.parametrize("content", [b"", b"not a file of arrays", None, "other"])
def test_a_damaged_file_is_made_anew(small: Mesh, content: bytes | str | None) -> None:
    levels_of(small)
    (path,) = cache_folder("levels").iterdir()
    whole = path.read_bytes()
    if content == "other":
        with path.open("wb") as file:
            corner = np.array([[0, 1, 10**6]], dtype=np.uint32)
            np.savez(file, triangles=corner, starts=np.array([[0, 1]]), errors=np.zeros((1, 1)))
    else:
        assert not isinstance(content, str)
        path.write_bytes(whole[: len(whole) // 2] if content is None else content)
    assert len(levels_of(small).errors) > 1
    assert path.read_bytes() == whole


def test_a_folder_that_cannot_be_written_costs_the_file_only(
    small: Mesh, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    blocked = tmp_path / "file"
    blocked.write_text("in the way")
    monkeypatch.setenv("XDG_CACHE_HOME", str(blocked))
    with pytest.warns(RuntimeWarning, match="Not a directory; levels of detail are made again"):
        assert len(levels_of(small).errors) > 1
