"""Highlights in the picture: the Sun's disc reaches the reflection law."""

from __future__ import annotations

import moderngl
import numpy as np

from tests.reference.brdf import brdf, disc_mean_brdf
from tests.scenes import radiance, scene

GREEN = 174.7738123  # [W m-2] of the Sun in 500-600 nm


def test_a_smooth_plate_at_the_mirror_angle_shows_the_suns_disc_blurred(
    gl: moderngl.Context,
) -> None:
    """A metal of roughness 0.05 at 30 deg, where a point Sun would be half as bright again."""
    metal = {"reflectance": 0.9, "metallic": 1.0, "roughness": 0.05}
    t = np.radians(30.0)
    wi, wo = np.array([[-np.sin(t), 0.0, np.cos(t)]]), np.array([[np.sin(t), 0.0, np.cos(t)]])
    scenario = scene(
        {
            "plate": {
                "model": {"plate": {"width_m": 4.0, "height_m": 4.0, "material": metal}},
                "position_icrf_m": [0, 0, 0],
            }
        },
        {
            "position_icrf_m": (50.0 * wo[0]).tolist(),
            "look_at": "plate",
            "width_px": 129,
            "height_px": 129,
        },
        sun_direction=tuple(wi[0].tolist()),
    )
    seen = radiance(gl, scenario)[64, 64, 1]
    n = np.array([[0.0, 0.0, 1.0]])
    light = GREEN * np.cos(t)
    expected = disc_mean_brdf(0.9, 1.0, 0.05, n, wi, wo, np.radians(0.263))[0] * light
    # The closed form is good to 0.7 % of the peak at 30 deg.
    np.testing.assert_allclose(seen, expected, rtol=0.01)
    assert brdf(0.9, 1.0, 0.05, n, wi, wo)[0] * light > 1.4 * seen
