"""Light between parts that joints move, from what rigid groups do to each other in pairs."""

from __future__ import annotations

from dataclasses import fields, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy import sparse

from simgl.arrays import Array32, Mask
from simgl.disk_cache import cache_folder
from simgl.motion.joints import Joint, body_from_stored
from simgl.radiosity import jointed_transport, rigid_pairs, transport_store
from simgl.radiosity.bake import BakeSettings, bake
from simgl.radiosity.gather_points import face_normals
from simgl.radiosity.jointed_bake import bake_jointed
from simgl.radiosity.jointed_transport import JointedTransport
from simgl.radiosity.light_transport import LightTransport
from simgl.radiosity.next_poses import NextPoses
from simgl.radiosity.patch_light import PatchLight
from simgl.radiosity.posed_transport import PosedTransport
from simgl.radiosity.solver import earth_share, vertex_irradiance
from simgl.radiosity.transport_store import TransportStore, jointed_transport_of
from simgl.scene.materials import Material
from simgl.scene.mesh import Mesh, box
from simgl.scene.posed_mesh import PosedMesh
from simgl.scene.spacecraft import SpacecraftModel
from tests.radiosity.shapes import joined, moved

SETTINGS = BakeSettings(patches=600, patch_rays=192, gather_rays=128, added_triangles=600)
THIN = 0.01


def slab(size: float, centre: tuple[float, float, float], part: int) -> Mesh:
    """A square plate, its large faces up and down [m]."""
    mesh = moved(box((size, size, THIN)), centre)
    return replace(mesh, part=np.full_like(mesh.part, part))


def rail(part: int, axis: tuple[float, float, float], parent: int | None = None) -> Joint:
    return Joint(
        name=f"rail_{part}",
        parts=(part,),
        axis_body=np.array(axis),
        origin_body=np.zeros(3),
        limits=(-20.0, 20.0),
        parent=parent,
        slides=True,
    )


# A floor; a shutter that slides in above it; and 0.5 m above the floor a ceiling on a rail.
ROOM = joined(
    slab(1.0, (0.0, 0.0, -0.5 * THIN), 0),
    slab(2.0, (6.0, 0.0, 0.25), 1),
    slab(1.0, (0.0, 0.0, 0.5 + 0.5 * THIN), 2),
)
ROOM_JOINTS = (rail(1, (-1.0, 0.0, 0.0)), rail(2, (0.0, 0.0, 1.0)))
# Two parallel unit squares at 0.5 m (Howell, A Catalog of Radiation Heat Transfer Configuration
# Factors, C-11).
FLOOR_TO_CEILING = 0.41525


@lru_cache(maxsize=1)
def room() -> JointedTransport:
    return bake_jointed(ROOM, ROOM_JOINTS, open_sheets=False, settings=SETTINGS)


def room_model() -> SpacecraftModel:
    """The same as a model."""
    return SpacecraftModel(
        name="room",
        mesh=ROOM,
        parts=("floor", "shutter", "ceiling"),
        materials=(Material(name="grey", reflectance=(0.5,) * 4),),
        joints=ROOM_JOINTS,
    )


def posed(transport: JointedTransport, mesh: Mesh, *values: float) -> PosedTransport:
    pose = PosedMesh(
        mesh=mesh, joints=transport.joints, motion=body_from_stored(transport.joints, values)
    )
    return transport.at(pose, values)


def exchange(transport: LightTransport, source: Mask, target: Mask) -> float:
    """Share of the light of some patches that arrives at others."""
    factors = transport.form_factors[np.flatnonzero(source)][:, np.flatnonzero(target)]
    areas = transport.areas[source]
    return float(areas @ np.asarray(factors.sum(axis=1)).ravel() / areas.sum())


def facing(transport: JointedTransport, group: int, z: float) -> Mask:
    """Patches of a group that face up (z = 1) or down (-1)."""
    up = transport.separate.normals[:, 0, 2] * z > 0.99
    return (transport.group_of_patch == group) & up


def vertex_light(transport: LightTransport, exitance: Array32) -> Array32:
    """(v, 4) irradiance of the vertices [W m-2]."""
    matrix = transport.of_vertices
    return vertex_irradiance(matrix, exitance).reshape(*matrix.shape, 4)[:, 0]


def mean_over(mesh: Mesh, chosen: Mask, values: Array32) -> float:
    """Mean over the surface of some triangles of what their vertices have."""
    areas = face_normals(mesh)[1] * chosen
    return float(areas @ values[mesh.triangles].mean(axis=1) / areas.sum())


def test_two_parts_exchange_what_the_closed_form_says() -> None:
    transport = room()
    away = posed(transport, ROOM, -10.0, 0.0)
    floor, ceiling = facing(transport, 0, 1.0), facing(transport, 2, -1.0)
    # 200 patches and more of 192 rays each: 40,000 rays, evenly spread, know it to 0.5 %.
    assert exchange(away, floor, ceiling) == pytest.approx(FLOOR_TO_CEILING, rel=0.01)
    assert exchange(away, ceiling, floor) == pytest.approx(FLOOR_TO_CEILING, rel=0.01)


