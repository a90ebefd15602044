"""Triangles that turn their front to a place are told from those that turn their back."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from simgl.arrays import Array
from simgl.motion.joints import Joint, body_from_stored
from simgl.scene.facing_triangles import facing_triangles
from simgl.scene.mesh import sphere
from simgl.scene.posed_mesh import PosedMesh

BALL = sphere(1.0, 64)
HINGE = Joint(
    name="hinge",
    parts=(1,),
    axis_body=np.array([0.0, 1.0, 0.0]),
    origin_body=np.array([1.0, 0.0, 0.0]),
    limits=(0.0, np.pi),
)


def opened(angle: float) -> PosedMesh:
    """A ball whose upper half turns about a hinge at its rim."""
    upper = (BALL.positions[:, 2] > 0.0).astype(np.uint32)
    # Triangles belong to the part of their first corner: all of them have one part.
    part = upper[BALL.triangles].min(axis=1)
    corners = BALL.triangles.ravel()
    mesh = replace(
        BALL,
        positions=BALL.positions[corners],
        normals=BALL.normals[corners],
        triangles=np.arange(corners.size, dtype=np.uint32).reshape(-1, 3),
        part=np.repeat(part, 3),
        material=BALL.material[corners],
    )
    motion = None if angle == 0.0 else body_from_stored([HINGE], [angle])
    return PosedMesh(mesh=mesh, joints=(HINGE,), motion=motion)


def sines(posed: PosedMesh, place: Array) -> Array:
    """(m,) of the angle of the line to a place above each triangle's plane."""
    baked = posed.baked()
    a, b, c = np.moveaxis(baked.positions[baked.triangles].astype(np.float64), 1, 0)
    across, towards = np.cross(b - a, c - a), place - a
    length = np.linalg.norm(across, axis=1) * np.linalg.norm(towards, axis=1)
    height = np.einsum("ij,ij->i", across, towards)
    return np.divide(height, length, out=np.zeros(len(a)), where=length > 0.0)


@pytest.mark.parametrize("angle", [0.0, 1.2])
@pytest.mark.parametrize("place", [(0.0, 0.0, 3.0), (-0.5, 2.0, 0.3), (2e4, -5e4, 3e3)])
def test_fronts_are_chosen_and_backs_are_not(
    angle: float, place: tuple[float, float, float]
) -> None:
    posed = opened(angle)
    numbers = facing_triangles(posed, np.array([place]))
    chosen = np.zeros(len(posed.mesh.triangles), dtype=bool)
    chosen[numbers] = True
    assert chosen.sum() == numbers.size  # each once
    sine = sines(posed, np.array(place))
    assert chosen[sine > 0.0].all()
    # A thousandth of the distance to what is farthest from the place, at most three times as far.
    assert not chosen[sine < -3e-3].any()
    assert 0.1 < chosen.mean() < 0.6


@pytest.mark.parametrize("angle", [0.0, 1.2])
def test_triangles_in_view_are_chosen_and_most_others_are_not(angle: float) -> None:
    posed = opened(angle)
    place = np.array([0.3, 1.8, 0.4])
    # A narrow pyramid from the place to a part of the ball's rim.
    axis = np.array([0.9, 0.2, 0.3]) - place
    axis /= np.linalg.norm(axis)
    across = np.cross(axis, [0.0, 0.0, 1.0])
    across /= np.linalg.norm(across)
    up = np.cross(across, axis)
    half_angle = 0.05
    sides = np.array(
        [
            np.sin(half_angle) * axis + s * np.cos(half_angle) * v
            for v in (across, up)
            for s in (-1.0, 1.0)
        ]
    )
    every = facing_triangles(posed, place[None])
    seen = facing_triangles(posed, place[None], sides=sides)
    baked = posed.baked()
    before = (baked.positions[baked.triangles].astype(np.float64) - place) @ sides.T
    reaches = (before > 0.0).any(axis=1).all(axis=1)
    assert np.isin(every[reaches[every]], seen).all()
    # In the same order, of which depend triangles at one depth.
    np.testing.assert_array_equal(seen, every[np.isin(every, seen)])
    assert 0 < seen.size < 0.4 * every.size
