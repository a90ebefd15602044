"""Light from one spacecraft to another: two boxes with closed forms."""

from __future__ import annotations

import moderngl
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from simgl.arrays import Array
from simgl.radiosity.between_spacecraft import (
    FINE_STEP,
    STEP,
    PosedPath,
    clusters_of,
    light_path,
)
from simgl.radiosity.convex_transport import convex_transport
from simgl.radiosity.near_body import NearBody, standing_rows
from simgl.radiosity.pose_steps import in_steps, without_noise
from simgl.radiosity.reflection_laws import reflection_laws
from simgl.scene.spacecraft import SpacecraftModel
from simgl.view.near_spacecraft import near_groups
from tests.radiosity.near_spacecraft import (
    BESIDE,
    BOX,
    WHITE,
    box_behind_bay,
    from_other_surfaces,
    large_and_small,
    near,
    square_seen,
    two_boxes,
)
from tests.scenes import IN_BANDS, Table, lambert

# The light of the one that shines onto the other's face, away from the Sun.
SUN = (-0.8, 0.0, 0.6)


def near_body(model: SpacecraftModel) -> NearBody:
    transport = convex_transport(model)
    laws = reflection_laws(model.materials)
    standing = standing_rows(transport)
    return NearBody(model=model, transport=transport, laws=laws, standing=standing)


def boxes(gap: float) -> tuple[NearBody, NearBody, Array]:
    """Two boxes, and the pose of the second in the axes of the first, inverted."""
    state = (scenario := two_boxes(gap, SUN)).at(scenario.epoch_tai_ns)
    first, second = (near_body(body.model) for body in state.bodies.values())
    matrix = np.eye(4)
    matrix[0, 3] = -(1.0 + gap)
    return first, second, matrix


def facing_square(y: float, z: float, gap: float) -> float:
    """Share of a hemisphere that the other box's face fills: four rectangles about the place across
    the gap; with signs where it stands outside."""
    signs = (-1, 1)
    return sum(square_seen((0.5 + i * y) / gap, (0.5 + j * z) / gap) for i in signs for j in signs)


def upright_seen(apart: float, height: float, along: float) -> float:
    """Share of a hemisphere, weighted by the cosine, of a rectangle that stands on the plane of the
    place, its lower corner so far before it [m]."""
    slant = np.hypot(apart, height)
    angles = np.arctan(along / apart) - apart / slant * np.arctan(along / slant)
    return float(angles / (2.0 * np.pi))


def shares_seen(
    receiver: NearBody, sender: NearBody, pose: Array, seen_at: Array | None = None
) -> Array:
    """(s,) of the hemispheres of a receiver's places that the sender fills.

    seen_at : the pose at which it is known what is seen from where
    """
    path = light_path(receiver, sender, pose if seen_at is None else seen_at)
    posed = PosedPath(path=path, sender_from_receiver=pose)
    return np.asarray(posed.to_places.sum(axis=1)).ravel()


def test_a_square_before_another_fills_the_share_of_its_hemisphere() -> None:
    first, second, second_from_first = boxes(2.0)
    shares = shares_seen(first, second, second_from_first)
    places, normals, _ = first.places
    facing = normals[:, 0] > 0.9
    np.testing.assert_array_equal(shares[normals[:, 0] < 0.1], 0.0)
    for (_, y, z), share in zip(places[facing], shares[facing], strict=True):
        # Discs of a quarter of their distance.
        np.testing.assert_allclose(share, facing_square(y, z, 2.0), rtol=0.01)


def test_the_same_close_by_is_as_right_as_discs_of_a_quarter_of_their_distance_are() -> None:
    """As discs seen along their normals all would give too little, by 2.6 % in the mean."""
    gap = 0.3
    first, second, second_from_first = boxes(gap)
    facing = first.places[1][:, 0] > 0.9
    shares = shares_seen(first, second, second_from_first)[facing]
    wanted = np.array([facing_square(y, z, gap) for _, y, z in first.places[0][facing]])
    np.testing.assert_allclose(shares, wanted, rtol=0.02)
    np.testing.assert_allclose(shares.sum(), wanted.sum(), rtol=0.005)


