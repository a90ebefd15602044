"""How clouds distribute what they reflect: ``simgl/data/earth/cloud_reflection.npy``.

    python -m tools.cloud_reflection

Half of a cloud is drops of a gamma distribution of sizes, effective radius 10 um and variance 0.1,
which scatter by Mie's theory (Bohren and Huffman 1983, chapter 4). The other half, an estimate, is
ice of rough crystals: Henyey and Greenstein's law with the asymmetry 0.75 of MODIS's aggregated
columns (Holz et al. 2016, Atmos. Chem. Phys. 16, 5075), which has neither rainbow nor glory. A
plane layer is solved by doubling (Hansen 1971, J. Atmos. Sci. 28, 120), with the forward peak
scaled off (Wiscombe 1977) and single scattering by the exact phase function (Nakajima and Tanaka
1988). Its top is rough: facets of normally distributed slopes, each a plane layer of its own,
shaded and hidden by Smith's law, so that it sends more of the light back and less ahead than a
level one; how much in all is that of the mean cosine of the Sun on them (``cosine_on_tops`` in
shaders/planet/cloud.glsl). Their mean square slope is chosen so that the Earth's light by its phase
is that of earthshine (``benchmarks/flight``).

The table is (16, 16, 16, 4) float32: relative azimuth of Sun and camera from 0 (the camera faces
the Sun) to 180 deg, cosine of the view, cosine of the Sun, and optical thickness 1, 4.64, 21.5 and
100: the bidirectional reflectance over its mean weighted by the view's cosine. Cosines are those of
the cells' middles, azimuths include both ends.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np
from scipy.interpolate import RegularGridInterpolator
from scipy.special import erfc

from simgl.arrays import Array

# A phase function: its values at cosines of the scattering angle.
Law = Callable[[Array], Array]

CELLS = 16
THICKNESSES = np.exp(np.log(100.0) * np.arange(4) / 3.0)

_INDEX, _RADIUS, _VARIANCE = 1.333, 10.0, 0.1
# Over the bands, as the mean of the phase functions at these wavelengths [um].
_WAVELENGTHS = (0.45, 0.5, 0.55, 0.6, 0.65, 0.75, 0.85, 0.95)
_RADII = np.linspace(1.0, 28.0, 110)
_ICE_SHARE, _ICE_ASYMMETRY = 0.5, 0.75
_STREAMS = 24
# Mean square slope of tops, and rings and azimuths of the slopes that stand for all.
ROUGH, _RINGS, _AROUND = 0.35, 8, 48
_LARGEST = 12.0


def mie_coefficients(size: float) -> tuple[Array, Array]:
    """a_n, b_n of a drop; size : 2 pi radius / wavelength."""
    count = int(size + 4.05 * size ** (1.0 / 3.0) + 2.0)
    inside = _INDEX * size
    derivative = np.zeros(int(max(count, inside)) + 17)
    for n in range(len(derivative) - 1, 0, -1):
        derivative[n - 1] = n / inside - 1.0 / (derivative[n] + n / inside)
    a, b = np.zeros(count, dtype=complex), np.zeros(count, dtype=complex)
    before, last = complex(np.cos(size), np.sin(size)), complex(np.sin(size), -np.cos(size))
    for n in range(1, count + 1):
        now = (2 * n - 1) * last / size - before
        for values, d in (
            (a, derivative[n] / _INDEX + n / size),
            (b, derivative[n] * _INDEX + n / size),
        ):
            values[n - 1] = (d * now.real - last.real) / (d * now - last)
        before, last = last, now
    return a, b


def phase_function(cosines: Array) -> Array:
    """Of the drops, its mean over the sphere 1."""
    longest = 2.0 * np.pi * _RADII[-1] / min(_WAVELENGTHS)
    count = int(longest + 4.05 * longest ** (1.0 / 3.0) + 3.0)
    pi, tau = np.zeros((2, count + 1, cosines.size))
    pi[1] = 1.0
    for n in range(2, count + 1):
        pi[n] = ((2 * n - 1) * cosines * pi[n - 1] - n * pi[n - 2]) / (n - 1)
    for n in range(1, count + 1):
        tau[n] = n * cosines * pi[n] - (n + 1) * pi[n - 1]
    drops = _RADII ** (1.0 / _VARIANCE - 3.0) * np.exp(-_RADII / (_RADIUS * _VARIANCE))
    total = np.zeros(cosines.size)
    for wavelength in _WAVELENGTHS:
        scattered = np.zeros(cosines.size)
        extinction = 0.0
        for radius, share in zip(_RADII, drops, strict=True):
            a, b = mie_coefficients(2.0 * np.pi * radius / wavelength)
            order = np.arange(1, len(a) + 1)
            f = (2.0 * order + 1.0) / (order * (order + 1.0))
            p, t = pi[1 : len(a) + 1], tau[1 : len(a) + 1]
            one, two = (f * a) @ p + (f * b) @ t, (f * a) @ t + (f * b) @ p
            scattered += share * (abs(one) ** 2 + abs(two) ** 2)
            extinction += share * float(np.sum((2.0 * order + 1.0) * (abs(a) ** 2 + abs(b) ** 2)))
        # The integral of (|S1|^2 + |S2|^2) / 2 over the cosine is the cross section's sum.
        total += scattered / extinction
    return np.asarray(total / len(_WAVELENGTHS))


@cache
def cloud_phase(cosines: tuple[float, ...]) -> Array:
    """Of drops and ice together, its mean over the sphere 1."""
    c = np.array(cosines)
    drops = phase_function(c)
    return np.asarray((1.0 - _ICE_SHARE) * drops + _ICE_SHARE * henyey_greenstein(c))


def cloud_law(cosines: Array) -> Array:
    """``cloud_phase`` at cosines; computed once for the same ones."""
    return cloud_phase(tuple(cosines))


def henyey_greenstein(cosines: Array, g: float = _ICE_ASYMMETRY) -> Array:
    """Phase function of asymmetry g."""
    return np.asarray((1.0 - g * g) / (1.0 + g * g - 2.0 * g * cosines) ** 1.5)


def legendre_moments(law: Law, count: int) -> tuple[Array, Array, Array]:
    """(count,) moments of a phase function; its values at fine nodes; these cosines."""
    angle = np.concatenate([np.linspace(0.0, 0.2, 3000), np.linspace(0.2, np.pi, 6000)[1:]])
    cosines = np.cos(angle)
    phase = law(cosines)
    weight = phase * np.sin(angle)
    step = np.zeros_like(angle)
    step[1:] += 0.5 * np.diff(angle)
    step[:-1] += 0.5 * np.diff(angle)
    moments, before, last = np.empty(count), np.ones_like(cosines), cosines
    for order in range(count):
        values = before
        moments[order] = 0.5 * np.sum(values * weight * step)
        before, last = last, ((2 * order + 3) * cosines * last - (order + 1) * before) / (order + 2)
    return moments / moments[0], np.asarray(phase / moments[0]), cosines


def _associated(order: int, count: int, cosines: Array) -> Array:
    """(count, n) normalised associated Legendre functions of an order, by degree."""
    values = np.zeros((count, cosines.size))
    start = np.ones_like(cosines)
    for k in range(1, order + 1):
        start = start * np.sqrt((2.0 * k - 1.0) / (2.0 * k)) * np.sqrt(1.0 - cosines**2)
    values[order] = start
    if order + 1 < count:
        values[order + 1] = np.sqrt(2.0 * order + 1.0) * cosines * start
    for n in range(order + 2, count):
        values[n] = (
            (2 * n - 1) * cosines * values[n - 1]
            - np.sqrt((n - 1.0) ** 2 - order**2) * values[n - 2]
        ) / np.sqrt(float(n * n - order**2))
    return values


def _doubled(up: Array, down: Array, mu: Array, weights: Array, thickness: float) -> Array:
    """(n, n) reflection of one azimuthal order; up, down : of a thin layer, back and onward."""
    halvings = 24
    thin = thickness / 2.0**halvings
    reflection = thin * up * weights / (2.0 * mu[:, None])
    transmission = np.diag(np.exp(-thin / mu)) + thin * down * weights / (2.0 * mu[:, None])
    one = np.eye(mu.size)
    for _ in range(halvings):
        between = np.linalg.solve(one - reflection @ reflection, transmission)
        reflection = reflection + transmission @ reflection @ between
        transmission = transmission @ between
    return reflection


def bidirectional(thickness: float, azimuths: Array, law: Law) -> tuple[Array, Array, Array]:
    """(azimuth, view, Sun) reflectance factors of a layer at Gauss nodes; nodes; weights."""
    count = 2 * _STREAMS
    moments, phase, cosines = legendre_moments(law, count + 1)
    peak = moments[count]
    scaled = (moments[:count] - peak) / (1.0 - peak)
    depth = (1.0 - peak) * thickness
    x, w = np.polynomial.legendre.leggauss(_STREAMS)
    mu, weights = 0.5 * (x + 1.0), 0.5 * w
    degree = (2.0 * np.arange(count) + 1.0) * scaled
    result = np.zeros((azimuths.size, _STREAMS, _STREAMS))
    for order in range(count):
        values, mirrored = _associated(order, count, mu), _associated(order, count, -mu)
        up, down = (degree[:, None] * values).T @ mirrored, (degree[:, None] * values).T @ values
        reflection = _doubled(up, down, mu, weights, depth) / (2.0 * weights * mu)
        factor = 1.0 if order == 0 else 2.0
        result += factor * np.cos(order * azimuths)[:, None, None] * reflection
    across = np.sqrt(1.0 - mu**2)
    angle = -mu[:, None] * mu + across[:, None] * across * np.cos(azimuths)[:, None, None]
    exact = np.interp(angle, cosines[::-1], phase[::-1]) / (1.0 - peak)
    truncated = np.polynomial.legendre.legval(angle, degree)
    path = 1.0 / mu[:, None] + 1.0 / mu
    single = (1.0 - np.exp(-depth * path)) / (4.0 * (mu[:, None] + mu))
    return result + (exact - truncated) * single, mu, weights


def _hidden(cosine: Array) -> Array:
    """Smith's function of tops: what hides them from a direction over what does not."""
    a = cosine / np.sqrt(np.maximum(1.0 - cosine**2, 1e-12) * ROUGH)
    return np.asarray(0.5 * (np.exp(-a * a) / (a * np.sqrt(np.pi)) - erfc(a)))