def test_a_part_that_slides_between_two_others_takes_all_light_that_they_exchange() -> None:
    transport = room()
    floor, ceiling = facing(transport, 0, 1.0), facing(transport, 2, -1.0)
    shut = posed(transport, ROOM, 6.0, 0.0)
    assert exchange(shut, floor, ceiling) == exchange(shut, ceiling, floor) == 0.0
    # Half of the way: the shutter's edge stands above the middle of the floor.
    half = posed(transport, ROOM, 5.0, 0.0)
    baked = bake(PosedMesh(mesh=ROOM, joints=ROOM_JOINTS, motion=body_from_stored(
        ROOM_JOINTS, (5.0, 0.0))).baked(), open_sheets=False, settings=SETTINGS)  # fmt: skip
    assert baked is not None
    up, z = baked.normals[:, 0, 2], baked.points[:, 0, 2]
    expected = exchange(baked, (up > 0.99) & (np.abs(z) < 0.01), (up < -0.99) & (z > 0.4))
    assert exchange(half, floor, ceiling) == pytest.approx(expected, abs=0.01)
    assert 0.1 < expected < 0.3


def test_vertices_get_what_other_parts_add_and_lose_the_sky_that_these_hide() -> None:
    transport = room()
    mesh = transport.separate.mesh
    normals, _ = face_normals(mesh)
    top = (mesh.part[mesh.triangles[:, 0]] == 0) & (normals[:, 2] > 0.99)
    open_, shut = posed(transport, ROOM, -10.0, 0.0), posed(transport, ROOM, 6.0, 0.0)
    glowing = np.zeros((len(transport.separate.areas), 4), dtype=np.float32)
    glowing[facing(transport, 2, -1.0)] = 1.0
    light = mean_over(mesh, top, vertex_light(open_, glowing)[:, 0])
    # Linear between vertices, it is 2 % more than a mean over the floor.
    assert light == pytest.approx(FLOOR_TO_CEILING, rel=0.03)
    assert mean_over(mesh, top, vertex_light(shut, glowing)[:, 0]) < 1e-4
    sky = np.ones((open_.sky.shape[1], 4), dtype=np.float32)
    seen = mean_over(mesh, top, earth_share(open_.of_vertices, sky)[:, 0])
    assert seen == pytest.approx(1.0 - FLOOR_TO_CEILING, rel=0.03)


def test_a_pose_gives_the_same_bytes_whatever_poses_came_before() -> None:
    poses = [(5.0, 0.0), (5.0, 0.2), (5.4, 0.2)]
    first, second = replace(room()), replace(room())
    there = [posed(first, ROOM, *pose) for pose in poses]
    back = [posed(second, ROOM, *pose) for pose in reversed(poses)][::-1]
    for one, other in zip(there, back, strict=True):
        assert one.digest == other.digest
        assert np.array_equal(one.points, other.points)
        for a, b in ((one, other), (one.between, other.between)):
            for f in fields(a):
                matrix = getattr(a, f.name)
                if isinstance(matrix, sparse.csc_matrix):
                    assert same(matrix, getattr(b, f.name)), f.name


def same(a: sparse.csc_matrix, b: sparse.csc_matrix) -> bool:
    """Whether two matrices are stored by the same bytes."""
    return all(
        getattr(a, name).tobytes() == getattr(b, name).tobytes()
        for name in ("data", "indices", "indptr")
    )


@pytest.fixture
def traced(monkeypatch: pytest.MonkeyPatch) -> list[object]:
    """The pairs of parts whose rays are traced from here on."""
    traced: list[object] = []

    def counted(*args: Any) -> rigid_pairs.Ends:
        traced.append(args)
        return rigid_pairs.ends(*args)

    monkeypatch.setattr(jointed_transport, "ends", counted)
    return traced


@pytest.fixture
def _baked(monkeypatch: pytest.MonkeyPatch) -> None:
    """The room is baked, with room for the pairs of one test alone."""
    prepared = replace(room())
    monkeypatch.setattr(transport_store, "transport_of", lambda *_, **__: None)
    monkeypatch.setattr(transport_store, "jointed_transport_of", lambda *_, **__: prepared)


def test_only_pairs_on_two_sides_of_a_joint_that_moved_are_traced(traced: list[object]) -> None:
    # The shutter on a rail of the ceiling.
    joints = replace(ROOM_JOINTS[0], parent=1), ROOM_JOINTS[1]
    transport = replace(room(), joints=joints)
    posed(transport, ROOM, 5.0, 0.0)
    assert len(traced) == 6
    # Ceiling and shutter go together: each with the floor, both ways.
    posed(transport, ROOM, 5.0, 0.1)
    assert len(traced) == 6 + 4
    # The shutter with each of the others; then nothing is new.
    posed(transport, ROOM, 5.5, 0.1)
    posed(transport, ROOM, 5.0, 0.0)
    assert len(traced) == 6 + 4 + 4