def test_the_top_of_a_box_sees_the_sides_of_a_smaller_one_that_stands_on_it() -> None:
    """No side of the smaller one sees the middle of the larger."""
    foot, width, height = 0.02, 0.6, 1.0
    small: Table = {"box": {"size_m": [width, width, height], "material": lambert(WHITE)}}
    raised = 0.5 * (1.0 + height) + foot
    scenario = near(BOX, {"model": small, "position_icrf_m": [0.0, 0.0, raised]}, BESIDE, SUN, {})
    bodies = scenario.at(scenario.epoch_tai_ns).bodies.values()
    first, second = (near_body(body.model) for body in bodies)
    pose = np.eye(4)
    pose[2, 3] = -raised
    (x, y, _), normals = first.places[0].T, first.places[1]
    before = (normals[:, 2] > 0.9) & (x > 0.4) & (np.abs(y) < 0.5 * width)
    wanted = [
        sum(
            sign * upright_seen(a - 0.5 * width, top, 0.5 * width + side * b)
            for sign, top in ((1.0, foot + height), (-1.0, foot))
            for side in (-1.0, 1.0)
        )
        for a, b in zip(x[before], y[before], strict=True)
    ]
    # Clusters of the side are as wide as a third of their distance there.
    np.testing.assert_allclose(shares_seen(first, second, pose)[before], wanted, rtol=0.03)


def test_another_one_close_by_fills_at_most_the_whole_hemisphere() -> None:
    first, second, second_from_first = boxes(0.05)
    shares = shares_seen(first, second, second_from_first)
    assert shares.max() <= 1.0 + 1e-5
    # Its discs would fill 1.14 of it.
    assert shares.max() > 0.9


def test_a_large_sender_has_as_many_clusters_as_are_allowed() -> None:
    """Its parts are a millimetre and 100 m from the receiver: steps of a factor of 1e5."""
    rng = np.random.default_rng(4)
    distance = 10.0 ** rng.uniform(-3.0, 2.0, 20_000)
    points = (rng.choice([-1.0, 1.0], (20_000, 3)) * distance[:, None]).astype(np.float32)
    normals = rng.normal(size=(20_000, 3)).astype(np.float32)
    with np.errstate(all="raise"):
        number = clusters_of(points, normals, distance, 64)
    assert number.min() == 0
    assert number.max() < 64


def test_what_hides_the_other_one_hides_its_light() -> None:
    first, second, second_from_first = boxes(2.0)
    behind = second_from_first.copy()
    behind[0, 3] = 3.0
    shares = shares_seen(first, second, behind)
    assert not shares[first.places[1][:, 0] > -0.9].any()


@pytest.mark.parametrize("by_compute", [False, True])
def test_a_face_in_shadow_shows_the_light_of_the_sunlit_one_across(
    gl: moderngl.Context, monkeypatch: pytest.MonkeyPatch, by_compute: bool
) -> None:
    monkeypatch.setattr("simgl.passes.interreflection.prefers_compute", lambda _: by_compute)
    gap = 2.0
    light, _ = from_other_surfaces(gl, two_boxes(gap, SUN))
    seen = 4.0 * square_seen(0.5 / gap, 0.5 / gap)
    # Back and forth between both faces 0.3 %.
    wanted = WHITE / np.pi * seen * WHITE * IN_BANDS * 0.8
    np.testing.assert_allclose(light[62:66, 62:66].mean(), wanted, rtol=0.02)


def test_without_the_key_nothing_comes(gl: moderngl.Context) -> None:
    alone, _ = from_other_surfaces(gl, two_boxes(2.0, SUN, between_spacecraft=False))
    assert not alone.any()


def weight(apart: float) -> float:
    """Of the light from one white box of 1 m to another that is so far from its middle [m]."""
    state = (scenario := two_boxes(apart - 0.5, SUN)).at(scenario.epoch_tai_ns)
    group = near_groups(state).get("target")
    return 0.0 if group is None else group.pairs[0].weight


def test_light_fades_where_it_is_a_thousandth_of_the_light_on_the_sender() -> None:
    # Seen along its diagonal a cube of 1 m covers sqrt(3) m2.
    far = np.sqrt(WHITE * np.sqrt(3.0) / np.pi / 1e-3)
    assert weight(1.01 * far) == 0.0
    assert weight(0.99 * far / np.sqrt(2.0)) == 1.0
    # Half of the way in share; the step there is the steepest, 1.5 / 1e-3.
    assert abs(weight(far / np.sqrt(1.5)) - 0.5) < 1e-6
    weights = [weight(d) for d in np.linspace(far / np.sqrt(2.0), far, 200)]
    assert np.abs(np.diff(weights)).max() < 0.01


