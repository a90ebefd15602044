"""The laws of the planet's shader: the sea's glint, clouds by thickness, cover by noise."""

from __future__ import annotations

from typing import Any

import moderngl
import numpy as np
import pytest
from scipy.ndimage import label
from scipy.special import ndtri

from simgl.passes.background.earth_maps import shore_map
from simgl.passes.background.planet_blocks import PLANET
from simgl.physics.sea_surface import (
    clear_water,
    foam_cover,
    foam_in_bands,
    wave_slope_variance,
)
from simgl.scene.noise_projection import RANGE, SIZE, chart
from tests.gpu.glsl_functions import evaluate
from tools.cloud_reflection import ROUGH

Array = np.ndarray[Any, Any]


def flat_fresnel(cosine: Array) -> Array:
    """Unpolarised reflectance of water of index 1.34, from the two polarisations."""
    inside = np.sqrt(1.0 - (1.0 - cosine**2) / 1.34**2)
    s = (cosine - 1.34 * inside) / (cosine + 1.34 * inside)
    p = (1.34 * cosine - inside) / (1.34 * cosine + inside)
    return 0.5 * (s * s + p * p)


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
    # 3.84e-6 of the wind's power 3.41, whose reflectance in effect is 0.22 (Koepke 1984).
    np.testing.assert_allclose([foam_cover(5.0), foam_cover(15.0)], [9.28e-4, 3.934e-2], rtol=2e-3)
    np.testing.assert_allclose(foam_in_bands()[:3], 0.22)
    blue = clear_water()
    assert blue[2] > blue[1] > blue[0] > blue[3]
    assert blue[1] < 0.01
    assert foam_cover(60.0) <= 1.0


@pytest.mark.parametrize("wind", [3.0, 7.0, 12.0])
@pytest.mark.parametrize("sun_zenith_deg", [10.0, 40.0])
def test_the_glint_s_peak_is_what_facets_send_there(
    gl: moderngl.Context, wind: float, sun_zenith_deg: float
) -> None:
    """Facets of Cox and Munk's slopes, each a mirror, summed over a cone about the mirror point."""
    zenith = np.radians(sun_zenith_deg)
    sun = np.array([np.sin(zenith), 0.0, np.cos(zenith)])
    peak = np.array([-np.sin(zenith), 0.0, np.cos(zenith)])
    variance = 0.003 + 0.00512 * wind
    slopes = np.linspace(-0.25, 0.25, 2001)
    x, y = (a.ravel() for a in np.meshgrid(slopes, slopes))
    density = np.exp(-(x * x + y * y) / variance) / (np.pi * variance)
    # Area and cosine of a facet over that of its ground: sun . (-x, -y, 1).
    facing = np.maximum(sun[2] - x * sun[0] - y * sun[1], 0.0)
    normal = np.stack([-x, -y, np.ones_like(x)], axis=1) / np.sqrt(1.0 + x * x + y * y)[:, None]
    cosine = np.clip(normal @ sun, 0.0, 1.0)
    sent = 2.0 * cosine[:, None] * normal - sun
    cone = np.cos(np.radians(4.0))
    flux = density * facing * flat_fresnel(cosine) * (sent @ peak > cone)
    power = flux.sum() * (slopes[1] - slopes[0]) ** 2
    turn, height = np.meshgrid(np.linspace(0, 2 * np.pi, 64, endpoint=False), np.arange(40) + 0.5)
    z = (1.0 - (1.0 - cone) * height / 40.0).ravel()
    level = np.sqrt(1.0 - z * z)
    side = np.array([peak[2], 0.0, -peak[0]])
    views = z[:, None] * peak
    views += (level * np.cos(turn.ravel()))[:, None] * side
    views += (level * np.sin(turn.ravel()))[:, None] * np.array([0.0, 1.0, 0.0])
    light = (glint(gl, views, zenith, wind) * views[:, 2]).mean() * 2.0 * np.pi * (1.0 - cone)
    # A rim of half a cell of 4 deg / 2 steps of 0.00025 is 0.7 % of the cone; waves hide next to
    # nothing of each other at 40 deg.
    assert light == pytest.approx(power, rel=0.01)


