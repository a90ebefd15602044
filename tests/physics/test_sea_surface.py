"""What waves mirror of the sky."""

from __future__ import annotations

import numpy as np
import pytest

from simgl.physics.sea_surface import SCHLICK, fresnel, mirror_laws, mirrored, wave_slope_variance


def test_a_calm_sea_mirrors_by_fresnels_law_at_the_mirror_place() -> None:
    for cosine in (0.3, 0.7, 0.95):
        share, height, spread = mirrored(1e-6, cosine)
        assert share == pytest.approx(float(fresnel(np.array(cosine))), rel=1e-3)
        assert height == pytest.approx(cosine, rel=1e-3)
        assert spread < 3e-3


def test_waves_make_the_far_sea_darker_and_mirror_a_higher_sky() -> None:
    """A grazing ray meets the near sides of waves: 0.4 at 7 m/s, from 15 deg up (Cox and Munk)."""
    share, height, _ = mirrored(wave_slope_variance(7.0), 0.01)
    assert 0.35 < share < 0.45
    assert 0.2 < height < 0.3


@pytest.mark.parametrize("wind", [1.0, 3.0, 7.0, 12.0, 30.0])
def test_the_shaders_cubics_keep_to_the_waves(wind: float) -> None:
    variance = wave_slope_variance(wind)
    laws = mirror_laws(variance)
    for angle in (0.5, 5.0, 10.0, 20.0, 30.0, 45.0, 80.0):
        cosine = float(np.sin(np.radians(angle)))
        share, height, spread = mirrored(variance, cosine)
        off, mean, width = laws @ cosine ** np.arange(4)
        # Cubics have four numbers: 6 % of the reflectance, and a degree of height.
        assert SCHLICK + (1.0 - SCHLICK) * (1.0 - off) ** 5 == pytest.approx(share, rel=0.06)
        assert mean == pytest.approx(height, abs=0.02)
        assert width == pytest.approx(spread, abs=0.02)
