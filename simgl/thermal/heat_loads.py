"""The heat that a scene sends to a spacecraft's patches: Sun, sunlit Earth, the Earth's warmth."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy import sparse

from simgl.arrays import Array, Mask
from simgl.environment_map import cube_cell, cube_directions, cube_solid_angles
from simgl.physics.earth_infrared import outgoing_longwave
from simgl.rays import ray_tracer
from simgl.scene.earth import Clouds, Earth
from simgl.scene.posed_mesh import PosedMesh
from simgl.scene.state import BodyState, EarthState, SceneState
from simgl.thermal.body import ThermalBody
from simgl.thermal.ground_seen import day_of_year, ground_seen, total_sunlight
from simgl.thermal.view_factors import CELLS_ACROSS, absorbed_light

# Share of sunlight that an Earth with maps reflects: without clouds, and with those of the usual
# cover (Loeb et al. 2018, rounded).
_CLEAR_ALBEDO, _USUAL_ALBEDO = 0.15, 0.30

# Directions in a cell of the sky along each edge, over which its radiance is averaged, and along
# the edge of a cube.
_FINER = 4
SKY_CELLS = CELLS_ACROSS * _FINER


@dataclass(frozen=True, kw_only=True, eq=False)
class HeatLoads:
    """Light on the patches of a body, and what its nodes absorb.

    sunlight, albedo, earth_infrared : (p,) on the patches, from outside [W m-2]
    heat : (n,) absorbed after all reflections, and internal power [W]
    """

    sunlight: Array
    albedo: Array
    earth_infrared: Array
    heat: Array


@dataclass(frozen=True, kw_only=True, eq=False)
class OuterLight:
    """(p,) light on the patches of a body from Sun and Earth; see ``HeatLoads``."""

    sunlight: Array
    albedo: Array
    earth_infrared: Array


def outer_light(
    body: ThermalBody, state: SceneState, hidden: sparse.csr_matrix | None = None
) -> OuterLight:
    """What Sun and Earth send to a body in a scene.

    hidden : (p, cells) shares of the patches' hemispheres that other bodies cover
    """
    albedo, infrared = np.zeros(body.patch_count), np.zeros(body.patch_count)
    sunlight = _sunlight(body, state, state.bodies[body.name])
    if state.earth is not None:
        albedo, infrared = _earthlight(body, state, state.earth, hidden)
    return OuterLight(sunlight=sunlight, albedo=albedo, earth_infrared=infrared)


def heat_loads(body: ThermalBody, state: SceneState) -> HeatLoads:
    """The heat of a body in a scene.

    Form factors are those of the stored joints; what comes from Sun and Earth follows the joints.
    Of other spacecraft their shadows only; for more see ``scene_heat_loads``.
    """
    count, light = body.patch_count, outer_light(body, state)
    solar = absorbed_light(body.views, body.absorptance, light.sunlight + light.albedo)
    warm = absorbed_light(body.views, body.emissivity, light.earth_infrared)
    heat = body.power.copy()
    heat[:count] += body.patches.areas * (solar + warm)
    return HeatLoads(
        sunlight=light.sunlight,
        albedo=light.albedo,
        earth_infrared=light.earth_infrared,
        heat=heat,
    )


def body_motion(body: ThermalBody, state: SceneState) -> Array:
    """(groups, 4, 4) body_from_stored of a body's rigid groups."""
    posed = state.bodies[body.name].model.posed_mesh
    return _motion(posed, int(body.group.max(initial=0)) + 1)


def _motion(posed: PosedMesh, groups: int) -> Array:
    """(groups, 4, 4) body_from_stored."""
    return np.tile(np.eye(4), (groups, 1, 1)) if posed.motion is None else posed.motion


def _sunlight(body: ThermalBody, state: SceneState, seen: BodyState) -> Array:
    """(p,) direct sunlight on the patches, past the Earth and what stands before it [W m-2]."""
    posed = seen.model.posed_mesh
    place = seen.pose.position
    sun = state.sun.seen_from(place)
    irradiance = total_sunlight(sun.irradiance) * state.sunlit_share(place)
    shape = body.patches.points.shape
    if irradiance == 0.0:
        return np.zeros(shape[0])
    motion = _motion(posed, int(body.group.max(initial=0)) + 1)[body.group]
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


