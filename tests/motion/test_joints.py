"""Hinges: which way parts turn, what stays, and drives that find the Sun."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from simgl.arrays import Array, IndexArray
from simgl.model_files.model_library import load_model
from simgl.motion.drives import sun_angle
from simgl.motion.joints import Joint
from simgl.physics.frames import Pose, matrix_from_quaternion, unit
from simgl.rays import RayTracer, ray_tracer
from simgl.scene.mesh import Mesh
from simgl.scene.spacecraft import SpacecraftModel
from simgl.scene.state import BodyState


@pytest.fixture(scope="module")
def rider() -> SpacecraftModel:
    return load_model("space_rider")


def drive(low_deg: float = -180.0, high_deg: float = 180.0) -> Joint:
    """About y, its face along -z as stored."""
    return Joint(
        name="drive",
        parts=(0,),
        axis_body=np.array([0.0, 1.0, 0.0]),
        origin_body=np.zeros(3),
        limits=(np.radians(low_deg), np.radians(high_deg)),
        sunward_body=np.array([0.0, 0.0, -1.0]),
    )


def turned_to(joint: Joint, sun: Array) -> float:
    assert joint.sunward_body is not None
    return sun_angle(joint.axis_body, joint.sunward_body, joint.limits, sun)


def corners(model: SpacecraftModel, part: str) -> Array:
    chosen = model.mesh.part == model.parts.index(part)
    return np.asarray(model.posed_mesh.baked().positions[chosen], dtype=np.float64)


def test_a_part_turns_about_its_hinge_and_nothing_else_moves(rider: SpacecraftModel) -> None:
    """A quarter turn carries the wing's chord over, to float32 of 5 m."""
    joint = next(j for j in rider.joints if j.name == "panel_wing_left")
    posed = rider.posed({"panel_wing_left": np.pi / 2.0})
    before, after = corners(rider, "panel_wing_left"), corners(posed, "panel_wing_left")
    for points in (before, after):
        points -= joint.origin_body
    np.testing.assert_allclose(after[:, 1], before[:, 1], atol=1e-6)
    # A right-handed quarter turn about y takes z to x and x to -z.
    np.testing.assert_allclose(after[:, 0], before[:, 2], atol=1e-6)
    np.testing.assert_allclose(after[:, 2], -before[:, 0], atol=1e-6)
    others = rider.mesh.part != rider.parts.index("panel_wing_left")
    baked = posed.posed_mesh.baked()
    np.testing.assert_array_equal(baked.positions[others], rider.mesh.positions[others])
    lengths = np.linalg.norm(baked.normals, axis=1)
    np.testing.assert_allclose(lengths, np.linalg.norm(rider.mesh.normals, axis=1), atol=1e-6)


def test_positive_angles_open_the_doors_further_and_the_least_closes_them(
    rider: SpacecraftModel,
) -> None:
    """Their free edges meet over the middle of the bay, 4 mm apart on either side."""
    shut = rider.posed({"bay_door_left": np.radians(-110.0), "bay_door_right": np.radians(-110.0)})
    assert -0.005 < corners(shut, "bay_door_left")[:, 1].max() < -0.003
    assert 0.003 < corners(shut, "bay_door_right")[:, 1].min() < 0.005
    wide = rider.posed({"bay_door_left": np.radians(40.0)})
    assert corners(wide, "bay_door_left")[:, 1].max() < corners(rider, "bay_door_left")[:, 1].max()


def test_keypoints_ride_on_their_parts(rider: SpacecraftModel) -> None:
    posed = rider.posed({"body_flap_left": np.radians(15.0)})
    tip, was = posed.keypoints["flap_tip_left"], rider.keypoints["flap_tip_left"]
    # The flap reaches 0.715 m aft of its hinge: down by a quarter of that, nearly.
    assert tip[2] - was[2] == pytest.approx(0.715 * np.radians(15.0), rel=0.06)
    right = "flap_tip_right"
    np.testing.assert_array_equal(posed.keypoints[right], rider.keypoints[right])


def test_equal_angles_are_one_model_and_none_is_the_stored_one(rider: SpacecraftModel) -> None:
    one, other = (rider.posed({"panel_wing_left": 0.3}) for _ in range(2))
    assert one is other
    assert one.posed({}) is rider
    assert one.posed({"panel_wing_left": 0.0}) is rider
    assert one.mesh is rider.mesh
    assert one.posed_mesh.digest != rider.posed_mesh.digest
    with pytest.raises(ValueError, match='did you mean "panel_wing_left"'):
        rider.posed({"panel_wing": 0.1})


def test_a_pose_follows_from_the_stored_places_whatever_pose_came_before(
    rider: SpacecraftModel,
) -> None:
    """And its hull bounds every vertex, to float32 of 5 m."""
    angles = {"panel_wing_left": 0.7, "body_flap_right": -0.1}
    posed = rider.posed({"panel_wing_left": 0.3}).posed(angles).posed_mesh
    assert posed.digest == rider.posed(angles).posed_mesh.digest
    positions = posed.baked().positions.astype(np.float64)
    for axis in np.random.default_rng(2).normal(size=(20, 3)):
        unit_axis = unit(axis)
        ends = (posed.hull @ unit_axis).max(), (positions @ unit_axis).max()
        assert ends[0] == pytest.approx(ends[1], abs=2e-6)
    distance = np.linalg.norm(positions - posed.centre, axis=1)
    assert distance.max() == pytest.approx(posed.radius, abs=2e-6)


