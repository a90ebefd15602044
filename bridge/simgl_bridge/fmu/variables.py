"""The variables of an FMU: what an importer sets before a step, and reads after it."""

from __future__ import annotations

import re
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from math import inf
from typing import Literal

from simgl.errors import ConfigError
from simgl.physics.constants import ASTRONOMICAL_UNIT
from simgl.scenario.scenario import Scenario
from simgl.scene.state import SunAtPosition
from simgl_bridge.bind_address import DEFAULT_ADDRESS
from simgl_bridge.body_pose import BodyPose

Type = Literal["Float64", "Int64", "UInt16", "Boolean", "String", "Binary", "Enumeration"]
Causality = Literal["independent", "parameter", "input", "output"]

# Items of the enumeration of ``status``.
IMAGE_STATES = (
    ("none", 0, "no step has taken an image"),
    ("new", 1, "the last step took this image"),
    ("held", 2, "trigger was false: the image of an earlier step"),
)
_IDENTIFIER = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")


@dataclass(frozen=True, kw_only=True)
class Variable:
    """A variable of an FMU.

    name : structured, such as ``chaser.position_icrf_m``
    symbol : what the C code calls it; empty for those that it has in tables
    shape : sizes of an array; empty for a scalar
    start : of parameters and inputs, row by row
    smallest, largest : limits of each element
    continuous : an importer may interpolate it; other inputs and outputs change at steps
    """

    name: str
    type: Type
    causality: Causality
    description: str
    symbol: str = ""
    shape: tuple[int, ...] = ()
    start: tuple[float | int | str, ...] | None = None
    unit: str | None = None
    smallest: float = -inf
    largest: float = inf
    continuous: bool = False

    @property
    def size(self) -> int:
        """Number of elements."""
        size = 1
        for length in self.shape:
            size *= length
        return size


@dataclass(frozen=True, kw_only=True)
class CameraModel:
    """One camera of a scenario as an FMU.

    bodies : spacecraft that the importer places, in the order of their variables; the others
        follow the laws of the scenario
    sends_sun : the importer places the Sun, too
    """

    scenario: Scenario
    camera: str
    bodies: tuple[str, ...]
    sends_sun: bool
    address: str = DEFAULT_ADDRESS

    def joints(self, body: str) -> tuple[str, ...]:
        """The joints of a spacecraft that the importer moves: those that no law moves."""
        laws = self.scenario.joints.get(body)
        moved = set() if laws is None else set(laws.sunward)
        if laws is not None and laws.sampled is not None:
            moved |= set(laws.sampled.names)
        return tuple(j.name for j in self.scenario.models[body].joints if j.name not in moved)


def variables(model: CameraModel) -> tuple[Variable, ...]:
    """All variables; the value reference of each is its place.

    Raises ConfigError where two would have the same name, as with a spacecraft called ``camera``.
    """
    described = (
        *_parameters(model),
        *_settings(model),
        *(v for body in model.bodies for v in _body(model, body)),
        *_lamps(model),
        *_outputs(model),
    )
    names: set[str] = set()
    for variable in described:
        if variable.name in names:
            where = str(model.scenario.source or model.scenario.name)
            body = variable.name.partition(".")[0]
            problem = f'would be two variables of the FMU; give "{body}" another name'
            raise ConfigError(where, variable.name, problem)
        names.add(variable.name)
    return described


def structured_name(*parts: str) -> str:
    """A name of FMI's structured naming convention; raises ConfigError where there is none."""
    return ".".join(part if _IDENTIFIER.fullmatch(part) else _quoted(part) for part in parts)


def _quoted(part: str) -> str:
    if not (part.isascii() and part.isprintable()):
        problem = f"{part!r} cannot be the name of an FMI variable, which is printable ASCII"
        raise ConfigError("simgl fmu", "SCENARIO", problem)
    return "'" + re.sub(r"(['\"\\])", r"\\\1", part) + "'"


def _parameters(model: CameraModel) -> list[Variable]:
    scenario = model.scenario

    def parameter(
        name: str, type: Type, start: float | str, description: str, **more: object
    ) -> Variable:
        return Variable(
            name=name,
            symbol=name,
            type=type,
            causality="parameter",
            start=(start,),
            description=description,
            **more,  # type: ignore[arg-type]
        )

    source = "" if scenario.source is None else str(scenario.source.resolve())
    seconds = {"unit": "s", "smallest": 0.001, "largest": 100000.0}
    return [
        Variable(
            name="time",
            symbol="time",
            type="Float64",
            causality="independent",
            unit="s",
            description="of the importer",
        ),
        parameter(
            "server_address",
            "String",
            model.address,
            "of a running simgl serve; one is started where none is; empty always starts one",
        ),
        parameter("python", "String", sys.executable, "Python with simgl, to start a server with"),
        parameter("scenario", "String", source, "scenario file, to start a server with"),
        parameter("timeout_s", "Float64", 60.0, "a step ends with an error after it", **seconds),
        parameter(
            "ready_timeout_s", "Float64", 600.0, "the same of a server that starts", **seconds
        ),
        parameter(
            "epoch_tai_ns",
            "Int64",
            scenario.epoch_tai_ns,
            "TAI nanoseconds since 1970-01-01T00:00:00 TAI at time 0",
        ),
        parameter(
            "exposure_offset_s",
            "Float64",
            0.0,
            "from the start of a step to mid-exposure",
            unit="s",
        ),
        parameter(
            "motion_blur",
            "Boolean",
            0,
            "spacecraft move with their rates while the shutter is open",
        ),
    ]


