"""Radiosity: light on the patches and vertices of a body at one instant."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import sparse

from simgl.arrays import Array, Array32, IndexArray, Mask
from simgl.radiosity.light_transport import GatherMatrix, LightTransport
from simgl.rays import AnyRayTracer
from simgl.scene.materials import Material

# What is left of the error of the first guess when the bounces end.
RESIDUAL = 3e-3
# Only a closed body of perfect reflectance needs more: there the sum of bounces has no end.
_MAX_STEPS = 200


@dataclass(frozen=True, kw_only=True, eq=False)
class Reflectors:
    """The patches of a body with its materials on them.

    albedo : (p, 4) share of the light that leaves again
    exitance : (p, 4) that they give off by themselves [W m-2]
    contraction : upper bound of what one bounce leaves of any light, below 1
    """

    albedo: Array32
    exitance: Array32
    contraction: float


@dataclass(frozen=True, kw_only=True, eq=False)
class Blocker:
    """Another body that shades this one.

    other_from_body : (4, 4) between their axes
    centre, radius : (3,) of its bounding sphere, in its own axes [m]
    hull : (k, 3) corners of its convex hull, there too
    """

    tracer: AnyRayTracer
    other_from_body: Array
    centre: Array
    radius: float
    hull: Array


@dataclass(frozen=True, kw_only=True, eq=False)
class SpotLight:
    """A lamp in body axes.

    place : (3,) [m]; axis : (3,) unit, along the beam
    half_angle, edge : of full intensity, and the fall to zero around it [rad]
    intensity : (4,) [W sr-1]
    """

    place: Array
    axis: Array
    half_angle: float
    edge: float
    intensity: Array


def hemispherical_albedo(material: Material) -> Array:
    """(4,) reflectance of a surface under uniform light.

    A dielectric's base loses what Fresnel's term takes: its mean over the hemisphere is
    F0 + (1 - F0) / 21, the integral of Schlick's (1 - cos)^5 with the cosine.
    """
    base = np.asarray(material.reflectance)
    if material.roughness is None:
        return base
    f0 = 0.04 + material.metallic * (base - 0.04)
    fresnel = f0 + (1.0 - f0) / 21.0
    return fresnel + (1.0 - fresnel) * (1.0 - material.metallic) * base


def material_light(materials: Sequence[Material]) -> tuple[Array32, Array32]:
    """(k, 4) albedo of materials under uniform light, and their own exitance [W m-2]."""
    albedo = np.array([hemispherical_albedo(m) for m in materials], dtype=np.float32)
    exitance = np.array([np.pi * np.asarray(m.emission) for m in materials], dtype=np.float32)
    return albedo, exitance


def reflectors(transport: LightTransport, materials: Sequence[Material]) -> Reflectors:
    """The patches with a model's materials."""
    used = materials[: transport.materials.shape[1]]
    albedo, exitance = (transport.materials @ light for light in material_light(used))
    return Reflectors(
        albedo=albedo,
        exitance=exitance,
        contraction=_contraction(transport.form_factors, albedo.astype(np.float64)),
    )


def _contraction(form_factors: sparse.csr_matrix, albedo: Array) -> float:
    """Upper bound of the spectral radius of one bounce, in its most reflecting band.

    For a matrix without negative entries and any positive x it is at most the largest of
    (M x)_i / x_i (Collatz & Wielandt); x close to the main eigenvector makes the bound tight.
    """
    x = np.ones(albedo.shape)
    bound = np.inf
    for _ in range(20):
        y = form_factors @ (albedo * x)
        bound = min(bound, float((y / x).max()))
        x = y / y.max() + 1e-3 if y.max() > 0.0 else x
    return min(bound, 1.0 - 1e-6)


def radiosity(
    transport: LightTransport,
    surface: Reflectors,
    emitted: Array32,
    residual: float = RESIDUAL,
) -> Array32:
    """(p, 4) or (p, 4, n) exitance of the patches after all bounces [W m-2].

    emitted : exitance before any bounce, of one light or of n separate ones; a light gets the same
        bits among others as by itself
    residual : what is left of the error of the first guess

    x = M x + c with Chebyshev's acceleration (Golub & Varga 1961): after k steps the error is below
    2 r^k of the first, r = mu / (1 + sqrt(1 - mu^2)) for a spectrum in -mu .. mu. The first guess
    lets the second bounce stand for all later ones, each less by the same ratio.
    """
    factors, count = transport.form_factors, len(emitted)
    albedo = surface.albedo if emitted.ndim == 2 else surface.albedo[:, :, None]

    def bounced(light: Array32) -> Array32:
        return albedo * (factors @ light.reshape(count, -1)).reshape(emitted.shape)

    mu = surface.contraction
    rate = mu / (1.0 + np.sqrt(1.0 - mu * mu))
    once = bounced(emitted)
    if rate <= 0.0 or not np.any(once):
        return emitted + once
    twice = bounced(once)
    ratio = (once * twice).sum(axis=0) / np.maximum((once * once).sum(axis=0), np.float32(1e-30))
    older = emitted + once + twice / (1.0 - np.clip(ratio, 0.0, np.float32(mu)))
    newer, omega = older, 1.0
    steps = min(int(np.ceil(np.log(0.5 * residual) / np.log(rate))) - 2, _MAX_STEPS)
    for step in range(steps):
        next_ = bounced(newer) + emitted
        if step == 0:
            older, newer = newer, next_
            continue
        omega = 1.0 / (1.0 - 0.5 * mu * mu) if step == 1 else 1.0 / (1.0 - 0.25 * mu * mu * omega)
        older, newer = newer, (omega * (next_ - older) + older).astype(np.float32)
    return np.maximum(newer, 0.0)


