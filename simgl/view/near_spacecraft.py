"""Spacecraft so near to each other that the light which one sends to the other matters."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from weakref import WeakKeyDictionary

import numpy as np

from simgl.arrays import Array
from simgl.radiosity.incident_light import (
    THRESHOLD,
    IncidentLight,
    NearPair,
    faded,
    incident_light,
)
from simgl.radiosity.solver import material_light
from simgl.scene.mesh import Mesh, cached_with_mesh
from simgl.scene.posed_mesh import PosedMesh
from simgl.scene.spacecraft import SpacecraftModel
from simgl.scene.state import BodyState, SceneState
from simgl.view.background import SkyView, sky_view


@dataclass(frozen=True, kw_only=True, eq=False)
class NearSpacecraft:
    """One of a group.

    instance : index in the scene, counted from 1
    incident_light : from elsewhere
    sky : None where there is no Earth
    """

    instance: int
    model: SpacecraftModel
    incident_light: IncidentLight
    sky: SkyView | None


@dataclass(frozen=True, kw_only=True, eq=False)
class NearGroup:
    """A spacecraft and all whose light comes to it, also by way of others."""

    spacecraft: tuple[NearSpacecraft, ...]
    pairs: tuple[NearPair, ...]


# Of each state that is in use, by the spacecraft: all cameras and all of a group ask for it.
_groups = WeakKeyDictionary[SceneState, Mapping[str, NearGroup]]()


def near_groups(state: SceneState) -> Mapping[str, NearGroup]:
    """The group of each spacecraft to which light comes from another one, by name."""
    groups = _groups.get(state)
    if groups is None:
        groups = _groups[state] = _grouped(state)
    return groups


def _grouped(state: SceneState) -> dict[str, NearGroup]:
    pairs = {}
    for receiver, sender in _perhaps_near(state):
        bodies = state.bodies[receiver], state.bodies[sender]
        weight = _weight(*bodies)
        if weight > 0.0:
            pairs[receiver, sender] = bodies, weight
    groups: dict[tuple[str, ...], NearGroup] = {}
    of_spacecraft = {}
    for name in {receiver: None for receiver, _ in pairs}:
        names = _senders_to(name, state, list(pairs))
        if names not in groups:
            groups[names] = NearGroup(
                spacecraft=tuple(_near_spacecraft(state, one) for one in names),
                pairs=tuple(
                    _pair(bodies, weight, (names.index(receiver), names.index(sender)))
                    for (receiver, sender), (bodies, weight) in pairs.items()
                    if receiver in names
                ),
            )
        of_spacecraft[name] = groups[names]
    return of_spacecraft


def _perhaps_near(state: SceneState) -> list[tuple[str, str]]:
    """Receivers and senders by their bounding spheres alone: most of many are far away."""
    names, bodies = list(state.bodies), list(state.bodies.values())
    if len(names) < 2:
        return []
    meshes = [body.model.posed_mesh for body in bodies]
    radii = np.array([mesh.radius for mesh in meshes])
    first = bodies[0].pose.position
    places = np.stack(
        [
            b.pose.position - first + b.pose.R_icrf_from_body @ m.centre
            for b, m in zip(bodies, meshes, strict=True)
        ]
    )
    gaps = np.linalg.norm(places[:, None] - places, axis=2) - radii[:, None]
    near = radii > np.sqrt(THRESHOLD) * np.maximum(gaps, 0.0)
    np.fill_diagonal(near, False)
    return [(names[i], names[j]) for i, j in np.argwhere(near)]


def _senders_to(first: str, state: SceneState, pairs: list[tuple[str, str]]) -> tuple[str, ...]:
    """Itself and all whose light comes to it, also by way of others, in the order of the scene."""
    names = [first]
    for name in names:
        names += [s for receiver, s in pairs if receiver == name and s not in names]
    return tuple(name for name in state.bodies if name in names)


def _near_spacecraft(state: SceneState, name: str) -> NearSpacecraft:
    body = state.bodies[name]
    return NearSpacecraft(
        instance=list(state.bodies).index(name) + 1,
        model=body.model,
        incident_light=incident_light(state, body),
        sky=sky_view(state, name, body),
    )


def _pair(bodies: tuple[BodyState, BodyState], weight: float, indices: tuple[int, int]) -> NearPair:
    receiver, sender = bodies
    matrix, ends = _between(*bodies), (receiver.model.posed_mesh, sender.model.posed_mesh)
    offset = matrix[:3, :3] @ ends[0].centre + matrix[:3, 3] - ends[1].centre
    return NearPair(
        receiver=indices[0],
        sender=indices[1],
        sender_from_receiver=matrix,
        reach=float(np.linalg.norm(offset)),
        weight=weight,
    )


def _between(receiver: BodyState, sender: BodyState) -> Array:
    """(4, 4) to the sender's axes from the receiver's."""
    matrix = np.eye(4)
    R_sender_from_icrf = sender.pose.R_icrf_from_body.T
    matrix[:3, :3] = R_sender_from_icrf @ receiver.pose.R_icrf_from_body
    matrix[:3, 3] = R_sender_from_icrf @ (receiver.pose.position - sender.pose.position)
    return matrix


def _weight(receiver: BodyState, sender: BodyState) -> float:
    """Of the light that comes from the sender to the receiver.

    A surface whose middle is so far away fills at most its area over pi times the square of the
    distance of a hemisphere, weighted by the cosine, and sends on its albedo of the light on it.
    """
    mesh = sender.model.posed_mesh
    offset = sender.pose.position - receiver.pose.position
    middle = receiver.pose.R_icrf_from_body.T @ (
        offset + sender.pose.R_icrf_from_body @ mesh.centre
    )
    near = receiver.model.posed_mesh
    low, high = near.hull.min(axis=0), near.hull.max(axis=0)
    beyond = np.maximum(np.maximum(low - middle, middle - high), 0.0)
    square = max(float(beyond @ beyond), 1e-12)
    share = min(_widest_area(mesh) / (np.pi * square), 1.0)
    return faded(share * _albedo(sender.model))


def _widest_area(mesh: PosedMesh) -> float:
    """Largest that the box around a mesh looks from any side [m2]."""
    a, b, c = mesh.hull.max(axis=0) - mesh.hull.min(axis=0)
    return float(np.sqrt((a * b) ** 2 + (b * c) ** 2 + (c * a) ** 2))


def _albedo(model: SpacecraftModel) -> float:
    """Mean over the surface, images taken as white, in the band where it is highest."""
    albedo, _ = material_light(model.materials)
    return float((_shares(model.mesh, len(albedo)) @ albedo).max())


@cached_with_mesh
def _shares(mesh: Mesh, materials: int) -> Array:
    """(k,) of the surface that each material covers."""
    a, b, c = np.moveaxis(mesh.positions[mesh.triangles].astype(np.float64), 1, 0)
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    material = mesh.material[mesh.triangles[:, 0]]
    return np.bincount(material, area, minlength=materials) / max(float(area.sum()), 1e-30)
