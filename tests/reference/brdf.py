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
    limb: tuple[float, float] = (0.0, 0.0),
) -> Array:
    """(k,) mean of ``brdf`` [sr-1] over a disc of light, weighted by its radiance and its cosines.

    n, wi, wo : (k, 3); wi towards the disc's centre
    radius : angular, of the disc [rad]
    limb : u, v of the disc's radiance 1 - u (1 - mu) - v (1 - mu)^2

    Gauss-Legendre quadrature over chords in the plane of wi and wo and, by the angle whose sine is
    their height, across it. Across, the half vectors of grazing light spread widest: most nodes.
    """
    across, across_weight = np.polynomial.legendre.leggauss(140)
    along, along_weight = np.polynomial.legendre.leggauss(50)
    height = np.sin(0.5 * np.pi * across)
    chord = np.cos(0.5 * np.pi * across)[:, None]
    y, x = np.broadcast_to(height[:, None], (140, 50)), chord * along
    weight = across_weight[:, None] * chord**2 * along_weight
    fall = 1.0 - chord * np.sqrt(1.0 - along**2)
    weight = (weight * (1.0 - limb[0] * fall - limb[1] * fall**2)).ravel()
    result = np.empty(len(wo))
    for index, (normal, light, eye) in enumerate(zip(n, wi, wo, strict=True)):
        side = np.cross(eye, light)
        if not side.any():
            side = np.cross(light, np.eye(3)[np.argmin(np.abs(light))])
        side /= np.linalg.norm(side)
        offset = np.stack([x.ravel(), y.ravel()], axis=1) @ [np.cross(side, light), side]
        lights = light + radius * offset
        lights /= np.linalg.norm(lights, axis=1, keepdims=True)
        share = weight * (lights @ normal)
        values = brdf(reflectance, metallic, roughness, normal, lights, eye)
        result[index] = np.sum(share * values) / np.sum(share)
    return result


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
