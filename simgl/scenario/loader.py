"""From a TOML file to a Scenario: units to SI, names resolved, contradictions refused."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from simgl.errors import AssetError, ConfigError, did_you_mean
from simgl.physics.air import ATMOSPHERES
from simgl.physics.constants import (
    ASTRONOMICAL_UNIT,
    SOLAR_CONSTANT,
    SOLAR_RADIUS,
    SOLAR_TEMPERATURE,
    WGS84_EQUATORIAL_RADIUS,
)
from simgl.physics.ephemeris import tai_ns_from_utc
from simgl.physics.frames import matrix_from_quaternion, unit
from simgl.physics.spectrum import black_body_light, photon_mean
from simgl.scenario.library import load_model, load_preset
from simgl.scenario.scenario import EphemerisSun, Scenario
from simgl.scenario.schema import (
    CameraPresetTable,
    CameraTable,
    EarthTable,
    EpochTable,
    OrbitTable,
    PrimitiveTable,
    RenderTable,
    SpacecraftTable,
    SunTable,
)
from simgl.scenario.strict import convert, plain, read_toml, shown, shown_key
from simgl.scene import mesh as shapes
from simgl.scene.camera import Camera, Detector, Lens
from simgl.scene.earth import Earth
from simgl.scene.materials import Material
from simgl.scene.spacecraft import SpacecraftModel
from simgl.scene.state import SunInDirection
from simgl.scene.trajectory import (
    Attitude,
    BodyMount,
    FixedAttitude,
    FixedPosition,
    FreeMount,
    KeplerianOrbit,
    LvlhAttitude,
    Motion,
    Mount,
    OrbitingMount,
    PointingAttitude,
    RelativePosition,
    Trajectory,
)

_TABLES = ("epoch", "sun", "earth", "spacecraft", "camera", "render")
_NAME = re.compile(r"[A-Za-z0-9_-]+")
# Keys that say nothing without another one: refused alone, not passed over.
_GOES_WITH = {
    "position_lvlh_m": "relative_to",
    "velocity_lvlh_m_s": "relative_to",
    "velocity_icrf_m_s": "position_icrf_m",
    "position_body_m": "on",
    "keypoint": "on",
}
_FOUR = tuple[float, float, float, float]
_Named = TypeVar("_Named", SpacecraftTable, CameraTable)


def load_scenario(path: str | Path) -> Scenario:
    """The scenario in a TOML file; raises ConfigError or AssetError with one clear line."""
    path = Path(path)
    return scenario_from_dict(read_toml(path), name=path.stem, source=path)


def scenario_from_dict(
    data: dict[str, Any], *, name: str = "scenario", source: Path | None = None
) -> Scenario:
    """A scenario from the content of a file; relative paths start at the folder of ``source``.

    Numbers and arrays of numpy serve as well as Python's.
    """
    where = str(source) if source else name
    data = plain(data)
    for key in data:
        if key not in _TABLES:
            problem = f"is not a table here; {did_you_mean(key, _TABLES)}"
            raise ConfigError(where, shown_key(key), problem)
    base = source.parent if source else Path()
    epoch = _epoch(data, where)
    craft = _named_tables(data, "spacecraft", SpacecraftTable, where)
    cameras = _named_tables(data, "camera", CameraTable, where)
    sun = convert(data.get("sun", {}), SunTable, f"{where} [sun]")
    earth = convert(data.get("earth", {}), EarthTable, f"{where} [earth]")
    render = convert(data.get("render", {}), RenderTable, f"{where} [render]")
    temperature = SOLAR_TEMPERATURE if sun.temperature_k is None else sun.temperature_k
    built = [_Craft(f"{where} [spacecraft.{n}]", n, t, craft, epoch) for n, t in craft.items()]
    models = {c.name: c.model(base) for c in built}
    places = {n: f"{where} [camera.{n}]" for n in cameras}
    lenses = {n: _camera(places[n], n, t, temperature, base) for n, t in cameras.items()}
    mounts = {n: _mount(places[n], t, models) for n, t in cameras.items()}
    scenario = Scenario(
        name=name,
        source=source,
        epoch_tai_ns=epoch,
        sun=_sun(sun, temperature, f"{where} [sun]"),
        earth=_earth(earth, f"{where} [earth]"),
        models=models,
        motions={c.name: Motion(trajectory=c.trajectory(), attitude=c.attitude()) for c in built},
        cameras=lenses,
        mounts=mounts,
        seed=render.seed,
        samples_per_pixel=render.samples_per_pixel,
    )
    # Laws that contradict each other, such as relative places in a circle, show here.
    scenario.poses(epoch)
    return scenario


def _named_tables(
    data: dict[str, Any], kind: str, table: type[_Named], where: str
) -> dict[str, _Named]:
    tables = data.get(kind, {})
    if not isinstance(tables, dict) or not all(isinstance(t, dict) for t in tables.values()):
        raise ConfigError(where, kind, f"must be tables [{kind}.NAME]")
    for name in tables:
        # Names become file names, message fields and parts of error messages.
        if not _NAME.fullmatch(name):
            problem = "must be a name of letters, digits, _ and -"
            raise ConfigError(where, f"{kind}.{shown_key(name)}", problem)
    return {n: convert(t, table, f"{where} [{kind}.{n}]") for n, t in tables.items()}


def _epoch(data: dict[str, Any], where: str) -> int:
    if "epoch" not in data:
        raise ConfigError(where, "epoch", 'is missing; write [epoch] utc = "2026-03-20T12:00:00"')
    table = convert(data["epoch"], EpochTable, f"{where} [epoch]")
    try:
        return tai_ns_from_utc(table.utc)
    except ValueError as error:
        raise ConfigError(f"{where} [epoch]", "utc", str(error)) from None


def _fractions(value: float | Sequence[float], where: str, key: str) -> _FOUR:
    """Four band values 0..1 from one number or four."""
    r, g, b, n = (value,) * 4 if isinstance(value, (int, float)) else value
    for one in (r, g, b, n):
        if not 0.0 <= one <= 1.0:
            raise ConfigError(where, key, f"must lie in 0..1, got {one:g}")
    return float(r), float(g), float(b), float(n)


def _direction(value: Sequence[float], where: str, key: str) -> np.ndarray[Any, Any]:
    try:
        return unit(value)
    except ValueError as error:
        raise ConfigError(where, key, str(error)) from None


def _sun(table: SunTable, temperature: float, where: str) -> EphemerisSun | SunInDirection:
    total = SOLAR_CONSTANT if table.irradiance_w_m2 is None else table.irradiance_w_m2
    light = black_body_light(total, temperature)
    radius = SOLAR_RADIUS
    if table.angular_diameter_deg is not None:
        radius = ASTRONOMICAL_UNIT * np.sin(np.radians(0.5 * table.angular_diameter_deg))
    if table.direction_icrf is None:
        return EphemerisSun(light_at_1_au=light, radius=radius, visible=table.visible)
    return SunInDirection(
        direction_icrf=_direction(table.direction_icrf, where, "direction_icrf"),
        light=light,
        angular_radius=float(np.arcsin(radius / ASTRONOMICAL_UNIT)),
        visible=table.visible,
    )


def _earth(table: EarthTable, where: str) -> Earth | None:
    if table.radius_km is not None and table.shape != "sphere":
        raise ConfigError(where, "radius_km", f'goes with shape = "sphere", got "{table.shape}"')
    albedo = None if table.albedo is None else _fractions(table.albedo, where, "albedo")
    if table.shape == "none":
        if albedo is not None:
            raise ConfigError(where, "albedo", 'goes with an Earth, got shape = "none"')
        if table.atmosphere is not None:
            raise ConfigError(where, "atmosphere", 'goes with an Earth, got shape = "none"')
        return None
    default = "standard" if table.shape == "wgs84" else "none"
    air = ATMOSPHERES.get(table.atmosphere or default)
    if table.shape == "sphere":
        if table.radius_km is None:
            raise ConfigError(where, "radius_km", 'is missing; shape = "sphere" needs it')
        radius = table.radius_km * 1e3
        return Earth(equatorial_radius=radius, polar_radius=radius, albedo=albedo, air=air)
    return Earth(albedo=albedo, air=air)


class _Craft:
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
        t = self.table
        _exactly_one(t, self.where, "place", ("orbit", "relative_to", "position_icrf_m"))
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
                axis_body=_direction(t.point_at.axis_body, self.where, "point_at.axis_body"),
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


def _exactly_one(
    table: SpacecraftTable | CameraTable, where: str, what: str, keys: tuple[str, ...]
) -> None:
    """One of the keys is given, and no key that goes with another of them."""
    given = [k for k in keys if getattr(table, k) is not None]
    if len(given) != 1:
        found = " and ".join(given) if given else "none of them"
        problem = f"needs exactly one of {', '.join(keys)}; got {found}"
        raise ConfigError(where, what, problem)
    for key, needed in _GOES_WITH.items():
        if getattr(table, key, None) is not None and needed not in given:
            raise ConfigError(where, key, f"goes with {needed}, not with {given[0]}")


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
    material = Material(
        name=name,
        reflectance=_fractions(
            given.reflectance, where, f"model.{shapes_given[0]}.material.reflectance"
        ),
        metallic=given.metallic,
        roughness=given.roughness,
    )
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


def _quantum_efficiency(
    table: CameraTable, preset: CameraPresetTable, temperature: float, where: str
) -> _FOUR:
    """Per band: given, or the preset's curve averaged over the Sun's photons in the band."""
    if table.quantum_efficiency is not None:
        return _fractions(table.quantum_efficiency, where, "quantum_efficiency")
    wavelength = np.array(preset.qe_wavelength_nm) * 1e-9
    red, green, blue, nir = photon_mean(wavelength, np.array(preset.qe), temperature).tolist()
    return red, green, blue, nir


def _camera(
    where: str, name: str, table: CameraTable, sun_temperature: float, base: Path
) -> Camera:
    try:
        preset = load_preset(table.preset, base)
    except AssetError as error:
        raise AssetError(f"{where}: preset: {error}") from None

    def chosen(key: str) -> Any:
        own = getattr(table, key)
        return getattr(preset, key) if own is None else own

    bits, pedestal = chosen("bits"), chosen("pedestal_dn")
    if pedestal >= 2**bits - 1:
        problem = f"must lie below the largest DN, {2**bits - 1}, got {pedestal:g}"
        raise ConfigError(where, "pedestal_dn", problem)
    detector = Detector(
        width=chosen("width_px"),
        height=chosen("height_px"),
        pixel_pitch=chosen("pixel_pitch_um") * 1e-6,
        quantum_efficiency=_quantum_efficiency(table, preset, sun_temperature, where),
        full_well=chosen("full_well_e"),
        read_noise=chosen("read_noise_e"),
        bits=bits,
        pedestal=pedestal,
        gain_dn_per_e=1.0 / chosen("gain_e_per_dn"),
    )
    lens = Lens(
        focal_length=table.focal_length_mm * 1e-3,
        f_number=table.f_number,
        transmission=_fractions(table.transmission, where, "transmission"),
    )
    return Camera(name=name, lens=lens, detector=detector, exposure_time=table.exposure_time_s)


def _mount(where: str, table: CameraTable, models: dict[str, SpacecraftModel]) -> Mount:
    _exactly_one(table, where, "mount", ("on", "about", "position_icrf_m"))

    def craft(key: str, name: str) -> str:
        if name not in models:
            raise ConfigError(
                where, key, f"names no spacecraft: {shown(name)}; {did_you_mean(name, models)}"
            )
        return name

    look_at = None if table.look_at is None else craft("look_at", table.look_at)
    if table.about is not None:
        about = table.about
        for key in ("look_at", "boresight", "up"):
            if getattr(table, key) is not None:
                raise ConfigError(where, key, "contradicts about, which looks at its target")
        return OrbitingMount(
            target=craft("about.target", about.target),
            azimuth=np.radians(about.azimuth_deg),
            elevation=np.radians(about.elevation_deg),
            range=about.range_m,
        )
    if (look_at is None) == (table.boresight is None):
        raise ConfigError(where, "look_at", "or boresight is needed, and not both")
    boresight = _direction(table.boresight or (1.0, 0.0, 0.0), where, "boresight")
    up = _direction(table.up or (0.0, 0.0, -1.0), where, "up")
    if table.on is None:
        return FreeMount(
            position=np.array(table.position_icrf_m),
            boresight_icrf=boresight,
            up_icrf=up,
            look_at=look_at,
        )
    model = models[craft("on", table.on)]
    if (table.keypoint is None) == (table.position_body_m is None):
        raise ConfigError(where, "position_body_m", "or keypoint is needed, and not both")
    if table.keypoint is not None and table.keypoint not in model.keypoints:
        suggestion = did_you_mean(table.keypoint, model.keypoints)
        problem = f'is not on "{model.name}": {shown(table.keypoint)}; {suggestion}'
        raise ConfigError(where, "keypoint", problem)
    position = model.keypoints[table.keypoint] if table.keypoint else table.position_body_m
    return BodyMount(
        spacecraft=table.on,
        position_body=np.asarray(position, dtype=np.float64),
        boresight_body=boresight,
        up_body=up,
        look_at=look_at,
    )