def bond_albedo(earth: Earth, irradiance: Array) -> float:
    """Share of all sunlight that an Earth reflects.

    irradiance : (4,) of the Sun in the bands, which stand for all wavelengths where the Earth has
        an albedo of its own
    """
    if earth.albedo is not None:
        return float(irradiance @ np.array(earth.albedo) / irradiance.sum())
    clouds = earth.clouds
    if clouds is None or clouds.image is not None:
        return _CLEAR_ALBEDO if clouds is None else _USUAL_ALBEDO
    share = clouds.cover / Clouds.cover
    return min(_CLEAR_ALBEDO + (_USUAL_ALBEDO - _CLEAR_ALBEDO) * share, 1.0)


def _earthlight(
    body: ThermalBody, state: SceneState, earth: EarthState, hidden: sparse.csr_matrix | None
) -> tuple[Array, Array]:
    """(p,) reflected sunlight and long-wave radiation of the Earth on the patches [W m-2].

    The long-wave flux is that of the climate by latitude and season which thermal images show.
    """
    sun = state.sun.seen_from(earth.position)
    position = state.bodies[body.name].pose.position
    reflected = bond_albedo(earth.earth, sun.irradiance) * total_sunlight(sun.irradiance) / np.pi
    day = day_of_year(state.tai_ns)

    def radiances(lines: Array) -> Array:
        ground = ground_seen(lines, position, earth, sun.direction_icrf)
        sunlit = reflected * ground.met * np.maximum(ground.sun_cosine, 0.0)
        flux = outgoing_longwave(ground.normal[:, 2], day)
        return np.stack([sunlit, flux / np.pi * ground.met], axis=1)

    albedo, infrared = light_of_sky(body, state, radiances, hidden).T
    return albedo, infrared


def light_of_sky(
    body: ThermalBody,
    state: SceneState,
    radiances: Callable[[Array], Array],
    hidden: sparse.csr_matrix | None = None,
) -> Array:
    """(p, m) light of the sky on the patches, where the body leaves it free.

    radiances : of m lights along lines of sight (k, 3), ICRF, from the body: (k, m)
    hidden : (p, cells) shares of the patches' hemispheres that other bodies cover

    Each cell of the sky has its mean radiance. It is evaluated once, on a cube in ICRF axes.
    """
    seen = state.bodies[body.name]
    fine = SKY_CELLS
    directions = cube_directions(fine).reshape(-1, 3)
    weight = np.tile(cube_solid_angles(fine).ravel(), 6)[:, None]
    solid_angles, light = _cell_sums(weight), radiances(directions)
    motion = _motion(seen.model.posed_mesh, int(body.group.max(initial=0)) + 1)
    rotations, of_group = np.unique(motion[:, :3, :3], axis=0, return_inverse=True)
    lights = np.zeros((body.patch_count, light.shape[1]))
    for number, rotation in enumerate(rotations):
        chosen = np.flatnonzero(of_group.ravel()[body.group] == number)
        if not len(chosen):
            continue
        R_icrf_from_stored = seen.pose.R_icrf_from_body @ rotation
        turned = light[cube_cell(directions @ R_icrf_from_stored.T, fine)]
        mean = _cell_sums(weight * turned) / solid_angles
        lights[chosen] = np.pi * (body.views.sky[chosen] @ mean)
    return lights if hidden is None else np.maximum(lights - np.pi * (hidden @ light), 0.0)


def _cell_sums(values: Array) -> Array:
    """(6 CELLS_ACROSS^2, m) sums of (k, m) over the finer directions of each cell of the sky."""
    shape = 6, CELLS_ACROSS, _FINER, CELLS_ACROSS, _FINER, values.shape[1]
    return values.reshape(shape).sum(axis=(2, 4)).reshape(-1, values.shape[1])
