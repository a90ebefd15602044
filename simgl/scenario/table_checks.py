"""Checks that several tables of a scenario file share: named spacecraft, places, exclusive keys."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from simgl.arrays import Array
from simgl.config.validation import exactly_one, shown
from simgl.errors import ConfigError, did_you_mean
from simgl.motion.joints import group_of_keypoint
from simgl.scenario.schema import CameraTable, LampTable, SpacecraftTable
from simgl.scene.spacecraft import SpacecraftModel

# Keys that require another one.
_REQUIRED = {
    "position_lvlh_m": "relative_to",
    "velocity_lvlh_m_s": "relative_to",
    "velocity_icrf_m_s": "position_icrf_m",
    "position_body_m": "on",
    "keypoint": "on",
}


def named_spacecraft(name: str, models: Mapping[str, SpacecraftModel], where: str, key: str) -> str:
    """The name of a spacecraft, which must be in the scenario."""
    if name not in models:
        problem = f"names no spacecraft: {shown(name)}; {did_you_mean(name, models)}"
        raise ConfigError(where, key, problem)
    return name


def keypoint_on(model: SpacecraftModel, name: str, where: str, key: str) -> Array:
    """(3,) place of a keypoint in body axes [m], which must be on the model."""
    if name not in model.keypoints:
        suggestion = did_you_mean(name, model.keypoints)
        problem = f'is not on "{model.name}": {shown(name)}; {suggestion}'
        raise ConfigError(where, key, problem)
    return model.keypoints[name]


def place_on(
    model: SpacecraftModel, table: CameraTable | LampTable, where: str
) -> tuple[Array, int]:
    """(3,) place in body axes [m], given by exactly one of a keypoint and coordinates, and the
    index in ``body_from_stored`` of what carries it."""
    given = {"position_body_m": table.position_body_m, "keypoint": table.keypoint}
    exactly_one(given, where)
    if table.keypoint is not None:
        place = keypoint_on(model, table.keypoint, where, "keypoint")
        return place, group_of_keypoint(model.joints, table.keypoint)
    assert table.position_body_m is not None
    return np.array(table.position_body_m), 0


def check_place(table: SpacecraftTable | CameraTable, where: str, keys: tuple[str, ...]) -> None:
    """One of the keys is given, and no key that requires another of them."""
    given = exactly_one({key: getattr(table, key) for key in keys}, where)
    for key, needed in _REQUIRED.items():
        if getattr(table, key, None) is not None and needed != given:
            raise ConfigError(where, key, f"requires {needed}, got {given}")