def test_a_posed_body_encloses_what_its_baked_mesh_encloses(rider: SpacecraftModel) -> None:
    posed = rider.posed({"panel_wing_left": 0.7, "bay_door_left": -0.5}).posed_mesh
    baked = posed.baked()
    for point in np.random.default_rng(4).uniform(-3.0, 3.0, (40, 3)):
        # Float32 places 1e-7 apart, seen from some centimetres at the nearest.
        expected = baked.winding_number(point)
        assert posed.winding_number(point) == pytest.approx(expected, abs=1e-4)


def test_a_body_encloses_the_points_that_its_surface_winds_around(rider: SpacecraftModel) -> None:
    turn = matrix_from_quaternion(unit([0.3, -0.2, 0.5, 0.8]))
    pose = Pose(position=np.array([7e6, 1.0, 2.0]), velocity=np.zeros(3), R_icrf_from_body=turn)
    body = BodyState(model=rider, pose=pose)
    points = np.random.default_rng(4).uniform(-1.5, 1.5, (60, 3)) * [3.0, 1.0, 1.0]
    inside = [rider.posed_mesh.winding_number(point) > 0.5 for point in points]
    assert 10 < sum(inside) < 50
    assert [body.encloses(pose.position + turn @ point) for point in points] == inside


def test_what_holds_at_a_point_is_not_asked_again_before_a_surface(
    rider: SpacecraftModel, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A walk in steps of 1 cm through the open bay and its floor, there and back."""
    posed = rider.posed({"bay_door_left": 1.0}).posed_mesh
    z = np.linspace(-2.0, 0.5, 251)
    walk = np.stack([np.full_like(z, 0.3), np.full_like(z, 0.1), z], axis=-1)
    expected = [posed.winding_number(point) > 0.5 for point in walk]
    assert 20 < sum(expected) < 230
    sums = 0
    winding_number = Mesh.winding_number

    def counted(mesh: Mesh, point: Array, chosen: IndexArray | None = None) -> float:
        nonlocal sums
        sums += 1
        return winding_number(mesh, point, chosen)

    monkeypatch.setattr(Mesh, "winding_number", counted)
    assert [posed.encloses(point) for point in walk] == expected
    assert [posed.encloses(point) for point in walk[::-1]] == expected[::-1]
    # Towards a surface the distance halves at worst, which takes 8 sums from 2.5 m to 1 cm on each
    # side; every group has its own.
    surfaces = int(np.count_nonzero(np.diff(expected)))
    assert sums <= 2 * (2 * 8 * surfaces + 8) * len(posed.groups)
    assert sums < 0.5 * 2 * len(walk) * len(posed.groups)


def test_rays_meet_a_posed_mesh_where_they_meet_its_baked_one(rider: SpacecraftModel) -> None:
    """Triangles too, but where a ray passes within rounding of an edge."""
    posed = rider.posed({"panel_wing_left": 0.7, "body_flap_right": -0.1}).posed_mesh
    random = np.random.default_rng(7)
    origins = random.uniform(-6.0, 6.0, (20_000, 3))
    directions = random.uniform(-2.0, 2.0, (20_000, 3)) - origins
    triangle, distance = ray_tracer(posed).hits(origins, directions)
    expected, reach = RayTracer(posed.baked()).hits(origins, directions)
    assert np.mean(triangle == expected) > 0.999
    both = (triangle == expected) & (triangle >= 0)
    assert both.sum() > 4000
    # Of some 6 m, float32 rounds 4e-7 each in several sums; grazing rays stretch it.
    np.testing.assert_allclose(distance[both], reach[both], rtol=2e-5, atol=2e-5)
    occluded = ray_tracer(posed).occluded(origins, directions)
    np.testing.assert_array_equal(occluded, triangle >= 0)


directions = st.tuples(*[st.floats(-1.0, 1.0)] * 3).filter(lambda v: np.hypot(v[0], v[2]) > 1e-3)


@settings(deadline=None, database=None, max_examples=100)
@given(directions)
def test_a_free_drive_brings_its_face_as_near_to_the_sun_as_its_axis_allows(
    sun: tuple[float, float, float],
) -> None:
    """What is left is the Sun's angle out of the plane square to the axis."""
    aim = unit(sun)
    angle = turned_to(drive(), aim)
    face = np.array([-np.sin(angle), 0.0, -np.cos(angle)])
    assert np.dot(face, aim) == pytest.approx(np.hypot(aim[0], aim[2]), abs=1e-12)


@pytest.mark.parametrize(("sun_deg", "angle_deg"), [(30.0, 30.0), (100.0, 60.0), (-100.0, -60.0)])
def test_a_drive_stops_at_its_limits(sun_deg: float, angle_deg: float) -> None:
    turned = np.radians(sun_deg)
    sun = np.array([-np.sin(turned), 0.3, -np.cos(turned)])
    assert np.degrees(turned_to(drive(-60.0, 60.0), sun)) == pytest.approx(angle_deg)


def test_coarse_poses_are_multiples_within_the_limits(rider: SpacecraftModel) -> None:
    step = np.radians(5.0)
    posed = rider.posed({"panel_wing_left": np.radians(12.0), "body_flap_left": np.radians(-10.0)})
    coarse = posed.coarsely_posed(step)
    by_name = dict(zip((j.name for j in coarse.joints), np.degrees(coarse.angles), strict=True))
    assert by_name["panel_wing_left"] == pytest.approx(10.0)
    assert by_name["body_flap_left"] == pytest.approx(-10.0)
    assert coarse.coarsely_posed(step) is coarse
    assert rider.coarsely_posed(step) is rider
