"""Light on the patches and vertices of a body at one instant: nothing is kept from the last."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from simgl.rays import RayTracer
from simgl.scene.materials import Material
from simgl.transport.transport import Transport

Array = NDArray[np.float64]
Floats = NDArray[np.float32]

# What is left of the light when the bounces end.
RESIDUAL = 1e-3
# Bounces between patches, after those between regions.
FINE_BOUNCES = 4
# Only a closed body of perfect reflectance needs more: there the sum of bounces has no end.
_MOST_STEPS = 200


@dataclass(frozen=True, kw_only=True, eq=False)
class Reflectors:
    """The patches of a body with its materials on them.

    albedo : (p, 4) share of the light that leaves again
    exitance : (p, 4) that they give off by themselves [W m-2]
    region_albedo : (c, 4) the first for whole regions
    contraction : upper bound of what one bounce leaves of any light, below 1
    """

    albedo: Floats
    exitance: Floats
    region_albedo: Floats
    contraction: float


@dataclass(frozen=True, kw_only=True, eq=False)
class Blocker:
    """Another body that shades this one.

    other_from_body : (4, 4) between their axes
    """

    tracer: RayTracer
    other_from_body: Array


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


@dataclass(frozen=True, kw_only=True, eq=False)
class VertexLight:
    """What vertices get, on their front and, where ``sides`` is 2, on their back.

    bounced : (sides, v, 4) irradiance from the body's other surfaces [W m-2]
    earth_share : (sides, v) of the Earth's irradiance on a free surface, the share that arrives
    """

    bounced: Floats
    earth_share: Floats


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
    return np.asarray(fresnel + (1.0 - fresnel) * (1.0 - material.metallic) * base)


def reflectors(transport: Transport, materials: Sequence[Material]) -> Reflectors:
    """The patches with a model's materials."""
    used = materials[: transport.materials.shape[1]]
    albedo = transport.materials @ np.array([hemispherical_albedo(m) for m in used])
    region_albedo = np.asarray(transport.region_mean @ albedo)
    exitance = transport.materials @ np.array([np.pi * np.asarray(m.emission) for m in used])
    return Reflectors(
        albedo=albedo.astype(np.float32),
        exitance=exitance.astype(np.float32),
        region_albedo=region_albedo.astype(np.float32),
        contraction=_contraction(transport.between_regions, region_albedo),
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


def radiosity(transport: Transport, surface: Reflectors, irradiance: Floats) -> Floats:
    """(p, 4) exitance of the patches after all bounces [W m-2].

    irradiance : (p, 4) direct, from all lights

    Regions exchange all bounces; from what they send, and its own direct light, each patch goes on
    for the last few. Between regions x = M x + c with Chebyshev's acceleration (Golub & Varga
    1961): after k steps the error is below 2 r^k of the first, r = mu / (1 + sqrt(1 - mu^2)) for a
    spectrum in -mu .. mu.
    """
    own = np.asarray(surface.exitance + surface.albedo * irradiance, dtype=np.float32)
    mu = surface.contraction
    rate = mu / (1.0 + np.sqrt(1.0 - mu * mu))
    if rate <= 0.0 or not np.any(own):
        return own
    emitted = transport.region_mean @ own
    steps = min(int(np.ceil(np.log(0.5 * RESIDUAL) / np.log(rate))), _MOST_STEPS)
    older, newer, omega = emitted, emitted, 1.0
    for step in range(steps):
        bounced = surface.region_albedo * (transport.between_regions @ newer) + emitted
        if step == 0:
            older, newer = newer, bounced
            continue
        omega = 1.0 / (1.0 - 0.5 * mu * mu) if step == 1 else 1.0 / (1.0 - 0.25 * mu * mu * omega)
        older, newer = newer, (omega * (bounced - older) + older).astype(np.float32)
    exitance = newer[transport.region]
    for _ in range(FINE_BOUNCES):
        exitance = own + surface.albedo * (transport.form_factors @ exitance)
    return np.asarray(np.maximum(exitance, 0.0))


def sun_cosines(transport: Transport, direction: Array, blockers: Sequence[Blocker] = ()) -> Floats:
    """(p,) mean over each patch of its cosine to the Sun where the Sun is seen.

    direction : (3,) unit, towards the Sun, body axes
    """
    points = transport.points[:, ::2].reshape(-1, 3)
    cosine = (transport.normals[:, ::2].reshape(-1, 3) @ direction.astype(np.float32)).ravel()
    valid = transport.point_open[:, ::2]
    facing = np.flatnonzero((cosine > 0.0) & valid.ravel())
    rays = np.broadcast_to(direction.astype(np.float32), (len(facing), 3))
    lit = np.zeros(len(points), dtype=np.float32)
    free = facing[~_blocked(transport, points[facing], rays, blockers)]
    lit[free] = cosine[free]
    count = np.maximum(valid.sum(axis=1), 1)
    return np.asarray((lit.reshape(valid.shape).sum(axis=1) / count).astype(np.float32))


def _blocked(
    transport: Transport, points: Floats, rays: Floats, blockers: Sequence[Blocker]
) -> NDArray[np.bool_]:
    blocked = transport.tracer.occluded(points, rays)
    for blocker in blockers:
        rest = np.flatnonzero(~blocked)
        matrix = blocker.other_from_body.astype(np.float32)
        origins = points[rest] @ matrix[:3, :3].T + matrix[:3, 3]
        blocked[rest] = blocker.tracer.occluded(origins, rays[rest] @ matrix[:3, :3].T)
    return blocked


def lamp_irradiance(
    transport: Transport, lamp: SpotLight, blockers: Sequence[Blocker] = ()
) -> Floats:
    """(p, 4) mean irradiance of each patch by a lamp [W m-2]."""
    points = transport.points[:, ::2].reshape(-1, 3)
    offset = lamp.place - points
    distance = np.linalg.norm(offset, axis=1)
    wi = offset / distance[:, None]
    cosine = np.einsum("ij,ij->i", transport.normals[:, ::2].reshape(-1, 3), wi)
    off_axis = np.arctan2(np.linalg.norm(np.cross(wi, lamp.axis), axis=1), -wi @ lamp.axis)
    beyond = np.clip((off_axis - lamp.half_angle) / lamp.edge, 0.0, 1.0)
    valid = transport.point_open[:, ::2]
    power = cosine * (1.0 - beyond * beyond * (3.0 - 2.0 * beyond)) / distance**2
    lit = np.flatnonzero((power > 0.0) & valid.ravel())
    # A ray to the lamp ends there: from it to the point, everything short of the point blocks.
    blocked = _blocked_before(transport, points[lit], offset[lit], blockers)
    power[(cosine <= 0.0) | ~valid.ravel()] = 0.0
    power[lit[blocked]] = 0.0
    mean = power.reshape(valid.shape).sum(axis=1) / np.maximum(valid.sum(axis=1), 1)
    return np.asarray((mean[:, None] * lamp.intensity).astype(np.float32))


def _blocked_before(
    transport: Transport, points: Floats, offsets: Array, blockers: Sequence[Blocker]
) -> NDArray[np.bool_]:
    """Whether anything lies between points and the ends of offsets."""
    _, share = transport.tracer.hits(points, offsets)
    blocked = share < 1.0 - 1e-3
    for blocker in blockers:
        matrix = blocker.other_from_body
        origins = points @ matrix[:3, :3].T + matrix[:3, 3]
        _, share = blocker.tracer.hits(origins, offsets @ matrix[:3, :3].T)
        # The lamp sits on its own craft: its housing, within 1 cm, does not count.
        blocked |= share < 1.0 - 0.01 / np.linalg.norm(offsets, axis=1)
    return blocked


def sky_irradiance(transport: Transport, cell_radiance: Floats) -> Floats:
    """(p, 4) irradiance of the patches by the sky [W m-2].

    cell_radiance : (96, 4) mean radiance of the sky's cells [W m-2 sr-1]
    """
    # Rays follow the cosine: each stands for pi over their number.
    return np.asarray(transport.sky @ (np.float32(np.pi) * cell_radiance))


def vertex_light(
    transport: Transport, exitance: Floats | None, cell_radiance: Floats | None
) -> VertexLight:
    """What the vertices get of the patches' light and of the sky's.

    exitance : (p, 4) of the patches, from ``radiosity``; None for a dark body
    cell_radiance : (96, 4) of the sky; None for a dark sky
    """
    sites, of_vertex = transport.gather.shape[0], transport.site_of_vertex
    bounced = np.zeros((sites, 4), dtype=np.float32)
    if exitance is not None:
        bounced = transport.gather @ exitance
    share = np.ones(sites, dtype=np.float32)
    if cell_radiance is not None:
        bands = cell_radiance.mean(axis=1)
        whole = (transport.whole @ bands)[transport.whole_row]
        hidden = transport.occluded @ bands
        share = np.clip(1.0 - hidden / np.maximum(whole, 1e-30), 0.0, 1.0).astype(np.float32)
    return VertexLight(
        bounced=np.take(bounced, of_vertex, axis=0), earth_share=np.take(share, of_vertex)
    )
