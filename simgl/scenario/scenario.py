"""A scenario: everything that is constant while it runs, and the laws of motion of the rest."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal

import numpy as np

from simgl.arrays import Array
from simgl.camera.camera import Camera
from simgl.errors import ConfigError
from simgl.html_table import html_table
from simgl.motion.drives import JointLaws
from simgl.motion.mounts import (
    Motions,
    Mount,
    at_joints,
    camera_pose,
    camera_velocity,
    motion_of,
)
from simgl.motion.trajectory import Motion, poses
from simgl.physics.constants import SOLAR_RADIUS
from simgl.physics.ephemeris import itrf_from_icrf, moon_position, sun_position, utc_from_tai_ns
from simgl.physics.frames import Pose
from simgl.physics.lunar_model import moon_from_icrf
from simgl.physics.solar_disc import UNIFORM
from simgl.physics.spectrum import BandLight, Bands
from simgl.scenario.given_poses import check_given
from simgl.scenario.requirements import Requirement
from simgl.scenario.schema import UsabilityCriteria
from simgl.scenario.uncertainty import Uncertainty
from simgl.scene.earth import Earth
from simgl.scene.lamps import Lamp, lamp_state
from simgl.scene.spacecraft import SpacecraftModel
from simgl.scene.star_catalogue import StarCatalogue, star_sky
from simgl.scene.state import (
    BodyState,
    CameraState,
    EarthState,
    SceneState,
    Sun,
    SunAtPosition,
    SunInDirection,
)
from simgl.value_checks import (
    LARGEST_SEED,
    LARGEST_TIME,
    check_choice,
    check_integer,
    check_positive,
)


@dataclass(frozen=True, kw_only=True, eq=False)
class EphemerisSun:
    """The real Sun's place with a given light and size.

    light_at_1_au : per band
    radius : [m]
    visible : draw the disc
    limb : (2, 4) darkening of the disc towards its limb
    """

    light_at_1_au: BandLight
    radius: float = SOLAR_RADIUS
    visible: bool = True
    limb: Array = field(default_factory=UNIFORM.copy)

    @property
    def bands(self) -> Bands:
        """Of its light."""
        return self.light_at_1_au.bands

    def at(self, tai_ns: int, position: Array | None = None) -> Sun:
        """The Sun at an epoch, or at a position (3,) in place of the ephemeris' [m]."""
        return SunAtPosition(
            position=sun_position(tai_ns) if position is None else position,
            light_at_1_au=self.light_at_1_au,
            radius=self.radius,
            visible=self.visible,
            limb=self.limb,
        )


def joint_motions(bodies: Mapping[str, BodyState]) -> Motions:
    """How the joints of spacecraft have moved what they carry."""
    return {name: body.model.posed_mesh.motion for name, body in bodies.items()}


