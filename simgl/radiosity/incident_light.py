"""The lights of one spacecraft in its body axes, for the interreflection on it."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass, replace

import numpy as np

from simgl.arrays import Array
from simgl.radiosity.solver import Blocker, SpotLight
from simgl.rays import ray_tracer
from simgl.scene.spacecraft import SpacecraftModel
from simgl.scene.state import BodyState, SceneState

# Of the distance: a body of this radius covers a millionth of a hemisphere's light.
_MIN_SIZE = 1e-3
# Of a hemisphere, weighted by the cosine: of white spacecraft in sunlight 1e-3 of it.
_MIN_SHARE = 1e-3


@dataclass(frozen=True, kw_only=True, eq=False)
class Neighbour:
    """Another spacecraft.

    instance : index in the scene, counted from 1
    other_from_body : (4, 4) to its axes
    near : whether it may fill more of this one's sky than a millionth
    """

    instance: int
    model: SpacecraftModel
    other_from_body: Array
    near: bool

    def blocker(self) -> Blocker:
        """The same, ready for rays."""
        mesh = self.model.posed_mesh
        return Blocker(
            tracer=ray_tracer(mesh),
            other_from_body=self.other_from_body,
            centre=mesh.centre,
            radius=mesh.radius,
            hull=mesh.hull,
        )


@dataclass(frozen=True, kw_only=True, eq=False)
class LitNeighbour:
    """A spacecraft near enough for its light to matter.

    gap : from its bounding sphere's centre to the body's [m]
    light : on it, its neighbours' left out
    """

    neighbour: Neighbour
    gap: float
    light: IncidentLight


@dataclass(frozen=True, kw_only=True, eq=False)
class IncidentLight:
    """What lights a spacecraft.

    sun_direction : (3,) unit, body axes; of the Moon where that gives more light
    sun_irradiance : (4,) past Earth and Moon [W m-2]
    before_sun : spacecraft that may shade it from the Sun
    lamps : that may light it
    around : every other spacecraft, which may stand between it and a lamp
    lit_by : those whose light comes to it
    """

    sun_direction: Array
    sun_irradiance: Array
    before_sun: tuple[Neighbour, ...]
    lamps: tuple[SpotLight, ...]
    around: tuple[Neighbour, ...]
    lit_by: tuple[LitNeighbour, ...] = ()

    @property
    def key(self) -> tuple[Hashable, ...]:
        """Equal for equal lights, whoever looks."""
        return (
            self.sun_direction.tobytes(),
            self.sun_irradiance.tobytes(),
            *(
                (shades, other.instance, other.model, other.other_from_body.tobytes())
                for shades, others in ((True, self.before_sun), (False, self.around))
                for other in others
            ),
            *(
                (
                    lamp.place.tobytes(),
                    lamp.axis.tobytes(),
                    lamp.half_angle,
                    lamp.edge,
                    lamp.intensity.tobytes(),
                )
                for lamp in self.lamps
            ),
            *(key for lit in self.lit_by for key in lit.light.key),
        )


def incident_light_with_neighbours(state: SceneState, body: BodyState) -> IncidentLight:
    """The lights of a body of the scene, its neighbours among them."""
    isolated = incident_light(state, body)
    lit_by = []
    for neighbour in isolated.around:
        gap = _gap(body, neighbour)
        if _may_light(body, neighbour, gap):
            other = list(state.bodies.values())[neighbour.instance - 1]
            light = incident_light(state, other)
            lit_by.append(LitNeighbour(neighbour=neighbour, gap=gap, light=light))
    return replace(isolated, lit_by=tuple(lit_by))


def _gap(body: BodyState, neighbour: Neighbour) -> float:
    """Between the centres of the bounding spheres [m]."""
    matrix, mesh = neighbour.other_from_body, body.model.posed_mesh
    offset = matrix[:3, :3] @ mesh.centre + matrix[:3, 3] - neighbour.model.posed_mesh.centre
    return float(np.linalg.norm(offset))


def _may_light(body: BodyState, neighbour: Neighbour, gap: float) -> bool:
    """Whether it may fill more than ``_MIN_SHARE`` of a hemisphere of any place on a body."""
    radius = neighbour.model.posed_mesh.radius
    return radius**2 > _MIN_SHARE * max(gap - body.model.posed_mesh.radius, 0.0) ** 2


def incident_light(state: SceneState, body: BodyState) -> IncidentLight:
    """The lights of a body of the scene, its neighbours left out."""
    pose, mesh = body.pose, body.model.posed_mesh
    sun = state.direct_light(pose.position).main
    direction = pose.R_icrf_from_body.T @ sun.direction_icrf
    around, before_sun = [], []
    for index, other in enumerate(state.bodies.values()):
        if other is body:
            continue
        R = other.pose.R_icrf_from_body.T @ pose.R_icrf_from_body
        matrix = np.eye(4)
        matrix[:3, :3] = R
        matrix[:3, 3] = other.pose.R_icrf_from_body.T @ (pose.position - other.pose.position)
        # Its bounding sphere, moved along the light, meets the body's.
        offset = R.T @ (other.model.posed_mesh.centre - matrix[:3, 3]) - mesh.centre
        reach = other.model.posed_mesh.radius + mesh.radius
        gap = max(float(np.linalg.norm(offset)) - reach, 0.0)
        neighbour = Neighbour(
            instance=index + 1,
            model=other.model,
            other_from_body=matrix,
            near=other.model.posed_mesh.radius > _MIN_SIZE * gap,
        )
        around.append(neighbour)
        along = float(offset @ direction)
        if along > -reach and np.linalg.norm(offset - along * direction) < reach:
            before_sun.append(neighbour)
    lamps = []
    for lamp in state.lamps:
        here = lamp.seen_from_body(pose)
        lamps.append(
            SpotLight(
                place=here.position,
                axis=here.direction,
                half_angle=here.lamp.half_angle,
                edge=here.lamp.edge,
                intensity=here.lamp.intensity,
            )
        )
    return IncidentLight(
        sun_direction=direction,
        sun_irradiance=sun.irradiance,
        before_sun=tuple(before_sun),
        lamps=tuple(lamps),
        around=tuple(around),
    )