def rough(level: RegularGridInterpolator, azimuth: Array, view: Array, sun: Array) -> Array:
    """Reflectance factors of a rough layer; arguments but the first of one shape.

    level : of a level one, by azimuth and cosines of the view and the Sun
    """
    lowest, *_, highest = level.grid[1]
    level_sun, level_view = np.sqrt(1.0 - sun**2), np.sqrt(1.0 - view**2)
    to_camera = -level_view * np.cos(azimuth), level_view * np.sin(azimuth)
    between = sun * view + level_sun * to_camera[0]
    total = np.zeros_like(azimuth)
    for square, share in zip(*np.polynomial.laguerre.laggauss(_RINGS), strict=True):
        slope = np.sqrt(ROUGH * square)
        up = 1.0 / np.sqrt(1.0 + slope**2)
        for turn in (np.arange(_AROUND) + 0.5) * 2.0 * np.pi / _AROUND:
            east, north = slope * up * np.cos(turn), slope * up * np.sin(turn)
            to_sun = up * sun + east * level_sun
            seen = up * view + east * to_camera[0] + north * to_camera[1]
            s, v = (np.clip(one, lowest, highest) for one in (to_sun, seen))
            across = np.sqrt((1.0 - s**2) * (1.0 - v**2))
            angle = np.arccos(np.clip((s * v - between) / across, -1.0, 1.0))
            light = s * v * level(np.stack([angle, v, s], axis=-1))
            total += np.where((to_sun > 0.0) & (seen > 0.0), share / _AROUND / up * light, 0.0)
    # Where the camera looks along the Sun's light, it sees no shadow (Ginneken et al. 1998, Appl.
    # Opt. 37, 130).
    from_sun, from_view, turned = _hidden(sun), _hidden(view), 4.41 * (np.pi - azimuth)
    larger, smaller = np.maximum(from_sun, from_view), np.minimum(from_sun, from_view)
    hidden = larger + turned / (1.0 + turned) * smaller
    return np.asarray(total / (sun * view * (1.0 + hidden)))