def lit_samples(transport: LightTransport, direction: Array) -> tuple[Mask, Mask]:
    """(p, n) which sample points of each patch the Sun reaches, and which are outside all other
    parts.

    direction : (3,) unit, towards the Sun, body axes
    """
    points, normals = (a.reshape(-1, 3) for a in (transport.points, transport.normals))
    valid = transport.point_open
    lit = seeing(transport.tracer, points, normals, direction, valid.ravel())
    return lit.reshape(valid.shape), valid


def seeing(
    tracer: AnyRayTracer, points: Array32, normals: Array32, direction: Array, asked: Mask
) -> Mask:
    """(n,) whether points (n, 3) of surfaces see the Sun in a direction (3,); no, if not asked."""
    towards = direction.astype(np.float32)
    facing = np.flatnonzero((normals @ towards > 0.0) & asked)
    rays = np.broadcast_to(towards, (len(facing), 3))
    lit = np.zeros(len(points), dtype=np.bool_)
    lit[facing[~tracer.occluded(points[facing], rays)]] = True
    return lit


def mean_normals(transport: LightTransport, lit: Mask, valid: Mask) -> Array32:
    """(p, 3) mean over each patch's sample points: their normals where they are lit.

    lit, valid : as of ``lit_samples``; the product of its direction with a row is the mean cosine
    """
    normals = np.where(lit[:, :, None], transport.normals, np.float32(0.0)).sum(axis=1)
    count = np.maximum(valid.sum(axis=1), 1).astype(np.float32)
    return np.asarray(normals / count[:, None], dtype=np.float32)


def sun_cosines(transport: LightTransport, direction: Array) -> Array32:
    """(p,) mean over each patch of its cosine to the Sun where the Sun is seen."""
    normals = mean_normals(transport, *lit_samples(transport, direction))
    return np.asarray(np.maximum(normals @ direction.astype(np.float32), 0.0))


def blocked_by(
    transport: LightTransport, direction: Array, blockers: Sequence[Blocker], asked: Mask
) -> Array32:
    """(p,) share of each patch's sample points that other bodies hide from the Sun.

    asked : (p,) patches that need it; the others get 0
    """
    lit = np.flatnonzero(asked)
    centres, radii = (np.take(a, lit, axis=0) for a in transport.patch_spheres)
    each = transport.points.shape[1]
    hidden = np.zeros((len(lit), each), dtype=np.bool_)
    for blocker in blockers:
        turn, shift = blocker.other_from_body[:3, :3], blocker.other_from_body[:3, 3]
        towards = turn @ direction
        # Only patches whose lines of sight pass through its bounding sphere.
        offset = centres @ turn.T + (shift - blocker.centre)
        along = offset @ towards
        past = offset - along[:, None] * towards
        reach = blocker.radius + radii
        passed = np.einsum("ij,ij->i", past, past) < reach * reach
        near = np.flatnonzero(passed & (along < reach))
        points = np.take(transport.points, lit[near], axis=0).reshape(-1, 3)
        origins = points @ turn.T.astype(np.float32) + shift.astype(np.float32)
        rays = np.broadcast_to(towards.astype(np.float32), origins.shape)
        met = blocker.tracer.occluded(origins, rays)
        hidden[near] |= met.reshape(-1, each)
    share = np.zeros(len(asked), dtype=np.float32)
    share[lit] = hidden.mean(axis=1, dtype=np.float32)
    return share


