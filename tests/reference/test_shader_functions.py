"""Shader functions against their numpy references, over grids."""

from __future__ import annotations

import moderngl
import numpy as np
import pytest
from scipy import stats

from simgl.camera.noise_streams import normal, philox, uniform_01
from tests.gpu.glsl_functions import evaluate
from tests.reference import brdf as reference
from tests.reference.highlights import LIMB, SUN, highlight, width_at_half

# Known answers of Philox4x32-10; the first three are those of its authors' test file.
PHILOX = [
    ([0, 0, 0, 0], [0, 0], "6627e8d5 e169c58d bc57ac4c 9b00dbd8"),
    ([0xFFFFFFFF] * 4, [0xFFFFFFFF] * 2, "408f276d 41c83b0e a20bc7c6 6d5451fd"),
    (
        [0x243F6A88, 0x85A308D3, 0x13198A2E, 0x03707344],
        [0xA4093822, 0x299F31D0],
        "d16cfe09 94fdcceb 5001e420 24126ea1",
    ),
    ([0x280, 0x1E0, 7, 0], [0x4D2, 0xA5], "77194845 2bb4cf69 17cc025a db564aa9"),
]


@pytest.mark.parametrize(("counter", "key", "answer"), PHILOX)
def test_philox_known_answers(
    gl: moderngl.Context, counter: list[int], key: list[int], answer: str
) -> None:
    expected = np.array([int(word, 16) for word in answer.split()], dtype=np.uint32)
    c, k = np.array([counter], dtype=np.uint32), np.array(key, dtype=np.uint32)
    np.testing.assert_array_equal(philox(c, k)[0], expected)
    words = (
        "uvec4(in_value[0], in_value[1], in_value[2], in_value[3]), uvec2(in_value[4], in_value[5])"
    )
    inputs = np.array([counter + key], dtype=np.uint32)
    got = evaluate(gl, ["common/philox.glsl"], f"philox({words})", inputs, result="uvec4")
    np.testing.assert_array_equal(got[0], expected)


def test_philox_agrees_on_random_counters(gl: moderngl.Context) -> None:
    rng = np.random.default_rng(3)
    inputs = rng.integers(0, 2**32, (4000, 4), dtype=np.uint32)
    got = evaluate(
        gl,
        ["common/philox.glsl"],
        "philox(uvec4(in_value[0], in_value[1], in_value[2], in_value[3]), uvec2(77u, 5u))",
        inputs,
        result="uvec4",
    )
    np.testing.assert_array_equal(got, philox(inputs, np.array([77, 5], dtype=np.uint32)))


def test_uniform_and_normal_numbers_agree(gl: moderngl.Context) -> None:
    words = np.random.default_rng(4).integers(0, 2**32, (4000, 1), dtype=np.uint32)
    words[:2, 0] = 0, 2**32 - 1
    got = evaluate(
        gl,
        ["common/philox.glsl"],
        "vec4(normal(uniform_01(uvec4(in_value[0]))).x, uniform_01(uvec4(in_value[0])).x, 0, 0)",
        words,
    )
    u = uniform_01(words[:, 0])
    np.testing.assert_array_equal(got[:, 1], u.astype(np.float32))
    # float32 log, square root and two polynomials: some 1e-6 of values up to 5.3.
    np.testing.assert_allclose(got[:, 0], normal(u), atol=1e-5)


def test_normal_numbers_are_quantiles_of_the_normal_distribution() -> None:
    u = (np.arange(2**16) * 128 + 0.5) / 2.0**23
    # Wichura states seven digits.
    np.testing.assert_allclose(normal(u), stats.norm.ppf(u), rtol=2e-7, atol=1e-7)


