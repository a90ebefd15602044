"""Joints on joints: places follow the product of the motions below them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from simgl.arrays import Array
from simgl.motion.joints import Joint, body_from_stored, motion_between
from simgl.physics.frames import unit
from simgl.scene.materials import Material
from simgl.scene.mesh import Mesh, box
from simgl.scene.spacecraft import SpacecraftModel

# Double precision over a few products of lengths of metres.
EXACT = 1e-12


def joint(name: str, axis: Array, origin: Array, parent: int | None, part: int) -> Joint:
    return Joint(
        name=name,
        parts=(part,),
        axis_body=unit(axis),
        origin_body=np.asarray(origin, dtype=np.float64),
        limits=(-10.0, 10.0),
        keypoints=(f"{name}_tip",),
        parent=parent,
    )


SHOULDER = joint("shoulder", np.array([0.0, 0.0, 1.0]), np.array([0.3, 0.0, 0.1]), None, 1)
ELBOW = joint("elbow", np.array([0.0, 1.0, 1.0]), np.array([1.2, 0.1, 0.1]), 0, 2)
WRIST = joint("wrist", np.array([1.0, 0.2, 0.0]), np.array([2.0, 0.1, -0.1]), 1, 3)
ARM = (SHOULDER, ELBOW, WRIST)
RAIL = replace(ELBOW, name="rail", slides=True, keypoints=("elbow_tip",))

angles = st.floats(-np.pi, np.pi)
places = st.tuples(*[st.floats(-3.0, 3.0)] * 3).map(np.array)


def applied(matrix: Array, place: Array) -> Array:
    return matrix[:3, :3] @ place + matrix[:3, 3]


def hinged(hinge: Joint, angle: float, place: Array) -> Array:
    """A place turned about one hinge line."""
    turn = Rotation.from_rotvec(angle * hinge.axis_body)
    return turn.apply(place - hinge.origin_body) + hinge.origin_body


@settings(deadline=None, database=None, max_examples=100)
@given(angles, angles, places)
def test_what_two_hinges_carry_turns_about_the_second_then_about_the_first(
    first: float, second: float, place: Array
) -> None:
    """With lines as stored: about the elbow while the shoulder still rests, then about that."""
    moved = body_from_stored((SHOULDER, ELBOW), (first, second))
    once = hinged(SHOULDER, first, place)
    np.testing.assert_allclose(applied(moved[1], place), once, atol=EXACT)
    twice = hinged(SHOULDER, first, hinged(ELBOW, second, place))
    np.testing.assert_allclose(applied(moved[2], place), twice, atol=EXACT)


@settings(deadline=None, database=None, max_examples=50)
@given(angles, angles, places)
def test_the_second_hinge_line_goes_along_with_the_first(
    first: float, second: float, place: Array
) -> None:
    """The same place by the other road: first to where the shoulder puts it, then about the elbow
    where that is now."""
    moved = body_from_stored((SHOULDER, ELBOW), (first, second))
    now = replace(
        ELBOW,
        axis_body=Rotation.from_rotvec(first * SHOULDER.axis_body).apply(ELBOW.axis_body),
        origin_body=hinged(SHOULDER, first, ELBOW.origin_body),
    )
    twice = hinged(now, second, hinged(SHOULDER, first, place))
    np.testing.assert_allclose(applied(moved[2], place), twice, atol=EXACT)


@settings(deadline=None, database=None, max_examples=50)
@given(angles, st.floats(-2.0, 2.0), places)
def test_a_rail_on_a_hinge_slides_along_its_turned_axis(
    angle: float, travel: float, place: Array
) -> None:
    moved = body_from_stored((SHOULDER, RAIL), (angle, travel))
    along = Rotation.from_rotvec(angle * SHOULDER.axis_body).apply(RAIL.axis_body)
    expected = hinged(SHOULDER, angle, place) + travel * along
    np.testing.assert_allclose(applied(moved[2], place), expected, atol=EXACT)


def test_a_hinge_on_a_rail_takes_its_line_along() -> None:
    carrier = replace(RAIL, parent=None)
    hinge = replace(SHOULDER, parent=0)
    place = np.array([0.5, -0.4, 0.7])
    moved = body_from_stored((carrier, hinge), (0.8, 1.1))
    expected = hinged(SHOULDER, 1.1, place) + 0.8 * RAIL.axis_body
    np.testing.assert_allclose(applied(moved[2], place), expected, atol=EXACT)


def test_the_order_in_which_joints_are_listed_means_nothing() -> None:
    values = (0.4, -1.1, 0.7)
    backward = (replace(WRIST, parent=1), replace(ELBOW, parent=2), SHOULDER)
    forward = body_from_stored(ARM, values)
    np.testing.assert_array_equal(body_from_stored(backward, values[::-1])[1:][::-1], forward[1:])


def arm() -> SpacecraftModel:
    """Four boxes of the same shape in a row: a foot and what the three joints move."""
    one = box((0.8, 0.2, 0.2))
    count = len(one.positions)
    shift = np.repeat(np.array([[1.0 * k, 0.0, 0.0] for k in range(4)]), count, axis=0)
    mesh = Mesh(
        positions=(np.tile(one.positions, (4, 1)) + shift).astype(np.float32),
        normals=np.tile(one.normals, (4, 1)),
        triangles=np.concatenate([one.triangles + np.uint32(k * count) for k in range(4)]),
        part=np.repeat(np.arange(4, dtype=np.uint32), count),
        material=np.zeros(4 * count, dtype=np.uint32),
    )
    return SpacecraftModel(
        name="arm",
        mesh=mesh,
        parts=("foot", "upper", "lower", "hand"),
        materials=(Material(name="grey", reflectance=(0.5, 0.5, 0.5, 0.5)),),
        keypoints={f"{j.name}_tip": np.array([1.0 + k, 0.1, 0.0]) for k, j in enumerate(ARM)},
        joints=ARM,
    )


def test_vertices_normals_and_keypoints_go_with_their_part() -> None:
    """To float32 of 4 m."""
    model = arm()
    values = {"shoulder": 0.5, "elbow": -0.9, "wrist": 2.0}
    baked = model.posed(values).posed_mesh.baked()
    turns = [Rotation.from_rotvec(values[j.name] * j.axis_body) for j in ARM]
    for part, held in enumerate([(), ARM[:1], ARM[:2], ARM]):
        own = model.mesh.part == part
        expected = model.mesh.positions[own].astype(np.float64)
        normals = model.mesh.normals[own].astype(np.float64)
        for k, hinge in reversed(list(enumerate(held))):
            expected = hinged(hinge, values[hinge.name], expected)
            normals = turns[k].apply(normals)
        np.testing.assert_allclose(baked.positions[own], expected, atol=4e-7)
        np.testing.assert_allclose(baked.normals[own], normals, atol=1.2e-7)
    tip = model.keypoints["wrist_tip"]
    for hinge in reversed(ARM):
        tip = hinged(hinge, values[hinge.name], tip)
    posed = model.posed(values)
    np.testing.assert_allclose(posed.keypoints["wrist_tip"], tip, atol=EXACT)


def test_a_joint_moves_what_it_carries_though_that_one_rests() -> None:
    model = arm()
    posed = model.posed({"elbow": 0.4})
    moved = np.any(posed.posed_mesh.baked().positions != model.mesh.positions, axis=1)
    assert set(model.mesh.part[moved].tolist()) == {2, 3}
    assert posed.mesh is model.mesh
    assert [group.index for group in posed.posed_mesh.groups] == [0, 1, 2, 3]
    np.testing.assert_array_equal(posed.keypoints["shoulder_tip"], model.keypoints["shoulder_tip"])


def test_the_motion_between_two_poses_leads_from_one_mesh_to_the_other() -> None:
    model = arm()
    values = {"shoulder": np.radians(12.0), "elbow": np.radians(-33.0)}
    posed = model.posed(values)
    coarse = posed.coarsely_posed(np.radians(5.0))
    np.testing.assert_allclose(np.degrees(coarse.angles), [10.0, -35.0, 0.0], atol=1e-9)
    motion = motion_between(ARM, coarse.angles, posed.angles)
    moved = posed.posed_mesh.moved_from(coarse.posed_mesh, coarse.posed_mesh.baked())
    np.testing.assert_array_equal(moved.motion, motion)
    expected = posed.posed_mesh.baked().positions
    np.testing.assert_allclose(moved.baked().positions, expected, atol=1e-6)
    rest = motion_between(ARM, coarse.angles, coarse.angles)
    np.testing.assert_array_equal(rest, np.tile(np.eye(4), (4, 1, 1)))


def test_rails_step_by_what_the_step_of_a_hinge_moves_the_rim_of_their_largest_part() -> None:
    """The lower arm's half diagonal of 0.424 m, 5 deg of which are 37 mm."""
    model = replace(arm(), joints=(SHOULDER, RAIL))
    step = np.radians(5.0)
    own = step * np.sqrt(0.4**2 + 0.1**2 + 0.1**2)
    coarse = model.posed({"rail": 3.3 * own}).coarsely_posed(step)
    assert coarse.angles[1] == pytest.approx(3.0 * own, rel=1e-6)
