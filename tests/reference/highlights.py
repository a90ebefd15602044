"""Highlights of the Sun's disc on spheres: the shader's, and quadrature over the disc."""

from __future__ import annotations

import moderngl
import numpy as np

from simgl.arrays import Array
from tests.gpu.glsl_functions import evaluate
from tests.reference import brdf as reference

# Angular radius [rad].
SUN = np.radians(0.263)


LIMB = (0.47, 0.23)  # green (simgl.physics.solar_disc)


def highlight(
    gl: moderngl.Context, roughness: float, phase: float, limb: tuple[float, float]
) -> tuple[Array, Array, Array]:
    """Profiles of the Sun's highlight on a sphere, in the plane of light and viewer and across it.

    returns : (41,) angles from the half vector in units of the highlight's width; (2, 41) f times
        the cosine by the shader, and by quadrature
    """
    half = np.radians(0.5 * phase)
    # The Sun's image among normals is as wide in the plane, and 1 / cos(half) times across.
    steps = np.linspace(-2.0, 2.0, 41)
    wi = np.array([-np.sin(half), 0.0, np.cos(half)])
    wo = np.array([np.sin(half), 0.0, np.cos(half)])
    got, expected = [], []
    for stretch, axis in ((1.0, 0), (1.0 / np.cos(half), 1)):
        width = np.hypot(roughness**2, 0.5 * SUN * stretch)
        # Not past grazing light.
        angle = steps * min(width, 0.4 * (0.5 * np.pi - half))
        n = np.zeros((len(angle), 3))
        n[:, axis], n[:, 2] = np.sin(angle), np.cos(angle)
        wis, wos = np.tile(wi, (len(n), 1)), np.tile(wo, (len(n), 1))
        cosine = np.sum(n * wi, axis=1)
        normal, light, eye = (
            f"vec3(in_value[{k}], in_value[{k + 1}], in_value[{k + 2}])" for k in (0, 3, 6)
        )
        disc = f"Disc({light}, {SUN:.9g}, vec4({limb[0]}), vec4({limb[1]}))"
        law = f"vec4(0.9), 1.0, round_width({roughness**2:.9g}), vec4(1.0)"
        call = f"brdf({law}, {normal}, {disc}, {eye})"
        inputs = np.concatenate([n, wis, wos], axis=1).astype(np.float32)
        got.append(evaluate(gl, ["surface/brdf.glsl"], call, inputs)[:, 0] * cosine)
        truth = reference.disc_mean_brdf(0.9, 1.0, roughness, n, wis, wos, SUN, limb)
        expected.append(truth * cosine)
    return steps, np.array(got), np.array(expected)


def width_at_half(x: Array, y: Array) -> float:
    """Of what is at least half as high as the peak, linear between points."""
    level, peak = 0.5 * y.max(), int(np.argmax(y))
    left = np.interp(level, y[: peak + 1], x[: peak + 1])
    right = np.interp(-level, -y[peak:], x[peak:])
    return float(right - left)
