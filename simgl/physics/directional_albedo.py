"""Albedo of the GGX lobe and where its light comes from: the look-up table of the shaders."""

from __future__ import annotations

import numpy as np

from simgl.arrays import Array, Array32

# Nodes along either axis of the shaders' look-up table. Linear interpolation is accurate to 0.002
# of the incident light; the error is largest where a narrow lobe meets the horizon.
TABLE_SIZE = 48

_GRAZING, _SMOOTHEST = 1e-3, 1e-4


def lambda_smith(cosine: Array, alpha: float | Array) -> Array:
    """Smith's auxiliary function of the GGX distribution (Heitz 2014, eq. 72)."""
    tangent2 = (1.0 - cosine**2) / cosine**2
    return 0.5 * (np.sqrt(1.0 + alpha**2 * tangent2) - 1.0)


def lobe_albedo(cosine: Array, alpha: Array, *, order: int = 32) -> tuple[Array, Array]:
    """Directional albedo of the GGX lobe as scale a and bias b: albedo = F0 a + b.

    cosine : (k,) between normal and viewer
    alpha : (k,) width of the lobe, roughness^2
    order : quadrature nodes along either axis
    returns : a and b, (k,) each

    The integral of f cos over the hemisphere, f = F D G2 / (4 cos cos), with Schlick's Fresnel term
    split: the mean over the visible normals of G2 / G1 (Heitz 2018, eq. 19) times
    1 - (1 - VoH)^5 gives a, times (1 - VoH)^5 gives b. Normals by Heitz' map from the unit disc;
    Gauss-Legendre along its radius with dense nodes at the rim, which holds the lobe's tail.
    """
    escaping, _, VoH, _ = _escaping(cosine, alpha, order)
    schlick = (1.0 - VoH) ** 5
    return (
        np.sum(escaping * (1.0 - schlick), axis=(1, 2)),
        np.sum(escaping * schlick, axis=(1, 2)),
    )


def seen_lobe(cosine: Array, alpha: Array, *, order: int = 32) -> tuple[Array, Array]:
    """The round lobe that stands for all directions from which a viewer gets a lobe's light.

    cosine, alpha, order : as of ``lobe_albedo``
    returns : (k,) sine between the normal and the lobe's axis over that of the viewer; (k,) the
        roughness of the ``glossy_sky`` that is looked up there

    The axis is where the light comes from in the mean, first of all alike, then by the inverse of
    its chord from there: the long tail of a lobe at a slant counts less. It leaves the mirror
    direction, since the lobe ends at the horizon. The width gives chords from the axis the same
    mean: at a slant a lobe is narrower across the plane of incidence than along it.
    """
    escaping, h, VoH, viewer = _escaping(cosine, alpha, order)
    light = 2.0 * VoH * h - viewer
    share = escaping / np.sum(escaping, axis=(1, 2), keepdims=True)
    axis, chord = _axis(light, share)
    axis, chord = _axis(light, share / np.maximum(chord, 1e-6))
    sine = np.sqrt(1.0 - cosine**2)
    return -axis[0] / sine, _roughness_of(np.sum(share * chord, axis=(1, 2)))


def _axis(light: Array, weight: Array) -> tuple[Array, Array]:
    """Mean of directions (3, k, n, n) by weight (k, n, n): (3, k) unit; their chords from it."""
    mean = np.sum(weight * light, axis=(2, 3))
    axis = mean / np.sqrt(np.sum(mean**2, axis=0))
    return axis, np.sqrt(np.sum((light - axis[:, :, None, None]) ** 2, axis=0))


def _roughness_of(chord: Array) -> Array:
    """Of the prefiltered lobe, D(h) max(n.l, 0) for n = v, whose light is so far from its axis."""
    roughness = np.linspace(0.0, 1.0, 201)
    part = (np.arange(2000) + 0.5) / 2000
    tangent2 = roughness[:, None] ** 4 * part / (1.0 - part)
    sine2 = tangent2 / (1.0 + tangent2)
    weight = np.maximum(1.0 - 2.0 * sine2, 0.0)
    mean = np.sum(weight * 2.0 * np.sqrt(sine2), axis=1) / np.sum(weight, axis=1)
    return np.interp(chord, mean, roughness)


def _escaping(cosine: Array, alpha: Array, order: int) -> tuple[Array, Array, Array, Array]:
    """Visible normals (3, k, order, order), the part of the light that each reflects out of the
    surface (k, order, order), its cosine with the viewer, and the viewer (3, k, 1, 1)."""
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
    viewer = np.stack([sine, np.zeros_like(c), c])
    return escaping, h, VoH, viewer


def lobe_table() -> Array32:
    """(TABLE_SIZE, TABLE_SIZE, 4) table of ``lobe_albedo`` and ``seen_lobe``.

    Rows by roughness 0..1, columns by the square root of the cosine 0..1, in equal steps with the
    ends on the first and last texel.
    """
    steps = np.linspace(0.0, 1.0, TABLE_SIZE)
    # A viewer along the normal has no plane of incidence.
    cosine = np.clip(steps**2, _GRAZING, 1.0 - 1e-6)
    rows = []
    for roughness in steps:
        alpha = np.full(TABLE_SIZE, max(roughness**2, _SMOOTHEST))
        rows.append(np.stack([*lobe_albedo(cosine, alpha), *seen_lobe(cosine, alpha)], axis=1))
    return np.stack(rows).astype(np.float32)
