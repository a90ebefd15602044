"""Directional albedos: quadrature, the shader's table and polynomial, and the white furnace."""

from __future__ import annotations

import moderngl
import numpy as np
import pytest

from simgl.passes.albedo_table import lobe_texture
from simgl.physics.directional_albedo import lobe_albedo, lobe_table, seen_lobe
from tests.gpu.glsl_functions import evaluate
from tests.reference.brdf import base_loss, brdf

COSINES = np.array([0.05, 0.1, 0.2, 0.35, 0.5, 0.7, 0.9, 1.0])


def hemisphere(cosine: float, alpha: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Lights (k, 3) over the hemisphere with weights cos d(solid angle), and the viewer (1, 3).

    Polar angles about the mirror direction, in steps that grow with the distance from it in units
    of the lobe's width; lights below the horizon get no weight.
    """
    sine = np.sqrt(1.0 - cosine**2)
    mirror, viewer = np.array([-sine, 0.0, cosine]), np.array([[sine, 0.0, cosine]])
    # theta = 3 alpha sinh(t): even steps in t.
    end = np.arcsinh(np.pi / (3.0 * alpha))
    t = (np.arange(1500) + 0.5) / 1500 * end
    theta, step = 3.0 * alpha * np.sinh(t), 3.0 * alpha * np.cosh(t) * end / 1500
    turn = 2.0 * np.pi * (np.arange(240) + 0.5) / 240
    x = np.array([mirror[2], 0.0, -mirror[0]])
    y = np.array([0.0, 1.0, 0.0])
    ring = np.cos(turn)[:, None] * x + np.sin(turn)[:, None] * y
    lights = np.cos(theta)[:, None, None] * mirror + np.sin(theta)[:, None, None] * ring
    weights = (np.sin(theta) * step)[:, None] * np.full(240, 2.0 * np.pi / 240) * lights[..., 2]
    above = lights[..., 2] > 0.0
    return lights[above], weights[above], viewer


@pytest.mark.parametrize("roughness", [0.1, 0.3, 0.5, 0.8, 1.0])
@pytest.mark.parametrize("cosine", [0.1, 0.5, 1.0])
def test_the_lobes_albedo_is_the_integral_of_its_reflection(
    roughness: float, cosine: float
) -> None:
    lights, weights, viewer = hemisphere(cosine, roughness**2)
    n = np.array([[0.0, 0.0, 1.0]])
    white, half = (
        float(np.sum(weights * brdf(f0, 1.0, roughness, n, lights, viewer))) for f0 in (1.0, 0.5)
    )
    a, b = lobe_albedo(np.array([cosine]), np.array([roughness**2]))
    # The 32 x 32 nodes are good to 0.002, the hemisphere's 360,000 to better than that.
    np.testing.assert_allclose([a[0] + b[0], 0.5 * a[0] + b[0]], [white, half], atol=3e-3)


def test_the_shaders_table_gives_the_lobes_albedo(gl: moderngl.Context) -> None:
    roughness = np.array([0.05, 0.123, 0.3, 0.5, 0.777, 1.0])
    c, r = (v.ravel() for v in np.meshgrid(COSINES, roughness))
    table = lobe_texture(gl)
    inputs = np.stack([c, r**2], axis=1).astype(np.float32)
    call = "lobe_albedo(vec4(1.0, 0.5, 0.04, 0.0), in_value[0], in_value[1])"
    textures = {"lobe_table": table}
    got = evaluate(gl, ["surface/albedo.glsl"], call, inputs, textures=textures)
    table.release()
    a, b = lobe_albedo(c, r**2, order=200)
    expected = np.stack([a * f0 + b for f0 in (1.0, 0.5, 0.04, 0.0)], axis=1)
    # 0.002 of the table's quadrature, 0.002 of the interpolation.
    np.testing.assert_allclose(got, expected, atol=4e-3)


def test_the_shaders_polynomial_gives_the_bases_loss(gl: moderngl.Context) -> None:
    cosine = np.linspace(0.01, 1.0, 100)
    inputs = cosine.astype(np.float32)[:, None]
    got = evaluate(gl, ["surface/albedo.glsl"], "vec4(base_share(in_value[0]))", inputs)
    # The least-squares polynomial of degree 4 leaves 5e-6, the quadrature's 160,000 nodes 1e-6.
    np.testing.assert_allclose(1.0 - got[:, 0], base_loss(cosine), atol=1e-5)


def test_a_smooth_lobe_loses_nothing() -> None:
    # Roughness 0.02 and less: rows 0 of the table. (1 - 0.02^4) and Schlick's term at grazing.
    np.testing.assert_allclose(lobe_table()[0, 8:, :2].sum(axis=1), 1.0, atol=1e-4)


def test_a_narrow_lobe_sees_the_mirror_direction_and_the_widest_the_sky() -> None:
    cosine = np.linspace(0.1, 0.99, 12)
    sine, roughness = seen_lobe(cosine, np.full(12, 0.01))
    # It leaves the mirror direction by the square of the width over the cosine's.
    np.testing.assert_allclose(sine, 1.0, atol=2e-3)
    assert np.all(roughness < 0.115)
    # At normal incidence it is the lobe that is prefiltered, but for that one's cosine.
    _, straight = seen_lobe(np.array([1.0 - 1e-6]), np.array([0.04]))
    assert straight[0] == pytest.approx(0.2, rel=0.05)
    sine, roughness = seen_lobe(cosine, np.full(12, 1.0))
    np.testing.assert_allclose(sine, 0.0, atol=0.1)
    assert np.all(roughness > 0.95)