@pytest.mark.parametrize(
    ("metallic", "roughness"), [(0.0, 0.3), (1.0, 0.3), (0.5, 0.7), (0.0, 1.0)]
)
def test_brdf_agrees(gl: moderngl.Context, metallic: float, roughness: float) -> None:
    rng = np.random.default_rng(5)
    directions = rng.normal(size=(2, 2000, 3))
    directions /= np.linalg.norm(directions, axis=2, keepdims=True)
    directions[..., 2] = np.abs(directions[..., 2])
    wi, wo = directions[:, np.all(directions[..., 2] > 0.05, axis=0)]
    inputs = np.concatenate([wi, wo], axis=1).astype(np.float32)
    vectors = "vec3(0, 0, 1), vec3(in_value[0], in_value[1], in_value[2])"
    vectors += ", vec3(in_value[3], in_value[4], in_value[5])"
    call = f"brdf(vec4(0.6, 0.2, 0.9, 0.0), {metallic}, {roughness**2}, {vectors}, 1e-6)"
    got = evaluate(gl, ["surface/brdf.glsl"], call, inputs)
    n = np.array([[0.0, 0.0, 1.0]])
    for band, rho in enumerate((0.6, 0.2, 0.9, 0.0)):
        expected = reference.brdf(rho, metallic, roughness, n, wi, wo)
        # float32 through some 30 operations; the distribution's denominator loses up to 1/alpha^2
        # of that at its peak: 6e-8 x 10 / 0.09^2 = 7e-5
        np.testing.assert_allclose(got[:, band], expected, rtol=1e-4, atol=1e-7)


@pytest.mark.parametrize("limb", [(0.0, 0.0), LIMB])
@pytest.mark.parametrize("phase", [0.01, 60.0, 120.0, 150.0])
@pytest.mark.parametrize("roughness", [0.02, 0.05, 0.1, 0.2, 0.8])
def test_a_highlight_of_the_suns_disc_agrees_with_quadrature_over_the_disc(
    gl: moderngl.Context, roughness: float, phase: float, limb: tuple[float, float]
) -> None:
    steps, got, expected = highlight(gl, roughness, phase, limb)
    for shown, truth in zip(got, expected, strict=True):
        np.testing.assert_allclose(shown, truth, rtol=0.0, atol=0.01 * truth.max())
        assert abs(shown.max() / truth.max() - 1.0) < 0.01
        # A lobe wider than what is in view has no width.
        if max(truth[0], truth[-1]) < 0.5 * truth.max():
            assert abs(width_at_half(steps, shown) / width_at_half(steps, truth) - 1.0) < 0.01


def test_a_mirror_shows_the_suns_own_radiance(gl: moderngl.Context) -> None:
    """f cos E of the smoothest metal in the mirror direction is F times E / (pi a^2)."""
    t = np.radians(30.0)
    inputs = np.array([[-np.sin(t), 0, np.cos(t), np.sin(t), 0, np.cos(t)]], dtype=np.float32)
    vectors = "vec3(0, 0, 1), vec3(in_value[0], in_value[1], in_value[2])"
    vectors += ", vec3(in_value[3], in_value[4], in_value[5])"
    call = f"brdf(vec4(1.0), 1.0, 1e-4, {vectors}, {SUN:.9g}) * in_value[2]"
    got = evaluate(gl, ["surface/brdf.glsl"], call, inputs)[0, 0]
    # The lobe's own tails hold alpha^2 / rho^2 = 2e-3 of the light.
    np.testing.assert_allclose(got, 1.0 / (np.pi * SUN**2), rtol=3e-3)


# Radiance along the equator of a GGX sphere, 1367 W m-2 of 0.526 deg, phase angle 60 deg; beta from
# the camera towards the Sun. Direct integration over the disc, by an independent path tracer.
GGX_SPHERES = [
    (True, 0.1, 1.0651e6, (0.1565, 2.253, 3.077, 0.3131, 0.1512)),
    (True, 0.3, 13932.0, (12.02, 147.4, 201.4, 24.04, 11.74)),
    (False, 0.1, 47567.0, (104.4, 147.8, 201.9, 208.9, 201.7)),
    (False, 0.3, 800.87, (105.0, 154.2, 210.7, 209.9, 202.3)),
]


