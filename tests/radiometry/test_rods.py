"""Highlights on rods: their normals turn in one direction alone, where balls' turn in both."""

from __future__ import annotations

import moderngl
import numpy as np
import pytest

from simgl.scenario.scenario import Scenario
from simgl.simulator import Simulator
from tests.gpu.glsl_functions import evaluate
from tests.radiometry.far_bodies import FOCAL_PX, light, place
from tests.reference.brdf import disc_mean_brdf
from tests.reference.highlights import SUN
from tests.scenes import IN_BANDS, scene

LENGTH_PX, DISTANCE = 12, 1000.0


def rod(
    width_px: float, roughness: float, phase: float, at_px: tuple[float, float], roll: float
) -> Scenario:
    """A polished metal rod square to the plane of Sun and camera, which is rolled against it."""
    size = DISTANCE / FOCAL_PX
    material = {"reflectance": 0.9, "metallic": 1.0, "roughness": roughness}
    model = {"radius_m": 0.5 * width_px * size, "length_m": LENGTH_PX * size, "material": material}
    upright = [np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5)]
    body = {
        "model": {"cylinder": model},
        "position_icrf_m": place(at_px[0], at_px[1], DISTANCE).tolist(),
        "quaternion_icrf_from_body_xyzw": upright,
    }
    camera = {
        "position_icrf_m": [0, 0, 0],
        "boresight": [0, 0, -1],
        "up": [float(np.sin(roll)), float(np.cos(roll)), 0],
        "focal_length_mm": 13.0,
        "pixel_pitch_um": 3.75,
        "width_px": 48,
        "height_px": 48,
    }
    return scene(
        {"rod": body},
        camera,
        sun_direction=(float(np.sin(phase)), 0.0, float(np.cos(phase))),
        sun={"angular_diameter_deg": float(np.degrees(2.0 * SUN)), "limb_darkening": False},
        render={"inter_reflection": False},
    )


def light_of_rod(roughness: float, phase: float) -> float:
    """Sum over the pixels of a rod one pixel wide, by quadrature over its normals and the disc."""
    wide, near = np.linspace(-0.5 * np.pi, 0.5 * np.pi, 1001), 0.5 * phase
    turn = np.unique(np.concatenate([wide[1:-1], near + np.linspace(-0.2, 0.2, 1001)]))
    n = np.stack([np.sin(turn), 0.0 * turn, np.cos(turn)], axis=1)
    wi = np.tile([np.sin(phase), 0.0, np.cos(phase)], (len(n), 1))
    lit = np.sum(n * wi, axis=1) > 0.0
    lit &= np.abs(turn) < 0.5 * np.pi
    total = 0.0
    for row in np.arange(LENGTH_PX // 2) + 0.5:
        wo = np.array([0.0, row / FOCAL_PX, 1.0]) / np.hypot(row / FOCAL_PX, 1.0)
        f = disc_mean_brdf(0.9, 1.0, roughness, n[lit], wi[lit], np.tile(wo, (lit.sum(), 1)), SUN)
        seen = f * np.sum(n * wi, axis=1)[lit]
        total += 2.0 * float(np.trapezoid(seen, 0.5 * np.sin(turn[lit])))
    return IN_BANDS * total


@pytest.mark.parametrize("phase_deg", [20.0, 140.0])
@pytest.mark.parametrize("roughness", [0.02, 0.15])
def test_a_rods_highlight_has_its_light(
    gl: moderngl.Context, roughness: float, phase_deg: float
) -> None:
    """Lobes as wide as the turn of the normals from point to point ripple by 1.2 %; a rod of 3 px
    has a dozen points across, at the middles of their samples, a fifth of a cell from even ones."""
    phase = np.radians(phase_deg)
    expected = light_of_rod(roughness, phase)
    for width in (3.0, 12.0):
        shares = []
        for at_px, roll in (((0.3, -0.3), 0.0), ((-0.1, 0.4), 0.0), ((0.3, 0.1), 0.4)):
            scenario = rod(width, roughness, phase, at_px, roll)
            with Simulator(scenario, gl) as simulator:
                shares.append(light(simulator, scenario).sum() / (width * expected))
        np.testing.assert_allclose(shares, 1.0, atol=0.1)
        assert np.mean(shares) == pytest.approx(1.0, abs=0.04)


def test_a_lobe_that_is_longer_in_one_direction_agrees_with_quadrature_over_the_disc(
    gl: moderngl.Context,
) -> None:
    """GGX with a width along an axis and another across it, its mean over the half vectors of a
    disc: by 20,000 directions to 0.3 %."""
    rng = np.random.default_rng(1)
    rows, expected = [], []
    count = np.arange(20_000) + 0.5
    radius, turn = SUN * np.sqrt(count / len(count)), np.pi * (1.0 + np.sqrt(5.0)) * count
    for _ in range(300):
        along = 10.0 ** rng.uniform(-2.0, -0.35)
        across = min(along, 10.0 ** rng.uniform(-2.6, -0.35))
        half, angle = np.radians(rng.uniform(1.0, 55.0)), rng.uniform(0.0, 2.0 * np.pi)
        wi = np.array([np.sin(half), 0.0, np.cos(half)])
        wo = wi * [-1.0, 1.0, 1.0]
        axes = np.array([[np.cos(angle), np.sin(angle), 0], [-np.sin(angle), np.cos(angle), 0]])
        n = [0.0, 0.0, 1.0] + rng.normal(size=2) * np.hypot([along, across], SUN / 2) @ axes
        n /= np.linalg.norm(n)
        axis = axes[0] - n * (n @ axes[0])
        axis /= np.linalg.norm(axis)
        if min(n @ wi, n @ wo) < 0.1:
            continue
        e = np.array([0.0, 1.0, 0.0])
        around = np.cos(turn)[:, None] * e + np.sin(turn)[:, None] * np.cross(wi, e)
        h = wi * np.cos(radius)[:, None] + np.sin(radius)[:, None] * around + wo
        h /= np.linalg.norm(h, axis=1, keepdims=True)
        slopes = np.stack([h @ axis, h @ np.cross(n, axis)]) / (h @ n) / [[along], [across]]
        density = (1.0 + np.sum(slopes**2, axis=0)) ** -2 / (np.pi * along * across * (h @ n) ** 4)
        rows.append(np.concatenate([[along**2, across**2], n, axis, wi, wo]))
        expected.append(density.mean())
    normal, turn_axis, to_sun, to_eye = (
        f"vec3(in_value[{k}], in_value[{k + 1}], in_value[{k + 2}])" for k in (2, 5, 8, 11)
    )
    width = f"uneven_width(in_value[0], in_value[1], {turn_axis})"
    half_way = f"normalize({to_sun} + {to_eye})"
    cosine = f"dot({to_eye}, {half_way})"
    image = f"disc_image({normal}, {half_way}, {to_eye}, {cosine}, {width}, {SUN:.9g})"
    call = f"vec4(D_ggx_disc({image}, {width}.alpha))"
    got = evaluate(gl, ["surface/brdf.glsl"], call, np.array(rows, dtype=np.float32))[:, 0]
    np.testing.assert_allclose(got, expected, rtol=0.01)
    assert np.sqrt(np.mean((got / expected - 1.0) ** 2)) < 0.003