@dataclass(frozen=True, kw_only=True, eq=False)
class Scenario:
    """The content of a scenario file, in SI units.

    name : in file headers and messages; of a file its stem
    source : the file; None for a scenario made in memory
    epoch_tai_ns : start, TAI nanoseconds since 1970-01-01T00:00:00 TAI
    sun : its ephemeris, or a fixed direction and irradiance
    earth : surface, clouds and air; None in deep space
    models : spacecraft name to its shape and surfaces
    motions : spacecraft name to its laws of position and attitude
    cameras : camera name to its lens, detector and settings
    mounts : camera name to its place and pointing
    lamps : lamp name to its light and place
    joints : spacecraft name to the laws of its joints
    criteria : limits of a usable image of a target
    requirements : on the images of a run
    uncertainty : standard deviations for the draws of an assessment; None for no draws
    seed : of all noise
    samples_per_pixel : geometry samples; chosen by the renderer if None
    inter_reflection : interreflection within a spacecraft, and its occlusion of the Earth
    between_spacecraft : light from one spacecraft to another nearby, at vertices
    gather : interreflection at vertices, or by rays from every sample of every pixel
    glossy_reflections : glossy surfaces reflect their spacecraft by rays, not a uniform mean
    joint_light : interreflection with moved joints: "quick" by pairs of rigid parts, "exact" by a
        bake of each pose
    stars : None for a sky without stars
    thermal_patches : approximate number of patches per spacecraft for its temperatures
    thermal_step : time between two evaluations of the light in a temperature history [s]
    inputs : the files that it was read from, with the SHA-256 of each
    """

    name: str
    source: Path | None
    epoch_tai_ns: int
    sun: EphemerisSun | SunInDirection
    earth: Earth | None
    models: Mapping[str, SpacecraftModel]
    motions: Mapping[str, Motion]
    cameras: Mapping[str, Camera]
    mounts: Mapping[str, Mount]
    lamps: Mapping[str, Lamp] = field(default_factory=dict)
    joints: Mapping[str, JointLaws] = field(default_factory=dict)
    criteria: UsabilityCriteria = field(default_factory=UsabilityCriteria)
    requirements: tuple[Requirement, ...] = ()
    uncertainty: Uncertainty | None = None
    seed: int = 0
    samples_per_pixel: int | None = None
    inter_reflection: bool = True
    between_spacecraft: bool = False
    gather: Literal["vertex", "pixel"] = "vertex"
    glossy_reflections: bool = False
    joint_light: Literal["exact", "quick"] = "exact"
    stars: StarCatalogue | None = None
    thermal_patches: int = 1500
    thermal_step: float = 30.0
    # What counts of them is in the fields above.
    inputs: Mapping[Path, str] = field(default_factory=dict, compare=False)

    def __post_init__(self) -> None:
        check_integer("seed", self.seed, 0, LARGEST_SEED)
        if self.samples_per_pixel is not None:
            check_integer("samples_per_pixel", self.samples_per_pixel, 1, 256)
        check_integer("thermal_patches", self.thermal_patches, 1, 6000)
        check_positive("thermal_step", self.thermal_step)
        check_choice("gather", self.gather, ("vertex", "pixel"))
        check_choice("joint_light", self.joint_light, ("exact", "quick"))

    @property
    def bands(self) -> Bands:
        """The bands of all light and reflectances."""
        return self.sun.bands

    def _repr_html_(self) -> str:
        title = f"Scenario {self.name}, {utc_from_tai_ns(self.epoch_tai_ns)} UTC"
        models = [
            (name, model.name, f"{len(model.mesh.triangles):,}", ", ".join(model.keypoints))
            for name, model in self.models.items()
        ]
        cameras = [
            (
                name,
                f"{camera.detector.width} x {camera.detector.height}",
                f"{1e3 * camera.lens.focal_length:g}",
                f"{camera.lens.f_number:g}",
                f"{1e3 * camera.exposure_time:g}",
            )
            for name, camera in self.cameras.items()
        ]
        of_models = ("spacecraft", "model", "triangles", "keypoints")
        of_cameras = ("camera", "pixels", "focal length [mm]", "f-number", "exposure time [ms]")
        return html_table(title, of_models, models) + html_table("Cameras", of_cameras, cameras)

    def at(self, tai_ns: int) -> SceneState:
        """The scene by the scenario's laws of motion.

        tai_ns : epoch, TAI nanoseconds since 1970-01-01T00:00:00 TAI

        Raises ConfigError where the data of a trajectory do not cover the epoch; ValueError for a
        time that is no integer, or before 1970.
        """
        return self.with_poses(tai_ns, {})

    def around(self, tai_ns: int) -> Callable[[int], SceneState]:
        """The scene as a function of time [TAI ns] during an exposure.

        tai_ns : mid-exposure, TAI nanoseconds since 1970-01-01T00:00:00 TAI

        If the data of a trajectory end within the exposure, the scene is static.
        """
        middle = self.at(tai_ns)

        def near(other_tai_ns: int) -> SceneState:
            try:
                return self.at(other_tai_ns)
            except ConfigError:
                return middle

        return near

    def poses(self, tai_ns: int) -> dict[str, Pose]:
        """Spacecraft name to its pose by the laws of motion.

        tai_ns : epoch, TAI nanoseconds since 1970-01-01T00:00:00 TAI
        """
        with self._named_in_errors():
            return poses(self.motions, tai_ns)

    def models_at_epoch(self) -> list[SpacecraftModel]:
        """The spacecraft models with the joints of the scenario's epoch."""
        return [body.model for body in self.at(self.epoch_tai_ns).bodies.values()]

    @contextmanager
    def _named_in_errors(self) -> Iterator[None]:
        """Put the file's name before errors of the laws of motion, which know only their tables."""
        try:
            yield
        except ConfigError as error:
            where = f"{self.source or self.name} {error.where}"
            raise ConfigError(where, error.key, error.problem) from None

    def with_poses(
        self,
        tai_ns: int,
        bodies: Mapping[str, Pose],
        exposure_times: Mapping[str, float] | None = None,
        joint_angles: Mapping[str, Mapping[str, float]] | None = None,
        sun: Array | None = None,
    ) -> SceneState:
        """The scene with given poses, for instance from a simulation.

        tai_ns : epoch, TAI nanoseconds since 1970-01-01T00:00:00 TAI
        bodies : spacecraft to pose; spacecraft that are not listed follow their laws of motion, and
            a law relative to a listed spacecraft follows its pose
        exposure_times : camera name to exposure time [s], if different from the file
        joint_angles : spacecraft to joint to angle [rad] or travel [m]; joints that are not listed
            follow their laws
        sun : (3,) position of the Sun that replaces the scenario's, Earth-centred ICRF [m]; if the
            scenario gives the Sun by direction and irradiance, only the direction is used

        Raises ConfigError for a name that is not the scenario's, and for a pose that is not finite
        or whose matrix is not a rotation; ValueError for a time that is no integer, or before 1970.
        """
        check_integer("tai_ns", tai_ns, 0, LARGEST_TIME)
        if sun is not None and not 0.0 < np.linalg.norm(sun) < np.inf:
            raise ValueError(f"sun must be a position away from the origin, got {sun}")
        given = joint_angles or {}
        with self._named_in_errors():
            known = self.motions.keys() | self.models.keys()
            check_given(bodies, given, exposure_times or (), known, self.cameras)
        earth = None
        if self.earth is not None:
            earth = EarthState(
                earth=self.earth,
                position=np.zeros(3),
                R_itrf_from_icrf=itrf_from_icrf(tai_ns),
            )
        light = self._sun(tai_ns, sun)
        moon = moon_position(tai_ns) if isinstance(self.sun, EphemerisSun) else None
        with self._named_in_errors():
            placed = poses(self.motions, tai_ns, bodies)
            body_states = {
                name: self._body(name, tai_ns, light, placed[name], given.get(name, {}))
                for name in self.models
            }
            motions = joint_motions(body_states)
            cameras = self._cameras(exposure_times or {}, placed, motions, light, earth)
            lamps = tuple(
                lamp_state(lamp, placed, motion_of(lamp.spacecraft, lamp.group, motions))
                for lamp in self.lamps.values()
            )
        return SceneState(
            tai_ns=tai_ns,
            sun=light,
            earth=earth,
            moon=moon,
            bodies=body_states,
            cameras=cameras,
            lamps=lamps,
            R_moon_from_icrf=None if moon is None else moon_from_icrf(tai_ns),
            stars=None if self.stars is None else star_sky(self.stars, tai_ns, self.bands),
        )

    def _cameras(
        self,
        exposure_times: Mapping[str, float],
        placed: Mapping[str, Pose],
        motions: Motions,
        sun: Sun,
        earth: EarthState | None,
    ) -> dict[str, CameraState]:
        """The cameras on their mounts, among the placed spacecraft."""
        states = {}
        for name, camera in self.cameras.items():
            mount = at_joints(self.mounts[name], motions)
            position, R_camera_from_icrf = camera_pose(
                name, mount, placed, lambda place: sun.seen_from(place).direction_icrf, earth
            )
            if name in exposure_times:
                camera = replace(camera, exposure_time=exposure_times[name])
            states[name] = CameraState(
                camera=camera,
                position=position,
                R_camera_from_icrf=R_camera_from_icrf,
                velocity=camera_velocity(mount, placed),
            )
        return states

    def _sun(self, tai_ns: int, position: Array | None) -> Sun:
        """The Sun at an epoch, at a given position where there is one."""
        if isinstance(self.sun, EphemerisSun):
            return self.sun.at(tai_ns, position)
        if position is None:
            return self.sun
        return replace(self.sun, direction_icrf=position / np.linalg.norm(position))

    def _body(
        self, name: str, tai_ns: int, sun: Sun, pose: Pose, given: Mapping[str, float]
    ) -> BodyState:
        """A spacecraft with its joints where their laws, or given angles [rad] or travels [m], put
        them."""
        model = self.models[name]
        laws = self.joints.get(name)
        if not given and (laws is None or not model.joints):
            return BodyState(model=model, pose=pose)
        sunward = pose.R_icrf_from_body.T @ sun.seen_from(pose.position).direction_icrf
        angles = (laws or JointLaws()).angles(model.joints, tai_ns, sunward, given)
        return BodyState(model=model.posed(angles), pose=pose)
