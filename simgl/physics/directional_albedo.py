"""Directional albedos of the metallic-roughness model, by quadrature."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from simgl.arrays import Array, Array32

# Nodes of the table that shaders look up, along either axis. Linear interpolation between them is
# good to 0.002 of the incident light, above all where a smooth lobe meets the horizon.
TABLE_SIZE = 48

_GRAZING, _SMOOTHEST = 1e-3, 1e-4


def lambda_smith(cosine: Array, alpha: float | Array) -> Array:
    """Smith's auxiliary function of the GGX distribution (Heitz 2014, eq. 72)."""
    tangent2 = (1.0 - cosine**2) / cosine**2
    return 0.5 * (np.sqrt(1.0 + alpha**2 * tangent2) - 1.0)


def lobe_albedo(cosine: Array, alpha: Array, *, order: int = 32) -> tuple[Array, Array]:
    """Share of a uniform light that the GGX lobe sends to a viewer: F0 times the first, plus the
    second.

    cosine : (k,) between normal and viewer; alpha : (k,) width of the lobe, roughness^2
    returns : two (k,)

    The integral of f cos over the hemisphere, f = F D G2 / (4 cos cos), with Schlick's Fresnel
    split into its parts: the mean over the normals that the viewer sees of G2 / G1 (Heitz 2018,
    eq. 19) times 1 - (1 - VoH)^5, and times (1 - VoH)^5. Normals by Heitz' map from the unit disc;
    Gauss-Legendre along its radius, crowded at the rim that holds the lobe's long tail.
    """
    nodes, weights = np.polynomial.legendre.leggauss(order)
    rest = 0.5 * (1.0 - nodes)
    weight = (0.5 * weights * 4.0 * rest**3)[:, None] / order
    radius = np.sqrt(1.0 - rest**4)[:, None]
    turn = 2.0 * np.pi * (np.arange(order) + 0.5) / order
    c, a = cosine[:, None, None], alpha[:, None, None]
    sine = np.sqrt(1.0 - c**2)
    stretched = np.hypot(a * sine, c)
    x, z = a * sine / stretched, c / stretched
    across = radius * np.cos(turn)
    share = 0.5 * (1.0 + z)
    along = (1.0 - share) * np.sqrt(1.0 - across**2) + share * radius * np.sin(turn)
    up = np.sqrt(np.maximum(1.0 - across**2 - along**2, 0.0))
    h = np.stack([a * (x * up - z * along), a * across, np.maximum(x * along + z * up, 0.0)])
    h /= np.sqrt(np.sum(h**2, axis=0))
    VoH = h[0] * sine + h[2] * c
    NoL = 2.0 * VoH * h[2] - c
    above = NoL > 0.0
    NoL = np.where(above, NoL, 1.0)
    seen = 1.0 + lambda_smith(c, a)
    escaping = np.where(above, seen / (seen + lambda_smith(NoL, a)), 0.0) * weight
    schlick = (1.0 - VoH) ** 5
    return (
        np.sum(escaping * (1.0 - schlick), axis=(1, 2)),
        np.sum(escaping * schlick, axis=(1, 2)),
    )


@lru_cache(maxsize=1)
def lobe_table() -> Array32:
    """(TABLE_SIZE, TABLE_SIZE, 2) of ``lobe_albedo``: rows by roughness 0..1, columns by the square
    root of the cosine 0..1, both in equal steps with the ends on the first and last texel.
    """
    steps = np.linspace(0.0, 1.0, TABLE_SIZE)
    cosine = np.maximum(steps**2, _GRAZING)
    rows = [
        np.stack(lobe_albedo(cosine, np.full(TABLE_SIZE, max(roughness**2, _SMOOTHEST))), axis=1)
        for roughness in steps
    ]
    return np.stack(rows).astype(np.float32)
