"""The ``[spacecraft.NAME]`` tables: model, trajectory, attitude and joints."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from simgl.arrays import Array
from simgl.config.path_sandbox import Base
from simgl.config.validation import exactly_one, shown
from simgl.config.value_types import direction
from simgl.errors import AssetError, ConfigError, did_you_mean
from simgl.model_files.model_library import UNITS, load_model
from simgl.model_files.surface_tables import PrimitiveTable, read_primitive
from simgl.motion.drives import JointLaws
from simgl.motion.files.motion_reader import (
    DEFAULT_ALLOWED_ERROR,
    read_angles,
    read_attitude,
    read_path,
)
from simgl.motion.files.spice import (
    DEFAULT_SPAN,
    SpiceSource,
    read_spice_path,
    read_spice_rotations,
)
from simgl.motion.joints import chain, unknown_joint
from simgl.motion.orbits import KeplerianOrbit
from simgl.motion.samples import Path as SampledPath
from simgl.motion.trajectory import (
    Attitude,
    FixedAttitude,
    LvlhAttitude,
    Motion,
    PointingAttitude,
    RelativeOrbit,
    RelativePath,
    RelativeUniformMotion,
    SampledAttitude,
    Trajectory,
    UniformMotion,
)
from simgl.physics.constants import WGS84_EQUATORIAL_RADIUS
from simgl.physics.frames import matrix_from_quaternion
from simgl.scenario.schema import MotionFileTable, OrbitTable, SpacecraftTable
from simgl.scenario.table_checks import check_place
from simgl.scene.spacecraft import SpacecraftModel

# Keys of a model file that is not in metres and body axes.
FILE_KEYS = ("unit", "unit_m", "up_axis", "forward_axis")
_PLACES = ("orbit", "trajectory", "relative_to", "position_icrf_m")
_ATTITUDES = (
    "attitude",
    "quaternion_icrf_from_body_xyzw",
    "quaternion_lvlh_from_body_xyzw",
    "point_at",
    "attitude_file",
)
_OF_POSITIONS = "is allowed only for positions"
_OF_SEVERAL = "is allowed only for files of several objects"


def read_model(where: str, name: str, table: SpacecraftTable, base: Base) -> SpacecraftModel:
    """The model of a spacecraft: a file, a shipped model or a primitive.

    base : folder that relative paths start from
    """
    if table.model is None:
        raise ConfigError(where, "model", "is missing")
    if isinstance(table.model, PrimitiveTable):
        for key in FILE_KEYS:
            if getattr(table, key) is not None:
                problem = "is allowed only for a mesh file; a primitive is in metres and body axes"
                raise ConfigError(where, key, problem)
        return read_primitive(table.model, name, where, base)
    if table.unit is not None and table.unit_m is not None:
        raise ConfigError(where, "unit_m", "contradicts unit; give one of them")
    unit_m = table.unit_m if table.unit is None else UNITS[table.unit]
    try:
        with _named_in_errors(where, "model"):
            return load_model(table.model, base, unit_m, table.up_axis, table.forward_axis)
    except ValueError as error:
        raise ConfigError(where, "forward_axis", str(error)) from None


@contextmanager
def _named_in_errors(where: str, key: str) -> Iterator[None]:
    """Put table and key before the error of a file that the key names."""
    try:
        yield
    except AssetError as error:
        raise AssetError(f"{where}: {key}: {error}") from None


class MotionReader:
    """Reads the laws of motion from one ``[spacecraft.NAME]`` table.

    base : folder that relative paths start from
    """

    def __init__(
        self,
        where: str,
        name: str,
        table: SpacecraftTable,
        spacecraft_names: Collection[str],
        epoch_tai_ns: int,
        base: Base,
    ) -> None:
        self._where, self._name, self._table = where, name, table
        self._others = [n for n in spacecraft_names if n != name]
        self._epoch_tai_ns, self._base = epoch_tai_ns, base

    def motion(self) -> Motion:
        """Trajectory and attitude; raises ConfigError or AssetError."""
        return Motion(trajectory=self._trajectory(), attitude=self._attitude())

    def _other(self, key: str, name: str) -> str:
        if name == self._name:
            raise ConfigError(self._where, key, "names the spacecraft itself; name another one")
        if name not in self._others:
            problem = (
                f"names no other spacecraft: {shown(name)}; {did_you_mean(name, self._others)}"
            )
            raise ConfigError(self._where, key, problem)
        return name

    def _trajectory(self) -> Trajectory:
        t = self._table
        if t.trajectory is not None:
            return self._from_file(t.trajectory)
        check_place(t, self._where, _PLACES)
        if t.drift and t.relative_to is None:
            raise ConfigError(self._where, "drift", "requires relative_to")
        if t.orbit is not None:
            return _orbit(t.orbit, self._where, self._epoch_tai_ns)
        if t.relative_to is not None:
            return self._relative(self._other("relative_to", t.relative_to))
        return UniformMotion(
            position=np.array(t.position_icrf_m),
            velocity=np.array(t.velocity_icrf_m_s or (0.0, 0.0, 0.0)),
            epoch_tai_ns=self._epoch_tai_ns,
        )

    def _relative(self, reference: str) -> Trajectory:
        t = self._table
        if t.position_lvlh_m is None:
            raise ConfigError(self._where, "position_lvlh_m", "is missing beside relative_to")
        law = RelativeOrbit if t.drift else RelativeUniformMotion
        return law(
            reference=reference,
            position_lvlh=np.array(t.position_lvlh_m),
            velocity_lvlh=np.array(t.velocity_lvlh_m_s or (0.0, 0.0, 0.0)),
            epoch_tai_ns=self._epoch_tai_ns,
        )

    def _from_file(self, given: str | MotionFileTable) -> Trajectory:
        t = self._table
        for key in ("orbit", "position_icrf_m", "velocity_icrf_m_s", "position_lvlh_m"):
            if getattr(t, key) is not None:
                raise ConfigError(self._where, key, "contradicts trajectory; give one of them")
        for key in ("velocity_lvlh_m_s", "drift"):
            if getattr(t, key):
                raise ConfigError(self._where, key, "requires relative_to, got trajectory")
        file = _as_table(given)
        self._refuse("trajectory", file, "frame", "is allowed only in attitude_file")
        if file.naif_id is not None:
            if t.relative_to is not None:
                problem = "is allowed only for positions in LVLH axes; SPICE's are about the Earth"
                raise ConfigError(self._where, "relative_to", problem)
            allowed = file.interpolation_error_m or DEFAULT_ALLOWED_ERROR
            return read_spice_path(self._spice("trajectory", file), file.naif_id, allowed)
        self._refuse("trajectory", file, "span_s", "requires naif_id")
        with _named_in_errors(self._where, "trajectory"):
            path, in_lvlh = read_path(
                self._base / file.file,
                self._epoch_tai_ns,
                name=file.object,
                longest_gap_s=file.longest_gap_s,
                allowed_error=file.interpolation_error_m,
            )
        if not isinstance(path, SampledPath) or not in_lvlh:
            if t.relative_to is not None:
                problem = "is allowed only for positions in LVLH axes; those of the file are not"
                raise ConfigError(self._where, "relative_to", problem)
            return path
        if t.relative_to is None:
            problem = "is missing: the places of the file are in LVLH axes of another spacecraft"
            raise ConfigError(self._where, "relative_to", problem)
        return RelativePath(reference=self._other("relative_to", t.relative_to), path=path)

    def _spice(self, key: str, file: MotionFileTable) -> SpiceSource:
        """The meta-kernel of a table; raises ConfigError or AssetError."""
        self._refuse(key, file, "object", f"{_OF_SEVERAL}; SPICE has naif_id and frame")
        problem = "is allowed only for samples in files; SPICE states its coverage"
        self._refuse(key, file, "longest_gap_s", problem)
        span_s = DEFAULT_SPAN if file.span_s is None else file.span_s
        if not span_s[0] < span_s[1]:
            problem = f"must begin before it ends, got {list(span_s)}"
            raise ConfigError(self._where, f"{key}.span_s", problem)
        with _named_in_errors(self._where, key):
            path = Path(self._base / file.file)
            return SpiceSource(path=path, epoch_tai_ns=self._epoch_tai_ns, span_s=span_s)

    def joint_laws(self, model: SpacecraftModel) -> JointLaws:
        """How the joints of its model move; raises ConfigError or AssetError."""
        t = self._table
        fixed: dict[str, float] = {}
        for key in ("joints_deg", "joints_m"):
            for name, value in (getattr(t, key) or {}).items():
                slides = key == "joints_m"
                fixed[name] = value if slides else float(np.radians(value))
                self._check_joint(model, f"{key}.{name}", name, [fixed[name]], slides=slides)
        self._check_drives(model)
        sampled = None
        if t.joint_file is not None:
            file = _as_table(t.joint_file)
            self._refuse("joint_file", file, "interpolation_error_m", _OF_POSITIONS)
            self._refuse("joint_file", file, "object", _OF_SEVERAL)
            for unused in ("naif_id", "frame", "span_s"):
                self._refuse("joint_file", file, unused, "is allowed only for SPICE meta-kernels")
            with _named_in_errors(self._where, "joint_file"):
                sampled = read_angles(
                    self._base / file.file, self._epoch_tai_ns, longest_gap_s=file.longest_gap_s
                )
            for name, values in zip(sampled.names, sampled.angles.T, strict=True):
                slides = name in sampled.slides
                self._check_joint(model, "joint_file", name, values.tolist(), slides=slides)
        moved = [*fixed, *t.sun_tracking, *(sampled.names if sampled else ())]
        for name in moved:
            if moved.count(name) > 1:
                problem = f"and the other keys move {shown(name)} twice"
                raise ConfigError(self._where, "joints_deg", problem)
        return JointLaws(fixed=fixed, sampled=sampled, sunward=t.sun_tracking)

    def _check_drives(self, model: SpacecraftModel) -> None:
        """Raise ConfigError for drives that cannot follow the Sun."""
        drives = {n: self._joint(model, "sun_tracking", n) for n in self._table.sun_tracking}
        for name, index in drives.items():
            carriers = [model.joints[i].name for i in chain(model.joints, index)]
            stacked = [other for other in reversed(carriers) if other in drives]
            if len(stacked) > 2:
                problem = f"has {', '.join(stacked)} each on the one before; at most two may follow"
                raise ConfigError(self._where, "sun_tracking", problem)
            carries_drives = any(
                index in chain(model.joints, other) for other in drives.values() if other != index
            )
            if model.joints[index].sunward_body is None and not carries_drives:
                problem = f"cannot turn {shown(name)} to the Sun: its model names no sunward_body"
                raise ConfigError(self._where, "sun_tracking", problem)

    def _joint(self, model: SpacecraftModel, key: str, name: str) -> int:
        index = next((i for i, j in enumerate(model.joints) if j.name == name), None)
        if index is None:
            problem = f"{shown(name)} {unknown_joint(name, model.joints)}"
            raise ConfigError(self._where, key, problem)
        return index

    def _check_joint(
        self, model: SpacecraftModel, key: str, name: str, values: list[float], *, slides: bool
    ) -> None:
        """Raise ConfigError for a wrong kind of joint or values [rad] or [m] out of range."""
        joint = model.joints[self._joint(model, key, name)]
        if joint.slides != slides:
            way = "slides, by metres" if joint.slides else "turns, by degrees"
            raise ConfigError(self._where, key, f"{shown(name)} {way}")
        (verb, unit), scale = ("move", "m"), 1.0
        if not slides:
            (verb, unit), scale = ("turn", "deg"), float(np.degrees(1.0))
        low, high = (scale * limit for limit in joint.limits)
        for value in (scale * v for v in values):
            if not low - 1e-9 <= value <= high + 1e-9:
                problem = (
                    f"must {verb} {shown(name)} within {low:g}..{high:g} {unit}, got {value:g}"
                )
                raise ConfigError(self._where, key, problem)

    def _attitude(self) -> Attitude:
        t = self._table
        given = [k for k in _ATTITUDES if getattr(t, k) is not None]
        if len(given) > 1:
            raise ConfigError(self._where, given[1], f"contradicts {given[0]}; give one of them")
        if t.attitude_file is not None:
            file = _as_table(t.attitude_file)
            self._refuse("attitude_file", file, "interpolation_error_m", _OF_POSITIONS)
            self._refuse("attitude_file", file, "naif_id", "is allowed only in trajectory")
            if file.frame is not None:
                rotations = read_spice_rotations(self._spice("attitude_file", file), file.frame)
                return SampledAttitude(rotations=rotations, in_lvlh=False)
            self._refuse("attitude_file", file, "span_s", "requires frame")
            with _named_in_errors(self._where, "attitude_file"):
                return read_attitude(
                    self._base / file.file,
                    self._epoch_tai_ns,
                    name=file.object,
                    longest_gap_s=file.longest_gap_s,
                )
        if t.quaternion_icrf_from_body_xyzw is not None:
            return FixedAttitude(R_icrf_from_body=self._matrix(given[0]))
        if t.quaternion_lvlh_from_body_xyzw is not None:
            return LvlhAttitude(R_lvlh_from_body=self._matrix(given[0]))
        if t.point_at is not None:
            return PointingAttitude(
                target=self._other("point_at.target", t.point_at.target),
                axis_body=direction(t.point_at.axis_body, self._where, "point_at.axis_body"),
            )
        fixed = t.attitude == "icrf" or (t.attitude is None and t.position_icrf_m is not None)
        if fixed:
            return FixedAttitude(R_icrf_from_body=np.eye(3))
        return LvlhAttitude(R_lvlh_from_body=np.eye(3))

    def _refuse(self, key: str, file: MotionFileTable, unused: str, problem: str) -> None:
        if getattr(file, unused) is not None:
            raise ConfigError(self._where, f"{key}.{unused}", problem)

    def _matrix(self, key: str) -> Array:
        try:
            return matrix_from_quaternion(getattr(self._table, key))
        except ValueError as error:
            raise ConfigError(self._where, key, str(error)) from None


def _as_table(given: str | MotionFileTable) -> MotionFileTable:
    return MotionFileTable(file=given) if isinstance(given, str) else given


def _orbit(table: OrbitTable, where: str, epoch_tai_ns: int) -> KeplerianOrbit:
    sizes = {"altitude_km": table.altitude_km, "semi_major_axis_km": table.semi_major_axis_km}
    exactly_one(sizes, where, "orbit")
    if table.altitude_km is not None:
        if table.eccentricity != 0.0:
            raise ConfigError(where, "orbit.eccentricity", "requires semi_major_axis_km")
        axis = WGS84_EQUATORIAL_RADIUS + table.altitude_km * 1e3
    else:
        assert table.semi_major_axis_km is not None
        axis = table.semi_major_axis_km * 1e3
    perigee = axis * (1.0 - table.eccentricity)
    if perigee <= WGS84_EQUATORIAL_RADIUS:
        problem = f"has its perigee {(WGS84_EQUATORIAL_RADIUS - perigee) / 1e3:.1f} km underground"
        raise ConfigError(where, "orbit", problem)
    return KeplerianOrbit(
        semi_major_axis=axis,
        eccentricity=table.eccentricity,
        inclination=np.radians(table.inclination_deg),
        raan=np.radians(table.raan_deg),
        argument_of_perigee=np.radians(table.argument_of_perigee_deg),
        true_anomaly=np.radians(table.true_anomaly_deg),
        epoch_tai_ns=epoch_tai_ns,
        oblate=table.j2,
    )
