"""The laws of the planet's shader: the sea's glint, clouds by thickness, cover by noise."""

from __future__ import annotations

from typing import Any

import moderngl
import numpy as np
import pytest

from simgl.physics.sea import foam_cover, water_body, wave_slope_variance
from tests.gpu.glsl_functions import evaluate

Array = np.ndarray[Any, Any]


def flat_fresnel(cosine: Array) -> Array:
    """Unpolarised reflectance of water of index 1.34, from the two polarisations."""
    inside = np.sqrt(1.0 - (1.0 - cosine**2) / 1.34**2)
    s = (cosine - 1.34 * inside) / (cosine + 1.34 * inside)
    p = (1.34 * cosine - inside) / (1.34 * cosine + inside)
    return np.asarray(0.5 * (s * s + p * p))


def hemisphere(rows: int, columns: int) -> tuple[Array, float]:
    """(n, 3) directions, each the middle of an equal part of the hemisphere, and that part [sr]."""
    cosine = (np.arange(rows) + 0.5) / rows
    turn = (np.arange(columns) + 0.5) * 2.0 * np.pi / columns
    z, turns = (a.ravel() for a in np.meshgrid(cosine, turn, indexing="ij"))
    level = np.sqrt(1.0 - z * z)
    directions = np.stack([level * np.cos(turns), level * np.sin(turns), z], axis=1)
    return directions, 2.0 * np.pi / z.size


def glint(gl: moderngl.Context, view: Array, sun_zenith: float, wind: float) -> Array:
    """Radiance over irradiance of the Sun, of a level sea, for (n, 3) directions to the camera."""
    sun = f"vec3({np.sin(sun_zenith)}, 0.0, {np.cos(sun_zenith)})"
    seen = "vec3(in_value[0], in_value[1], in_value[2])"
    call = f"vec4(glint(vec3(0.0, 0.0, 1.0), {sun}, {seen}, {wave_slope_variance(wind)}))"
    return evaluate(gl, ["planet/ocean.glsl"], call, view.astype(np.float32))[:, 0]


def test_fresnel_is_the_mean_of_both_polarisations(gl: moderngl.Context) -> None:
    cosine = np.linspace(0.01, 1.0, 100)
    seen = evaluate(
        gl,
        ["planet/ocean.glsl"],
        "vec4(fresnel_water(in_value[0]))",
        cosine[:, None].astype(np.float32),
    )[:, 0]
    np.testing.assert_allclose(seen, flat_fresnel(cosine), rtol=1e-4)


@pytest.mark.parametrize("wind", [3.0, 7.0, 12.0])
@pytest.mark.parametrize("sun_zenith_deg", [0.0, 30.0, 45.0])
def test_the_waves_send_up_what_flat_water_would_reflect(
    gl: moderngl.Context, wind: float, sun_zenith_deg: float
) -> None:
    zenith = np.radians(sun_zenith_deg)
    views, part = hemisphere(80, 200)
    sent = (glint(gl, views, zenith, wind) * views[:, 2]).sum() * part / np.cos(zenith)
    # Facets lean by 0.28 rms at 12 m/s, so their incidence differs; at 45 deg Fresnel's law is
    # curved enough to gain 13 % by that, and single scattering loses a few per cent.
    expected = float(flat_fresnel(np.array(np.cos(zenith))))
    assert 0.94 < sent / expected < 1.15


def test_the_glint_stands_at_the_mirror_point_and_widens_with_the_wind(
    gl: moderngl.Context,
) -> None:
    zenith = np.radians(30.0)
    angles = np.radians(np.linspace(-10.0, 70.0, 801))
    views = np.stack([-np.sin(angles), np.zeros_like(angles), np.cos(angles)], axis=1)
    widths = []
    for wind in (1.0, 5.0, 14.0):
        light = glint(gl, views, zenith, wind)
        peak = angles[np.argmax(light)]
        # Around the mirror point ln L = -d^2 / (4 v) + a d, so the peak lies 2 v a beyond it; the
        # slant gives a = tan(zenith) < 0.85 up to 40 deg, Fresnel's law less than 0.35 more.
        beyond = peak - zenith
        if wind <= 5.0:  # where it is near enough for that
            assert -0.002 < beyond < 0.002 + 2.4 * wave_slope_variance(wind)
        above = angles[light > 0.5 * light.max()]
        widths.append(above[-1] - above[0])
    # A slope turns the mirrored ray by twice itself; a bell's half width is 1.67 of one axis' rms.
    # Along the plane of incidence the light's own slant adds a few per cent.
    expected = [2.0 * 1.67 * np.sqrt(wave_slope_variance(w)) for w in (1.0, 5.0)]
    np.testing.assert_allclose(widths[:2], expected, rtol=0.1)
    assert widths[2] > widths[1]