def test_only_those_whose_light_arrives_are_in_a_group() -> None:
    """A small box sends too little to a large one, and gets its light."""
    state = (scenario := large_and_small(40.0)).at(scenario.epoch_tai_ns)
    groups = near_groups(state)
    assert list(groups) == ["chaser"]
    assert [one.instance for one in groups["chaser"].spacecraft] == [1, 2]
    assert [(p.receiver, p.sender) for p in groups["chaser"].pairs] == [(1, 0)]


def test_sunlight_on_a_bay_stays_as_fine_beside_another_spacecraft(gl: moderngl.Context) -> None:
    """What a box behind the bay's back sends does not come into the bay."""
    alone, _ = from_other_surfaces(gl, box_behind_bay(between_spacecraft=False))
    scenario = box_behind_bay()
    light, instance = from_other_surfaces(gl, scenario)
    groups = near_groups(scenario.at(scenario.epoch_tai_ns))
    assert len(groups["target"].pairs) == 2
    bay = instance == 1
    # The hull's flanks get some of it and send it on.
    np.testing.assert_allclose(light[bay], alone[bay], rtol=0.0, atol=3e-3 * alone[bay].mean())


def test_light_follows_a_pose_between_the_steps_of_what_is_seen() -> None:
    first, second, pose = boxes(2.0)
    # Half a step farther away, by the distance of the middles.
    gap = 2.0 + 3.0 * STEP / 2.0
    _, _, farther = boxes(gap)
    facing = first.places[1][:, 0] > 0.9
    before = shares_seen(first, second, pose)[facing]
    after = shares_seen(first, second, farther, seen_at=pose)[facing]
    wanted = [
        facing_square(y, z, gap) / facing_square(y, z, 2.0) for _, y, z in first.places[0][facing]
    ]
    assert max(wanted) < 0.97
    # Of a change of 4 %; discs of a quarter of their distance are right to 1 %.
    np.testing.assert_allclose(after / before, wanted, rtol=1e-3)


def test_rounding_errors_do_not_tell_half_turns_apart() -> None:
    half = np.eye(4)
    for axis in (np.array([0.0, 0.0, 1.0]), np.array([0.6, -0.48, 0.64])):
        steps = []
        for error in (-1e-9, 1e-9):
            half[:3, :3] = Rotation.from_rotvec((np.pi + error) * axis).as_matrix()
            steps.append(in_steps(half, 1.0, STEP))
        np.testing.assert_array_equal(steps[0], steps[1])


def test_poses_in_steps_are_within_half_of_one() -> None:
    rng = np.random.default_rng(3)
    for step in (STEP, FINE_STEP):
        for gap in (0.3, 2.0, 50.0):
            matrix = np.eye(4)
            matrix[:3, 3] = gap * rng.normal(size=3)
            stepped = in_steps(matrix, gap, step)
            assert np.abs(stepped - matrix).max() <= 0.5 * step * gap
            np.testing.assert_array_equal(in_steps(stepped, gap, step), stepped)


def test_poses_that_differ_by_rounding_errors_are_one() -> None:
    """Places 7000 km from the Earth's centre are known to 1e-9 m, their differences to some."""
    rng = np.random.default_rng(8)
    for gap in (0.5, 21.0, 900.0):
        pose = np.eye(4)
        pose[:3, :3] = Rotation.from_rotvec(rng.normal(size=3)).as_matrix()
        pose[:3, 3] = gap * rng.normal(size=3)
        kept = without_noise(pose)
        # Half of a micrometre and half of a nanoradian, and less than twice that.
        np.testing.assert_allclose(kept[:3, 3], pose[:3, 3], rtol=0.0, atol=1e-6)
        np.testing.assert_allclose(kept[:3, :3], pose[:3, :3], rtol=0.0, atol=1e-9)
        # What is in the middle of a step stays in it.
        noise = 1e-16 * rng.normal(size=(4, 4))
        noise[:3, 3] *= 1e8
        np.testing.assert_array_equal(without_noise(kept + noise), kept)
