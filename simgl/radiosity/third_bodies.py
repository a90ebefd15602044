"""Bodies that stand between two others and hide them from each other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from simgl.arrays import Array, Array32, Mask
from simgl.radiosity.between_spacecraft import STEP, LightPath
from simgl.radiosity.incident_light import Neighbour
from simgl.radiosity.path_pairs import SeenPairs
from simgl.radiosity.solver import Blocker
from simgl.scene.spacecraft import SpacecraftModel


def third_bodies(
    around: Sequence[Neighbour],
    receiver: SpacecraftModel,
    sender: SpacecraftModel,
    sender_from_receiver: Array,
) -> tuple[Neighbour, ...]:
    """Those that may stand between a receiver and a sender, by bounding spheres, in steps of their
    poses.

    around : all others about the receiver but the sender
    """
    first, last = receiver.posed_mesh, sender.posed_mesh
    start = first.centre
    way = _from_other(sender_from_receiver, last.centre) - start
    between = []
    for other in around:
        offset = _from_other(other.other_from_body, other.model.posed_mesh.centre) - start
        along = float(np.clip(offset @ way / max(float(way @ way), 1e-30), 0.0, 1.0))
        reach = other.model.posed_mesh.radius + max(first.radius, last.radius)
        if np.linalg.norm(offset - along * way) < reach:
            between.append(other.in_steps(float(np.linalg.norm(offset)), STEP))
    return tuple(between)


def _from_other(other_from_body: Array, place: Array) -> Array:
    """(3,) a place of another body in the axes of this one."""
    return np.asarray((place - other_from_body[:3, 3]) @ other_from_body[:3, :3])


def unhidden(
    path: LightPath, sender_from_receiver: Array, blockers: Sequence[Blocker]
) -> LightPath:
    """The path without the pairs that other bodies hide from each other.

    sender_from_receiver : (4, 4) the pose that it was traced at
    blockers : from the receiver's axes
    """
    turn, shift = sender_from_receiver[:3, :3], sender_from_receiver[:3, 3]
    ends = ((path.ends - shift) @ turn).astype(np.float32)
    at_places, at_patches = (
        np.flatnonzero(~_hidden(pairs, ends, blockers))
        for pairs in (path.at_places, path.at_patches)
    )
    return replace(
        path,
        at_places=path.at_places.of_pairs(at_places),
        at_patches=path.at_patches.of_pairs(at_patches),
        cells=path.cells[at_places],
    )


def _hidden(pairs: SeenPairs, ends: Array32, blockers: Sequence[Blocker]) -> Mask:
    """(k,) whether a body stands between the two of each pair."""
    hidden = np.zeros(len(pairs.point), dtype=np.bool_)
    for blocker in blockers:
        turn, shift = blocker.other_from_body[:3, :3], blocker.other_from_body[:3, 3]
        starts, goals = (
            (places @ turn.T + shift).astype(np.float32) for places in (pairs.points, ends)
        )
        start = np.take(starts, pairs.point, axis=0)
        way = np.take(goals, pairs.end, axis=0) - start
        # Only those that pass through its bounding sphere.
        offset = blocker.centre.astype(np.float32) - start
        square = np.maximum(np.einsum("ij,ij->i", way, way), np.float32(1e-12))
        along = np.clip(np.einsum("ij,ij->i", offset, way) / square, 0.0, 1.0)
        offset -= along[:, None] * way
        passed = np.einsum("ij,ij->i", offset, offset) < np.float32(blocker.radius**2)
        near = np.flatnonzero(passed & ~hidden)
        reach = np.ones(len(near), dtype=np.float32)
        hidden[near] = blocker.tracer.occluded(start[near], way[near], reach)
    return hidden