def test_the_sea_is_as_rough_and_white_as_its_sources_say() -> None:
    # Cox and Munk (1954) at 10 m/s: 0.0542; Monahan and O'Muircheartaigh (1980): 0.98 %.
    assert wave_slope_variance(10.0) == pytest.approx(0.0542)
    assert foam_cover(10.0) == pytest.approx(0.0098, rel=0.01)
    blue = water_body(5.0)
    assert blue[2] > blue[1] > blue[0] > blue[3]
    assert blue[1] < 0.01
    assert foam_cover(60.0) <= 1.0


def clouds(gl: moderngl.Context, expression: str, inputs: Array) -> Array:
    return evaluate(gl, ["planet/cloud.glsl"], f"vec4({expression})", inputs.astype(np.float32))[
        :, 0
    ]


def slab_reflectance(tau: float, mu: float, count: int, rng: np.random.Generator) -> float:
    """Share of photons that leave a slab upwards: Henyey-Greenstein, g = 0.85, no absorption."""
    g = 0.85
    depth, cosine = np.zeros(count), np.full(count, mu)
    up = 0
    while depth.size:
        depth = depth + cosine * rng.exponential(size=depth.size)
        up += int((depth < 0.0).sum())
        inside = (depth >= 0.0) & (depth <= tau)
        depth, cosine = depth[inside], cosine[inside]
        s = (1.0 - g * g) / (1.0 - g + 2.0 * g * rng.uniform(size=depth.size))
        turn = (1.0 + g * g - s * s) / (2.0 * g)
        around = np.cos(2.0 * np.pi * rng.uniform(size=depth.size))
        lean = np.sqrt(np.maximum((1.0 - turn**2) * (1.0 - cosine**2), 0.0))
        cosine = np.clip(cosine * turn + lean * around, -1.0, 1.0)
    return up / count


# Two streams miss little but thin clouds under a low Sun (King and Harshvardhan 1986).
@pytest.mark.parametrize(("mu", "two_streams"), [(1.0, 0.03), (0.5, 0.03), (0.2, 0.06)])
def test_a_cloud_reflects_what_photons_in_a_slab_do(
    gl: moderngl.Context, mu: float, two_streams: float
) -> None:
    thickness = [2.0, 8.0, 30.0]
    rng = np.random.default_rng(11)
    traced = [slab_reflectance(tau, mu, 8_000, rng) for tau in thickness]
    cases = np.array([[tau, mu] for tau in thickness])
    seen = clouds(gl, "cloud_reflectance(in_value[0], in_value[1])", cases)
    # 8,000 photons: 0.0056 standard error, 3 of them.
    np.testing.assert_allclose(seen, traced, atol=two_streams + 0.017)


def test_thick_clouds_are_bright_and_none_sends_more_than_it_gets(gl: moderngl.Context) -> None:
    tau, mu = (a.ravel() for a in np.meshgrid(np.geomspace(0.01, 1000, 40), [0.05, 0.3, 0.6, 1.0]))
    seen = clouds(gl, "cloud_reflectance(in_value[0], in_value[1])", np.stack([tau, mu], axis=1))
    assert seen.min() >= 0.0
    assert seen.max() < 1.0
    thick = clouds(gl, "cloud_reflectance(in_value[0], in_value[1])", np.array([[20, 1], [50, 1]]))
    assert np.all((thick > 0.6) & (thick < 0.86))
    even = clouds(gl, "cloud_diffuse_reflectance(in_value[0])", np.array([[7.7], [50.0]]))
    np.testing.assert_allclose(even, [7.7 / (7.7 + 8.89), 50.0 / (50.0 + 8.89)], rtol=2e-3)


def test_the_noise_breaks_a_cover_up_and_keeps_its_mean(gl: moderngl.Context) -> None:
    level = (np.arange(4000) + 0.5) / 4000
    for share in (0.0, 0.02, 0.2, 0.5, 0.93, 1.0):
        for ragged in (0.2, 1.0):
            cases = np.stack([np.full(4000, share), level, np.full(4000, ragged)], axis=1)
            given = "(in_value[0], in_value[1], in_value[2])"
            cover = clouds(gl, f"cover_here{given}", cases)
            # The level is drawn in by 0.4 % so that a share of 0 stays empty.
            assert cover.mean() == pytest.approx(share, abs=0.005)
            assert cover.min() >= 0.0
            assert cover.max() <= 1.0
            thicker = clouds(gl, f"thicker{given}", cases)
            assert (cover * thicker).mean() == pytest.approx(0.0, abs=0.006)
