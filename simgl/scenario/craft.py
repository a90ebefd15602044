"""The ``[spacecraft.NAME]`` tables: model, place and attitude."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from simgl.errors import AssetError, ConfigError, did_you_mean
from simgl.physics.constants import WGS84_EQUATORIAL_RADIUS
from simgl.physics.frames import matrix_from_quaternion
from simgl.scenario.fields import direction, exactly_one
from simgl.scenario.finishes import material_of
from simgl.scenario.library import load_model
from simgl.scenario.schema import OrbitTable, PrimitiveTable, SpacecraftTable
from simgl.scenario.strict import shown
from simgl.scene import mesh as shapes
from simgl.scene.spacecraft import SpacecraftModel
from simgl.scene.trajectory import (
    Attitude,
    FixedAttitude,
    FixedPosition,
    KeplerianOrbit,
    LvlhAttitude,
    PointingAttitude,
    RelativePosition,
    Trajectory,
)


class Craft:
    """One ``[spacecraft.NAME]`` table on its way to a model and its motion."""

    def __init__(
        self,
        where: str,
        name: str,
        table: SpacecraftTable,
        all_craft: dict[str, SpacecraftTable],
        epoch_tai_ns: int,
    ) -> None:
        self.where, self.name, self.table = where, name, table
        self.all_craft, self.epoch_tai_ns = all_craft, epoch_tai_ns

    def _check_name(self, key: str, name: str) -> str:
        if name == self.name:
            raise ConfigError(self.where, key, "names the spacecraft itself; name another one")
        others = [n for n in self.all_craft if n != self.name]
        if name not in others:
            problem = f"names no other spacecraft: {shown(name)}; {did_you_mean(name, others)}"
            raise ConfigError(self.where, key, problem)
        return name

    def model(self, base: Path) -> SpacecraftModel:
        """Its shape and surface; relative paths start at ``base``."""
        source = self.table.model
        if isinstance(source, PrimitiveTable):
            if self.table.unit_m is not None:
                problem = "goes with a mesh file; a primitive is in metres"
                raise ConfigError(self.where, "unit_m", problem)
            return _primitive(source, self.where, self.name)
        try:
            return load_model(source, base, self.table.unit_m)
        except AssetError as error:
            raise AssetError(f"{self.where}: model: {error}") from None

    def trajectory(self) -> Trajectory:
        """How it moves."""
        t = self.table
        exactly_one(t, self.where, "place", ("orbit", "relative_to", "position_icrf_m"))
        if t.orbit is not None:
            return _orbit(t.orbit, self.where, self.epoch_tai_ns)
        if t.relative_to is not None:
            if t.position_lvlh_m is None:
                raise ConfigError(self.where, "position_lvlh_m", "is missing beside relative_to")
            return RelativePosition(
                reference=self._check_name("relative_to", t.relative_to),
                position_lvlh=np.array(t.position_lvlh_m),
                velocity_lvlh=np.array(t.velocity_lvlh_m_s or (0.0, 0.0, 0.0)),
            )
        return FixedPosition(
            position=np.array(t.position_icrf_m),
            velocity=np.array(t.velocity_icrf_m_s or (0.0, 0.0, 0.0)),
        )

    def attitude(self) -> Attitude:
        """How it turns."""
        t = self.table
        keys = (
            "attitude",
            "quaternion_icrf_from_body_xyzw",
            "quaternion_lvlh_from_body_xyzw",
            "point_at",
        )
        given = [k for k in keys if getattr(t, k) is not None]
        if len(given) > 1:
            raise ConfigError(self.where, given[1], f"contradicts {given[0]}; give one of them")
        if t.quaternion_icrf_from_body_xyzw is not None:
            return FixedAttitude(R_icrf_from_body=self._matrix(given[0]))
        if t.quaternion_lvlh_from_body_xyzw is not None:
            return LvlhAttitude(R_lvlh_from_body=self._matrix(given[0]))
        if t.point_at is not None:
            return PointingAttitude(
                target=self._check_name("point_at.target", t.point_at.target),
                axis_body=direction(t.point_at.axis_body, self.where, "point_at.axis_body"),
            )
        fixed = t.attitude == "icrf" or (t.attitude is None and t.position_icrf_m is not None)
        return (
            FixedAttitude(R_icrf_from_body=np.eye(3))
            if fixed
            else LvlhAttitude(R_lvlh_from_body=np.eye(3))
        )

    def _matrix(self, key: str) -> np.ndarray[Any, Any]:
        try:
            return matrix_from_quaternion(getattr(self.table, key))
        except ValueError as error:
            raise ConfigError(self.where, key, str(error)) from None


def _primitive(table: PrimitiveTable, where: str, name: str) -> SpacecraftModel:
    shapes_given = [s for s in table.__struct_fields__ if getattr(table, s) is not None]
    if len(shapes_given) != 1:
        raise ConfigError(where, "model", "needs exactly one of plate, sphere, box, cylinder")
    if table.plate is not None:
        mesh = shapes.plate(table.plate.width_m, table.plate.height_m)
    elif table.sphere is not None:
        mesh = shapes.sphere(table.sphere.radius_m)
    elif table.box is not None:
        mesh = shapes.box(table.box.size_m)
    else:
        assert table.cylinder is not None
        mesh = shapes.cylinder(table.cylinder.radius_m, table.cylinder.length_m)
    given = getattr(table, shapes_given[0]).material
    material = material_of(given, name, where, f"model.{shapes_given[0]}.material")
    return SpacecraftModel(name=name, mesh=mesh, parts=(name,), materials=(material,))


def _orbit(table: OrbitTable, where: str, epoch_tai_ns: int) -> KeplerianOrbit:
    if (table.altitude_km is None) == (table.semi_major_axis_km is None):
        problem = "needs exactly one of altitude_km (circular) and semi_major_axis_km"
        raise ConfigError(where, "orbit", problem)
    if table.altitude_km is not None:
        if table.eccentricity != 0.0:
            raise ConfigError(where, "orbit.eccentricity", "goes with semi_major_axis_km")
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
    )