def table() -> Array:
    """The table of the module's text."""
    azimuths = np.linspace(0.0, np.pi, CELLS)
    # Between the table's azimuths the rainbow and the glory are smoothed.
    fine = np.linspace(0.0, np.pi, 8 * (CELLS - 1) + 1)
    spread = np.maximum(1.0 - abs(azimuths[:, None] - fine) * (CELLS - 1) / np.pi, 0.0)
    spread /= spread.sum(axis=1, keepdims=True)
    around = np.full(fine.size, 1.0 / (fine.size - 1))
    around[[0, -1]] *= 0.5
    middles = (np.arange(CELLS) + 0.5) / CELLS
    weights = middles / middles.sum()
    layers = []
    for thickness in THICKNESSES:
        factors, mu, _ = bidirectional(float(thickness), fine, cloud_law)
        level = RegularGridInterpolator((fine, mu, mu), factors)
        reflectance = rough(level, *np.meshgrid(fine, middles, middles, indexing="ij"))
        albedo = np.einsum("a,v,avs->s", around, weights, reflectance)
        layers.append(np.einsum("af,fvs->avs", spread, reflectance / albedo))
    # Where both graze the layer it is no plane, and its forward peak would be that of a mirror.
    return np.minimum(np.stack(layers, axis=-1), _LARGEST).astype(np.float32)


if __name__ == "__main__":
    folder = Path(__file__).resolve().parents[1] / "simgl" / "data" / "earth"
    np.save(folder / "cloud_reflection.npy", table())
