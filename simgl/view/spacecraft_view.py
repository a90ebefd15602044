"""Spacecraft before a camera: float64 places and light of the scene, as float32 camera axes."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from simgl.arrays import Array, Array32
from simgl.errors import ConfigError
from simgl.physics.frames import moved, norm
from simgl.radiosity.incident_light import IncidentLight, incident_light
from simgl.scene.spacecraft import SpacecraftModel
from simgl.scene.state import BodyState, CameraState, EarthState, SceneState
from simgl.view.aerial_perspective import AirSegment, air_between
from simgl.view.background import SkyView, sky_view
from simgl.view.light_spread import LightSpread
from simgl.view.near_spacecraft import NearGroup, near_groups
from simgl.view.row_clock import PoseMotion, camera_from_body
from simgl.view.shadow_views import ShadowView, TurnedFrom, shadow_view


@dataclass(frozen=True, kw_only=True, eq=False)
class SpacecraftView:
    """A spacecraft before the camera.

    instance : index in the scene, counted from 1 (0 is no spacecraft)
    camera_from_body : (4, 4) float32
    sun_direction : (3,) float32 unit, camera axes; of the Moon where that gives more light, and so
        are the other values of the Sun
    sun_irradiance : (4,) float32 [W m-2], the eclipse by the Earth included
    sun_limb : (2, 4) limb darkening u and v per band: 1 - u (1 - mu) - v (1 - mu)^2
    sun_angular_radius : [rad]
    sky : None where there is no Earth
    incident_light : None where light between its surfaces is left out
    near : those that it exchanges light with; None for none
    air : on the way to the camera; None where there is none
    motion : while rows are exposed one after the other; None where it stands still for all of them
    light_spread : while the shutter is open; None where it has the light of one time
    """

    name: str
    instance: int
    model: SpacecraftModel
    camera_from_body: Array32
    sun_direction: Array32
    sun_irradiance: Array32
    sun_limb: Array32
    sun_angular_radius: float
    shadow: ShadowView
    sky: SkyView | None
    incident_light: IncidentLight | None
    near: NearGroup | None = None
    air: AirSegment | None = None
    motion: PoseMotion | None = None
    light_spread: LightSpread | None = None

    @property
    def lit_variant(self) -> tuple[str, ...]:
        """What shaders of its light are defined by."""
        motion = () if self.motion is None else self.motion.variant
        return motion if self.light_spread is None else (*motion, "SPREAD_LIGHT")

    def in_cells(self, per_pixel: float) -> SpacecraftView:
        """The same where a pixel has so many cells along its edge."""
        if self.light_spread is None:
            return self
        return replace(self, light_spread=replace(self.light_spread, cells=per_pixel))

    @cached_property
    def sky_from_camera(self) -> Array:
        """(4, 4) turns directions to the axes of its sky; 1 where there is none."""
        matrix = np.eye(4)
        if self.sky is not None:
            matrix[:3, :3] = self.sky.R_sky_from_body @ self.camera_from_body[:3, :3].T
        return matrix


@dataclass(frozen=True, kw_only=True, eq=False)
class ShadowsOf:
    """A state whose shadow maps others share.

    camera : then
    turn : their light comes from within so much of what it does then, body axes [rad]
    while_open : they turn by so much while a row is exposed [rad]
    """

    state: SceneState
    camera: CameraState
    turn: float
    while_open: float

    def of(self, name: str) -> TurnedFrom:
        """For one of the spacecraft."""
        body = self.state.bodies[name]
        sun = self.state.direct_light(body.pose.position).main
        inverse = np.linalg.inv(camera_from_body(self.camera, body))
        return TurnedFrom(
            sun_body=body.pose.R_icrf_from_body.T @ sun.direction_icrf,
            body_from_camera=np.asarray(inverse, dtype=np.float64),
            turn=self.turn,
            while_open=self.while_open,
        )


def _float32(values: Array) -> Array32:
    return np.asarray(values, dtype=np.float32)


def _hidden_by_earth(earth: EarthState | None, camera: Array, body: Array) -> bool:
    """Whether the straight line between two places runs through the Earth."""
    if earth is None:
        return False
    radii = np.array(earth.earth.radii)
    start = (earth.R_itrf_from_icrf @ (camera - earth.position)) / radii
    line = (earth.R_itrf_from_icrf @ (body - camera)) / radii
    nearest = np.clip(-np.dot(start, line) / np.dot(line, line), 0.0, 1.0)
    return bool(norm(start + nearest * line) < 1.0)


def _refuse_inside(camera: CameraState, name: str, body: BodyState) -> None:
    if body.encloses(camera.position):
        place = ", ".join(f"{v:.3f}" for v in body.in_body(camera.position))
        raise ConfigError(
            f"[camera.{camera.camera.name}]",
            "position",
            f'is inside the body of "{name}" (at {place} m in its axes)',
        )


def spacecraft_views(
    state: SceneState,
    camera: CameraState,
    inter_reflection: bool,
    *,
    between_spacecraft: bool = False,
    shadows: ShadowsOf | None = None,
    samples_per_pixel: float | None = None,
    shown: frozenset[str] | None = None,
) -> list[SpacecraftView]:
    """All spacecraft that the Earth does not hide from the camera.

    inter_reflection : with the light between the surfaces of each
    between_spacecraft : and that between those near to each other
    shadows : whose shadow maps they have; None for their own
    samples_per_pixel : that the scenario asks for
    shown : which of them; None for all

    Raises ConfigError where the camera is inside a body.
    """
    views = []
    groups = near_groups(state) if inter_reflection and between_spacecraft else {}
    for index, (name, body) in enumerate(state.bodies.items()):
        _refuse_inside(camera, name, body)
        if shown is not None and name not in shown:
            continue
        if _hidden_by_earth(state.earth, camera.position, body.pose.position):
            continue
        sun = state.direct_light(body.pose.position).main
        matrix = camera_from_body(camera, body)
        body_from_camera: Array = np.linalg.inv(matrix).astype(np.float64)
        views.append(
            SpacecraftView(
                name=name,
                instance=index + 1,
                model=body.model,
                camera_from_body=_float32(matrix),
                sun_direction=_float32(camera.R_camera_from_icrf @ sun.direction_icrf),
                sun_irradiance=_float32(sun.irradiance),
                sun_limb=_float32(sun.limb),
                sun_angular_radius=sun.angular_radius,
                sky=sky_view(state, name, body),
                incident_light=incident_light(state, body) if inter_reflection else None,
                near=groups.get(name),
                shadow=shadow_view(
                    state,
                    body,
                    camera.camera,
                    sun,
                    body_from_camera,
                    None if shadows is None else shadows.of(name),
                    samples_per_pixel,
                ),
                air=air_between(state, camera.position, body.pose.position),
            )
        )
    return views


def hull_in_camera(view: SpacecraftView) -> Array:
    """(n, 3) corners of its hull, each at its row's own time, camera axes [m]."""
    hull = view.model.posed_mesh.hull
    if view.motion is not None:
        return view.motion.moved(hull)
    m = view.camera_from_body.astype(np.float64)
    return moved(hull, m[:3, :3], m[:3, 3])


def hulls_at_the_ends(view: SpacecraftView) -> tuple[Array, Array]:
    """The same at the times of the first and of the last row."""
    assert view.motion is not None
    first, last = (
        replace(view, motion=None, camera_from_body=_float32(view.motion.at(time)))
        for time in (-1.0, 1.0)
    )
    return hull_in_camera(first), hull_in_camera(last)


def settled_view(view: SpacecraftView) -> SpacecraftView:
    """A spacecraft that moves, as it stands when its middle's row is exposed."""
    assert view.motion is not None
    middle = view.model.posed_mesh.centre[None]
    pose = view.motion.at(float(view.motion.row_times(middle)[0]))
    return replace(view, motion=None, camera_from_body=_float32(pose))
