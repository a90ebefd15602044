"""The lights of one spacecraft in its body axes, for the interreflection on it."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass, replace

import numpy as np

from simgl.arrays import Array
from simgl.radiosity.lamp_light import SpotLight, beyond_box
from simgl.radiosity.pose_steps import (
    direction_without_noise,
    in_steps,
    place_without_noise,
    without_noise,
)
from simgl.radiosity.solver import Blocker
from simgl.rays import ray_tracer
from simgl.scene.spacecraft import SpacecraftModel
from simgl.scene.state import BodyState, SceneState

# Of the distance: a body of this radius covers a millionth of a hemisphere's light.
_MIN_SIZE = 1e-3
# Light from another spacecraft that may be less than this share of all is left out; it counts in
# full from twice as much on.
THRESHOLD = 1e-3
# A spacecraft carries a lamp that is so near beside what it lights; its turns count in such steps
# [rad].
_CARRIES, _TURN = 1.0 / 64.0, 1.0 / 512.0


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

    @property
    def key(self) -> tuple[Hashable, ...]:
        """Equal for equal bodies that stand alike."""
        return self.model.posed_mesh.digest, self.other_from_body.tobytes()

    def in_steps(self, reach: float, step: float) -> Neighbour:
        """The same at a pose in steps, as of ``pose_steps.in_steps``."""
        return replace(self, other_from_body=in_steps(self.other_from_body, reach, step))

    def around_lamp(self, lamp: SpotLight, rounded: SpotLight, gap: float) -> Neighbour:
        """The same as it stands to a lamp whose place is rounded: what carries the lamp goes with
        it, and is turned in steps.

        gap : from the lamp to the body that it lights [m]
        """
        hull, pose = self.model.posed_mesh.hull, self.other_from_body
        place = pose[:3, :3] @ lamp.place + pose[:3, 3]
        if beyond_box(place, (hull.min(axis=0), hull.max(axis=0))) > _CARRIES * gap:
            return self
        moved = in_steps(pose, gap, _TURN).copy()
        moved[:3, 3] = place_without_noise(place) - moved[:3, :3] @ rounded.place
        return replace(self, other_from_body=moved)

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
class NearPair:
    """Light that goes from one spacecraft of some to another.

    receiver, sender : which of them
    sender_from_receiver : (4, 4) between their axes
    reach : between the centres of the bounding spheres [m]
    weight : of that light, 0 to 1; it rises from 0 as they come near
    """

    receiver: int
    sender: int
    sender_from_receiver: Array
    reach: float
    weight: float


@dataclass(frozen=True, kw_only=True, eq=False)
class IncidentLight:
    """What lights a spacecraft.

    sun_direction : (3,) unit, body axes; of the Moon where that gives more light
    sun_irradiance : (4,) past Earth and Moon [W m-2]
    before_sun : spacecraft that may shade it from the Sun
    lamps : that may light it
    around : every other spacecraft, which may stand between it and a lamp
    """

    sun_direction: Array
    sun_irradiance: Array
    before_sun: tuple[Neighbour, ...]
    lamps: tuple[SpotLight, ...]
    around: tuple[Neighbour, ...]

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
            *((lamp.beam, lamp.intensity.tobytes()) for lamp in self.lamps),
        )


def faded(share: float, threshold: float = THRESHOLD) -> float:
    """Weight of light that is so small a share of all: from 0 at the threshold to 1 at twice it."""
    t = min(max(share / threshold - 1.0, 0.0), 1.0)
    return t * t * (3.0 - 2.0 * t)


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
        matrix = without_noise(matrix)
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
                place=place_without_noise(here.position),
                axis=direction_without_noise(here.direction),
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
