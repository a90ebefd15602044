"""From a TOML file to a ``Scenario``: converts units, resolves names, refuses contradictions."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType
from typing import Any, TypeVar

from msgspec import Struct
from msgspec.structs import asdict

from simgl.camera.camera import Camera
from simgl.camera.presets import read_camera
from simgl.config.path_sandbox import Base, SandboxedFolder
from simgl.config.validation import check_depth, convert, plain, read_toml, shown, shown_key
from simgl.errors import ConfigError, did_you_mean
from simgl.input_files import recorded_inputs
from simgl.motion.drives import JointLaws
from simgl.motion.mounts import Mount
from simgl.motion.trajectory import Motion
from simgl.physics.constants import SOLAR_TEMPERATURE
from simgl.physics.ephemeris import tai_ns_from_utc
from simgl.physics.spectrum import Bands
from simgl.scenario.bands_table import read_bands
from simgl.scenario.camera_tables import read_mount
from simgl.scenario.environment_tables import read_earth, read_sky, read_sun
from simgl.scenario.lamp_tables import read_lamps
from simgl.scenario.requirements import RequirementsTable, read_requirements
from simgl.scenario.scenario import Scenario
from simgl.scenario.schema import (
    AssessTable,
    BandsTable,
    CameraTable,
    EarthTable,
    EpochTable,
    LampTable,
    RenderTable,
    SkyTable,
    SpacecraftTable,
    SunTable,
    ThermalTable,
    UsabilityCriteria,
)
from simgl.scenario.spacecraft_tables import FILE_KEYS, MotionReader, read_model
from simgl.scenario.uncertainty import Uncertainty, UncertaintyTable
from simgl.scene.band_materials import model_in_bands
from simgl.scene.spacecraft import SpacecraftModel

_TABLES = (
    "epoch", "bands", "sun", "earth", "sky", "spacecraft", "camera", "lamp", "assess",
    "requirements", "uncertainty", "render", "thermal",
)  # fmt: skip
_NAME = re.compile(r"[A-Za-z0-9_-]+")
_MAX_NAME = 100
# More are a mistake of the program that wrote the file. A sample's place in the G-buffer names its
# spacecraft by a number below 1024.
MAX_NAMED = 1000
NO_MODELS: Mapping[str, SpacecraftModel] = MappingProxyType({})
_Named = TypeVar("_Named", SpacecraftTable, CameraTable, LampTable)
_Single = TypeVar("_Single", bound=Struct)


def load_scenario(
    path: str | Path,
    *,
    root: Path | None = None,
    models: Mapping[str, SpacecraftModel] = NO_MODELS,
) -> Scenario:
    """The scenario in a TOML file; docs/scenario.md lists its keys.

    path : of the file
    root : folder that must contain its models, maps, tables and presets, after links are resolved;
        shipped files are always allowed. None allows any path
    models : spacecraft name to a model that replaces the ``model`` of its table, such as one from
        ``model_from_mesh``

    Raises ConfigError or AssetError with one line that names file, table and key.

    >>> scenario = simgl.load_scenario("examples/approach.toml")
    >>> list(scenario.models)
    ['target', 'chaser']
    """
    path = Path(path)
    with recorded_inputs() as inputs:
        data = read_toml(path)
        scenario = scenario_from_dict(data, name=path.stem, source=path, root=root, models=models)
    return replace(scenario, inputs=inputs)


def scenario_from_dict(
    data: dict[str, Any],
    *,
    name: str = "scenario",
    source: Path | None = None,
    root: Path | None = None,
    models: Mapping[str, SpacecraftModel] = NO_MODELS,
) -> Scenario:
    """A scenario from the tables of a scenario file; numpy numbers and arrays are accepted.

    data : table name to table, see docs/scenario.md
    name : appears in file headers and, without ``source``, in error messages
    source : the file; relative paths start at its folder, without it at the working directory
    root, models : see ``load_scenario``

    Raises ConfigError or AssetError with one line that names table and key.

    >>> ball = {"sphere": {"radius_m": 1.0, "material": "white_paint"}}
    >>> scenario = simgl.scenario_from_dict({
    ...     "epoch": {"utc": "2026-03-20T12:00:00"},
    ...     "spacecraft": {"ball": {"model": ball, "orbit": {"altitude_km": 400.0}}},
    ...     "camera": {"cam": {"about": {"target": "ball", "azimuth_deg": 0.0, "range_m": 9.0}}},
    ... })
    >>> sorted(scenario.cameras)
    ['cam']
    """
    with recorded_inputs() as inputs:
        scenario = _read_tables(data, name, source, root, models)
    # Laws that contradict each other, such as relative places in a circle, show here.
    scenario.poses(scenario.epoch_tai_ns)
    return replace(scenario, inputs=inputs)


def _read_tables(
    data: dict[str, Any],
    name: str,
    source: Path | None,
    root: Path | None,
    models: Mapping[str, SpacecraftModel],
) -> Scenario:
    where = str(source) if source else name
    check_depth(data, where)
    data = plain(data)
    if not isinstance(data, dict):
        raise ConfigError(where, "", f"must be a table of tables, got {shown(data)}")
    _check_tables(data, where)
    folder = source.parent if source else Path()
    base: Base = folder if root is None else SandboxedFolder(folder, root.resolve())

    def single(kind: str, table: type[_Single]) -> _Single:
        return convert(data.get(kind, {}), table, f"{where} [{kind}]")

    epoch_tai_ns = _epoch(data, where)
    spacecraft_tables = _named_tables(data, "spacecraft", SpacecraftTable, where)
    camera_tables = _named_tables(data, "camera", CameraTable, where)
    lamp_tables = _named_tables(data, "lamp", LampTable, where)
    sun_table, earth_table = single("sun", SunTable), single("earth", EarthTable)
    criteria = UsabilityCriteria(**asdict(single("assess", AssessTable)))
    requirements = read_requirements(
        single("requirements", RequirementsTable), f"{where} [requirements]"
    )
    uncertainty = single("uncertainty", UncertaintyTable)
    render, thermal = single("render", RenderTable), single("thermal", ThermalTable)
    temperature = SOLAR_TEMPERATURE if sun_table.temperature_k is None else sun_table.temperature_k
    bands = read_bands(single("bands", BandsTable), f"{where} [bands]", base)
    sun = read_sun(sun_table, temperature, f"{where} [sun]", bands)
    if render.gather == "pixel" and not render.inter_reflection:
        raise ConfigError(f"{where} [render]", "gather", "requires inter_reflection = true")
    _check_models(models, spacecraft_tables, where)
    context = _Context(
        where=where, base=base, bands=bands, temperature=temperature, epoch_tai_ns=epoch_tai_ns
    )
    placed_models, motions, joints = context.spacecraft(spacecraft_tables, models)
    with_earth = earth_table.shape != "none"
    cameras, mounts = context.cameras(camera_tables, placed_models, with_earth)
    _check_criteria(criteria, f"{where} [assess]", placed_models, cameras)
    return Scenario(
        name=name,
        source=source,
        epoch_tai_ns=epoch_tai_ns,
        sun=sun,
        earth=read_earth(earth_table, f"{where} [earth]", base, sun),
        models=placed_models,
        motions=motions,
        joints=joints,
        cameras=cameras,
        mounts=mounts,
        lamps=read_lamps(where, lamp_tables, placed_models, base, bands),
        criteria=criteria,
        requirements=requirements,
        uncertainty=Uncertainty(**asdict(uncertainty)) if "uncertainty" in data else None,
        seed=render.seed,
        samples_per_pixel=render.samples_per_pixel,
        inter_reflection=render.inter_reflection,
        between_spacecraft=render.between_spacecraft,
        gather=render.gather,
        glossy_reflections=render.glossy_reflections,
        joint_light=render.joint_light,
        stars=read_sky(single("sky", SkyTable), f"{where} [sky]", sun),
        thermal_patches=thermal.patches,
        thermal_step=thermal.step_s,
    )


@dataclass(frozen=True, kw_only=True)
class _Context:
    """What the tables of all spacecraft and cameras are read with.

    where : the file, for errors
    base : folder of relative paths
    temperature : of the Sun's spectrum [K]
    """

    where: str
    base: Base
    bands: Bands
    temperature: float
    epoch_tai_ns: int

    def spacecraft(
        self, tables: dict[str, SpacecraftTable], models: Mapping[str, SpacecraftModel]
    ) -> tuple[dict[str, SpacecraftModel], dict[str, Motion], dict[str, JointLaws]]:
        """Models, laws of motion and laws of joints.

        models : in place of those of the tables
        """
        placed, motions, joints = {}, {}, {}
        for name, table in tables.items():
            at = f"{self.where} [spacecraft.{name}]"
            model = models[name] if name in models else read_model(at, name, table, self.base)
            reader = MotionReader(at, name, table, tables, self.epoch_tai_ns, self.base)
            placed[name] = model_in_bands(model, self.bands, self.temperature)
            motions[name] = reader.motion()
            joints[name] = reader.joint_laws(model)
        return placed, motions, joints

    def cameras(
        self,
        tables: dict[str, CameraTable],
        models: dict[str, SpacecraftModel],
        with_earth: bool,
    ) -> tuple[dict[str, Camera], dict[str, Mount]]:
        """Cameras, and where they are mounted."""
        cameras, mounts = {}, {}
        for name, table in tables.items():
            at = f"{self.where} [camera.{name}]"
            cameras[name] = read_camera(at, name, table, self.temperature, self.base, self.bands)
            mounts[name] = read_mount(at, table, models, earth=with_earth)
        return cameras, mounts


def _check_tables(data: dict[str, Any], where: str) -> None:
    for key in data:
        if key not in _TABLES:
            problem = f"is not a table here; {did_you_mean(key, _TABLES)}"
            raise ConfigError(where, shown_key(key), problem)


def _named_tables(
    data: dict[str, Any], kind: str, table: type[_Named], where: str
) -> dict[str, _Named]:
    tables = data.get(kind, {})
    if not isinstance(tables, dict) or not all(isinstance(t, dict) for t in tables.values()):
        raise ConfigError(where, kind, f"must be tables [{kind}.NAME]")
    if len(tables) > MAX_NAMED:
        raise ConfigError(where, kind, f"holds {len(tables)} tables, at most {MAX_NAMED}")
    for name in tables:
        # Names become file names, message fields and parts of error messages.
        if not _NAME.fullmatch(name):
            problem = "must be a name of letters a to z or A to Z, digits, _ and -"
            raise ConfigError(where, f"{kind}.{shown_key(name)}", problem)
        if len(name) > _MAX_NAME:
            problem = f"has {len(name)} characters, a name at most {_MAX_NAME}"
            raise ConfigError(where, f"{kind}.{shown_key(name)}", problem)
    return {n: convert(t, table, f"{where} [{kind}.{n}]") for n, t in tables.items()}


def _check_models(
    models: Mapping[str, SpacecraftModel], tables: Mapping[str, SpacecraftTable], where: str
) -> None:
    for name in models:
        if name not in tables:
            problem = f"names no spacecraft: {shown(name)}; {did_you_mean(name, tables)}"
            raise ConfigError(where, "models", problem)
        for key in FILE_KEYS:
            if getattr(tables[name], key) is not None:
                problem = "is allowed only for a mesh file, not for a model given in memory"
                raise ConfigError(f"{where} [spacecraft.{name}]", key, problem)


def _check_criteria(
    table: UsabilityCriteria,
    where: str,
    models: Mapping[str, SpacecraftModel],
    cameras: Mapping[str, Camera],
) -> None:
    named = (("target", table.target, models), ("camera", table.camera, cameras))
    for key, name, known in named:
        if name is not None and name not in known:
            problem = f"names none of this file: {shown(name)}; {did_you_mean(name, known)}"
            raise ConfigError(where, key, problem)


def _epoch(data: dict[str, Any], where: str) -> int:
    if "epoch" not in data:
        raise ConfigError(where, "epoch", 'is missing; write [epoch] utc = "2026-03-20T12:00:00"')
    table = convert(data["epoch"], EpochTable, f"{where} [epoch]")
    try:
        return tai_ns_from_utc(table.utc)
    except ValueError as error:
        raise ConfigError(f"{where} [epoch]", "utc", str(error)) from None
