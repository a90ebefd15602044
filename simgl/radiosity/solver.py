"""Radiosity: light on the patches and vertices of a body at one instant."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import sparse

from simgl.arrays import Array, Array32, IndexArray, Mask
from simgl.radiosity.light_transport import GatherMatrix, LightTransport
from simgl.radiosity.reflection_laws import (
    ReflectionLaws,
    hemispherical_albedo,
    reflection_laws,
)
from simgl.rays import AnyRayTracer
from simgl.scene.materials import Material

# What is left of the error of the first guess when the bounces end.
RESIDUAL = 3e-3
# Only a closed body of perfect reflectance needs more: there the sum of bounces has no end.
_MAX_STEPS = 200
# Bounces after which it is known how fast light dies out.
_POWER = 10
# Three products with the form factors suffice then.
_MIN_CONTRACTION = 1e-3


@dataclass(frozen=True, kw_only=True, eq=False)
class Reflectors:
    """The patches of a body with its materials on them.

    albedo : (p, 4) share of the light that leaves again
    exitance : (p, 4) that they give off by themselves [W m-2]
    laws, law : of the materials, and (p,) that of each patch
    contraction : upper bound of what one bounce leaves of any light, below 1
    """

    albedo: Array32
    exitance: Array32
    laws: ReflectionLaws
    law: IndexArray
    contraction: float

    def of_sun(self, facing: Array32) -> Array32:
        """(2, p, 4) share of sunlight that leaves patches evenly, and in lobes that are followed.

        facing : (p,) cosines of the patches to the Sun
        """
        return self.laws.of_light(self.law, facing)


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
        laws=reflection_laws(used),
        law=np.argmax(transport.materials, axis=1),
        contraction=_contraction(transport.form_factors, albedo),
    )


def _contraction(form_factors: sparse.csc_matrix, albedo: Array32) -> float:
    """Upper bound of the spectral radius of one bounce, in its most reflecting band.

    For a matrix M without negative entries it is at most the largest of (M x)_i / x_i for any
    positive x, where x close to the main eigenvector makes the bound tight (Collatz & Wielandt);
    and at most the k-th root of the largest of M^k 1 (Gelfand), tighter where light dies out fast.
    """
    x = np.ones_like(albedo)
    bound = np.inf
    for _ in range(20):
        y = form_factors @ (albedo * x)
        bound = min(bound, float((y / x).max()))
        x = y / y.max() + np.float32(1e-3) if y.max() > 0.0 else x
    light = np.ones_like(albedo)
    for _ in range(_POWER):
        light = form_factors @ (albedo * light)
    bound = min(bound, float(light.max()) ** (1.0 / _POWER))
    return min(max(bound, _MIN_CONTRACTION), 1.0 - 1e-6)


def radiosity(
    transport: LightTransport,
    surface: Reflectors,
    emitted: Array32,
    residual: float = RESIDUAL,
) -> Array32:
    """(p, 4) or (p, 4, n) exitance of the patches after all bounces [W m-2].

    emitted : exitance before any bounce, of one light or of n separate ones; a light gets the same
        bits among others as by itself. Less than nothing where light is missing
    residual : what is left of the error of the first guess

    x = M x + c with Chebyshev's acceleration (Golub & Varga 1961): after k steps the error is below
    2 r^k of the first, r = mu / (1 + sqrt(1 - mu^2)) for a spectrum in -mu .. mu. The first guess
    lets the second bounce stand for all later ones, each less by the same ratio.
    """
    lights = emitted.reshape(len(emitted), -1)
    # As wide as the lights: numpy takes longer over rows of a few than over all at once.
    albedo = np.repeat(surface.albedo, lights.shape[1] // 4, axis=1)

    def bounced(light: Array32) -> Array32:
        arrived: Array32 = transport.form_factors @ light
        return np.multiply(arrived, albedo, out=arrived)

    mu = surface.contraction
    rate = mu / (1.0 + np.sqrt(1.0 - mu * mu))
    once = bounced(lights)
    if not np.any(once):
        return emitted
    twice = bounced(once)
    ratio = _product(once, twice) / np.maximum(_product(once, once), np.float32(1e-30))
    older = lights + once
    older += twice / (1.0 - np.clip(ratio, 0.0, np.float32(mu)))
    newer = bounced(older)
    newer += lights
    omega = 1.0
    for step in range(1, min(int(np.ceil(np.log(0.5 * residual) / np.log(rate))) - 2, _MAX_STEPS)):
        omega = 1.0 / (1.0 - (0.5 if step == 1 else 0.25 * omega) * mu * mu)
        next_ = bounced(newer)
        next_ += lights
        next_ -= older
        next_ *= np.float32(omega)
        next_ += older
        older, newer = newer, next_
    if lights.min() >= 0.0:
        np.maximum(newer, 0.0, out=newer)
    return newer.reshape(emitted.shape)


def _product(a: Array32, b: Array32) -> Array32:
    """(k,) scalar products of the columns (p, k)."""
    return np.einsum("pk,pk->k", a, b)


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


def mean_cosines(transport: LightTransport, direction: Array, lit: Mask, valid: Mask) -> Array32:
    """(p,) mean over each patch's sample points: their cosines to a direction where they are lit.

    lit, valid : as of ``lit_samples``
    """
    cosines = (transport.normals @ direction.astype(np.float32)) * lit
    count = np.maximum(valid.sum(axis=1), 1).astype(np.float32)
    return np.asarray(np.maximum(cosines.sum(axis=1) / count, 0.0), dtype=np.float32)


def sun_cosines(transport: LightTransport, direction: Array) -> Array32:
    """(p,) mean over each patch of its cosine to the Sun where the Sun is seen."""
    return mean_cosines(transport, direction, *lit_samples(transport, direction))


def blocked_by(
    transport: LightTransport, direction: Array, blockers: Sequence[Blocker], asked: Mask
) -> Mask:
    """(p, n) which sample points of each patch other bodies hide from the Sun.

    asked : (p,) patches that need it; of the others none
    """
    lit = np.flatnonzero(asked)
    centres, radii = (np.take(a, lit, axis=0) for a in transport.patch_spheres)
    each = transport.points.shape[1]
    hidden = np.zeros((len(asked), each), dtype=np.bool_)
    for blocker in blockers:
        turn, shift = blocker.other_from_body[:3, :3], blocker.other_from_body[:3, 3]
        towards = turn @ direction
        # Only patches whose lines of sight pass through its bounding sphere.
        offset = centres @ turn.T + (shift - blocker.centre)
        along = offset @ towards
        past = offset - along[:, None] * towards
        reach = blocker.radius + radii
        passed = np.einsum("ij,ij->i", past, past) < reach * reach
        near = lit[passed & (along < reach)]
        points = np.take(transport.points, near, axis=0).reshape(-1, 3)
        hidden[near] |= hidden_behind(points, direction, blocker).reshape(-1, each)
    return hidden


def hidden_behind(points: Array32, direction: Array, blocker: Blocker) -> Mask:
    """(n,) whether another body stands between points (n, 3) and the Sun in a direction (3,)."""
    turn, shift = blocker.other_from_body[:3, :3], blocker.other_from_body[:3, 3]
    origins = points @ turn.T.astype(np.float32) + shift.astype(np.float32)
    rays = np.broadcast_to((turn @ direction).astype(np.float32), origins.shape)
    return blocker.tracer.occluded(origins, rays)


def earth_share(matrix: GatherMatrix, cell_radiance: Array32 | None) -> Array32:
    """(k, sides) of the Earth's irradiance on a free surface, the share that arrives at vertices.

    cell_radiance : (c, 4) of the sky; None for a dark sky
    """
    if cell_radiance is None:
        return np.ones(matrix.shape, dtype=np.float32)
    bands = cell_radiance.mean(axis=1)
    # Not by BLAS: its threads keep the cores busy while they wait for the next product.
    free = np.einsum("bc,c->b", matrix.all_sky, bands)
    seen, one = matrix.open_sky
    share = seen @ bands
    share *= np.take(np.float32(1.0) / np.maximum(free, np.float32(1e-30)), matrix.sky_rays_row)
    share += one
    share = np.take(matrix.at_points(share), matrix.rows)
    if matrix.between is not None:
        between = matrix.between
        lost = (between.sky_lost @ bands) / np.maximum(between.sky_rays @ bands, np.float32(1e-30))
        share -= between.spread @ lost
    return np.clip(share, 0.0, 1.0, out=share).reshape(matrix.shape)


def vertex_irradiance(
    matrix: GatherMatrix,
    exitance: Array32,
    more: Array32 | None = None,
    lobes: Array32 | None = None,
) -> Array32:
    """(r, 4) irradiance of vertices from the body's own surfaces [W m-2].

    exitance : (p, 4) of the patches, after all bounces
    more : (r, 4) what vertices get besides
    lobes : (s, 4) what gather points get more because lobes do not send evenly
    """
    at_points = matrix.at_points(matrix.gather @ exitance)
    if lobes is not None:
        at_points += lobes
    light: Array32 = np.take(at_points, matrix.rows, axis=0)
    if more is not None:
        light += more
    if matrix.between is not None:
        light += matrix.between.spread @ (matrix.between.light @ exitance)
    # Where other bodies and parts take light that more rays do not find.
    return np.maximum(light, 0.0, out=light)
