"""The heat that a scene sends to a spacecraft's patches: Sun, sunlit Earth, the Earth's warmth."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from simgl.arrays import Array, Mask
from simgl.environment_map import cube_directions, cube_solid_angles
from simgl.physics.constants import SOLAR_TEMPERATURE
from simgl.physics.spectrum import BANDS
from simgl.physics.thermal_radiation import band_fraction
from simgl.radiosity.gather_points import face_normals
from simgl.rays import ray_tracer
from simgl.scene.posed_mesh import PosedMesh
from simgl.scene.state import BodyState, EarthState, SceneState
from simgl.thermal.body import ThermalBody
from simgl.thermal.view_factors import CELLS_ACROSS, absorbed_light

# Of the Earth in the mean (Stephens et al. 2012; Loeb et al. 2018): long-wave flux that leaves it
# [W m-2], and the share of sunlight that it reflects.
OUTGOING_LONGWAVE = 240.0
BOND_ALBEDO = 0.30

# Directions in a cell of the sky along each edge, over which its radiance is averaged.
_FINER = 4


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


def total_sunlight(irradiance: Array) -> float:
    """The Sun's irradiance over all wavelengths of that in the bands (4,) [W m-2].

    The Sun is a black body of 5772 K: another temperature by 5 K changes this by 0.02 %.
    """
    edges = [edge for band in BANDS.edges for edge in band]
    share = float(band_fraction((min(edges), max(edges)), SOLAR_TEMPERATURE))
    return float(irradiance.sum()) / share


def heat_loads(body: ThermalBody, state: SceneState) -> HeatLoads:
    """The heat of a body in a scene.

    Form factors are those of the stored joints; what comes from Sun and Earth follows the joints.
    Light from and shadows of other spacecraft: their shadows only.
    """
    seen = state.bodies[body.name]
    posed = seen.model.posed_mesh
    count = body.patch_count
    sunlight = _sunlight(body, state, seen, posed)
    albedo, infrared = np.zeros(count), np.zeros(count)
    if state.earth is not None:
        albedo, infrared = _earthlight(body, state, state.earth, seen, posed)
    solar = absorbed_light(body.views, body.absorptance, sunlight + albedo)
    warm = absorbed_light(body.views, body.emissivity, infrared)
    heat = body.power.copy()
    heat[:count] += body.patches.areas * (solar + warm)
    return HeatLoads(sunlight=sunlight, albedo=albedo, earth_infrared=infrared, heat=heat)


def _motion(posed: PosedMesh, groups: int) -> Array:
    """(groups, 4, 4) body_from_stored."""
    return np.tile(np.eye(4), (groups, 1, 1)) if posed.motion is None else posed.motion


def _sunlight(body: ThermalBody, state: SceneState, seen: BodyState, posed: PosedMesh) -> Array:
    """(p,) direct sunlight on the patches, past the Earth and what stands before it [W m-2]."""
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
    normals, areas = face_normals(body.mesh)
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


def _earthlight(
    body: ThermalBody, state: SceneState, earth: EarthState, seen: BodyState, posed: PosedMesh
) -> tuple[Array, Array]:
    """(p,) reflected sunlight and long-wave radiation of the Earth on the patches [W m-2].

    The Earth is a Lambertian ellipsoid of one albedo and one long-wave flux. Each cell of the sky
    has its mean radiance; patches see the cells that their body leaves free.
    """
    sun = state.sun.seen_from(earth.position)
    reflected = BOND_ALBEDO * total_sunlight(sun.irradiance) / np.pi
    fine = CELLS_ACROSS * _FINER
    directions = cube_directions(fine).reshape(-1, 3)
    weight = np.tile(cube_solid_angles(fine).ravel(), 6)
    groups = int(body.group.max(initial=0)) + 1
    motion = _motion(posed, groups)
    albedo, infrared = np.zeros(body.patch_count), np.zeros(body.patch_count)
    for group in range(groups):
        chosen = np.flatnonzero(body.group == group)
        if len(chosen) == 0:
            continue
        R_icrf_from_stored = seen.pose.R_icrf_from_body @ motion[group, :3, :3]
        lines = directions @ R_icrf_from_stored.T
        met, cosine = _ground(lines, seen.pose.position, earth, sun.direction_icrf)
        rows = body.views.sky[chosen]
        weights = _cell_sums(weight)
        sunlit = _cell_sums(weight * met * np.maximum(cosine, 0.0)) / weights
        covered = _cell_sums(weight * met) / weights
        albedo[chosen] = np.pi * reflected * (rows @ sunlit)
        infrared[chosen] = OUTGOING_LONGWAVE * (rows @ covered)
    return albedo, infrared


def _cell_sums(values: Array) -> Array:
    """(6 CELLS_ACROSS^2,) sums over the finer directions of each cell of the sky."""
    shape = 6, CELLS_ACROSS, _FINER, CELLS_ACROSS, _FINER
    return values.reshape(shape).sum(axis=(2, 4)).ravel()


def _ground(
    lines: Array, position: Array, earth: EarthState, sun_direction: Array
) -> tuple[Array, Array]:
    """(k,) whether lines of sight (k, 3) meet the ellipsoid, and the Sun's cosine there."""
    turn = earth.R_itrf_from_icrf
    radii = np.asarray(earth.radii)
    eye = (turn @ (position - earth.position)) / radii
    ways = (lines @ turn.T) / radii
    a = np.einsum("ki,ki->k", ways, ways)
    b = ways @ eye
    inside = b * b - a * (eye @ eye - 1.0)
    met = (inside > 0.0) & (b < 0.0)
    distance = (-b - np.sqrt(np.maximum(inside, 0.0))) / a
    # The gradient of the ellipsoid's equation.
    normal = (eye + distance[:, None] * ways) / radii
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-30)
    return met.astype(np.float64), normal @ (turn @ sun_direction)
