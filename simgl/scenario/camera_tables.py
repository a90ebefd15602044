"""The ``[camera.NAME]`` tables: where a camera sits and where it looks."""

from __future__ import annotations

import numpy as np

from simgl.arrays import Array
from simgl.config.validation import exactly_one, shown
from simgl.config.value_types import direction
from simgl.errors import ConfigError, did_you_mean
from simgl.motion.joints import group_of_keypoint, group_of_part
from simgl.motion.mounts import BodyMount, FreeMount, Mount, OrbitingMount
from simgl.motion.pointing import Axes, Limb, Place, Pointing
from simgl.scenario.schema import CameraTable, LookAtTable
from simgl.scenario.table_checks import check_place, keypoint_on, named_spacecraft, place_on
from simgl.scene.spacecraft import SpacecraftModel


def read_mount(
    where: str, table: CameraTable, models: dict[str, SpacecraftModel], *, earth: bool
) -> Mount:
    """Where a camera sits and what it looks at.

    models : by spacecraft name
    earth : whether the scene has an Earth
    """
    check_place(table, where, ("on", "about", "position_icrf_m"))
    if table.about is not None:
        about = table.about
        for key in ("look_at", "limb", "boresight", "up", "axes", "keep_from_sun_deg"):
            if getattr(table, key) is not None:
                raise ConfigError(where, key, "contradicts about, which looks at its target")
        return OrbitingMount(
            target=named_spacecraft(about.target, models, where, "about.target"),
            azimuth=np.radians(about.azimuth_deg),
            elevation=np.radians(about.elevation_deg),
            range=about.range_m,
        )
    if table.on is None:
        if table.limb is not None:
            raise ConfigError(where, "limb", "requires on, got position_icrf_m")
        if table.axes not in (None, "icrf"):
            problem = f'must be "icrf" with position_icrf_m, got "{table.axes}"'
            raise ConfigError(where, "axes", problem)
        pointing = _pointing(where, table, models, "icrf")
        return FreeMount(position=np.array(table.position_icrf_m), pointing=pointing)
    if table.limb is not None and not earth:
        raise ConfigError(where, "limb", 'needs an Earth; shape = "none" leaves it out')
    model = models[named_spacecraft(table.on, models, where, "on")]
    axes = table.axes or ("body" if table.limb is None else "lvlh")
    position_body, group = place_on(model, table, where)
    return BodyMount(
        spacecraft=table.on,
        position_body=position_body,
        pointing=_pointing(where, table, models, axes),
        group=group,
    )


def _pointing(
    where: str, table: CameraTable, models: dict[str, SpacecraftModel], axes: Axes
) -> Pointing:
    ways = {"look_at": table.look_at, "limb": table.limb, "boresight": table.boresight}
    exactly_one(ways, where)
    towards: Array | Place | Limb
    if table.boresight is not None:
        towards = direction(table.boresight, where, "boresight")
    elif table.limb is not None:
        towards = Limb(
            azimuth=np.radians(table.limb.azimuth_deg),
            tangent_height=table.limb.tangent_height_km * 1e3,
        )
    else:
        assert table.look_at is not None
        towards = _place(where, table.look_at, models)
    up = (0.0, 0.0, -1.0)
    if axes == "lvlh" and isinstance(towards, np.ndarray) and not np.any(towards[:2]):
        up = (1.0, 0.0, 0.0)  # Nadir or zenith: the top of the image lies ahead.
    top = direction(table.up or up, where, "up")
    if table.up and isinstance(towards, np.ndarray) and abs(towards @ top) > 1.0 - 1e-9:
        raise ConfigError(where, "up", f"must not lie along boresight, got {shown(table.up)}")
    return Pointing(
        towards=towards,
        axes=axes,
        up=top,
        sun_exclusion=np.radians(table.keep_from_sun_deg or 0.0),
    )


def _place(where: str, given: str | LookAtTable, models: dict[str, SpacecraftModel]) -> Place:
    if isinstance(given, str):
        name = named_spacecraft(given, models, where, "look_at")
        return Place(spacecraft=name, position_body=np.zeros(3))
    name = named_spacecraft(given.target, models, where, "look_at.target")
    model = models[name]
    if given.keypoint is not None and given.part is not None:
        raise ConfigError(where, "look_at.part", "contradicts keypoint; give one of them")
    place, group = np.zeros(3), 0
    if given.keypoint is not None:
        group = group_of_keypoint(model.joints, given.keypoint)
        place = keypoint_on(model, given.keypoint, where, "look_at.keypoint")
    if given.part is not None:
        if given.part not in model.parts:
            known = did_you_mean(given.part, model.parts)
            problem = f'is not of "{model.name}": {shown(given.part)}; {known}'
            raise ConfigError(where, "look_at.part", problem)
        part = model.parts.index(given.part)
        group = group_of_part(model.joints, part)
        corners = model.mesh.positions[model.mesh.part == part]
        low, high = corners.min(axis=0), corners.max(axis=0)
        place = 0.5 * (low.astype(np.float64) + high.astype(np.float64))
    return Place(spacecraft=name, position_body=place, group=group)