def lamp_irradiance(
    transport: LightTransport, lamp: SpotLight, blockers: Sequence[Blocker] = ()
) -> Array32:
    """(p, 4) mean irradiance of each patch by a lamp [W m-2]."""
    mean = np.zeros(len(transport.areas))
    patches = _patches_in_beam(transport, lamp)
    all_points, all_normals, all_open = transport.few_points
    points = np.take(all_points, patches, axis=0).reshape(-1, 3)
    normals = np.take(all_normals, patches, axis=0).reshape(-1, 3)
    valid = np.take(all_open, patches, axis=0)
    offset = lamp.place - points
    along = np.einsum("ni,ni->n", normals, offset)
    # Most face away; the others one beside the other.
    lit = np.flatnonzero((along > 0.0) & valid.ravel())
    points, offset = np.take(points, lit, axis=0), np.take(offset, lit, axis=0)
    distance = np.sqrt(np.einsum("ni,ni->n", offset, offset))
    off_axis = np.arccos(np.clip(-(offset @ lamp.axis) / distance, -1.0, 1.0))
    beyond = np.clip((off_axis - lamp.half_angle) / lamp.edge, 0.0, 1.0)
    power = along[lit] / distance * (1.0 - beyond * beyond * (3.0 - 2.0 * beyond)) / distance**2
    seen = np.flatnonzero(power > 0.0)
    rays = np.take(points, seen, axis=0), np.take(offset, seen, axis=0), distance[seen]
    blocked = _blocked_before(transport, lamp, *rays, blockers)
    power[seen[blocked]] = 0.0
    total = np.bincount(lit // valid.shape[1], power, minlength=len(patches))
    mean[patches] = total / np.maximum(valid.sum(axis=1), 1)
    return (mean[:, None] * lamp.intensity).astype(np.float32)


def _patches_in_beam(transport: LightTransport, lamp: SpotLight) -> IndexArray:
    """Patches of which a part may lie in the beam, by their bounding spheres."""
    centres, radii = transport.patch_spheres
    offset = centres - lamp.place
    distance = np.maximum(np.linalg.norm(offset, axis=1), 1e-9)
    off_axis = np.arccos(np.clip(offset @ lamp.axis / distance, -1.0, 1.0))
    spanned = np.arcsin(np.minimum(radii / distance, 1.0))
    around = radii >= distance
    return np.flatnonzero(around | (off_axis - spanned < lamp.half_angle + lamp.edge))


def _blocked_before(
    transport: LightTransport,
    lamp: SpotLight,
    points: Array32,
    offsets: Array,
    distances: Array,
    blockers: Sequence[Blocker],
) -> Mask:
    """Whether anything lies between points in a beam and its lamp, at the ends of offsets."""
    ends = np.full(len(points), 1.0 - 1e-3, dtype=np.float32)
    blocked = transport.tracer.occluded(points, offsets, ends)
    # The lamp sits on its own craft: its housing, within 1 cm, does not count.
    ends = (1.0 - 0.01 / distances).astype(np.float32)
    for blocker in blockers:
        if not _reaches_into(blocker, lamp):
            continue
        matrix = blocker.other_from_body
        rest = np.flatnonzero(~blocked)
        origins = np.take(points, rest, axis=0) @ matrix[:3, :3].T + matrix[:3, 3]
        rays = np.take(offsets, rest, axis=0) @ matrix[:3, :3].T
        blocked[rest] = blocker.tracer.occluded(origins, rays, ends[rest])
    return blocked


def _reaches_into(blocker: Blocker, lamp: SpotLight) -> bool:
    """Whether any of a body lies before a lamp: none of what carries it does, as a rule."""
    if lamp.half_angle + lamp.edge >= 0.5 * np.pi:
        return True
    turn, shift = blocker.other_from_body[:3, :3], blocker.other_from_body[:3, 3]
    place, axis = turn @ lamp.place + shift, turn @ lamp.axis
    return bool(((blocker.hull - place) @ axis).max() > 0.0)


def earth_share(matrix: GatherMatrix, cell_radiance: Array32 | None) -> Array32:
    """(k, sides) of the Earth's irradiance on a free surface, the share that arrives at vertices.

    cell_radiance : (c, 4) of the sky; None for a dark sky
    """
    if cell_radiance is None:
        return np.ones(matrix.shape, dtype=np.float32)
    bands = cell_radiance.mean(axis=1)
    free = np.maximum(matrix.sky_rays @ bands, np.float32(1e-30))[matrix.sky_rays_row]
    share = (matrix.sky_part @ bands) / free
    np.subtract(np.float32(1.0), share, out=share, where=~matrix.sky_part_seen)
    share = np.take(share, matrix.rows)
    if matrix.between is not None:
        between = matrix.between
        lost = (between.sky_lost @ bands) / np.maximum(between.sky_rays @ bands, np.float32(1e-30))
        share -= between.spread @ lost
    return np.clip(share, 0.0, 1.0, out=share).reshape(matrix.shape)


def vertex_irradiance(
    matrix: GatherMatrix, exitance: Array32, more: Array32 | None = None
) -> Array32:
    """(r, 4) irradiance of vertices from the body's own surfaces [W m-2].

    exitance : (p, 4) of the patches, after all bounces
    more : (r, 4) what vertices get besides
    """
    light: Array32 = np.take(matrix.gather @ exitance, matrix.rows, axis=0)
    if more is not None:
        light += more
    if matrix.between is not None:
        light += matrix.between.spread @ (matrix.between.light @ exitance)
    # Where other bodies and parts take light that more rays do not find.
    return np.maximum(light, 0.0, out=light)
