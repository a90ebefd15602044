"""From a TOML file to a Scenario: units to SI, names resolved, contradictions refused."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeVar

from simgl.camera.camera import Camera
from simgl.camera.presets import read_camera
from simgl.config.path_sandbox import Base, SandboxedFolder
from simgl.config.validation import convert, plain, read_toml, shown, shown_key
from simgl.errors import ConfigError, did_you_mean
from simgl.physics.constants import SOLAR_TEMPERATURE
from simgl.physics.ephemeris import tai_ns_from_utc
from simgl.scenario.camera_tables import read_mount
from simgl.scenario.lamp_tables import read_lamps
from simgl.scenario.light_tables import read_earth, read_sky, read_sun
from simgl.scenario.motion_tables import MotionReader
from simgl.scenario.scenario import Scenario
from simgl.scenario.schema import (
    AssessTable,
    CameraTable,
    EarthTable,
    EpochTable,
    LampTable,
    RenderTable,
    SkyTable,
    SpacecraftTable,
    SunTable,
)
from simgl.scenario.spacecraft_tables import read_model
from simgl.scene.spacecraft import SpacecraftModel
from simgl.scene.usability_criteria import UsabilityCriteria

_TABLES = ("epoch", "sun", "earth", "sky", "spacecraft", "camera", "lamp", "assess", "render")
_NAME = re.compile(r"[A-Za-z0-9_-]+")
_Named = TypeVar("_Named", SpacecraftTable, CameraTable, LampTable)


def load_scenario(path: str | Path, *, root: Path | None = None) -> Scenario:
    """The scenario in a TOML file; raises ConfigError or AssetError with one clear line.

    root : folder that its models, maps, tables and presets must lie in, links followed; shipped
        ones may be named all the same. None lets them lie anywhere
    """
    path = Path(path)
    return scenario_from_dict(read_toml(path), name=path.stem, source=path, root=root)


def scenario_from_dict(
    data: dict[str, Any],
    *,
    name: str = "scenario",
    source: Path | None = None,
    root: Path | None = None,
) -> Scenario:
    """A scenario from the content of a file; relative paths start at the folder of ``source``.

    root : see ``load_scenario``

    Numbers and arrays of numpy serve as well as Python's.
    """
    where = str(source) if source else name
    data = plain(data)
    _check_tables(data, where)
    folder = source.parent if source else Path()
    base: Base = folder if root is None else SandboxedFolder(folder, root.resolve())
    epoch = _epoch(data, where)
    craft = _named_tables(data, "spacecraft", SpacecraftTable, where)
    cameras = _named_tables(data, "camera", CameraTable, where)
    lamps = _named_tables(data, "lamp", LampTable, where)
    sun = convert(data.get("sun", {}), SunTable, f"{where} [sun]")
    earth = convert(data.get("earth", {}), EarthTable, f"{where} [earth]")
    sky = convert(data.get("sky", {}), SkyTable, f"{where} [sky]")
    assess = convert(data.get("assess", {}), AssessTable, f"{where} [assess]")
    render = convert(data.get("render", {}), RenderTable, f"{where} [render]")
    temperature = SOLAR_TEMPERATURE if sun.temperature_k is None else sun.temperature_k
    light = read_sun(sun, temperature, f"{where} [sun]")
    bodies = {n: f"{where} [spacecraft.{n}]" for n in craft}
    models = {n: read_model(bodies[n], n, t, base) for n, t in craft.items()}
    laws = {n: MotionReader(bodies[n], n, t, craft, epoch, base) for n, t in craft.items()}
    places = {n: f"{where} [camera.{n}]" for n in cameras}
    lenses = {n: read_camera(places[n], n, t, temperature, base) for n, t in cameras.items()}
    there = earth.shape != "none"
    mounts = {n: read_mount(places[n], t, models, earth=there) for n, t in cameras.items()}
    scenario = Scenario(
        name=name,
        source=source,
        epoch_tai_ns=epoch,
        sun=light,
        earth=read_earth(earth, f"{where} [earth]", base, light),
        models=models,
        motions={n: law.motion() for n, law in laws.items()},
        joints={n: law.joint_laws(models[n]) for n, law in laws.items()},
        cameras=lenses,
        mounts=mounts,
        lamps=read_lamps(where, lamps, models),
        criteria=_criteria(assess, f"{where} [assess]", models, lenses),
        seed=render.seed,
        samples_per_pixel=render.samples_per_pixel,
        inter_reflection=render.inter_reflection,
        gather=render.gather,
        stars=read_sky(sky, light),
    )
    # Laws that contradict each other, such as relative places in a circle, show here.
    scenario.poses(epoch)
    return scenario


# Keys of [render] that files of earlier versions have, and why they went.
_REMOVED = {
    "level_of_detail_error_px": "was removed with the levels of detail: they saved 5 % of a frame "
    "and changed interreflected light; delete the key",
}


def _check_tables(data: dict[str, Any], where: str) -> None:
    for key, problem in _REMOVED.items():
        if isinstance(data.get("render"), dict) and key in data["render"]:
            raise ConfigError(f"{where} [render]", key, problem)
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
    for name in tables:
        # Names become file names, message fields and parts of error messages.
        if not _NAME.fullmatch(name):
            problem = "must be a name of letters, digits, _ and -"
            raise ConfigError(where, f"{kind}.{shown_key(name)}", problem)
    return {n: convert(t, table, f"{where} [{kind}.{n}]") for n, t in tables.items()}


def _criteria(
    table: AssessTable,
    where: str,
    models: Mapping[str, SpacecraftModel],
    cameras: Mapping[str, Camera],
) -> UsabilityCriteria:
    named = (("target", table.target, models), ("camera", table.camera, cameras))
    for key, name, known in named:
        if name is not None and name not in known:
            problem = f"names none of this file: {shown(name)}; {did_you_mean(name, known)}"
            raise ConfigError(where, key, problem)
    return UsabilityCriteria(
        target=table.target,
        camera=table.camera,
        least_pixels=table.least_pixels,
        most_saturated=table.most_saturated,
        most_dark=table.most_dark,
        least_snr=table.least_snr,
        least_contrast=table.least_contrast,
    )


def _epoch(data: dict[str, Any], where: str) -> int:
    if "epoch" not in data:
        raise ConfigError(where, "epoch", 'is missing; write [epoch] utc = "2026-03-20T12:00:00"')
    table = convert(data["epoch"], EpochTable, f"{where} [epoch]")
    try:
        return tai_ns_from_utc(table.utc)
    except ValueError as error:
        raise ConfigError(f"{where} [epoch]", "utc", str(error)) from None