@pytest.mark.parametrize(("metal", "roughness", "peak", "profile"), GGX_SPHERES)
def test_ggx_spheres_have_their_profile_and_peak(
    gl: moderngl.Context,
    metal: bool,
    roughness: float,
    peak: float,
    profile: tuple[float, float, float, float, float],
) -> None:
    beta = np.radians(np.concatenate([[0.0, 15.0, 45.0, 60.0, 75.0], np.arange(28, 32, 0.01)]))
    phase = np.radians(60.0)
    inputs = np.stack([np.sin(beta), np.cos(beta)], axis=1).astype(np.float32)
    n = "vec3(in_value[0], 0, in_value[1])"
    wi = f"vec3({np.sin(phase):.9g}, 0, {np.cos(phase):.9g})"
    rho, metallic = (0.9, 1.0) if metal else (0.5, 0.0)
    call = f"brdf(vec4({rho}), {metallic}, {roughness**2}, {n}, {wi}, vec3(0, 0, 1), {SUN:.9g})"
    call = f"{call} * 1367.0 * dot({n}, {wi})"
    got = evaluate(gl, ["surface/brdf.glsl"], call, inputs)[:, 0]
    # The truth is printed to four digits; the disc as a circle among half vectors costs some 5e-4.
    np.testing.assert_allclose(got[:5], profile, rtol=1e-3)
    np.testing.assert_allclose(got[5:].max(), peak, rtol=1e-3)


def test_no_surface_shows_the_sun_brighter_than_it_is(gl: moderngl.Context) -> None:
    """Radiance = reflectance times cosine times irradiance, and irradiance is pi r^2 radiance."""
    rng = np.random.default_rng(5)
    # Grazing light and viewers, normals that lean away from both: what backlit edges hold.
    azimuth = rng.uniform(0.0, 2.0 * np.pi, (4000, 2))
    height = rng.uniform(-0.05, 0.05, (4000, 2))
    flat = np.sqrt(1.0 - height**2)
    vectors = np.stack([flat * np.cos(azimuth), flat * np.sin(azimuth), height], axis=2)
    wi, wo = vectors[:, 0], vectors[:, 1]
    wi[:, 2] = np.abs(wi[:, 2]) + 1e-4
    values = np.concatenate([wi, wo], axis=1).astype(np.float32)
    light = "normalize(vec3(in_value[0], in_value[1], in_value[2]))"
    eye = "normalize(vec3(in_value[3], in_value[4], in_value[5]))"
    for roughness in (0.05, 0.2, 0.6):
        call = f"brdf(vec4(1.0), 1.0, {roughness**2}, vec3(0, 0, 1), {light}, {eye}, {SUN:.9g})"
        shown = evaluate(gl, ["surface/brdf.glsl"], f"{call} * in_value[2]", values)[:, 0]
        assert np.all(np.isfinite(shown))
        assert shown.max() <= 1.001 / (np.pi * SUN**2)


def test_brdf_is_reciprocal() -> None:
    rng = np.random.default_rng(6)
    wi, wo = rng.normal(size=(2, 500, 3))
    wi, wo = (np.abs(w) / np.linalg.norm(w, axis=1, keepdims=True) for w in (wi, wo))
    n = np.array([[0.0, 0.0, 1.0]])
    there = reference.brdf(0.7, 0.3, 0.4, n, wi, wo)
    back = reference.brdf(0.7, 0.3, 0.4, n, wo, wi)
    np.testing.assert_allclose(there, back, rtol=1e-12)


def test_disc_cosine_agrees_with_quadrature_over_the_disc(gl: moderngl.Context) -> None:
    radius = np.radians(0.263)
    tilt = np.radians(np.concatenate([np.linspace(89.5, 90.5, 41), [0.0, 30.0, 60.0, 85.0]]))
    cosine = np.cos(tilt)
    inputs = cosine.astype(np.float32)[:, None]
    got = evaluate(gl, ["common/sun.glsl"], f"vec4(disc_cosine(in_value[0], {radius:.9g}))", inputs)
    # The closed form takes the disc as flat (1e-5 of its radius); strips resolve it to 1e-6 of it.
    expected = reference.disc_cosine(cosine, radius)
    np.testing.assert_allclose(got[:, 0], expected, rtol=2e-5, atol=radius * 5e-5)


