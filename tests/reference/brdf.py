"""Metallic-roughness reflection of glTF 2.0 (Appendix B), term by term."""

from __future__ import annotations

import numpy as np

from simgl.arrays import Array
from simgl.physics.directional_albedo import lambda_smith


def ggx(NoH: Array, alpha: float) -> Array:
    """Normal distribution of Walter et al. (2007) [sr-1]."""
    return alpha**2 / (np.pi * (NoH**2 * (alpha**2 - 1.0) + 1.0) ** 2)


def schlick(f0: Array, VoH: Array) -> Array:
    """Fresnel reflectance after Schlick (1994)."""
    return f0 + (1.0 - f0) * (1.0 - VoH) ** 5


def brdf(
    reflectance: float, metallic: float, roughness: float, n: Array, wi: Array, wo: Array
) -> Array:
    """Bidirectional reflectance [sr-1] of one band.

    n, wi, wo : (k, 3) unit normal and directions away from the surface, both above it
    returns : (k,)
    """
    h = wi + wo
    h = h / np.linalg.norm(h, axis=-1, keepdims=True)
    NoL, NoV, NoH, VoH = (np.sum(a * b, axis=-1) for a, b in ((n, wi), (n, wo), (n, h), (wo, h)))
    alpha = roughness**2
    masking = 1.0 / (1.0 + lambda_smith(NoL, alpha) + lambda_smith(NoV, alpha))
    lobe = ggx(NoH, alpha) * masking / (4.0 * NoL * NoV)
    f0 = np.asarray((1.0 - metallic) * 0.04 + metallic * reflectance)
    fresnel = schlick(f0, VoH)
    base = (1.0 - metallic) * reflectance / np.pi
    return (1.0 - fresnel) * base + fresnel * lobe


def disc_mean_brdf(
    reflectance: float,
    metallic: float,
    roughness: float,
    n: Array,
    wi: Array,
    wo: Array,
    radius: float,
) -> Array:
    """(k,) mean of ``brdf`` [sr-1] over a uniform disc of light, weighted by its cosines.

    wi : (k, 3) towards the disc's centre
    radius : angular, of the disc [rad]

    Direct quadrature on rings of equal width.
    """
    rings, points = 100, 96
    distance = radius * (np.arange(rings) + 0.5) / rings
    turn = 2.0 * np.pi * (np.arange(points) + 0.5) / points
    offset = np.stack(
        [np.outer(distance, np.cos(turn)).ravel(), np.outer(distance, np.sin(turn)).ravel()], axis=1
    )
    share = np.repeat(distance, points)
    helper = np.where(np.abs(wi[:, :1]) < 0.9, [[1.0, 0.0, 0.0]], [[0.0, 1.0, 0.0]])
    x = np.cross(wi, helper)
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    y = np.cross(wi, x)
    total, weight = np.zeros(len(wi)), np.zeros(len(wi))
    for (along_x, along_y), area in zip(offset, share, strict=True):
        light = wi + along_x * x + along_y * y
        light /= np.linalg.norm(light, axis=1, keepdims=True)
        cosine = area * np.sum(n * light, axis=1)
        total += brdf(reflectance, metallic, roughness, n, light, wo) * cosine
        weight += cosine
    return total / weight


def disc_cosine(cosine: Array, radius: float) -> Array:
    """Irradiance of a small uniform disc on a plane, over that on a plane which faces it.

    cosine : (k,) between the plane's normal and the disc's centre
    radius : angular, of the disc [rad]

    Direct quadrature over strips of the disc, each at its own height above the plane's horizon.
    """
    strips = 20_001
    height = np.linspace(-1.0, 1.0, strips)
    share = np.sqrt(1.0 - height**2)
    share /= share.sum()
    elevation = np.arcsin(cosine)[:, None] + radius * height[None, :]
    return np.sum(share * np.maximum(np.sin(elevation), 0.0), axis=1)


def base_loss(cosine: Array) -> Array:
    """Mean of (1 - VoH)^5 over a uniform sky, weighted by its cosine: of the light that Schlick's
    Fresnel term leaves at normal incidence, the share that the base does not get.

    cosine : (k,) between normal and viewer; returns : (k,)
    """
    count = 400
    u = (np.arange(count) + 0.5) / count
    sine = np.sqrt(u)[:, None]
    x, z = sine * np.cos(2.0 * np.pi * u), np.sqrt(1.0 - sine**2)
    VoL = np.sqrt(1.0 - cosine[:, None, None] ** 2) * x + cosine[:, None, None] * z
    VoH = np.sqrt(np.maximum(0.5 * (1.0 + VoL), 0.0))
    return np.mean((1.0 - VoH) ** 5, axis=(1, 2))
