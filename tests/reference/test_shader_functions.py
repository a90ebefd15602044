"""Shader functions against their numpy references, over grids."""

from __future__ import annotations

import moderngl
import numpy as np
import pytest

from simgl.reference import brdf as reference
from simgl.reference.noise import gaussian, philox, uniform_01
from tests.gpu.glsl_functions import evaluate

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


def test_gaussian_agrees(gl: moderngl.Context) -> None:
    words = np.random.default_rng(4).integers(0, 2**32, (4000, 2), dtype=np.uint32)
    got = evaluate(
        gl,
        ["common/philox.glsl"],
        "vec4(gaussian(uvec2(in_value[0], in_value[1])), uniform_01(in_value[0]), 0, 0)",
        words,
    )
    # float32 log, sqrt and cos of an angle up to 2 pi: some 1e-6 of values up to 5.8.
    np.testing.assert_allclose(got[:, 0], gaussian(words), atol=2e-5)
    np.testing.assert_array_equal(got[:, 1], uniform_01(words[:, 0]).astype(np.float32))


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
    call = f"brdf(vec4(0.6, 0.2, 0.9, 0.0), {metallic}, {roughness**2}, {vectors})"
    got = evaluate(gl, ["surface/brdf.glsl"], call, inputs)
    n = np.array([[0.0, 0.0, 1.0]])
    for band, rho in enumerate((0.6, 0.2, 0.9, 0.0)):
        expected = reference.brdf(rho, metallic, roughness, n, wi, wo)
        # float32 through some 30 operations; the distribution's denominator loses up to 1/alpha^2
        # of that at its peak: 6e-8 x 10 / 0.09^2 = 7e-5
        np.testing.assert_allclose(got[:, band], expected, rtol=1e-4, atol=1e-7)


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
