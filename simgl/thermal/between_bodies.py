"""What spacecraft near each other send to each other: warmth, and light that they reflect."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy import sparse

from simgl.arrays import Array
from simgl.environment_map import cube_cell
from simgl.physics.constants import STEFAN_BOLTZMANN
from simgl.rays import ray_tracer
from simgl.scene.posed_mesh import PosedMesh
from simgl.scene.state import SceneState
from simgl.thermal.body import ThermalBody, patches_met
from simgl.thermal.heat_loads import HeatLoads, body_motion, heat_loads, outer_light
from simgl.thermal.sky_light import SKY_CELLS, SkyLight

# A body counts that may fill this share of another's hemisphere; less is 2 W m-2 and some 0.3 K.
_NEAR = 4e-3
# Rays of a patch towards another body, of all its sample points together.
_RAYS = 96
# Rounds of scaling that make sums those of rays.
_SCALINGS = 10
# Light goes on between bodies until a reflection adds less than this share of the first, at most
# so often.
_DARK, _MAX_BOUNCES = 1e-6, 1000

Bodies = Mapping[str, ThermalBody]
# Values of the patches of each body (p,), by its name.
OfBodies = Mapping[str, Array]


@dataclass(frozen=True, kw_only=True, eq=False)
class Neighbours:
    """How bodies that are near each other see each other.

    factors : by receiver and sender, (p, q) csr, the share of the hemisphere of each of p patches
        that each of q covers; reciprocal
    hidden : by receiver, (p, cells) csr, the share that others cover, by cells of the sky in its
        axes
    """

    factors: Mapping[tuple[str, str], sparse.csr_matrix]
    hidden: Mapping[str, sparse.csr_matrix]

    def received(self, sent: OfBodies) -> dict[str, Array]:
        """(p,) irradiance of each body by the radiosity (q,) of the others."""
        result = {name: np.zeros(matrix.shape[0]) for name, matrix in self.hidden.items()}
        for (receiver, sender), factors in self.factors.items():
            result[receiver] += factors @ sent[sender]
        return result


def neighbours(bodies: Bodies, state: SceneState) -> Neighbours:
    """Pairs of bodies that may fill 0.4 % of each other's hemisphere, by rays.

    Rays from both ends of a pair are averaged, as areas have it. A pure function of the poses.
    """
    shares: dict[tuple[str, str], sparse.csr_matrix] = {}
    hidden: dict[str, sparse.csr_matrix] = {}
    for receiver in bodies:
        for sender in bodies:
            if receiver != sender and _are_near(receiver, sender, state):
                seen, sky = _seen(bodies[receiver], bodies[sender], state)
                shares[receiver, sender] = seen
                hidden[receiver] = hidden[receiver] + sky if receiver in hidden else sky
    factors = {}
    for (receiver, sender), seen in shares.items():
        if (sender, receiver) in factors:
            continue
        areas = bodies[receiver].patches.areas, bodies[sender].patches.areas
        pairs = _reciprocal(areas, seen, shares[sender, receiver])
        for pair, area, matrix in (
            ((receiver, sender), areas[0], pairs),
            ((sender, receiver), areas[1], pairs.T),
        ):
            inverse = sparse.diags_array(1.0 / np.maximum(area, 1e-30))
            factors[pair] = sparse.csr_matrix(inverse @ matrix)
    return Neighbours(factors=factors, hidden=hidden)


def _reciprocal(
    areas: tuple[Array, Array], seen: sparse.csr_matrix, back: sparse.csr_matrix
) -> sparse.csr_matrix:
    """(p, q) exchange areas of two bodies [m2]: rays from both ends averaged, and scaled so that
    rows and columns keep the sums of their own rays (Sinkhorn 1964)."""
    of_rows = sparse.diags_array(areas[0]) @ seen
    of_columns = sparse.csr_matrix((sparse.diags_array(areas[1]) @ back).T)
    wanted = np.asarray(of_rows.sum(axis=1)).ravel(), np.asarray(of_columns.sum(axis=0)).ravel()
    pairs = sparse.csr_matrix(0.5 * (of_rows + of_columns))
    for _ in range(_SCALINGS):
        for axis, sums in ((1, wanted[0]), (0, wanted[1])):
            now = np.asarray(pairs.sum(axis=axis)).ravel()
            scale = np.divide(sums, now, out=np.zeros_like(now), where=now > 0.0)
            matrix = sparse.diags_array(scale)
            pairs = sparse.csr_matrix(matrix @ pairs if axis == 1 else pairs @ matrix)
    return pairs


def scene_heat_loads(
    bodies: Bodies,
    state: SceneState,
    skies: Mapping[str, SkyLight],
    temperatures: OfBodies,
    known: Neighbours | None = None,
) -> dict[str, HeatLoads]:
    """The heat of every body of a scene, with what bodies near each other exchange.

    skies : the heat of each (``Skies.heat``)
    temperatures : (n,) of each body's nodes, whose patches warm the others [K]
    known : the ``neighbours`` of the scene, where they are
    """
    near = neighbours(bodies, state) if known is None else known
    far = {name: body for name, body in bodies.items() if name not in near.hidden}
    loads = {name: heat_loads(body, state, skies[name]) for name, body in far.items()}
    together = {name: bodies[name] for name in near.hidden}
    if not together:
        return loads
    outer = {n: outer_light(b, state, skies[n], near.hidden[n]) for n, b in together.items()}
    emitted = {
        name: _emitted_radiosity(body, temperatures[name][: body.patch_count])
        for name, body in together.items()
    }
    warmth = near.received(emitted)
    solar = reflected_between(
        together,
        near,
        {name: light.sunlight + light.albedo for name, light in outer.items()},
        {name: 1.0 - body.absorptance for name, body in together.items()},
    )
    warm = reflected_between(
        together,
        near,
        {name: light.earth_infrared + warmth[name] for name, light in outer.items()},
        {name: 1.0 - body.emissivity for name, body in together.items()},
    )
    for name, body in together.items():
        heat = body.power.copy()
        absorbed = body.absorptance * solar[name] + body.emissivity * warm[name]
        heat[: body.patch_count] += body.patches.areas * absorbed
        loads[name] = HeatLoads(sunlight=outer[name].sunlight, heat=heat)
    return loads


def reflected_between(
    bodies: Bodies,
    near: Neighbours,
    irradiance: OfBodies,
    reflectance: OfBodies,
    until: float = _DARK,
) -> dict[str, Array]:
    """(p,) irradiance of each body after all reflections within and between bodies.

    irradiance : (p,) that arrives first; reflectance : (p,)
    until : share of the brightest patch below which a reflection is the last
    """
    total = {name: irradiance[name] for name in bodies}
    bounce = total
    for _ in range(_MAX_BOUNCES):
        sent = {name: reflectance[name] * bounce[name] for name in bodies}
        others = near.received(sent)
        bounce = {
            name: body.views.factors @ sent[name] + others.get(name, 0.0)
            for name, body in bodies.items()
        }
        total = {name: total[name] + bounce[name] for name in bodies}
        brightest = max(float(np.max(light, initial=0.0)) for light in total.values())
        if all(float(np.max(one, initial=0.0)) <= until * brightest for one in bounce.values()):
            break
    return total


def _emitted_radiosity(body: ThermalBody, kelvin: Array) -> Array:
    """(p,) what a body's patches send of their own emission, after reflections within it
    [W m-2]."""
    sent = body.emissivity * STEFAN_BOLTZMANN * kelvin**4
    rho = 1.0 - body.emissivity
    no_neighbours = Neighbours(factors={}, hidden={})
    first = {body.name: body.views.factors @ sent}
    light = reflected_between({body.name: body}, no_neighbours, first, {body.name: rho})[body.name]
    return np.asarray(sent + rho * light)


def _are_near(receiver: str, sender: str, state: SceneState) -> bool:
    one, other = state.bodies[receiver], state.bodies[sender]
    meshes = one.model.posed_mesh, other.model.posed_mesh
    places = (
        body.pose.position + body.pose.R_icrf_from_body @ mesh.centre
        for body, mesh in zip((one, other), meshes, strict=True)
    )
    gap = float(np.linalg.norm(np.subtract(*places))) - meshes[0].radius - meshes[1].radius
    # From the nearest points on both spheres, the larger of which both may fill for the other.
    radius = max(mesh.radius for mesh in meshes)
    return gap <= 0.0 or radius**2 >= _NEAR * (gap + radius) ** 2


def _posed(body: ThermalBody, state: SceneState) -> PosedMesh:
    posed = state.bodies[body.name].model.posed_mesh
    return PosedMesh(mesh=body.mesh, joints=posed.joints, motion=posed.motion)


def _seen(
    receiver: ThermalBody, sender: ThermalBody, state: SceneState
) -> tuple[sparse.csr_matrix, sparse.csr_matrix]:
    """(p, q) shares of hemispheres that another body's patches cover, and (p, cells) of the sky."""
    one, other = state.bodies[receiver.name], state.bodies[sender.name]
    turn = other.pose.R_icrf_from_body.T @ one.pose.R_icrf_from_body
    shift = other.pose.R_icrf_from_body.T @ (one.pose.position - other.pose.position)
    posed = other.model.posed_mesh
    motion = body_motion(receiver, state)[receiver.group]
    points = np.einsum("pij,psj->psi", motion[:, :3, :3], receiver.patches.points)
    points += motion[:, None, :3, 3]
    normals = np.einsum("pij,psj->psi", motion[:, :3, :3], receiver.patches.normals)
    samples = points.shape[1]
    centre = turn.T @ (posed.centre - shift)
    towards = centre - points
    distance = np.linalg.norm(towards, axis=2)
    sine = np.minimum(posed.radius / np.maximum(distance, 1e-9), 1.0)
    above = np.einsum("psi,psi->ps", normals, towards) > -sine * distance
    patch, point = np.nonzero(receiver.views.point_open & above)
    each = max(_RAYS // samples, 1)
    patch, point = np.repeat(patch, each), np.repeat(point, each)
    ways, weight = _towards_sphere(
        normals[patch, point], towards[patch, point], sine[patch, point], each
    )
    weight /= each * np.maximum(receiver.views.point_open.sum(axis=1), 1)[patch]
    starts = points[patch, point]
    triangle, reach = ray_tracer(_posed(sender, state)).hits(starts @ turn.T + shift, ways @ turn.T)
    met = np.flatnonzero((triangle >= 0) & (weight > 0.0))
    within = ray_tracer(_posed(receiver, state)).occluded(starts[met], ways[met], reach[met])
    met = met[~within]
    side = sender.patches.of_side[triangle[met].astype(np.int64)]
    moved = body_motion(sender, state)[sender.group[side]][:, :3, :3]
    as_stored = np.einsum("kji,kj->ki", moved, ways[met] @ turn.T)
    patches = patches_met(sender, triangle[met].astype(np.int64), as_stored)
    cells = cube_cell(ways[met], SKY_CELLS)
    rows, values = patch[met], weight[met]
    count = receiver.patch_count
    seen = sparse.csr_matrix((values, (rows, patches)), shape=(count, sender.patch_count))
    return seen, sparse.csr_matrix((values, (rows, cells)), shape=(count, 6 * SKY_CELLS**2))


def _towards_sphere(normals: Array, towards: Array, sine: Array, each: int) -> tuple[Array, Array]:
    """(k, 3) directions within the cones around a sphere, or over the hemisphere from within it,
    and (k,) the shares of the hemisphere that they stand for, times their number.

    towards : (k, 3) its middle; sine : (k,) of the cone's half angle, 1 from within
    each : directions of a point, which follow each other
    """
    number = np.arange(len(normals))
    # An even sequence in two dimensions (Roberts 2018), turned from point to point.
    start = (number // each) * 0.6180339887498949
    u = ((number % each + 0.5) / each + start) % 1.0
    v = ((number % each) * 0.7548776662466927 + 0.5 * start) % 1.0
    inside = sine >= 1.0
    axis = np.where(
        inside[:, None], normals, towards / np.linalg.norm(towards, axis=1, keepdims=True)
    )
    cone = 1.0 - np.sqrt(np.maximum(1.0 - sine**2, 0.0))
    cosine = np.where(inside, np.sqrt(u), 1.0 - u * cone)
    oblique = np.where(np.abs(axis[:, :1]) > 0.7, [0.0, 1.0, 0.0], [1.0, 0.0, 0.0])
    right = np.cross(axis, oblique)
    right /= np.linalg.norm(right, axis=1, keepdims=True)
    across = np.sqrt(np.maximum(1.0 - cosine**2, 0.0))[:, None]
    angle = 2.0 * np.pi * v[:, None]
    ways = cosine[:, None] * axis
    ways += across * (np.cos(angle) * right + np.sin(angle) * np.cross(axis, right))
    facing = np.maximum(np.einsum("ki,ki->k", ways, normals), 0.0)
    return ways, np.where(inside, 1.0, 2.0 * cone * facing)