@pytest.mark.parametrize("roughness", [0.05, 0.3, 0.55, 0.8])
def test_light_from_behind_makes_no_highlight_where_quadrature_has_none(
    gl: moderngl.Context, roughness: float
) -> None:
    """Phases of 140 to 178 deg, surfaces in any position that both sides see, grazing ones too."""
    rng = np.random.default_rng(8)
    half = 0.5 * np.radians(rng.uniform(140.0, 178.0, 2000))
    zero = np.zeros(len(half))
    wi = np.stack([-np.sin(half), zero, np.cos(half)], axis=1)
    wo = np.stack([np.sin(half), zero, np.cos(half)], axis=1)
    n = rng.normal(size=(len(half), 3))
    n /= np.linalg.norm(n, axis=1, keepdims=True)
    seen = (np.sum(n * wi, axis=1) > 0.02) & (np.sum(n * wo, axis=1) > 0.02)
    n, wi, wo = n[seen][:100], wi[seen][:100], wo[seen][:100]
    normal, light, eye = (
        f"vec3(in_value[{k}], in_value[{k + 1}], in_value[{k + 2}])" for k in (0, 3, 6)
    )
    call = f"brdf(vec4(0.9), 1.0, {roughness**2:.9g}, {normal}, {light}, {eye}, {SUN:.9g})"
    inputs = np.concatenate([n, wi, wo], axis=1).astype(np.float32)
    got = evaluate(gl, ["surface/brdf.glsl"], call, inputs)[:, 0]
    expected = reference.disc_mean_brdf(0.9, 1.0, roughness, n, wi, wo, SUN)
    # Masking and Fresnel are those of the disc's middle; 0.02 of a white surface does not show.
    np.testing.assert_allclose(got, expected, rtol=0.05, atol=0.02 / np.pi)


@pytest.mark.parametrize("roughness", [0.05, 0.3, 0.55, 0.8])
def test_a_normal_that_leans_from_the_viewer_makes_no_glint(
    gl: moderngl.Context, roughness: float
) -> None:
    """Interpolated normals at backlit edges: the lobe is no higher than anywhere on the disc."""
    rng = np.random.default_rng(9)
    n, wi, wo = (rng.normal(size=(20000, 3)) for _ in range(3))
    n, wi, wo = (v / np.linalg.norm(v, axis=1, keepdims=True) for v in (n, wi, wo))
    h = (wi + wo) / np.linalg.norm(wi + wo, axis=1, keepdims=True)
    NoL, NoV, NoH, VoH = (np.sum(a * b, axis=1) for a, b in ((n, wi), (n, wo), (n, h), (wo, h)))
    leaning = (NoL > 0.01) & (NoV < 0.0) & (NoV > -0.3) & (VoH > 0.05)
    normal, light, eye = (
        f"vec3(in_value[{k}], in_value[{k + 1}], in_value[{k + 2}])" for k in (0, 3, 6)
    )
    call = f"brdf(vec4(1.0), 1.0, {roughness**2:.9g}, {normal}, {light}, {eye}, {SUN:.9g})"
    inputs = np.concatenate([n, wi, wo], axis=1)[leaning].astype(np.float32)
    got = evaluate(gl, ["surface/brdf.glsl"], call, inputs)[:, 0]
    # Half vectors turn by half of the disc's radius, and across the plane by 1 / VoH of that.
    reach = 0.5 * SUN / VoH
    nearest = np.cos(np.maximum(np.arccos(np.clip(NoH, 0.0, 1.0)) - reach, 0.0))
    a2 = roughness**4
    # Masking with the viewer at the horizon.
    masking = 0.5 / (NoL * np.sqrt(1e-8 * (1.0 - a2) + a2) + 1e-4 * np.sqrt(NoL**2 * (1 - a2) + a2))
    highest = (reference.ggx(nearest, roughness**2) * masking)[leaning]
    assert np.all(got <= 1.1 * highest)