def _settings(model: CameraModel) -> list[Variable]:
    camera = model.scenario.cameras[model.camera]
    settings = [
        Variable(
            name="trigger",
            symbol="trigger",
            type="Boolean",
            causality="input",
            start=(1,),
            description="whether the next step takes an image",
        ),
        Variable(
            name="exposure_time_s",
            symbol="exposure_time_s",
            type="Float64",
            causality="input",
            start=(camera.exposure_time,),
            unit="s",
            description="exposure time",
        ),
        Variable(
            name="gain_dn_per_e",
            symbol="gain_dn_per_e",
            type="Float64",
            causality="input",
            start=(camera.detector.gain_dn_per_e,),
            unit="DN/e-",
            description="gain of the detector",
        ),
        Variable(
            name="draw",
            symbol="draw",
            type="Int64",
            causality="input",
            start=(0,),
            smallest=0,
            largest=2**32 - 1,
            description="images of one time that differ in it have other noise",
        ),
    ]
    if model.sends_sun:
        settings.append(
            Variable(
                name="sun.position_icrf_m",
                symbol="sun_position_icrf_m",
                type="Float64",
                causality="input",
                shape=(3,),
                start=_sun_position(model.scenario),
                unit="m",
                continuous=True,
                description="Earth-centred, ICRF axes",
            )
        )
    return settings


def _sun_position(scenario: Scenario) -> tuple[float, ...]:
    """Where the Sun is at the epoch [m], or far away in the scenario's direction."""
    sun = scenario.at(scenario.epoch_tai_ns).sun
    if isinstance(sun, SunAtPosition):
        return tuple(sun.position.tolist())
    return tuple((ASTRONOMICAL_UNIT * sun.direction_icrf).tolist())


def _body(model: CameraModel, body: str) -> list[Variable]:
    """Thirteen numbers of the pose in the order that the C code takes, then the joints."""
    scenario = model.scenario
    pose = BodyPose.from_pose(scenario.poses(scenario.epoch_tai_ns)[body]).as_sent()
    parts: list[tuple[str, Sequence[float], str, str]] = [
        ("position_icrf_m", pose.position_m, "m", "body origin, Earth-centred, ICRF axes"),
        ("velocity_icrf_m_s", pose.velocity_m_s, "m/s", "ICRF axes"),
        (
            "q_icrf_from_body_xyzw",
            pose.q_icrf_from_body_xyzw,
            "1",
            "attitude, unit Hamilton quaternion, scalar last",
        ),
        (
            "angular_velocity_body_rad_s",
            pose.angular_velocity_rad_s,
            "rad/s",
            "relative to ICRF, body axes; used with motion_blur",
        ),
    ]
    pose_variables = [
        Variable(
            name=structured_name(body, name),
            type="Float64",
            causality="input",
            shape=(len(start),),
            start=tuple(start),
            unit=unit,
            continuous=True,
            description=description,
        )
        for name, start, unit, description in parts
    ]
    state = scenario.at(scenario.epoch_tai_ns).bodies[body].model
    angles = state.angles or (0.0,) * len(state.joints)
    moved = model.joints(body)
    return pose_variables + [
        Variable(
            name=structured_name(body, "joint", joint.name),
            type="Float64",
            causality="input",
            start=(float(angle),),
            unit="m" if joint.slides else "rad",
            smallest=joint.limits[0],
            largest=joint.limits[1],
            continuous=True,
            description="travel of a rail" if joint.slides else "angle of a hinge",
        )
        for joint, angle in zip(state.joints, angles, strict=True)
        if joint.name in moved
    ]


def _lamps(model: CameraModel) -> list[Variable]:
    return [
        Variable(
            name=structured_name("lamp", name),
            type="Float64",
            causality="input",
            start=(1.0,),
            unit="1",
            smallest=0.0,
            largest=1.0,
            description="share of the lamp's power",
        )
        for name in model.scenario.lamps
    ]


def _outputs(model: CameraModel) -> list[Variable]:
    detector = model.scenario.cameras[model.camera].detector
    shape = (detector.height, detector.width)

    def output(
        name: str,
        type: Type,
        description: str,
        unit: str | None = None,
        shape: tuple[int, ...] = (),
    ) -> Variable:
        return Variable(
            name=name,
            symbol=name.replace(".", "_"),
            type=type,
            causality="output",
            unit=unit,
            shape=shape,
            description=description,
        )

    return [
        output("image", "UInt16", "DN, row 0 at the top", shape=shape),
        output("image_binary", "Binary", "the same as little-endian uint16, row by row"),
        output("status", "Enumeration", "of the image"),
        output("frame_number", "Int64", "counts the images, from 1; 0 before the first"),
        output("frame_hash", "String", "of the image's bytes: BLAKE2b with 16 bytes"),
        output("state_hash", "String", "of the state that the image shows"),
        output("saturated_share", "Float64", "of the pixels, at full scale or full well", "1"),
        output("mid_exposure_s", "Float64", "mid-exposure, in the importer's time", "s"),
        output("mid_exposure_tai_ns", "Int64", "mid-exposure"),
        output("available_s", "Float64", "when flight software receives the image", "s"),
        output("camera.position_icrf_m", "Float64", "of the pinhole", "m", (3,)),
        output(
            "camera.q_camera_from_icrf_xyzw",
            "Float64",
            "camera axes are z boresight, x right, y down",
            "1",
            (4,),
        ),
        output("camera.intrinsics", "Float64", "from camera axes to pixels", "1", (3, 3)),
        output("server", "String", "the server in use, and whether it was found or started"),
    ]