def wind_over(gl: moderngl.Context, up: Array, season: float) -> Array:
    """The wind over its mean at (n, 3) places at a share of the year."""
    values = np.zeros((), dtype=PLANET.dtype)
    values["planet_km"], values["year_share"] = 6378.137, season
    block = gl.buffer(values.tobytes())
    block.bind_to_uniform_block(0)
    call = "vec4(wind_over(vec3(in_value[0], in_value[1], in_value[2]), 1.0))"
    over = evaluate(
        gl,
        ["planet/wind.glsl"],
        call,
        up.astype(np.float32),
        blocks=[PLANET],
    )[:, 0]
    block.release()
    return over


@pytest.mark.parametrize("season", [0.05, 0.55])
def test_the_wind_has_its_mean_over_the_sea_trades_calms_and_storm_tracks(
    gl: moderngl.Context, season: float
) -> None:
    codes = shore_map(None)[0][..., 0]
    step = codes.shape[0] // 60
    sea = codes[step // 2 :: step, step // 2 :: step] > 128
    rows, columns = sea.shape
    latitude = np.pi * (0.5 - (np.arange(rows) + 0.5) / rows)
    longitude = np.pi * (2.0 * (np.arange(columns) + 0.5) / columns - 1.0)
    lat, lon = np.meshgrid(latitude, longitude, indexing="ij")
    up = np.stack([np.cos(lat) * np.cos(lon), np.cos(lat) * np.sin(lon), np.sin(lat)], axis=-1)
    wind = wind_over(gl, up.reshape(-1, 3), season).reshape(sea.shape)
    # Ice lies beyond 70 deg.
    weight = np.cos(lat) * sea * (np.abs(lat) < np.radians(70.0))
    mean = np.average(wind, weights=weight)
    assert mean == pytest.approx(1.0, abs=0.03)
    assert 0.25 < np.sqrt(np.average((wind - mean) ** 2, weights=weight)) < 0.5
    assert wind.min() > 0.15
    zonal = np.average(wind, axis=1)

    def at(degrees: float) -> float:
        return float(np.interp(degrees, np.degrees(latitude[::-1]), zonal[::-1]))

    # QuikSCAT's means: 5 m/s in the calms, 7 to 8 in the trades, 10 in the southern storms.
    assert at(4.0) < 0.75 < 0.9 < at(16.0)
    assert at(-50.0) > 1.2
    assert at(50.0) > (1.15 if season < 0.3 else 0.9)


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


def light_on_facets(mu: float) -> float:
    """Mean cosine of sunlight on normally distributed slopes, each by the light that it gets."""
    slopes = np.linspace(-4.0, 4.0, 161) * np.sqrt(0.5 * ROUGH)
    ahead, across = np.meshgrid(slopes, slopes, indexing="ij")
    up = 1.0 / np.sqrt(1.0 + ahead**2 + across**2)
    cosine = np.maximum(up * (mu + ahead * np.sqrt(1.0 - mu**2)), 0.0)
    light = cosine / up * np.exp(-(ahead**2 + across**2) / ROUGH)
    return float((light * cosine).sum() / light.sum())


def test_the_sun_on_rough_tops_is_that_on_facets_of_the_reflection_table(
    gl: moderngl.Context,
) -> None:
    mu = np.array([0.0, 0.1, 0.3, 0.5, 0.7, 0.85, 1.0])
    seen = clouds(gl, "cosine_on_tops(in_value[0])", np.stack([mu, mu], axis=1))
    # A line through a curve.
    np.testing.assert_allclose(seen, [light_on_facets(m) for m in mu], atol=0.02)


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


@pytest.mark.parametrize("kept", [0.0, 0.3, 1.0])
@pytest.mark.parametrize("softness", [0.15, 0.55])
def test_the_noise_breaks_a_cover_up_and_keeps_its_mean_at_any_pixel(
    gl: moderngl.Context, kept: float, softness: float
) -> None:
    seen = np.sqrt(kept) * ndtri((np.arange(4000) + 0.5) / 4000)
    for share in (0.02, 0.2, 0.5, 0.93, 0.99):
        cases = np.stack([np.full(4000, share), seen], axis=1)
        cloud = f"broken_up(in_value[0], {kept}, {softness})"
        cover = clouds(gl, f"cloud_cover({cloud}, in_value[1])", cases)
        # The quantile is good to 0.012, 0.005 of a share.
        assert cover.mean() == pytest.approx(share, abs=0.005)
        assert cover.min() >= 0.0
        assert cover.max() <= 1.0
        thicker = clouds(gl, f"in_value[1] - {cloud}.mean", cases)
        assert (cover * thicker).mean() == pytest.approx(0.0, abs=0.008)


def test_a_pixel_that_resolves_less_of_the_noise_shows_less_of_its_contrast(
    gl: moderngl.Context,
) -> None:
    """Half of the noise resolved: cover is the mean of what full resolution would show."""
    rng = np.random.default_rng(5)
    seen = np.sqrt(0.5) * rng.standard_normal(20)
    unseen = np.sqrt(0.5) * ndtri((np.arange(500) + 0.5) / 500)
    fine = np.stack([np.full(10_000, 0.4), (seen[:, None] + unseen).ravel()], axis=1)
    sharp = clouds(gl, "cloud_cover(broken_up(in_value[0], 1.0, 0.2), in_value[1])", fine)
    coarse = np.stack([np.full(20, 0.4), seen], axis=1)
    blurred = clouds(gl, "cloud_cover(broken_up(in_value[0], 0.5, 0.2), in_value[1])", coarse)
    np.testing.assert_allclose(blurred, sharp.reshape(20, 500).mean(axis=1), atol=0.005)


@pytest.mark.parametrize("share", [0.1, 0.2, 0.4])
def test_outlines_of_cumulus_have_the_dimension_of_clouds(share: float) -> None:
    """Of 1 to 1,200 km2, perimeters go with areas as Lovejoy (1982) found: dimension 1.35."""
    noise = chart(0)[0][0][..., 6]
    cloudy = noise > np.quantile(noise, 1.0 - share)
    labels, count = label(cloudy)
    area = np.bincount(labels.ravel(), minlength=count + 1)[1:]
    perimeter = np.zeros(count + 1)
    for axis in (0, 1):
        beside = np.roll(cloudy, -1, axis)
        of = np.where(cloudy, labels, np.roll(labels, -1, axis))[cloudy != beside]
        perimeter += np.bincount(of, minlength=count + 1)
    # A texel is 250 m. Where 40 % is cloud, clouds run into each other.
    some = (area > 16) & (area < 19_200)
    slope = np.polyfit(np.log(area[some]), np.log(perimeter[1:][some]), 1)[0]
    assert 2.0 * slope == pytest.approx(1.35, abs=0.08)


def test_storms_tower_over_thin_and_missing_cloud(gl: moderngl.Context) -> None:
    cases = np.array([[1.0, 0.89], [1.0, 0.55], [0.0, 0.89], [0.5, 1.0]])
    height = clouds(gl, "tower_height(vec2(in_value[0], in_value[1]))", cases)
    np.testing.assert_allclose(height, [1.0, 0.0, 0.0, 0.5], atol=1e-5)


def test_the_chart_is_normal_and_loses_variance_as_texels_grow() -> None:
    (codes, *_), kept = chart(3)
    noise = (codes[..., 2:] / 255.0 - 0.5) * 2.0 * RANGE
    # What is read between texels is normal; on them the finest waves are up to a tenth stronger.
    np.testing.assert_allclose(noise.mean(axis=(0, 1)), 0.0, atol=0.02)
    np.testing.assert_allclose(noise.std(axis=(0, 1)), 1.0, atol=0.1)
    slopes = (codes[..., :2] / 255.0 - 0.5) * 2.0 * RANGE
    np.testing.assert_allclose(np.sqrt((slopes**2).mean()), 1.0, atol=0.02)
    assert np.all(np.diff(kept, axis=0) < 0.0)
    assert np.all(kept[0] == 1.0)
    # Clouds' waves of 64 km are gone from texels of 32 km, hills' of 18 km from texels of 8 km.
    assert np.all(kept[-1, 1:] < 0.15)
    assert kept[5, 0] < 0.1
    # It repeats: the seam is no rougher than what lies beside it.
    for axis in (0, 1):
        step = np.abs(np.diff(noise, axis=axis, append=np.take(noise, [0], axis=axis)))
        seam = np.take(step, -1, axis=axis).mean()
        assert seam < 1.3 * step.mean()


@pytest.mark.parametrize("level", [0, 3])
def test_every_kind_of_cloud_covers_its_share_whatever_a_pixel_resolves(
    gl: moderngl.Context, level: int
) -> None:
    """Streets, cells and lumps, and what lies between two of them: of the image's own noise."""
    levels, kept = chart(3)
    codes = levels[level][..., 4:].reshape(-1, 4)
    codes = codes[np.random.default_rng(1).integers(0, len(codes), 10_000)]
    noise = (codes / 255.0 - 0.5) * 2.0 * RANGE
    neighbours = np.array([0.5, 0.5, 0.0, 0.0]), np.array([0.0, 0.0, 0.5, 0.5])
    for shares in (*np.eye(4), *neighbours):
        seen = noise @ np.sqrt(shares)
        broken = f"broken_up(in_value[0], {kept[level, 2:] @ shares:.4f}, 0.3)"
        cases = np.stack([np.full(seen.size, 0.3), seen], axis=1)
        cover = clouds(gl, f"cloud_cover({broken}, in_value[1])", cases)
        # On texels noise is up to a tenth stronger than between them, which moves 0.3 by 0.012;
        # waves of 64 km are 16 to the image: 0.012 more.
        assert cover.mean() == pytest.approx(0.3, abs=0.025)


def test_the_charts_faces_meet_without_a_seam(gl: moderngl.Context) -> None:
    """Across edges and corners of the cube noise changes no more than inside a face."""
    (codes, *_), _ = chart(0)
    texture = gl.texture((SIZE, SIZE), 4, codes[..., :4].tobytes(), alignment=1)
    texture.filter = (moderngl.LINEAR, moderngl.LINEAR)
    values = np.zeros((), dtype=PLANET.dtype)
    values["chart_repeats"], values["chart_last"] = 20.0, 7.0
    block = gl.buffer(values.tobytes())
    block.bind_to_uniform_block(0)
    s = np.linspace(-0.03, 0.03, 12_000)[:, None]
    lines = {
        "inside": (np.array([1.0, 0.3, 0.3]), np.array([0.0, 1.0, 0.2])),
        "edge": (np.array([1.0, 1.0, 0.3]), np.array([-1.0, 1.0, 0.1])),
        "corner": (np.array([1.0, 1.0, 1.0]), np.array([-1.0, 0.7, 0.3])),
    }
    steps, deviation = {}, {}
    for name, (middle, along) in lines.items():
        seen = evaluate(
            gl,
            ["planet/chart.glsl"],
            "chart_about(chart, normalize(vec3(in_value[0], in_value[1], in_value[2])), 0.0)",
            (middle + s * along).astype(np.float32),
            textures={"chart": texture},
            blocks=[PLANET],
        )[:, 2]
        # A step is 30 to 40 m, a texel 250 m.
        steps[name], deviation[name] = np.abs(np.diff(seen)).max(), seen.std()
    block.release()
    texture.release()
    assert steps["inside"] < 1.0
    for name in ("edge", "corner"):
        assert steps[name] < 1.5 * steps["inside"]
        # 380 km hold some ten of the longest waves.
        assert 0.6 < deviation[name] < 1.5
