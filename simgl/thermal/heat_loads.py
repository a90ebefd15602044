"""The heat that a scene sends to a spacecraft's patches: Sun, sunlit Earth, the Earth's warmth."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from simgl.arrays import Array, Mask
from simgl.rays import ray_tracer
from simgl.scene.state import BodyState, SceneState
from simgl.thermal.body import ThermalBody
from simgl.thermal.infrared_surroundings import total_sunlight
from simgl.thermal.sky_light import SkyLight, light_of_sky, motion_of
from simgl.thermal.view_factors import absorbed_light


@dataclass(frozen=True, kw_only=True, eq=False)
class HeatLoads:
    """What the nodes of a body absorb.

    sunlight : (p,) on the patches, from outside [W m-2]
    heat : (n,) absorbed after all reflections, and internal power [W]
    """

    sunlight: Array
    heat: Array


@dataclass(frozen=True, kw_only=True, eq=False)
class OuterLight:
    """(p,) light on the patches of a body from Sun and Earth [W m-2]."""

    sunlight: Array
    albedo: Array
    earth_infrared: Array


def outer_light(
    body: ThermalBody, state: SceneState, sky: SkyLight, hidden: sparse.csr_matrix | None = None
) -> OuterLight:
    """What Sun and Earth send to a body in a scene.

    sky : its heat (``Skies.heat``)
    hidden : (p, cells) shares of the patches' hemispheres that other bodies cover
    """
    albedo, infrared = light_of_sky(body, state, sky, hidden).T
    sunlight = _sunlight(body, state, state.bodies[body.name])
    return OuterLight(sunlight=sunlight, albedo=albedo, earth_infrared=infrared)


def heat_loads(body: ThermalBody, state: SceneState, sky: SkyLight) -> HeatLoads:
    """The heat of a body in a scene.

    sky : its heat (``Skies.heat``)

    Form factors are those of the stored joints; what comes from Sun and Earth follows the joints.
    Of other spacecraft their shadows only; for more see ``scene_heat_loads``.
    """
    count, light = body.patch_count, outer_light(body, state, sky)
    solar = absorbed_light(body.views, body.absorptance, light.sunlight + light.albedo)
    warm = absorbed_light(body.views, body.emissivity, light.earth_infrared)
    heat = body.power.copy()
    heat[:count] += body.patches.areas * (solar + warm)
    return HeatLoads(sunlight=light.sunlight, heat=heat)


def body_motion(body: ThermalBody, state: SceneState) -> Array:
    """(groups, 4, 4) body_from_stored of a body's rigid groups."""
    posed = state.bodies[body.name].model.posed_mesh
    return motion_of(posed, int(body.group.max(initial=0)) + 1)


def _sunlight(body: ThermalBody, state: SceneState, seen: BodyState) -> Array:
    """(p,) direct sunlight on the patches, past the Earth and what stands before it [W m-2]."""
    posed = seen.model.posed_mesh
    place = seen.pose.position
    sun = state.sun.seen_from(place)
    irradiance = total_sunlight(sun.irradiance, state.bands) * state.sunlit_share(place)
    shape = body.patches.points.shape
    if irradiance == 0.0:
        return np.zeros(shape[0])
    motion = motion_of(posed, int(body.group.max(initial=0)) + 1)[body.group]
    direction = seen.pose.R_icrf_from_body.T @ sun.direction_icrf
    normals = np.einsum("pij,psj->psi", motion[:, :3, :3], body.patches.normals)
    points = np.einsum("pij,psj->psi", motion[:, :3, :3], body.patches.points)
    points += motion[:, None, :3, 3]
    cosine = (normals @ direction).ravel()
    lit = np.flatnonzero((cosine > 0.0) & body.views.point_open.ravel())
    rays = np.tile(direction, (len(lit), 1))
    starts = points.reshape(-1, 3)[lit]
    shaded = ray_tracer(posed).occluded(starts, rays)
    shaded |= _shaded_by_others(state, seen, starts, rays)
    patch = lit // shape[1]
    facing = np.bincount(patch, minlength=shape[0])
    sunlit = np.bincount(patch[~shaded], minlength=shape[0])
    # What samples see is a share of the area that faces the Sun, which triangles give exactly.
    facing_area = _facing(body, np.einsum("pji,j->pi", motion[:, :3, :3], direction))
    return irradiance * facing_area * sunlit / np.maximum(facing, 1)


def _facing(body: ThermalBody, directions: Array) -> Array:
    """(p,) mean over a patch of the cosine towards a light, 0 where it faces away.

    directions : (p, 3) of each patch, as stored
    """
    normals, areas = body.faces
    of_side = body.patches.of_side
    sides = len(of_side) // len(areas)
    signs = np.repeat([1.0, -1.0][:sides], len(areas))
    cosine = signs * np.einsum("ij,ij->i", np.tile(normals, (sides, 1)), directions[of_side])
    sums = np.bincount(
        of_side, np.tile(areas, sides) * np.maximum(cosine, 0.0), minlength=len(directions)
    )
    return np.asarray(sums / np.maximum(body.patches.areas, 1e-30))


def _shaded_by_others(state: SceneState, seen: BodyState, starts: Array, rays: Array) -> Mask:
    """(k,) whether rays from places in body axes meet another spacecraft."""
    shaded = np.zeros(len(starts), dtype=np.bool_)
    R, position = seen.pose.R_icrf_from_body, seen.pose.position
    for other in state.bodies.values():
        if other is seen:
            continue
        turn = other.pose.R_icrf_from_body.T @ R
        shift = other.pose.R_icrf_from_body.T @ (position - other.pose.position)
        mesh = other.model.posed_mesh
        line, middle = turn @ rays[:1].T, mesh.centre[:, None]
        offset = shift[:, None] - middle
        along = float((offset * line).sum())
        reach = mesh.radius + seen.model.posed_mesh.radius + float(np.linalg.norm(starts.max(0)))
        if len(rays) == 0 or along > reach or np.linalg.norm(offset - along * line) > reach:
            continue
        shaded |= ray_tracer(mesh).occluded(starts @ turn.T + shift, rays @ turn.T)
    return shaded