@pytest.mark.usefixtures("_baked")
def test_no_frame_waits_for_a_bake_of_parts_that_begin_to_move(
    monkeypatch: pytest.MonkeyPatch, traced: list[object]
) -> None:
    """All stand as stored at the start, when time may be spent; in the loop only pairs are new."""
    model = room_model()
    transports = TransportStore()
    transports.prepare([model], "quick")
    assert len(traced) == 6
    monkeypatch.setattr(transport_store, "jointed_transport_of", None)
    assert transports.of(model.posed({"rail_2": 0.1}), "quick") is not None
    # The ceiling with each of the others, both ways.
    assert len(traced) == 6 + 4


@pytest.mark.usefixtures("_baked")
def test_a_joint_on_the_move_finds_its_next_pose_made(traced: list[object]) -> None:
    """A shutter that slides by a tenth of a step in each frame, over eight steps."""
    model = room_model()
    size = model.step_sizes(transport_store.STEPS["quick"])[0]
    transports, light = TransportStore(), PatchLight()
    ahead = NextPoses(transports, light)
    in_frame, asked = [], []
    for frame in range(80):
        # At every tenth frame it stands at a step, but for rounding.
        steps = 20.0 + 0.1 * frame * (1.0 + 1e-12 * (-1) ** frame)
        place = model.posed({"rail_1": steps * size})
        before = len(traced)
        assert transports.of(place, "quick") is not None
        asked.append(len(traced) - before)
        ahead.make_ahead(0, place)
        in_frame.append(len(traced) - before)
    # All six pairs at first. Then those of the shutter, four, one at a time.
    assert asked[0] == 6
    assert sum(asked[1:10]) <= 4
    assert not any(asked[10:])
    assert max(in_frame[10:]) == 1
    # The last step that is reached is made, and a part of the one after it.
    assert 6 + 4 * 8 <= len(traced) <= 6 + 4 * 9


def test_a_pose_of_turned_parts_agrees_with_a_bake_of_that_pose() -> None:
    """A flap on a hinge at the floor's edge, at angles that no bake has seen."""
    flap = slab(1.0, (1.0, 0.0, -0.5 * THIN), 1)
    mesh = joined(slab(1.0, (0.0, 0.0, -0.5 * THIN), 0), flap)
    hinge = Joint(
        name="hinge",
        parts=(1,),
        axis_body=np.array([0.0, -1.0, 0.0]),
        origin_body=np.array([0.5, 0.0, 0.0]),
        limits=(0.0, np.pi),
    )
    transport = bake_jointed(mesh, (hinge,), open_sheets=False, settings=SETTINGS)
    floor, of_flap = facing(transport, 0, 1.0), facing(transport, 1, 1.0)
    for angle in np.radians([40.0, 90.0, 130.0]).tolist():
        # Unit squares with a common edge, by Lambert's formula for the one, over the other.
        expected = hinged_squares(np.pi - angle)
        pose = posed(transport, mesh, angle)
        # A ray of 192 is 0.5 %; 100 patches, most of them near the hinge.
        assert exchange(pose, floor, of_flap) == pytest.approx(expected, rel=0.03, abs=0.002)
        assert exchange(pose, of_flap, floor) == pytest.approx(expected, rel=0.03, abs=0.002)


def hinged_squares(angle: float) -> float:
    """Form factor between unit squares that share an edge and enclose an angle [rad]."""
    t = (np.arange(64) + 0.5) / 64
    x, y = (v.ravel() for v in np.meshgrid(t, t))
    points = np.stack([x, y, np.zeros_like(x)], axis=1)
    c, s = np.cos(angle), np.sin(angle)
    corners = np.array([[0, 0, 0], [0, 1, 0], [c, 1, s], [c, 0, s]])
    total = np.zeros(len(points))
    for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        u, v = a - points, b - points
        cross = np.cross(u, v)
        size = np.linalg.norm(cross, axis=1)
        turn = np.arctan2(size, np.einsum("ij,ij->i", u, v))
        total += turn * cross[:, 2] / np.maximum(size, 1e-30)
    return float(np.abs(total).mean() / (2.0 * np.pi))


def test_the_file_of_a_bake_gives_the_same_poses_and_a_damaged_one_is_replaced(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    settings = BakeSettings(patches=60, patch_rays=32, gather_rays=32, added_triangles=0)
    made, read = (
        jointed_transport_of(ROOM, ROOM_JOINTS, open_sheets=False, settings=settings)
        for _ in range(2)
    )
    assert made is not read
    (path,) = cache_folder("transport").iterdir()
    a, b = (posed(transport, ROOM, 5.0, 0.1) for transport in (made, read))
    assert same(a.form_factors, b.form_factors)
    with np.load(path) as data:
        arrays = dict(data)
    arrays["jointed.target"] = np.full_like(arrays["jointed.target"], 60_000)
    np.savez(path, **arrays)
    again = jointed_transport_of(ROOM, ROOM_JOINTS, open_sheets=False, settings=settings)
    assert same(posed(again, ROOM, 5.0, 0.1).form_factors, a.form_factors)
