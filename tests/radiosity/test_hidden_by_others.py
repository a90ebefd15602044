"""What a spacecraft hides: of another one's own surfaces, and of the light between two others."""

from __future__ import annotations

import numpy as np

from simgl.arrays import Array
from simgl.radiosity.bake import BakeSettings, bake
from simgl.radiosity.between_spacecraft import PosedPath, light_path
from simgl.radiosity.convex_transport import convex_transport
from simgl.radiosity.incident_light import Neighbour
from simgl.radiosity.near_body import NearBody, standing_rows
from simgl.radiosity.reflection_laws import reflection_laws
from simgl.radiosity.remesh import subdivided
from simgl.radiosity.third_bodies import third_bodies, unhidden
from simgl.scene.materials import Material
from simgl.scene.mesh import Mesh
from simgl.scene.spacecraft import SpacecraftModel
from tests.radiosity.near_spacecraft import square_seen
from tests.radiosity.shapes import Quad, quads

WHITE = Material(name="white", reflectance=(0.8,) * 4)
QUICK = BakeSettings(patches=400, patch_rays=64, gather_rays=64, sun_rays=64, grids=0)


def square(height: float, half: float, up: bool) -> Quad:
    a = half if up else -half
    return ((-a, -half, height), (a, -half, height), (a, half, height), (-a, half, height))


# Squares of 1 m that face each other across a metre.
FACING = subdivided(quads((square(0.0, 0.5, True), square(1.0, 0.5, False))), 0.2)


def body(mesh: Mesh, *, alone: bool) -> NearBody:
    """Of open sheets.

    alone : whether its surfaces do not see each other
    """
    model = SpacecraftModel(
        name="squares",
        mesh=mesh,
        parts=("squares",),
        materials=(WHITE,) * (int(mesh.material.max()) + 1),
        open_sheets=True,
    )
    transport = convex_transport(model) if alone else bake(mesh, open_sheets=True, settings=QUICK)
    assert transport is not None
    laws = reflection_laws(model.materials)
    standing = standing_rows(transport)
    return NearBody(model=model, transport=transport, laws=laws, standing=standing)


def between(height: float) -> Array:
    """Pose of another body in its axes, which stands so high over this one."""
    pose = np.eye(4)
    pose[2, 3] = -height
    return pose


def in_the_middle(receiver: NearBody) -> int:
    """The place nearest to the middle of the lower square, on its upper side."""
    places, normals, _ = receiver.places
    off = np.linalg.norm(places, axis=1) + 10.0 * (normals[:, 2] < 0.9)
    return int(np.argmin(off))


def test_a_body_within_another_hides_what_faces_what() -> None:
    """From the middle a square of 0.4 m half way up covers as much of the other one's square."""
    receiver = body(FACING, alone=False)
    sender = body(quads((square(0.0, 0.2, True),)), alone=True)
    pose = between(0.5)
    posed = PosedPath(path=light_path(receiver, sender, pose), sender_from_receiver=pose)
    at = in_the_middle(receiver)
    hidden = posed.hides_from_places[at]
    np.testing.assert_allclose(hidden.sum(), 4.0 * square_seen(0.4, 0.4), rtol=0.02)
    # Patches of the upper square alone, all within 0.4 m of its middle and their own size.
    patches = receiver.transport.points[hidden.indices].mean(axis=1)
    np.testing.assert_allclose(patches[:, 2], 1.0, atol=1e-3)
    assert np.abs(patches[:, :2]).max() < 0.5
    # What stands before the body itself does not stand before its sky.
    assert not posed.hides[at].sum()
    # Its patches, one for each square of some centimetres, lose as much.
    lower = np.abs(receiver.transport.points[:, 0, 2]) < 1e-3
    middle = lower & (np.abs(receiver.transport.points.mean(axis=1)[:, :2]).max(axis=1) < 0.1)
    lost = np.asarray(posed.hides_from_patches.sum(axis=1)).ravel()
    up = receiver.transport.normals[:, 0, 2] > 0.9
    np.testing.assert_allclose(lost[middle & up].mean(), 4.0 * square_seen(0.4, 0.4), rtol=0.1)


def test_a_body_outside_hides_nothing_of_it() -> None:
    receiver = body(FACING, alone=False)
    sender = body(quads((square(0.0, 0.2, False),)), alone=True)
    pose = between(2.0)
    posed = PosedPath(path=light_path(receiver, sender, pose), sender_from_receiver=pose)
    assert posed.to_places.nnz > 0
    assert posed.hides_from_places.nnz == 0


def test_a_third_body_hides_two_from_each_other() -> None:
    lower, upper = (body(quads((square(0.0, 0.5, up),)), alone=True) for up in (True, False))
    pose = between(2.0)
    path = light_path(lower, upper, pose)

    def seen_past(half: float, offset: float) -> float:
        """Share of the hemisphere over the lower square's middle, where a square stands half way
        up and so far to the side."""
        other = between(1.0)
        other[0, 3] = -offset
        shield = body(quads((square(0.0, half, True),)), alone=True).model
        around = [Neighbour(instance=3, model=shield, other_from_body=other, near=True)]
        third = third_bodies(around, lower.model, upper.model, pose)
        free = unhidden(path, pose, [one.blocker() for one in third]) if third else path
        posed = PosedPath(path=free, sender_from_receiver=pose)
        return float(posed.to_places[in_the_middle(lower)].sum())

    whole = 4.0 * square_seen(0.25, 0.25)
    np.testing.assert_allclose(seen_past(0.5, 9.0), whole, rtol=0.01)
    # From the middle its shadow on the upper square is twice as wide: all, or a square of 0.5 m.
    assert seen_past(0.5, 0.0) == 0.0
    rest = whole - 4.0 * square_seen(0.125, 0.125)
    # One ray for each cluster of a quarter of the distance.
    np.testing.assert_allclose(seen_past(0.125, 0.0), rest, rtol=0.1)
