"""From a campaign file to a Campaign."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from msgspec import structs

from simgl.campaign import random_draws as draws
from simgl.campaign.campaign_schema import CampaignTable, Drawn, DrawTable
from simgl.campaign.random_draws import Distribution
from simgl.config.validation import convert, exactly_one, read_toml, shown
from simgl.errors import ConfigError, did_you_mean
from simgl.input_files import recorded_inputs
from simgl.motion.joints import unknown_joint
from simgl.motion.mounts import BodyMount
from simgl.scenario.loader import load_scenario
from simgl.scenario.scenario import Scenario
from simgl.scene.spacecraft import SpacecraftModel
from simgl.sequence.run_sequence import fingerprint

_WAYS = ("direction", "azimuth_deg", "phase_angle_deg")
# Limits of values, where there are any.
_LIMITS = {
    "range_m": (1e-3, 1e9),
    "elevation_deg": (-90.0, 90.0),
    "phase_angle_deg": (0.0, 180.0),
    "offset_x": (-1.0, 1.0),
    "offset_y": (-1.0, 1.0),
    "target_rate_deg_s": (0.0, 3600.0),
    "camera_rate_deg_s": (0.0, 3600.0),
    "relative_speed_m_s": (0.0, 1e5),
    "exposure_time_s": (1e-9, 3600.0),
    "f_number": (0.5, 1e3),
}


@dataclass(frozen=True, kw_only=True)
class Campaign:
    """Randomised frames of one scenario.

    write : kinds of files of each frame
    drawn : distributions by key of ``[draw]``
    joints, lamps : of the target [deg] or [m], and factors on the power of lamps, by name
    sphere : the camera may be in any direction from the target
    any_attitude : the target may have any attitude
    identity : digests of everything that a frame depends on
    """

    source: Path
    scenario: Scenario
    camera: str
    target: str
    frames: int
    seed: int
    write: tuple[str, ...]
    drawn: Mapping[str, Distribution]
    joints: Mapping[str, Distribution]
    lamps: Mapping[str, Distribution]
    sphere: bool
    any_attitude: bool
    identity: Mapping[str, str]


def load_campaign(path: Path) -> Campaign:
    """The campaign in a TOML file; raises ConfigError or AssetError with one clear line."""
    where = str(path)
    with recorded_inputs() as inputs:
        table = convert(read_toml(path), CampaignTable, where)
        scenario = load_scenario(path.parent / table.scenario)
    camera = _named(where, "camera", table.camera, list(scenario.cameras))
    target = _named(where, "target", table.target, list(scenario.models))
    if len(set(table.write)) != len(table.write) or not table.write:
        raise ConfigError(where, "write", "must name at least one kind of file, each once")
    if table.write[0] == "truth":
        raise ConfigError(where, "write", "must begin with an image: dn8, dn16, view or exr")
    place = f"{where} [draw]"
    _check_ways(table.draw, place)
    mount = scenario.mounts[camera]
    if isinstance(mount, BodyMount) and mount.spacecraft == target:
        problem = f'is on the target, "{target}"; a campaign looks at it from elsewhere'
        raise ConfigError(where, "camera", problem)
    model = scenario.models[target]
    for name in table.draw.lamp_power:
        if name not in scenario.lamps:
            problem = f"names no lamp of the scenario; {did_you_mean(name, scenario.lamps)}"
            raise ConfigError(place, f"lamp_power.{name}", problem)
    return Campaign(
        source=path,
        scenario=scenario,
        camera=camera,
        target=target,
        frames=table.frames,
        seed=table.seed,
        write=table.write,
        drawn={
            key: _distribution(getattr(table.draw, key), place, key, _LIMITS.get(key))
            for key in _NUMBERS
            if getattr(table.draw, key) is not None
        },
        joints=_joints(table.draw.joints_deg, model, place, "joints_deg", slides=False)
        | _joints(table.draw.joints_m, model, place, "joints_m", slides=True),
        lamps={
            name: _distribution(drawn, place, f"lamp_power.{name}", (0.0, 1e6))
            for name, drawn in table.draw.lamp_power.items()
        },
        sphere=table.draw.direction == "sphere",
        any_attitude=table.draw.attitude == "uniform",
        identity=fingerprint(scenario, inputs, path),
    )


_NUMBERS = (
    "epoch_offset_s",
    "range_m",
    "azimuth_deg",
    "elevation_deg",
    "phase_angle_deg",
    "attitude_error_deg",
    "roll_deg",
    "offset_x",
    "offset_y",
    "target_rate_deg_s",
    "camera_rate_deg_s",
    "relative_speed_m_s",
    "exposure_time_s",
    "f_number",
)


def _joints(
    drawn: Mapping[str, Drawn], model: SpacecraftModel, where: str, key: str, *, slides: bool
) -> dict[str, Distribution]:
    """Distributions of one key's joints, in its unit."""
    joints = {joint.name: joint for joint in model.joints}
    distributions = {}
    for name, given in drawn.items():
        if name not in joints:
            problem = f"{shown(name)} {unknown_joint(name, model.joints)}"
            raise ConfigError(where, f"{key}.{name}", problem)
        if joints[name].slides != slides:
            way = "slides, by metres" if joints[name].slides else "turns, by degrees"
            raise ConfigError(where, f"{key}.{name}", f"{shown(name)} {way}")
        scale = 1.0 if slides else math.degrees(1.0)
        limits = tuple(scale * limit for limit in joints[name].limits)
        distributions[name] = _distribution(given, where, f"{key}.{name}", limits)
    return distributions


