"""Spacecraft that pass before one another while the shutter is open, in layers by their distance.

Each layer has snapshots of its own. What it hides of those behind it is then told by the covered
share of each pixel, and not by the middle of a snapshot of both.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from simgl.arrays import Array
from simgl.scene.state import SceneState
from simgl.view.image_motion import LARGEST_STEP, Pair
from simgl.view.row_clock import camera_from_body

Layers = tuple[frozenset[str], ...]


@dataclass(frozen=True, kw_only=True)
class DepthLayers:
    """
    names : of the spacecraft of each layer, the farthest first
    both_move : how far the slower of two that pass each other goes in the image, at most [px]
    """

    names: Layers
    both_move: float = 0.0


def depth_layers(states: Sequence[SceneState], camera: str, exposed: float) -> DepthLayers:
    """One layer where nothing passes anything, or where what does is not apart in depth.

    states : at even times from the start of what rows see to its end
    exposed : share of that time in which a row sees them
    """
    names = list(states[0].bodies)
    group_of = {name: name for name in names}
    before: set[tuple[str, str]] = set()
    both_move = 0.0

    def join(one: str, other: str) -> None:
        old, new = group_of[one], group_of[other]
        group_of.update({name: new for name in names if group_of[name] == old})

    for one, other in combinations(names, 2):
        pair = Pair.of(states, camera, one, other)
        if not pair.may_overlap:
            continue
        order = 0
        if exposed * pair.against > LARGEST_STEP:
            order = _order(states, camera, one, other)
        if order == 0:
            join(one, other)
            continue
        before.add((one, other) if order > 0 else (other, one))
        both_move = max(both_move, exposed * min(pair.ways))
    edges = {(group_of[near], group_of[far]) for near, far in before}
    levels = dict.fromkeys(group_of.values(), 0)
    for _ in levels:
        for near, far in edges:
            levels[near] = max(levels[near], levels[far] + 1)
    # Groups that are before and behind each other are one layer.
    if any(levels[near] <= levels[far] for near, far in edges):
        return DepthLayers(names=(frozenset(names),))
    layers = tuple(
        frozenset(name for name in names if levels[group_of[name]] == level)
        for level in range(max(levels.values(), default=0) + 1)
    )
    return DepthLayers(names=layers, both_move=both_move)


def _order(states: Sequence[SceneState], camera: str, one: str, other: str) -> int:
    """1 where a spacecraft may only hide another one all the time, -1 where that may only hide it,
    0 where neither is so."""
    nearer = [_is_before(state, camera, one, other) for state in states]
    if all(nearer):
        return 1
    if any(nearer):
        return 0
    return -1 if all(_is_before(state, camera, other, one) for state in states) else 0


def _is_before(state: SceneState, camera: str, one: str, other: str) -> bool:
    """Whether a plane has a spacecraft and the camera on one side, and another beyond it.

    Planes across the boresight, across the way from one to the other, and along their axes.
    """
    placed = state.cameras[camera]
    poses = [camera_from_body(placed, state.bodies[name]) for name in (one, other)]
    meshes = [state.bodies[name].model.posed_mesh for name in (one, other)]
    near, far = (
        mesh.hull @ pose[:3, :3].T + pose[:3, 3] for mesh, pose in zip(meshes, poses, strict=True)
    )
    axes = [pose[:3, :3].T for pose in poses]
    normals: Array = np.vstack([[0.0, 0.0, 1.0], far.mean(axis=0) - near.mean(axis=0), *axes])
    normals = np.vstack([normals, -normals])
    end = np.maximum((near @ normals.T).max(axis=0), 0.0)
    return bool(np.any(end < (far @ normals.T).min(axis=0)))