def _named(where: str, kind: str, given: str | None, known: list[str]) -> str:
    if not known:
        raise ConfigError(where, kind, "is missing in the scenario; a campaign needs one")
    if given is not None and given not in known:
        problem = f"names none of the scenario: {shown(given)}; {did_you_mean(given, known)}"
        raise ConfigError(where, kind, problem)
    return given or known[0]


def _check_ways(table: DrawTable, where: str) -> None:
    ways = [key for key in _WAYS if getattr(table, key) is not None]
    if len(ways) > 1:
        raise ConfigError(where, ways[1], f"contradicts {ways[0]}; give one of them")
    if table.elevation_deg is not None and table.azimuth_deg is None:
        raise ConfigError(where, "elevation_deg", "requires azimuth_deg")
    if table.attitude is not None and table.attitude_error_deg is not None:
        raise ConfigError(where, "attitude_error_deg", "contradicts attitude; give one of them")


def _distribution(
    given: Drawn, where: str, key: str, limits: tuple[float, ...] | None
) -> Distribution:
    distribution = _from_table(given, where, key)
    if limits is None:
        return distribution
    low, high = limits
    if not isinstance(given, float | int) and given.normal is not None:
        # A normal distribution has no ends: values outside the limits are drawn again.
        mean, _ = given.normal
        if low <= mean <= high:
            return draws.Distribution(distribution.quantile, low, high)
        raise ConfigError(where, key, f"must have its mean in {low:g}..{high:g}, got {mean:g}")
    first, last = distribution.low, distribution.high
    if first < low or last > high:
        got = f"{first:g}" if first == last else f"{first:g}..{last:g}"
        raise ConfigError(where, key, f"must lie in {low:g}..{high:g}, got {got}")
    return distribution


def _from_table(given: Drawn, where: str, key: str) -> Distribution:
    if isinstance(given, float | int):
        return draws.choice((float(given),))
    way = exactly_one(structs.asdict(given), where, key)
    if given.normal is not None:
        if given.normal[1] < 0.0:
            problem = f"must not have a negative deviation, got {given.normal[1]:g}"
            raise ConfigError(where, f"{key}.normal", problem)
        return draws.normal(*given.normal)
    if given.choice is not None:
        return draws.choice(given.choice)
    low, high = given.uniform or given.log_uniform or (0.0, 0.0)
    if low > high:
        problem = f"must give the lower limit first, got {low:g}, {high:g}"
        raise ConfigError(where, f"{key}.{way}", problem)
    if given.uniform is not None:
        return draws.uniform(low, high)
    if low <= 0.0:
        problem = f"must have positive limits, got {low:g}"
        raise ConfigError(where, f"{key}.log_uniform", problem)
    return draws.log_uniform(low, high)
